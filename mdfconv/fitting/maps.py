"""The best fits as stored polynomials: what `fast` answers, and where `fit` starts.

A lobe is described by x, which for a smooth surface is its roughness and stays below 1, and by
its concentration κ, about 1/x² and 0 for a uniform lobe (`MapVariables` of the distributions).
For each pair and metric the product x² κ of the source's x and the fit's κ is a smooth function
of x; where source and target become uniform together, x² κ/(1−x²) is. Both are stored as
polynomials on a few pieces, made from the fit by ``python -m tests.generate_fast``.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np

from mdfconv.distributions import Distribution, distribution
from mdfconv.distributions.base import MapVariables
from mdfconv.distributions.endpoint import follow, to_root
from mdfconv.distributions.evaluation import Array, Indices, by_blocks
from mdfconv.distributions.table import PolynomialTable, filled
from mdfconv.fitting.metrics import Metric, metric_named
from mdfconv.fitting.problem import ConversionTask

FILE = Path(__file__).parent / "data" / "maps.npz"
# So many values and their intermediates stay in the cache; with fewer, threads would wait for each
# other between the operations.
_BLOCK = 131072
# Degree and cells of the tables of maps, and their tolerance, a fifth of what the method promises.
_TABLE = 2, 1024, 2e-7


@dataclass(frozen=True, eq=False)
class Map:
    """The stored fit of one pair of distributions under one metric.

    Each piece between two `edges` in x, of which the first is 0, has the coefficients of a
    polynomial in z from −1 to 1, constant first. `factored` says whether both lobes become uniform
    at x = 1, so that x² κ/(1−x²) is stored.
    """

    edges: Array
    coefficients: tuple[Array, ...]
    factored: bool

    def __call__(self, x: Array) -> Array:
        """Return x² κ at x, shape (n,); NaN outside the range."""
        value = np.full_like(x, np.nan)
        for (low, high), piece in zip(pairwise(self.edges), self.coefficients, strict=True):
            inside = np.flatnonzero((x > low) & (x <= high))
            if inside.size:
                z = (x[inside] - 0.5 * (low + high)) * (2 / (high - low))
                value[inside] = horner(piece, z)
        if self.factored:
            value *= (1 - x) * (1 + x)
        return value


def horner(coefficients: Array, z: Array) -> Array:
    """Return a polynomial at z, shape (n,); the coefficients begin with the constant."""
    value = np.full_like(z, coefficients[-1])
    for coefficient in coefficients[-2::-1].tolist():
        value *= z
        value += coefficient
    return value


@cache
def load() -> dict[str, Map]:
    """Return the stored maps; their names are metric, source and target between blanks."""
    with np.load(FILE) as file:
        content = {name: file[name] for name in file.files}
    terms = np.split(content["coefficients"], np.cumsum(content["terms"])[:-1])
    pieces = content["pieces"]
    firsts = np.cumsum(pieces) - pieces
    edges = np.split(content["edges"], np.cumsum(pieces + 1)[:-1])
    columns = (content["names"], edges, firsts, pieces, content["factored"])
    return {
        str(name): Map(edge, tuple(terms[first : first + count]), bool(factored))
        for name, edge, first, count, factored in zip(*columns, strict=True)
    }


class StoredFit:
    """The fits of one pair of distributions under one metric: a map, or one constant.

    A distribution that is another one in another parameter has that one's maps, as a target its
    own if they are stored. `pair` and `variables` are those of the map.
    """

    def __init__(self, source: Distribution, target: Distribution, metric: Metric) -> None:
        self._first, self._forward, self._onward = to_root(source, same_lobe=True)
        self._last, _, self._back = to_root(target, same_lobe=True)
        self._symbol, self._above = source.parameter.symbol, source.parameter.larger_is_smoother
        self._ratio = metric.ratio(self._first, self._last)
        self.map: Map | None = None
        for last in (target, self._last) if self._ratio is None else ():
            stored = load().get(f"{metric} {self._first.name} {last.name}")
            if stored and self._first.map_variables and last.map_variables:
                self.map, self.pair = stored, (self._first.name, last.name)
                self.variables = self._first.map_variables, last.map_variables
                self._upper = last.parameter.upper
                if last is target:
                    self._back = ()
                break

    @property
    def exact(self) -> bool:
        """Whether they are a constant multiple, to the last digits."""
        return self._ratio is not None

    @property
    def known(self) -> bool:
        """Whether there are any."""
        return self.map is not None or self._ratio is not None

    def with_map(self, other: Map) -> StoredFit:
        """Return the fits with another map of their pair."""
        fits = copy(self)
        fits.map = other
        return fits

    def __call__(self, parameter: Array) -> Array:
        """Return the target's parameters (any shape); NaN beyond the range of the map."""
        if self._ratio is not None:
            last = follow(self._forward, parameter) * self._ratio
            return follow(self._back, np.minimum(last, self._last.parameter.upper))
        assert self.map is not None, "asked only for what is known"
        source, target = self.variables
        stored, values = self.map, parameter.ravel()
        table = _table(stored, target, self._upper)

        def tabulated(values: Array) -> Array:
            x = source.width(follow(self._forward, values))
            fits = table(x)
            fits *= target.scale(x)
            np.minimum(fits, self._upper, out=fits)
            return follow(self._back, fits)

        def exact(rows: Indices) -> Array:
            x = source.width(follow(self._forward, values[rows]))
            return follow(self._back, target.from_map(x, stored(x)))

        # Together: they are few, and a polynomial of theirs has many steps.
        return filled(by_blocks(tabulated, values, _BLOCK), exact).reshape(parameter.shape)

    def range_text(self) -> str:
        """Return which parameters of the source the maps cover; "" for all."""
        if self.map is None:
            return ""
        end = self.variables[0].from_width(np.asarray(self.map.edges[-1]))
        end = follow(self._onward, end)
        return f"{self._symbol} {'≥' if self._above else '≤'} {float(end):.6g}"


@cache
def _table(stored: Map, target: MapVariables, upper: float) -> PolynomialTable:
    """Return the target's parameter over its scale, as a function of x."""

    def function(x: Array) -> Array:
        parameter = target.from_map(x, stored(x))
        # At the end of the legal range the parameter itself is exact.
        return np.where(parameter < upper, parameter / target.scale(x), np.nan)

    return PolynomialTable(function, *_TABLE, stored.edges[1:])


# Where a polynomial is fitted, where it is checked, and how long it may be.
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
# The polynomial of a piece without fits.
_NO_FIT = np.array([np.nan])


@dataclass(frozen=True)
class Piece:
    """A polynomial in z on a part of the range of x, and its worst error that was seen.

    The error is relative, of the target's parameter; infinite where there is no fit.
    """

    low: float
    high: float
    coefficients: Array
    error: float


@dataclass(frozen=True)
class MapMaker:
    """One map in the making, from fits: a function of parameters that is NaN where there is none.

    A polynomial may leave a relative error of the `tolerance`; a piece that has not come within it
    at the width `narrowest`, in x, is left as it is.
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
        done = piece.error < self.tolerance or piece.coefficients is _NO_FIT
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
        if np.isnan(fitted).any():
            return Piece(low, high, _NO_FIT if np.isnan(fitted).all() else np.zeros(1), np.inf)
        from numpy.polynomial import chebyshev

        series = chebyshev.chebfit(nodes, self.product(x, fitted)[:_NODES], _NODES - 1)
        for terms in range(1, _MOST_TERMS + 1):
            power = chebyshev.cheb2poly(series[:terms])
            product = Map(np.array([low, high]), (power,), self.factored)(x[_NODES:])
            approximate = self.variables[1].from_map(x[_NODES:], product)
            worst = float(np.max(np.abs(approximate / fitted[_NODES:] - 1)))
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

    Its errors are below 1e-4; it takes about a second, and is kept. The metric's `from_stored`
    begins with another one, that has a map of the pair.
    """
    from mdfconv.fitting.solve import follow_stored

    ends = distribution(source), distribution(target)
    stored = StoredFit(*ends, metric_named(metric).from_stored()[0])
    assert stored.map is not None, "asked only for a pair that has a map"

    def fits(parameter: Array) -> Array:
        return follow_stored(ConversionTask(ends[0], parameter, ends[1], metric_named(metric))).fits

    maker = MapMaker(stored.variables, stored.map.factored, fits, _MADE_TOLERANCE, _MADE_NARROWEST)
    # The lobes' own bends stay where they are, what else there is is found.
    edges = np.minimum(stored.map.edges, _MADE_END)
    pieces = [
        piece if piece.error < _MADE_TOLERANCE else replace(piece, coefficients=_NO_FIT)
        for low, high in pairwise(edges.tolist())
        for piece in maker.pieces(low, high)
    ]
    return maker.map(pieces, stored.map.edges[-1])
