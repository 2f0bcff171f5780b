"""Least-squares fits between distributions, under metrics that say what a fit keeps."""

from typing import TYPE_CHECKING

from mdfconv import lazy_face

if TYPE_CHECKING:
    from mdfconv.fitting.free_gamma import fit_free_gamma
    from mdfconv.fitting.metrics import Metric, list_metrics, metric_named, register_metric
    from mdfconv.fitting.solve import fit

__all__ = ["Metric", "fit", "fit_free_gamma", "list_metrics", "metric_named", "register_metric"]

# Imported when they are asked for: most conversions need the metrics alone.
_MODULES = {
    "free_gamma": ("fit_free_gamma",),
    "metrics": ("Metric", "list_metrics", "metric_named", "register_metric"),
    "solve": ("fit",),
}
__getattr__ = lazy_face(__name__, _MODULES)


def __dir__() -> list[str]:
    """Return the public names, whether they are imported yet or not."""
    return sorted(__all__)
