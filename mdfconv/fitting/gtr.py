"""Fits of GTR with its exponent γ free."""

from __future__ import annotations

import numpy as np
from scipy.optimize import minimize_scalar

from mdfconv.distributions import Distribution
from mdfconv.distributions.evaluation import Array, Indices
from mdfconv.distributions.gtr import GTR
from mdfconv.fitting.core import fit
from mdfconv.fitting.metrics import Metric
from mdfconv.fitting.quadrature import Quadrature

# Towards γ → ∞ GTR becomes a Gaussian in sin β and α and γ can no longer be told apart.
LOWEST_GAMMA, HIGHEST_GAMMA = 0.25, 64.0
_SCAN = np.geomspace(LOWEST_GAMMA, HIGHEST_GAMMA, 13)
_TOLERANCE = 1e-8  # in ln γ


def fit_gtr(
    source: Distribution,
    parameter: Array,
    metric: Metric,
    quadrature: Quadrature | None = None,
) -> tuple[Array, Array, Array]:
    """Fit α and γ of GTR to the source for each of a batch of source parameters.

    γ is sought between 0.25 and 64, by a bounded search on the distance that the best α
    leaves; a result at either end says that the distance falls beyond it.

    Parameters
    ----------
    source, parameter, metric, quadrature
        As for `mdfconv.fitting.core.fit`.

    Returns
    -------
    alpha, gamma, distance : numpy.ndarray, shape (n,)
        The parameters, and the squared distance at the minimum.
    """
    found = [_fit_one(source, parameter, metric, quadrature, row) for row in range(parameter.size)]
    alpha, gamma, distance = np.array(found).reshape(-1, 3).T
    return alpha, gamma, distance


class _OneRow:
    """A quadrature's single problem, as a batch of its own."""

    def __init__(self, quadrature: Quadrature, row: int) -> None:
        self._quadrature, self._row = quadrature, np.array([row])

    def nodes(self, rows: Indices, breaks: Array | None = None) -> tuple[Array, Array]:
        return self._quadrature.nodes(self._row, breaks)

    def coarse(self, rows: Indices, *, fine: bool = False) -> tuple[Array, Array]:
        return self._quadrature.coarse(self._row, fine=fine)


def _fit_one(
    source: Distribution,
    parameter: Array,
    metric: Metric,
    quadrature: Quadrature | None,
    row: int,
) -> tuple[float, float, float]:
    one = parameter[row : row + 1]
    sampled = None if quadrature is None else _OneRow(quadrature, row)

    def best(log_gamma: float) -> tuple[float, float]:
        result = fit(source, one, GTR(float(np.exp(log_gamma))), metric, sampled)
        return float(result.distance[0]), float(result.parameter[0])

    scanned = [best(log_gamma)[0] for log_gamma in np.log(_SCAN)]
    place = int(np.argmin(scanned))
    ends = np.log(_SCAN[np.clip([place - 1, place + 1], 0, _SCAN.size - 1)])
    inside = minimize_scalar(
        lambda log_gamma: best(log_gamma)[0],
        bounds=ends,
        method="bounded",
        options={"xatol": _TOLERANCE},
    )
    chosen = min((*ends, inside.x), key=lambda log_gamma: best(log_gamma)[0])
    distance, alpha = best(chosen)
    return alpha, float(np.exp(chosen)), distance
