"""Materials by name: what their surfaces reflect at each angle.

Metals are coloured and given by their reflectance along the normal; plastics are not, and given by
their index of refraction.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np

from mdfconv.brdf.fresnel import dielectric, schlick_fresnel
from mdfconv.distributions.evaluation import Array
from mdfconv.errors import check_name, unknown_name

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

# Reflectance for cosines of the angle of incidence.
Fresnel = Callable[[Array | float], Array | float]


@dataclass(frozen=True)
class Material:
    """A material, as far as its reflectance goes.

    Parameters
    ----------
    name : str
        Its name.
    fresnel : callable
        Reflectance for cosines of shape (n,) or (): of the same shape for a grey material, of
        shape (3, n) or (3, 1) for a coloured one, linear Rec. 709.
    """

    name: str
    fresnel: Fresnel


def list_materials() -> list[str]:
    """Return the names of the materials, metals first."""
    return [*METALS, *PLASTICS]


def material(name: str) -> Material:
    """Return a material by name.

    Metals reflect as Schlick's approximation with their F₀ does (1994), plastics exactly.

    Raises
    ------
    MdfconvError
        If the name is unknown.
    """
    key = check_name("material", name).strip().lower()
    if key in METALS:
        normal = np.array(METALS[key])[:, None]
        return Material(key, partial(schlick_fresnel, normal_reflectance=normal))
    if key in PLASTICS:
        return Material(key, partial(dielectric, ior=PLASTICS[key]))
    raise unknown_name("material", name, list_materials())
