"""The error that a conversion leaves under a metric."""

from __future__ import annotations

import numpy as np

from mdfconv.distributions import Distribution
from mdfconv.distributions.evaluation import Array
from mdfconv.fitting.metrics import Metric
from mdfconv.fitting.problem import Problem, narrowest

# 64 × 800 angles and what is computed there stay in the cache.
_ROWS_AT_ONCE = 64


def remaining_error(
    source: Distribution,
    parameter: Array,
    target: Distribution,
    result: Array,
    metric: Metric,
    gamma: Array | None = None,
) -> tuple[Array, Array]:
    """Compare two lobes by what a metric minimizes, so that no conversion is better than the fit.

    Parameters
    ----------
    source, target : Distribution
        The distributions.
    parameter, result : numpy.ndarray, shape (n,)
        Their parameters.
    metric : Metric
        Its signals S are compared, with its weight w, over the whole hemisphere.
    gamma : numpy.ndarray, shape (n,), optional
        The second parameter of the target, if it differs from row to row.

    Returns
    -------
    rmse, max_error : numpy.ndarray, shape (n,)
        √(∫ (S_t − S_s)² w dβ / ∫ S_s² w dβ), and max |S_t − S_s| / max |S_s|.
    """
    if gamma is not None:
        columns = [
            _compare(source, parameter[[row]], target.with_gamma(gamma[row]), result[[row]], metric)
            for row in range(parameter.size)
        ]
    else:
        columns = [
            _compare(source, parameter[rows], target, result[rows], metric)
            for rows in _blocks(parameter.size)
        ]
    rmse, maximum = np.concatenate([np.zeros((2, 0)), *columns], axis=1)
    return rmse, maximum


def _compare(
    source: Distribution, parameter: Array, target: Distribution, result: Array, metric: Metric
) -> Array:
    quadrature = metric.quadrature(narrowest(source, parameter, target, result))
    problem = Problem(source, parameter, target, metric, quadrature, np.arange(parameter.size))
    return np.stack(problem.relative_error(result))


def _blocks(size: int) -> list[slice]:
    return [slice(start, start + _ROWS_AT_ONCE) for start in range(0, size, _ROWS_AT_ONCE)]
