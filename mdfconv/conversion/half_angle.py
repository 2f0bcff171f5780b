"""Equal half angle: Blinn 1977; Sawicki 2021, equations (3)-(10)."""

from __future__ import annotations

from mdfconv.conversion.method import Method
from mdfconv.distributions import Distribution
from mdfconv.distributions.evaluation import Array
from mdfconv.fitting.metrics import Metric


class HalfAngle(Method):
    """Both distributions fall to half of their value at the normal at the same angle."""

    name = "half-angle"
    source = "Blinn 1977; Sawicki 2021, eqs (3)-(10)"

    def keeps(self, metric: Metric) -> str:
        """Return what the method is named for."""
        return "angle of half height"

    def route(self, source: Distribution, target: Distribution) -> tuple[str, ...]:
        """Return the one step, which exists for every pair."""
        return ("β_half of the source = β_half of the target",)

    def convert(
        self, parameter: Array, source: Distribution, target: Distribution, metric: Metric
    ) -> Array:
        """Go through tan β_half; NaN where a distribution never falls to one half."""
        result: Array = target.from_half_tangent(source.half_tangent(parameter))
        return result


METHOD = HalfAngle()
