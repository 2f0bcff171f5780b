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
_SCAN_SAMPLES, _FINE_SAMPLES = 40, 300
# An encoding for a screen rises like a root where a distribution leaves 0: panels that shrink
# by 4 towards the edge resolve it to 1e-6 of the lobe.
_TOWARDS_EDGE = 1 - np.append(0.25 ** np.arange(1, 10), 0)
# With the nodes of a smooth quadrature by 16 is enough.
_TOWARDS_SMOOTH_EDGE = 1 - np.append(0.0625 ** np.arange(1, 5), 0)
# ln tan β = ln tan β_half + 1.5 sinh s for s in this range: from e⁻¹⁸ of a lobe to within e⁻¹⁸ of
# the horizon. The trapezoidal rule needs so many nodes, panels so many of the order above.
_SPREAD, _RANGE = 1.5, (-3.2, 3.2)
_SMOOTH_NODES, _SMOOTH_ENDS = 76, np.linspace(*_RANGE, 9)


class Quadrature(Protocol):
    """Where an integral over β is sampled, for a batch of n problems."""

    def nodes(
        self, rows: Indices, kinks: Array | None = None, edges: Array | None = None
    ) -> tuple[Array, Array]:
        """Return angles and weights, shape (len(rows), k).

        Panels end at kinks and edges, shape (len(rows), any), 0 for none: where the integrand
        bends, and where a distribution becomes 0.
        """

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

    def nodes(
        self, rows: Indices, kinks: Array | None = None, edges: Array | None = None
    ) -> tuple[Array, Array]:
        """Return angles and weights, as in the protocol."""
        ends = [self._edges[rows]]
        if kinks is not None:
            ends.append(kinks)
        if edges is not None:
            ends.append((edges[:, :, None] * _TOWARDS_EDGE).reshape(len(edges), -1))
        return gauss_panels(np.sort(np.concatenate(ends, axis=1), axis=1), _ORDER)

    def coarse(self, rows: Indices, *, fine: bool = False) -> tuple[Array, Array]:
        """Return the panels at a low order."""
        return gauss_panels(self._edges[rows], _ORDER if fine else _SCAN_ORDER)


class SmoothQuadrature:
    """A few nodes in a variable in which integrands over a lobe are smooth.

    ln tan β = ln tan β_half + 1.5 sinh s: tan β makes lobes similar, its logarithm makes them
    analytic, and sinh turns their decay like a power, at the normal, in the tail and at the
    horizon, into one like an exponential's exponential (Takahasi & Mori 1974). The trapezoidal
    rule then converges geometrically, and between kinks Gauss-Legendre panels do.

    Parameters
    ----------
    half_width : numpy.ndarray, shape (n,)
        β_half of the narrowest lobe of each problem, radians.
    """

    def __init__(self, half_width: Array) -> None:
        self._log_tangent = np.log(np.tan(half_width))[:, None]

    def nodes(
        self, rows: Indices, kinks: Array | None = None, edges: Array | None = None
    ) -> tuple[Array, Array]:
        """Return angles and weights, as in the protocol."""
        middle = self._log_tangent[rows]
        if kinks is not None and edges is not None:
            edges = (edges[:, :, None] * _TOWARDS_SMOOTH_EDGE).reshape(len(edges), -1)
        breaks = [self._variable(part, middle) for part in (kinks, edges) if part is not None]
        if breaks:
            every = np.broadcast_to(_SMOOTH_ENDS, (rows.size, _SMOOTH_ENDS.size))
            ends = np.sort(np.concatenate([every, *breaks], axis=1), axis=1)
            s, weight = gauss_panels(ends, _ORDER)
        else:
            s = np.linspace(*_RANGE, _SMOOTH_NODES)[None, :]
            weight = np.broadcast_to(s[0, 1] - s[0, 0], s.shape)
        tangent = np.exp(middle + _SPREAD * np.sinh(s))
        slope = _SPREAD * np.cosh(s) * tangent / (1 + np.square(tangent))
        return np.arctan(tangent), weight * slope

    def coarse(self, rows: Indices, *, fine: bool = False) -> tuple[Array, Array]:
        """Return all: there are few."""
        return self.nodes(rows)

    def _variable(self, beta: Array, middle: Array) -> Array:
        """Return s of angles, within its range; its lower end for 0."""
        tangent = np.maximum(np.tan(beta), np.exp(middle + _SPREAD * np.sinh(_RANGE[0])))
        s: Array = np.clip(np.arcsinh((np.log(tangent) - middle) / _SPREAD), *_RANGE)
        return s


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

    def nodes(
        self, rows: Indices, kinks: Array | None = None, edges: Array | None = None
    ) -> tuple[Array, Array]:
        """Return the samples; they are what they are, wherever the kinks."""
        beta = self._beta if rows.size == len(self._beta) else self._beta[rows]
        return beta, np.broadcast_to(1.0, beta.shape)

    def coarse(self, rows: Indices, *, fine: bool = False) -> tuple[Array, Array]:
        """Return some of the samples, weighted so that their sum is that of all.

        By the trapezoidal rule for both, up to slopes at the ends (Euler-Maclaurin).
        """
        last = self._beta.shape[1] - 1
        longest = max(1, last // (_FINE_SAMPLES if fine else _SCAN_SAMPLES))
        step = next(step for step in range(longest, 0, -1) if last % step == 0)
        beta = self._beta[rows, ::step]
        weight = np.full_like(beta, step)
        weight[:, [0, -1]] = 0.5 * (step + 1)
        return beta, weight
