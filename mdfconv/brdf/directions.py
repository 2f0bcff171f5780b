"""Directions: arrays of unit vectors, shape (..., 3), in a frame whose z axis is the normal."""

from __future__ import annotations

import numpy as np

from mdfconv.distributions.evaluation import Array

_MIRROR = np.array([-1.0, -1.0, 1.0])


def direction(theta: Array | float, phi: Array | float = 0.0) -> Array:
    """Return unit vectors for angles from the normal and azimuths, radians."""
    theta, phi = np.broadcast_arrays(np.asarray(theta, float), np.asarray(phi, float))
    sine = np.sin(theta)
    return np.stack([sine * np.cos(phi), sine * np.sin(phi), np.cos(theta)], axis=-1)


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


def angles(vectors: Array) -> tuple[Array, Array]:
    """Return the angle from the normal and the azimuth, radians, accurate at both ends."""
    x, y, z = np.moveaxis(vectors, -1, 0)
    return np.arctan2(np.hypot(x, y), z), np.arctan2(y, x)
