"""Arithmetic on unevaluated sums of two doubles, for the one place that needs it.

The algorithms are Dekker's (1971), as collected by Hida, Li & Bailey (2001).
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np

from mdfconv.distributions.evaluation import Array

DoubleDouble: TypeAlias = tuple[Array, Array]

_SPLITTER = 134217729.0  # 2²⁷ + 1
# (π/2)^(2k)/(2k)! drops below 1e-32 at k = 18.
_COSINE_TERMS = 18


def distance_to_cosine(beta: Array, m: Array) -> Array:
    """Return m − (1 − cos β) to full relative precision, even where it nearly vanishes.

    Parameters
    ----------
    beta : numpy.ndarray
        Angles, radians, [0, π/2], float64.
    m : numpy.ndarray
        Numbers of the same shape, float64.
    """
    square = _product(beta, beta)
    # 1 − cos β = ½β² (1 − β²/12 (1 − β²/30 (1 − …))), innermost bracket first.
    bracket: DoubleDouble = (np.ones_like(beta), np.zeros_like(beta))
    for k in range(_COSINE_TERMS, 0, -1):
        term = _divide(_multiply(square, bracket), (2 * k + 1) * (2 * k + 2))
        high, low = _sum(np.ones_like(beta), -term[0])
        bracket = _sum(high, low - term[1])
    drop = _multiply(square, bracket)
    high, low = _sum(m, -0.5 * drop[0])
    return high + (low - 0.5 * drop[1])


def _sum(a: Array, b: Array) -> DoubleDouble:
    total = a + b
    virtual = total - a
    return total, (a - (total - virtual)) + (b - virtual)


def _product(a: Array, b: Array) -> DoubleDouble:
    product = a * b
    a_high, a_low = _split(a)
    b_high, b_low = _split(b)
    return product, ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low


def _split(a: Array) -> DoubleDouble:
    scaled = _SPLITTER * a
    high = scaled - (scaled - a)
    return high, a - high


def _multiply(a: DoubleDouble, b: DoubleDouble) -> DoubleDouble:
    high, low = _product(a[0], b[0])
    return _sum(high, low + a[0] * b[1] + a[1] * b[0])


def _divide(a: DoubleDouble, divisor: float) -> DoubleDouble:
    quotient = a[0] / divisor
    high, low = _product(quotient, np.full_like(quotient, divisor))
    return _sum(quotient, ((a[0] - high) - low + a[1]) / divisor)
