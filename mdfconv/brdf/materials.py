"""Materials by name: what their surfaces reflect at each angle.

Metals are coloured and given by their reflectance along the normal; plastics are not, and given by
their index of refraction.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np

from mdfconv.brdf.fresnel import Fresnel, dielectric, schlick_fresnel
from mdfconv.registry import Registry

# F₀ in linear Rec. 709 R, G, B: Lagarde 2011, "Feeding a physically based shading model", from
# measured η and k; iron is that of Hoffman's course notes of 2010.
METALS: Mapping[str, tuple[float, float, float]] = {
    "gold": (1.0, 0.766, 0.336),
    "silver": (0.972, 0.960, 0.915),
    "copper": (0.955, 0.637, 0.538),
    "nickel": (0.660, 0.609, 0.526),
    "iron": (0.560, 0.570, 0.580),
    "chrome": (0.550, 0.556, 0.554),
}
# Index of refraction at the sodium line (589 nm), typical values of the handbooks.
PLASTICS: Mapping[str, float] = {
    "polypropylene": 1.49,
    "acrylic": 1.491,
    "polyethylene": 1.51,
    "pvc": 1.53,
    "polycarbonate": 1.585,
    "polystyrene": 1.59,
}


@dataclass(frozen=True)
class Material:
    """A material, as far as its reflectance goes.

    Parameters
    ----------
    name : str
        Its name.
    fresnel : callable
        Reflectance of cosines; of a coloured one in linear Rec. 709 R, G, B.
    """

    name: str
    fresnel: Fresnel


_REGISTRY: Registry[Material] = Registry("material")
for _name, _color in METALS.items():
    _normal = np.array(_color)[:, None]
    _REGISTRY.add(_name, Material(_name, partial(schlick_fresnel, normal_reflectance=_normal)))
for _name, _index in PLASTICS.items():
    _REGISTRY.add(_name, Material(_name, partial(dielectric, ior=_index)))


def list_materials() -> list[str]:
    """Return the names of the materials, metals first."""
    return _REGISTRY.names


def material(name: str) -> Material:
    """Return a material by name.

    Metals reflect as Schlick's approximation with their F₀ does (1994), plastics exactly.

    Raises
    ------
    MdfconvError
        If the name is unknown.
    """
    return _REGISTRY[name]
