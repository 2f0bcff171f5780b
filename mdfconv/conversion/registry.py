"""The registry of conversion methods.

A new method is a module that defines ``METHOD``, and one line in `_MODULES`.
"""

from __future__ import annotations

from importlib import import_module

from mdfconv.conversion.method import Method
from mdfconv.errors import check_name, unknown_name

DEFAULT_METHOD = "closed-form"
_MODULES = ("closed_form", "half_angle", "ward", "peak", "least_squares", "fast")
_ALL: tuple[Method, ...] = tuple(
    import_module(f"mdfconv.conversion.{module}").METHOD for module in _MODULES
)
_BY_NAME = {entry.name: entry for entry in _ALL}


def list_methods() -> tuple[Method, ...]:
    """Return every conversion method, the default first."""
    return _ALL


def find_method(name: str) -> Method:
    """Return the method with a given name.

    Raises
    ------
    MdfconvError
        If the name is not known; the message offers the nearest ones.
    """
    key = check_name("method", name).strip().lower().replace("_", "-")
    if key not in _BY_NAME:
        raise unknown_name("method", name, list(_BY_NAME))
    return _BY_NAME[key]
