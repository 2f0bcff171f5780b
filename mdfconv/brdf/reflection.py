"""The BRDFs into which a distribution can be put.

Each is built from a microsurface, whose D it takes in the form that the surface has, and a Fresnel
term F of a cosine; the constants are those for a normalized D. A `BrdfSet` is several at once.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

import numpy as np

from mdfconv.brdf.fresnel import Fresnel
from mdfconv.brdf.microfacet import Brdf, Masking, Microsurface, above, dot, mirrored, v_cavity
from mdfconv.distributions.evaluation import Array
from mdfconv.errors import MdfconvError
from mdfconv.registry import Registry

# I_M for cosines of the viewer with the normal, and an exponent γ ≥ 0.
Normalizer: TypeAlias = Callable[[Array, float], Array]

# More steps of the recurrence take seconds, and another normalizer takes one.
_LARGEST_RECURRENCE = 1e5


@dataclass(frozen=True)
class LobeBrdf:
    """A BRDF that is a lobe times a factor.

    `parts` takes (light, view) to where the lobe is taken, tan θ or (tan θ, φ), and to the factor,
    which is 0 where either is not above the surface.
    """

    lobe: Callable[..., Array]
    parts: Callable[[Array, Array], tuple[tuple[Array, ...], Array]]

    def __call__(self, light: Array, view: Array) -> Array:
        """Return the BRDF as `Brdf` has it."""
        places, factor = self.parts(light, view)
        return self.lobe(*places) * factor


# Steps of the table: a smooth lobe up to five times as wide or as narrow keeps 1e-7 of its peak.
_STEPS = 2048


class BrdfSet:
    """BRDFs that differ in their lobes alone, in one picture.

    For many samples of light the lobes are interpolated by cubics between equal steps of
    t/(t + width), t = tan θ. What the samples send is a sum over nodes, whose weights all lobes
    share: another lobe costs next to nothing.

    Parameters
    ----------
    brdfs : sequence of LobeBrdf
        The k BRDFs. They are isotropic and differ only in their lobes.
    width : float
        About the half width of the lobes, radians.
    """

    def __init__(self, brdfs: Sequence[LobeBrdf], width: float) -> None:
        self._parts = brdfs[0].parts
        self._lobes = [brdf.lobe for brdf in brdfs]
        self._width = width

    @cached_property
    def _table(self) -> Array:
        """The lobes at the nodes, shape (nodes, k)."""
        step = np.arange(_STEPS)
        slope = np.append(self._width * step / (_STEPS - step), np.inf)
        return np.stack([lobe(slope) for lobe in self._lobes], axis=-1)

    def reflected(self, light: Array, view: Array, brought: Array) -> Array:
        """Return what s samples of light for each of m surfaces send to the viewer.

        Parameters
        ----------
        light, view : numpy.ndarray, shape (m s, 3)
            Directions, as for `Brdf`.
        brought : numpy.ndarray, shape (m, s)
            What a sample brings: its irradiance on the surface.

        Returns
        -------
        numpy.ndarray, shape (k, m), or (k, 3, m) in colour
            The radiance.
        """
        (slope,), factor = self._parts(light, view)
        channels = np.atleast_2d(factor * brought.ravel())
        if brought.shape[1] == 1:
            sent = np.stack([lobe(slope) for lobe in self._lobes])[:, None] * channels
        else:
            sent = np.stack([self._sums(slope, weight, brought.shape) for weight in channels], 1)
        return sent if factor.ndim > 1 else sent[:, 0]

    def _sums(self, slope: Array, weight: Array, shape: tuple[int, int]) -> Array:
        """Return the sums over samples of weights times lobes, shape (k, m)."""
        from scipy.sparse import csr_array

        with np.errstate(divide="ignore"):
            place = _STEPS / (1 + self._width / slope)
        node = np.clip(place.astype(np.int32), 1, _STEPS - 2)
        a = place - node
        b, c, d = a + 1, a - 1, a - 2
        shares = np.stack([a * c * d / -6, b * c * d / 2, a * b * d / -2, a * b * c / 6], axis=-1)
        shares *= weight[:, None]
        nodes = node[:, None] + np.arange(-1, 3, dtype=np.int32)
        ends = 4 * shape[1] * np.arange(shape[0] + 1)
        rows = csr_array((shares.ravel(), nodes.ravel(), ends), shape=(shape[0], _STEPS + 1))
        return np.asarray((rows @ self._table).T)


def around_mirror(
    lobe: Callable[[Array], Array], factor: Callable[[Array], Array | float]
) -> LobeBrdf:
    """Return the BRDF lobe(tan θ_r) factor(n·v) for θ_r < π/2.

    A lobe with long tails ends with an edge. The factor is the Fresnel term, or what normalizes
    the lobe.
    """

    def parts(light: Array, view: Array) -> tuple[tuple[Array], Array]:
        # By the chord, 2 sin ½θ_r: a cosine loses its digits near 0.
        chord = np.linalg.norm(light - mirrored(view), axis=-1)
        half = np.square(np.minimum(0.5 * chord, 1))
        lit = above(light, view) & (half < 0.5)
        half = np.where(lit, half, 0)
        slope = 2 * np.sqrt(half * (1 - half)) / (1 - 2 * half)
        return (slope,), lit * factor(np.maximum(view[..., 2], 0))

    return LobeBrdf(lobe, parts)


def original(exponent: float) -> Brdf:
    """Return the original Phong BRDF (γ+1)/(2π) cos^γ θ_r / cos θ_i (Phong 1975).

    It is not reciprocal: the cosine is that of the light.

    Parameters
    ----------
    exponent : float
        γ ≥ 0.
    """
    lobe = around_mirror(_cosine_power(exponent), lambda cosine: (exponent + 1) / (2 * np.pi))
    return lambda light, view: lobe(light, view) / np.where(light[..., 2] > 0, light[..., 2], 1)


def modified(exponent: float, normalizer: str = "usual") -> Brdf:
    """Return the modified Phong BRDF cos^γ θ_r / I (Lafortune & Willems 1994).

    Parameters
    ----------
    exponent : float
        γ ≥ 0.
    normalizer : str
        What I is: a name in `NORMALIZERS`. With the usual one, a constant, the BRDF is
        reciprocal; with the others, functions of the viewer, it reflects all energy instead.
    """
    integral = NORMALIZERS[normalizer]
    return around_mirror(_cosine_power(exponent), lambda cosine: 1 / integral(cosine, exponent))


def _cosine_power(exponent: float) -> Callable[[Array], Array]:
    """Return cos^γ of the tangent of an angle below π/2, with its digits near 0."""
    if not 0 <= exponent < np.inf:
        raise MdfconvError(f"Phong's exponent is at least 0, not {exponent:g}")
    return lambda slope: np.exp(-0.5 * exponent * np.log1p(np.square(slope)))


def usual(cosine: Array, exponent: float) -> Array:
    """Return 2π/(γ+2), which is I_M for a viewer along the normal and too large elsewhere."""
    return np.full_like(cosine, 2 * np.pi / (exponent + 2))


def arvo(cosine: Array, exponent: float) -> Array:
    """Return I_M for an integer exponent by recurrence, in O(γ) (Arvo 1995)."""
    if exponent != round(exponent):
        raise MdfconvError(f"Arvo's normalizer takes an integer exponent, not {exponent:g}")
    if exponent > _LARGEST_RECURRENCE:
        raise MdfconvError(
            f"Arvo's normalizer takes {exponent:g} steps", "use mallett-yuksel, which takes one"
        )
    sine_square = (1 - cosine) * (1 + cosine)
    even = exponent % 2 == 0
    angle = np.full_like(cosine, np.pi / 2) if even else np.pi - np.arccos(cosine)
    term = np.full_like(cosine, np.pi / 2) if even else np.sqrt(sine_square)
    total = np.zeros_like(cosine)
    k = 0 if even else 1
    while k <= exponent - 2:
        total = total + term
        k += 2
        term = sine_square * ((k - 1) / k) * term
    return 2 * (term + angle * cosine + cosine * cosine * total) / (exponent + 2)


def mallett_yuksel(cosine: Array, exponent: float) -> Array:
    """Return I_M for a real exponent, in O(1) (Mallett & Yuksel 2020).

    With R = Γ(γ/2+½)/Γ(γ/2+1) and the regularized incomplete beta function their
    2πc + √π R (s^γ − c (γ/2) B(s²; γ/2, ½)) becomes πc (1 + I(c²; ½, γ/2)) + √π R s^γ: a sum
    of positive terms, which keeps its digits from γ = 0 to 10⁶ and from normal to grazing.
    """
    from scipy.special import betainc, poch

    half = 0.5 * exponent
    ratio = 1 / poch(half + 0.5, 0.5)
    with np.errstate(divide="ignore", invalid="ignore"):
        power = np.exp(half * np.log1p(-np.square(cosine)))
    power = np.where(cosine < 1, power, 1.0 if exponent == 0 else 0.0)
    share = betainc(0.5, half, np.square(cosine)) if half > 0 else np.zeros_like(cosine)
    return (np.pi * cosine * (1 + share) + np.sqrt(np.pi) * ratio * power) / (exponent + 2)


NORMALIZERS: Registry[Normalizer] = Registry("normalizer")
NORMALIZERS.add("usual", usual)
NORMALIZERS.add("arvo", arvo)
NORMALIZERS.add("mallett-yuksel", mallett_yuksel)


# What a BRDF has beside D and F, of light, viewer, half vector m and the cosine l·m = v·m.
_Geometry: TypeAlias = Callable[[Array, Array, Array, Array], Array]


def microfacet(surface: Microsurface, fresnel: Fresnel, masking: Masking) -> LobeBrdf:
    """Return D F G / (4 (n·l)(n·v)) (Cook & Torrance 1981), which is reciprocal.

    Parameters
    ----------
    surface : Microsurface
        D.
    fresnel : callable
        F of the cosine l·m.
    masking : callable
        G of (light, view, microfacet normal), such as those of `mdfconv.brdf.microfacet.MASKINGS`.
    """

    def geometry(light: Array, view: Array, m: Array, cosine: Array) -> Array:
        return masking(light, view, m) / (4 * light[..., 2] * view[..., 2])

    return _from_half_vectors(surface, fresnel, geometry)


def cook_torrance(surface: Microsurface, fresnel: Fresnel) -> LobeBrdf:
    """Return the microfacet BRDF with V-cavities (Cook & Torrance 1981)."""
    return microfacet(surface, fresnel, v_cavity)


def ashikhmin_shirley(surface: Microsurface, fresnel: Fresnel) -> LobeBrdf:
    """Return D F / (4 (l·m) max(n·l, n·v)) (Ashikhmin & Shirley 2000, eq. 3)."""

    def geometry(light: Array, view: Array, m: Array, cosine: Array) -> Array:
        return 1 / (4 * cosine * np.maximum(light[..., 2], view[..., 2]))

    return _from_half_vectors(surface, fresnel, geometry)


def smoothie(surface: Microsurface, fresnel: Fresnel) -> LobeBrdf:
    """Return D F / (h·h), h = l + v not normalized (Smoothie: an empirical BRDF).

    That is the microfacet BRDF with the masking of Kelemen and Szirmay-Kalos 2001. D is
    normalized here as everywhere. The article prints D = (α + 4 sin²β/α)^(−2), for which
    ∫ D cos β dω = π/(4+α²): its value is that share of this one.
    """
    return _from_half_vectors(
        surface, fresnel, lambda light, view, m, cosine: 1 / np.square(2 * cosine)
    )


def smoothie_approx(surface: Microsurface, fresnel: Fresnel) -> LobeBrdf:
    """Return D F / 4 with D at the angle β' of 2 sin β' = ‖h − n (n·h)‖, h = l + v, and no G.

    The article replaces 4 sin²β, in its D, by ‖h − n (n·h)‖²; any D follows at the angle of
    which this is the sine. 4 is what h·h is for light from where the viewer is. The highlight
    is too wide by 1/(l·m). The article prints (α + ‖h − n (n·h)‖²/α)^(−2) for a punctual light
    in the convention of real-time rendering, which is π times a BRDF: its value is 4π/(4+α²) of
    this one, with the normalized D.
    """

    def parts(light: Array, view: Array) -> tuple[tuple[Array], Array]:
        h = light + view
        sine = np.minimum(0.5 * np.hypot(h[..., 0], h[..., 1]), 1)
        with np.errstate(divide="ignore"):
            slope = sine / np.sqrt((1 - sine) * (1 + sine))
        return (slope,), 0.25 * above(light, view) * fresnel(_half_length(h))

    return LobeBrdf(surface.at_slope, parts)


def modified_phong(surface: Microsurface, fresnel: Fresnel) -> LobeBrdf:
    """Return D(θ_r) F(n·v), θ_r the angle of the light with the viewer's mirror image.

    The modified Phong BRDF (γ+2)/(2π) cos^γ θ_r (Lafortune & Willems 1994) is Blinn/Phong's
    normalized D, N = γ, at θ_r for β: any other D will do, and a normalized one reflects
    all energy to a viewer along the normal.
    """
    return around_mirror(surface.at_slope, fresnel)


def _from_half_vectors(surface: Microsurface, fresnel: Fresnel, geometry: _Geometry) -> LobeBrdf:
    """Return D(m) F(l·m) times a geometric factor."""

    def parts(light: Array, view: Array) -> tuple[tuple[Array, ...], Array]:
        h = light + view
        # ½‖h‖ is the cosine, with its digits where both graze.
        cosine = _half_length(h)
        # Below the surface the factors may be infinite or none; they are not used.
        with np.errstate(divide="ignore", invalid="ignore"):
            m = h / (2 * cosine[..., None])
            factor = np.where(above(light, view), geometry(light, view, m, cosine), 0)
        return surface.slopes(m), factor * fresnel(cosine)

    return LobeBrdf(surface.at_slope, parts)


def _half_length(h: Array) -> Array:
    """Return the cosine of the half vector with light or viewer: half the length of l + v."""
    return np.minimum(0.5 * np.sqrt(dot(h, h)), 1)


BRDFS: Registry[Callable[[Microsurface, Fresnel], LobeBrdf]] = Registry("BRDF")
BRDFS.add("ashikhmin-shirley", ashikhmin_shirley)
BRDFS.add("cook-torrance", cook_torrance)
BRDFS.add("smoothie", smoothie)
BRDFS.add("smoothie-approx", smoothie_approx)
BRDFS.add("modified-phong", modified_phong)
# In directions of the light a lobe is as wide as in θ; of the others it is twice as wide.
AROUND_MIRROR = ("modified-phong",)
