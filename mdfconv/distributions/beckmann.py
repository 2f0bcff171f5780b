"""The Beckmann distribution."""

from __future__ import annotations

import numpy as np

from mdfconv.distributions.base import AnisotropicDistribution
from mdfconv.distributions.evaluation import Array, inverse_square, tangent_square
from mdfconv.distributions.parameter import GLOSSINESS, ROUGHNESS, Parameter

_NEWTON_STEPS = 12


class Beckmann(AnisotropicDistribution):
    """Gaussian slopes: Beckmann & Spizzichino 1963; Cook & Torrance 1981.

    Unit form, with t = tan β::

        D̄ = e^(−t²/m²) / cos⁴β = (1+t²)² e^(−t²/m²)   for m ≤ 1/√2,

    divided by 4m⁴ e^(1/m²−2) for m > 1/√2, where the maximum lies at t² = 2m² − 1 and no
    longer at β = 0. Normalized by 1/(π m²). Anisotropic: t²/m² becomes
    t² (cos²φ/m_x² + sin²φ/m_y²) and m² in the constant becomes m_x m_y.

    The form in t keeps every digit up to β = π/2 and needs one
    trigonometric function instead of two.
    """

    name = "beckmann"
    aliases = ("cook-torrance",)
    unit_formula = "exp(−tan²β/m²) / cos⁴β, divided by its maximum where m > 1/√2"
    normalized_formula = "exp(−tan²β/m²) / (π m² cos⁴β)"
    source = "Beckmann & Spizzichino 1963; Cook & Torrance 1981"
    parameter = Parameter("alpha", "m_B", usual="0 < m_B ≤ 1")
    operations = 17
    encodings = (ROUGHNESS, GLOSSINESS)

    def _lobe(self, beta: Array, parameter: Array, out: Array | None = None) -> Array:
        square = tangent_square(beta, out)
        return _lobe(square, square * -inverse_square(parameter))

    def _lobe_pair(self, beta: Array, x: Array, y: Array, phi: Array, out: Array) -> None:
        square = tangent_square(beta, out)
        _lobe(square, square * -slope_scale(x, y, phi))

    def _at_normal(self, parameter: Array) -> Array:
        return 1 / (np.pi * parameter * parameter)

    def _at_normal_pair(self, x: Array, y: Array) -> Array:
        return 1 / (np.pi * x * y)

    def _lobe_and_log_slope(self, beta: Array, parameter: Array) -> tuple[Array, Array]:
        square = tangent_square(beta)
        exponent = square * inverse_square(parameter)
        return _lobe(square, -exponent), 2 * exponent

    def _log_slope_at_normal(self, parameter: Array) -> Array:
        return np.full_like(parameter, -2)

    def mode(self, parameter: Array) -> Array:
        """Return the angle of the maximum: tan²β = 2m² − 1 where m² > ½, else 0."""
        return np.arctan(np.sqrt(np.maximum(2 * np.square(parameter) - 1, 0)))

    def _log_slope_off_axis(self, parameter: Array) -> Array:
        return 4 - 2 / np.maximum(np.square(parameter), 0.5)

    def _off_axis_maximum(self, parameter: Array) -> Array | None:
        square = np.square(parameter)
        if square.max() <= 0.5:
            return None
        # 4m⁴ e^(1/m²−2), which is 1 at m² = ½.
        square = np.maximum(square, 0.5)
        return np.square(2 * square) * np.exp(1 / square - 2)

    def _half_tangent(self, parameter: Array) -> Array:
        # z = t²/m² solves z = ln 2 + 2 ln(1 + m² z). The difference is convex and rises with
        # slope ≥ 1/2 from z = 4 on, so Newton steps from there close in from above.
        square = np.square(parameter)
        z = np.full_like(square, 4.0)
        for _ in range(_NEWTON_STEPS):
            value = z - np.log(2) - 2 * np.log1p(square * z)
            z = z - value / (1 - 2 * square / (1 + square * z))
        return parameter * np.sqrt(z)

    def _from_half_tangent(self, tangent: Array) -> Array:
        # Sawicki 2021, eq. (9), with −4 ln cos β = 2 ln(1 + t²): no digits lost when smooth.
        return tangent / np.sqrt(np.log(2) + 2 * np.log1p(np.square(tangent)))

    def _peak_alpha(self, parameter: Array) -> Array:
        return parameter

    def _from_peak_alpha(self, alpha: Array) -> Array:
        return alpha


def slope_scale(x: Array, y: Array, phi: Array) -> Array:
    """Return cos²φ/x² + sin²φ/y², which takes the place of 1/α² on an anisotropic surface."""
    along_x = np.square(np.cos(phi)) * inverse_square(x)
    return along_x + np.square(np.sin(phi)) * inverse_square(y)


def _lobe(square: Array, exponent: Array) -> Array:
    """Turn t² into (1+t²)² e^exponent in place."""
    np.exp(exponent, out=exponent)
    square += 1
    np.square(square, out=square)
    square *= exponent
    return square


DISTRIBUTION = Beckmann()
