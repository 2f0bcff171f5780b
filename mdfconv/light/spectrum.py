"""The angular power spectrum C_l of a light, and its continuation by a power law."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from mdfconv.distributions.evaluation import Array
from mdfconv.light.environment_map import read_environment_map

# Degrees beyond follow the power law anyhow.
_MOST_DEGREES = 255
# The law is fitted from here on: below, a degree has too few harmonics to be typical.
FIRST_OF_LAW = 10
# A law is not steeper than that of a smooth sky, nor does it rise; what is less than this share of
# the largest power is rounding.
_SOFTEST, _ROUNDING = 6.0, 1e-12
# Rows whose Legendre functions are held at a time: 67 MB.
_ROWS_AT_ONCE = 64


@dataclass(frozen=True)
class Spectrum:
    """The power of a light by degree: C_l = Σ_m |a_lm|² / (2l + 1).

    Parameters
    ----------
    power : numpy.ndarray, shape (L + 1,)
        C_l for l from 0 to L, at least 31, relative to that of a white sphere as bright on
        average: C_0 = 4π.
    """

    power: Array

    @property
    def highest(self) -> int:
        """The highest degree L."""
        return self.power.size - 1

    @property
    def exponent(self) -> float:
        """P of the law C_l ~ l^−p: 0 for a sun or a lamp, 2 for nature's 1/f²."""
        return 0.0 - self._line[0]

    def at(self, degree: Array) -> Array:
        """Return C_l for l + ½ of any size: as measured up to L, beyond by the power law."""
        measured = self.power[np.minimum(degree, self.highest).astype(int)]
        return np.where(degree < self.highest + 1, measured, self.law(degree))

    def law(self, degree: Array) -> Array:
        """Return C_l for l + ½ by the power law."""
        slope, constant = self._line
        return np.exp(constant + slope * np.log(degree))

    @cached_property
    def _line(self) -> tuple[float, float]:
        """Slope and constant of the line through ln C_l over ln (l + ½)."""
        least = _ROUNDING * self.power[1:].max()
        degree = np.arange(1, self.highest + 1)
        # What is symmetrical or smooth has no power in some degrees but that of rounding.
        degree = degree[self.power[1:] > least]
        usual = degree[degree >= FIRST_OF_LAW]
        degree = usual if usual.size > 1 else degree
        x, y = np.log(degree + 0.5), np.log(self.power[degree])
        slope = np.polyfit(x, y, 1)[0] if degree.size > 1 else -_SOFTEST
        slope = float(np.clip(slope, -_SOFTEST, 0))
        return slope, float(np.mean(y - slope * x))


def spectrum_of(luminance: Array) -> Spectrum:
    """Return the spectrum of an environment map, to l = height/2 − 1, at most 255.

    Parameters
    ----------
    luminance : numpy.ndarray, shape (h, 2 h)
        In latitude and longitude, the zenith first.
    """
    from scipy.special import sph_legendre_p_all

    height, width = luminance.shape
    highest = min(height // 2 - 1, _MOST_DEGREES)
    zenith = np.pi * (np.arange(height) + 0.5) / height
    rows = _weights(zenith)[:, None] * np.fft.rfft(luminance, axis=1)[:, : highest + 1]
    rows *= 2 * np.pi / width
    harmonics = np.zeros((highest + 1, highest + 1), complex)
    for start in range(0, height, _ROWS_AT_ONCE):
        part = slice(start, start + _ROWS_AT_ONCE)
        legendre = sph_legendre_p_all(highest, highest, zenith[part])[0][:, : highest + 1]
        harmonics += np.einsum("lmt,tm->lm", legendre, rows[part])
    power = np.square(np.abs(harmonics)).sum(axis=1) * 2 - np.square(np.abs(harmonics[:, 0]))
    power /= 2 * np.arange(highest + 1) + 1
    return Spectrum(power * (4 * np.pi / power[0]))


def _weights(zenith: Array) -> Array:
    """Return the weights of Fejér's first rule, which is exact for harmonics (Fejér 1933)."""
    order = np.arange(1, zenith.size // 2 + 1)
    ripple = np.cos(2 * np.outer(zenith, order)) @ (2 / (4 * np.square(order) - 1))
    weights: Array = 2 / zenith.size * (1 - ripple)
    return weights


def spectrum_of_file(path: str | Path) -> Spectrum:
    """Return the spectrum of an environment map; raise as `read_environment_map`."""
    return spectrum_of(read_environment_map(path))
