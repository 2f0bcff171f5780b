"""What the interactive page knows of light and of screens, as tables."""

from __future__ import annotations

from typing import Any

import numpy as np

from mdfconv.brdf.microfacet import direction, half_vector
from mdfconv.distributions import Distribution
from mdfconv.distributions.evaluation import Array, gauss_panels
from mdfconv.fitting.metrics.base import srgb
from mdfconv.render.comparison import Scene
from mdfconv.render.page_tables import DEGREE, grid, packed, rounded
from mdfconv.render.sphere import LIGHTS, VIEW, Lights, cross_section, radiance

_LABELS = {"directional": "the sun", "area": "a square lamp"}
# Where the peak of the source's picture is sampled: parameters, and points of a section.
_PEAKS, _SECTION_POINTS = 64, 41
# The environment as the sphere mirrors it: rows of the angle from the viewer, and azimuths.
_ROWS, _AZIMUTHS = 25, 48
# Of the integrals over the environment: nodes in the height, and azimuths.
_HEIGHTS, _AROUND = 32, 64
_FILMIC_WHITE, _LEVELS = 16.0, 4096


def lights(source: Distribution) -> list[dict[str, Any]]:
    """Return the lights of `mdfconv.render.sphere`, and how bright they make the source.

    Returns
    -------
    list of dict
        For each light its ``label``; ``directions``, (x, y, z, w) of each sample, where w is what
        the viewer gets through the half vector for D = 1 (irradiance, F and the constants of the
        BRDF); and ``peak``, the ln of the picture's maximum at parameters in equal steps of ln p.
    """
    return [_light(name, LIGHTS[name], source) for name in LIGHTS.names]


def _light(name: str, light: Lights, source: Distribution) -> dict[str, Any]:
    half = half_vector(light.directions, VIEW)
    some = source.parameter.typical_value
    surface = Scene().surface(source, some)
    weights = [
        radiance(normal[None, :], surface, Lights(toward[None, :], irradiance[None]))[0]
        for normal, toward, irradiance in zip(half, light.directions, light.irradiance, strict=True)
    ]
    through = np.array(weights) / float(source.normalized(0.0, some))
    peaks = [
        _peak(source, float(parameter), light, half)
        for parameter in grid(*source.parameter.typical, _PEAKS)
    ]
    return {
        "label": _LABELS.get(name, name),
        "directions": rounded(np.column_stack([light.directions, through])),
        "peak": rounded(np.log(peaks)),
    }


def _peak(source: Distribution, parameter: float, light: Lights, half: Array) -> float:
    """Return the maximum of the picture, on the section through the highlight or in a sample."""
    width = min(4 * float(source.peak_alpha(parameter)), 1.0)
    normals = np.concatenate([cross_section(_SECTION_POINTS, width)[1], half])
    surface = Scene().surface(source, parameter)
    return float(radiance(normals, surface, light).max())


def environment() -> dict[str, Any]:
    """Return a small landscape as the sphere mirrors it, by degree of spherical harmonics.

    Returns
    -------
    dict
        ``rows`` of the mirrored direction's angle from the viewer, 0 to π, and ``azimuths`` from
        the x axis; ``mean``; and for the degrees from 1 ``scales`` and ``maps`` of 8-bit numbers.
        A lobe's picture is the mean and the sum over degrees of k_l, scale and map.
    """
    theta = np.linspace(0, np.pi, _ROWS)
    phi = 2 * np.pi * np.arange(_AZIMUTHS) / _AZIMUTHS
    seen = direction(*np.meshgrid(theta, phi, indexing="ij")).reshape(-1, 3)
    parts = _by_degree(seen)
    parts /= parts.sum(axis=0).max()
    scales = np.abs(parts[1:]).max(axis=1) / 127
    return {
        "rows": _ROWS,
        "azimuths": _AZIMUTHS,
        "mean": float(parts[0].mean()),
        "scales": rounded(scales),
        "maps": packed(np.rint(parts[1:] / scales[:, None]), np.int8),
    }


def _by_degree(seen: Array) -> Array:
    """Return the parts of the landscape in each degree, shape (DEGREE + 1, n).

    A part is (2l+1)/(4π) ∫ L(ω) P_l(ω·ω') dω, by the addition theorem; P_l by its recurrence.
    """
    height, weight = gauss_panels(np.array([[-1.0, 1.0]]), _HEIGHTS)
    azimuth = 2 * np.pi * (np.arange(_AROUND) + 0.5) / _AROUND
    # The poles of the quadrature are above and below, as those of the landscape.
    z, phi = np.meshgrid(height[0], azimuth, indexing="ij")
    level = np.sqrt(1 - z * z)
    nodes = np.stack([level * np.cos(phi), z, level * np.sin(phi)], axis=-1).reshape(-1, 3)
    light = _landscape(nodes) * np.repeat(weight[0], _AROUND) * 2 * np.pi / _AROUND
    cosine = seen @ nodes.T
    before, now = np.ones_like(cosine), cosine
    parts = []
    for degree in range(DEGREE + 1):
        # Lanczos' factor keeps what is cut off from ringing.
        share = (2 * degree + 1) / (4 * np.pi) * np.sinc(degree / (DEGREE + 1))
        parts.append(share * (before @ light))
        step = (2 * degree + 3) * cosine * now - (degree + 1) * before
        before, now = now, step / (degree + 2)
    return np.array(parts)


def _landscape(toward: Array) -> Array:
    """Return the radiance from directions with y up: sky, sun behind haze, hills, ground."""
    x, y, z = np.moveaxis(toward, -1, 0)
    azimuth = np.arctan2(x, z)
    hills = 0.12 + 0.1 * np.sin(3 * azimuth + 1) + 0.06 * np.sin(7 * azimuth)
    sky = 0.35 + 0.25 * (1 - np.clip(y, 0, 1)) ** 3
    clouds = 0.25 * np.clip(np.sin(5 * x + 2) * np.sin(6 * z - 1) * np.sin(4 * y + 1), 0, 1)
    sun = direction(0.9, 2.3)
    haze = 6 * np.exp(-(1 - toward @ sun) / 0.02)
    ground = 0.1 + 0.05 * np.sin(9 * x) * np.sin(8 * z)
    return np.where(y > hills, sky + clouds + haze, np.where(y > 0, 0.04, ground))


def curves() -> list[dict[str, Any]]:
    """Return the curves from linear light to a screen's 8 bits.

    Returns
    -------
    list of dict
        For each its ``label``, the light that is ``white``, and ``levels``: 0 to 255 for light in
        equal steps of its root, from 0 to white.
    """
    root = np.linspace(0, 1, _LEVELS)
    return [
        _curve("sRGB", 1.0, srgb(np.square(root))),
        _curve("filmic", _FILMIC_WHITE, srgb(_filmic(_FILMIC_WHITE * np.square(root)))),
    ]


def _curve(label: str, white: float, encoded: Array) -> dict[str, Any]:
    levels = np.rint(255 * encoded)
    # Where each level begins says it all, in a twentieth of the room.
    starts = np.searchsorted(levels, np.arange(1, 256))
    return {
        "label": label,
        "white": white,
        "entries": _LEVELS,
        "starts": packed(starts, np.uint16),
    }


def _filmic(light: Array) -> Array:
    """Return the fit to the ACES tone curve of Narkowicz 2015, which rises to just above 1."""
    return np.clip(light * (2.51 * light + 0.03) / (light * (2.43 * light + 0.59) + 0.14), 0, 1)
