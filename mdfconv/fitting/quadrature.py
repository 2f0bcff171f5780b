"""Angles and weights that resolve a lobe of any width and its tail to π/2."""

from __future__ import annotations

from typing import NamedTuple, Protocol, TypeAlias

import numpy as np

from mdfconv.distributions.angles import Angles
from mdfconv.distributions.elementary import exp_of_product
from mdfconv.distributions.evaluation import Array, Indices, gauss_legendre, gauss_panels

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
# the horizon. The trapezoidal rule needs so many nodes, panels so many of the order above, and with
# more at kinks fewer.
_SPREAD, _RANGE = 1.5, (-3.2, 3.2)
_SMOOTH_NODES, _SMOOTH_PANELS = 76, np.linspace(*_RANGE, 9)
_LARGEST = _SPREAD * np.sinh(_RANGE[1])
_PANELS_WITH_KINKS = np.linspace(-2.6, 3.2, 7)


def _towards_edge(shrink: float, panels: int) -> Array:
    """Return where panels that shrink towards an edge begin and end, as shares of its angle."""
    return 1 - np.append((1 / shrink) ** np.arange(1, panels), 0)


# Where a distribution leaves 0, an encoding for a screen bends: these panels resolve it to 1e-6 of
# the lobe, with the nodes of a smooth quadrature the fewer ones do.
_TO_EDGE, _TO_SMOOTH_EDGE = _towards_edge(4, 10), _towards_edge(16, 5)


# Angles and weights, shape (n, k).
Samples: TypeAlias = tuple[Angles, Array]


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

    `half_width`, shape (n,), is β_half of the narrowest lobe of each problem. Where a distribution
    becomes 0, the integrand is a function of the `root` of the distance from there.
    """

    def __init__(self, half_width: Array, *, root: float = 1.0) -> None:
        self._root = root
        start = _NARROWEST * half_width[:, None]
        growth = np.linspace(0, 1, _LOBE_PANELS + 1)
        lobe = start * (0.5 * np.pi / start) ** growth
        rows = half_width.size
        horizon = np.broadcast_to(_TOWARDS_HORIZON, (rows, _TOWARDS_HORIZON.size))
        self._panels = _sorted_panels(np.zeros((rows, 1)), lobe, horizon)

    def nodes(self, rows: Indices, breaks: Breaks = NO_BREAKS) -> Samples:
        """Return angles and weights, as in the protocol."""
        parts: list[Array] = [self._panels[rows]]
        if breaks.kinks is not None:
            parts.append(breaks.kinks)
        if breaks.edges is not None:
            parts.append(_products(breaks.edges, _TO_EDGE))
        beta, weight = _panels_to_edges(_sorted_panels(*parts), breaks.edges, self._root)
        return Angles(beta), weight

    def coarse(self, rows: Indices, *, fine: bool = False) -> Samples:
        """Return the panels at a low order."""
        beta, weight = gauss_panels(self._panels[rows], _ORDER if fine else _SCAN_ORDER)
        return Angles(beta), weight


class SmoothQuadrature:
    """A few nodes in a variable in which integrands over a lobe are smooth.

    ln tan β = ln tan β_half + 1.5 sinh s: tan β makes lobes similar, its logarithm makes them
    analytic, and sinh turns their decay like a power, at the normal, in the tail and at the
    horizon, into one like an exponential's exponential (Takahasi & Mori 1974). The trapezoidal
    rule then converges geometrically, and between kinks Gauss-Legendre panels do.

    The arguments are those of `LobeQuadrature`.
    """

    def __init__(self, half_width: Array, *, root: float = 1.0) -> None:
        self._log_tangent = np.log(np.tan(half_width))[:, None]
        self._root = root

    def nodes(self, rows: Indices, breaks: Breaks = NO_BREAKS) -> Samples:
        """Return angles and weights, as in the protocol."""
        middle = self._log_tangent[rows]
        few = breaks.kinks is not None and breaks.edges is None
        panels = _PANELS_WITH_KINKS if few else _SMOOTH_PANELS
        parts: list[Array] = [np.broadcast_to(panels, (rows.size, panels.size))]
        edges = None
        if breaks.kinks is not None:
            parts.append(self._variable(breaks.kinks, middle, panels))
        if breaks.edges is not None:
            edges = self._variable(breaks.edges, middle, panels)
            smooth = breaks.kinks is None and self._root == 1
            shares = _TO_SMOOTH_EDGE if self._root == 1 else _TO_EDGE
            graded = breaks.edges if smooth else _products(breaks.edges, shares)
            parts.append(self._variable(graded, middle, panels))
        if len(parts) > 1:
            s, weight = _panels_to_edges(_sorted_panels(*parts), edges, self._root)
        else:
            s = np.linspace(*_RANGE, _SMOOTH_NODES)[None, :]
            weight = np.broadcast_to(s[0, 1] - s[0, 0], s.shape)
        rise = _exponential(s, _RANGE[1])
        fall = 1 / rise
        tangent = _exponential((0.5 * _SPREAD) * (rise - fall), _LARGEST)
        angles = Angles(tangent=np.exp(middle) * tangent)
        rise += fall
        rise *= (0.5 * _SPREAD) * weight
        slope = 1 + angles.tangent_square
        np.divide(angles.tangent, slope, out=slope)
        slope *= rise
        return angles, slope

    def coarse(self, rows: Indices, *, fine: bool = False) -> Samples:
        """Return all: there are few."""
        return self.nodes(rows)

    def _variable(self, beta: Array, middle: Array, panels: Array) -> Array:
        """Return s of angles, within the range of panels; its lower end for 0."""
        tangent = np.maximum(np.tan(beta), np.exp(middle + _SPREAD * np.sinh(panels[0])))
        return np.clip(np.arcsinh((np.log(tangent) - middle) / _SPREAD), panels[0], panels[-1])


def _exponential(values: Array, largest: float) -> Array:
    """Return the exponential of values up to a largest one."""
    values = values - largest
    values = exp_of_product(values, 1.0, out=values)
    values *= np.exp(largest)
    return values


def _sorted_panels(*ends: Array) -> Array:
    """Return where the panels of each row begin and end, from their ends in any order."""
    return np.sort(np.concatenate(ends, axis=1), axis=1)


def _panels_to_edges(ends: Array, edges: Array | None, root: float) -> tuple[Array, Array]:
    """Return nodes and weights on panels, of which some end at an edge.

    There the node at the distance v^root, of a panel's width, takes the place of that at v: what
    is a root of the distance is smooth in v.
    """
    nodes, weight = gauss_panels(ends, _ORDER)
    if edges is None or root == 1:
        return nodes, weight
    at_edge = (ends[:, 1:, None] == edges[:, None, :]).any(axis=2)
    width = np.diff(ends)[at_edge][:, None]
    x, w = gauss_legendre(_ORDER)
    v = 0.5 * (1 - x)
    by_panel = (*at_edge.shape, _ORDER)
    nodes.reshape(by_panel)[at_edge] = ends[:, 1:][at_edge][:, None] - width * v**root
    weight.reshape(by_panel)[at_edge] = width * (0.5 * root * w * v ** (root - 1))
    return nodes, weight


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
        return Angles(beta), np.broadcast_to(1.0, beta.shape)

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
        return Angles(beta), weight
