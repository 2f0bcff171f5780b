"""Directions drawn around an axis, and the densities of reflected ones.

Random numbers u₁, u₂ are uniform on [0, 1), of any shape; directions are unit vectors, shape
(..., 3). Densities are per solid angle, 1/sr. What belongs to a distribution is drawn by
`mdfconv.brdf.microsurface`.
"""

from __future__ import annotations

import numpy as np

from mdfconv.brdf.directions import direction, dot, frames
from mdfconv.distributions.evaluation import Array


def cosine_lobe(axis: Array, exponent: float, u1: Array, u2: Array) -> Array:
    """Draw directions around an axis with density (γ+1)/(2π) cos^γ (Lafortune & Willems 1994).

    Parameters
    ----------
    axis : numpy.ndarray, shape (..., 3)
        Unit vector; with the normal and γ = 1 the draw is cosine-weighted.
    exponent : float
        γ ≥ 0.
    u1, u2 : numpy.ndarray
        Uniform random numbers.
    """
    # 1 − cos θ = −expm1(ln(1−u)/(γ+1)) keeps the digits of narrow lobes.
    drop = -np.expm1(np.log1p(-u1) / (exponent + 1))
    local = direction(2 * np.arcsin(np.sqrt(0.5 * drop)), 2 * np.pi * u2)
    drawn: Array = np.einsum("...i,...ij->...j", local, frames(axis))
    return drawn


def cosine_lobe_density(axis: Array, exponent: float, omega: Array) -> Array:
    """Return the density of `cosine_lobe`."""
    drop = 0.5 * np.square(omega - axis).sum(axis=-1)
    inside = drop < 1
    power = np.exp(exponent * np.log1p(-np.where(inside, drop, 0)))
    return np.where(inside, (exponent + 1) / (2 * np.pi) * power, 0)


def reflected_density(half_density: Array, view: Array, m: Array) -> Array:
    """Return the density of reflected directions for that of half vectors: p/(4 |v·m|)."""
    cosine = np.abs(dot(view, m))
    return half_density / (4 * np.where(cosine > 0, cosine, np.inf))
