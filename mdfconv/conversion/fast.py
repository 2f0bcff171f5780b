"""The answer of the fit at the price of a closed form: stored polynomials.

A lobe is described by x, which for a smooth surface is its roughness and stays below 1: the
parameter itself for Beckmann, Gauss, GGX and Schlick, √(2/(N+2)) for Blinn/Phong,
√(8/(3N+9)) for Sawicki. For each pair and metric the product x² k of the fit is a
smooth function of x, where k falls to 0 as the target's lobe becomes uniform; where source and
target become uniform together, x² k/(1−x²) is. Both are stored as polynomials on a few pieces,
made from the fit by ``python -m tests.generate_fast``, with the error that the fit leaves.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from mdfconv.conversion.method import Method
from mdfconv.distributions import Distribution
from mdfconv.distributions.evaluation import Array
from mdfconv.distributions.gtr import GTR
from mdfconv.distributions.smoothie import to_ggx
from mdfconv.fitting.metrics import Display, Metric

DATA = "fast.npz"
# Where the errors are stored, as shares of the largest x of a map: between lobes that become alike
# as they become smooth they fall like a power of x.
ERROR_PLACES = np.union1d(np.geomspace(1e-4, 1, 49), np.linspace(0, 1, 49)[1:])
_BLOCK = 8192
_NO_ERROR = 1e-30


@dataclass(frozen=True)
class Side:
    """A distribution as the maps see it.

    Parameters
    ----------
    lobe : str
        The distribution whose lobes it has in another parameter, or itself.
    reach : callable
        x for a parameter.
    parameter : callable
        The parameter for x and x² k.
    excess : callable
        k for a parameter.
    can_be_uniform : bool
        Whether k = 0 is the uniform lobe and relative precision there matters.
    """

    lobe: str
    reach: Callable[[Array], Array]
    parameter: Callable[[Array, Array], Array]
    excess: Callable[[Array], Array]
    can_be_uniform: bool = False


def _identity(parameter: Array) -> Array:
    return parameter


def _alpha(x: Array, product: Array) -> Array:
    return np.minimum(x / np.sqrt(x * x + product), 1)


def _alpha_excess(alpha: Array) -> Array:
    return (1 - alpha) * (1 + alpha) / (alpha * alpha)


def _exponent(x: Array, product: Array) -> Array:
    return product / (x * x)


_BLINN_PHONG = Side(
    "blinn-phong", lambda n: np.sqrt(2 / (n + 2)), _exponent, _identity, can_be_uniform=True
)
_GGX = Side("ggx", _identity, _alpha, _alpha_excess, can_be_uniform=True)
SIDES = {
    "beckmann": Side(
        "beckmann", _identity, lambda x, product: x / np.sqrt(x * x + product), _alpha_excess
    ),
    "gauss": Side(
        "gauss",
        _identity,
        lambda x, product: x / np.sqrt(product),
        lambda m: 1 / (m * m),
        can_be_uniform=True,
    ),
    "ggx": _GGX,
    "gtr": _GGX,
    "blinn-phong": _BLINN_PHONG,
    "ashikhmin-shirley": _BLINN_PHONG,
    "schlick": Side("schlick", _identity, _alpha, _alpha_excess),
    "sawicki": Side("sawicki", lambda n: np.sqrt(8 / (3 * n + 9)), _exponent, _identity),
    "smoothie": Side(
        "ggx",
        to_ggx,
        lambda x, product: 2 * x / np.sqrt(product),
        lambda alpha: 4 / (alpha * alpha),
        can_be_uniform=True,
    ),
}


def uniform_together(source: str, target: str) -> bool:
    """Return whether both lobes become uniform at x = 1, so that x² k/(1−x²) is stored."""
    return source in ("ggx", "schlick") and SIDES[target].can_be_uniform


@dataclass(frozen=True)
class Map:
    """The stored fit of one pair of distributions under one metric.

    Parameters
    ----------
    edges : numpy.ndarray, shape (pieces + 1,)
        Where the pieces begin and end in x; the first edge is 0.
    coefficients : tuple of numpy.ndarray
        For each piece those of a polynomial in z, which runs from −1 to 1, constant first.
    errors : numpy.ndarray, shape (2, n)
        RMSE and maximum error of the conversion at ERROR_PLACES.
    """

    edges: Array
    coefficients: tuple[Array, ...]
    errors: Array

    def __call__(self, x: Array) -> Array:
        """Return the stored function at x, shape (n,); NaN outside the range."""
        value = np.full_like(x, np.nan)
        for low, high, piece in zip(
            self.edges[:-1], self.edges[1:], self.coefficients, strict=True
        ):
            inside = np.flatnonzero((x > low) & (x <= high))
            if inside.size:
                z = (x[inside] - 0.5 * (low + high)) * (2 / (high - low))
                value[inside] = _horner(piece, z)
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
    pieces = [piece for entry in every for piece in entry.coefficients]
    return {
        "names": np.array(list(maps)),
        "pieces": np.array([len(entry.coefficients) for entry in every]),
        "terms": np.array([piece.size for piece in pieces]),
        "edges": np.concatenate([entry.edges for entry in every]),
        "coefficients": np.concatenate(pieces),
        "errors": np.stack([entry.errors for entry in every]).astype(np.float32),
    }


@cache
def load() -> dict[str, Map]:
    """Return the stored maps; their names are metric, source and target between blanks."""
    with np.load(Path(__file__).parent / "data" / DATA) as stored:
        content = {name: stored[name] for name in stored.files}
    terms = np.split(content["coefficients"], np.cumsum(content["terms"])[:-1])
    pieces = content["pieces"]
    firsts = np.cumsum(pieces) - pieces
    edges = np.split(content["edges"], np.cumsum(pieces + 1)[:-1])
    return {
        str(name): Map(edge, tuple(terms[first : first + count]), errors)
        for name, edge, first, count, errors in zip(
            content["names"], edges, firsts, pieces, content["errors"], strict=True
        )
    }


class Fast(Method):
    """The least-squares fit from stored polynomials: 1e-6 from it, 1e-4 for a display.

    Covers the usual range of the source (N from 0.1) as far as the fit does and the target
    stays usable. The display metric is stored for exposure 1.
    """

    name = "fast"
    source = "least squares, mdfconv.fitting, as stored polynomials"
    follows_metric = True
    gaps_as_nan = True

    def keeps(self, metric: Metric) -> str:
        """Return what the metric keeps."""
        return metric.keeps

    def covers_metric(self, metric: Metric) -> bool:
        """Return whether there are maps: for the display metric at exposure 1 only."""
        return not isinstance(metric, Display) or metric.exposure == 1

    def route(self, source: Distribution, target: Distribution) -> tuple[str, ...] | None:
        """Return the one step; None for distributions without maps, such as GTR."""
        if _side(source) and _side(target):
            return () if self.is_exact(source, target) else ("stored least squares",)
        return None

    def is_exact(self, source: Distribution, target: Distribution) -> bool:
        """Return whether both are one form in two parameters, such as smoothie and ggx."""
        first, last = _side(source), _side(target)
        return first is not None and last is not None and first.lobe == last.lobe

    def convert(
        self, parameter: Array, source: Distribution, target: Distribution, metric: Metric
    ) -> Array:
        """Evaluate the polynomials; NaN outside their range."""
        if self.is_exact(source, target):
            if "smoothie" not in (source.name, target.name):
                return parameter.copy()
            result: Array = target.from_peak_alpha(source.peak_alpha(parameter))
            return result
        found = _map(source, target, metric)
        first, last = SIDES[source.name], SIDES[target.name]
        factored = uniform_together(first.lobe, target.name)
        given = parameter.ravel()
        answers = np.empty_like(given)
        # Block by block the intermediates stay in the cache.
        for start in range(0, given.size, _BLOCK):
            block = slice(start, start + _BLOCK)
            x = first.reach(given[block])
            product = found(x)
            if factored:
                product *= (1 - x) * (1 + x)
            answers[block] = last.parameter(x, product)
        return answers.reshape(parameter.shape)

    def residual(
        self,
        parameter: Array,
        source: Distribution,
        result: Array,
        target: Distribution,
        metric: Metric,
    ) -> tuple[Array, Array]:
        """Return RMSE and maximum error as stored with the polynomials."""
        if self.is_exact(source, target) or self.route(source, target) is None:
            return super().residual(parameter, source, result, target, metric)
        found = _map(source, target, metric)
        share = np.log(SIDES[source.name].reach(parameter) / found.edges[-1])
        rmse, maximum = (
            np.exp(np.interp(share, np.log(ERROR_PLACES), np.log(np.maximum(errors, _NO_ERROR))))
            for errors in found.errors
        )
        return rmse, maximum

    def range_text(self, source: Distribution, target: Distribution, metric: Metric) -> str:
        """Return which parameters of the source the stored maps cover."""
        x = _map(source, target, metric).edges[-1]
        end = x if source.name == "gauss" else source.from_peak_alpha(x)
        rises = source.parameter.name.startswith("exponent")
        return f"{source.parameter.symbol} {'≥' if rises else '≤'} {float(end):.6g}"


def _side(distribution: Distribution) -> Side | None:
    if isinstance(distribution, GTR) and distribution.gamma != 2:
        return None
    return SIDES.get(distribution.name)


def _map(source: Distribution, target: Distribution, metric: Metric) -> Map:
    last = SIDES[target.name]
    name = target.name if target.name == "smoothie" else last.lobe
    return load()[f"{metric.name} {SIDES[source.name].lobe} {name}"]


METHOD = Fast()
