"""Fits of a distribution of two parameters with both of them free."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from mdfconv.distributions import Distribution
from mdfconv.distributions.evaluation import Array, Indices, Mask
from mdfconv.errors import MdfconvError
from mdfconv.fitting.fit import descend
from mdfconv.fitting.metrics import Metric
from mdfconv.fitting.problem import near_problem
from mdfconv.fitting.quadrature import Quadrature
from mdfconv.fitting.scan import candidates

# The distance left by the best first parameter has one minimum over γ, and is smooth: 13 values
# over the range lie near enough.
_SCANNED = 13
# Kinks stay where they were while both parameters are found: the next pass puts them right.
_PASSES = 3
_TOLERANCE = 1e-13
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
    at_limit: Mask


def fit_free_gamma(
    source: Distribution,
    parameter: Array,
    target: Distribution,
    metric: Metric,
    quadrature: Quadrature | None = None,
) -> FreeFit:
    """Fit both parameters of the target to the source, for each of a batch.

    Both are looked for together from the lowest of a grid, γ in `Parameter.fit_range`.

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
    start = _start(source, parameter, target, metric, quadrature)
    rows = [
        _fit_row(source, parameter[[row]], target, metric, _row_of(quadrature, row), start[row])
        for row in range(parameter.size)
    ]
    best, gamma, distance = np.array(rows).reshape(-1, 3).T
    return FreeFit(best, gamma, distance, np.isin(gamma, shape.fit_range))


def _start(
    source: Distribution,
    parameter: Array,
    target: Distribution,
    metric: Metric,
    quadrature: Quadrature | None,
) -> Array:
    """Return ln p and ln γ of the lowest of many candidates, shape (n, 2), inside the bounds."""
    rows = np.arange(parameter.size)
    lowest, start = np.full(parameter.size, np.inf), np.zeros((parameter.size, 2))
    low, high = np.log(target.parameters[1].fit_range)
    for log_gamma in np.linspace(low, high, _SCANNED):
        shaped = target.with_gamma(float(np.exp(log_gamma)))
        width = shaped.from_half_tangent(source.half_tangent(parameter))
        problem = near_problem(source, parameter, shaped, width, metric, quadrature)
        with np.errstate(all="ignore"):
            every = candidates(problem)
            distance = problem.coarse_distance(every)
        column = np.nanargmin(distance, axis=1)
        lower = distance[rows, column] < lowest
        lowest[lower] = distance[rows, column][lower]
        start[lower] = np.stack([np.log(every[rows, column]), np.full(rows.size, log_gamma)], 1)[
            lower
        ]
    start[:, 0] = np.minimum(start[:, 0], np.log(target.parameter.upper) - _AT_END)
    start[:, 1] = np.clip(start[:, 1], low + _AT_END, high - _AT_END)
    return start


def _fit_row(
    source: Distribution,
    parameter: Array,
    target: Distribution,
    metric: Metric,
    quadrature: Quadrature | None,
    x: Array,
) -> tuple[float, float, float]:
    """Return the first parameter, γ and the distance of the best fit of one problem."""
    fit_range = target.parameters[1].fit_range
    low, high = np.log(fit_range).tolist()
    for _ in range(_PASSES):
        near = target.with_gamma(float(np.exp(x[1])))
        problem = near_problem(source, parameter, near, np.exp(x[:1]), metric, quadrature)
        residual = problem.residual(np.exp(x[:1]))
        found = least_squares(
            lambda at, residual=residual: residual(
                target.with_gamma(float(np.exp(at[1]))), float(np.exp(at[0]))
            ),
            x,
            bounds=([-np.inf, low], [np.log(target.parameter.upper), high]),
            xtol=_TOLERANCE,
            ftol=_TOLERANCE,
            gtol=_TOLERANCE,
        )
        x = found.x
    for end, log_end in zip(fit_range, (low, high), strict=True):
        if abs(x[1] - log_end) < _AT_END:
            near = target.with_gamma(end)
            problem = near_problem(source, parameter, near, np.exp(x[:1]), metric, quadrature)
            best, distance = descend(problem, np.exp(x[:1]))
            return float(best[0]), end, float(distance[0])
    return float(np.exp(x[0])), float(np.exp(x[1])), 2 * float(found.cost)


def _row_of(quadrature: Quadrature | None, row: int) -> Quadrature | None:
    return None if quadrature is None else _OneRow(quadrature, row)


class _OneRow:
    """A quadrature's single problem, as a batch of its own."""

    def __init__(self, quadrature: Quadrature, row: int) -> None:
        self._quadrature, self._row = quadrature, np.array([row])

    def nodes(
        self, rows: Indices, kinks: Array | None = None, edges: Array | None = None
    ) -> tuple[Array, Array]:
        return self._quadrature.nodes(self._row, kinks, edges)

    def coarse(self, rows: Indices, *, fine: bool = False) -> tuple[Array, Array]:
        return self._quadrature.coarse(self._row, fine=fine)
