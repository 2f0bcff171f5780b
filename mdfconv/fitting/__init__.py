"""Least-squares fits between distributions, under metrics that say what a fit keeps."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from mdfconv.fitting.metrics import Metric, list_metrics, metric_named, register_metric

if TYPE_CHECKING:
    from mdfconv.fitting.free_gamma import fit_free_gamma
    from mdfconv.fitting.solve import fit

__all__ = ["Metric", "fit", "fit_free_gamma", "list_metrics", "metric_named", "register_metric"]

# Most conversions fit nothing.
_HOMES = {"fit": "solve", "fit_free_gamma": "free_gamma"}


def __getattr__(name: str) -> Any:
    """Import what fits when it is asked for."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
