"""Reflection with the distribution exchanged, for one light and one viewer at many normals.

A BRDF is a function of D (of an angle, radians), of F (of a cosine) and of the geometry. What is
put in as D is a normalized or a unit form; the constants are those for a normalized one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from mdfconv.brdf.materials import Fresnel
from mdfconv.distributions.evaluation import Array

Density = Callable[[Array], Array]


@dataclass(frozen=True)
class Geometry:
    """Light and viewer above a surface, as they meet normals n.

    Parameters
    ----------
    normals : numpy.ndarray, shape (n, 3)
        Unit vectors with positive cosines to light and viewer.
    light, view : numpy.ndarray, shape (3,)
        Unit vectors.
    """

    normals: Array
    light: Array
    view: Array

    @property
    def half(self) -> Array:
        """The normalized half vector, shape (3,)."""
        return (self.light + self.view) / np.linalg.norm(self.light + self.view)

    @property
    def n_l(self) -> Array:
        """Cosine of normal and light, shape (n,)."""
        return self.normals @ self.light

    @property
    def n_v(self) -> Array:
        """Cosine of normal and viewer, shape (n,)."""
        return self.normals @ self.view

    @property
    def n_h(self) -> Array:
        """Cosine of normal and half vector, shape (n,)."""
        return self.normals @ self.half

    @property
    def h_l(self) -> float:
        """Cosine of half vector and light, or viewer."""
        return float(self.half @ self.light)

    @property
    def half_angle(self) -> Array:
        """The angle of normal and half vector, shape (n,), radians."""
        return _angle(self.normals, self.half)

    @property
    def mirror_angle(self) -> Array:
        """The angle of the light with the viewer's mirror image, shape (n,), radians."""
        return _angle(2 * self.n_v[:, None] * self.normals - self.view, self.light)


def _angle(vectors: Array, direction: Array) -> Array:
    # The angle between unit vectors by the chord: arccos loses its digits near 0.
    chord = np.linalg.norm(vectors - direction, axis=1)
    return 2 * np.arcsin(np.minimum(0.5 * chord, 1))


# 1/sr, shape (n,), or (3, n) for the three channels of a coloured F.
Brdf = Callable[[Density, Fresnel, Geometry], Array]


def v_cavity(n_l: Array, n_v: Array, n_h: Array, h_l: Array | float) -> Array:
    """Return the V-cavity masking and shadowing of Torrance & Sparrow 1967, in [0, 1]."""
    return np.minimum(1, 2 * n_h * np.minimum(n_l, n_v) / h_l)


def ashikhmin_shirley(density: Density, fresnel: Fresnel, at: Geometry) -> Array:
    """Return D F / (4 (h·l) max(n·l, n·v)) (Ashikhmin & Shirley 2000)."""
    light = density(at.half_angle) * fresnel(at.h_l)
    return light / (4 * at.h_l * np.maximum(at.n_l, at.n_v))


def cook_torrance(density: Density, fresnel: Fresnel, at: Geometry) -> Array:
    """Return D F G / (4 (n·l) (n·v)) with V-cavity G (Cook & Torrance 1981)."""
    masking = v_cavity(at.n_l, at.n_v, at.n_h, at.h_l)
    return density(at.half_angle) * fresnel(at.h_l) * masking / (4 * at.n_l * at.n_v)


def smoothie(density: Density, fresnel: Fresnel, at: Geometry) -> Array:
    """Return D F / (h·h), h = l + v not normalized (Smoothie: an empirical BRDF).

    That is D F G / (4 (n·l) (n·v)) with the G = 4 (n·l) (n·v) / (h·h) of Kelemen and
    Szirmay-Kalos 2001. With the Smoothie distribution for D it is the article's exact BRDF.
    """
    return density(at.half_angle) * fresnel(at.h_l) / (4 * at.h_l**2)


def smoothie_approx(density: Density, fresnel: Fresnel, at: Geometry) -> Array:
    """Return D F / 4 with D at the angle β' of 2 sin β' = ‖h − n (n·h)‖, and no G.

    The article replaces 4 sin²β, in its D, by ‖h − n (n·h)‖² with h = l + v not normalized;
    any D follows at the angle of which this is the sine. 4 is what h·h is for light from
    where the viewer is. The highlight is too wide by 1/(h·l).
    """
    angle = np.arcsin(at.h_l * np.sin(at.half_angle))
    return density(angle) * fresnel(at.h_l) / 4


def modified_phong(density: Density, fresnel: Fresnel, at: Geometry) -> Array:
    """Return D(θ_r) F(n·v), θ_r the angle of the light with the viewer's mirror image.

    The modified Phong BRDF (γ+2)/(2π) cos^γ θ_r (Lafortune & Willems 1994) is Blinn/Phong's
    normalized D, N = γ, at θ_r for β: any D fits into that place, and a normalized one
    reflects all energy to a viewer along the normal. 0 from θ_r = π/2 on, where a lobe with
    long tails, such as GGX's, ends with an edge.
    """
    angle = at.mirror_angle
    lobe = np.where(angle < 0.5 * np.pi, density(np.minimum(angle, 0.5 * np.pi)), 0)
    return lobe * fresnel(at.n_v)


BRDFS: dict[str, Brdf] = {
    "ashikhmin-shirley": ashikhmin_shirley,
    "cook-torrance": cook_torrance,
    "smoothie": smoothie,
    "smoothie-approx": smoothie_approx,
    "modified-phong": modified_phong,
}
