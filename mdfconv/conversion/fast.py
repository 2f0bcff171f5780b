"""The answer of the fit at the price of a closed form: stored polynomials.

A lobe is described by x, which for a smooth surface is its roughness and stays below 1, and by
its concentration κ, about 1/x² and 0 for a uniform lobe (`MapVariables` of the distributions).
For each pair and metric the product x² κ of the source's x and the fit's κ is a smooth function
of x; where source and target become uniform together, x² κ/(1−x²) is. Both are stored as
polynomials on a few pieces, made from the fit by ``python -m tests.generate_fast``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from mdfconv.conversion.equivalence import Formula, follow, from_root, to_root
from mdfconv.conversion.method import Method
from mdfconv.distributions import Distribution
from mdfconv.distributions.declarations import MapVariables
from mdfconv.distributions.evaluation import Array
from mdfconv.fitting.metrics import Metric, list_metrics, metric_named
from mdfconv.fitting.metrics.base import scaled

DATA = "fast.npz"
# So many values and their intermediates stay in the cache.
_BLOCK = 8192


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
                value[inside] = _horner(piece, z)
        if self.factored:
            value *= (1 - x) * (1 + x)
        return value


def _horner(coefficients: Array, z: Array) -> Array:
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
    with np.load(Path(__file__).parent / "data" / DATA) as file:
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


@dataclass(frozen=True)
class _Stored:
    """A map with the variables of its ends."""

    source: MapVariables
    target: MapVariables
    map: Map


def _stored(source: Distribution, target: Distribution, metric: str) -> _Stored | None:
    """Return the map of a pair under a metric, if there is one.

    A distribution that is another one in another parameter has that one's maps, as a target its
    own if they are stored.
    """
    first, _ = to_root(source, same_lobe=True)
    root, _ = to_root(target, same_lobe=True)
    for last in (target, root):
        stored = load().get(f"{metric} {first.name} {last.name}")
        if stored and first.map_variables and last.map_variables:
            return _Stored(first.map_variables, last.map_variables, stored)
    return None


def _ratio(source: Distribution, target: Distribution, metric: Metric) -> float | None:
    """Return the constant by which the parameters of the lobes themselves convert, or None."""
    roots = [to_root(end, same_lobe=True)[0] for end in (source, target)]
    return metric.ratio(roots[0], roots[1])


class Fast(Method):
    """The least-squares fit from stored polynomials: 1e-6 from it, 1e-4 for a display.

    Covers the usual range of the source (N from 0.1) as far as the fit does and the target
    stays usable, under the metrics for which there are maps.
    """

    name = "fast"
    source = "least squares, mdfconv.fitting, as stored polynomials"
    follows_metric = True
    gaps_as_nan = True

    def keeps(self, metric: Metric) -> str:
        """Return what the metric keeps."""
        return metric.keeps

    def route(self, source: Distribution, target: Distribution) -> tuple[str, ...] | None:
        """Return the one step; None for pairs without maps, such as those of GTR."""
        metrics = map(metric_named, list_metrics())
        covered = any(self.covers(source, target, metric) for metric in metrics)
        return ("stored least squares",) if covered else None

    def covers(self, source: Distribution, target: Distribution, metric: Metric) -> bool:
        """Return whether there is a map (for the display metric at exposure 1) or a constant."""
        stored = _stored(source, target, str(metric)) is not None
        return stored or _ratio(source, target, metric) is not None

    def convert(
        self, parameter: Array, source: Distribution, target: Distribution, metric: Metric
    ) -> Array:
        """Evaluate the polynomials; NaN outside their range."""
        ratio = _ratio(source, target, metric)
        if ratio is not None:
            first = follow(to_root(source, same_lobe=True)[1], parameter)
            last = scaled(first, ratio, to_root(target, same_lobe=True)[0])
            return follow(from_root(target, same_lobe=True), last)
        stored, back = self._for(source, target, metric)
        forward = to_root(source, same_lobe=True)[1]
        values = parameter.ravel()
        answers = np.empty_like(values)
        for start in range(0, values.size, _BLOCK):
            block = slice(start, start + _BLOCK)
            x = stored.source.width(follow(forward, values[block]))
            answers[block] = follow(back, stored.target.from_map(x, stored.map(x)))
        return answers.reshape(parameter.shape)

    def range_text(self, source: Distribution, target: Distribution, metric: Metric) -> str:
        """Return which parameters of the source the stored maps cover."""
        if _ratio(source, target, metric) is not None:
            return ""
        stored, _ = self._for(source, target, metric)
        end = stored.source.from_width(np.asarray(stored.map.edges[-1]))
        end = follow(from_root(source, same_lobe=True), end)
        above = source.parameter.larger_is_smoother
        return f"{source.parameter.symbol} {'≥' if above else '≤'} {float(end):.6g}"

    def _for(
        self, source: Distribution, target: Distribution, metric: Metric
    ) -> tuple[_Stored, Sequence[Formula]]:
        """Return the map of a pair that is covered, and the steps from its target back."""
        stored = _stored(source, target, str(metric))
        assert stored, "a pair that is covered has a map"
        own = stored.target is target.map_variables
        return stored, () if own else from_root(target, same_lobe=True)


METHOD = Fast()
