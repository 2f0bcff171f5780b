"""The conversions at the ends of the ranges against 50 digits, there and back, and the fits."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from decimal import Decimal
from itertools import groupby
from typing import Any

import numpy as np

from mdfconv.benchmark.stability_finding import Finding, Tally, read_rows
from mdfconv.benchmark.stability_textbook import printed_conversion
from mdfconv.conversion import convert, list_methods
from mdfconv.conversion.formulas import FormulaMethod
from mdfconv.conversion.method import Method
from mdfconv.distributions import Distribution, distribution
from mdfconv.distributions.evaluation import Array
from mdfconv.fitting.metrics import metric

# The computation is in float64 throughout: float32 rounds the input and the result.
_DTYPES = (np.float64, np.float32)
# Methods that answer with the best fit.
_BEST_FITS = ("fit", "fast")
_FIT_METRICS = ("unit", "energy")
# Methods of which one direction undoes the other, for every pair.
_INVERTIBLE = ("half-angle", "peak")
_ENCODED = {"mirror-smooth": ("1e-08", "1e-06", "1e-04"), "rough": ("0.25", "0.5", "1")}


@dataclass(frozen=True)
class _Batch:
    """Values at one end of the source's range, float32's, and their exact results in a target."""

    source: str
    target: str
    regime: str
    gamma: float
    values: list[str]
    exact: list[Decimal]

    def given(self, dtype: Any) -> Array:
        return np.array(self.values, dtype=np.float32).astype(dtype)

    @property
    def places(self) -> list[str]:
        return [f"{value} → {self.target}" for value in self.values]


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
    known = {row["method"] for row in formulas}
    for entry in chosen:
        for method in list_methods():
            if method.name in known:
                rows = [row for row in formulas if row["method"] == method.name]
                yield from _formula(method, _formula_batches(rows, entry))
            elif method.name in _BEST_FITS:
                yield from _fits(method, fits, entry)
        yield from _encodings(entry)


def _formula_batches(rows: list[dict[str, str]], entry: Distribution) -> Iterator[_Batch]:
    mine = [row for row in rows if row["source"] == entry.name]
    for regime, group in groupby(mine, lambda row: row["regime"]):
        members = list(group)
        for target in _names(members[0]):
            found = [row for row in members if row[target]]
            if found:
                yield _Batch(
                    entry.name,
                    target,
                    regime,
                    float(found[0]["gamma"]),
                    [row["value"] for row in found],
                    [Decimal(row[target]) for row in found],
                )


def _names(row: dict[str, str]) -> list[str]:
    return [name for name in row if name not in ("method", "source", "regime", "gamma", "value")]


def _formula(method: Method, batches: Iterator[_Batch]) -> Iterator[Finding]:
    there, back = _Tallies(), _Tallies()
    for batch in batches:
        source, target = batch.source, batch.target
        sides = distribution(source), distribution(target)
        comes_back = method.name in _INVERTIBLE or method.is_exact(*sides)
        for dtype in _DTYPES:
            given = batch.given(dtype)
            ours = convert(given, source, target, method.name, gamma=batch.gamma)
            printed = _printed(method, source, target, given, batch.gamma)
            there.of(source, method.name, batch.regime, dtype).add(
                ours, printed, batch.exact, batch.places
            )
            if comes_back:
                if printed is not None:
                    printed = _printed(method, target, source, printed, batch.gamma)
                back.of(source, f"{method.name} and back", batch.regime, dtype).add(
                    convert(ours, target, source, method.name, gamma=batch.gamma),
                    printed,
                    [Decimal(float(value)) for value in given],
                    [f"{place} → {source}" for place in batch.places],
                )
    yield from there.findings()
    yield from back.findings()


def _printed(method: Method, source: str, target: str, given: Array, gamma: float) -> Array | None:
    """Return what the printed formula gives in the type of the value, None if there is none."""
    if isinstance(method, FormulaMethod):
        # It holds the formulas as printed.
        sides = distribution(source), distribution(target)
        with np.errstate(all="ignore"):
            return method.convert(given, *sides, metric("unit")).astype(given.dtype)
    exponent = np.full_like(given, gamma)
    found: Array | None = printed_conversion(method.name, source, target, given, exponent)
    return found


def _fits(method: Method, rows: list[dict[str, str]], entry: Distribution) -> Iterator[Finding]:
    tallies = _Tallies()
    mine = [row for row in rows if row["source"] == entry.name]
    keys = ("target", "regime")
    for (target, regime), group in groupby(mine, lambda row: tuple(row[key] for key in keys)):
        members = list(group)
        if method.route(entry, distribution(target)) is None:
            continue
        values = [row["value"] for row in members]
        for name in _FIT_METRICS:
            exact = [Decimal(row[name]) for row in members]
            batch = _Batch(entry.name, target, regime, 2, values, exact)
            for dtype in _DTYPES:
                given = batch.given(dtype)
                ours = convert(given, entry.name, target, method.name, metric=metric(name))
                tallies.of(entry.name, f"{method.name} {name}", regime, dtype).add(
                    ours, None, exact, batch.places
                )
    yield from tallies.findings()


def _encodings(entry: Distribution) -> Iterator[Finding]:
    tallies = _Tallies()
    for encoding in entry.encodings:
        label = f"{entry.name}:{encoding.name}"
        for regime, values in _ENCODED.items():
            for dtype in _DTYPES:
                given = np.array(values, dtype=dtype)
                tallies.of(entry.name, f"{encoding.name} and back", regime, dtype).add(
                    convert(convert(given, entry.name, label), label, entry.name),
                    None,
                    [Decimal(float(value)) for value in given],
                    [f"{value} → {encoding.name} → α" for value in values],
                )
    yield from tallies.findings()


class _Tallies:
    """The tallies of several groups, in the order in which they were first asked for."""

    def __init__(self) -> None:
        self._found: dict[tuple[str, str, str, str], Tally] = {}

    def of(self, source: str, rule: str, regime: str, dtype: Any) -> Tally:
        kind = np.dtype(dtype)
        key = (source, rule, regime, kind.name)
        return self._found.setdefault(key, Tally(source, rule, regime, kind))

    def findings(self) -> Iterator[Finding]:
        return (tally.finding() for tally in self._found.values())
