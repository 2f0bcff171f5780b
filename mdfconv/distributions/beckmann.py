"""The Beckmann distribution."""

from __future__ import annotations

from functools import cache
from typing import Any, ClassVar

import numpy as np

from mdfconv.distributions import base
from mdfconv.distributions.angles import Angles
from mdfconv.distributions.elementary import exp_of_product, one_minus_exp_of_product
from mdfconv.distributions.evaluation import Array, inverse_square
from mdfconv.distributions.parameter import GLOSSINESS, ROUGHNESS, Parameter
from mdfconv.distributions.table import TO_ROUNDING, PolynomialTable, filled

_NEWTON_STEPS = 12


def _printed_unit(beta: Any, m: Any) -> Any:
    value = np.exp(-(np.tan(beta) ** 2) / m**2) / np.cos(beta) ** 4
    if np.all(2 * m**2 <= 1):
        return value
    return value / np.where(2 * m**2 > 1, 4 * m**4 * np.exp(1 / m**2 - 2), 1)


def _printed_cosine(m: Any) -> Any:
    # u² e^(−(u−1)/m²) = ½ for u = 1/cos²β_half.
    from scipy.special import lambertw

    argument = -np.exp(-1 / (2 * m**2)) / (2 * np.sqrt(2).astype(m.dtype) * m**2)
    return 1 / np.sqrt(-2 * m**2 * lambertw(argument, -1).real)


def _printed_from_cosine(c: Any) -> Any:
    return np.tan(np.arccos(c)) / np.sqrt(float(np.log(2)) - 4 * np.log(c))


class Beckmann(base.AlphaDistribution, base.AnisotropicDistribution):
    """Gaussian slopes: Beckmann & Spizzichino 1963; Cook & Torrance 1981.

    Unit form, with t = tan β::

        D̄ = e^(−t²/m²) / cos⁴β   for m ≤ 1/√2,

    divided by 4m⁴ e^(1/m²−2) for m > 1/√2, where the maximum lies at t² = 2m² − 1 and no
    longer at β = 0. Normalized by 1/(π m²). Anisotropic: t²/m² becomes
    t² (cos²φ/m_x² + sin²φ/m_y²) and m² in the constant becomes m_x m_y.
    F = 1 − e^(−t²/m²); Smith's Λ is that of Heitz 2014, eq. (66), exact.
    """

    name = "beckmann"
    aliases = ("cook-torrance",)
    meant_by: ClassVar = {"radiance": "beckmann:ward"}
    unit_formula = "exp(−tan²β/m²) / cos⁴β, divided by its maximum where m > 1/√2"
    normalized_formula = "exp(−tan²β/m²) / (π m² cos⁴β)"
    source = "Beckmann & Spizzichino 1963; Cook & Torrance 1981"
    parameters = (Parameter("alpha", "m_B", (0.01, 0.8)),)
    operations = 17
    scales_with_slope = True
    smith = True
    encodings = (ROUGHNESS, GLOSSINESS)
    map_variables = base.ALPHA_MAP
    printed = base.Printed.of_alpha(
        _printed_unit, cosine=_printed_cosine, from_cosine=_printed_from_cosine
    )

    def _lobe(self, angles: Angles, parameter: Array, out: Array | None = None) -> Array:
        return _exp_over_cosine_power(angles, -inverse_square(parameter), out)

    def _lobe_pair(self, angles: Angles, x: Array, y: Array, phi: Array, out: Array) -> None:
        _exp_over_cosine_power(angles, -slope_scale(x, y, phi), out)

    def _lobe_and_log_slope(self, angles: Angles, parameter: Array) -> tuple[Array, Array]:
        scale = inverse_square(parameter)
        value = _exp_over_cosine_power(angles, -scale, None)
        return value, angles.tangent_square * (2 * scale)

    def mode(self, parameter: Array) -> Array:
        """Return the angle of the maximum: tan²β = 2m² − 1 where m² > ½, else 0."""
        return np.arctan(np.sqrt(np.maximum(2 * np.square(parameter) - 1, 0)))

    def _log_slope_off_axis(self, parameter: Array) -> Array:
        return 4 - 2 / np.maximum(np.square(parameter), 0.5)

    def _cumulative(self, angles: Angles, parameter: Array) -> tuple[Array, Array]:
        arguments = angles.tangent_square, -inverse_square(parameter)
        return one_minus_exp_of_product(*arguments), exp_of_product(*arguments)

    def _quantile(self, lobe: Array, tail: Array, parameter: Array) -> Array:
        # Walter et al. 2007, eq. (28).
        return np.arctan(parameter * np.sqrt(base.negative_log_tail(lobe, tail)))

    def smith_lambda(self, tangent: Array, parameter: float | Array) -> Array:
        """Return Λ = ½ (erf(a) − 1) + e^(−a²)/(2a√π), a = 1/(m tan θ) (Heitz 2014, eq. 66)."""
        from scipy.special import erfcx

        slope = parameter * tangent
        with np.errstate(all="ignore"):
            a = 1 / slope
            # erf − 1 = −erfc, and both terms have the factor e^(−a²).
            value = 0.5 * np.exp(-a * a) * (slope / np.sqrt(np.pi) - erfcx(a))
        return np.where(slope == 0, 0, np.maximum(value, 0))

    def _off_axis_maximum(self, parameter: Array) -> Array | None:
        square = np.square(parameter)
        if square.max() <= 0.5:
            return None
        # 4m⁴ e^(1/m²−2), which is 1 at m² = ½.
        square = np.maximum(square, 0.5)
        return np.square(2 * square) * np.exp(1 / square - 2)

    def _half_tangent(self, parameter: Array) -> Array:
        square = np.square(parameter)
        slope = _half_slopes()(square / (1 + square))
        return parameter * filled(slope, lambda rows: _half_slope(square[rows]))

    def _from_half_tangent(self, tangent: Array) -> Array:
        # Sawicki 2021, eq. (9), with −4 ln cos β = 2 ln(1 + t²): no digits lost when smooth.
        return tangent / np.sqrt(np.log(2) + 2 * np.log(1 + np.square(tangent)))


def _half_slope(square: Array) -> Array:
    """Return tan β_half/m for m²."""
    # z = t²/m² solves z = ln 2 + 2 ln(1 + m² z). The difference is convex and rises with
    # slope ≥ 1/2 from z = 4 on, so Newton steps from there close in from above.
    z = np.full_like(square, 4.0)
    for _ in range(_NEWTON_STEPS):
        value = z - np.log(2) - 2 * np.log1p(square * z)
        z = z - value / (1 - 2 * square / (1 + square * z))
    return np.sqrt(z)


@cache
def _half_slopes() -> PolynomialTable:
    """Return tan β_half/m as a function of m²/(1+m²)."""
    return PolynomialTable(lambda x: _half_slope(x / (1 - x)), *TO_ROUNDING)


def slope_scale(x: Array, y: Array, phi: Array) -> Array:
    """Return cos²φ/x² + sin²φ/y², which takes the place of 1/α² on an anisotropic surface."""
    along_x = np.square(np.cos(phi)) * inverse_square(x)
    return along_x + np.square(np.sin(phi)) * inverse_square(y)


def _exp_over_cosine_power(angles: Angles, scale: Array, out: Array | None) -> Array:
    """Return e^(k t²) / cos⁴β for k = `scale`."""
    # Its root, which does not underflow where it does not.
    value = exp_of_product(angles.tangent_square, 0.5 * scale, out)
    value *= 1 + angles.tangent_square
    return np.square(value, out=value)


DISTRIBUTIONS = (Beckmann(),)
