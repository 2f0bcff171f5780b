"""Masking and shadowing: Smith's for GGX and Beckmann, the V-cavity, Kelemen-Szirmay-Kalos.

Directions are unit vectors, shape (..., 3), with the surface normal along z. A roughness is one
α, or a pair (α_x, α_y) for an anisotropic surface.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np
from scipy.special import erfcx

from mdfconv.brdf.directions import dot
from mdfconv.distributions.evaluation import Array
from mdfconv.errors import MdfconvError, unknown_name

Roughness: TypeAlias = float | tuple[float, float]
Masking: TypeAlias = Callable[[Array, Array, Array], Array]


def smith_lambda(name: str, omega: Array, alpha: Roughness) -> Array:
    """Return Smith's Λ for a direction.

    Parameters
    ----------
    name : str
        ``"ggx"``: Λ = ½ (√(1 + 1/a²) − 1) (Walter et al. 2007, eq. 34; Heitz 2014, eq. 72).
        ``"beckmann"``: Λ = ½ (erf(a) − 1) + e^(−a²)/(2a√π) (Heitz 2014, eq. 66), exact, not the
        rational fit. a = 1/(α tan θ), along the azimuth for a pair.
    omega : numpy.ndarray, shape (..., 3)
        The direction; above or below the surface alike.
    alpha : float or tuple of two floats
        Roughness, > 0.

    Returns
    -------
    numpy.ndarray, shape (...)
        Λ ≥ 0, infinite at grazing.

    Raises
    ------
    MdfconvError
        For other distributions, for which there is no closed form here.
    """
    if name not in _LAMBDAS:
        raise unknown_name("Smith masking", name, list(_LAMBDAS))
    slope = _projected_slope(omega, alpha)
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        return _LAMBDAS[name](slope)


def _projected_slope(omega: Array, alpha: Roughness) -> Array:
    """Return α tan θ along the azimuth of a direction, 1/a."""
    alpha_x, alpha_y = alpha if isinstance(alpha, tuple) else (alpha, alpha)
    if not (alpha_x > 0 and alpha_y > 0):
        raise MdfconvError(f"a roughness is above 0, not {alpha}")
    x, y, z = np.moveaxis(omega, -1, 0)
    with np.errstate(divide="ignore"):
        return np.hypot(alpha_x * x, alpha_y * y) / np.abs(z)


def _ggx(slope: Array) -> Array:
    # ½ (√(1+s²) − 1) without the difference, and without s² where it would overflow.
    root = np.hypot(1, slope)
    return np.where(np.isinf(slope), np.inf, 0.5 * slope * (slope / (1 + root)))


def _beckmann(slope: Array) -> Array:
    # erf − 1 = −erfc, and both terms have the factor e^(−a²).
    a = 1 / slope
    value = 0.5 * np.exp(-a * a) * (slope / np.sqrt(np.pi) - erfcx(a))
    return np.where(slope == 0, 0, np.maximum(value, 0))


_LAMBDAS = {"ggx": _ggx, "beckmann": _beckmann}


def smith_g1(name: str, omega: Array, m: Array, alpha: Roughness) -> Array:
    """Return Smith's G₁ = 1/(1+Λ), 0 where the microfacet is seen from behind.

    Parameters
    ----------
    name, omega, alpha
        As for `smith_lambda`.
    m : numpy.ndarray, shape (..., 3)
        Normal of the microfacet.
    """
    value = 1 / (1 + smith_lambda(name, omega, alpha))
    return np.where(dot(omega, m) * omega[..., 2] > 0, value, 0)


def separable(name: str, light: Array, view: Array, m: Array, alpha: Roughness) -> Array:
    """Return G₁(l) G₁(v) (Walter et al. 2007, eq. 23)."""
    return smith_g1(name, light, m, alpha) * smith_g1(name, view, m, alpha)


def correlated(name: str, light: Array, view: Array, m: Array, alpha: Roughness) -> Array:
    """Return the height-correlated 1/(1 + Λ_l + Λ_v) (Heitz 2014, eq. 99)."""
    value = 1 / (1 + smith_lambda(name, light, alpha) + smith_lambda(name, view, alpha))
    seen = (dot(light, m) * light[..., 2] > 0) & (dot(view, m) * view[..., 2] > 0)
    return np.where(seen, value, 0)


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
    return np.where((light[..., 2] > 0) & (view[..., 2] > 0), value, 0)


def no_masking(light: Array, view: Array, m: Array) -> Array:
    """Return 1 for directions above the surface."""
    return np.where((light[..., 2] > 0) & (view[..., 2] > 0), 1.0, 0)


_PLAIN: dict[str, Masking] = {
    "v-cavity": v_cavity,
    "ksk": kelemen_szirmay_kalos,
    "none": no_masking,
}
MASKINGS = ("correlated", "separable", *_PLAIN)


def masking(kind: str, name: str, alpha: Roughness) -> Masking:
    """Return a masking function of (light, view, microfacet normal).

    Parameters
    ----------
    kind : str
        One of `MASKINGS`; the first two are Smith's.
    name : str
        Distribution, for Smith's.
    alpha : float or tuple of two floats
        Its roughness, for Smith's.

    Raises
    ------
    MdfconvError
        If the kind is not known, or there is no Smith masking for the distribution.
    """
    if kind in _PLAIN:
        return _PLAIN[kind]
    if kind not in MASKINGS:
        raise unknown_name("masking", kind, list(MASKINGS))
    if name not in _LAMBDAS:
        raise unknown_name("Smith masking", name, list(_LAMBDAS))
    smith = correlated if kind == "correlated" else separable
    return lambda light, view, m: smith(name, light, view, m, alpha)
