"""The registry of distributions.

A new distribution is a module that defines ``DISTRIBUTION``, and one line in `_MODULES`.
"""

from __future__ import annotations

from importlib import import_module

from mdfconv.distributions.base import Distribution
from mdfconv.errors import check_name, unknown_name

__all__ = ["Distribution", "distribution", "list_distributions"]

_MODULES = (
    "beckmann",
    "gauss",
    "ggx",
    "gtr",
    "blinn_phong",
    "ashikhmin_shirley",
    "schlick",
    "sawicki",
    "smoothie",
)

_ALL: tuple[Distribution, ...] = tuple(
    import_module(f"{__name__}.{module}").DISTRIBUTION for module in _MODULES
)
_BY_NAME = {name: entry for entry in _ALL for name in (entry.name, *entry.aliases)}


def list_distributions() -> tuple[Distribution, ...]:
    """Return every distribution, in the order of the documentation."""
    return _ALL


def distribution(name: str) -> Distribution:
    """Return the distribution with a given name or alias.

    Parameters
    ----------
    name : str
        Name or alias; case does not matter, and ``_``, ``/`` and blanks count as ``-``.

    Raises
    ------
    MdfconvError
        If the name is not known; the message offers the nearest ones.

    Examples
    --------
    >>> distribution("Trowbridge_Reitz").name
    'ggx'
    """
    key = check_name("distribution", name).strip().lower().translate(str.maketrans("_/ ", "---"))
    if key not in _BY_NAME:
        raise unknown_name("distribution", name, list(_BY_NAME))
    return _BY_NAME[key]
