"""Directions: arrays of unit vectors, shape (..., 3), in a frame whose z axis is the normal."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from mdfconv.distributions import Distribution
from mdfconv.distributions.endpoint import follow, to_root
from mdfconv.distributions.evaluation import Array
from mdfconv.errors import MdfconvError
from mdfconv.registry import Registry

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
    return np.einsum("...i,...i->...", a, b)


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
    return (light[..., 2] > 0) & (view[..., 2] > 0)


def polar_angle(vectors: Array) -> Array:
    """Return the angle from the normal, radians, accurate at both ends."""
    x, y, z = np.moveaxis(vectors, -1, 0)
    return np.arctan2(np.hypot(x, y), z)


def azimuth(vectors: Array) -> Array:
    """Return the azimuth from the x axis, radians."""
    return np.arctan2(vectors[..., 1], vectors[..., 0])


def frames(normals: Array) -> Array:
    """Return right-handed orthonormal frames whose z axes are normals (Duff et al. 2017).

    The axes are the rows, shape (..., 3, 3): a matrix times a direction is that direction in the
    frame.
    """
    x, y, z = np.moveaxis(normals, -1, 0)
    sign = np.where(z < 0, -1.0, 1.0)
    a = -1 / (sign + z)
    b = x * y * a
    first = np.stack([1 + sign * x * x * a, sign * b, -sign * x], axis=-1)
    second = np.stack([b, sign + y * y * a, -y], axis=-1)
    return np.stack([first, second, normals], axis=-2)


# Of an isotropic surface, or along x and y of an anisotropic one.
Roughness: TypeAlias = float | tuple[float, float]

# Its facets, moved together, make an ellipsoid, of which one can draw what a viewer sees.
_ELLIPSOID = "ggx"
# The z of a normal that is level but for rounding: the facet belongs to the upper side.
_LEVEL = 1e-300


@dataclass(frozen=True)
class Microsurface:
    """A distribution with its parameter, and what follows from it.

    Parameters
    ----------
    distribution : Distribution
        That of the microfacets' normals.
    parameter : float or tuple of two floats
        Its parameter; a pair makes it anisotropic.
    normalized : bool
        Whether D is the normalized form (1/sr) or the unit form. Masking and sampling do not
        depend on it.

    Raises
    ------
    MdfconvError
        If the parameter is illegal, or a pair and the distribution takes none.
    """

    distribution: Distribution
    parameter: Roughness
    normalized: bool = True

    def __post_init__(self) -> None:
        if isinstance(self.parameter, tuple):
            if not self.distribution.anisotropic:
                raise MdfconvError(f"{self.distribution.label} takes no pair of parameters")
            if len(self.parameter) != 2:
                raise MdfconvError(f"expected a number or a pair, got {len(self.parameter)} values")
        for value in _pair(self.parameter):
            self.distribution.parameter.check_one(value, self.distribution.label)

    def at_slope(self, slope: Array, phi: Array | None = None) -> Array:
        """Return D at tangents of angles from the normal, and azimuths if it has a pair."""
        form = self.distribution.normalized if self.normalized else self.distribution.unit
        return np.asarray(form(slope, self.parameter, phi=phi, variable="slope"))

    def density(self, m: Array) -> Array:
        """Return D at microfacet normals, shape (..., 3); 0 below the surface."""
        return np.where(m[..., 2] > 0, self.at_slope(*self.slopes(m)), 0)

    def slopes(self, m: Array) -> tuple[Array, ...]:
        """Return the slopes of normals for `at_slope`, infinite for one that is not above."""
        x, y, z = np.moveaxis(m, -1, 0)
        slope = np.full(z.shape, np.inf)
        np.divide(np.sqrt(x * x + y * y), z, out=slope, where=z > 0)
        return (slope, azimuth(m)) if isinstance(self.parameter, tuple) else (slope,)

    def smith_lambda(self, omega: Array) -> Array:
        """Return Smith's Λ for directions.

        Parameters
        ----------
        omega : numpy.ndarray, shape (..., 3)
            The directions; above or below the surface alike.

        Returns
        -------
        numpy.ndarray, shape (...)
            Λ ≥ 0, infinite at grazing.

        Raises
        ------
        MdfconvError
            If there is a pair of parameters and D does not scale with the slope.
        """
        if isinstance(self.parameter, tuple) and not self.distribution.scales_with_slope:
            raise MdfconvError(
                f"{self.distribution.label} has no Smith's masking for a pair of parameters",
                "give one parameter, or choose another masking",
            )
        # α tan θ along the azimuth of the direction is that of the rougher axis, shortened.
        pair = _pair(self.parameter)
        rougher = max(pair)
        x, y, z = np.moveaxis(omega, -1, 0)
        with np.errstate(divide="ignore", over="ignore"):
            tangent = np.hypot(pair[0] / rougher * x, pair[1] / rougher * y) / np.abs(z)
            return self.distribution.smith_lambda(tangent, rougher)

    def smith_g1(self, omega: Array, m: Array) -> Array:
        """Return Smith's G₁ = 1/(1+Λ) for directions, 0 where they see the facet from behind."""
        return np.where(_faces(omega, m), 1 / (1 + self.smith_lambda(omega)), 0)

    def separable(self, light: Array, view: Array, m: Array) -> Array:
        """Return the separable G = G₁(l) G₁(v) (Walter et al. 2007, eq. 23)."""
        return self.smith_g1(light, m) * self.smith_g1(view, m)

    def correlated(self, light: Array, view: Array, m: Array) -> Array:
        """Return the height-correlated G = 1/(1 + Λ_l + Λ_v) (Heitz 2014, eq. 99)."""
        value = 1 / (1 + self.smith_lambda(light) + self.smith_lambda(view))
        return np.where(_faces(light, m) & _faces(view, m), value, 0)

    def half_vectors(self, u1: Array, u2: Array) -> Array:
        """Draw microfacet normals with density D cos θ, by F or, for a pair, by stretched slopes.

        Raises
        ------
        MdfconvError
            If there is a pair of parameters and D does not scale with the slope.
        """
        phi = 2 * np.pi * u2
        if not isinstance(self.parameter, tuple):
            return direction(self.distribution.sample(u1, self.parameter), phi)
        if not self.distribution.scales_with_slope:
            raise MdfconvError(f"{self.distribution.label} has no sampler for a pair of parameters")
        slope = np.tan(self.distribution.sample(u1, 1.0))
        x, y = self.parameter
        stretched = [x * slope * np.cos(phi), y * slope * np.sin(phi), np.ones_like(slope)]
        return unit(np.stack(stretched, axis=-1))

    def half_vector_density(self, m: Array) -> Array:
        """Return the density of `half_vectors`, 1/sr: D cos θ."""
        return replace(self, normalized=True).density(m) * np.maximum(m[..., 2], 0)

    @cached_property
    def _ellipsoid(self) -> Array | None:
        """The α of GGX along x and y, if it is that by whatever name."""
        root, steps, _ = to_root(self.distribution, same_lobe=True)
        return follow(steps, np.array(_pair(self.parameter))) if root.name == _ELLIPSOID else None

    @property
    def has_visible_normals(self) -> bool:
        """Whether `visible_normals` can be drawn: of GGX, by whatever name."""
        return self._ellipsoid is not None

    def visible_normals(self, view: Array, u1: Array, u2: Array) -> Array:
        """Draw the microfacet normals that a viewer sees (Heitz 2018).

        Parameters
        ----------
        view : numpy.ndarray, shape (..., 3)
            Unit vector above the surface.
        u1, u2 : numpy.ndarray
            Uniform random numbers.

        Raises
        ------
        MdfconvError
            If the distribution is not GGX.
        """
        if self._ellipsoid is None:
            raise MdfconvError(
                f"{self.distribution.label} has no sampler of visible normals",
                f"{_ELLIPSOID} has one",
            )
        scale = np.append(self._ellipsoid, 1.0)
        stretched = unit(view * scale)
        # One axis is level, the other rises towards the normal: where the disk is squeezed.
        x, y, _ = np.moveaxis(stretched, -1, 0)
        turned = np.where(x * x + y * y > 0, np.arctan2(x, -y), 0)
        first = direction(np.full_like(turned, np.pi / 2), turned)
        second = np.cross(stretched, first)
        radius, phi = np.sqrt(u1), 2 * np.pi * u2
        t1, t2 = radius * np.cos(phi), radius * np.sin(phi)
        share = 0.5 * (1 + stretched[..., 2])
        t2 = (1 - share) * np.sqrt(np.maximum(0, 1 - t1 * t1)) + share * t2
        t3 = np.sqrt(np.maximum(0, 1 - t1 * t1 - t2 * t2))
        normal = t1[..., None] * first + t2[..., None] * second + t3[..., None] * stretched
        normal = normal * scale
        normal[..., 2] = np.maximum(normal[..., 2], _LEVEL)
        return unit(normal)

    def visible_normal_density(self, view: Array, m: Array) -> Array:
        """Return the density of `visible_normals`, 1/sr: G₁ D max(0, v·m)/(n·v)."""
        shadow = self.smith_g1(view, m) * replace(self, normalized=True).density(m)
        return shadow * np.maximum(dot(view, m), 0) / view[..., 2]


def _pair(parameter: Roughness) -> tuple[float, float]:
    """Return the parameter along x and y."""
    return parameter if isinstance(parameter, tuple) else (parameter, parameter)


def _faces(omega: Array, m: Array) -> NDArray[np.bool_]:
    """Return where directions see the same side of the facet and of the surface."""
    return dot(omega, m) * omega[..., 2] > 0


Masking: TypeAlias = Callable[[Array, Array, Array], Array]


def v_cavity(light: Array, view: Array, m: Array) -> Array:
    """Return min(1, 2 (n·m)(n·l)/(l·m), 2 (n·m)(n·v)/(v·m)) (Torrance & Sparrow 1967)."""
    least = np.minimum(light[..., 2], view[..., 2])
    with np.errstate(divide="ignore", invalid="ignore"):
        value = 2 * m[..., 2] * least / dot(view, m)
    return np.where(least > 0, np.minimum(1, value), 0)


def kelemen_szirmay_kalos(light: Array, view: Array, m: Array) -> Array:
    """Return 4 (n·l)(n·v)/(h·h), h = l + v (Kelemen & Szirmay-Kalos 2001).

    It stands for G in D F G / (4 (n·l)(n·v)), whose denominator it cancels; it may exceed 1.
    """
    # |h|², whose sum 2 + 2 l·v would lose its digits where both graze.
    square = np.square(light + view).sum(axis=-1)
    value = 4 * light[..., 2] * view[..., 2] / np.where(square > 0, square, 1)
    return np.where(above(light, view), value, 0)


def no_masking(light: Array, view: Array, m: Array) -> Array:
    """Return 1 for directions above the surface."""
    return np.where(above(light, view), 1.0, 0)


MASKINGS: Registry[Callable[[Microsurface], Masking]] = Registry("masking")
MASKINGS.add("correlated", lambda surface: surface.correlated)
MASKINGS.add("separable", lambda surface: surface.separable)
MASKINGS.add("v-cavity", lambda surface: v_cavity)
MASKINGS.add("ksk", lambda surface: kelemen_szirmay_kalos)
MASKINGS.add("none", lambda surface: no_masking)
