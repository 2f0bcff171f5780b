"""The BRDFs into which a distribution can be put.

Each is built from a microsurface, whose D it takes in the form that the surface has, and a Fresnel
term F of a cosine; the constants are those for a normalized D.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from mdfconv.brdf.directions import Brdf, above
from mdfconv.brdf.fresnel import Fresnel
from mdfconv.brdf.masking import Masking, v_cavity
from mdfconv.brdf.microsurface import Microsurface
from mdfconv.brdf.phong import around_mirror
from mdfconv.distributions.evaluation import Array
from mdfconv.registry import Registry

# What a BRDF has beside D and F, of light, viewer, half vector m and the cosine l·m = v·m.
_Geometry: TypeAlias = Callable[[Array, Array, Array, Array], Array]


def microfacet(surface: Microsurface, fresnel: Fresnel, masking: Masking) -> Brdf:
    """Return D F G / (4 (n·l)(n·v)) (Cook & Torrance 1981), which is reciprocal.

    Parameters
    ----------
    surface : Microsurface
        D.
    fresnel : callable
        F of the cosine l·m.
    masking : callable
        G of (light, view, microfacet normal), such as those of `mdfconv.brdf.masking.MASKINGS`.
    """

    def geometry(light: Array, view: Array, m: Array, cosine: Array) -> Array:
        return masking(light, view, m) / (4 * light[..., 2] * view[..., 2])

    return _from_half_vectors(surface, fresnel, geometry)


def cook_torrance(surface: Microsurface, fresnel: Fresnel) -> Brdf:
    """Return the microfacet BRDF with V-cavities (Cook & Torrance 1981)."""
    return microfacet(surface, fresnel, v_cavity)


def ashikhmin_shirley(surface: Microsurface, fresnel: Fresnel) -> Brdf:
    """Return D F / (4 (l·m) max(n·l, n·v)) (Ashikhmin & Shirley 2000, eq. 3)."""

    def geometry(light: Array, view: Array, m: Array, cosine: Array) -> Array:
        return 1 / (4 * cosine * np.maximum(light[..., 2], view[..., 2]))

    return _from_half_vectors(surface, fresnel, geometry)


def smoothie(surface: Microsurface, fresnel: Fresnel) -> Brdf:
    """Return D F / (h·h), h = l + v not normalized (Smoothie: an empirical BRDF).

    That is the microfacet BRDF with the masking of Kelemen and Szirmay-Kalos 2001. D is
    normalized here as everywhere. The article prints D = (α + 4 sin²β/α)^(−2), for which
    ∫ D cos β dω = π/(4+α²): its value is that share of this one.
    """
    return _from_half_vectors(
        surface, fresnel, lambda light, view, m, cosine: 1 / np.square(2 * cosine)
    )


def smoothie_approx(surface: Microsurface, fresnel: Fresnel) -> Brdf:
    """Return D F / 4 with D at the angle β' of 2 sin β' = ‖h − n (n·h)‖, h = l + v, and no G.

    The article replaces 4 sin²β, in its D, by ‖h − n (n·h)‖²; any D follows at the angle of
    which this is the sine. 4 is what h·h is for light from where the viewer is. The highlight
    is too wide by 1/(l·m). The article prints (α + ‖h − n (n·h)‖²/α)^(−2) for a punctual light
    in the convention of real-time rendering, which is π times a BRDF: its value is 4π/(4+α²) of
    this one, with the normalized D.
    """

    def brdf(light: Array, view: Array) -> Array:
        h = light + view
        sine = np.minimum(0.5 * np.hypot(h[..., 0], h[..., 1]), 1)
        value = 0.25 * surface.at_angle(np.arcsin(sine))
        return np.where(above(light, view), value, 0) * fresnel(_half_length(h))

    return brdf


def modified_phong(surface: Microsurface, fresnel: Fresnel) -> Brdf:
    """Return D(θ_r) F(n·v), θ_r the angle of the light with the viewer's mirror image.

    The modified Phong BRDF (γ+2)/(2π) cos^γ θ_r (Lafortune & Willems 1994) is Blinn/Phong's
    normalized D, N = γ, at θ_r for β: any other D will do, and a normalized one reflects
    all energy to a viewer along the normal.
    """
    return around_mirror(surface.at_angle, fresnel)


def _from_half_vectors(surface: Microsurface, fresnel: Fresnel, geometry: _Geometry) -> Brdf:
    """Return D(m) F(l·m) times a geometric factor."""

    def brdf(light: Array, view: Array) -> Array:
        h = light + view
        # ½‖h‖ is the cosine, with its digits where both graze.
        cosine = _half_length(h)
        # Below the surface the factors may be infinite or none; they are not used.
        with np.errstate(divide="ignore", invalid="ignore"):
            m = h / (2 * cosine[..., None])
            value = surface.density(m) * geometry(light, view, m, cosine)
        return np.where(above(light, view), value, 0) * fresnel(cosine)

    return brdf


def _half_length(h: Array) -> Array:
    """Return the cosine of the half vector with light or viewer: half the length of l + v."""
    length: Array = np.linalg.norm(h, axis=-1)
    return np.minimum(0.5 * length, 1)


BRDFS: Registry[Callable[[Microsurface, Fresnel], Brdf]] = Registry("BRDF")
BRDFS.add("ashikhmin-shirley", ashikhmin_shirley)
BRDFS.add("cook-torrance", cook_torrance)
BRDFS.add("smoothie", smoothie)
BRDFS.add("smoothie-approx", smoothie_approx)
BRDFS.add("modified-phong", modified_phong)
