"""The metric that keeps the light of a natural environment."""

from __future__ import annotations

from functools import cache
from typing import ClassVar

import numpy as np

from mdfconv.distributions import Distribution
from mdfconv.distributions.evaluation import Array, gauss_panels
from mdfconv.fitting.metrics.base import Metric

# The ratio of two parameters is found on ln tan β from −32 to 32: beyond, the shares of any two
# lobes differ by less than 1e-27.
_LOG_REACH, _PANELS, _ORDER = 32.0, 96, 16
# Ratios between lobes of one width lie within a factor of e³ of each other.
_LOG_RATIOS = (-3.0, 3.0)


class Environment(Metric):
    """The light of a natural environment, whose angular power falls like 1/f².

    A lobe blurs the environment. In spherical harmonics that multiplies degree l by k_l, so that
    the error of a picture is Σ (2l+1) C_l (Δk_l)². For C_l = 1/(l(l+1)), the law of natural
    images, the sum is 4 ∫ ΔF² dβ / sin 2β, F the cumulative distribution. S is F less that of the
    uniform lobe, sin²β, which leaves no contrast: so ∫ S² w is the contrast of the picture.

    As dβ / sin 2β = ½ d ln tan β, whatever scales with the slope converts by one constant.
    """

    name = "environment"
    keeps = "light of a natural environment"
    word = "environment"
    purpose = "natural light"
    meant_by: ClassVar[tuple[str, ...]] = ("natural", "sky", "scene", "hdri", "ibl")
    quantity = "share of the facets within β, beyond a uniform lobe's"
    normalized = True

    def weight(self, beta: Array) -> Array:
        """Return 4 / sin 2β."""
        # A panel of no width lies at 0.
        return 4 / np.maximum(np.sin(2 * beta), 1e-300)

    def signal(
        self, distribution: Distribution, beta: Array, parameter: Array, peak: Array
    ) -> Array:
        """Return F − sin²β."""
        with np.errstate(all="ignore"):
            return self.signal_and_slope(distribution, beta, parameter, peak)[0]

    def signal_and_slope(
        self, distribution: Distribution, beta: Array, parameter: Array, peak: Array
    ) -> tuple[Array, Array]:
        """Return F − sin²β and ∂F/∂ ln p."""
        share, slope = distribution.cumulative_with_slope(beta, parameter)
        return share - np.square(np.sin(beta)), slope

    def ratio(self, source: Distribution, target: Distribution) -> float | None:
        """Return the constant by which parameters convert, if both scale with the slope."""
        if not (source.scales_with_slope and target.scales_with_slope):
            return None
        # One search for both directions, so that there and back is the identity.
        pair = (source.name, source.gamma), (target.name, target.gamma)
        if pair[0] <= pair[1]:
            return _ratio(source, target)
        return 1 / _ratio(target, source)


@cache
def _ratio(source: Distribution, target: Distribution) -> float:
    """Return p_target/p_source where ∂/∂ ln p of the distance is 0, to the last digits."""
    from scipy.optimize import brentq

    edges = np.linspace(-_LOG_REACH, _LOG_REACH, _PANELS + 1)
    log_tangent, weight = gauss_panels(edges[None, :], _ORDER)
    share, _ = source.cumulative_with_slope(np.arctan(np.exp(log_tangent)), np.ones((1, 1)))

    def slope(log_ratio: float) -> float:
        # The target at parameter 1, moved along the axis: a legal range does not matter.
        moved = np.arctan(np.exp(log_tangent - log_ratio))
        other, fall = target.cumulative_with_slope(moved, np.ones((1, 1)))
        return float(np.sum(weight * (other - share) * fall))

    return float(np.exp(brentq(slope, *_LOG_RATIOS, xtol=1e-16, rtol=1e-15)))


METRIC = Environment
