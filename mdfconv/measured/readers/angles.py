"""Directions as other coordinates have them."""

from __future__ import annotations

import numpy as np

from mdfconv.brdf.directions import direction, mirrored
from mdfconv.distributions.evaluation import Array


def turn_from_normal(vectors: Array, theta: Array, phi: Array) -> Array:
    """Return vectors, shape (n, 3), turned as the normal has to be to come to (θ, φ).

    First by θ in the plane of x and z, then by φ about the normal.
    """
    x, y, z = np.moveaxis(vectors, -1, 0)
    x, z = np.cos(theta) * x + np.sin(theta) * z, np.cos(theta) * z - np.sin(theta) * x
    return np.stack([np.cos(phi) * x - np.sin(phi) * y, np.sin(phi) * x + np.cos(phi) * y, z], -1)


def from_half_and_difference(
    theta_half: Array, phi_half: Array, theta_difference: Array, phi_difference: Array
) -> tuple[Array, Array]:
    """Return the two directions of the coordinates of Rusinkiewicz 1998, each of shape (n, 3).

    Parameters
    ----------
    theta_half, phi_half : numpy.ndarray, shape (n,)
        Zenith and azimuth of the half vector, radians.
    theta_difference, phi_difference : numpy.ndarray, shape (n,)
        Those of the first direction where the half vector is the normal.

    Returns
    -------
    tuple of numpy.ndarray
        The first direction, and the one on the other side of the half vector.
    """
    first = direction(theta_difference, phi_difference)
    second = mirrored(first)
    return (
        turn_from_normal(first, theta_half, phi_half),
        turn_from_normal(second, theta_half, phi_half),
    )
