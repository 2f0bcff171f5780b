"""The registry of conversion methods.

A new method is a module that defines ``METHOD``, and one line in `_MODULES`.
"""

from __future__ import annotations

from importlib import import_module

import numpy as np

from mdfconv.conversion.least_squares import LeastSquares
from mdfconv.conversion.method import Method
from mdfconv.distributions import Distribution
from mdfconv.distributions.evaluation import Array
from mdfconv.fitting.metrics import Metric
from mdfconv.registry import Registry

_DEFAULT, _FAST = "closed-form", "fast"
_MODULES = ("closed_form", "half_angle", "ward", "peak", "least_squares", "fast")

_REGISTRY: Registry[Method] = Registry("method")
for _module in _MODULES:
    _method = import_module(f"mdfconv.conversion.{_module}").METHOD
    _REGISTRY.add(_method.name, _method)


def list_methods() -> tuple[Method, ...]:
    """Return every conversion method, the default first."""
    return tuple(_REGISTRY)


def method_named(name: str) -> Method:
    """Return the method with a given name.

    Raises
    ------
    MdfconvError
        If the name is not known; the message offers the nearest ones.
    """
    return _REGISTRY[name]


class BestFit(LeastSquares):
    """The fit, from the stored polynomials as far as they reach."""

    def convert(
        self, parameter: Array, source: Distribution, target: Distribution, metric: Metric
    ) -> Array:
        """Take the stored fits, and fit what they do not cover."""
        result = self._stored(parameter, source, target, metric)
        missing = np.isnan(result)
        if missing.any():
            result[missing] = super().convert(parameter[missing], source, target, metric)
        return result

    def answered_by(
        self, parameter: Array, source: Distribution, target: Distribution, metric: Metric
    ) -> list[str]:
        """Return "fast" where the stored fits reach, else "fit"."""
        missing = np.isnan(self._stored(parameter, source, target, metric))
        return np.where(missing, self.name, _FAST).tolist()

    def _stored(
        self, parameter: Array, source: Distribution, target: Distribution, metric: Metric
    ) -> Array:
        """Return the stored fits, NaN where there is none."""
        fast = _REGISTRY[_FAST]
        if not fast.covers(source, target, metric):
            return np.full(parameter.shape, np.nan)
        return fast.convert(parameter, source, target, metric)


_BEST_FIT = BestFit()


def default_method(
    source: Distribution, target: Distribution, *, metric_given: bool = True
) -> Method:
    """Return the method for a pair where none is asked for.

    With a metric that is the fit under it; without, the closed form of a pair that has one.
    """
    closed_form = _REGISTRY[_DEFAULT]
    if metric_given or closed_form.route(source, target) is None:
        return _BEST_FIT
    return closed_form
