"""The Smoothie distribution."""

from __future__ import annotations

from typing import Any

import numpy as np

from mdfconv.distributions import ggx
from mdfconv.distributions.angles import Angles
from mdfconv.distributions.base import Distribution, Equivalent, MapVariables, Printed
from mdfconv.distributions.evaluation import Array, inverse_square
from mdfconv.distributions.parameter import Parameter

_EXCESS = np.sqrt(2) - 1


def to_ggx(alpha: Array) -> Array:
    """Return the α of the GGX that equals Smoothie's α: α/√(4+α²)."""
    return alpha / np.hypot(2, alpha)


def from_ggx(alpha: Array) -> Array:
    """Return Smoothie's α for a GGX α < 1: 2α/√(1−α²); inf or NaN from 1 on."""
    return 2 * alpha / np.sqrt((1 - alpha) * (1 + alpha))


def _printed_to_ggx(alpha: Any) -> Any:
    return alpha / np.sqrt(4 + alpha**2)


def _printed_from_ggx(alpha: Any) -> Any:
    return 2 * alpha / np.sqrt(1 - alpha**2)


class Smoothie(Distribution):
    """The empirical BRDF's distribution, which is Trowbridge-Reitz in another parameter.

    Unit form::

        D̄ = [α² / (α² + 4 sin²β)]² = [1 + (2 sin β/α)²]^(−2).

    Normalized by (α²+4)/(π α²). With α_ggx = α/√(4+α²) it is GGX.
    """

    name = "smoothie"
    unit_formula = "[α² / (α² + 4 sin²β)]²"
    normalized_formula = "(α²+4)/(π α²) [α² / (α² + 4 sin²β)]²"
    source = "Smoothie: an empirical BRDF (web article)"
    parameters = (Parameter("alpha", "α_s", (0.01, 0.8)),)
    operations = 6
    equivalent = Equivalent(
        "ggx",
        forward=to_ggx,
        backward=from_ggx,
        forward_text="α = α_s/√(4+α_s²), exact",
        backward_text="α_s = 2α/√(1−α²), exact",
    )
    map_variables = MapVariables(
        width=to_ggx,
        from_width=from_ggx,
        concentration=lambda alpha: 4 / (alpha * alpha),
        from_map=lambda x, product: 2 * x / np.sqrt(product),
    )
    printed = Printed(
        lambda beta, alpha: (alpha**2 / (alpha**2 + 4 * np.sin(beta) ** 2)) ** 2,
        lambda alpha: (alpha**2 + 4) / (np.pi * alpha**2),
        cosine=lambda alpha: ggx.printed_cosine(_printed_to_ggx(alpha), np.full_like(alpha, 2)),
        from_cosine=lambda c: _printed_from_ggx(ggx.printed_from_cosine(c, np.full_like(c, 2))),
        peak_alpha=_printed_to_ggx,
        from_peak_alpha=_printed_from_ggx,
    )

    def _lobe(self, angles: Angles, parameter: Array, out: Array | None = None) -> Array:
        return ggx.trowbridge_reitz(angles, 1 + 4 * inverse_square(parameter), out)

    def _at_normal(self, parameter: Array) -> Array:
        return (1 + 4 * inverse_square(parameter)) / np.pi

    def _lobe_and_log_slope(self, angles: Angles, parameter: Array) -> tuple[Array, Array]:
        ratio = angles.sine_square * (4 * inverse_square(parameter))
        return 1 / np.square(1 + ratio), 4 * ratio / (1 + ratio)

    def _log_slope_at_normal(self, parameter: Array) -> Array:
        return -8 / (4 + np.square(parameter))

    def _cumulative(self, angles: Angles, parameter: Array) -> tuple[Array, Array]:
        return ggx.trowbridge_reitz_shares(angles, 1 + 4 * inverse_square(parameter))

    def _quantile(self, lobe: Array, tail: Array, parameter: Array) -> Array:
        return np.arctan(to_ggx(parameter) * np.sqrt(lobe / tail))

    def smith_lambda(self, tangent: Array, parameter: float | Array) -> Array:
        """Return Λ, that of GGX with α_s/√(4+α_s²)."""
        return ggx.trowbridge_reitz_lambda(to_ggx(np.asarray(parameter)) * tangent)

    def _half_tangent(self, parameter: Array) -> Array:
        square = 0.25 * _EXCESS * np.square(parameter)
        return np.sqrt(square / (1 - square))

    def _from_half_tangent(self, tangent: Array) -> Array:
        return 2 * tangent / np.sqrt(_EXCESS * (1 + np.square(tangent)))

    def _peak_alpha(self, parameter: Array) -> Array:
        return to_ggx(parameter)

    def _from_peak_alpha(self, alpha: Array) -> Array:
        return from_ggx(alpha)


DISTRIBUTIONS = (Smoothie(),)
