"""Least squares between two distributions, batched over a sweep.

Where there is a stored fit, two Gauss-Newton steps from there on a few nodes are the answer.
Elsewhere the squared distance under a metric is minimized over ln p, p the target's parameter: a
scan over the legal range finds the neighbourhoods of the lowest minima, the zero of the analytic
slope in each is found between candidates, and the lowest of them is the fit unless the distance
falls lower still towards an open end of the range. Many values start from the fits of a few. All
problems of a batch advance together.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mdfconv.distributions import Distribution
from mdfconv.distributions.evaluation import Array, Indices
from mdfconv.fitting.interpolation import WORTH_IT, interpolated
from mdfconv.fitting.maps import StoredFit
from mdfconv.fitting.metrics import Metric
from mdfconv.fitting.problem import Problem, near_problem
from mdfconv.fitting.quadrature import Quadrature
from mdfconv.fitting.refine import refine
from mdfconv.fitting.scan import lowest_minima, scan

# The intermediates of a scan, 76 candidates × 250 angles a row, stay in the cache, and those of a
# warm start, 68 angles a row.
_ROWS_AT_ONCE, _WARM_ROWS = 32, 256
# A stored fit is within 1e-6 in ln p: a step far beyond leaves the neighbourhood. A start that is
# worse takes some steps to come so near.
_LARGEST_STEP, _MORE_DESCENTS = 1e-4, 2
# Steps that do not shrink to this share lead nowhere; the smallest are rounding.
_MOST_LEFT, _ROUNDING = 0.9, 1e-7
# With more values than knots, those between knots start from a curve through the knots' fits. What
# ends far above their distances has missed the lowest minimum.
_KNOTS, _LEAST_KNOTS, _AS_USUAL = 64, 4, 1.05
# From the hemisphere to samples of a part of it a fit moves by some per cent, from some of them to
# all by 1e-7 and so that one step is enough.
_DESCENTS_ON_FEW, _LARGEST_FROM_FEW = 2, 1e-6
# Of the ends of a plateau, between which all lobes are clipped as a whole, the last.
_AS_LOW = 1 + 1e-9
# The coarse distance at an end of the scan is right to a per cent or so.
_CLEARLY_LOWER = 0.98


@dataclass(frozen=True)
class Fit:
    """The best parameters of a batch of n problems.

    Parameters
    ----------
    parameter : numpy.ndarray, shape (n,)
        Parameters of the target; NaN where the distance has no minimum in the legal range.
    distance : numpy.ndarray, shape (n,)
        The squared distance at the minimum, in the metric and with the quadrature's weights.
    at_limit : numpy.ndarray of bool, shape (n,)
        Where the minimum lies at the end of a closed legal range.
    """

    parameter: Array
    distance: Array
    at_limit: Array


def fit(
    source: Distribution,
    parameter: Array,
    target: Distribution,
    metric: Metric,
    quadrature: Quadrature | None = None,
) -> Fit:
    """Fit the target to the source for each of a batch of source parameters.

    Parameters
    ----------
    source, target : Distribution
        The distribution that is replaced and the one that takes its place.
    parameter : numpy.ndarray, shape (n,)
        Legal parameters of the source.
    metric : Metric
        What the fit keeps.
    quadrature : Quadrature, optional
        Where the distance is sampled; by default the whole hemisphere.

    Returns
    -------
    Fit
        The global minimum of each problem.
    """
    if quadrature is not None:
        found = _on_samples(source, parameter, target, metric, quadrature)
        if np.isnan(found.parameter).any():
            return cold_fit(source, parameter, target, metric, quadrature)
        return found
    nowhere = _nowhere(parameter.size, target)
    best, distance = nowhere.parameter, nowhere.distance
    for search, most_left in _SEARCHES:
        rest = np.flatnonzero(np.isnan(best) & (distance != np.inf))
        if rest.size > most_left:
            found = search(source, parameter[rest], target, metric)
            best[rest], distance[rest] = found.parameter, found.distance
    return _with_limits(best, distance, target)


def _among_many(
    source: Distribution, parameter: Array, target: Distribution, metric: Metric
) -> Fit:
    """Fit where fits of fewer values lie on a smooth curve: NaN elsewhere.

    The distance is infinite where there are no fits around.
    """
    x = np.log(parameter)
    if not np.ptp(x) > 0:
        return _nowhere(parameter.size, target)

    def some(x: Array) -> Array:
        fits = fit(source, np.clip(np.exp(x), parameter.min(), parameter.max()), target, metric)
        return np.stack([np.log(fits.parameter), fits.distance])

    (log_best, distance), nowhere = interpolated(some, x)
    best = np.minimum(np.exp(log_best), target.parameter.upper)
    return _with_limits(best, np.where(nowhere, np.inf, distance), target)


def warm_fit(source: Distribution, parameter: Array, target: Distribution, metric: Metric) -> Fit:
    """Fit from where the minimum is known to be near: as `fit`, NaN where that is not known."""
    way = metric.from_stored()
    stored = StoredFit(source, target, way[0])
    if not stored.known:
        return _nowhere(parameter.size, target)
    with np.errstate(all="ignore"):
        start = stored(parameter)
    found = _fit_near(source, parameter, target, way[1:] or way, start)
    return replace(found, parameter=start) if stored.exact else found


def cold_fit(
    source: Distribution,
    parameter: Array,
    target: Distribution,
    metric: Metric,
    quadrature: Quadrature | None = None,
) -> Fit:
    """Fit without knowing where the minimum is: as `fit`, which it checks."""
    best, distance = np.full((2, parameter.size), np.nan)
    fitted = parameter
    if metric.similar_below:
        scale = source.half_tangent(parameter) / metric.similar_below
        similar = scale < 1
        fitted = np.where(similar, source.from_half_tangent(metric.similar_below), parameter)
    for rows in _batches(parameter.size, _ROWS_AT_ONCE):
        problem = Problem(source, fitted, target, metric, quadrature, rows)
        best[rows], distance[rows] = _minimum(problem)
    if metric.similar_below and similar.any():
        tangent = target.half_tangent(best[similar]) * scale[similar]
        best[similar] = target.from_half_tangent(tangent)
    return _with_limits(best, distance, target)


def _nowhere(size: int, target: Distribution) -> Fit:
    nowhere = np.full(size, np.nan)
    return _with_limits(nowhere, nowhere.copy(), target)


def _with_limits(best: Array, distance: Array, target: Distribution) -> Fit:
    limits = target.parameter
    return Fit(best, distance, (best == limits.upper) & limits.upper_closed)


def _fit_near(
    source: Distribution, parameter: Array, target: Distribution, way: Sequence[Metric], near: Array
) -> Fit:
    """Return the fits under the last of some metrics, each near those under the one before.

    NaN where they start from none, or a last step says that another minimum may be the lowest.
    """
    best, distance = np.full((2, parameter.size), np.nan)
    there = np.flatnonzero(target.parameter.accepts(near))
    for part in _batches(there.size, _WARM_ROWS):
        rows = there[part]
        start = near[rows]
        for metric in way if len(way) == 1 else [*way, *[way[-1]] * _MORE_DESCENTS]:
            with np.errstate(all="ignore"):
                problem = near_problem(source, parameter[rows], target, start, metric)
                found, distance[rows] = descend(problem, start)
                step = np.log(found / start)
            legal = target.parameter.accepts(found)
            start = np.where(legal, found, start)
        best[rows] = np.where(legal & (np.abs(step) <= _LARGEST_STEP), found, np.nan)
    return _with_limits(best, distance, target)


def _on_samples(
    source: Distribution,
    parameter: Array,
    target: Distribution,
    metric: Metric,
    quadrature: Quadrature,
) -> Fit:
    """Return the fits on given samples, from those over the hemisphere by way of a few samples."""
    stored = StoredFit(source, target, metric)
    nowhere = _nowhere(parameter.size, target)
    if not stored.known:
        return nowhere
    with np.errstate(all="ignore"):
        near = stored(parameter)
        if not target.parameter.accepts(near).all():
            return nowhere
        few = near_problem(source, parameter, target, near, metric, _Few(quadrature))
        for _ in range(_DESCENTS_ON_FEW):
            near, _ = descend(few, near)
        if not target.parameter.accepts(near).all():
            return nowhere
        problem = near_problem(source, parameter, target, near, metric, quadrature)
        step, distance = problem.step(np.log(near))
        best = near * np.exp(step)
        stays = np.abs(step) <= _LARGEST_FROM_FEW
    best = np.where(stays & target.parameter.accepts(best), best, np.nan)
    return _with_limits(best, distance, target)


class _Few:
    """The coarse samples of a quadrature."""

    def __init__(self, quadrature: Quadrature) -> None:
        self._quadrature = quadrature

    def nodes(
        self, rows: Indices, kinks: Array | None = None, edges: Array | None = None
    ) -> tuple[Array, Array]:
        return self._quadrature.coarse(rows, fine=True)

    def coarse(self, rows: Indices, *, fine: bool = False) -> tuple[Array, Array]:
        return self._quadrature.coarse(rows, fine=fine)


def _between_knots(
    source: Distribution, parameter: Array, target: Distribution, metric: Metric
) -> Fit:
    """Fit many values from fits of a few between which they lie."""
    x = np.log(parameter)
    knots = np.exp(np.linspace(x.min(), x.max(), _KNOTS))
    return FitCurve(source, knots, target, metric)(parameter)


class FitCurve:
    """Fits of a few values, and those of others near a curve through them.

    Parameters
    ----------
    source, target, metric
        As for `fit`.
    knots : numpy.ndarray, shape (k,)
        Legal parameters of the source.
    """

    def __init__(
        self, source: Distribution, knots: Array, target: Distribution, metric: Metric
    ) -> None:
        self._problem = source, target, metric
        fits = cold_fit(source, knots, target, metric)
        order = np.argsort(knots)
        x = np.log(knots[order])
        known = ~np.isnan(fits.parameter[order]) & (np.diff(x, prepend=-np.inf) > 0)
        self._log_knots = x[known]
        self._log_fits = np.log(fits.parameter[order][known])
        self._distances = fits.distance[order][known]

    def __call__(self, parameter: Array) -> Fit:
        """Return the fits of values, shape (n,); NaN where the curve leads astray.

        It does where the lowest minimum changes from one to another, or the fit runs into a limit.
        """
        from scipy.interpolate import PchipInterpolator

        source, target, metric = self._problem
        if self._log_knots.size < _LEAST_KNOTS:
            return _nowhere(parameter.size, target)
        x = np.log(parameter)
        curve = PchipInterpolator(self._log_knots, self._log_fits, extrapolate=False)
        start = np.exp(curve(x))
        found = _fit_near(source, parameter, target, [metric, metric], start)
        usual = np.interp(x, self._log_knots, self._distances)
        astray = ~(found.distance <= _AS_USUAL * usual)
        if metric.similar_below:
            astray |= source.half_tangent(parameter) < metric.similar_below
        best = np.where(astray, np.nan, found.parameter)
        return _with_limits(best, found.distance, target)


def descend(problem: Problem, start: Array) -> tuple[Array, Array]:
    """Return the minima near parameters that nearly are, and the distances there.

    A Gauss-Newton step leaves a constant share of the error, a large one where lobes are clipped:
    two of them say where all would lead (Aitken 1926). NaN where they hardly shrink.
    """
    first, _ = problem.step(np.log(start))
    second, distance = problem.step(np.log(start) + first)
    left = second / first
    lost = (np.abs(left) > _MOST_LEFT) & (np.abs(first) > _ROUNDING)
    moved = first + second / (1 - np.where(np.abs(left) <= _MOST_LEFT, left, 0))
    return np.where(lost, np.nan, start * np.exp(moved)), distance


def _batches(size: int, rows: int) -> list[Indices]:
    return [np.arange(start, min(start + rows, size)) for start in range(0, size, rows)]


def _minimum(problem: Problem) -> tuple[Array, Array]:
    """Return the global minimum of each problem of a batch, and its distance."""
    best, distance = np.full(problem.size, np.nan), np.full(problem.size, np.inf)
    with np.errstate(all="ignore"):
        candidates, coarse = scan(problem)
        for column in lowest_minima(coarse).T:
            local, value = refine(problem, candidates, column)
            lower = value <= _AS_LOW * distance
            best[lower], distance[lower] = local[lower], value[lower]
        ends = coarse[:, 0]
        if not problem.target.parameter.upper_closed:
            ends = np.minimum(ends, coarse[:, -1])
        return np.where(ends < _CLEARLY_LOWER * distance, np.nan, best), distance


# How a fit is found, and how many there must be for that to pay; the first that answers does.
_SEARCHES = ((_among_many, WORTH_IT), (warm_fit, 0), (_between_knots, _KNOTS), (cold_fit, 0))
