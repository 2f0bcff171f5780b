"""The second part of a fit: the zero of the slope near a candidate."""

from __future__ import annotations

import numpy as np

from mdfconv.distributions.evaluation import Array, Indices
from mdfconv.fitting.problem import Problem

# In ln p. The last step of the search is far smaller than the one that is compared with it.
_TOLERANCES = {"xatol": 1e-9, "xrtol": 0.0, "fatol": 0.0, "frtol": 0.0}


def refine(problem: Problem, candidates: Array, column: Indices) -> tuple[Array, Array]:
    """Return the minimum near a column of the candidates, and its distance.

    Parameters
    ----------
    problem : Problem
        A batch of n fits.
    candidates : numpy.ndarray, shape (n, c)
        Target parameters, rising along a row.
    column : numpy.ndarray of int, shape (n,)
        Where in each row the minimum is looked for; −1 for none.

    Returns
    -------
    parameter, distance : numpy.ndarray, shape (n,)
        NaN and infinity where there is none: where the distance falls until an end of the
        candidates, unless that end belongs to the legal range.
    """
    best, distance = np.full(problem.size, np.nan), np.full(problem.size, np.inf)
    rows = np.flatnonzero(column >= 0)
    if rows.size == 0:
        return best, distance
    log_candidates = np.log(candidates[rows])
    last = log_candidates.shape[1] - 1
    # Downhill from the column itself: beyond a neighbour there may be another minimum.
    start = column[rows]
    down = problem.distance(log_candidates[np.arange(rows.size), start], rows)[1] > 0
    low, high = np.maximum(start - down, 0), np.minimum(start + ~down, last)
    log_best = _zero_of_slope(problem, log_candidates, low, high, rows)
    missed = np.flatnonzero(np.isnan(log_best))
    if missed.size:
        # The scan is approximate: from here the distance falls on, down or up the candidates.
        ends = _walk(problem, log_candidates[missed], low[missed], high[missed], rows[missed])
        log_best[missed] = _zero_of_slope(problem, log_candidates[missed], *ends, rows[missed])
        low[missed], high[missed] = ends
    # What falls until an end of the candidates has no minimum, but where that end is legal.
    target = problem.target.parameter
    at_end = high == last
    if target.upper_closed:
        log_best[at_end & np.isnan(log_best)] = np.log(target.upper)
    else:
        log_best[at_end] = np.nan
    log_best[low == 0] = np.nan
    there = np.flatnonzero(~np.isnan(log_best))
    if there.size == 0:
        return best, distance
    best[rows[there]] = np.exp(log_best[there])
    distance[rows[there]] = problem.distance(log_best[there], rows[there])[0]
    return best, distance


def _zero_of_slope(
    problem: Problem, log_candidates: Array, low: Indices, high: Indices, rows: Indices
) -> Array:
    """Return ln p where the slope turns from − to + between two candidates; NaN if it does not."""
    from scipy.optimize import elementwise

    def slope(log_parameter: Array, index: Array) -> Array:
        return problem.distance(log_parameter, index.astype(int))[1]

    every = np.arange(rows.size)
    result = elementwise.find_root(
        slope,
        (log_candidates[every, low], log_candidates[every, high]),
        args=(rows.astype(float),),
        tolerances=_TOLERANCES,
    )
    rises = result.f_bracket[0] <= result.f_bracket[1]
    return np.where(result.success & rises, result.x, np.nan)


def _walk(
    problem: Problem, log_candidates: Array, low: Indices, high: Indices, rows: Indices
) -> tuple[Indices, Indices]:
    """Return neighbouring columns between which the slope turns from − to +, or at an end."""
    last = log_candidates.shape[1] - 1
    low, high = low.copy(), high.copy()
    moving = np.arange(rows.size)
    while moving.size:
        slope = [
            problem.distance(log_candidates[moving, column[moving]], rows[moving])[1]
            for column in (low, high)
        ]
        down = (slope[0] > 0) & (low[moving] > 0)
        up = ~down & (slope[1] < 0) & (high[moving] < last)
        high[moving[down]], low[moving[down]] = low[moving[down]], low[moving[down]] - 1
        low[moving[up]], high[moving[up]] = high[moving[up]], high[moving[up]] + 1
        moving = moving[down | up]
    return low, high
