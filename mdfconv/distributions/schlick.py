"""Schlick's rational approximation of Beckmann."""

from __future__ import annotations

from functools import cache, lru_cache
from typing import Any, TypeAlias

import numpy as np

from mdfconv.distributions import base
from mdfconv.distributions.angles import Angles
from mdfconv.distributions.evaluation import Array
from mdfconv.distributions.parameter import Parameter
from mdfconv.distributions.table import TO_ROUNDING, PolynomialTable, filled

# Where y = x/m is smaller than this, 1 − w is a difference of numbers that agree in too many digits
# for the type at hand.
_JUST_BEYOND = 1 + 1e-6
# What they leave, a Newton step squares.
_HALVINGS = 34
# tan β_half of a lobe that no double tells from the uniform one.
_LARGEST_TANGENT = 1e100
_EDGE = {np.dtype(np.float32): 1e-2, np.dtype(np.float64): 5e-4}


def _printed_unit(beta: Any, m: Any) -> Any:
    c = np.cos(beta)
    x = c + m - 1
    return np.where(x > 0, m**5 * x / (c * (m * x**2 - x**2 + m**2) ** 2), 0)


class Schlick(base.AlphaDistribution):
    """Beckmann as a rational function: Schlick 1994 (An Inexpensive BRDF Model).

    Unit form, with x = cos β + m − 1 ≥ 0 and 0 where x < 0::

        D̄ = m⁵ x / (cos β (m x² − x² + m²)²)
           = y / (cos β (1 + (1−m)/m · w (2−w))²),   w = (1 − cos β)/m, y = 1 − w = x/m.

    Normalized by 1/(π m²), exactly; F = q/(m + (1−m) q) with q = 1 − y², 1 beyond the edge. The
    parameter is Beckmann's m. The second form has no difference that vanishes for smooth surfaces;
    1 − cos β = 2 sin²(β/2) keeps its digits.
    """

    name = "schlick"
    unit_formula = "m⁵ x / (cos β (m x² − x² + m²)²), x = cos β + m − 1; 0 where x < 0"
    normalized_formula = "m³ x / (π cos β (m x² − x² + m²)²)"
    source = "Schlick 1994, An Inexpensive BRDF Model for Physically-Based Rendering"
    parameters = (Parameter("alpha", "m_B", (0.01, 0.8), upper=1.0, upper_closed=True),)
    operations = 8
    equivalent = base.Equivalent(
        "beckmann",
        same_lobe=False,
        forward_text="schlick has beckmann's m_B",
        backward_text="schlick has beckmann's m_B",
    )
    map_variables = base.BOUNDED_ALPHA_MAP
    printed = base.Printed.of_alpha(_printed_unit)

    def _lobe(self, angles: Angles, parameter: Array, out: Array | None = None) -> Array:
        # Angles often come sorted or in tiles: of whole blocks beyond the edge nothing is computed.
        beta = angles.beta
        if out is not None and beta.min() > _JUST_BEYOND * np.max(self.edge(parameter)):
            out.fill(0)
            return out
        w = angles.versine * (1 / parameter)
        y = np.subtract(1, w, out=out)
        if _sharpen_edge(y, beta, parameter):
            # Against arrays, not against numbers: NumPy has a fast loop for that.
            np.maximum(y, np.zeros_like(y), out=y)
            np.minimum(w, np.ones_like(w), out=w)
        fall = 2 - w
        fall *= w
        fall *= (1 - parameter) / parameter
        fall += 1
        np.square(fall, out=fall)
        # cos β from y, not from the tangent: at m = 1 the two cancel to the last bit.
        cosine = np.multiply(y, parameter, out=w)
        cosine += 1 - parameter
        fall *= cosine
        y /= fall
        return y

    def _lobe_and_log_slope(self, angles: Angles, parameter: Array) -> tuple[Array, Array]:
        value = self._lobe(angles, parameter)
        w = np.minimum(angles.versine / parameter, 1)
        y = 1 - w
        _sharpen_edge(y, angles.beta, parameter)
        bend = (1 - parameter) / parameter
        fall = 1 + bend * w * (2 - w)
        # At and beyond the edge D is 0, and so is its slope.
        y = np.where(y > 0, y, 1)
        return value, w / y + 2 * w * ((2 - w) / parameter + 2 * bend * y) / fall

    def _cumulative(self, angles: Angles, parameter: Array) -> tuple[Array, Array]:
        w = np.minimum(angles.versine / parameter, 1)
        y = 1 - w
        _sharpen_edge(y, angles.beta, parameter)
        np.maximum(y, 0, out=y)
        q = w * (2 - w)
        below = parameter + (1 - parameter) * q
        return q / below, parameter * np.square(y) / below

    def cumulative_with_slope(self, angles: Angles, parameter: Array) -> tuple[Array, Array]:
        """Return F and ∂F/∂ ln m, as in the base class."""
        w = np.minimum(angles.versine / parameter, 1)
        y, q = 1 - w, w * (2 - w)
        below = parameter + (1 - parameter) * q
        return q / below, -parameter * y * (2 * w + q * y) / np.square(below)

    def _quantile(self, lobe: Array, tail: Array, parameter: Array) -> Array:
        # 1 − q = y² = (1 − F)/(1 − (1−m) F), and w = q/(1 + y).
        below = 1 - (1 - parameter) * lobe
        y = np.sqrt(tail / below)
        w = parameter * lobe / below / (1 + y)
        return 2 * np.arcsin(np.sqrt(0.5 * parameter * w))

    def _half_tangent(self, parameter: Array) -> Array:
        u = filled(_half_drops()(parameter), lambda rows: _half_drop(parameter[rows]))
        drop = np.square(parameter) * u
        tangent = parameter * np.sqrt(u * (2 - drop)) / (1 - drop)
        # At m = 1 the lobe is uniform.
        return np.where(parameter < 1, tangent, np.nan)

    def _from_half_tangent(self, tangent: Array) -> Array:
        # Beyond, m is 1.
        t = np.minimum(tangent, _LARGEST_TANGENT)
        z = t / (1 + np.sqrt(1 + np.square(t)))
        return np.minimum(z * filled(_ratios()(z), lambda rows: _ratio(z[rows])), 1)

    def edge(self, parameter: Array) -> Array:
        """Return the end of the support, cos β = 1 − m."""
        return 2 * np.arcsin(np.sqrt(0.5 * parameter))


def _half_excess(u: Array, m: Array) -> tuple[Array, Array]:
    """Return ½ (1 − m w)(1 + (1−m)/m · w (2−w))² − (1 − w), w = m u, and its slope in u.

    It is 0 where 1 − cos β_half = m w.
    """
    w = m * u
    bend = (1 - m) * u * (2 - w) + 1
    cosine = 1 - m * w
    half = 0.5 * bend * bend
    slope = 2 * (1 - m) * cosine * bend * (1 - w) + m * (1 - m * half)
    return cosine * half - 1 + w, slope


def _half_drop(m: Array) -> Array:
    """Return (1 − cos β_half)/m²."""
    # A smooth lobe has it near 0.2, a rough one next to the edge at 1/m, where it is 1.
    low, high = np.full_like(m, 0.1), 1 / np.maximum(m, 0.5)
    for _ in range(_HALVINGS):
        u = 0.5 * (low + high)
        below = _half_excess(u, m)[0] < 0
        low, high = np.where(below, u, low), np.where(below, high, u)
    excess, slope = _half_excess(u, m)
    return u - excess / slope


@cache
def _half_drops() -> PolynomialTable:
    """Return (1 − cos β_half)/m² as a function of m."""
    return PolynomialTable(_half_drop, *TO_ROUNDING)


def _ratio_excess(ratio: Array, z: Array) -> tuple[Array, Array]:
    """Return what `_half_excess` does for m = z `ratio` and its slope in the ratio's logarithm.

    z = tan ½β_half; the excess is 0 for the m that has this β_half.
    """
    square = np.square(z)
    m = z * ratio
    # w = (1 − cos β)/m and w/m
    w = 2 * z / ((1 + square) * ratio)
    steep = w / m
    bend = 1 + (1 - m) * steep * (2 - w)
    scaled = (1 - square) / (1 + square) * bend
    slope = scaled * steep * ((2 - w) * (m - 2) + (1 - m) * w) - w
    return 0.5 * scaled * bend - 1 + w, slope


def _ratio(z: Array) -> Array:
    """Return m/z, between 1 for the uniform lobe and 3.11 for a smooth one."""
    low, high = np.ones_like(z), np.full_like(z, 3.2)
    for _ in range(_HALVINGS):
        ratio = 0.5 * (low + high)
        above = _ratio_excess(ratio, z)[0] > 0
        low, high = np.where(above, ratio, low), np.where(above, high, ratio)
    excess, slope = _ratio_excess(ratio, z)
    return ratio - ratio * excess / slope


@cache
def _ratios() -> PolynomialTable:
    """Return m/z, z = tan ½β_half, as a function of z."""
    return PolynomialTable(_ratio, *TO_ROUNDING)


def _sharpen_edge(y: Array, beta: Array, parameter: Array) -> bool:
    """Recompute y = x/m where it nearly vanishes, in place and to working precision.

    Returns whether it is nearly 0, negative or NaN anywhere.
    """
    threshold = _EDGE[y.dtype]
    if y.min() >= threshold:
        return False
    near = np.abs(y) < threshold
    beta = np.broadcast_to(beta, y.shape)
    # Rounded to float32, π/2 exceeds π/2.
    angle = np.minimum(np.abs(beta[near]).astype(float), np.pi / 2)
    single = parameter.size == 1
    m = parameter.ravel() if single else np.broadcast_to(parameter, y.shape)[near]
    if y.dtype == np.float64:
        edge, rest = _edge_of(float(m[0])) if single else _precise_edge(m)
        # x = cos β − cos β_edge
        x = 2 * np.sin(0.5 * (edge - angle + rest)) * np.sin(0.5 * (edge + angle))
        y[near] = x / m
    else:
        y[near] = 1 - 2 * np.square(np.sin(0.5 * angle)) / m.astype(float)
    return True


def _precise_edge(m: Array) -> tuple[Array, Array]:
    """Return the end of the support in two parts, to twice the working precision."""
    edge = 2 * np.arcsin(np.sqrt(0.5 * m))
    return edge, _distance_to_cosine(edge, m) / np.sin(edge)


@lru_cache(maxsize=64)
def _edge_of(m: float) -> tuple[Array, Array]:
    return _precise_edge(np.array([m]))


# An unevaluated sum of two doubles. The algorithms are Dekker's (1971), as collected by Hida, Li &
# Bailey (2001).
DoubleDouble: TypeAlias = tuple[Array, Array]

_SPLITTER = 134217729.0  # 2²⁷ + 1
# (π/2)^(2k)/(2k)! drops below 1e-32 at k = 18.
_COSINE_TERMS = 18


def _distance_to_cosine(beta: Array, m: Array) -> Array:
    """Return m − (1 − cos β) to full relative precision, even where it nearly vanishes."""
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


DISTRIBUTIONS = (Schlick(),)
