"""Convert roughness between microfacet distributions.

Examples
--------
>>> import mdfconv
>>> mdfconv.convert(0.2, "beckmann", "ggx")
0.23552
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mdfconv.conversion import Conversion, convert, explain, list_methods
    from mdfconv.distributions import Distribution, distribution, list_distributions
    from mdfconv.errors import MdfconvError, MdfconvWarning

__version__ = "0.1.0"

__all__ = [
    "Conversion",
    "Distribution",
    "MdfconvError",
    "MdfconvWarning",
    "__version__",
    "convert",
    "distribution",
    "explain",
    "list_distributions",
    "list_methods",
]

# Imported when they are asked for: the command line takes a Ctrl-C during imports, which those of
# the package itself would precede.
_ROOMS = {
    "conversion": ("Conversion", "convert", "explain", "list_methods"),
    "distributions": ("Distribution", "distribution", "list_distributions"),
    "errors": ("MdfconvError", "MdfconvWarning"),
}
_HOMES = {name: room for room, names in _ROOMS.items() for name in names}


def __getattr__(name: str) -> Any:
    """Import what was asked for by its name: a public one, or the module that has it."""
    if name in _ROOMS:
        return import_module(f"{__name__}.{name}")
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = globals()[name] = getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
    return value


def __dir__() -> list[str]:
    """Return the public names, whether they are imported yet or not."""
    return sorted({*globals(), *_HOMES, *_ROOMS})
