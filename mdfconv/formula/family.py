"""The family of formulas: powers of a polynomial or rational function in a natural variable.

    t = (wᶠ P(wᵏ) / Q(wᵏ))ᵉ

w is what the source stores, or 1 − it for a glossiness, and t the same of the target. Lobes are
similar to each other, so that a good exponent e and a good factor wᶠ leave P and Q little to do.
What is stored is first clamped to the range: outside, a formula may be 0, infinite or no number.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from mdfconv.distributions.evaluation import Array
from mdfconv.fitting.maps import horner

# The price of ÷, √ and 1/√ against that of +, − and ×, as on graphics processors.
SLOW = 4
# A clamp is a minimum and a maximum, each as cheap as +.
CLAMP = 2
# Prices of raising to these powers.
POWERS = {-2.0: SLOW + 1, -1.0: SLOW, -0.5: SLOW, 0.0: 0, 0.5: SLOW, 1.0: 0, 2.0: 1, 4.0: 2}
# What lobes ask for: α, its square and its fourth power (an exponent of a roughness), a root (a
# roughness of α), an inverse (α² of an exponent).
_VARIABLES = (1.0, 2.0, 4.0, 0.5, -1.0)
_FACTORS = (0.0, 1.0, 2.0, -1.0, -2.0, 0.5)
# A fourth root is the root of a root.
_OUTER = {1.0: 0, 2.0: 1, 0.5: SLOW, -0.5: SLOW, -1.0: SLOW, 0.25: 2 * SLOW, -0.25: 2 * SLOW}
# With more coefficients the rounding of float32 takes what they add.
_MOST_TERMS = 8
_MOST_RATIONAL_TERMS = 4


@dataclass(frozen=True)
class Shape:
    """The form of a formula, without its coefficients.

    Parameters
    ----------
    variable, factor, outer : float
        The exponents k, f and e.
    numerator, denominator : int
        The numbers of coefficients of P and of Q; Q = 1 has none, any other starts with 1.
    """

    variable: float
    factor: float
    outer: float
    numerator: int
    denominator: int = 0

    @property
    def has_terms(self) -> bool:
        """Whether P or Q depends on the variable."""
        return self.numerator > 1 or self.denominator > 0

    @property
    def is_constant(self) -> bool:
        """Whether t is one number for every w, so that there is nothing to clamp."""
        return not (self.has_terms or self.factor)

    @property
    def shares_factor(self) -> bool:
        """Whether the factor wᶠ is the variable wᵏ of P and Q, which the code has already."""
        return self.has_terms and self.factor == self.variable

    @property
    def operations(self) -> int:
        """The price: + − × count 1 each, the clamp of the input 2, ÷ √ 1/√ count 4 each."""
        steps = self.numerator - 1 + self.denominator
        price = 2 * steps + _OUTER[self.outer]
        price += 0 if self.is_constant else CLAMP
        price += SLOW if self.denominator else 0
        price += POWERS[self.variable] if self.has_terms else 0
        if self.factor:
            price += 1 + (0 if self.shares_factor else POWERS[self.factor])
        return price


def shapes() -> Iterator[Shape]:
    """Yield every shape of the family, the cheapest first."""
    family = {
        Shape(variable, factor, outer, numerator, denominator)
        for variable in _VARIABLES
        for factor in _FACTORS
        for outer in _OUTER
        for numerator, denominator in _sizes()
        # A constant has no variable; 1 stands for all of them.
        if numerator + denominator > 1 or variable == 1.0
    }
    key = lambda s: (s.operations, s.denominator, s.outer, s.factor, s.variable)  # noqa: E731
    return iter(sorted(family, key=key))


def _sizes() -> list[tuple[int, int]]:
    polynomials = [(terms, 0) for terms in range(1, _MOST_TERMS + 1)]
    few = range(1, _MOST_RATIONAL_TERMS + 1)
    return polynomials + [(up, down) for up in few for down in few if abs(up - 1 - down) <= 1]


@dataclass(frozen=True)
class Formula:
    """A formula of the family, in single precision.

    Parameters
    ----------
    shape : Shape
        Its form.
    numerator, denominator : tuple of float
        Coefficients of P and Q, constant first; those of Q start after its 1.
    error : float
        The worst relative error over the range, evaluated in float32.
    """

    shape: Shape
    numerator: tuple[float, ...]
    denominator: tuple[float, ...]
    error: float = float("nan")


def power(base: Array, exponent: float) -> Array:
    """Return base to one of the family's powers, in its type and by the steps of the code."""
    if exponent == 0:
        return np.ones_like(base)
    if exponent < 0:
        return 1 / power(base, -exponent)
    if exponent < 1:
        return power(np.sqrt(base), 2 * exponent)
    for _ in range(round(np.log2(exponent))):
        base = base * base
    return base


def evaluate(
    formula: Formula,
    w: Any,
    power: Callable[[Any, float], Any] = power,
    named: Callable[[Any, str], Any] = lambda value, name: value,
) -> Any:
    """Return t for w, in the type of w and by the steps of the code that is emitted.

    An expression w makes that of t, with its own `power` and with names for its parts.
    """
    shape = formula.shape
    with np.errstate(all="ignore"):
        u = w if shape.variable == 1 else named(power(w, shape.variable), "u")
        value = horner(np.array(formula.numerator), u)
        if shape.factor:
            value = (u if shape.shares_factor else power(w, shape.factor)) * value
        if formula.denominator:
            value = value / horner(np.array([1.0, *formula.denominator]), u)
        return value if shape.outer == 1 else power(named(value, "v"), shape.outer)
