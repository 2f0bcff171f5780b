"""Microfacet reflection with the distribution exchanged.

Every function takes cosines: ``n_l`` and ``n_v`` of the normal with light and viewer, ``n_h``
of the normal with the half vector, ``h_l`` of the half vector with the light (or viewer).
"""

from __future__ import annotations

import numpy as np

from mdfconv.distributions.evaluation import Array

NORMAL_REFLECTANCE = 0.04  # a dielectric of index 1.5


def schlick_fresnel(
    h_l: Array | float, normal_reflectance: float = NORMAL_REFLECTANCE
) -> Array | float:
    """Return Schlick's approximation F₀ + (1−F₀) (1−cos)⁵ (Schlick 1994)."""
    return normal_reflectance + (1 - normal_reflectance) * (1 - h_l) ** 5


def v_cavity(n_l: Array, n_v: Array, n_h: Array, h_l: Array | float) -> Array:
    """Return the V-cavity masking and shadowing of Torrance & Sparrow 1967, in [0, 1]."""
    return np.minimum(1, 2 * n_h * np.minimum(n_l, n_v) / h_l)


def ashikhmin_shirley(
    density: Array, n_l: Array, n_v: Array, n_h: Array, h_l: Array | float
) -> Array:
    """Return D F / (4 (h·l) max(n·l, n·v)) (Ashikhmin & Shirley 2000), 1/sr.

    Parameters
    ----------
    density : numpy.ndarray
        D at the half vector, in whatever form.
    n_l, n_v, n_h, h_l : array_like
        Cosines; positive for light and viewer above the surface.
    """
    return density * schlick_fresnel(h_l) / (4 * h_l * np.maximum(n_l, n_v))


def cook_torrance(density: Array, n_l: Array, n_v: Array, n_h: Array, h_l: Array | float) -> Array:
    """Return D F G / (4 (n·l) (n·v)) with V-cavity G (Cook & Torrance 1981), 1/sr.

    Parameters are those of `ashikhmin_shirley`.
    """
    return density * schlick_fresnel(h_l) * v_cavity(n_l, n_v, n_h, h_l) / (4 * n_l * n_v)


BRDFS = {"ashikhmin-shirley": ashikhmin_shirley, "cook-torrance": cook_torrance}
