"""Fresnel reflectance: exact for dielectrics and conductors, and the usual approximations.

Every function takes cosines of the angle of incidence in [0, 1], of any shape, and returns the
unpolarized reflectance in the same shape, float64.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from mdfconv.distributions.evaluation import Array
from mdfconv.errors import MdfconvError
from mdfconv.registry import Registry

# Reflectance for cosines of the angle of incidence, shape (n,) or (): of their shape for a grey
# material, of shape (3, n) or (3, 1) for a coloured one.
Fresnel: TypeAlias = Callable[[Array], Array | float]

NORMAL_REFLECTANCE = 0.04  # a dielectric of index 1.5
# The constants that the article on Smoothie prints.
SMOOTHIE_FIT = (-1.71983, -5.43926)


def lossless(cosine: Array) -> float:
    """Return 1, the reflectance of what absorbs nothing."""
    return 1.0


def dielectric(cosine: ArrayLike, ior: float) -> Array:
    """Return the exact reflectance of a dielectric (Fresnel 1823; Born & Wolf, 1.5.2).

    Parameters
    ----------
    cosine : array_like
        Cosine of the angle of incidence, [0, 1].
    ior : float
        Relative index of refraction, far side over near side; below 1 from the inside, with
        total internal reflection beyond the critical angle.

    Returns
    -------
    numpy.ndarray
        ½ (r_s² + r_p²), in [0, 1]. Next to the critical angle, where the slope is infinite,
        it is exact for a cosine within rounding of this one.

    Raises
    ------
    MdfconvError
        If the index is not a positive finite number.
    """
    index = check_index(ior)
    # Only from the inside is there a critical angle, beyond which the root is imaginary.
    return _unpolarized(cosine, index if index > 1 else complex(index))


def conductor(cosine: ArrayLike, eta: float, k: float) -> Array:
    """Return the exact reflectance of a conductor (Born & Wolf, 14.2).

    Parameters
    ----------
    cosine : array_like
        Cosine of the angle of incidence, [0, 1].
    eta, k : float
        Relative index of refraction and extinction coefficient, m = η + ik. With k = 0 it is
        a dielectric.

    Returns
    -------
    numpy.ndarray
        ½ (|r_s|² + |r_p|²), in [0, 1].

    Raises
    ------
    MdfconvError
        If η is not positive or k is negative.
    """
    if not (np.isfinite(k) and k >= 0):
        raise MdfconvError(f"the extinction coefficient is at least 0, not {k:g}")
    return _unpolarized(cosine, complex(check_index(eta), k)) if k else dielectric(cosine, eta)


def check_index(ior: float) -> float:
    """Return an index of refraction; raise `MdfconvError` unless positive and finite."""
    if not (np.isfinite(ior) and ior > 0):
        raise MdfconvError(f"an index of refraction is a positive number, not {ior:g}")
    return float(ior)


def _unpolarized(cosine: ArrayLike, index: complex | float) -> Array:
    """Return ½ (|r_s|² + |r_p|²) for m = `index`.

    With z = √(m² − 1 + c²) the usual r_s = (c − z)/(c + z) and r_p = (m²c − z)/(m²c + z) become,
    expanded by their denominators, −(m²−1)/(c+z)² and (m²−1) ((m²+1)c² − 1)/(m²c+z)²: sums of
    what does not cancel for m near 1. Total internal reflection is an imaginary z.
    """
    c = np.asarray(cosine, float)
    contrast = (index - 1) * (index + 1)
    if contrast == 0:
        return np.zeros_like(c)
    square = index * index
    z = np.sqrt(contrast + c * c)
    perpendicular = contrast / np.square(c + z)
    parallel = contrast * ((square + 1) * (c * c) - 1) / np.square(square * c + z)
    reflected = 0.5 * (np.abs(perpendicular) ** 2 + np.abs(parallel) ** 2)
    # Rounding may miss the whole, next to the critical angle, or exceed it.
    return np.where(z.real == 0, 1, np.minimum(reflected, 1))


def normal_reflectance(ior: float) -> float:
    """Return F₀ = ((n₁−n₂)/(n₁+n₂))², the reflectance along the normal.

    Parameters
    ----------
    ior : float
        Relative index of refraction n₂/n₁; its reciprocal has the same F₀.

    Raises
    ------
    MdfconvError
        If the index is not a positive finite number.
    """
    return ((check_index(ior) - 1) / (ior + 1)) ** 2


def dielectric_index(reflectance: ArrayLike) -> Array:
    """Return n ≥ 1 of a dielectric, the inverse of `normal_reflectance`.

    Parameters
    ----------
    reflectance : array_like
        F₀, [0, 1).

    Returns
    -------
    numpy.ndarray
        n₂/n₁ = (1 + √F₀)/(1 − √F₀), in the shape of `reflectance`.
    """
    root = np.sqrt(np.asarray(reflectance, float))
    return np.asarray((1 + root) / (1 - root))


def schlick_fresnel(
    cosine: Array | float, normal_reflectance: Array | float = NORMAL_REFLECTANCE
) -> Array | float:
    """Return Schlick's approximation F₀ + (1−F₀) (1−cos)⁵ (Schlick 1994, equation 15)."""
    square = (1 - cosine) * (1 - cosine)
    return normal_reflectance + (1 - normal_reflectance) * (square * square * (1 - cosine))


def smoothie_fresnel(
    cosine: ArrayLike, a: float = SMOOTHIE_FIT[0], b: float = SMOOTHIE_FIT[1]
) -> Array:
    """Return exp2(a + b (l·h)), h = l + v not normalized (Smoothie: an empirical BRDF).

    Like Schlick's (1−cos)⁵ it leads from the reflectance along the normal, F₀, to 1: the
    reflectance is F₀ + (1−F₀) times it. It is at most 2^a.

    Parameters
    ----------
    cosine : array_like
        l·H for the normalized half vector H, [0, 1]; l·h = 2 (l·H)².
    a, b : float
        The constants; by default the printed ones.
    """
    return np.exp2(a + 2 * b * np.square(np.asarray(cosine, float)))


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
    """A material, as far as its reflectance goes: of a coloured one in linear Rec. 709 R, G, B."""

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
