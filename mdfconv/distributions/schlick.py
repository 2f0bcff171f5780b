"""Schlick's rational approximation of Beckmann."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from mdfconv.distributions.base import Distribution
from mdfconv.distributions.double_double import distance_to_cosine
from mdfconv.distributions.evaluation import Array, tangent_square
from mdfconv.distributions.parameter import Parameter

# Where y = x/m is smaller than this, 1 − w is a difference of numbers that agree in too many digits
# for the type at hand.
_JUST_BEYOND = 1 + 1e-6
_EDGE = {np.dtype(np.float32): 1e-2, np.dtype(np.float64): 5e-4}


class Schlick(Distribution):
    """Beckmann as a rational function: Schlick 1994 (An Inexpensive BRDF Model).

    Unit form, with x = cos β + m − 1 ≥ 0 and 0 where x < 0::

        D̄ = m⁵ x / (cos β (m x² − x² + m²)²)
           = y / (cos β (1 + (1−m)/m · w (2−w))²),   w = (1 − cos β)/m, y = 1 − w = x/m.

    Normalized by 1/(π m²), exactly. The parameter is Beckmann's m. The second form has no
    difference that vanishes for smooth surfaces; 1 − cos β = 2 sin²(β/2) keeps its digits.
    """

    name = "schlick"
    unit_formula = "m⁵ x / (cos β (m x² − x² + m²)²), x = cos β + m − 1; 0 where x < 0"
    normalized_formula = "m³ x / (π cos β (m x² − x² + m²)²)"
    source = "Schlick 1994, An Inexpensive BRDF Model for Physically-Based Rendering"
    parameter = Parameter("alpha", "m_B", upper=1.0, upper_closed=True, usual="0 < m_B ≤ 1")
    operations = 8

    def _lobe(self, beta: Array, parameter: Array, out: Array | None = None) -> Array:
        # Angles often come sorted or in tiles: of whole blocks beyond the edge nothing is computed.
        if out is not None and beta.min() > _JUST_BEYOND * np.max(self.edge(parameter)):
            out.fill(0)
            return out
        # tan²(β/2)/(1+tan²(β/2)) = ½ (1 − cos β)
        w = np.multiply(beta, 0.5)
        tangent_square(w, w)
        fall = w + 1
        w /= fall
        w *= 2 / parameter
        y = np.subtract(1, w, out=out)
        if _sharpen_edge(y, beta, parameter):
            # Against arrays, not against numbers: NumPy has a fast loop for that.
            np.maximum(y, np.zeros_like(y), out=y)
            np.minimum(w, np.ones_like(w), out=w)
        fall = np.subtract(2, w, out=fall)
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

    def _at_normal(self, parameter: Array) -> Array:
        return 1 / (np.pi * parameter * parameter)

    def _lobe_and_log_slope(self, beta: Array, parameter: Array) -> tuple[Array, Array]:
        value = self._lobe(beta, parameter)
        w = np.minimum(2 * np.square(np.sin(0.5 * beta)) / parameter, 1)
        y = 1 - w
        _sharpen_edge(y, beta, parameter)
        bend = (1 - parameter) / parameter
        fall = 1 + bend * w * (2 - w)
        # At and beyond the edge D is 0, and so is its slope.
        y = np.where(y > 0, y, 1)
        return value, w / y + 2 * w * ((2 - w) / parameter + 2 * bend * y) / fall

    def _log_slope_at_normal(self, parameter: Array) -> Array:
        return np.full_like(parameter, -2)

    def edge(self, parameter: Array) -> Array:
        """Return the end of the support, cos β = 1 − m."""
        return 2 * np.arcsin(np.sqrt(0.5 * parameter))

    def _peak_alpha(self, parameter: Array) -> Array:
        return parameter

    def _from_peak_alpha(self, alpha: Array) -> Array:
        return alpha


def _sharpen_edge(y: Array, beta: Array, parameter: Array) -> bool:
    """Recompute y = x/m where it nearly vanishes, in place and to working precision.

    Returns whether it is nearly 0, negative or NaN anywhere.
    """
    threshold = _EDGE[y.dtype]
    if y.min() >= threshold:
        return False
    near = np.abs(y) < threshold
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
    return edge, distance_to_cosine(edge, m) / np.sin(edge)


@lru_cache(maxsize=64)
def _edge_of(m: float) -> tuple[Array, Array]:
    return _precise_edge(np.array([m]))


DISTRIBUTION = Schlick()
