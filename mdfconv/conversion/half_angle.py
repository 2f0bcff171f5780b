"""Equal half angle: Blinn 1977; Sawicki 2021, equations (3)-(10)."""

from __future__ import annotations

from mdfconv.conversion.method import Method
from mdfconv.distributions import Distribution
from mdfconv.distributions.evaluation import Array


class HalfAngle(Method):
    """Both distributions fall to half of their value at the normal at the same angle."""

    name = "half-angle"
    keeps = "angle at which D falls to D(0)/2"
    source = "Blinn 1977; Sawicki 2021, eqs (3)-(10)"

    def route(self, source: Distribution, target: Distribution) -> tuple[str, ...]:
        """Return the one step, which exists for every pair."""
        return ("β_half of the source = β_half of the target",)

    def convert(self, parameter: Array, source: Distribution, target: Distribution) -> Array:
        """Go through tan β_half; NaN where a distribution never falls to one half."""
        result: Array = target.from_half_tangent(source.half_tangent(parameter))
        return result


METHOD = HalfAngle()
