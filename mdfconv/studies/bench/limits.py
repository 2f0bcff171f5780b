"""How far the conversions are from the evaluations that they cannot avoid."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mdfconv.conversion import method_named
from mdfconv.distributions import Distribution
from mdfconv.fitting.maps import StoredFit, horner
from mdfconv.fitting.metrics import Metric, metric_named
from mdfconv.fitting.problem import narrowest
from mdfconv.fitting.quadrature import SmoothQuadrature
from mdfconv.studies.bench.methods import COLD, LOOP, MethodSpeed, answers, sweep
from mdfconv.timing import Advance, Sizes, Spread, interleave, spread

# So many values stay in the cache from one operation to the next.
_BLOCK = 16384


@dataclass(frozen=True)
class Limit:
    """What a conversion costs beside what it cannot avoid; nanoseconds a value.

    Parameters
    ----------
    method, metric : str
        As in `MethodSpeed`.
    work : str
        What cannot be avoided, in words.
    conversion, unavoidable : Spread
        The time of the conversion, and that of the work alone.
    """

    method: str
    metric: str
    work: str
    conversion: Spread
    unavoidable: Spread

    @property
    def ratio(self) -> float:
        """How many times as long as the work the conversion takes."""
        return self.conversion.median / self.unavoidable.median

    def record(self) -> dict[str, Any]:
        """Return a flat row of a table."""
        row: dict[str, Any] = {"method": self.method, "metric": self.metric, "work": self.work}
        row |= self.conversion.columns("conversion_ns")
        return row | self.unavoidable.columns("unavoidable_ns") | {"ratio": self.ratio}


@dataclass(frozen=True)
class _Work:
    """Evaluations for an array of values."""

    words: str
    values: int
    run: Callable[[], object]


def limits(
    source: Distribution,
    target: Distribution,
    speeds: Sequence[MethodSpeed],
    sizes: Sizes,
    advance: Advance,
) -> list[Limit]:
    """Measure the work that measured conversions cannot avoid.

    Parameters
    ----------
    source, target : Distribution
        The pair.
    speeds : sequence of MethodSpeed
        Its conversions.
    sizes : Sizes
        How much is measured.
    advance : callable
        Called with 1 after each of `sizes`.rounds + 1 rounds.
    """
    works = [_work(source, target, row, sizes) for row in speeds]
    functions = {str(number): work.run for number, work in enumerate(works)}
    times = interleave(functions, sizes.rounds, advance)
    return [
        Limit(
            row.method,
            row.metric,
            work.words,
            row.nanoseconds,
            spread(1e9 * samples / work.values),
        )
        for row, work, samples in zip(speeds, works, times.values(), strict=True)
    ]


def _work(source: Distribution, target: Distribution, row: MethodSpeed, sizes: Sizes) -> _Work:
    metric = metric_named(row.metric)
    if row.method in ("fit", COLD, LOOP):
        return _of_fit(source, target, metric, sizes)
    parameter = sweep(source, _BLOCK)
    if row.method != "fast":
        return _Work("a square root", _BLOCK, lambda: np.sqrt(parameter))
    stored = StoredFit(source, target, metric)
    if stored.exact:
        return _Work("a multiplication", _BLOCK, lambda: parameter * 0.5)
    return _of_map(stored)


def _of_fit(source: Distribution, target: Distribution, metric: Metric, sizes: Sizes) -> _Work:
    """Return one evaluation of the source and two of the target at the nodes of a fit."""
    parameter = sweep(source, sizes.fits)
    best = answers(method_named("fit"), parameter, source, target, metric)
    width = narrowest(source, parameter, target, best)
    beta, _ = SmoothQuadrature(width).nodes(np.arange(width.size))
    ours, theirs = parameter[:, None], best[:, None]
    peak = source.maximum(ours, normalized=metric.normalized)

    def run() -> None:
        with np.errstate(all="ignore"):
            metric.signal(source, beta, ours, peak)
            for _ in range(2):
                metric.signal_and_slope(target, beta, theirs, peak)

    words = f"{beta.shape[1]} angles: source, 2 × target with slope"
    return _Work(words, parameter.size, run)


def _of_map(stored: StoredFit) -> _Work:
    """Return the longest polynomial of a map and the two changes of variable."""
    assert stored.map, "what converts by no constant has a map"
    first, last = stored.variables
    polynomial = max(stored.map.coefficients, key=len)
    x = np.linspace(0.1, 0.5, _BLOCK)
    parameter = first.from_width(x)

    def run() -> None:
        last.from_map(first.width(parameter), horner(polynomial, x))

    return _Work(f"a polynomial of {len(polynomial)} terms, two changes of variable", x.size, run)
