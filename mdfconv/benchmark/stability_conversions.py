"""The conversions at the ends of the ranges against 50 digits, there and back, and the fits."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from decimal import Decimal
from itertools import groupby
from typing import Any

import numpy as np

from mdfconv.benchmark.stability_finding import Finding, Tallies, read_rows
from mdfconv.conversion import convert, list_methods
from mdfconv.conversion.endpoint import Endpoint
from mdfconv.conversion.formulas import FormulaMethod
from mdfconv.conversion.method import Method
from mdfconv.distributions import Distribution, distribution
from mdfconv.distributions.equivalence import exact_route
from mdfconv.distributions.evaluation import Array
from mdfconv.errors import MdfconvWarning
from mdfconv.fitting.metrics import metric_named

# The computation is in float64 throughout: float32 rounds the input and the result.
_DTYPES = (np.float64, np.float32)
# What the stored fits keep.
_FIT_METRICS = ("unit", "energy")
# Methods of which one direction undoes the other, for every pair, with the printed expressions
# that they go through.
_INVERTIBLE = {"half-angle": ("cosine", "from_cosine"), "peak": ("peak_alpha", "from_peak_alpha")}
_ENCODED = {"mirror-smooth": ("1e-08", "1e-06", "1e-04"), "rough": ("0.25", "0.5", "1")}
_ENCODED_EXPONENTS = {"mirror-smooth": ("1000", "10000", "60000"), "rough": ("4", "10", "100")}

# Columns of conversions.csv that are not a target's.
_KEYS = ("method", "source", "regime", "gamma", "value")

_Rows = list[dict[str, str]]


@dataclass(frozen=True)
class _Batch:
    """Values at one end of the source's range, float32's, and their exact results in a target."""

    source: Distribution
    target: Distribution
    regime: str
    values: list[str]
    exact: list[Decimal]

    def of_type(self, dtype: Any) -> Array:
        return np.array(self.values, dtype=np.float32).astype(dtype)

    @property
    def cases(self) -> list[str]:
        return [f"{value} → {self.target.name}" for value in self.values]


def audit_conversions(chosen: Sequence[Distribution]) -> Iterator[Finding]:
    """Yield the findings of all conversions from the chosen distributions.

    Parameters
    ----------
    chosen : sequence of Distribution
        The sources.

    Yields
    ------
    Finding
        One for each source, method, end of the range and type. A round trip is compared with
        where it started: where a conversion is nearly constant, no stored result leads back.
    """
    formulas, fits = read_rows("conversions.csv"), read_rows("fits.csv")
    for source in chosen:
        fitted = [row for row in fits if row["source"] == source.name]
        for method in list_methods():
            rows = [
                row
                for row in formulas
                if (row["method"], row["source"]) == (method.name, source.name)
            ]
            yield from _formula(method, _formula_batches(source, rows))
            if method.follows_metric:
                yield from _fits(method, source, fitted)
        yield from _encodings(source)


def _formula_batches(source: Distribution, rows: _Rows) -> Iterator[_Batch]:
    for (regime, gamma), group in groupby(rows, lambda row: (row["regime"], row["gamma"])):
        members = list(group)
        for name in [column for column in members[0] if column not in _KEYS]:
            answered = [row for row in members if row[name]]
            if answered:
                yield _Batch(
                    _with_gamma(source, gamma),
                    _with_gamma(distribution(name), gamma),
                    regime,
                    [row["value"] for row in answered],
                    [Decimal(row[name]) for row in answered],
                )


def _with_gamma(end: Distribution, gamma: str) -> Distribution:
    return end.with_gamma(float(gamma)) if end.second_parameter else end


def _converted(values: Array, source: Distribution, target: Distribution, method: Method) -> Any:
    """Convert hard cases, of which nobody is to be warned."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", MdfconvWarning)
        return convert(values, Endpoint(source), Endpoint(target), method.name)


def _formula(method: Method, batches: Iterator[_Batch]) -> Iterator[Finding]:
    forward, back = Tallies(), Tallies()
    for batch in batches:
        source, target = batch.source, batch.target
        comes_back = method.name in _INVERTIBLE or exact_route(source, target) is not None
        for dtype in _DTYPES:
            values = batch.of_type(dtype)
            ours = _converted(values, source, target, method)
            printed = printed_conversion(method, source, target, values)
            group = batch.regime, dtype
            forward.of(source.name, method.name, *group).add(
                ours, printed, batch.exact, batch.cases
            )
            if comes_back:
                if printed is not None:
                    printed = printed_conversion(method, target, source, printed)
                back.of(source.name, f"{method.name} and back", *group).add(
                    _converted(ours, target, source, method),
                    printed,
                    [Decimal(float(value)) for value in values],
                    [f"{case} → {source.name}" for case in batch.cases],
                )
    yield from forward.findings()
    yield from back.findings()


def printed_conversion(
    method: Method, source: Distribution, target: Distribution, values: Array
) -> Array | None:
    """Return what the printed formulas give in the type of the values; None if none is printed.

    Parameters
    ----------
    method : Method
        The method.
    source, target : Distribution
        The pair, with their γ.
    values : numpy.ndarray
        Parameters of the source.
    """
    with np.errstate(all="ignore"):
        if isinstance(method, FormulaMethod):
            # It holds the formulas as printed.
            result = method.convert(values, source, target, metric_named("unit"))
        else:
            first, last = (
                getattr(end.printed, name)
                for end, name in zip((source, target), _INVERTIBLE[method.name], strict=True)
            )
            if first is None or last is None:
                return None
            result = last(first(values, *_gammas(source, values)), *_gammas(target, values))
    return np.asarray(result).astype(values.dtype)


def _gammas(end: Distribution, values: Array) -> list[Array]:
    return [np.full_like(values, end.gamma)] if end.second_parameter else []


def _fits(method: Method, source: Distribution, rows: _Rows) -> Iterator[Finding]:
    tallies = Tallies()
    for (name, regime), group in groupby(rows, lambda row: (row["target"], row["regime"])):
        members = list(group)
        target = distribution(name)
        for metric in map(metric_named, _FIT_METRICS):
            if not method.covers(source, target, metric):
                continue
            exact = [Decimal(row[metric.name]) for row in members]
            batch = _Batch(source, target, regime, [row["value"] for row in members], exact)
            for dtype in _DTYPES:
                ours = convert(batch.of_type(dtype), source.name, name, method.name, metric=metric)
                tallies.of(source.name, f"{method.name} {metric.name}", regime, dtype).add(
                    ours, None, exact, batch.cases
                )
    yield from tallies.findings()


def _encodings(source: Distribution) -> Iterator[Finding]:
    tallies = Tallies()
    for encoding in source.encodings:
        label = f"{source.name}:{encoding.name}"
        smooth = source.parameter.larger_is_smoother
        for regime, texts in (_ENCODED_EXPONENTS if smooth else _ENCODED).items():
            for dtype in _DTYPES:
                values = np.array(texts, dtype=dtype)
                tallies.of(source.name, f"{encoding.name} and back", regime, dtype).add(
                    convert(convert(values, source.name, label), label, source.name),
                    None,
                    [Decimal(float(value)) for value in values],
                    [f"{text} → {encoding.name} → {source.parameter.symbol}" for text in texts],
                )
    yield from tallies.findings()
