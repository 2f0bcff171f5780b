"""Making the polynomials of a map from fits."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise

import numpy as np
from numpy.polynomial import chebyshev

from mdfconv.distributions import distribution
from mdfconv.distributions.base import MapVariables
from mdfconv.distributions.evaluation import Array
from mdfconv.fitting.maps import Map, StoredFit
from mdfconv.fitting.metrics import metric_named
from mdfconv.fitting.solve import warm_fit

_NODES, _CHECKS, _MOST_TERMS = 32, 37, 25
# A bend is looked for where so many halvings have not helped: where second differences of a few
# points stand out, again and again.
_BEND_DEPTHS, _BEND_STEPS, _BEND_POINTS, _STANDS_OUT = (2, 5), 20, 9, 8.0
# A fifth of what is promised for maps that are made when they are asked for; x where they end.
# What is not smooth at a scale of 1/50 has no map: lobes that are clipped as a whole have not even
# one fit.
_MADE_TOLERANCE, _MADE_END, _MADE_NARROWEST = 2e-5, 1 - 1e-9, 0.02
# At 0 there is no surface.
_LEAST_X = 1e-9


@dataclass(frozen=True)
class Piece:
    """A polynomial on a part of the range of a map.

    Parameters
    ----------
    low, high : float
        Where it holds, in x.
    coefficients : numpy.ndarray
        In z, which runs from −1 to 1, constant first.
    error : float
        The worst relative error of the target's parameter that was seen; infinite where there is
        no fit.
    """

    low: float
    high: float
    coefficients: Array
    error: float


@dataclass(frozen=True)
class MapMaker:
    """One map in the making.

    Parameters
    ----------
    variables : tuple of MapVariables
        Those of source and target.
    factored : bool
        As of `Map`.
    fits : callable
        From parameters of the source, shape (n,), to those of the target, NaN where there is none.
    tolerance : float
        The relative error of the target's parameter that a polynomial may leave.
    narrowest : float
        In x: what has not come within the tolerance at this width is left as it is.
    """

    variables: tuple[MapVariables, MapVariables]
    factored: bool
    fits: Callable[[Array], Array]
    tolerance: float
    narrowest: float

    def fitted(self, x: Array) -> Array:
        """Return the target's parameters at x, shape (n,)."""
        return self.fits(self.variables[0].from_width(x))

    def product(self, x: Array, fitted: Array) -> Array:
        """Return what a map stores for parameters of the target."""
        product = x * x * self.variables[1].concentration(fitted)
        return product / ((1 - x) * (1 + x)) if self.factored else product

    def pieces(self, low: float, high: float, depth: int = 0) -> Iterator[Piece]:
        """Yield polynomials between two x, each within the tolerance or very narrow."""
        piece = self._piece(low, high)
        done = piece.error < self.tolerance or np.isnan(piece.coefficients).all()
        if done or high - low < self.narrowest:
            yield piece
            return
        bend = self._bend(low, high) if depth in _BEND_DEPTHS else None
        middle = 0.5 * (low + high) if bend is None else bend
        yield from self.pieces(low, middle, depth + 1)
        yield from self.pieces(middle, high, depth + 1)

    def map(self, pieces: Sequence[Piece], end: float) -> Map:
        """Return pieces that follow each other as a map whose last one holds until an x."""
        edges = np.array([piece.low for piece in pieces] + [end])
        return Map(edges, tuple(piece.coefficients for piece in pieces), self.factored)

    def _piece(self, low: float, high: float) -> Piece:
        """Return the shortest polynomial within the tolerance, or the longest; NaN without fits."""
        middle, half = 0.5 * (low + high), 0.5 * (high - low)
        nodes = np.cos(np.pi * (np.arange(_NODES) + 0.5) / _NODES)
        # The upper end, where a target may run out, is the hardest place; the lower may be 0.
        checks = np.linspace(-1, 1, _CHECKS + 1)[1:]
        # Rounding must not lead beyond the piece.
        x = np.minimum(middle + half * np.append(nodes, checks), high)
        fitted = self.fitted(x)
        stored, wanted, checked = self.product(x, fitted)[:_NODES], fitted[_NODES:], x[_NODES:]
        if np.isnan(fitted).any():
            none = np.nan if np.isnan(fitted).all() else 0.0
            return Piece(low, high, np.array([none]), np.inf)
        series = chebyshev.chebfit(nodes, stored, _NODES - 1)
        for terms in range(1, _MOST_TERMS + 1):
            power = chebyshev.cheb2poly(series[:terms])
            product = Map(np.array([low, high]), (power,), self.factored)(checked)
            got = self.variables[1].from_map(checked, product)
            worst = float(np.max(np.abs(got / wanted - 1)))
            if worst < self.tolerance:
                break
        return Piece(low, high, power, worst)

    def _bend(self, low: float, high: float) -> float | None:
        """Return where the fit jumps or bends in a piece, None if it is smooth."""
        start = low, high = max(low, _LEAST_X), high
        for _ in range(_BEND_STEPS):
            x = np.linspace(low, high, _BEND_POINTS)
            second = np.abs(np.diff(self.product(x, self.fitted(x)), 2))
            peak = int(np.argmax(second))
            if not second[peak] >= _STANDS_OUT * np.median(second):
                return None
            low, high = float(x[peak]), float(x[peak + 2])
        return None if low == start[0] or high == start[1] else 0.5 * (low + high)


@cache
def made_map(source: str, target: str, metric: str) -> Map:
    """Return the map of a pair under a metric, made from that of the one it is followed from.

    Its errors are below 1e-4; it takes about a second, and is kept.

    Parameters
    ----------
    source, target : str
        The pair of a `StoredFit`.
    metric : str
        A metric whose `from_stored` begins with another one that has a map of the pair.
    """
    ends, kept = (distribution(source), distribution(target)), metric_named(metric)
    stored = StoredFit(*ends, kept.from_stored()[0])
    assert stored.map is not None, "asked only for a pair that has a map"

    def fits(parameter: Array) -> Array:
        return warm_fit(ends[0], parameter, ends[1], kept).parameter

    maker = MapMaker(stored.variables, stored.map.factored, fits, _MADE_TOLERANCE, _MADE_NARROWEST)
    # The lobes' own bends stay where they are, what else there is is found.
    edges = np.minimum(stored.map.edges, _MADE_END)
    pieces = [
        piece if piece.error < _MADE_TOLERANCE else replace(piece, coefficients=np.array([np.nan]))
        for low, high in pairwise(edges.tolist())
        for piece in maker.pieces(low, high)
    ]
    return maker.map(pieces, stored.map.edges[-1])
