"""The Smoothie BRDF, exact and approximate, as in its article.

Directions are unit vectors, shape (..., 3), with the surface normal along z; h = l + v is not
normalized.
"""

from __future__ import annotations

import numpy as np

from mdfconv.distributions.evaluation import Array


def exact(light: Array, view: Array, alpha: float) -> Array:
    """Return D G / (4 (n·l)(n·v)) = (α + 4 sin²θ_m/α)^(−2) / (h·h).

    The article's D is not normalized: ∫ D cos θ dω = π/(4+α²). G is that of Kelemen and
    Szirmay-Kalos, whose numerator cancels.

    Parameters
    ----------
    light, view : numpy.ndarray, shape (..., 3)
        Unit vectors; they may change places.
    alpha : float
        α > 0.

    Returns
    -------
    numpy.ndarray, shape (...)
        The BRDF without its Fresnel term, 1/sr.
    """
    above = (light[..., 2] > 0) & (view[..., 2] > 0)
    square = np.where(above, np.square(light + view).sum(axis=-1), 1)
    # 4 sin²θ_m = 4 |h_∥|²/(h·h), without the difference 1 − cos².
    spread = 4 * _tangential_square(light, view) / square
    return np.where(above, _distribution(spread, alpha) / square, 0)


def approximate(light: Array, view: Array, alpha: float) -> Array:
    """Return (α + ‖h − n(n·h)‖²/α)^(−2) / π.

    The article prints π times this, the reflection of a punctual light in the convention of
    real-time rendering. There is no G.

    Parameters and result are those of `exact`.
    """
    above = (light[..., 2] > 0) & (view[..., 2] > 0)
    value = _distribution(_tangential_square(light, view), alpha) / np.pi
    return np.where(above, value, 0)


def _tangential_square(light: Array, view: Array) -> Array:
    """Return ‖h − n(n·h)‖²."""
    return np.square(light[..., :2] + view[..., :2]).sum(axis=-1)


def _distribution(spread: Array, alpha: float) -> Array:
    # α²/(α² + spread)², which does not divide by a small α.
    return np.square(alpha / (alpha * alpha + spread))


def energy_response(alpha: float) -> float:
    """Return ∫∫ sin θ cos θ D(θ/2) dθ dφ = 2π (½ + ½α² ln α − ¼α² ln(α²+2)).

    The article prints ½ + α² ln α − ½α² ln(1+α²), which is not this integral.
    """
    square = alpha * alpha
    logarithms = 0.5 * np.log(alpha) - 0.25 * np.log(square + 2)
    return float(2 * np.pi * (0.5 + square * logarithms))


def printed_energy_response(alpha: float) -> float:
    """Return the article's expression for the energy response, as printed."""
    square = alpha * alpha
    return float(0.5 + square * np.log(alpha) - 0.5 * square * np.log1p(square))
