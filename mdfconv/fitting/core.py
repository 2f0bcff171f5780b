"""Least squares between two distributions, batched over a sweep.

The squared distance under a metric is minimized over ln p, p the target's parameter: a scan
over the legal range finds the neighbourhood of the global minimum, and the zero of the
analytic derivative is then found by safeguarded secant steps. All problems of a batch advance
together.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mdfconv.distributions import Distribution
from mdfconv.distributions.evaluation import Array, Indices
from mdfconv.fitting.level import level_crossing
from mdfconv.fitting.metrics import Metric
from mdfconv.fitting.quadrature import LobeQuadrature, Quadrature

# Candidates for the scan: multiples of the source's tan β_half, and parameters beyond those
# for which a half width exists.
_LEAST_MULTIPLE, _MOST_MULTIPLE = 0.01, 100.0
_MULTIPLES, _MULTIPLES_WITH_KINKS = 50, 150
_WIDE = np.geomspace(1.02, 1e5, 26)
_BEYOND = 1.3
_WIDEST_TANGENT = 20.0
_MINIMA = 3
# Columns of the scan on either side of its minimum.
_REACH = 2
_RECENTRINGS = 40
_STEPS = 80
_NEARLY = 2.0
_LOWER = 0.98
# In ln p. A secant step of the first size leaves an error far below it; a bisection does not, nor
# does the Gauss-Newton step at the start, whose curvature is not that of the distance.
_SECANT_TOLERANCE = 1e-6
_LINEAR_TOLERANCE = 1e-10
_AT_END = 1e-7
# An encoding for a screen rises like a root where a distribution leaves 0.
_TOWARDS_EDGE = 1 - np.append(0.25 ** np.arange(1, 10), 0)
_ROWS_AT_ONCE = 32


@dataclass(frozen=True)
class Fit:
    """The best parameters of a batch of n problems.

    Parameters
    ----------
    parameter : numpy.ndarray, shape (n,)
        Parameters of the target; NaN where the distance has no minimum in the legal range.
    distance : numpy.ndarray, shape (n,)
        The squared distance at the minimum, in the metric and with the quadrature's weights.
    at_limit : numpy.ndarray of bool, shape (n,)
        Where the minimum lies at the end of a closed legal range.
    """

    parameter: Array
    distance: Array
    at_limit: Array


def fit(
    source: Distribution,
    parameter: Array,
    target: Distribution,
    metric: Metric,
    quadrature: Quadrature | None = None,
) -> Fit:
    """Fit the target to the source for each of a batch of source parameters.

    Parameters
    ----------
    source, target : Distribution
        The distribution that is given and the one that takes its place.
    parameter : numpy.ndarray, shape (n,)
        Legal parameters of the source.
    metric : Metric
        What the fit keeps.
    quadrature : Quadrature, optional
        Where the distance is sampled; by default the whole hemisphere.

    Returns
    -------
    Fit
        The global minimum of each problem.
    """
    blocks = [
        _fit_block(_Problem(source, parameter, target, metric, quadrature, rows))
        for rows in _blocks(parameter.size)
    ]
    columns = zip(*blocks, strict=True) if blocks else [[np.zeros(0)]] * 3
    best, distance, at_limit = (np.concatenate(list(column)) for column in columns)
    return Fit(best, distance, at_limit.astype(bool))


def _blocks(size: int) -> list[Indices]:
    starts = range(0, size, _ROWS_AT_ONCE)
    return [np.arange(start, min(start + _ROWS_AT_ONCE, size)) for start in starts]


class _Problem:
    """A batch of fits: residuals between target and source, and their slope in ln p."""

    def __init__(
        self,
        source: Distribution,
        parameter: Array,
        target: Distribution,
        metric: Metric,
        quadrature: Quadrature | None,
        rows: Indices,
    ) -> None:
        self.target = target
        self._source, self._metric = source, metric
        self._given = parameter[rows][:, None]
        tangent = source.half_tangent(parameter[rows])
        self.tangent = np.where(tangent < _WIDEST_TANGENT, tangent, _WIDEST_TANGENT)
        self._peak = source.maximum(self._given, normalized=metric.normalized)
        if quadrature is None:
            self._quadrature: Quadrature = LobeQuadrature(np.arctan(self.tangent))
            self._rows: Indices = np.arange(rows.size)
        else:
            self._quadrature, self._rows = quadrature, rows
        self._fixed = self._breaks(self._source, self._given, self._peak)
        self._cached: tuple[Array, Array, Array] | None = None
        if target.edge(np.ones(1)) is None and not metric.kinks:
            self._cached = self._sampled(np.arange(rows.size), self._fixed)

    @property
    def size(self) -> int:
        return self._rows.size

    @property
    def has_kinks(self) -> bool:
        return bool(self._metric.kinks)

    def scan(self, candidates: Array) -> Array:
        """Return the approximate distance for each candidate parameter, shape (n, c)."""
        beta, weight = self._quadrature.coarse(self._rows, fine=self.has_kinks)
        weight = weight * self._metric.weight(beta)
        wanted = self._metric.signal_of(self._source, beta, self._given, self._peak)
        shape = (*candidates.shape, beta.shape[1])
        everywhere = np.broadcast_to(beta[:, None, :], shape)
        got = self._metric.signal_of(
            self.target, everywhere, candidates[:, :, None], self._peak[:, :, None]
        )
        got -= wanted[:, None, :]
        return np.einsum("ik,ijk,ijk->ij", weight, got, got)

    def distance(self, log_parameter: Array, index: Indices) -> tuple[Array, Array, Array]:
        """Return the distance, half its slope and half its Gauss-Newton curvature in ln p."""
        chosen = np.exp(log_parameter)[:, None]
        if self._cached is None:
            breaks = self._breaks(self.target, chosen, self._peak[index])
            fixed = self._fixed[index]
            beta, weight, wanted = self._sampled(index, np.concatenate([fixed, breaks], axis=1))
        elif index.size == self.size:
            beta, weight, wanted = self._cached
        else:
            beta, weight, wanted = (array[index] for array in self._cached)
        peak = self._peak[index]
        normalized = self._metric.normalized
        value, slope = self.target.with_slope(beta, chosen, normalized=normalized)
        if normalized:
            value /= peak
            slope *= self._metric.signal_slope(value) / peak
        residual = self._metric.signal(value) - wanted
        weighted = weight * slope
        return (
            np.einsum("ij,ij,ij->i", weight, residual, residual),
            np.einsum("ij,ij->i", weighted, residual),
            np.einsum("ij,ij->i", weighted, slope),
        )

    def _sampled(self, index: Indices, breaks: Array) -> tuple[Array, Array, Array]:
        """Return angles, weights and the source's signal."""
        beta, weight = self._quadrature.nodes(self._rows[index], breaks)
        wanted = self._metric.signal_of(self._source, beta, self._given[index], self._peak[index])
        return beta, weight * self._metric.weight(beta), wanted

    def _breaks(self, distribution: Distribution, parameter: Array, peak: Array) -> Array:
        """Return the angles where the signal is not smooth, shape (n, any); 0 for none."""
        edge = distribution.edge(parameter)
        found = [np.zeros_like(parameter) if edge is None else edge * _TOWARDS_EDGE]
        maximum = distribution.maximum(parameter, normalized=self._metric.normalized)
        mode = distribution.mode(parameter)
        for kink in self._metric.kinks:
            level = kink * peak / maximum
            ends = [(mode, np.full_like(mode, 0.5 * np.pi))]
            if np.any(mode > 0):
                ends.append((mode, np.zeros_like(mode)))
            found += [level_crossing(distribution, parameter, level, *end) for end in ends]
        return np.concatenate(found, axis=1)


def _fit_block(problem: _Problem) -> tuple[Array, Array, Array]:
    with np.errstate(all="ignore"):
        candidates = _candidates(problem)
        scanned = problem.scan(candidates)
        best = np.full(problem.size, np.nan)
        distance = np.full(problem.size, np.inf)
        for column in _lowest_minima(scanned).T:
            found, value = _refine(problem, candidates, scanned, column)
            better = value < distance
            best[better], distance[better] = found[better], value[better]
        # No minimum inside holds where the distance falls lower still towards an open end.
        ends = scanned[:, 0]
        if not problem.target.parameter.upper_closed:
            ends = np.minimum(ends, scanned[:, -1])
        best = np.where(ends < _LOWER * distance, np.nan, best)
        wanted = problem.target.parameter
        at_limit = (best == wanted.upper) & wanted.upper_closed
    return best, distance, at_limit


def _candidates(problem: _Problem) -> Array:
    """Return target parameters over the whole legal range, ascending, shape (n, c)."""
    target = problem.target
    # Clipping at white makes minima narrow.
    count = _MULTIPLES_WITH_KINKS if problem.has_kinks else _MULTIPLES
    multiples = np.geomspace(_LEAST_MULTIPLE, _MOST_MULTIPLE, count)
    tangents = problem.tangent[:, None] * np.append(multiples, 1e6)
    scaled = target.from_half_tangent(np.minimum(tangents, 1e8))
    # Exponents fall as lobes widen.
    falls = np.fmin.reduce(scaled[0]) < scaled[0, 0]
    widest = (np.fmin if falls else np.fmax).reduce(scaled, axis=1, keepdims=True)
    wide = widest / _WIDE if falls else widest * _WIDE
    if target.parameter.upper_closed:
        upper = target.parameter.upper
        wide = upper - (upper - widest) * np.linspace(0.95, 0, _WIDE.size)
    # Where a tangent has no legal parameter, go on beyond the widest that has one.
    missing = np.isnan(scaled)
    beyond = widest * _BEYOND ** (np.cumsum(missing, axis=1) * (-1 if falls else 1))
    found = np.concatenate([np.where(missing, beyond, scaled), wide], axis=1)
    return np.sort(found, axis=1)


def _lowest_minima(scanned: Array) -> Indices:
    """Return the columns of the lowest minima of each row, shape (n, 3); −1 for none.

    The scan is approximate, so a minimum that is nearly as low as the lowest counts as well.
    """
    padded = np.pad(scanned, ((0, 0), (1, 1)), constant_values=np.inf)
    local = (scanned <= padded[:, :-2]) & (scanned < padded[:, 2:])
    ranked = np.where(local, scanned, np.inf)
    columns = np.argsort(ranked, axis=1, kind="stable")[:, :_MINIMA]
    values = np.take_along_axis(ranked, columns, axis=1)
    return np.where(values <= _NEARLY * values[:, :1], columns, -1)


def _refine(
    problem: _Problem, candidates: Array, scanned: Array, column: Indices
) -> tuple[Array, Array]:
    """Return the minimum near a column of the scan and its distance; NaN and inf for none."""
    best = np.full(problem.size, np.nan)
    value = np.full(problem.size, np.inf)
    active = np.flatnonzero(column >= 0)
    last = candidates.shape[1] - 1
    steps = np.arange(-_REACH, _REACH + 1)
    for _ in range(_RECENTRINGS):
        if active.size == 0:
            break
        places = np.clip(column[active, None] + steps, 0, last)
        around = np.log(candidates[active[:, None], places])
        start = _vertex(around[:, 1:4], scanned[active[:, None], places[:, 1:4]])
        low, high = around[:, 0], around[:, -1]
        root, value[active] = _stationary(problem, low.copy(), high.copy(), start, active)
        best[active] = np.exp(root)
        # Where the approximate scan was out by more than the bracket, go on from its end.
        down, up = root <= low + _AT_END, root >= high - _AT_END
        shift = _REACH * (up.astype(int) - down.astype(int))
        moved = np.clip(column[active] + shift, 0, last)
        previous, column = column[active], column.copy()
        column[active] = moved
        active = active[moved != previous]
    return _without_open_ends(problem, candidates, best, value)


def _without_open_ends(
    problem: _Problem, candidates: Array, best: Array, value: Array
) -> tuple[Array, Array]:
    """Return minima without those at the ends of the scan, which belong to no legal range.

    Sliding down to the end of the scan means that there is no minimum before it, unless the
    end is part of the legal range.
    """
    slid_up = best >= candidates[:, -1] * (1 - _AT_END)
    slid_down = best <= candidates[:, 0] * (1 + _AT_END)
    upper = problem.target.parameter.upper
    best[slid_up] = upper if problem.target.parameter.upper_closed else np.nan
    best[slid_down] = np.nan
    value[np.isnan(best)] = np.inf
    return best, value


def _vertex(x: Array, y: Array) -> Array:
    """Return the lowest point of the parabola through three points, the middle if it has none."""
    left, right = x[:, 0] - x[:, 1], x[:, 2] - x[:, 1]
    down, up = (y[:, 0] - y[:, 1]) / left, (y[:, 2] - y[:, 1]) / right
    vertex = x[:, 1] + 0.5 * (up * left - down * right) / (up - down)
    return np.where((vertex > x[:, 0]) & (vertex < x[:, 2]), vertex, x[:, 1])


def _stationary(
    problem: _Problem, lower: Array, upper: Array, start: Array, rows: Indices
) -> tuple[Array, Array]:
    """Return the zero of the slope between bounds, and the distance there.

    Secant steps, replaced by bisection where they leave the bracket or do not shrink; where
    the slope keeps its sign they end at the bound.
    """
    root = start.copy()
    distance = np.empty_like(root)
    active = np.arange(root.size)
    last_step = upper - lower
    previous: tuple[Array, Array] | None = None
    for _ in range(_STEPS):
        x = root[active]
        distance[active], slope, curvature = problem.distance(x, rows[active])
        low = np.where(slope < 0, x, lower[active])
        high = np.where(slope >= 0, x, upper[active])
        if previous is None:
            step, tolerance = -slope / curvature, np.full_like(x, _LINEAR_TOLERANCE)
        else:
            step = -slope * (x - previous[0]) / (slope - previous[1])
            # Towards a closed end the distance bends on the scale of what is left to it.
            left = 1 - np.exp(x) / problem.target.parameter.upper
            tolerance = np.maximum(_SECANT_TOLERANCE * left, _LINEAR_TOLERANCE)
        safe = (x + step > low) & (x + step < high) & (np.abs(step) < 0.7 * last_step[active])
        step = np.where(safe, step, 0.5 * (low + high) - x)
        step = np.where(slope == 0, 0, step)
        distance[active] += slope * step
        lower[active], upper[active], last_step[active] = low, high, np.abs(step)
        root[active] = x + step
        going = np.abs(step) > np.where(safe, tolerance, _LINEAR_TOLERANCE)
        previous = x[going], slope[going]
        active = active[going]
        if active.size == 0:
            break
    return root, distance
