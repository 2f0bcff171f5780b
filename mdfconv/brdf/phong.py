"""Phong's reflection, original and modified, and its normalizers.

Directions are unit vectors, shape (..., 3), with the surface normal along z; θ_r is the angle
between the light and the mirror image of the viewer.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.special import betainc, poch

from mdfconv.brdf.directions import mirrored
from mdfconv.distributions.evaluation import Array
from mdfconv.errors import MdfconvError, unknown_name

_LARGEST_RECURRENCE = 1e5


def check_exponent(exponent: float) -> None:
    """Raise an MdfconvError unless an exponent is a finite number from 0 up."""
    if not 0 <= exponent < np.inf:
        raise MdfconvError(f"Phong's exponent is at least 0, not {exponent:g}")


def _lobe(light: Array, view: Array, exponent: float) -> Array:
    """Return cos^γ θ_r above the surface, 0 elsewhere, with its digits near the mirror image."""
    check_exponent(exponent)
    # cos θ = 1 − ½|l − r|²; the chord keeps what 1 − cos loses.
    drop = 0.5 * np.square(light - mirrored(view)).sum(axis=-1)
    lit = (light[..., 2] > 0) & (view[..., 2] > 0) & (drop < 1)
    with np.errstate(divide="ignore"):
        value = np.exp(exponent * np.log1p(-np.where(lit, drop, 0)))
    return np.where(lit, value, 0)


def original(light: Array, view: Array, exponent: float) -> Array:
    """Return the original Phong BRDF (γ+1)/(2π) cos^γ θ_r / cos θ_i (Phong 1975).

    Parameters
    ----------
    light, view : numpy.ndarray, shape (..., 3)
        Unit vectors.
    exponent : float
        γ ≥ 0.

    Returns
    -------
    numpy.ndarray, shape (...)
        The BRDF, 1/sr. It is not reciprocal: the cosine is that of the light.
    """
    lobe = _lobe(light, view, exponent)
    cosine = np.where(light[..., 2] > 0, light[..., 2], 1)
    return (exponent + 1) / (2 * np.pi) * lobe / cosine


def modified(light: Array, view: Array, exponent: float, normalizer: str = "usual") -> Array:
    """Return the modified Phong BRDF cos^γ θ_r / I (Lafortune & Willems 1994).

    Parameters
    ----------
    light, view : numpy.ndarray, shape (..., 3)
        Unit vectors.
    exponent : float
        γ ≥ 0.
    normalizer : str
        What I is: one of `NORMALIZERS`. With the usual one, a constant, the BRDF is
        reciprocal; with the others, functions of the viewer, it reflects all energy instead.

    Returns
    -------
    numpy.ndarray, shape (...)
        The BRDF, 1/sr.
    """
    return _lobe(light, view, exponent) / normalization(normalizer, view[..., 2], exponent)


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
    if normalizer not in NORMALIZERS:
        raise unknown_name("normalizer", normalizer, list(NORMALIZERS))
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
            f"Arvo's normalizer takes {exponent:g} steps: use mallett-yuksel, which takes one"
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


NORMALIZERS: dict[str, Callable[[Array, float], Array]] = {
    "usual": usual,
    "arvo": arvo,
    "mallett-yuksel": mallett_yuksel,
}
