"""Directions: arrays of unit vectors, shape (..., 3), in a frame whose z axis is the normal."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from mdfconv.distributions.evaluation import Array

# A BRDF of (light, view), 1/sr, 0 where either is not above the surface. In colour the three
# channels come first: shape (3, n) for directions of shape (n, 3).
Brdf: TypeAlias = Callable[[Array, Array], Array]

_MIRROR = np.array([-1.0, -1.0, 1.0])


def direction(theta: Array | float, phi: Array | float = 0.0) -> Array:
    """Return unit vectors for angles from the normal and azimuths, radians."""
    sine = np.sin(theta)
    axes = np.broadcast_arrays(sine * np.cos(phi), sine * np.sin(phi), np.cos(theta))
    return np.stack(axes, axis=-1)


def dot(a: Array, b: Array) -> Array:
    """Return the scalar product over the last axis."""
    product: Array = np.einsum("...i,...i->...", a, b)
    return product


def unit(vectors: Array) -> Array:
    """Return vectors at length 1."""
    length: Array = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return vectors / length


def reflect(view: Array, normal: Array) -> Array:
    """Return the mirror images of directions at normals: 2 (v·m) m − v."""
    return 2 * dot(view, normal)[..., None] * normal - view


def mirrored(view: Array) -> Array:
    """Return the mirror images of directions at the surface normal, exactly: (−x, −y, z)."""
    return view * _MIRROR


def half_vector(light: Array, view: Array) -> Array:
    """Return the normalized half vectors."""
    return unit(light + view)


def above(light: Array, view: Array) -> NDArray[np.bool_]:
    """Return where light and viewer both are above the surface."""
    both: NDArray[np.bool_] = (light[..., 2] > 0) & (view[..., 2] > 0)
    return both


def polar_angle(vectors: Array) -> Array:
    """Return the angle from the normal, radians, accurate at both ends."""
    x, y, z = np.moveaxis(vectors, -1, 0)
    return np.arctan2(np.hypot(x, y), z)


def azimuth(vectors: Array) -> Array:
    """Return the azimuth from the x axis, radians."""
    return np.arctan2(vectors[..., 1], vectors[..., 0])


def frames(normals: Array) -> Array:
    """Return right-handed orthonormal frames whose z axes are normals (Duff et al. 2017).

    Parameters
    ----------
    normals : numpy.ndarray, shape (..., 3)
        Unit vectors.

    Returns
    -------
    numpy.ndarray, shape (..., 3, 3)
        The axes as rows: a matrix times a direction is that direction in the frame.
    """
    x, y, z = np.moveaxis(normals, -1, 0)
    sign = np.where(z < 0, -1.0, 1.0)
    a = -1 / (sign + z)
    b = x * y * a
    first = np.stack([1 + sign * x * x * a, sign * b, -sign * x], axis=-1)
    second = np.stack([b, sign + y * y * a, -y], axis=-1)
    return np.stack([first, second, normals], axis=-2)
