"""Conversions of one value to millions: what a call costs, and what a value does."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from mdfconv.distributions import Distribution
from mdfconv.studies.bench.methods import sweep, trials
from mdfconv.timing import Advance, Sizes, Spread, interleave, spread

_FACTOR = 10
# The largest conversions take seconds each.
_ROUNDS = 3


@dataclass(frozen=True)
class ConversionTime:
    """The time of one conversion of an array.

    Parameters
    ----------
    method, metric : str
        As in `MethodSpeed`.
    values : int
        Size of the array.
    seconds : Spread
        Of the whole conversion.
    """

    method: str
    metric: str
    values: int
    seconds: Spread

    def record(self) -> dict[str, Any]:
        """Return a flat row of a table."""
        row = {"method": self.method, "metric": self.metric, "values": self.values}
        return row | self.seconds.columns("seconds")


def conversion_times(
    source: Distribution, target: Distribution, sizes: Sizes, advance: Advance
) -> list[ConversionTime]:
    """Measure every way to convert a pair under the first metric, from one value on.

    Parameters
    ----------
    source, target : Distribution
        The pair.
    sizes : Sizes
        How far: to `largest` values, a slow method to what it does within `patience`.
    advance : callable
        Called with 1 after each of `count_steps` rounds.
    """
    every = trials(source, target)
    left = [trial for trial in every if trial.metric is every[0].metric]
    measured = []
    for count in _counts(sizes):
        parameter = sweep(source, count)
        functions = {trial.method: partial(trial.convert, parameter) for trial in left}
        times = interleave(functions, _ROUNDS, advance)
        measured += [
            ConversionTime(name, str(every[0].metric), count, spread(samples))
            for name, samples in times.items()
        ]
        left = [
            trial for trial in left if _FACTOR * np.median(times[trial.method]) <= sizes.patience
        ]
    return measured


def count_steps(sizes: Sizes) -> int:
    """Return how often `conversion_times` advances."""
    return len(_counts(sizes)) * (_ROUNDS + 1)


def _counts(sizes: Sizes) -> list[int]:
    return [_FACTOR**power for power in range(round(np.log10(sizes.largest)) + 1)]
