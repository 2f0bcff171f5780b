"""Fits of a distribution of two parameters with both of them free."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar

from mdfconv.distributions import Distribution
from mdfconv.distributions.evaluation import Array, Indices
from mdfconv.errors import MdfconvError
from mdfconv.fitting.fit import fit
from mdfconv.fitting.metrics import Metric
from mdfconv.fitting.quadrature import Quadrature

# The distance left by the best first parameter has one minimum over γ, and is smooth: 13 values
# over the range bracket it.
_SCANNED = 13
_TOLERANCE = 1e-8  # in ln γ
# Nearer than this share to an end of the range, γ is at the end.
_AT_END = 1e-3


@dataclass(frozen=True)
class FreeFit:
    """The best pairs of parameters of a batch of n problems.

    Parameters
    ----------
    parameter, gamma : numpy.ndarray, shape (n,)
        The parameters of the target; NaN where the first has no best value.
    distance : numpy.ndarray, shape (n,)
        The squared distance at the minimum.
    at_limit : numpy.ndarray of bool, shape (n,)
        Where γ lies at the end of the range in which it is looked for: the distance falls
        beyond it.
    """

    parameter: Array
    gamma: Array
    distance: Array
    at_limit: Array


def fit_free_gamma(
    source: Distribution,
    parameter: Array,
    target: Distribution,
    metric: Metric,
    quadrature: Quadrature | None = None,
) -> FreeFit:
    """Fit both parameters of the target to the source, for each of a batch.

    γ is looked for in `Parameter.fit_range`, by a bounded search on the distance that the best
    first parameter leaves.

    Parameters
    ----------
    source, parameter, target, metric, quadrature
        As for `mdfconv.fitting.fit.fit`; the target's own γ does not matter.

    Raises
    ------
    MdfconvError
        If the target has no second parameter.
    """
    shape = target.second_parameter
    if shape is None:
        raise MdfconvError(f"{target.name} has one parameter and no γ")
    low, high = np.log(shape.fit_range).tolist()
    scanned = np.linspace(low, high, _SCANNED)
    coarse = np.stack(
        [
            fit(source, parameter, target.with_gamma(float(gamma)), metric, quadrature).distance
            for gamma in np.exp(scanned)
        ]
    )
    rows = range(parameter.size)
    fits = np.array(
        [
            _fit_row(_Row(source, parameter, target, metric, quadrature, row), scanned, coarse)
            for row in rows
        ]
    )
    best, log_gamma, distance = fits.reshape(-1, 3).T
    at_low, at_high = log_gamma - low < _AT_END, high - log_gamma < _AT_END
    gamma = np.where(at_low, shape.fit_range[0], np.exp(log_gamma))
    gamma = np.where(at_high, shape.fit_range[1], gamma)
    return FreeFit(best, gamma, distance, at_low | at_high)


class _Row:
    """One problem of a batch, as a function of ln γ."""

    def __init__(
        self,
        source: Distribution,
        parameter: Array,
        target: Distribution,
        metric: Metric,
        quadrature: Quadrature | None,
        row: int,
    ) -> None:
        self.row = row
        self._source, self._target, self._metric = source, target, metric
        self._parameter = parameter[row : row + 1]
        self._quadrature = None if quadrature is None else _OneRow(quadrature, row)

    def best(self, log_gamma: float) -> tuple[float, float]:
        """Return the distance and the first parameter of the best fit for a γ."""
        target = self._target.with_gamma(float(np.exp(log_gamma)))
        one = fit(self._source, self._parameter, target, self._metric, self._quadrature)
        return float(one.distance[0]), float(one.parameter[0])

    def distance(self, log_gamma: float) -> float:
        return self.best(log_gamma)[0]


class _OneRow:
    """A quadrature's single problem, as a batch of its own."""

    def __init__(self, quadrature: Quadrature, row: int) -> None:
        self._quadrature, self._row = quadrature, np.array([row])

    def nodes(self, rows: Indices, breaks: Array | None = None) -> tuple[Array, Array]:
        return self._quadrature.nodes(self._row, breaks)

    def coarse(self, rows: Indices, *, fine: bool = False) -> tuple[Array, Array]:
        return self._quadrature.coarse(self._row, fine=fine)


def _fit_row(problem: _Row, scanned: Array, coarse: Array) -> tuple[float, float, float]:
    """Return the first parameter, ln γ and the distance of the best fit of one problem."""
    lowest = int(np.argmin(coarse[:, problem.row]))
    ends = scanned[np.clip([lowest - 1, lowest + 1], 0, scanned.size - 1)]
    inside = minimize_scalar(
        problem.distance, bounds=ends, method="bounded", options={"xatol": _TOLERANCE}
    )
    log_gamma = float(min((*ends, inside.x), key=problem.distance))
    distance, best = problem.best(log_gamma)
    return best, log_gamma, distance
