"""How a lobe blurs an environment: k_l, by which it multiplies the degree l."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from mdfconv.distributions import Distribution
from mdfconv.distributions.evaluation import Array, gauss_panels

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

    Parameters
    ----------
    highest : int
        The highest degree of which each is a term of its own.

    Attributes
    ----------
    degree : numpy.ndarray, shape (k,)
        l + ½: from 3/2 in steps of 1, then from `highest` + 1 in logarithmic ones.
    count : numpy.ndarray, shape (k,)
        How many harmonics a term stands for: 2l + 1 for a degree, ∫ 2 (l + ½) dl for a step.
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
        values = [distribution.normalized(beta, parameter) for beta in self._angles]
        return self._transformed(*values)

    def with_slope(self, distribution: Distribution, parameter: Array) -> tuple[Array, Array]:
        """Return k_l and ∂k_l/∂ ln p for parameters of shape (n, 1), shapes (n, k)."""
        pairs = [
            distribution.with_slope(
                np.broadcast_to(beta, (len(parameter), beta.size)), parameter, normalized=True
            )
            for beta in self._angles
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
    def _angles(self) -> tuple[Array, Array]:
        """The angles at which lobes are sampled, for low and for high degrees."""
        return self._panels[0], self._radii[self._radii < np.pi / 2]

    @cached_property
    def _panels(self) -> tuple[Array, Array]:
        wave = _WAVES * np.pi / self._highest
        lobe = wave * _GROWTH ** np.arange(np.log(_LEAST_ANGLE / wave) // np.log(_GROWTH), 0)
        even = np.linspace(wave, np.pi / 2, int(np.ceil(np.pi / 2 / wave)) + 1)
        edges = np.concatenate([[0.0], lobe, even, np.pi / 2 * _TOWARDS_HORIZON])
        beta, weight = gauss_panels(np.sort(edges)[None, :], _ORDER)
        return beta[0], weight[0]

    @cached_property
    def _legendre(self) -> Array:
        """The integral as a matrix, from D at the angles to k_l."""
        from scipy.special import legendre_p_all

        beta, weight = self._panels
        polynomials = legendre_p_all(self._highest, np.cos(2 * beta))[0][1:]
        matrix: Array = (polynomials * (np.pi * np.sin(2 * beta) * weight)).T
        return matrix

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

        beta = self._angles[1]
        samples = np.zeros((beta.size, self._radii.size))
        np.fill_diagonal(samples, np.pi * np.sqrt(2 * beta * np.sin(2 * beta)))
        spectra = fht(samples, _STEP, 0, self._offset)[:, -self._smooth_count :]
        matrix: Array = spectra / (2 * self.degree[self._highest :])
        return matrix
