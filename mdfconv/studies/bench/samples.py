"""The hemisphere around a lobe as samples with weights."""

from __future__ import annotations

import numpy as np

from mdfconv.distributions import Distribution
from mdfconv.distributions.evaluation import Array
from mdfconv.fitting.metrics import Metric
from mdfconv.fitting.problem import bounded_tangent
from mdfconv.fitting.quadrature import LobeQuadrature


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
    width = np.arctan(bounded_tangent(source, parameter))
    beta, weight = LobeQuadrature(width).nodes(np.arange(parameter.size))
    column = parameter[:, None]
    peak = source.maximum(column, normalized=metric.normalized)
    signal = metric.signal(source, beta, column, peak)
    return beta, weight * metric.weight(beta), signal, peak
