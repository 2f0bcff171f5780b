"""Masking and shadowing by name: Smith's, the V-cavity, Kelemen-Szirmay-Kalos.

A masking is G of light, viewer and microfacet normal: unit vectors, shape (..., 3), with the
surface normal along z. Smith's belong to the distribution: see `mdfconv.brdf.microsurface`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from mdfconv.brdf.directions import above, dot
from mdfconv.brdf.microsurface import Microsurface
from mdfconv.distributions.evaluation import Array
from mdfconv.registry import Registry

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


def _of_any_surface(masking: Masking) -> Callable[[Microsurface], Masking]:
    return lambda surface: masking


MASKINGS: Registry[Callable[[Microsurface], Masking]] = Registry("masking")
MASKINGS.add("correlated", lambda surface: surface.correlated)
MASKINGS.add("separable", lambda surface: surface.separable)
MASKINGS.add("v-cavity", _of_any_surface(v_cavity))
MASKINGS.add("ksk", _of_any_surface(kelemen_szirmay_kalos))
MASKINGS.add("none", _of_any_surface(no_masking))
