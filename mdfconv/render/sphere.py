"""A sphere under a distant light, seen from afar: Figures 3 to 5 of Sawicki 2021.

The viewer looks along −z at the unit sphere, without perspective, so every pixel's normal is
known and one light direction gives one half vector for the whole picture.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np

from mdfconv.brdf.microfacet import Brdf, frames, half_vector, unit
from mdfconv.brdf.reflection import BrdfSet
from mdfconv.distributions.evaluation import Array, Indices, gauss_legendre
from mdfconv.registry import Registry

VIEW = np.array([0.0, 0.0, 1.0])
LIGHT = np.array([-0.5, 0.5, np.sqrt(0.5)])  # 45° off the viewer, from above left
# The normal where the highlight lies.
HIGHLIGHT = half_vector(LIGHT, VIEW)
_AREA_HALF_SIDE = 0.15  # of the distance to the square light
_AREA_SAMPLES = 8  # a side
# Gauss's nodes a side: for each radian of half the range of t, and besides; more for a lobe of more
# than this half width, which shows where the horizon or a shadow cuts through the square.
_NODES, _BESIDES, _BESIDES_WIDE, _WIDE = 8, 2, 7, 0.2
# On how many half widths nodes crowd: fewer miss the flanks of Beckmann's lobe, more miss the peak.
_CROWD = 1.3
# The least depth of what is mirrored.
_LEAST_DEPTH = 1e-3
MARGIN = 1.04  # half the picture, in radii
# So many normals, and samples of light, at a time: enough to hide the cost of a call.
_NORMALS_AT_ONCE, _SAMPLES_AT_ONCE = 8192, 32768


@dataclass(frozen=True)
class Lights:
    """Distant light: unit vectors towards it, shape (k, 3), and the irradiance of each, (k,)."""

    directions: Array
    irradiance: Array

    def resolved(self, width: float) -> Lights:
        """Return the light in samples for lobes of about this half width in it, radians."""
        return self

    def samples(self, normals: Array) -> Iterator[tuple[Indices, Array, Array]]:
        """Yield which m normals s samples are for, unit vectors towards them, their irradiance.

        The vectors are of shape (m, s, 3), the irradiance of (m, s); both broadcast to it.
        """
        at_once = max(1, _SAMPLES_AT_ONCE // max(1, len(normals)))
        for start in range(0, len(self.irradiance), at_once):
            some = slice(start, start + at_once)
            yield np.arange(len(normals)), self.directions[some], self.irradiance[some]


# The sides of the level square around `LIGHT`, which faces the sphere.
_RIGHT = unit(np.cross([0.0, 1.0, 0.0], LIGHT))
_SIDES = np.stack([_RIGHT, np.cross(LIGHT, _RIGHT)])
# What it brings, π, by its solid angle.
_BRIGHTNESS = np.pi / (4 * np.arctan(_AREA_HALF_SIDE**2 / np.sqrt(1 + 2 * _AREA_HALF_SIDE**2)))


def _on_square(along: Array) -> tuple[Array, Array]:
    """Return unit vectors towards all pairs of places on the two sides, and their solid angles.

    The places have the shape (..., 2, n), the pairs (..., n²). A solid angle is by the area.
    """
    u, v = along[..., 0, None, :], along[..., 1, :, None]
    distance = np.sqrt(1 + u * u + v * v)
    right, up = _SIDES
    toward = (LIGHT + u[..., None] * right) + v[..., None] * up
    toward /= distance[..., None]
    pairs = (*along.shape[:-2], -1)
    # The cosine at the light over distance².
    solid = 1 / (distance * distance * distance)
    return toward.reshape(*pairs, 3), solid.reshape(pairs)


@dataclass(frozen=True)
class _Square(Lights):
    """The square, in samples that are the same for all normals."""

    def resolved(self, width: float) -> Lights:
        return _GradedSquare(self.directions, self.irradiance, width)


@dataclass(frozen=True)
class _GradedSquare(Lights):
    """The square, in samples that crowd around what a mirror would show at each normal.

    On each side u = u₀ + s tan t with Gauss's nodes in t, u₀ the mirrored place or the nearest
    one on the square, and s the width of the lobe or the distance between the two: in t a lobe
    with the tails of GGX is a power of the cosine, however narrow it is.
    """

    width: float

    def samples(self, normals: Array) -> Iterator[tuple[Indices, Array, Array]]:
        """Yield samples as `Lights.samples`, more for normals that mirror the square."""
        mirrored = 2 * (normals @ VIEW)[:, None] * normals - VIEW
        # What is mirrored from behind is far from the square.
        places = mirrored @ _SIDES.T / np.maximum(mirrored @ LIGHT, _LEAST_DEPTH)[:, None]
        nearest = np.clip(places, -_AREA_HALF_SIDE, _AREA_HALF_SIDE)
        scale = np.maximum(_CROWD * self.width, np.linalg.norm(places - nearest, axis=1))[:, None]
        low = np.arctan((-_AREA_HALF_SIDE - nearest) / scale)
        reach = 0.5 * (np.arctan((_AREA_HALF_SIDE - nearest) / scale) - low)
        besides = _BESIDES_WIDE if self.width > _WIDE else _BESIDES
        counts = np.ceil(_NODES * reach.max(axis=1) + besides).astype(int)
        for count in np.unique(counts).tolist():
            nodes, weights = gauss_legendre(count)
            alike = np.flatnonzero(counts == count)
            parts = 1 + alike.size * count * count // _SAMPLES_AT_ONCE
            for which in np.array_split(alike, parts):
                half = reach[which, :, None]
                t = low[which, :, None] + half * (1 + nodes)
                along = nearest[which, :, None] + scale[which, :, None] * np.tan(t)
                share = scale[which, :, None] * half * weights / np.square(np.cos(t))
                directions, solid = _on_square(along)
                area = share[:, 0, None, :] * share[:, 1, :, None]
                yield which, directions, _BRIGHTNESS * solid * area.reshape(solid.shape)


LIGHTS: Registry[Lights] = Registry("light")
LIGHTS.add("directional", Lights(LIGHT[None, :], np.array([np.pi])))
_steps = _AREA_HALF_SIDE * (2 * (np.arange(_AREA_SAMPLES) + 0.5) / _AREA_SAMPLES - 1)
_toward, _weight = _on_square(np.stack([_steps, _steps]))
LIGHTS.add("area", _Square(_toward, np.pi * _weight / _weight.sum()))


def radiance(normals: Array, brdf: Brdf | BrdfSet, light: Lights) -> Array:
    """Return the light that surfaces with unit normals, shape (n, 3), send to the viewer.

    It is 0 where a normal turns away. The shape is (n,), or (3, n) in colour; of a set of BRDFs
    they come first.
    """
    blocks = np.array_split(normals, 1 + len(normals) // _NORMALS_AT_ONCE)
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        parts = pool.map(lambda block: _radiance(block, brdf, light), blocks)
        return np.concatenate([*parts], axis=-1)


def _radiance(normals: Array, brdf: Brdf | BrdfSet, light: Lights) -> Array:
    local = frames(normals)
    view = local @ VIEW
    total: Any = 0
    for which, directions, irradiance in light.samples(normals):
        toward = directions @ np.swapaxes(local[which], -1, -2)
        lit = (view[which, 2] > 0) & (toward[..., 2] > 0).any(axis=1)
        brought = np.broadcast_to(irradiance, toward.shape[:2])[lit]
        toward, which = toward[lit], which[lit]
        brought = brought * np.maximum(toward[..., 2], 0)
        seen = np.broadcast_to(view[which, None], toward.shape)
        sent = _reflected(brdf, toward.reshape(-1, 3), seen.reshape(-1, 3), brought)
        if np.isscalar(total):
            total = np.zeros((*sent.shape[:-1], len(normals)))
        total[..., which] += sent
    return total


def _reflected(brdf: Brdf | BrdfSet, light: Array, view: Array, brought: Array) -> Array:
    if isinstance(brdf, BrdfSet):
        return brdf.reflected(light, view, brought)
    values = brdf(light, view)
    return (values.reshape(*values.shape[:-1], *brought.shape) * brought).sum(axis=-1)


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

    def render(self, brdf: Brdf | BrdfSet, light: Lights) -> Array:
        """Return the picture in linear light, black around the sphere.

        Its shape is (size, size), or (3, size, size) in colour; of a set of BRDFs they come
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
