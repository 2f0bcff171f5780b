"""Elementary functions of arrays, from products, sums and one division.

NumPy computes those with vector instructions on every processor. Its tan, log1p and expm1, and its
exp in float64, go value by value unless the processor has AVX-512. Arrays are float32 or float64
and have at least one dimension; results have their type.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np

from mdfconv.distributions.coefficients import FLOAT32, FLOAT64, Coefficients
from mdfconv.distributions.evaluation import Array, Mask

_LOG2_E = 1.4426950408889634
# A result below the smallest normal number is computed so many octaves higher, and scaled down.
_LIFT = 64


class _Type:
    """The constants of a floating-point type, as arrays without dimensions.

    With those an operation starts sooner than with Python's numbers, by a microsecond.
    """

    def __init__(self, dtype: type[Any], integer: type[Any], coefficients: Coefficients) -> None:
        limits = np.finfo(dtype)
        rounded = partial(np.array, dtype=dtype)
        self.integer = integer
        self.tangent, self.exponential, (self.versine,), (self.sine,) = (
            tuple([rounded(one) for one in part] for part in parts) for parts in coefficients[1:]
        )
        self.half_pi, self.half_pi_rest = map(rounded, coefficients.half_pi)
        self.pi = 2 * self.half_pi
        self.one, self.two, self.near = map(rounded, (1, 2, 0.75))
        # Below it results are subnormal; bits of the mantissa.
        self.lowest, self.shift = int(limits.minexp), np.array(limits.nmant, integer)
        # Added to a small number it leaves the nearest integer in the last bits, as the exponent
        # of a number is stored.
        self.to_exponent = rounded(1.5 * 2.0**limits.nmant + 1 - self.lowest)
        self.lift = rounded(_LIFT)
        self.down = rounded(2.0**-_LIFT)


_TYPES = {
    np.dtype(np.float32): _Type(np.float32, np.int32, FLOAT32),
    np.dtype(np.float64): _Type(np.float64, np.int64, FLOAT64),
}


def tangent_square(beta: Array, square: Array) -> Array:
    """Return tan²β for β in [−π/2, π/2], radians, and β².

    The error is within 12 units in the last place, and within 2 up to 0.3. The form is
    β² (1 + β² R(β²)/((π/2 − β)(π/2 + β)))², R a rational function: the pole is divided out, and the
    next one is at 3π/2.
    """
    constants = _TYPES[beta.dtype]
    numerator, denominator = constants.tangent
    tangent = _polynomial(numerator, square)
    tangent *= square
    below = _polynomial(denominator, square)
    to_pole = np.abs(beta)
    np.subtract(constants.half_pi, to_pole, out=to_pole)
    tangent /= below
    np.subtract(constants.pi, to_pole, out=below)
    # The rest of π/2, so that it has all its digits.
    to_pole += constants.half_pi_rest
    below *= to_pole
    tangent /= below
    tangent *= beta
    tangent += beta
    return np.square(tangent, out=tangent)


def sine_square(square: Array) -> Array:
    """Return sin²β for β² up to π²/4, within 4 units in the last place."""
    value = versine(square)
    rest = _TYPES[square.dtype].two - value
    value *= rest
    return value


def versine(square: Array) -> Array:
    """Return 1 − cos β for β² up to π²/4: within 2 units in the last place."""
    value = _polynomial(_TYPES[square.dtype].versine, square)
    value *= square
    return value


def cosine(beta: Array, versine: Array) -> tuple[Array, Mask]:
    """Return |cos β| for β in [−π/2, π/2], radians, and 1 − cos β; and where it is less than ¼.

    There 1 less 1 − cos β has lost digits, and it is the sine of what is left to π/2. The error is
    within 6 units in the last place.
    """
    constants = _TYPES[beta.dtype]
    near = versine > constants.near
    to_horizon = np.abs(beta)
    np.subtract(constants.half_pi, to_horizon, out=to_horizon)
    to_horizon += constants.half_pi_rest
    # float32's π/2 is beyond π/2: the mirrored angle counts.
    np.abs(to_horizon, out=to_horizon)
    to_horizon *= _polynomial(constants.sine, np.square(to_horizon))
    value = constants.one - versine
    np.copyto(value, to_horizon, where=near)
    return value, near


def minus_log_of_difference(difference: Array, one_less: Array, near: Mask | None) -> Array:
    """Return −ln d from d and 1 − d.

    Where it is `near` 0, d has all its digits; elsewhere 1 − d has. The method is that of `log1p`,
    and the error within 3 units in the last place.
    """
    lost = _TYPES[difference.dtype].one - difference
    lost -= one_less
    lost /= difference
    if near is not None:
        lost[near] = 0
    lost += np.log(difference)
    return np.negative(lost, out=lost)


def log1p(values: Array) -> Array:
    """Return ln(1 + x) for finite x ≥ 0: within 2 units in the last place.

    What the sum 1 + x has lost is added to its logarithm, to first order (after Kahan; Goldberg
    1991, theorem 4).
    """
    one = _TYPES[values.dtype].one
    above = values + one
    lost = above - one
    np.subtract(values, lost, out=lost)
    lost /= above
    np.log(above, out=above)
    above += lost
    return above


def exp_of_product(values: Array, factor: Any, out: Array | None = None) -> Array:
    """Return e^(x y) for x y ≤ 0.

    The error is 2 units in the last place, and what the rounding of the product adds. That is
    relative: where x y is −700 it adds up to 700 units.

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
    to_exponent = constants.to_exponent
    is_deep = not octaves.min(initial=0) > constants.lowest
    if is_deep:
        np.maximum(octaves, constants.lowest - _LIFT + 1, out=octaves)
        to_exponent = to_exponent + constants.lift
    power = _split(octaves, constants, to_exponent)
    above, product = _half_tangent(octaves, constants)
    np.add(above, product, out=octaves)
    above -= product
    octaves /= above
    octaves *= power
    if is_deep:
        octaves *= constants.down
    return octaves


def one_minus_exp_of_product(values: Array, factor: Any) -> Array:
    """Return 1 − e^(x y) for x y ≤ 0, within 4 units in the last place.

    The arguments are those of `exp_of_product`.
    """
    constants = _TYPES[values.dtype]
    octaves = values * (factor * _LOG2_E)
    # From here on it is 1.
    np.maximum(octaves, -64, out=octaves)
    power = _split(octaves, constants, constants.to_exponent)
    above, product = _half_tangent(octaves, constants)
    above -= product
    # 1 − 2ⁿ e^r = (1 − 2ⁿ) − 2ⁿ (e^r − 1), and e^r − 1 has no difference of numbers that agree.
    product *= constants.two
    product /= above
    product *= power
    np.subtract(constants.one, power, out=power)
    power -= product
    return power


def _split(octaves: Array, constants: _Type, to_exponent: Array) -> Array:
    """Take the nearest integers n from exponents in place, and return 2ⁿ."""
    power = octaves + to_exponent
    octaves -= power - to_exponent
    bits = power.view(constants.integer)
    bits <<= constants.shift
    return power


def _half_tangent(octaves: Array, constants: _Type) -> tuple[Array, Array]:
    """Return A(f²) and f B(f²) for which 2^f = (A + f B)/(A − f B), |f| ≤ ½."""
    numerator, denominator = constants.exponential
    square = np.square(octaves)
    product = _polynomial(denominator, square)
    product *= octaves
    return _polynomial(numerator, square), product


def _polynomial(coefficients: Sequence[Array], x: Array) -> Array:
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
