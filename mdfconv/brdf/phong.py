"""Phong's reflection, a lobe around the mirror image of the viewer, and its normalizers.

Directions are unit vectors, shape (..., 3), with the surface normal along z; θ_r is the angle
between the light and the mirror image of the viewer.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np
from scipy.special import betainc, poch

from mdfconv.brdf.directions import Brdf, above, mirrored
from mdfconv.distributions.evaluation import Array
from mdfconv.errors import MdfconvError
from mdfconv.registry import Registry

# I_M for cosines of the viewer with the normal, and an exponent γ ≥ 0.
Normalizer: TypeAlias = Callable[[Array, float], Array]

# More steps of the recurrence take seconds, and another normalizer takes one.
_LARGEST_RECURRENCE = 1e5


def around_mirror(lobe: Callable[[Array], Array], factor: Callable[[Array], Array | float]) -> Brdf:
    """Return the BRDF lobe(θ_r) factor(n·v) for θ_r < π/2.

    A lobe with long tails ends with an edge.

    Parameters
    ----------
    lobe : callable
        Of angles θ_r, radians.
    factor : callable
        Of cosines n·v: the Fresnel term, or what normalizes the lobe.
    """

    def brdf(light: Array, view: Array) -> Array:
        # By the chord: an arccos loses its digits near 0.
        chord = np.linalg.norm(light - mirrored(view), axis=-1)
        angle = 2 * np.arcsin(np.minimum(0.5 * chord, 1))
        lit = above(light, view) & (angle < 0.5 * np.pi)
        value = np.where(lit, lobe(np.where(lit, angle, 0)), 0)
        return value * factor(np.maximum(view[..., 2], 0))

    return brdf


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
    """Return cos^γ of an angle below π/2, with its digits near 0."""
    check_exponent(exponent)
    # cos θ = 1 − 2 sin²(θ/2)
    return lambda angle: np.exp(exponent * np.log1p(-2 * np.square(np.sin(0.5 * angle))))


def check_exponent(exponent: float) -> None:
    """Raise an MdfconvError unless an exponent is a finite number from 0 up."""
    if not 0 <= exponent < np.inf:
        raise MdfconvError(f"Phong's exponent is at least 0, not {exponent:g}")


def normalization(normalizer: str, cosine: Array, exponent: float) -> Array:
    """Return I_M = ∫ cos^γ θ_r cos θ_i dω_i, exactly or as an approximation.

    Parameters
    ----------
    normalizer : str
        ``"usual"``, ``"arvo"`` or ``"mallett-yuksel"``.
    cosine : numpy.ndarray
        Cosine of the viewer with the normal, [0, 1].
    exponent : float
        γ ≥ 0; an integer up to 10⁵ for ``"arvo"``.

    Raises
    ------
    MdfconvError
        If the name is not known, or the exponent not one that the normalizer takes.
    """
    check_exponent(exponent)
    return NORMALIZERS[normalizer](np.asarray(cosine, float), float(exponent))


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
