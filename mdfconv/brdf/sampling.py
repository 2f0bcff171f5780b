"""Directions drawn in proportion to distributions, with their densities.

Random numbers u₁, u₂ are uniform on [0, 1), of any shape; directions are unit vectors, shape
(..., 3), with the surface normal along z. Densities are per solid angle, 1/sr.
"""

from __future__ import annotations

import numpy as np

from mdfconv.brdf.directions import direction, dot, unit
from mdfconv.brdf.masking import Roughness, smith_g1
from mdfconv.brdf.microfacet import density
from mdfconv.distributions import distribution
from mdfconv.distributions.evaluation import Array
from mdfconv.errors import unknown_name


def half_vectors(name: str, alpha: Roughness, u1: Array, u2: Array) -> Array:
    """Draw microfacet normals with density D cos θ.

    Parameters
    ----------
    name : str
        ``"ggx"``: tan²θ = α² ξ/(1−ξ); ``"beckmann"``: tan²θ = −α² ln(1−ξ) (Walter et al. 2007,
        eqs 28, 35).
    alpha : float or tuple of two floats
        Roughness, > 0.
    u1, u2 : numpy.ndarray
        Uniform random numbers.

    Raises
    ------
    MdfconvError
        For other distributions.
    """
    squares = {"ggx": lambda u: u / (1 - u), "beckmann": lambda u: -np.log1p(-u)}
    if name not in squares:
        raise unknown_name("sampled distribution", name, list(squares))
    radius, phi = np.sqrt(squares[name](u1)), 2 * np.pi * u2
    alpha_x, alpha_y = alpha if isinstance(alpha, tuple) else (alpha, alpha)
    slopes = [alpha_x * radius * np.cos(phi), alpha_y * radius * np.sin(phi)]
    return unit(np.stack([*slopes, np.ones_like(radius)], axis=-1))


def half_vector_density(name: str, alpha: Roughness, m: Array) -> Array:
    """Return the density of `half_vectors`: D cos θ."""
    return density(distribution(name), alpha, m) * np.maximum(m[..., 2], 0)


def visible_normals(view: Array, alpha: Roughness, u1: Array, u2: Array) -> Array:
    """Draw the microfacet normals of GGX that a viewer sees (Heitz 2018).

    Parameters
    ----------
    view : numpy.ndarray, shape (..., 3)
        Unit vector above the surface.
    alpha : float or tuple of two floats
        Roughness, > 0.
    u1, u2 : numpy.ndarray
        Uniform random numbers.
    """
    alpha_x, alpha_y = alpha if isinstance(alpha, tuple) else (alpha, alpha)
    scale = np.array([alpha_x, alpha_y, 1.0])
    stretched = unit(view * scale)
    # One axis is level, the other rises towards the normal: that is where the disk is squeezed.
    x, y, _ = np.moveaxis(stretched, -1, 0)
    azimuth = np.arctan2(x, -y)
    first = direction(np.full_like(azimuth, np.pi / 2), np.where(x * x + y * y > 0, azimuth, 0))
    second = np.cross(stretched, first)
    radius, phi = np.sqrt(u1), 2 * np.pi * u2
    t1, t2 = radius * np.cos(phi), radius * np.sin(phi)
    share = 0.5 * (1 + stretched[..., 2])
    t2 = (1 - share) * np.sqrt(np.maximum(0, 1 - t1 * t1)) + share * t2
    t3 = np.sqrt(np.maximum(0, 1 - t1 * t1 - t2 * t2))
    normal = t1[..., None] * first + t2[..., None] * second + t3[..., None] * stretched
    normal = normal * scale
    normal[..., 2] = np.maximum(normal[..., 2], 1e-300)
    return unit(normal)


def visible_normal_density(view: Array, alpha: Roughness, m: Array) -> Array:
    """Return the density of `visible_normals`: G₁ D max(0, v·m)/(n·v)."""
    shadow = smith_g1("ggx", view, m, alpha)
    facing = np.maximum(dot(view, m), 0)
    return shadow * density(distribution("ggx"), alpha, m) * facing / view[..., 2]


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
    first, second = _basis(np.broadcast_to(axis, local.shape))
    return local[..., :1] * first + local[..., 1:2] * second + local[..., 2:] * axis


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


def _basis(axis: Array) -> tuple[Array, Array]:
    """Return two unit vectors that make a right-handed frame with an axis (Duff et al. 2017)."""
    x, y, z = np.moveaxis(axis, -1, 0)
    sign = np.where(z < 0, -1.0, 1.0)
    a = -1 / (sign + z)
    b = x * y * a
    first = np.stack([1 + sign * x * x * a, sign * b, -sign * x], axis=-1)
    return first, np.stack([b, sign + y * y * a, -y], axis=-1)
