"""Convert roughness between microfacet distributions.

`convert` and `explain` take numbers, arrays and pairs; `convert_mtl`, `convert_gltf`,
`convert_mitsuba` and `convert_texture` whole files and textures; `read` and `fit` measurements.
Distributions, methods and metrics are given by their names: `list_distributions`, `list_methods`
and `list_metrics` have them. What is not named here is in the packages, such as ``mdfconv.brdf``,
which need no import of their own.

Examples
--------
>>> import mdfconv
>>> mdfconv.convert(0.2, "beckmann", "ggx")
0.23552
"""

from collections.abc import Callable
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mdfconv.conversion import Conversion, convert, explain, list_methods
    from mdfconv.distributions import Distribution, distribution, list_distributions, register
    from mdfconv.errors import MdfconvError, MdfconvWarning
    from mdfconv.fitting.metrics import list_metrics, metric_named, register_metric
    from mdfconv.measured import fit, read
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
    "fit",
    "list_distributions",
    "list_methods",
    "list_metrics",
    "metric_named",
    "read",
    "register",
    "register_metric",
]


def lazy_face(package: str, homes: dict[str, tuple[str, ...]]) -> Callable[[str], Any]:
    """Return the `__getattr__` of a package whose names are imported when they are asked for.

    `homes` has the names by the modules of the package that define them; the modules are found,
    too.
    """
    modules = {name: module for module, names in homes.items() for name in names}

    def get(name: str) -> Any:
        if name in modules:
            value = getattr(import_module(f"{package}.{modules[name]}"), name)
            setattr(import_module(package), name, value)
            return value
        if not name.startswith("_"):
            from importlib.util import find_spec

            if find_spec(f"{package}.{name}"):
                return import_module(f"{package}.{name}")
        raise AttributeError(f"module {package!r} has no attribute {name!r}")

    return get


# Lazily, as the command line takes a Ctrl-C during imports, which those of the package itself
# would precede.
_ROOMS = {
    "conversion": ("Conversion", "convert", "explain", "list_methods"),
    "distributions": ("Distribution", "distribution", "list_distributions", "register"),
    "errors": ("MdfconvError", "MdfconvWarning"),
    "fitting.metrics": ("list_metrics", "metric_named", "register_metric"),
    "measured": ("fit", "read"),
    "scene": (
        "TextureRule",
        "convert_gltf",
        "convert_mitsuba",
        "convert_mtl",
        "convert_texture",
        "convert_texture_file",
    ),
}
__getattr__ = lazy_face(__name__, _ROOMS)


def __dir__() -> list[str]:
    """Return the public names, whether they are imported yet or not."""
    return sorted(__all__)
