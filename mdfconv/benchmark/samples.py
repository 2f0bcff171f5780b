"""The hemisphere around a lobe as samples with weights."""

from __future__ import annotations

import numpy as np

from mdfconv.distributions import Distribution
from mdfconv.distributions.evaluation import Array
from mdfconv.fitting.metrics import Metric
from mdfconv.fitting.quadrature import LobeQuadrature

# Beyond this tan β_half, or without a β_half, a lobe is as wide as the hemisphere.
_WIDEST_TANGENT = 20.0


def hemisphere(
    source: Distribution, parameter: Array, metric: Metric
) -> tuple[Array, Array, Array, Array]:
    """Return samples of a lobe that resolve it and its tail.

    Parameters
    ----------
    source : Distribution
        The distribution.
    parameter : numpy.ndarray, shape (n,)
        Its parameters.
    metric : Metric
        What is sampled.

    Returns
    -------
    beta, weight, signal : numpy.ndarray, shape (n, k)
        Angles in radians, the weights of the metric's distance, and the metric's signal.
    peak : numpy.ndarray, shape (n, 1)
        max D, which the signals of other distributions are taken relative to.
    """
    tangent = source.half_tangent(parameter)
    width = np.arctan(np.where(tangent < _WIDEST_TANGENT, tangent, _WIDEST_TANGENT))
    beta, weight = LobeQuadrature(width).nodes(np.arange(parameter.size))
    column = parameter[:, None]
    peak = source.maximum(column, normalized=metric.normalized)
    signal = metric.signal(source, beta, column, peak)
    return beta, weight * metric.weight(beta), signal, peak
