"""The registry of conversion methods.

A new method is a module that defines ``METHOD``, and one line in `_MODULES`.
"""

from __future__ import annotations

from importlib import import_module

from mdfconv.conversion.method import Method
from mdfconv.distributions import Distribution
from mdfconv.registry import Registry

# The default first, and after it what answers where the default has no formula.
_DEFAULT, _FALLBACK = "closed-form", "fit"
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


def default_method(source: Distribution, target: Distribution) -> Method:
    """Return the method for a pair where none is asked for: the closed form, or else the fit."""
    method = _REGISTRY[_DEFAULT]
    return method if method.route(source, target) is not None else _REGISTRY[_FALLBACK]
