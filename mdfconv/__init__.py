"""Convert roughness between microfacet distributions.

`convert` and `explain` take numbers, arrays and pairs; `convert_mtl`, `convert_gltf`,
`convert_mitsuba` and `convert_texture` whole files and textures. Distributions, methods and
metrics are given by their names: `list_distributions`, `list_methods` and `list_metrics` have
them. What is not named here is in the packages, such as ``mdfconv.brdf``, which need no import
of their own.

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
    from mdfconv.distributions import Distribution, distribution, list_distributions, register
    from mdfconv.errors import MdfconvError, MdfconvWarning
    from mdfconv.fitting.metrics import list_metrics, metric_named, register_metric
    from mdfconv.scene import (
        TextureRule,
        convert_gltf,
        convert_mitsuba,
        convert_mtl,
        convert_texture,
        convert_texture_file,
    )

__version__ = "0.1.0"

__all__ = [
    "Conversion",
    "Distribution",
    "MdfconvError",
    "MdfconvWarning",
    "TextureRule",
    "__version__",
    "convert",
    "convert_gltf",
    "convert_mitsuba",
    "convert_mtl",
    "convert_texture",
    "convert_texture_file",
    "distribution",
    "explain",
    "list_distributions",
    "list_methods",
    "list_metrics",
    "metric_named",
    "register",
    "register_metric",
]

# Imported when they are asked for: the command line takes a Ctrl-C during imports, which those of
# the package itself would precede.
_ROOMS = {
    "conversion": ("Conversion", "convert", "explain", "list_methods"),
    "distributions": ("Distribution", "distribution", "list_distributions", "register"),
    "errors": ("MdfconvError", "MdfconvWarning"),
    "fitting.metrics": ("list_metrics", "metric_named", "register_metric"),
    "scene": (
        "TextureRule",
        "convert_gltf",
        "convert_mitsuba",
        "convert_mtl",
        "convert_texture",
        "convert_texture_file",
    ),
}
_HOMES = {name: room for room, names in _ROOMS.items() for name in names}


def __getattr__(name: str) -> Any:
    """Import what was asked for by its name: a public one, or a module of the package."""
    if name in _HOMES:
        value = globals()[name] = getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
        return value
    if not name.startswith("_"):
        from importlib.util import find_spec

        if find_spec(f"{__name__}.{name}"):
            return import_module(f"{__name__}.{name}")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    """Return the public names, whether they are imported yet or not."""
    return sorted(__all__)
