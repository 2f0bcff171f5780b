"""Least squares between two distributions, batched over a sweep.

The squared distance under a metric is minimized over ln p, p the target's parameter: a scan over
the legal range finds the neighbourhoods of the lowest minima, the zero of the analytic slope in
each is found between candidates, and the lowest of them is the fit unless the distance falls
lower still towards an open end of the range. All problems of a batch advance together.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mdfconv.distributions import Distribution
from mdfconv.distributions.evaluation import Array, Indices
from mdfconv.fitting.metrics import Metric
from mdfconv.fitting.metrics.base import scaled
from mdfconv.fitting.problem import Problem
from mdfconv.fitting.quadrature import Quadrature
from mdfconv.fitting.refine import refine
from mdfconv.fitting.scan import lowest_minima, scan

# The intermediates of a scan, 76 candidates × 250 angles a row, stay in the cache.
_ROWS_AT_ONCE = 32
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
    best, distance = np.full(parameter.size, np.nan), np.full(parameter.size, np.inf)
    limits = target.parameter
    ratio = metric.ratio(source, target) if quadrature is None else None
    for rows in _batches(parameter.size):
        problem = Problem(source, parameter, target, metric, quadrature, rows)
        if ratio is None:
            best[rows], distance[rows] = _minimum(problem)
        else:
            best[rows] = scaled(parameter[rows], ratio, target)
            distance[rows], _ = problem.distance(np.log(best[rows]), np.arange(rows.size))
    return Fit(best, distance, (best == limits.upper) & limits.upper_closed)


def _batches(size: int) -> list[Indices]:
    starts = range(0, size, _ROWS_AT_ONCE)
    return [np.arange(start, min(start + _ROWS_AT_ONCE, size)) for start in starts]


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
