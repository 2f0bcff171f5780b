"""Angles and weights that resolve a lobe of any width and its tail to π/2."""

from __future__ import annotations

from typing import NamedTuple, Protocol, TypeAlias

import numpy as np

from mdfconv.distributions.evaluation import Array, Indices, gauss_panels

# Panels from a thousandth of the half width to the horizon, the widest factor between two of
# them 2 for a mirror of 1e-8.
_LOBE_PANELS = 48
_NARROWEST = 1e-3
# Towards π/2, where powers of cos β are not smooth, panels shrink by 4.
_TOWARDS_HORIZON = 0.5 * np.pi * (1 - 0.25 ** np.arange(1, 15))
# Nodes a panel: 12 leave nothing to be seen in a fit, 4 tell its neighbourhood.
_ORDER, _SCAN_ORDER = 12, 4
_SCAN_SAMPLES, _FINE_SAMPLES = 40, 300
# ln tan β = ln tan β_half + 1.5 sinh s for s in this range: from e⁻¹⁸ of a lobe to within e⁻¹⁸ of
# the horizon. The trapezoidal rule needs so many nodes, panels so many of the order above.
_SPREAD, _RANGE = 1.5, (-3.2, 3.2)
_SMOOTH_NODES, _SMOOTH_PANELS = 76, np.linspace(*_RANGE, 9)


def _towards_edge(shrink: float, panels: int) -> Array:
    """Return where panels that shrink towards an edge begin and end, as shares of its angle."""
    return 1 - np.append((1 / shrink) ** np.arange(1, panels), 0)


# Where a distribution leaves 0, an encoding for a screen bends: these panels resolve it to 1e-6 of
# the lobe, with the nodes of a smooth quadrature the fewer ones do.
_TO_EDGE, _TO_SMOOTH_EDGE = _towards_edge(4, 10), _towards_edge(16, 5)
# A root of D has an infinite slope there. What the last panel, as narrow as rounding, leaves of a
# cube root is 1e-10.
_TO_STEEP_EDGE = _towards_edge(4, 27)


# Angles and weights, shape (n, k).
Samples: TypeAlias = tuple[Array, Array]


class Breaks(NamedTuple):
    """Angles at which panels end, shape (n, any), 0 for none.

    At kinks the integrand bends, at edges a distribution becomes 0.
    """

    kinks: Array | None = None
    edges: Array | None = None

    def joined(self, other: Breaks) -> Breaks:
        """Return those of both."""
        pairs = ([one for one in pair if one is not None] for pair in zip(self, other, strict=True))
        return Breaks(*(np.concatenate(pair, axis=1) if pair else None for pair in pairs))

    def rows(self, index: Indices) -> Breaks:
        """Return those of some rows."""
        return Breaks(*(None if angles is None else angles[index] for angles in self))


NO_BREAKS = Breaks()


class Quadrature(Protocol):
    """Where an integral over β is sampled, for a batch of n problems."""

    def nodes(self, rows: Indices, breaks: Breaks = NO_BREAKS) -> Samples:
        """Return angles and weights of some problems, the panels of which end at breaks, too."""

    def coarse(self, rows: Indices, *, fine: bool = False) -> Samples:
        """Return fewer angles, enough for the neighbourhood of a minimum; more if `fine`."""


class LobeQuadrature:
    """Gauss-Legendre panels that grow geometrically from the lobe to π/2.

    `half_width`, shape (n,), is β_half of the narrowest lobe of each problem; `steep` whether the
    integrand has an infinite slope where a distribution becomes 0.
    """

    def __init__(self, half_width: Array, *, steep: bool = False) -> None:
        self._to_edge = _TO_STEEP_EDGE if steep else _TO_EDGE
        start = _NARROWEST * half_width[:, None]
        growth = np.linspace(0, 1, _LOBE_PANELS + 1)
        lobe = start * (0.5 * np.pi / start) ** growth
        rows = half_width.size
        horizon = np.broadcast_to(_TOWARDS_HORIZON, (rows, _TOWARDS_HORIZON.size))
        self._panels = _sorted_panels(np.zeros((rows, 1)), lobe, horizon)

    def nodes(self, rows: Indices, breaks: Breaks = NO_BREAKS) -> Samples:
        """Return angles and weights, as in the protocol."""
        parts = [self._panels[rows]]
        if breaks.kinks is not None:
            parts.append(breaks.kinks)
        if breaks.edges is not None:
            parts.append(_products(breaks.edges, self._to_edge))
        return gauss_panels(_sorted_panels(*parts), _ORDER)

    def coarse(self, rows: Indices, *, fine: bool = False) -> Samples:
        """Return the panels at a low order."""
        return gauss_panels(self._panels[rows], _ORDER if fine else _SCAN_ORDER)


class SmoothQuadrature:
    """A few nodes in a variable in which integrands over a lobe are smooth.

    ln tan β = ln tan β_half + 1.5 sinh s: tan β makes lobes similar, its logarithm makes them
    analytic, and sinh turns their decay like a power, at the normal, in the tail and at the
    horizon, into one like an exponential's exponential (Takahasi & Mori 1974). The trapezoidal
    rule then converges geometrically, and between kinks Gauss-Legendre panels do.

    The arguments are those of `LobeQuadrature`.
    """

    def __init__(self, half_width: Array, *, steep: bool = False) -> None:
        self._log_tangent = np.log(np.tan(half_width))[:, None]
        self._steep = steep

    def nodes(self, rows: Indices, breaks: Breaks = NO_BREAKS) -> Samples:
        """Return angles and weights, as in the protocol."""
        middle = self._log_tangent[rows]
        kinks, edges = breaks
        if edges is not None and self._steep:
            edges = _products(edges, _TO_STEEP_EDGE)
        elif edges is not None and kinks is not None:
            edges = _products(edges, _TO_SMOOTH_EDGE)
        ends = [self._variable(part, middle) for part in (kinks, edges) if part is not None]
        if ends:
            panels = np.broadcast_to(_SMOOTH_PANELS, (rows.size, _SMOOTH_PANELS.size))
            s, weight = gauss_panels(_sorted_panels(panels, *ends), _ORDER)
        else:
            s = np.linspace(*_RANGE, _SMOOTH_NODES)[None, :]
            weight = np.broadcast_to(s[0, 1] - s[0, 0], s.shape)
        tangent = np.exp(middle + _SPREAD * np.sinh(s))
        slope = _SPREAD * np.cosh(s) * tangent / (1 + np.square(tangent))
        return np.arctan(tangent), weight * slope

    def coarse(self, rows: Indices, *, fine: bool = False) -> Samples:
        """Return all: there are few."""
        return self.nodes(rows)

    def _variable(self, beta: Array, middle: Array) -> Array:
        """Return s of angles, within its range; its lower end for 0."""
        tangent = np.maximum(np.tan(beta), np.exp(middle + _SPREAD * np.sinh(_RANGE[0])))
        return np.clip(np.arcsinh((np.log(tangent) - middle) / _SPREAD), *_RANGE)


def _sorted_panels(*ends: Array) -> Array:
    """Return where the panels of each row begin and end, from their ends in any order."""
    return np.sort(np.concatenate(ends, axis=1), axis=1)


def _products(angles: Array, shares: Array) -> Array:
    """Return every share of every angle of a row."""
    return (angles[:, :, None] * shares).reshape(len(angles), -1)


class UniformSamples:
    """Equal weights at `count` even angles from 0 to `reach`, as in the paper's Table 2."""

    def __init__(self, reach: Array, count: int) -> None:
        self._beta = reach[:, None] * np.linspace(0, 1, count)

    def nodes(self, rows: Indices, breaks: Breaks = NO_BREAKS) -> Samples:
        """Return the samples; they are what they are, wherever the kinks."""
        beta = self._beta if rows.size == len(self._beta) else self._beta[rows]
        return beta, np.broadcast_to(1.0, beta.shape)

    def coarse(self, rows: Indices, *, fine: bool = False) -> Samples:
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
