"""The best fit under a metric: exact where the other methods approximate."""

from __future__ import annotations

from mdfconv.conversion.method import Method
from mdfconv.distributions import Distribution
from mdfconv.distributions.evaluation import Array, Mask
from mdfconv.fitting.metrics import Metric


class LeastSquares(Method):
    """The target with the smallest squared distance from the source over the hemisphere.

    The metric says which distance: of the unit forms (shape), of the normalized forms (light),
    or of what a screen shows of them (picture).
    """

    name = "fit"
    source = "least squares, mdfconv.fitting"
    follows_metric = True

    def keeps(self, metric: Metric) -> str:
        """Return what the metric keeps."""
        return metric.keeps

    def route(self, source: Distribution, target: Distribution) -> tuple[str, ...]:
        """Return the one step, which exists for every pair."""
        return ("least squares",)

    def convert(
        self, parameter: Array, source: Distribution, target: Distribution, metric: Metric
    ) -> Array:
        """Fit every value; NaN where the fit tends to the open end of the legal range."""
        from mdfconv.fitting.fit import fit

        return fit(source, parameter.ravel(), target, metric).parameter.reshape(parameter.shape)

    def cautions(
        self, parameter: Array, result: Array, source: Distribution, target: Distribution
    ) -> dict[str, Mask]:
        """Say where the best fit is the end of the target's range."""
        limits = target.parameter
        sentence = f"the best fit lies at the end of the legal range of {target.name}"
        return {sentence: (result == limits.upper) & limits.upper_closed}


METHOD = LeastSquares()
