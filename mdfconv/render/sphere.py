"""A sphere under a distant light, seen from afar: Figures 3 to 5 of Sawicki 2021.

The viewer looks along −z at the unit sphere, without perspective, so every pixel's normal is
known and one light direction gives one half vector for the whole picture.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mdfconv.brdf.directions import Brdf, frames, half_vector, unit
from mdfconv.distributions.evaluation import Array
from mdfconv.registry import Registry

VIEW = np.array([0.0, 0.0, 1.0])
LIGHT = np.array([-0.5, 0.5, np.sqrt(0.5)])  # 45° off the viewer, from above left
_AREA_HALF_SIDE = 0.15  # of the distance to the square light
_AREA_SAMPLES = 8  # a side
MARGIN = 1.04  # half the picture, in radii
# Some twenty vectors for each normal, as many as this, stay in the cache.
_NORMALS_AT_ONCE = 8192


@dataclass(frozen=True)
class Lights:
    """Distant light from a set of directions.

    Parameters
    ----------
    directions : numpy.ndarray, shape (k, 3)
        Unit vectors towards the light.
    irradiance : numpy.ndarray, shape (k,)
        What each brings to a surface that faces it.
    """

    directions: Array
    irradiance: Array


def _square() -> Lights:
    """Return a level square around `LIGHT`, which faces the sphere; total irradiance π."""
    right = unit(np.cross([0.0, 1.0, 0.0], LIGHT))
    up = np.cross(LIGHT, right)
    steps = _AREA_HALF_SIDE * (2 * (np.arange(_AREA_SAMPLES) + 0.5) / _AREA_SAMPLES - 1)
    x, y = (grid.ravel()[:, None] for grid in np.meshgrid(steps, steps))
    toward = LIGHT + x * right + y * up
    distance = np.linalg.norm(toward, axis=1)
    # A sample of the square counts by its solid angle: cosine at the light over distance².
    weight = distance**-3
    return Lights(toward / distance[:, None], np.pi * weight / weight.sum())


LIGHTS: Registry[Lights] = Registry("light")
LIGHTS.add("directional", Lights(LIGHT[None, :], np.array([np.pi])))
LIGHTS.add("area", _square())


def radiance(normals: Array, brdf: Brdf, light: Lights) -> Array:
    """Return the light that surfaces send to the viewer.

    Parameters
    ----------
    normals : numpy.ndarray, shape (n, 3)
        Unit normals; where one turns away from the viewer the result is 0.
    brdf : callable
        The BRDF, of directions in the frames of the normals; or several, stacked.
    light : Lights
        Where the light comes from.

    Returns
    -------
    numpy.ndarray, shape (n,), or (3, n) in colour
        Radiance in units of irradiance per steradian; of several BRDFs they come first.
    """
    blocks = np.array_split(normals, max(1, len(normals) // _NORMALS_AT_ONCE))
    return np.concatenate([_radiance(block, brdf, light) for block in blocks], axis=-1)


def _radiance(normals: Array, brdf: Brdf, light: Lights) -> Array:
    total: Array = np.zeros(len(normals))
    local = frames(normals)
    view = local @ VIEW
    for direction, irradiance in zip(light.directions, light.irradiance, strict=True):
        toward = local @ direction
        lit = np.flatnonzero((view[:, 2] > 0) & (toward[:, 2] > 0))
        sent = brdf(toward[lit], view[lit]) * toward[lit, 2] * irradiance
        everywhere = np.zeros((*sent.shape[:-1], len(normals)))
        everywhere[..., lit] = sent
        total = total + everywhere
    return total


@dataclass(frozen=True)
class Frame:
    """The pixels of a square picture that show the sphere.

    Parameters
    ----------
    size : int
        Pixels a side.
    """

    size: int

    def normals(self) -> tuple[Array, Array]:
        """Return the pixels' normals, shape (size², 3), and how far each is covered, 0 to 1."""
        axis = MARGIN * (2 * (np.arange(self.size) + 0.5) / self.size - 1)
        x, y = np.meshgrid(axis, -axis)
        radius = np.hypot(x, y)
        pixel = 2 * MARGIN / self.size
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

    The line runs through the centre of the sphere's disc, towards the light.

    Parameters
    ----------
    count : int
        Twice this many positions, plus one: so many all along the line, so many within the
        highlight, and its centre.
    width : float
        How far from its centre the highlight is resolved, radians.
    """
    centre = float(np.arccos(half_vector(LIGHT, VIEW)[2]))
    spread = centre + np.linspace(-width, width, count)
    everywhere = np.linspace(-0.5 * np.pi, 0.5 * np.pi, count + 2)[1:-1]
    angle = np.unique(np.concatenate([everywhere, spread, [centre]]))
    angle = angle[np.abs(angle) < 0.5 * np.pi]
    across = LIGHT[:2] / np.linalg.norm(LIGHT[:2])
    normals = np.column_stack([np.sin(angle)[:, None] * across, np.cos(angle)])
    return np.sin(angle), normals


def highlight() -> tuple[float, float]:
    """Return where the highlight lies: the half vector's x and y, in radii."""
    x, y, _ = half_vector(LIGHT, VIEW)
    return float(x), float(y)
