"""The answer of the fit at the price of a closed form: stored polynomials."""

from __future__ import annotations

from mdfconv.conversion.least_squares import METHOD as FIT
from mdfconv.conversion.method import Method
from mdfconv.distributions import Distribution
from mdfconv.distributions.evaluation import Array
from mdfconv.fitting.maps import StoredFit
from mdfconv.fitting.metrics import Metric, list_metrics, metric_named

# Fewer values are fitted sooner than a map is made.
_MANY = 8192


class Fast(Method):
    """The least-squares fit from stored polynomials: 1e-6 from it, 1e-5 for a display.

    Covers the usual range of the source (N from 0.1) as far as the fit does and the target
    stays usable, under the metrics for which there are maps. For a display at another exposure
    than 1 many values have a map made for them, within 1e-4.
    """

    name = "fast"
    source = "least squares, mdfconv.fitting, as stored polynomials"
    follows_metric = True
    gaps_as_nan = True

    def keeps(self, metric: Metric) -> str:
        """Return what the metric keeps."""
        return metric.keeps

    def route(self, source: Distribution, target: Distribution) -> tuple[str, ...] | None:
        """Return the one step; None for pairs without maps, such as those of GTR."""
        metrics = map(metric_named, list_metrics())
        covered = any(self.covers(source, target, metric) for metric in metrics)
        return ("stored least squares",) if covered else None

    def covers(self, source: Distribution, target: Distribution, metric: Metric) -> bool:
        """Return whether there is a map, one to make others from, or a constant."""
        return _stored(source, target, metric).known

    def convert(
        self, parameter: Array, source: Distribution, target: Distribution, metric: Metric
    ) -> Array:
        """Evaluate the polynomials; NaN outside their range."""
        stored = _stored(source, target, metric)
        if len(metric.from_stored()) > 1 and not stored.exact:
            from mdfconv.fitting.map_making import made_map

            if parameter.size < _MANY:
                return FIT.convert(parameter, source, target, metric)
            stored = stored.with_map(made_map(*stored.pair, str(metric)))
        return stored(parameter)

    def range_text(self, source: Distribution, target: Distribution, metric: Metric) -> str:
        """Return which parameters of the source the stored maps cover."""
        return _stored(source, target, metric).range_text()


def _stored(source: Distribution, target: Distribution, metric: Metric) -> StoredFit:
    """Return what is stored under a metric, or under the one that it is followed from."""
    return StoredFit(source, target, metric.from_stored()[0])


METHOD = Fast()
