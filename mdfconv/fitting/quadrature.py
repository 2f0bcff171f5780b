"""Angles and weights that resolve a lobe of any width and its tail to π/2."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from mdfconv.distributions.evaluation import Array, Indices, gauss_panels

# Panels from a thousandth of the half width to the horizon, the widest factor between two of
# them 2 for a mirror of 1e-8; towards π/2, where powers of cos β are not smooth, they shrink by 4.
_LOBE_PANELS = 48
_NARROWEST = 1e-3
_HORIZON_PANELS = 14
# Nodes a panel: 12 leave nothing to be seen in a fit, 4 tell its neighbourhood.
_ORDER, _SCAN_ORDER = 12, 4
_SCAN_SAMPLES = 40


class Quadrature(Protocol):
    """Where an integral over β is sampled, for a batch of n problems."""

    def nodes(self, rows: Indices, breaks: Array | None = None) -> tuple[Array, Array]:
        """Return angles and weights, shape (len(rows), k), with panels that end at breaks."""

    def coarse(self, rows: Indices, *, fine: bool = False) -> tuple[Array, Array]:
        """Return fewer angles, enough for the neighbourhood of a minimum; more if `fine`."""


class LobeQuadrature:
    """Gauss-Legendre panels that grow geometrically from the lobe to π/2.

    Parameters
    ----------
    half_width : numpy.ndarray, shape (n,)
        β_half of the narrowest lobe of each problem, radians.
    """

    def __init__(self, half_width: Array) -> None:
        start = _NARROWEST * half_width[:, None]
        growth = np.linspace(0, 1, _LOBE_PANELS + 1)
        lobe = start * (0.5 * np.pi / start) ** growth
        # Powers of cos β with a broken exponent have a singularity at the horizon.
        horizon = 0.5 * np.pi * (1 - 0.25 ** np.arange(1, _HORIZON_PANELS + 1))
        rows = half_width.size
        edges = [np.zeros((rows, 1)), lobe, np.broadcast_to(horizon, (rows, horizon.size))]
        self._edges = np.sort(np.concatenate(edges, axis=1), axis=1)

    def nodes(self, rows: Indices, breaks: Array | None = None) -> tuple[Array, Array]:
        """Return angles and weights; `breaks` has shape (len(rows), any number)."""
        edges = self._edges[rows]
        if breaks is not None:
            edges = np.sort(np.concatenate([edges, breaks], axis=1), axis=1)
        return gauss_panels(edges, _ORDER)

    def coarse(self, rows: Indices, *, fine: bool = False) -> tuple[Array, Array]:
        """Return the panels at a low order."""
        return gauss_panels(self._edges[rows], _ORDER if fine else _SCAN_ORDER)


class UniformSamples:
    """Equal weights at uniformly spaced angles, as in the paper's Table 2.

    Parameters
    ----------
    reach : numpy.ndarray, shape (n,)
        The largest angle of each problem, radians.
    count : int
        The number of samples from 0 to there.
    """

    def __init__(self, reach: Array, count: int) -> None:
        self._beta = reach[:, None] * np.linspace(0, 1, count)

    def nodes(self, rows: Indices, breaks: Array | None = None) -> tuple[Array, Array]:
        """Return the samples; they are what they are, wherever the breaks."""
        beta = self._beta if rows.size == len(self._beta) else self._beta[rows]
        return beta, np.broadcast_to(1.0, beta.shape)

    def coarse(self, rows: Indices, *, fine: bool = False) -> tuple[Array, Array]:
        """Return a few of the samples, with the weight of all."""
        count = self._beta.shape[1]
        beta = self._beta[rows, :: max(1, count // _SCAN_SAMPLES)]
        return beta, np.full_like(beta, count / beta.shape[1])
