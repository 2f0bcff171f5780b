"""The best fits as stored polynomials: what `fast` answers, and where `fit` starts.

A lobe is described by x, which for a smooth surface is its roughness and stays below 1, and by
its concentration κ, about 1/x² and 0 for a uniform lobe (`MapVariables` of the distributions).
For each pair and metric the product x² κ of the source's x and the fit's κ is a smooth function
of x; where source and target become uniform together, x² κ/(1−x²) is. Both are stored as
polynomials on a few pieces, made from the fit by ``python -m tests.generate_fast``.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from mdfconv.distributions import Distribution
from mdfconv.distributions.endpoint import follow, from_root, to_root
from mdfconv.distributions.evaluation import Array
from mdfconv.fitting.metrics import Metric
from mdfconv.fitting.metrics.base import scaled

FILE = Path(__file__).parent / "data" / "maps.npz"
# So many values and their intermediates stay in the cache; fewer would be computed no sooner, and
# threads would wait for each other between them.
_BLOCK = 131072


@dataclass(frozen=True)
class Map:
    """The stored fit of one pair of distributions under one metric.

    Parameters
    ----------
    edges : numpy.ndarray, shape (pieces + 1,)
        Where the pieces begin and end in x; the first edge is 0.
    coefficients : tuple of numpy.ndarray
        For each piece those of a polynomial in z, which runs from −1 to 1, constant first.
    factored : bool
        Whether both lobes become uniform at x = 1, so that x² κ/(1−x²) is stored.
    """

    edges: Array
    coefficients: tuple[Array, ...]
    factored: bool

    def __call__(self, x: Array) -> Array:
        """Return x² κ at x, shape (n,); NaN outside the range."""
        value = np.full_like(x, np.nan)
        for low, high, piece in zip(
            self.edges[:-1], self.edges[1:], self.coefficients, strict=True
        ):
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


def pack(maps: dict[str, Map]) -> dict[str, Array]:
    """Return maps as the arrays of the data file."""
    every = list(maps.values())
    pieces = [piece for stored in every for piece in stored.coefficients]
    return {
        "names": np.array(list(maps)),
        "factored": np.array([stored.factored for stored in every]),
        "pieces": np.array([len(stored.coefficients) for stored in every]),
        "terms": np.array([piece.size for piece in pieces]),
        "edges": np.concatenate([stored.edges for stored in every]),
        "coefficients": np.concatenate(pieces),
    }


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
    """The fits of one pair of distributions under one metric.

    Parameters
    ----------
    source, target : Distribution
        The pair. A distribution that is another one in another parameter has that one's maps,
        as a target its own if they are stored.
    metric : Metric
        What they keep; between two that convert by a constant there is no need of a map.

    Attributes
    ----------
    known : bool
        Whether there are any.
    map : Map or None
        The polynomials, where there are some.
    pair : tuple of str
        Source and target of the map, "" where there is none.
    variables : tuple of MapVariables
        Those of the pair, where there is a map.
    """

    def __init__(self, source: Distribution, target: Distribution, metric: Metric) -> None:
        self._first, self._forward = to_root(source, same_lobe=True)
        self._last, _ = to_root(target, same_lobe=True)
        self._back = from_root(target, same_lobe=True)
        self._onward = from_root(source, same_lobe=True)
        self._symbol, self._above = source.parameter.symbol, source.parameter.larger_is_smoother
        self._ratio = metric.ratio(self._first, self._last)
        self.map: Map | None = None
        self.pair = "", ""
        if self._ratio is None:
            self._find(target, str(metric))

    def _find(self, target: Distribution, metric: str) -> None:
        for last in (target, self._last):
            stored = load().get(f"{metric} {self._first.name} {last.name}")
            if stored and self._first.map_variables and last.map_variables:
                self.map, self.variables = stored, (self._first.map_variables, last.map_variables)
                self.pair = self._first.name, last.name
                if last is target:
                    self._back = ()
                return

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
            first = follow(self._forward, parameter)
            return follow(self._back, scaled(first, self._ratio, self._last))
        assert self.map is not None, "asked only for what is known"
        source, target = self.variables
        values = parameter.ravel()
        answers = np.empty_like(values)
        for start in range(0, values.size, _BLOCK):
            block = slice(start, start + _BLOCK)
            x = source.width(follow(self._forward, values[block]))
            answers[block] = follow(self._back, target.from_map(x, self.map(x)))
        return answers.reshape(parameter.shape)

    def range_text(self) -> str:
        """Return which parameters of the source the maps cover; "" for all."""
        if self.map is None:
            return ""
        end = self.variables[0].from_width(np.asarray(self.map.edges[-1]))
        end = follow(self._onward, end)
        return f"{self._symbol} {'≥' if self._above else '≤'} {float(end):.6g}"
