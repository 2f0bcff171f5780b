"""Elementary functions of arrays, from products, sums and one division.

NumPy computes those with vector instructions on every processor. Its tan, log1p and expm1, and its
exp in float64, go value by value unless the processor has AVX-512. Arrays are float32 or float64
and have at least one dimension; results have their type.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from mdfconv.distributions.coefficients import FLOAT32, FLOAT64, Coefficients
from mdfconv.distributions.evaluation import Array

_LOG2_E = 1.4426950408889634
# A result below the smallest normal number is computed so many octaves higher, and scaled down.
_LIFT = 64


class _Type:
    """The constants of a floating-point type; `shift` are the bits of its mantissa."""

    def __init__(self, dtype: type[Any], integer: type[Any], coefficients: Coefficients) -> None:
        limits = np.finfo(dtype)
        self.coefficients, self.integer = coefficients, integer
        self.shift, self.lowest = int(limits.nmant), int(limits.minexp)
        # Added to a small number it leaves the nearest integer in the last bits, as the exponent
        # of a number is stored.
        self.to_exponent = 1.5 * 2.0**self.shift + 1 - self.lowest


_TYPES = {
    np.dtype(np.float32): _Type(np.float32, np.int32, FLOAT32),
    np.dtype(np.float64): _Type(np.float64, np.int64, FLOAT64),
}


def tangent_square(beta: Array) -> Array:
    """Return tan²β for β in [0, π/2], radians: within 12 units in the last place, 2 up to 0.3.

    As β² (1 + β² R(β²)/((π/2 − β)(π/2 + β)))², R a rational function: the pole is divided out, and
    the next one is at 3π/2.
    """
    constants = _TYPES[beta.dtype].coefficients
    numerator, denominator = constants.tangent
    square = np.square(beta)
    tangent = _polynomial(numerator, square)
    tangent *= square
    below = _polynomial(denominator, square)
    # π/2 less β in two parts, so that it has all its digits.
    to_pole = np.subtract(constants.half_pi[0], beta, out=square)
    to_pole += constants.half_pi[1]
    below *= to_pole
    below *= np.add(beta, constants.half_pi[0], out=to_pole)
    tangent /= below
    tangent *= beta
    tangent += beta
    return np.square(tangent, out=tangent)


def versine(beta: Array) -> Array:
    """Return 1 − cos β for β in [0, π/2], radians: within 2 units in the last place."""
    square = np.square(beta)
    value = _polynomial(_TYPES[beta.dtype].coefficients.versine[0], square)
    value *= square
    return value


def log1p(values: Array) -> Array:
    """Return ln(1 + x) for finite x ≥ 0: within 2 units in the last place.

    What the sum 1 + x has lost is added to its logarithm, to first order (after Kahan; Goldberg
    1991, theorem 4).
    """
    above = 1 + values
    lost = above - 1
    np.subtract(values, lost, out=lost)
    lost /= above
    np.log(above, out=above)
    above += lost
    return above


def exp_of_product(values: Array, factor: Any, out: Array | None = None) -> Array:
    """Return e^(x y) for x y ≤ 0, within 2 units in the last place but for the product's rounding.

    The product's rounding is relative: where x y is −700 it is 700 units of the result.

    Parameters
    ----------
    values : numpy.ndarray
        x.
    factor : numpy.ndarray or float
        y, which broadcasts with x.
    out : numpy.ndarray, optional
        Where to write the result; it may be `values`.
    """
    if values.dtype == np.float32:
        # NumPy has a vector form in this type.
        product = np.multiply(values, factor, out=out)
        return np.exp(product, out=product)
    constants = _TYPES[values.dtype]
    octaves = np.multiply(values, factor * _LOG2_E, out=out)
    lift = 0
    if not octaves.min(initial=0) > constants.lowest:
        lift = _LIFT
        np.maximum(octaves, constants.lowest - lift + 1, out=octaves)
    power = _split(octaves, constants, lift)
    above, product = _half_tangent(octaves, constants)
    np.add(above, product, out=octaves)
    above -= product
    octaves /= above
    octaves *= power
    if lift:
        octaves *= 2.0**-lift
    return octaves


def one_minus_exp_of_product(values: Array, factor: Any) -> Array:
    """Return 1 − e^(x y) for x y ≤ 0, within 4 units in the last place.

    The arguments are those of `exp_of_product`.
    """
    constants = _TYPES[values.dtype]
    octaves = values * (factor * _LOG2_E)
    # From here on it is 1.
    np.maximum(octaves, -64, out=octaves)
    power = _split(octaves, constants)
    above, product = _half_tangent(octaves, constants)
    above -= product
    # 1 − 2ⁿ e^r = (1 − 2ⁿ) − 2ⁿ (e^r − 1), and e^r − 1 has no difference of numbers that agree.
    product *= 2
    product /= above
    product *= power
    np.subtract(1, power, out=power)
    power -= product
    return power


def _split(octaves: Array, constants: _Type, lift: int = 0) -> Array:
    """Take the nearest integers n from exponents in place, and return 2^(n + lift)."""
    to_exponent = constants.to_exponent + lift
    power = octaves + to_exponent
    octaves -= power - to_exponent
    bits = power.view(constants.integer)
    bits <<= constants.shift
    return power


def _half_tangent(octaves: Array, constants: _Type) -> tuple[Array, Array]:
    """Return A(f²) and f B(f²) for which 2^f = (A + f B)/(A − f B), |f| ≤ ½."""
    numerator, denominator = constants.coefficients.exponential
    square = np.square(octaves)
    product = _polynomial(denominator, square)
    product *= octaves
    return _polynomial(numerator, square), product


def _polynomial(coefficients: Sequence[float], x: Array) -> Array:
    """Return a polynomial of at least degree 1; the coefficients begin with the highest power."""
    first, second, *rest = coefficients
    if first == 1:
        value = x + second
    else:
        value = x * first
        value += second
    for coefficient in rest:
        value *= x
        value += coefficient
    return value
