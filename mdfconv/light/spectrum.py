"""Angular power spectra: C_l of an environment map, k_l of a lobe that blurs it."""

from __future__ import annotations

import stat
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from mdfconv.distributions import Distribution
from mdfconv.distributions.angles import Angles
from mdfconv.distributions.evaluation import Array, gauss_panels
from mdfconv.errors import MdfconvError
from mdfconv.light.radiance import SIGNATURE, read_radiance
from mdfconv.output.kinds import HEAD_BYTES, refuse_foreign

# Of linear Rec. 709 (ITU-R BT.709), the primaries of OpenEXR and Radiance files.
_LUMINANCE = np.array([0.2126, 0.7152, 0.0722], np.float32)
# A map is often the reduction of a larger one, and the filter that made it has overshot beside
# its lights: by at most a quarter of what shines within four texels.
_OVERSHOOT, _FILTER_WIDTH = 0.25, 9
# Where a spectrum has a slope that means something.
_LEAST_HEIGHT = 64
# What OpenImageIO calls the cube map of an OpenEXR file.
_CUBE = "CubeFace Environment"
_WAY_OUT = "convert it to latitude and longitude, 2:1"


def read_environment_map(path: str | Path) -> Array:
    """Return the luminance of an environment map in latitude and longitude.

    Parameters
    ----------
    path : str or Path
        A Radiance picture, or one that OpenImageIO reads, OpenEXR for one; taken as linear. The
        first row is the zenith.

    Returns
    -------
    numpy.ndarray, shape (h, 2 h)
        Luminance.

    Raises
    ------
    MdfconvError
        If it cannot be read as a whole, is not twice as wide as high, has fewer than 64 rows, is
        not finite, black or of one colour, or has negative texels that no filter has made.
    """
    pixels = _read(Path(path))
    height, width = pixels.shape[:2]
    if width != 2 * height:
        reason = f"{path}: an environment map has a shape of 2:1, not {width}×{height}"
        raise MdfconvError(reason, _WAY_OUT)
    if height < _LEAST_HEIGHT:
        raise MdfconvError(f"{path}: a spectrum takes {_LEAST_HEIGHT} rows, not {height}")
    if not np.isfinite(pixels).all():
        count = int(np.count_nonzero(~np.isfinite(pixels).all(axis=2)))
        raise MdfconvError(f"{path}: {count} of {height * width} texels are NaN or infinite")
    colour = pixels.shape[2] > 2
    luminance: Array = (pixels @ _LUMINANCE if colour else pixels[:, :, 0]).astype(np.float64)
    _check_light(luminance, path)
    return luminance


def _read(path: Path) -> Array:
    """Return luminance or the first colour channels of a picture, shape (h, w, 1 to 3), float32."""
    # Libraries open names with patterns in them, and devices; a file is what it is.
    try:
        if not stat.S_ISREG(path.stat().st_mode):
            raise MdfconvError(f"cannot read {path}: it is not a file")
        with path.open("rb") as file:
            head = file.read(HEAD_BYTES)
            if head.startswith(SIGNATURE):
                return read_radiance(head + file.read())
    except OSError as error:
        raise MdfconvError(f"cannot read {path}: {error.strerror}") from None
    except MdfconvError:
        raise
    except ValueError as error:  # a damaged picture, or a name with a 0 in it
        raise MdfconvError(f"cannot read {path}: {error}") from None
    return _read_other(path, head)


def _read_other(path: Path, head: bytes) -> Array:
    """Return the first colour channels of a picture that is read by OpenImageIO."""
    import OpenImageIO

    source = OpenImageIO.ImageInput.open(str(path))
    if source is None:
        fault = OpenImageIO.geterror()
        refuse_foreign(path, head)
        raise MdfconvError(f"cannot read {path}: {_first_line(fault)}")
    try:
        shape = source.spec()
        is_strip = max(shape.width, shape.height) == 6 * min(shape.width, shape.height)
        if is_strip or shape.getattribute("textureformat") == _CUBE:
            tool = " (exrenvmap -l, of OpenEXR)" if source.format_name() == "openexr" else ""
            raise MdfconvError(f"{path} is a cube map", _WAY_OUT + tool)
        if (shape.width, shape.height) != (shape.full_width, shape.full_height):
            raise MdfconvError(f"{path}: a part of a larger picture is no environment map")
        channels = min(shape.nchannels, 3)
        pixels = source.read_image(0, 0, 0, channels, "float")
        fault = source.geterror()
    finally:
        source.close()
    if pixels is None or fault:
        raise MdfconvError(f"cannot read {path}: {_first_line(fault)}")
    return np.asarray(pixels)


def _first_line(text: str) -> str:
    return (text.strip().splitlines() or ["it is damaged"])[0]


def _check_light(luminance: Array, path: str | Path) -> None:
    from scipy.ndimage import maximum_filter

    if not luminance.any():
        raise MdfconvError(f"{path}: the map is black")
    if np.ptp(luminance) == 0:
        raise MdfconvError(
            f"{path}: the map is of one colour, under which all surfaces look the same"
        )
    bright = maximum_filter(luminance, _FILTER_WIDTH, mode=("nearest", "wrap"))
    negative = np.count_nonzero(-luminance > _OVERSHOOT * np.maximum(bright, 0))
    if negative:
        raise MdfconvError(f"{path}: {negative} of {luminance.size} texels are negative")


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
    return 2 / zenith.size * (1 - ripple)


def spectrum_of_file(path: str | Path) -> Spectrum:
    """Return the spectrum of an environment map; raise as `read_environment_map`."""
    return spectrum_of(read_environment_map(path))


# Lobes down to α = 1e-17 are resolved.
_LEAST_ANGLE = 1e-18
# P_l(cos 2β) has a wave length of π/l: panels of two of them, and for smaller angles panels that
# grow by 4, with 12 nodes each.
_WAVES, _GROWTH, _ORDER = 2.0, 4.0, 12
# Of the Hankel transform: steps in ln β and ln l, and how far beyond π/2 its period reaches.
_STEP, _BEYOND = 0.1, 1e3
# Towards π/2, where the roughest lobes are, panels shrink by 4.
_TOWARDS_HORIZON = 1 - 0.25 ** np.arange(4, 18)


class LobeSpectrum:
    """The spectrum k_l of lobes, each degree to a highest one and from there on smoothly.

    k_l = 2π ∫ D sin β cos β P_l(cos 2β) dβ: for a mirror-like surface seen from the normal, the
    kernel over incident directions θ = 2β is D(θ/2)/4. A degree that is so high that the sum over
    degrees is an integral goes by Hilb's formula (Szegő 1939, 8.21.17),
    P_l(cos θ) ≈ √(θ/sin θ) J₀((l + ½) θ), through a logarithmic Hankel transform (Hamilton 2000).

    `degree`, shape (k,), is l + ½: from 3/2 to `highest` + ½ in steps of 1, then in logarithmic
    ones. `count` is how many harmonics a term stands for: 2l + 1, or ∫ 2 (l + ½) dl for a step.
    """

    def __init__(self, highest: int) -> None:
        self._highest = highest
        each = np.arange(1, highest + 1) + 0.5
        steps = int(np.log((highest + 1) * _LEAST_ANGLE) / -_STEP)
        smooth = (highest + 1) * np.exp(_STEP * np.arange(steps))
        weight = 2 * _STEP * np.square(smooth)
        weight[0] /= 2  # the end of the trapezoidal rule
        self.degree = np.concatenate([each, smooth])
        self.count = np.concatenate([2 * each, weight])

    def __call__(self, distribution: Distribution, parameter: Array) -> Array:
        """Return k_l for parameters of shape (..., 1), shape (..., k)."""
        values = [distribution.normalized(angles.beta, parameter) for angles in self._angles]
        return self._transformed(*values)

    def with_slope(self, distribution: Distribution, parameter: Array) -> tuple[Array, Array]:
        """Return k_l and ∂k_l/∂ ln p for parameters of shape (n, 1), shapes (n, k)."""
        pairs = [
            distribution.with_slope(angles, parameter, normalized=True) for angles in self._angles
        ]
        values, slopes = zip(*pairs, strict=True)
        return self._transformed(*values), self._transformed(*slopes)

    def _transformed(self, low: Array, high: Array) -> Array:
        """Return the spectra of functions sampled at both sets of angles."""
        return np.concatenate([low @ self._legendre, high @ self._hankel], axis=-1)

    @property
    def _smooth_count(self) -> int:
        return self.degree.size - self._highest

    @cached_property
    def _angles(self) -> tuple[Angles, Angles]:
        """The angles at which lobes are sampled, for low and for high degrees."""
        return Angles(self._panels[0]), Angles(self._radii[self._radii < np.pi / 2])

    @cached_property
    def _panels(self) -> tuple[Array, Array]:
        wave = _WAVES * np.pi / self._highest
        lobe = wave * _GROWTH ** np.arange(np.log(_LEAST_ANGLE / wave) // np.log(_GROWTH), 0)
        even = np.linspace(wave, np.pi / 2, int(np.ceil(np.pi / 2 / wave)) + 1)
        edges = np.concatenate([[0.0], lobe, even, np.pi / 2 * _TOWARDS_HORIZON])
        return gauss_panels(np.sort(edges), _ORDER)

    @cached_property
    def _legendre(self) -> Array:
        """The integral as a matrix, from D at the angles to k_l."""
        from scipy.special import legendre_p_all

        beta, weight = self._panels
        polynomials = legendre_p_all(self._highest, np.cos(2 * beta))[0][1:]
        return (polynomials * (np.pi * np.sin(2 * beta) * weight)).T

    @cached_property
    def _offset(self) -> float:
        from scipy.fft import fhtoffset

        return float(fhtoffset(_STEP, 0))

    @cached_property
    def _radii(self) -> Array:
        """The angles of the Hankel transform, of which the last are beyond π/2."""
        size = self._smooth_count + int(np.log(2 * (self._highest + 1) * _BEYOND) / _STEP)
        # The product of an angle and the 2l + 1 as far from the other end is exp(offset).
        largest = 2 * self.degree[-1]
        return np.exp(self._offset) / largest * np.exp(_STEP * np.arange(size))

    @cached_property
    def _hankel(self) -> Array:
        """The transform as a matrix, from D at the angles to k_l."""
        from scipy.fft import fht

        beta = self._angles[1].beta
        samples = np.zeros((beta.size, self._radii.size))
        np.fill_diagonal(samples, np.pi * np.sqrt(2 * beta * np.sin(2 * beta)))
        spectra = fht(samples, _STEP, 0, self._offset)[:, -self._smooth_count :]
        return spectra / (2 * self.degree[self._highest :])
