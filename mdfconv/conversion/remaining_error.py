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
# 256 × 3001 angles are 6 MB.
_ROWS_AT_ONCE = 256


def lobe_extent(distribution: Distribution, parameter: Array) -> Array:
    """Return the angle up to which a lobe matters: 4.8 β_half, at most π/2, radians."""
    extent = _HALF_WIDTHS * distribution.half_width(parameter)
    return np.where(extent <= np.pi / 2, extent, np.pi / 2)


def remaining_error(
    source: Distribution,
    parameter: Array,
    target: Distribution,
    result: Array,
    metric: Metric,
    extent: Array | None = None,
    gamma: Array | None = None,
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
    extent : numpy.ndarray, shape (n,), optional
        The largest angles, radians, in place of those.
    gamma : numpy.ndarray, shape (n,), optional
        The second parameter of the target, if it differs from row to row.

    Returns
    -------
    rmse, max_error : numpy.ndarray, shape (n,)
        Root mean square and maximum of the difference over 3001 uniform angles.
    """
    extent = lobe_extent(source, parameter) if extent is None else extent
    columns = [
        _compare(
            source,
            parameter[rows],
            target if gamma is None else target.with_gamma(float(gamma[rows][0])),
            result[rows],
            extent[rows],
            metric,
        )
        for rows in _blocks(parameter.size, _ROWS_AT_ONCE if gamma is None else 1)
    ]
    rmse, maximum = np.concatenate([np.zeros((2, 0)), *columns], axis=1)
    return rmse, maximum


def _compare(
    source: Distribution,
    parameter: Array,
    target: Distribution,
    result: Array,
    extent: Array,
    metric: Metric,
) -> Array:
    beta = extent[:, None] * np.linspace(0, 1, SAMPLES)
    peak = source.maximum(parameter[:, None], normalized=metric.normalized)
    difference = metric.signal(target, beta, result[:, None], peak)
    difference -= metric.signal(source, beta, parameter[:, None], peak)
    rmse = np.sqrt(np.mean(np.square(difference), axis=1))
    return np.stack([rmse, np.max(np.abs(difference), axis=1)])


def _blocks(size: int, rows: int) -> list[slice]:
    return [slice(start, start + rows) for start in range(0, size, rows)]
