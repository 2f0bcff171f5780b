"""The error that a conversion leaves under a metric."""

from __future__ import annotations

import numpy as np

from mdfconv.distributions import Distribution
from mdfconv.distributions.evaluation import Array
from mdfconv.fitting.metrics import Metric
from mdfconv.fitting.problem import Problem, bounded_tangent, narrowest

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
        The second parameter of the target, if it was fitted in each row.

    Returns
    -------
    rmse, max_error : numpy.ndarray, shape (n,)
        √(∫ (S_t − S_s)² w dβ / ∫ S_s² w dβ), and max |S_t − S_s| / max |S_s|.
    """
    columns = []
    for rows in _blocks(parameter.size):
        sources = source, parameter[rows]
        if gamma is None:
            shaped = target
            widths = narrowest(*sources, target, result[rows])
        else:
            # A free γ makes the target as wide as the source.
            shaped = target.with_gammas(gamma[rows, None])
            widths = np.arctan(bounded_tangent(*sources))
        every = np.arange(widths.size)
        problem = Problem(*sources, shaped, metric, metric.quadrature(widths), every)
        columns.append(np.stack(problem.relative_error(result[rows])))
    rmse, maximum = np.concatenate([np.zeros((2, 0)), *columns], axis=1)
    return rmse, maximum


def _blocks(size: int) -> list[slice]:
    return [slice(start, start + _ROWS_AT_ONCE) for start in range(0, size, _ROWS_AT_ONCE)]
