"""Equal peak of the normalized forms."""

from __future__ import annotations

from mdfconv.conversion.method import Method
from mdfconv.distributions import Distribution
from mdfconv.distributions.evaluation import Array
from mdfconv.fitting.metrics import Metric


class Peak(Method):
    """Both normalized forms have the same value at the normal, D(0) = 1/(π α²).

    Between Beckmann and GGX this is equal α; between Beckmann and Blinn/Phong it is
    m = √(2/(N+2)), the usual rule between roughness and shininess.
    """

    name = "peak"
    source = "equal D(0); for Blinn/Phong m = √(2/(N+2))"

    def keeps(self, metric: Metric) -> str:
        """Return what the method is named for."""
        return "peak of the normalized form"

    def route(self, source: Distribution, target: Distribution) -> tuple[str, ...]:
        """Return the one step, which exists for every pair."""
        return ("D(0) of the source = D(0) of the target",)

    def convert(
        self, parameter: Array, source: Distribution, target: Distribution, metric: Metric
    ) -> Array:
        """Go through the α with that peak; NaN where the target has no such peak."""
        result: Array = target.from_peak_alpha(source.peak_alpha(parameter))
        return result


METHOD = Peak()
