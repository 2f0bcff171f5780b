"""The metric that keeps the light of a given environment map."""

from __future__ import annotations

from functools import cache, lru_cache
from pathlib import Path
from typing import Self

import numpy as np

from mdfconv.distributions import Distribution
from mdfconv.distributions.angles import Angles
from mdfconv.distributions.evaluation import Array, Indices
from mdfconv.errors import MdfconvError
from mdfconv.fitting.metrics.base import Metric
from mdfconv.fitting.quadrature import NO_BREAKS, Breaks, Quadrature, Samples
from mdfconv.light.spectrum import LobeSpectrum, Spectrum, spectrum_of_file

_lobe_spectrum = cache(LobeSpectrum)


class LightMetric(Metric):
    """The light of an environment map: Σ (2l+1) C_l (Δk_l)².

    A lobe blurs the environment, which multiplies degree l by k_l; C_l is the angular power of
    the map's luminance, beyond its resolution continued by its power law. The sum takes the place
    of the integral over β: S is k_l, and a sample is a degree. The label is the path of the map.
    """

    name = "light"
    keeps = "light of an environment map"
    word = "map"
    purpose = "under that light"
    quantity = "k_l, the contrast that is left at degree l"
    normalized = True
    setting = "environment map"
    needs_setting = True
    over_angles = False
    similar_below = 1e-7

    def __init__(self, spectrum: Spectrum, label: str = "") -> None:
        self.spectrum, self._label = spectrum, label
        self.inputs = (Path(label),) if label else ()
        self._lobes = _lobe_spectrum(spectrum.highest)
        self._weight = self._lobes.count * spectrum.at(self._lobes.degree)

    @classmethod
    def with_setting(cls, text: str) -> Self:
        """Return the metric for the path of an environment map, as in ``"light:sky.exr"``."""
        if not text:
            raise MdfconvError("the light metric needs an environment map", "light:FILE")
        path = Path(text)
        try:
            changed = path.stat().st_mtime_ns
        except (OSError, ValueError):
            changed = 0  # reading it says what is wrong
        return cls(_spectrum(path, changed), text)

    def __str__(self) -> str:
        """Return the name with the path of the map."""
        return f"{self.name}:{self._label}"

    def weight(self, angles: Angles) -> Array:
        """Return (2l+1) C_l of the degrees."""
        return np.broadcast_to(self._weight, angles.shape)

    def quadrature(self, half_width: Array) -> Quadrature:
        """Return the degrees."""
        return _Degrees(self._lobes.degree)

    def signal(self, mdf: Distribution, angles: Angles, parameter: Array, peak: Array) -> Array:
        """Return k_l."""
        with np.errstate(all="ignore"):
            # A row at a time stays in the cache.
            rows = [self._lobes(mdf, row[..., None]) for row in parameter[..., 0]]
        return np.stack(rows)

    def signal_and_slope(
        self, distribution: Distribution, angles: Angles, parameter: Array, peak: Array
    ) -> tuple[Array, Array]:
        """Return k_l and ∂k_l/∂ ln p."""
        return self._lobes.with_slope(distribution, parameter)


class _Degrees:
    """Degrees in the place of angles: the same for every problem, and each counts once."""

    def __init__(self, degree: Array) -> None:
        self._degree = degree

    def nodes(self, rows: Indices, breaks: Breaks = NO_BREAKS) -> Samples:
        shape = rows.size, self._degree.size
        return Angles(np.broadcast_to(self._degree, shape)), np.broadcast_to(1.0, shape)

    def coarse(self, rows: Indices, *, fine: bool = False) -> Samples:
        return self.nodes(rows)


@lru_cache(maxsize=4)
def _spectrum(path: Path, changed: int) -> Spectrum:
    """Return the spectrum of a map; one that has changed since is read anew."""
    return spectrum_of_file(path)


METRICS = (LightMetric,)
