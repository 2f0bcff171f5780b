"""The GGX or Trowbridge-Reitz distribution."""

from __future__ import annotations

import numpy as np

from mdfconv.distributions.base import AnisotropicDistribution
from mdfconv.distributions.beckmann import slope_scale
from mdfconv.distributions.evaluation import Array, inverse_square, tangent_square
from mdfconv.distributions.parameter import GLOSSINESS, ROUGHNESS, Parameter

_EXCESS = np.sqrt(2) - 1


class GGX(AnisotropicDistribution):
    """Normals of an ellipsoid: Trowbridge & Reitz 1975; Walter et al. 2007.

    Unit form, with t = tan β::

        D̄ = [α² / (α² + (1−α²) sin²β)]² = [(1+t²) / (1+t²/α²)]².

    Normalized by 1/(π α²). Anisotropic: t²/α² becomes t² (cos²φ/α_x² + sin²φ/α_y²) and α²
    in the constant becomes α_x α_y (Burley 2012). The printed cos²β (α²−1) + 1 loses every
    digit for smooth surfaces; the tangent form has only positive terms.
    """

    name = "ggx"
    aliases = ("trowbridge-reitz", "tr")
    unit_formula = "[α² / (α² + (1−α²) sin²β)]²"
    normalized_formula = "[α² / (α² + (1−α²) sin²β)]² / (π α²)"
    source = "Trowbridge & Reitz 1975; Walter et al. 2007; Burley 2012"
    parameter = Parameter("alpha", "α", upper=1.0, upper_closed=True, usual="0 < α ≤ 1")
    operations = 5
    encodings = (ROUGHNESS, GLOSSINESS)

    def _lobe(self, beta: Array, parameter: Array, out: Array | None = None) -> Array:
        return trowbridge_reitz(beta, inverse_square(parameter), out)

    def _lobe_pair(self, beta: Array, x: Array, y: Array, phi: Array, out: Array) -> None:
        trowbridge_reitz(beta, slope_scale(x, y, phi), out)

    def _at_normal(self, parameter: Array) -> Array:
        return 1 / (np.pi * parameter * parameter)

    def _at_normal_pair(self, x: Array, y: Array) -> Array:
        return 1 / (np.pi * x * y)

    def _lobe_and_log_slope(self, beta: Array, parameter: Array) -> tuple[Array, Array]:
        square = tangent_square(beta)
        ratio = square * inverse_square(parameter)
        square += 1
        fall = 1 + ratio
        square /= fall
        ratio /= fall
        ratio *= 4
        return np.square(square, out=square), ratio

    def _log_slope_at_normal(self, parameter: Array) -> Array:
        return np.full_like(parameter, -2)

    def _half_tangent(self, parameter: Array) -> Array:
        # t² = e α² / (1 − (1+e) α²), e = √2 − 1: Sawicki 2021, eq. (8), free of its 1 − cos².
        return parameter * np.sqrt(_EXCESS / (1 - np.sqrt(2) * np.square(parameter)))

    def _from_half_tangent(self, tangent: Array) -> Array:
        # Sawicki 2021, eq. (5), likewise.
        return tangent / np.sqrt(_EXCESS + np.sqrt(2) * np.square(tangent))

    def _peak_alpha(self, parameter: Array) -> Array:
        return parameter

    def _from_peak_alpha(self, alpha: Array) -> Array:
        return alpha


def trowbridge_reitz(beta: Array, scale: Array, out: Array | None) -> Array:
    """Return [(1+t²) / (1+k t²)]² for k = `scale` = 1/α².

    As [1/k + (1−1/k) / (1+k t²)]² it takes one pass over memory less.
    """
    value = tangent_square(beta, out)
    value *= scale
    value += 1
    floor = 1 / scale
    np.divide(1 - floor, value, out=value)
    value += floor
    return np.square(value, out=value)


DISTRIBUTION = GGX()
