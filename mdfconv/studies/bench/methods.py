"""Conversion methods: how many values a second, and how far from the best fit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mdfconv.conversion import list_methods, method_named
from mdfconv.conversion.explanation import remaining_error
from mdfconv.conversion.methods import Method
from mdfconv.distributions import Distribution, distribution
from mdfconv.distributions.evaluation import Array
from mdfconv.errors import MdfconvError
from mdfconv.fitting.metrics import Metric, list_metrics, metric_named
from mdfconv.fitting.solve import cold_fit
from mdfconv.studies.bench.loop import curve_fit_loop
from mdfconv.studies.table2 import paper_sweep
from mdfconv.timing import Advance, Sizes, Spread, clock, interleave, spread

# Beside the methods: a loop of SciPy's, and the fit without the stored fits.
LOOP, COLD = "curve_fit", "cold fit"
# From one size that is tried to the next.
_STEP = 10
# The paper's sweep, and every range of widths here, is one of this distribution's m_B.
_PAPER_SOURCE = "beckmann"


@dataclass(frozen=True)
class MethodSpeed:
    """One method on a sweep of one pair.

    Parameters
    ----------
    source, target : str
        Names of the distributions.
    method : str
        Name of the method, ``"curve_fit"`` for a loop of scipy.optimize.curve_fit, or
        ``"cold fit"`` for a fit by a scan, without the stored fits.
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

    @property
    def nanoseconds(self) -> Spread:
        """The time of a value."""
        median, low, high = (1e9 / value for value in self.per_second)
        return Spread(median, high, low)

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
    tried = trials(source, target)
    values = [_size(trial, source, sizes) for trial in tried]
    functions = {
        str(number): partial(trial.convert, sweep(source, size))
        for number, (trial, size) in enumerate(zip(tried, values, strict=True))
    }
    times = interleave(functions, sizes.rounds, advance)
    return [
        _speed(source, target, trial, size, sizes, samples)
        for trial, size, samples in zip(tried, values, times.values(), strict=True)
    ]


@dataclass(frozen=True)
class Trial:
    """A way to convert a pair under a metric.

    Parameters
    ----------
    method : str
        Its name.
    metric : Metric
        Under which its errors are taken.
    convert : callable
        From parameters of the source, shape (n,), to those of the target.
    """

    method: str
    metric: Metric
    convert: Callable[[Array], Array]


def trials(source: Distribution, target: Distribution) -> list[Trial]:
    """Return every way to convert a pair: what follows no metric once, under the first one."""
    metrics = [metric_named(name) for name in list_metrics()]
    found = [
        Trial(method.name, metric, _by_method(method, source, target, metric))
        for metric in metrics
        for method in covering(source, target, metric)
        if method.follows_metric or metric is metrics[0]
    ]
    found += [Trial(COLD, metric, _by_scan(source, target, metric)) for metric in metrics]
    return found + [Trial(LOOP, metric, _by_loop(source, target, metric)) for metric in metrics]


def _by_method(
    method: Method, source: Distribution, target: Distribution, metric: Metric
) -> Callable[[Array], Array]:
    return lambda parameter: answers(method, parameter, source, target, metric)


def _by_scan(
    source: Distribution, target: Distribution, metric: Metric
) -> Callable[[Array], Array]:
    return lambda parameter: cold_fit(source, parameter, target, metric).parameter


def _by_loop(
    source: Distribution, target: Distribution, metric: Metric
) -> Callable[[Array], Array]:
    return lambda parameter: curve_fit_loop(source, parameter, target, metric)


def _size(trial: Trial, source: Distribution, sizes: Sizes) -> int:
    """Return the size of array that a method is timed on: many values if it is quick."""
    if trial.method in (COLD, LOOP):
        return sizes.loop
    size = sizes.fits
    if trial.method == "fit":
        # Among more values most come from a curve: here each is fitted.
        return size
    trial.convert(sweep(source, 1))
    # Step by step, as each of a few costs many times as much as one of many.
    while size < sizes.conversions:
        start = clock()
        trial.convert(sweep(source, size))
        if _STEP * (clock() - start) > sizes.patience:
            return sizes.fits
        size *= _STEP
    return sizes.conversions


def _speed(
    source: Distribution,
    target: Distribution,
    trial: Trial,
    values: int,
    sizes: Sizes,
    samples: Array,
) -> MethodSpeed:
    parameter = sweep(source, min(values, sizes.fits))
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
        values=values,
        per_second=spread(values / samples),
        parameter_error=_summary(np.median, off),
        parameter_error_max=_summary(np.max, off),
        rmse=_summary(np.median, rmse),
        rmse_max=_summary(np.max, rmse),
        answered=float(np.mean(answered)),
    )


def _summary(function: Callable[[Array], Any], values: Array) -> float:
    return float(function(values)) if values.size else float("nan")
