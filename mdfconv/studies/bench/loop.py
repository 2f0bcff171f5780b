"""What one would write without this package: a loop of scipy.optimize.curve_fit."""

from __future__ import annotations

import warnings

import numpy as np

from mdfconv.distributions import Distribution
from mdfconv.distributions.evaluation import Array
from mdfconv.fitting.metrics import Metric
from mdfconv.studies.bench.samples import hemisphere


def curve_fit_loop(
    source: Distribution, parameter: Array, target: Distribution, metric: Metric
) -> Array:
    """Fit values one by one from equal half angles, on the samples that the package fits to.

    Parameters
    ----------
    source, target : Distribution
        The distribution that is replaced and the one that takes its place.
    parameter : numpy.ndarray, shape (n,)
        Legal parameters of the source.
    metric : Metric
        What the fits keep.

    Returns
    -------
    numpy.ndarray, shape (n,)
        Parameters of the target; NaN where there is no start or no convergence.
    """
    from scipy.optimize import OptimizeWarning, curve_fit

    beta, weight, wanted, peak = hemisphere(source, parameter, metric)
    starts = target.from_half_tangent(source.half_tangent(parameter))
    results = np.full(parameter.size, np.nan)
    with np.errstate(all="ignore"), warnings.catch_warnings():
        # A perfect fit has no covariance to speak of.
        warnings.simplefilter("ignore", OptimizeWarning)
        for row in np.flatnonzero(~np.isnan(starts)).tolist():

            def signal(angle: Array, log_parameter: float, row: int = row) -> Array:
                return metric.signal(target, angle, np.exp([log_parameter]), peak[row])

            try:
                fitted, _ = curve_fit(
                    signal, beta[row], wanted[row], [np.log(starts[row])], 1 / np.sqrt(weight[row])
                )
            except RuntimeError:
                continue
            results[row] = np.exp(fitted[0])
    return results
