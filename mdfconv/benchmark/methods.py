"""Conversion methods: how many values a second, and how far from the best fit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from mdfconv.benchmark.loop import curve_fit_loop
from mdfconv.benchmark.timing import Advance, Sizes, Spread, clock, interleave, spread
from mdfconv.conversion import list_methods, method_named
from mdfconv.conversion.method import Method
from mdfconv.conversion.remaining_error import remaining_error
from mdfconv.distributions import Distribution, distribution
from mdfconv.distributions.evaluation import Array
from mdfconv.errors import MdfconvError
from mdfconv.fitting.metrics import Metric, list_metrics, metric_named
from mdfconv.paper.table2 import paper_sweep

LOOP = "curve_fit"
# The paper's sweep, and every range of widths here, is one of this distribution's m_B.
_PAPER_SOURCE = "beckmann"
# Seconds for the many values of `Sizes.conversions`, judged by a few of them, of which each costs
# several times as much.
_PATIENCE = 3.0

_Convert: TypeAlias = Callable[[Array], Array]


@dataclass(frozen=True)
class MethodSpeed:
    """One method on a sweep of one pair.

    Parameters
    ----------
    source, target : str
        Names of the distributions.
    method : str
        Name of the method, or ``"curve_fit"`` for a loop of scipy.optimize.curve_fit.
    metric : str
        Under which its errors are taken: what it keeps, or unit if it has no choice.
    values : int
        Size of the array that was converted at a time.
    per_second : Spread
        Values converted a second.
    parameter_error, parameter_error_max : float
        Median and maximum over the sweep of |p/p_fit − 1|, p_fit the result of ``"fit"``.
    rmse, rmse_max : float
        Median and maximum over the sweep of the error that the conversion leaves under the
        metric: the relative root mean square of `remaining_error`.
    answered : float
        Share of the sweep for which there is a result in the legal range.
    """

    source: str
    target: str
    method: str
    metric: str
    values: int
    per_second: Spread
    parameter_error: float
    parameter_error_max: float
    rmse: float
    rmse_max: float
    answered: float

    def record(self) -> dict[str, Any]:
        """Return a flat row of a table."""
        row: dict[str, Any] = {"from": self.source, "to": self.target}
        for name, value in list(vars(self).items())[2:]:
            row |= value.columns(name) if isinstance(value, Spread) else {name: value}
        return row


def covering(source: Distribution, target: Distribution, metric: Metric) -> list[Method]:
    """Return the methods that answer for a pair under a metric."""
    return [method for method in list_methods() if method.covers(source, target, metric)]


def answers(
    method: Method, parameter: Array, source: Distribution, target: Distribution, metric: Metric
) -> Array:
    """Return what a method answers, NaN outside the target's legal range.

    Parameters
    ----------
    method : Method
        A method that covers the pair.
    parameter : numpy.ndarray, shape (n,)
        Legal parameters of the source.
    source, target : Distribution
        The pair.
    metric : Metric
        For methods that have a choice.
    """
    with np.errstate(all="ignore"):
        result = np.asarray(method.convert(parameter, source, target, metric))
        return np.where(target.parameter.accepts(result), result, np.nan)


def as_wide(m_b: ArrayLike, source: Distribution) -> Array:
    """Return the parameters of lobes as wide at half height as Beckmann's at m_B.

    Parameters
    ----------
    m_b : array_like, shape (n,)
        Beckmann's parameters.
    source : Distribution
        The distribution.

    Returns
    -------
    numpy.ndarray, shape (n,)
        NaN where the distribution has no such lobe.
    """
    tangents = distribution(_PAPER_SOURCE).half_tangent(m_b)
    return np.asarray(source.from_half_tangent(tangents))


def sweep(source: Distribution, count: int) -> Array:
    """Return parameters for lobes as wide as those of the paper's sweep, evenly in logarithm."""
    m_b, _ = paper_sweep()
    low, high = as_wide([m_b.min(), m_b.max()], source).tolist()
    return np.geomspace(low, high, count)


def method_speeds(
    source: Distribution, target: Distribution, sizes: Sizes, advance: Advance
) -> list[MethodSpeed]:
    """Measure every method that covers a pair, under every metric it can answer.

    Parameters
    ----------
    source, target : Distribution
        The pair.
    sizes : Sizes
        How much is measured.
    advance : callable
        Called with 1 after each of `sizes`.rounds + 1 rounds.

    Raises
    ------
    MdfconvError
        If there is nothing to convert between the two.
    """
    if source.is_same(target):
        raise MdfconvError(f"from {source.name} to {target.name} there is nothing to convert")
    trials = _trials(source, target, sizes)
    functions = {str(number): trial.run(source) for number, trial in enumerate(trials)}
    times = interleave(functions, sizes.rounds, advance)
    return [
        _speed(source, target, trial, sizes, samples)
        for trial, samples in zip(trials, times.values(), strict=True)
    ]


@dataclass(frozen=True)
class _Trial:
    """A method under a metric, and the size of the array on which it is timed."""

    method: str
    metric: Metric
    convert: _Convert
    values: int

    def run(self, source: Distribution) -> Callable[[], object]:
        parameter = sweep(source, self.values)
        return lambda: self.convert(parameter)


def _trials(source: Distribution, target: Distribution, sizes: Sizes) -> list[_Trial]:
    """Return the trials: a method that follows no metric once, under the first one."""
    metrics = [metric_named(name) for name in list_metrics()]
    trials = []
    for metric in metrics:
        for method in covering(source, target, metric):
            if method.follows_metric or metric is metrics[0]:
                convert = _by_method(method, source, target, metric)
                trials.append(_Trial(method.name, metric, convert, _size(convert, source, sizes)))
    for metric in metrics:
        trials.append(_Trial(LOOP, metric, _by_loop(source, target, metric), sizes.loop))
    return trials


def _by_method(
    method: Method, source: Distribution, target: Distribution, metric: Metric
) -> _Convert:
    return lambda parameter: answers(method, parameter, source, target, metric)


def _by_loop(source: Distribution, target: Distribution, metric: Metric) -> _Convert:
    return lambda parameter: curve_fit_loop(source, parameter, target, metric)


def _size(convert: _Convert, source: Distribution, sizes: Sizes) -> int:
    """Return the size of array that a method is timed on: many values if it is quick."""
    few = sweep(source, sizes.fits)
    convert(few)
    start = clock()
    convert(few)
    many = (clock() - start) * sizes.conversions / sizes.fits
    return sizes.conversions if many <= _PATIENCE else sizes.fits


def _speed(
    source: Distribution, target: Distribution, trial: _Trial, sizes: Sizes, samples: Array
) -> MethodSpeed:
    parameter = sweep(source, min(trial.values, sizes.fits))
    result = trial.convert(parameter)
    best = answers(method_named("fit"), parameter, source, target, trial.metric)
    answered = ~np.isnan(result) & ~np.isnan(best)
    off = np.abs(result[answered] / best[answered] - 1)
    rmse, _ = remaining_error(source, parameter[answered], target, result[answered], trial.metric)
    return MethodSpeed(
        source=source.name,
        target=target.name,
        method=trial.method,
        metric=str(trial.metric),
        values=trial.values,
        per_second=spread(trial.values / samples),
        parameter_error=_summary(np.median, off),
        parameter_error_max=_summary(np.max, off),
        rmse=_summary(np.median, rmse),
        rmse_max=_summary(np.max, rmse),
        answered=float(np.mean(answered)),
    )


def _summary(function: Callable[[Array], Any], values: Array) -> float:
    return float(function(values)) if values.size else float("nan")
