"""Reflection by microfacets: D F G / (4 (n·l)(n·v)).

Directions are unit vectors, shape (..., 3), with the surface normal along z.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from mdfconv.brdf.directions import angles, dot, half_vector
from mdfconv.brdf.masking import Masking
from mdfconv.distributions import Distribution
from mdfconv.distributions.evaluation import Array

Fresnel = Callable[[Array], Array]


def density(distribution: Distribution, parameter: Any, m: Array) -> Array:
    """Return the normalized D at microfacet normals, 1/sr; 0 below the surface.

    Parameters
    ----------
    distribution : Distribution
        The distribution.
    parameter : float or tuple of two floats
        Its parameter; a pair makes it anisotropic.
    m : numpy.ndarray, shape (..., 3)
        Microfacet normals.
    """
    theta, phi = angles(m)
    azimuth = phi if isinstance(parameter, tuple) else None
    value = distribution.normalized(np.minimum(theta, np.pi / 2), parameter, phi=azimuth)
    return np.where(m[..., 2] > 0, value, 0)


def reflection(
    light: Array,
    view: Array,
    distribution: Distribution,
    parameter: Any,
    masking: Masking,
    fresnel: Fresnel | None = None,
) -> Array:
    """Return the microfacet BRDF D F G / (4 (n·l)(n·v)) (Cook & Torrance 1981).

    Parameters
    ----------
    light, view : numpy.ndarray, shape (..., 3)
        Unit vectors; they may change places (Helmholtz reciprocity).
    distribution, parameter
        D, as for `density`.
    masking : callable
        G of (light, view, microfacet normal), such as `mdfconv.brdf.masking.masking` returns.
    fresnel : callable, optional
        F of the cosine l·m; 1 if not given.

    Returns
    -------
    numpy.ndarray, shape (...)
        The BRDF, 1/sr; 0 where light or viewer is not above the surface.
    """
    m = half_vector(light, view)
    above = (light[..., 2] > 0) & (view[..., 2] > 0)
    cosines = np.where(above, light[..., 2] * view[..., 2], 1)
    value = density(distribution, parameter, m) * masking(light, view, m) / (4 * cosines)
    if fresnel is not None:
        value = value * fresnel(dot(light, m))
    return np.where(above, value, 0)


def ashikhmin_shirley(
    light: Array,
    view: Array,
    distribution: Distribution,
    parameter: Any,
    fresnel: Fresnel | None = None,
) -> Array:
    """Return D F / (4 (l·m) max(n·l, n·v)) (Ashikhmin & Shirley 2000, eq. 3).

    Parameters are those of `reflection`.
    """
    m = half_vector(light, view)
    cosine = dot(light, m)
    above = (light[..., 2] > 0) & (view[..., 2] > 0)
    scale = np.where(above, 4 * cosine * np.maximum(light[..., 2], view[..., 2]), 1)
    value = density(distribution, parameter, m) / scale
    if fresnel is not None:
        value = value * fresnel(cosine)
    return np.where(above, value, 0)
