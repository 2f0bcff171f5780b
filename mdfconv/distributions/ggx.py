"""The GGX or Trowbridge-Reitz distribution."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from mdfconv.distributions import base
from mdfconv.distributions.angles import Angles
from mdfconv.distributions.beckmann import slope_scale
from mdfconv.distributions.evaluation import Array, inverse_square
from mdfconv.distributions.parameter import GLOSSINESS, ROUGHNESS, Parameter

_EXCESS = np.sqrt(2) - 1


def printed_cosine(alpha: Any, gamma: Any) -> Any:
    """Return cos β_half of [α² / (cos²β (α²−1) + 1)]^γ, as printed for γ = 2."""
    return np.sqrt((2 ** (1 / gamma) * alpha**2 - 1) / (alpha**2 - 1))


def printed_from_cosine(c: Any, gamma: Any) -> Any:
    """Return α for cos β_half, as printed for γ = 2."""
    return np.sqrt((c**2 - 1) / (c**2 - 2 ** (1 / gamma)))


class GGX(base.AlphaDistribution, base.AnisotropicDistribution):
    """Normals of an ellipsoid: Trowbridge & Reitz 1975; Walter et al. 2007.

    Unit form, with t = tan β::

        D̄ = [α² / (α² + (1−α²) sin²β)]² = 1 / (1 + (1/α²−1) sin²β)².

    Normalized by 1/(π α²). Anisotropic: 1/α² becomes cos²φ/α_x² + sin²φ/α_y² and α²
    in the constant becomes α_x α_y (Burley 2012). The printed cos²β (α²−1) + 1 loses every
    digit for smooth surfaces; the second form has only positive terms. F = t²/(t²+α²); Smith's
    Λ = ½ (√(1 + α² tan²θ) − 1).
    """

    name = "ggx"
    aliases = ("trowbridge-reitz", "tr")
    unit_formula = "[α² / (α² + (1−α²) sin²β)]²"
    normalized_formula = "[α² / (α² + (1−α²) sin²β)]² / (π α²)"
    source = "Trowbridge & Reitz 1975; Walter et al. 2007; Burley 2012"
    parameters = (Parameter("alpha", "α", (0.01, 0.8), upper=1.0, upper_closed=True),)
    operations = 5
    scales_with_slope = True
    smith = True
    encodings = (ROUGHNESS, GLOSSINESS)
    meant_by: ClassVar = {
        **dict.fromkeys(("roughness", "principled", "disney", "blender"), "ggx:roughness"),
        **dict.fromkeys(("gltf", "pbr", "perceptual-roughness"), "ggx:roughness"),
        **dict.fromkeys(("unreal", "ue4", "ue5", "maya", "3ds-max", "3dsmax"), "ggx:roughness"),
        "alpha": "ggx",
        **dict.fromkeys(("glossiness", "gloss", "smoothness"), "ggx:glossiness"),
        **dict.fromkeys(("unity", "vray", "v-ray"), "ggx:glossiness"),
    }
    map_variables = base.BOUNDED_ALPHA_MAP
    printed = base.Printed.of_alpha(
        lambda beta, alpha: (alpha**2 / (np.cos(beta) ** 2 * (alpha**2 - 1) + 1)) ** 2,
        cosine=lambda alpha: printed_cosine(alpha, np.full_like(alpha, 2)),
        from_cosine=lambda c: printed_from_cosine(c, np.full_like(c, 2)),
    )

    def _lobe(self, angles: Angles, parameter: Array, out: Array | None = None) -> Array:
        return trowbridge_reitz(angles, inverse_square(parameter), out)

    def _lobe_pair(self, angles: Angles, x: Array, y: Array, phi: Array, out: Array) -> None:
        trowbridge_reitz(angles, slope_scale(x, y, phi), out)

    def _lobe_and_log_slope(self, angles: Angles, parameter: Array) -> tuple[Array, Array]:
        ratio = angles.tangent_square * inverse_square(parameter)
        fall = 1 + ratio
        ratio /= fall
        ratio *= 4
        np.divide(1 + angles.tangent_square, fall, out=fall)
        return np.square(fall, out=fall), ratio

    def _cumulative(self, angles: Angles, parameter: Array) -> tuple[Array, Array]:
        return trowbridge_reitz_shares(angles, inverse_square(parameter))

    def _quantile(self, lobe: Array, tail: Array, parameter: Array) -> Array:
        # Walter et al. 2007, eq. (35).
        return np.arctan(parameter * np.sqrt(lobe / tail))

    def smith_lambda(self, tangent: Array, parameter: float | Array) -> Array:
        """Return Λ = ½ (√(1 + α² tan²θ) − 1)."""
        return trowbridge_reitz_lambda(parameter * tangent)

    def _half_tangent(self, parameter: Array) -> Array:
        # t² = e α² / (1 − (1+e) α²), e = √2 − 1: Sawicki 2021, eq. (8), free of its 1 − cos².
        return parameter * np.sqrt(_EXCESS / (1 - np.sqrt(2) * np.square(parameter)))

    def _from_half_tangent(self, tangent: Array) -> Array:
        # Sawicki 2021, eq. (5), likewise.
        return tangent / np.sqrt(_EXCESS + np.sqrt(2) * np.square(tangent))


def trowbridge_reitz_lambda(slope: Array) -> Array:
    """Return ½ (√(1 + slope²) − 1) (Walter et al. 2007, eq. 34; Heitz 2014, eq. 72)."""
    with np.errstate(invalid="ignore"):
        # Without the difference, and without slope² where it would overflow.
        value = 0.5 * slope * (slope / (1 + np.hypot(1, slope)))
    return np.where(np.isinf(slope), np.inf, value)


def trowbridge_reitz(angles: Angles, scale: Array, out: Array | None) -> Array:
    """Return 1 / (1 + (k−1) sin²β)² for k = `scale` = 1/α²."""
    value = np.multiply(angles.sine_square, scale - 1, out=out)
    value += 1
    np.divide(1, value, out=value)
    return np.square(value, out=value)


def trowbridge_reitz_shares(angles: Angles, scale: Array) -> tuple[Array, Array]:
    """Return F = k t² / (1+k t²) and 1 − F for k = `scale` = 1/α²."""
    ratio = angles.tangent_square * scale
    # Finite, so that the share of the lobe is 1 where it overflows.
    ratio = np.minimum(ratio, np.finfo(ratio.dtype).max)
    return ratio / (1 + ratio), 1 / (1 + ratio)


def ggx_at_two(mdf: base.Distribution) -> base.Equivalent | None:
    """Return GGX as the equivalent of a distribution that it is at γ = 2."""
    text = f"{mdf.name} with γ = 2 is ggx"
    return base.Equivalent("ggx", forward_text=text, backward_text=text) if mdf.gamma == 2 else None


DISTRIBUTIONS = (GGX(),)
