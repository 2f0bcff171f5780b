"""Parameters, their legal ranges, and the encodings in which they are stored."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mdfconv.distributions.evaluation import Array, Mask, as_operand
from mdfconv.errors import MdfconvError


def number_text(value: float) -> str:
    """Return a number as mdfconv writes it in messages: ten significant digits."""
    return f"{value:.10g}"


def percent_hint(text: str, separator: str = ",") -> str:
    """Return what is meant by a number of percent, or several of such; "" for other words."""
    parts = [part.strip() for part in text.split(separator)]
    try:
        numbers = [float(part.removesuffix("%")) for part in parts]
    except ValueError:
        return ""
    if not any(part.endswith("%") for part in parts) or not np.isfinite(numbers).all():
        return ""
    percent = [100 if part.endswith("%") else 1 for part in parts]
    shares = (number / by for number, by in zip(numbers, percent, strict=True))
    return f"did you mean {separator.join(map(number_text, shares))}?"


@dataclass(frozen=True)
class Parameter:
    """One scalar parameter: its name, symbol and ranges.

    Parameters
    ----------
    name : str
        The field's name for it, such as ``"roughness"`` or ``"exponent"``.
    symbol : str
        The symbol in the source, such as ``"m_B"``.
    typical : tuple of two floats
        The range in which scenes use it, on which every distribution has an answer.
    lower, upper : float
        The legal range. It is closed where `lower_closed` and `upper_closed` say so.
    larger_is_smoother : bool
        Whether a larger value is a smoother surface, as of an exponent or a glossiness.
    default : float
        The value where none is given: of a second parameter.
    fit_range : tuple of two floats
        The range in which a fit looks for it where it is free: of a second parameter.
    """

    name: str
    symbol: str
    typical: tuple[float, float]
    lower: float = 0.0
    upper: float = float("inf")
    lower_closed: bool = False
    upper_closed: bool = False
    larger_is_smoother: bool = False
    default: float = float("nan")
    fit_range: tuple[float, float] = (float("nan"), float("nan"))

    @property
    def legal(self) -> str:
        """The legal range in words, such as ``"0 < α ≤ 1"``."""
        above = "≤" if self.lower_closed else "<"
        below = "≤" if self.upper_closed else "<"
        lower, upper = number_text(self.lower), number_text(self.upper)
        if self.upper == float("inf"):
            return f"{self.symbol} {'≥' if self.lower_closed else '>'} {lower}"
        return f"{lower} {above} {self.symbol} {below} {upper}"

    @property
    def typical_value(self) -> float:
        """The geometric mean of the typical range."""
        return float(np.sqrt(self.typical[0] * self.typical[1]))

    def accepts(self, values: Array) -> Any:
        """Return where values are finite and inside the legal range (bool, same shape)."""
        # A limit that a short type cannot hold is infinite there, which is right.
        above = np.greater_equal if self.lower_closed else np.greater
        below = np.less_equal if self.upper_closed else np.less
        with np.errstate(over="ignore"):
            return above(values, self.lower) & below(values, self.upper) & (values < np.inf)

    def only_accepted(self, values: Array) -> Array:
        """Return values, NaN where they are illegal; the array itself where all are legal."""
        # Two reductions need no memory; NaN fails both comparisons.
        if values.size and self.accepts(values.min()) and self.accepts(values.max()):
            return values
        return np.where(self.accepts(values), values, np.nan)

    def held(self, dtype: np.dtype[Any]) -> tuple[float, float]:
        """Return between which values a lobe is one in a type of floats.

        Beyond them α² underflows or the fourth power of α, which a maximum off the axis has,
        overflows; an exponent is about 2/α².
        """
        limits = np.finfo(dtype)
        if self.larger_is_smoother:
            return 0.0, float(limits.max) / 16
        return 2 * float(limits.tiny) ** 0.5, float(limits.max) ** 0.25 / 4

    def check(self, values: ArrayLike, owner: str, dtype: np.dtype[Any] | None = None) -> Any:
        """Return the values as real operands, or say which one is illegal and why.

        Parameters
        ----------
        values : array_like
            Candidate parameters.
        owner : str
            The distribution they belong to, for the message.
        dtype : numpy.dtype, optional
            The type of floats in which lobes of these parameters are evaluated.

        Raises
        ------
        MdfconvError
            If a value is not a finite number inside the legal range, or the type cannot hold
            its lobe.
        """
        operand = as_operand(values)
        array = np.asarray(operand)
        if array.size == 0:
            return operand
        # Two reductions need no memory; NaN fails both comparisons.
        low, high = array.min(), array.max()
        if self.accepts(low) and self.accepts(high):
            if dtype is not None:
                self._check_held(float(low), float(high), owner, dtype)
            return operand
        index = int(np.argmin(self.accepts(array)))
        bad = float(array.flat[index])
        what = f"{owner} {self.symbol} = {number_text(bad)}"
        which = f" (value {index + 1} of {array.size})" if array.size > 1 else ""
        wrong = "not a finite number" if not np.isfinite(bad) else "outside the legal range"
        raise MdfconvError(f"{what} is {wrong}{which}: {self.legal}")

    def _check_held(self, low: float, high: float, owner: str, dtype: np.dtype[Any]) -> None:
        smallest, largest = self.held(dtype)
        if smallest <= low and high <= largest:
            return
        bad, limit = (low, smallest) if low < smallest else (high, largest)
        # Of an α the least is the smoothest.
        smooth = (low < smallest) != self.larger_is_smoother
        why = "a mirror" if smooth else "too rough"
        raise MdfconvError(
            f"{owner} {self.symbol} = {number_text(bad)} is {why} in {dtype.name}",
            f"its lobes are {'from' if low < smallest else 'up to'} {limit:.3g}",
        )

    def check_one(self, value: float, owner: str) -> float:
        """Return a single legal value as a float, or say what is wrong with it."""
        operand = self.check(value, owner)
        if np.ndim(operand):
            raise MdfconvError(f"{owner}: {self.name} is one number, not an array")
        return float(operand)


@dataclass(frozen=True)
class Clamp:
    """A stored number that stands for all parameters beyond one.

    Parameters
    ----------
    stored : float
        The number.
    edge : float
        The number up to which the rule holds: as a rule the same.
    above : bool
        Whether the parameters are those above the limit, or those below.
    limit : float
        The parameter that the rule has for the edge.
    """

    stored: float
    edge: float
    above: bool = True
    limit: float = float("nan")

    def text(self, stored: str, parameter: str) -> str:
        """Return in words what the number stands for, such as ``"r = 0 is any N ≥ 1000"``."""
        beyond = "≥" if self.above else "≤"
        number, limit = number_text(self.stored), number_text(self.limit)
        return f"{stored} = {number} is any {parameter} {beyond} {limit}"


@dataclass(frozen=True)
class Pairing:
    """How an encoding stores both axes of an anisotropic surface: one, and how they differ.

    Parameters
    ----------
    second : Parameter
        What is stored beside the first number, such as an anisotropy.
    axes : callable
        From both numbers to what the encoding stores for each axis by itself, along x and y.
    pair : callable
        Back; NaN where there is no such pair.
    formula : str
        The relation in words.
    """

    second: Parameter
    axes: Callable[[Array, Array], tuple[Array, Array]]
    pair: Callable[[Array, Array], tuple[Array, Array]]
    formula: str


@dataclass(frozen=True)
class Encoding:
    """The form in which artists or files store a distribution's parameter.

    Parameters
    ----------
    name : str
        The word after the colon in ``ggx:roughness``.
    stored : Parameter
        Name, symbol and ranges of the stored value.
    decode, encode : callable
        Stored value to parameter, and back; elementwise on arrays.
    formula : str
        The relation in words.
    clamps : tuple of Clamp
        Stored numbers that have no inverse.
    pairing : Pairing, optional
        How it stores a pair; None for each axis by itself.
    """

    name: str
    stored: Parameter
    decode: Callable[[Array], Array]
    encode: Callable[[Array], Array]
    formula: str
    clamps: tuple[Clamp, ...] = ()
    pairing: Pairing | None = None

    def clamped(self, values: Array) -> Mask:
        """Return where stored numbers have no inverse, for they stand for many parameters."""
        which: Mask = np.isin(values, [clamp.stored for clamp in self.clamps])
        return which


ROUGHNESS = Encoding(
    "roughness",
    Parameter("roughness", "r", (0.1, 0.9), 0.0, 1.0, upper_closed=True),
    np.square,
    np.sqrt,
    "α = r²",
)
GLOSSINESS = Encoding(
    "glossiness",
    Parameter("glossiness", "g", (0.1, 0.9), 0.0, 1.0, lower_closed=True, larger_is_smoother=True),
    lambda stored: np.square(1 - stored),
    lambda alpha: 1 - np.sqrt(alpha),
    "α = (1 − g)²",
)
# Phong's own exponent n, of the angle between the reflected ray and the viewer, which at normal
# incidence is 2β: F = 1 − cos^(n+1) 2β. N = 4 n + 3 is what the fit that keeps the light of a
# natural environment tends to as n grows (N = 43.05 for n = 10; N = 4 n + 2 has the same peak), and
# leaves a relative error of 7 % at n = 1, 0.6 % at 10 and 0.04 % at 100.
REFLECTED = Encoding(
    "reflected",
    Parameter("exponent", "n", (1.0, 2500.0), 0.0, lower_closed=True, larger_is_smoother=True),
    lambda stored: 4 * stored + 3,
    lambda exponent: (exponent - 3) / 4,
    "N = 4 n + 3, of the reflected ray",
)
