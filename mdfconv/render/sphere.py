"""A sphere under a distant light, seen from afar: Figures 3 to 5 of Sawicki 2021.

The viewer looks along −z at the unit sphere, without perspective, so every pixel's normal is
known and one light direction gives one half vector for the whole picture.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from mdfconv.brdf.microfacet import Brdf, frames, half_vector, unit
from mdfconv.distributions.evaluation import Array
from mdfconv.registry import Registry

VIEW = np.array([0.0, 0.0, 1.0])
LIGHT = np.array([-0.5, 0.5, np.sqrt(0.5)])  # 45° off the viewer, from above left
# The normal where the highlight lies.
HIGHLIGHT = half_vector(LIGHT, VIEW)
_AREA_HALF_SIDE = 0.15  # of the distance to the square light
_AREA_SAMPLES = 8  # a side
# Pairs of Gauss's nodes a side for each unit of half the range of t.
_NODES = 2
# The least depth of what is mirrored.
_LEAST_DEPTH = 1e-3
MARGIN = 1.04  # half the picture, in radii
# Some twenty vectors for each normal, as many as this, stay in the cache.
_NORMALS_AT_ONCE = 8192


@dataclass(frozen=True)
class Lights:
    """Distant light: unit vectors towards it, shape (k, 3), and the irradiance of each, (k,)."""

    directions: Array
    irradiance: Array

    def resolved(self, width: float) -> Lights:
        """Return the light in samples between which a lobe of a half width, radians, is smooth."""
        return self

    def samples(self, normals: Array) -> Iterator[tuple[Any, Array, Array]]:
        """Yield which normals a sample is for, unit vectors towards it, and its irradiance."""
        for direction, irradiance in zip(self.directions, self.irradiance, strict=True):
            yield slice(None), direction, irradiance


# The sides of the level square around `LIGHT`, which faces the sphere.
_RIGHT = unit(np.cross([0.0, 1.0, 0.0], LIGHT))
_SIDES = np.stack([_RIGHT, np.cross(LIGHT, _RIGHT)])
# What it brings, π, by its solid angle.
_BRIGHTNESS = np.pi / (4 * np.arctan(_AREA_HALF_SIDE**2 / np.sqrt(1 + 2 * _AREA_HALF_SIDE**2)))


def _on_square(places: Array) -> tuple[Array, Array]:
    """Return unit vectors towards places of the square, and their solid angle by their area."""
    toward = LIGHT + places @ _SIDES
    distance = np.linalg.norm(toward, axis=-1)
    # The cosine at the light over distance².
    return toward / distance[..., None], distance**-3


@dataclass(frozen=True)
class _Square(Lights):
    """The square, in samples that are the same for all normals."""

    def resolved(self, width: float) -> Lights:
        # Around the mirror direction a lobe is half as wide, and a half vector moves by half of
        # what the light does: the widest lobe of which samples could be told apart.
        if width < 4 * _AREA_HALF_SIDE / _AREA_SAMPLES:
            return _GradedSquare(self.directions, self.irradiance, width)
        return self


@dataclass(frozen=True)
class _GradedSquare(Lights):
    """The square, in samples that crowd around what a mirror would show at each normal.

    On each side u = u₀ + s sinh t with Gauss's nodes in t, u₀ the mirrored place or the nearest
    one on the square, and s the width of the lobe or the distance between the two.
    """

    width: float

    def samples(self, normals: Array) -> Iterator[tuple[Any, Array, Array]]:
        """Yield samples as `Lights.samples`, more for normals that mirror the square."""
        mirrored = 2 * (normals @ VIEW)[:, None] * normals - VIEW
        # What is mirrored from behind is far from the square.
        places = mirrored @ _SIDES.T / np.maximum(mirrored @ LIGHT, _LEAST_DEPTH)[:, None]
        nearest = np.clip(places, -_AREA_HALF_SIDE, _AREA_HALF_SIDE)
        scale = np.maximum(self.width, np.linalg.norm(places - nearest, axis=1))[:, None]
        low = np.arcsinh((-_AREA_HALF_SIDE - nearest) / scale)
        reach = 0.5 * (np.arcsinh((_AREA_HALF_SIDE - nearest) / scale) - low)
        counts = 2 * np.ceil(_NODES * reach.max(axis=1))
        for count in np.unique(counts).astype(int):
            which = np.flatnonzero(counts == count)
            nodes, weights = np.polynomial.legendre.leggauss(count)
            t = low[which] + reach[which] * (1 + nodes[:, None, None])
            along = nearest[which] + scale[which] * np.sinh(t)
            share = scale[which] * np.cosh(t) * reach[which] * weights[:, None, None]
            for u, v in np.ndindex(count, count):
                directions, solid = _on_square(np.stack([along[u, :, 0], along[v, :, 1]], axis=-1))
                yield which, directions, _BRIGHTNESS * solid * share[u, :, 0] * share[v, :, 1]


LIGHTS: Registry[Lights] = Registry("light")
LIGHTS.add("directional", Lights(LIGHT[None, :], np.array([np.pi])))
_steps = _AREA_HALF_SIDE * (2 * (np.arange(_AREA_SAMPLES) + 0.5) / _AREA_SAMPLES - 1)
_toward, _weight = _on_square(np.stack(np.meshgrid(_steps, _steps), axis=-1).reshape(-1, 2))
LIGHTS.add("area", _Square(_toward, np.pi * _weight / _weight.sum()))


def radiance(normals: Array, brdf: Brdf, light: Lights) -> Array:
    """Return the light that surfaces with unit normals, shape (n, 3), send to the viewer.

    It is 0 where a normal turns away. The shape is (n,), or (3, n) in colour; of several BRDFs,
    stacked, they come first.
    """
    blocks = np.array_split(normals, max(1, len(normals) // _NORMALS_AT_ONCE))
    return np.concatenate([_radiance(block, brdf, light) for block in blocks], axis=-1)


def _radiance(normals: Array, brdf: Brdf, light: Lights) -> Array:
    total: Array = np.zeros(len(normals))
    local = frames(normals)
    view = local @ VIEW
    everywhere = np.arange(len(normals))
    for which, direction, irradiance in light.samples(normals):
        toward = (local[which] @ direction[..., None])[..., 0]
        lit = (view[which, 2] > 0) & (toward[:, 2] > 0)
        brought = np.broadcast_to(irradiance, lit.shape)[lit]
        seen = everywhere[which][lit]
        sent = brdf(toward[lit], view[seen]) * toward[lit, 2] * brought
        added = np.zeros((*sent.shape[:-1], len(normals)))
        added[..., seen] = sent
        total = total + added
    return total


@dataclass(frozen=True)
class Frame:
    """The pixels of a square picture that shows the sphere, or a part of it.

    Its centre, x and y, and half its side are in radii.
    """

    size: int
    centre: tuple[float, float] = (0.0, 0.0)
    half: float = MARGIN

    def normals(self) -> tuple[Array, Array]:
        """Return the pixels' normals, shape (size², 3), and how far each is covered, 0 to 1."""
        axis = self.half * (2 * (np.arange(self.size) + 0.5) / self.size - 1)
        x, y = np.meshgrid(self.centre[0] + axis, self.centre[1] - axis)
        radius = np.hypot(x, y)
        pixel = 2 * self.half / self.size
        coverage = np.clip((1 - radius) / pixel + 0.5, 0, 1)
        # A pixel that straddles the silhouette shows what lies just inside it.
        shrink = np.minimum(1, (1 - 0.25 * pixel) / np.maximum(radius, 1e-300))
        x, y = x * shrink, y * shrink
        z = np.sqrt(np.maximum(1 - x * x - y * y, 0))
        return np.stack([x, y, z], axis=-1).reshape(-1, 3), coverage.ravel()

    def render(self, brdf: Brdf, light: Lights) -> Array:
        """Return the picture in linear light, black around the sphere.

        Its shape is (size, size), or (3, size, size) in colour; of several BRDFs they come
        first.
        """
        normals, coverage = self.normals()
        inside = np.flatnonzero(coverage)
        sent = radiance(normals[inside], brdf, light) * coverage[inside]
        picture = np.zeros((*sent.shape[:-1], len(normals)))
        picture[..., inside] = sent
        return picture.reshape(*sent.shape[:-1], self.size, self.size)


def cross_section(count: int, width: float) -> tuple[Array, Array]:
    """Return positions from −1 to 1 radius along the line through the highlight, and normals.

    The line runs through the centre of the sphere's disc, towards the light. So many positions are
    all along it, so many within the width, radians, around the highlight's centre.
    """
    centre = float(np.arccos(HIGHLIGHT[2]))
    spread = centre + np.linspace(-width, width, count)
    everywhere = np.linspace(-0.5 * np.pi, 0.5 * np.pi, count + 2)[1:-1]
    angle = np.unique(np.concatenate([everywhere, spread, [centre]]))
    angle = angle[np.abs(angle) < 0.5 * np.pi]
    across = LIGHT[:2] / np.linalg.norm(LIGHT[:2])
    normals = np.column_stack([np.sin(angle)[:, None] * across, np.cos(angle)])
    return np.sin(angle), normals


def highlight_extent(lobe: float, light: Lights) -> float:
    """Return how far the highlight reaches, radians, for the angle up to which a lobe does."""
    halves = half_vector(light.directions, VIEW)
    cosine = np.clip(halves @ HIGHLIGHT, -1, 1)
    return lobe + float(np.arccos(cosine).max())
