"""Nonlinear least squares within bounds, for a batch of problems that advance together."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from mdfconv.distributions.evaluation import Array

# Marquardt's factor of the diagonal: where it starts, by how much it falls and rises, its least.
_DAMPING, _EASES, _TIGHTENS, _LEAST_DAMPING = 1e-3, 0.1, 8.0, 1e-12
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
        there = residual(tried)
        reached = np.einsum("ik,ik->i", there, there)
        better = moving & (reached < distance)
        at = np.where(better[:, None], tried, at)
        value = np.where(better[:, None], there, value)
        distance = np.where(better, reached, distance)
        damping = np.maximum(damping * np.where(better, _EASES, _TIGHTENS), _LEAST_DAMPING)
    return at, distance


def _slopes(residual: Callable[[Array], Array], at: Array, low: Array, high: Array) -> Array:
    """Return the slopes of the residuals, shape (n, v, k)."""
    slopes = []
    for variable in range(at.shape[1]):
        ends = []
        for side in (-_DIFFERENCE, _DIFFERENCE):
            moved = at.copy()
            moved[:, variable] += side
            ends.append(np.clip(moved, low, high))
        width = ends[1][:, variable] - ends[0][:, variable]
        slopes.append((residual(ends[1]) - residual(ends[0])) / width[:, None])
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
