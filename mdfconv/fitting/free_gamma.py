"""Fits of a distribution of two parameters with both of them free."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from mdfconv.distributions import Distribution
from mdfconv.distributions.evaluation import Array, Indices
from mdfconv.errors import MdfconvError
from mdfconv.fitting.metrics import Metric
from mdfconv.fitting.problem import ConversionTask, FitProblem, bounded_tangent
from mdfconv.fitting.quadrature import Quadrature, SmoothQuadrature
from mdfconv.fitting.solve import Fit, batches, candidates, descend

# Marquardt's factor of the diagonal: where it starts, what it falls and rises by, its least.
_DAMPING, _LEAST_DAMPING = 1e-3, 1e-12
_EASES, _TIGHTENS = 0.1, 8.0
# Of the variables: for slopes from differences, and the step at which a search ends.
_DIFFERENCE, _SMALLEST_STEP = 1e-5, 1e-10
_MOST_STEPS = 100


def least_squares(
    residual: Callable[[Array], Array], start: Array, low: Array, high: Array
) -> tuple[Array, Array]:
    """Return where sums of squares are least near a start: Levenberg 1944, Marquardt 1963.

    Parameters
    ----------
    residual : callable
        Returns the residuals, shape (n, k), of variables, shape (n, v).
    start : numpy.ndarray, shape (n, v)
        Where the search begins, within the bounds.
    low, high : numpy.ndarray, shape (v,)
        The bounds.

    Returns
    -------
    at, distance : numpy.ndarray, shapes (n, v) and (n,)
        The best variables, and the sum of squares there.
    """
    at, value = start, residual(start)
    distance = np.einsum("ik,ik->i", value, value)
    damping = np.full(len(start), _DAMPING)
    moving = np.ones(len(start), bool)
    for _ in range(_MOST_STEPS):
        slope = _slopes(residual, at, low, high)
        step = _step(slope, value, damping, at, low, high)
        tried = np.clip(at + step, low, high)
        moving &= np.abs(tried - at).max(axis=1) > _SMALLEST_STEP
        if not moving.any():
            break
        tried_value = residual(tried)
        tried_distance = np.einsum("ik,ik->i", tried_value, tried_value)
        better = moving & (tried_distance < distance)
        at = np.where(better[:, None], tried, at)
        value = np.where(better[:, None], tried_value, value)
        distance = np.where(better, tried_distance, distance)
        damping = np.maximum(damping * np.where(better, _EASES, _TIGHTENS), _LEAST_DAMPING)
    return at, distance


def _slopes(residual: Callable[[Array], Array], at: Array, low: Array, high: Array) -> Array:
    """Return the slopes of the residuals, shape (n, v, k)."""
    slopes = []
    for variable in range(at.shape[1]):
        aside = np.zeros(at.shape[1])
        aside[variable] = _DIFFERENCE
        below, above = (np.clip(moved, low, high) for moved in (at - aside, at + aside))
        width = above[:, variable] - below[:, variable]
        slopes.append((residual(above) - residual(below)) / width[:, None])
    return np.stack(slopes, axis=1)


def _step(slope: Array, value: Array, damping: Array, at: Array, low: Array, high: Array) -> Array:
    """Return the damped Gauss-Newton steps of the variables, shape (n, v)."""
    gradient = np.einsum("ivk,ik->iv", slope, value)
    # What stands at a bound and would go beyond stays.
    free = ~(((at <= low) & (gradient > 0)) | ((at >= high) & (gradient < 0)))
    normal = np.einsum("ivk,iwk->ivw", slope, slope)
    diagonal = np.einsum("ivv->iv", normal)
    normal = np.where(free[:, :, None] & free[:, None, :], normal, 0)
    index = np.arange(at.shape[1])
    normal[:, index, index] = np.where(free & (diagonal > 0), diagonal * (1 + damping[:, None]), 1)
    right = np.where(free, -gradient, 0)[:, :, None]
    return np.linalg.solve(normal, right)[:, :, 0]


# The distance left by the best first parameter has one minimum over γ, and is smooth: 13 values
# over the range lie near enough.
_SCANNED = 13
# Kinks stay where they were while both parameters are found: the next pass puts them right.
_PASSES = 3
# A start need not be as near as where one parameter alone is found: every other candidate will do.
_STRIDE = 2
# The candidates of a scan, 90 × 76 angles a row, stay in the cache.
_BATCH = 64
# Nearer than this share to an end of the range, γ is at the end.
_AT_END = 1e-3


@dataclass(frozen=True)
class FreeFit(Fit):
    """The best pairs of parameters of a batch of n problems.

    Parameters
    ----------
    parameter, gamma : numpy.ndarray, shape (n,)
        The parameters of the target; NaN where the first has no best value.
    distance : numpy.ndarray, shape (n,)
        The squared distance at the minimum.
    at_limit : numpy.ndarray of bool, shape (n,)
        Where γ lies at the end of the range in which it is looked for: the distance falls
        beyond it.
    """

    gamma: Array


def fit_free_gamma(
    source: Distribution,
    parameter: Array,
    target: Distribution,
    metric: Metric,
    quadrature: Quadrature | None = None,
) -> FreeFit:
    """Fit both parameters of the target to the source, for each of a batch.

    Both are looked for together from the lowest of a grid, γ in `Parameter.fit_range`.

    Parameters
    ----------
    source, parameter, target, metric, quadrature
        As for `mdfconv.fitting.solve.fit`; the target's own γ does not matter.

    Raises
    ------
    MdfconvError
        If the target has no second parameter.
    """
    shape = target.second_parameter
    if shape is None:
        raise MdfconvError(f"{target.name} has one parameter and no γ")
    task = ConversionTask(source, parameter, target, metric, quadrature)
    # Where nothing fits the result is NaN, which says so.
    with np.errstate(all="ignore"):
        parts = [_fit_batch(task, rows) for rows in batches(np.arange(parameter.size), _BATCH)]
    best, gamma, distance = np.concatenate(parts or [np.empty((3, 0))], axis=1)
    least, most = source.parameter.held(np.dtype(float))
    held = (parameter >= least) & (parameter <= most)
    best[~(held & np.isfinite(distance))] = np.nan
    return FreeFit(best, distance, np.isin(gamma, shape.fit_range), gamma)


def _fit_batch(task: ConversionTask, rows: Indices) -> Array:
    """Return the first parameters, γ and distances of some of the fits, shape (3, rows)."""
    if task.quadrature is None and task.metric.over_angles:
        # The best lobes are about as wide as the source's.
        task, rows = task.part(rows), np.arange(rows.size)
        width = np.arctan(bounded_tangent(task.source, task.parameter))
        task = task._replace(quadrature=SmoothQuadrature(width, root=task.metric.root))
    target, fit_range = task.target, task.target.parameters[1].fit_range
    low = np.array([-np.inf, np.log(fit_range[0])])
    high = np.log([target.parameter.upper, fit_range[1]])
    x = _start(task, rows)
    for _ in range(_PASSES if task.metric.kinks else 1):
        near = task._replace(target=target.with_gammas(np.exp(x[:, 1:]))).problem(rows)
        x, distance = least_squares(_residual(near, target, x), x, low, high)
    best, gamma = np.exp(x).T
    for end in fit_range:
        at_end = np.flatnonzero(np.abs(x[:, 1] - np.log(end)) < _AT_END)
        if at_end.size:
            gamma[at_end] = end
            problem = task._replace(target=target.with_gamma(end)).problem(rows[at_end])
            best[at_end], distance[at_end] = descend(problem, best[at_end])
    # A step or an exponential may round beyond the end of a closed range.
    return np.stack([np.minimum(best, target.parameter.upper), gamma, distance])


def _start(task: ConversionTask, rows: Indices) -> Array:
    """Return ln p and ln γ of the lowest of many candidates, shape (n, 2), inside the bounds."""
    every_row = np.arange(rows.size)
    lowest, start = np.full(rows.size, np.inf), np.zeros((rows.size, 2))
    low, high = np.log(task.target.parameters[1].fit_range)
    for log_gamma in np.linspace(low, high, _SCANNED):
        shaped = task.target.with_gamma(float(np.exp(log_gamma)))
        problem = task._replace(target=shaped).problem(rows)
        scanned = candidates(problem)[:, ::_STRIDE]
        distance = problem.coarse_distance(scanned)
        column = np.argmin(np.where(np.isnan(distance), np.inf, distance), axis=1)
        best = np.stack([np.log(scanned[every_row, column]), np.full(rows.size, log_gamma)], axis=1)
        lower = distance[every_row, column] < lowest
        lowest[lower], start[lower] = distance[every_row, column][lower], best[lower]
    start[:, 0] = np.minimum(start[:, 0], np.log(task.target.parameter.upper) - _AT_END)
    start[:, 1] = np.clip(start[:, 1], low + _AT_END, high - _AT_END)
    return start


def _residual(near: FitProblem, target: Distribution, x: Array) -> Callable[[Array], Array]:
    """Return the residuals as a function of ln p and ln γ, on the samples for some of them."""
    residual = near.residual(np.exp(x[:, 0]))
    return lambda x: residual(target.with_gammas(np.exp(x[:, 1:])), np.exp(x[:, 0]))
