"""What "best fit" means: the metrics under which two distributions are compared.

A new metric is a module that defines ``METRICS``, its classes, and one line in `_MODULES`.
"""

from __future__ import annotations

from importlib import import_module

from mdfconv.errors import MdfconvError
from mdfconv.fitting.metrics.base import Metric
from mdfconv.registry import Registry

__all__ = ["Metric", "list_metrics", "metric_named", "register_metric"]

# The default first.
_MODULES = ("base", "light")

_REGISTRY: Registry[type[Metric]] = Registry("metric")


def register_metric(kind: type[Metric]) -> None:
    """Add a metric: every function and command that takes one knows it from here on.

    Parameters
    ----------
    kind : type
        A subclass of `mdfconv.fitting.metrics.Metric`.

    Raises
    ------
    MdfconvError
        If its name is taken.
    """
    _REGISTRY.add(kind.name, kind, meant_by=dict.fromkeys(kind.meant_by, kind.name))


for _module in _MODULES:
    for _kind in import_module(f"{__name__}.{_module}").METRICS:
        register_metric(_kind)


def list_metrics() -> list[str]:
    """Return the names of the metrics, the default first, but for those that need a setting."""
    return [kind.name for kind in _REGISTRY if not kind.needs_setting]


def metric_named(name: str | Metric) -> Metric:
    """Return the metric with a name, such as ``"energy"`` or ``"display:4"``.

    Parameters
    ----------
    name : str or Metric
        One of `list_metrics`, with a setting after a colon if it has one: the exposure of
        ``display``, 1 if not given; or ``"light:FILE"``. A metric is returned as it is.

    Raises
    ------
    MdfconvError
        If the name is not known, or the setting is none of the metric's.
    """
    if isinstance(name, Metric):
        return name
    if not isinstance(name, str):
        raise MdfconvError(f"a metric is named by a string, not {name!r}")
    head, colon, setting = name.partition(":")
    kind = _REGISTRY[head]
    return kind.with_setting(setting) if colon or kind.needs_setting else kind()
