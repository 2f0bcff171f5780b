"""The error that a conversion leaves."""

from __future__ import annotations

import numpy as np

from mdfconv.distributions import Distribution
from mdfconv.distributions.evaluation import Array
from mdfconv.fitting.metrics import Metric

# The number of samples behind the paper's Table 2.
_SAMPLES = 3001
# 4.8 β_half is 4 m_B for Beckmann, the paper's habit.
_HALF_WIDTHS = 4.8
_ROWS_AT_ONCE = 256


def residual(
    source: Distribution,
    parameter: Array,
    target: Distribution,
    result: Array,
    metric: Metric,
) -> tuple[Array, Array]:
    """Compare under a metric on β from 0 to 4.8 β_half of the source, at most π/2.

    Parameters
    ----------
    source, target : Distribution
        The distributions.
    parameter, result : numpy.ndarray, shape (n,)
        Their parameters.
    metric : Metric
        Its signal is compared: D̄, D over the source's maximum, or its encoding for a screen.

    Returns
    -------
    rmse, max_error : numpy.ndarray, shape (n,)
        Root mean square and maximum of the difference over 3001 uniform angles.
    """
    reach = _HALF_WIDTHS * source.half_width(parameter)
    reach = np.where(reach <= np.pi / 2, reach, np.pi / 2)
    errors = [
        _compare(source, parameter[rows], target, result[rows], reach[rows], metric)
        for rows in _blocks(parameter.size)
    ]
    rmse, maximum = np.concatenate([np.zeros((2, 0)), *errors], axis=1)
    return rmse, maximum


def _compare(
    source: Distribution,
    parameter: Array,
    target: Distribution,
    result: Array,
    reach: Array,
    metric: Metric,
) -> Array:
    beta = reach[:, None] * np.linspace(0, 1, _SAMPLES)
    peak = source.maximum(parameter[:, None], normalized=metric.normalized)
    signals = []
    for distribution, values in ((source, parameter[:, None]), (target, result[:, None])):
        scale = distribution.maximum(values, normalized=metric.normalized) / peak
        signals.append(metric.signal(distribution.unit(beta, values) * scale))
    difference = signals[1] - signals[0]
    rmse = np.sqrt(np.mean(np.square(difference), axis=1))
    return np.stack([rmse, np.max(np.abs(difference), axis=1)])


def _blocks(size: int) -> list[slice]:
    return [slice(start, start + _ROWS_AT_ONCE) for start in range(0, size, _ROWS_AT_ONCE)]
