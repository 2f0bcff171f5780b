"""The error that a conversion leaves."""

from __future__ import annotations

import numpy as np

from mdfconv.distributions import Distribution
from mdfconv.distributions.evaluation import Array
from mdfconv.fitting.metrics import Metric

# The number of samples behind the paper's Table 2.
SAMPLES = 3001
# 4.8 β_half is 4 m_B for Beckmann, the paper's habit.
_HALF_WIDTHS = 4.8
_ROWS_AT_ONCE = 256


def lobe_reach(distribution: Distribution, parameter: Array) -> Array:
    """Return the angle up to which a lobe matters: 4.8 β_half, at most π/2, radians."""
    reach = _HALF_WIDTHS * distribution.half_width(parameter)
    return np.where(reach <= np.pi / 2, reach, np.pi / 2)


def residual(
    source: Distribution,
    parameter: Array,
    target: Distribution,
    result: Array,
    metric: Metric,
    reach: Array | None = None,
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
    reach : numpy.ndarray, shape (n,), optional
        The largest angles, radians, in place of those.

    Returns
    -------
    rmse, max_error : numpy.ndarray, shape (n,)
        Root mean square and maximum of the difference over 3001 uniform angles.
    """
    reach = lobe_reach(source, parameter) if reach is None else reach
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
    beta = reach[:, None] * np.linspace(0, 1, SAMPLES)
    peak = source.maximum(parameter[:, None], normalized=metric.normalized)
    difference = metric.signal_of(target, beta, result[:, None], peak)
    difference -= metric.signal_of(source, beta, parameter[:, None], peak)
    rmse = np.sqrt(np.mean(np.square(difference), axis=1))
    return np.stack([rmse, np.max(np.abs(difference), axis=1)])


def _blocks(size: int) -> list[slice]:
    return [slice(start, start + _ROWS_AT_ONCE) for start in range(0, size, _ROWS_AT_ONCE)]
