"""The error that a conversion leaves under a metric."""

from __future__ import annotations

import numpy as np

from mdfconv.distributions import Distribution
from mdfconv.distributions.evaluation import Array
from mdfconv.fitting.metrics import Metric
from mdfconv.fitting.problem import Problem, bounded_tangent, narrowest

# 64 × 800 angles and what is computed there stay in the cache.
_ROWS_AT_ONCE = 64
# Of still narrower lobes quadratures lose digits, and squares of their peaks overflow.
_NARROWEST = 1e-30  # radians


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
        √(∫ (S_t − S_s)² w dβ / ∫ S_s² w dβ), and max |S_t − S_s| / max |S_s|; NaN for lobes that
        floats do not resolve: narrower than 1e-30, or so wide or steep that their squares
        overflow.
    """
    columns = []
    for rows in _blocks(parameter.size):
        with np.errstate(all="ignore"):
            columns.append(
                _errors(
                    source,
                    parameter[rows],
                    target,
                    result[rows],
                    metric,
                    None if gamma is None else gamma[rows],
                )
            )
    rmse, maximum = np.concatenate([np.zeros((2, 0)), *columns], axis=1)
    return rmse, maximum


def _errors(
    source: Distribution,
    parameter: Array,
    target: Distribution,
    result: Array,
    metric: Metric,
    gamma: Array | None,
) -> Array:
    """Return both errors, shape (2, n), of so few values that the angles stay in the cache."""
    sources = source, parameter
    if gamma is None:
        shaped = target
        widths = narrowest(*sources, target, result)
    else:
        # A free γ makes the target as wide as the source.
        shaped = target.with_gammas(gamma[:, None])
        widths = np.arctan(bounded_tangent(*sources))
    resolved = widths >= _NARROWEST
    # Where nothing can be said the angles are those of any lobe.
    angles = metric.quadrature(np.where(resolved, widths, 1.0))
    problem = Problem(*sources, shaped, metric, angles, np.arange(widths.size))
    errors: Array = np.stack(problem.relative_error(result))
    return np.where(resolved & np.isfinite(errors).all(axis=0), errors, np.nan)


def _blocks(size: int) -> list[slice]:
    return [slice(start, start + _ROWS_AT_ONCE) for start in range(0, size, _ROWS_AT_ONCE)]
