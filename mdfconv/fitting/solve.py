"""Values of a smooth function at many places from those at some."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mdfconv.distributions import Distribution
from mdfconv.distributions.evaluation import Array, Indices, Mask
from mdfconv.fitting.maps import StoredFit
from mdfconv.fitting.metrics import Metric
from mdfconv.fitting.problem import FitProblem, near_problem
from mdfconv.fitting.quadrature import Quadrature

# Even, so that every other knot is checked by its neighbours.
_INTERVALS = 4096
# Four knots foretell the one in their middle to this; between it and them the error is a
# sixteenth of that.
_TOLERANCE = 1e-7

WORTH_IT = 2 * _INTERVALS
# Errors are shown with three digits.
_COARSE, _COARSE_TOLERANCE = 512, 1e-4


def errors_of_many(function: Callable[[Array], Array], parameter: Array) -> Array:
    """Return an error for each of many parameters, from those of some where it is smooth.

    Parameters
    ----------
    function : callable
        Returns errors, shape (n,), of parameters, shape (n,); NaN where there are none.
    parameter : numpy.ndarray, shape (m,)
        Numbers above 0.

    Returns
    -------
    numpy.ndarray, shape (m,)
        Of fewer than a thousand the function itself, of more to 1e-4.
    """
    if parameter.size < 2 * _COARSE or not np.ptp(parameter) > 0:
        return function(parameter)
    low, high = parameter.min(), parameter.max()
    (found,), _ = interpolated(
        lambda x: function(np.clip(np.exp(x), low, high))[None],
        np.log(parameter),
        _COARSE,
        _COARSE_TOLERANCE,
    )
    rest = np.isnan(found)
    found[rest] = function(parameter[rest])
    return found


def interpolated(
    function: Callable[[Array], Array],
    x: Array,
    intervals: int = _INTERVALS,
    tolerance: float = _TOLERANCE,
) -> tuple[Array, Mask]:
    """Return a function of one variable by cubics through its values at even knots.

    Parameters
    ----------
    function : callable
        Returns values, shape (c, n), at places, shape (n,); NaN where there are none.
    x : numpy.ndarray, shape (m,)
        Places, not all the same. With fewer than `WORTH_IT` the function itself is as quick.
    intervals : int
        Even: so many lie between the knots.
    tolerance : float
        By how much four knots may miss the one in their middle; between them the error is a
        sixteenth of that.

    Returns
    -------
    values : numpy.ndarray, shape (c, m)
        NaN where the first value jumps or bends, by more than the tolerance from the knots
        around.
    nowhere : numpy.ndarray of bool, shape (m,)
        Where none of the knots around has one.
    """
    start, step = x.min(), np.ptp(x) / intervals
    values = function(np.linspace(start, x.max(), intervals + 1))
    place = (x - start) / step
    left = np.clip(place.astype(int), 1, intervals - 2)
    t = place - left
    weights = (
        t * (t - 1) * (2 - t) / 6,
        (t + 1) * (t - 1) * (t - 2) / 2,
        (t + 1) * t * (2 - t) / 2,
        (t + 1) * t * (t - 1) / 6,
    )
    with np.errstate(invalid="ignore"):
        result = sum(weight * values[:, left + at - 1] for at, weight in enumerate(weights))
    nowhere = _all_four(np.isnan(values[0]))[left - 1]
    return np.where(_all_four(_smooth(values[0], tolerance))[left - 1], result, np.nan), nowhere


def _smooth(value: Array, tolerance: float) -> Mask:
    """Return whether knots lie on cubics through others, as far as that is known."""
    foretold = (9 * (value[2:-4:2] + value[4:-2:2]) - value[:-6:2] - value[6::2]) / 16
    good = np.abs(foretold - value[3:-3:2]) <= tolerance
    checked = np.ones(value.size, bool)
    checked[3:-3:2] = good
    checked[1], checked[-2] = good[0], good[-1]
    return checked


def _all_four(holds: Mask) -> Mask:
    """Return where what holds for knots holds for four in a row."""
    every: Mask = holds[:-3] & holds[1:-2] & holds[2:-1] & holds[3:]
    return every


# Targets whose tan β_half is this multiple of the source's: the best fits known lie between 0.3
# and 3; far beyond, the distance only falls towards an end of the legal range.
_LEAST_MULTIPLE, _MOST_MULTIPLE = 0.01, 100.0
# Steps of 21 %, and of 6 % where clipping at white makes minima narrow.
_MULTIPLES, _MULTIPLES_WITH_KINKS = 50, 150
# Where the lobe itself is clipped, the lowest minima are looked at again, as far as two steps
# away in thirds of a step.
_NEIGHBOURS, _POINTS_BETWEEN = 2, 11
# Beyond the widest target that has a half width: factors of its parameter, or for a closed range
# shares of what is left to its end.
_WIDER = np.geomspace(1.02, 1e5, 26)
_CLOSER = np.linspace(0.95, 0, _WIDER.size)
# Where a tangent has no legal parameter, neighbours are this factor apart.
_BEYOND = 1.3
# A tangent above it is that of an angle which no float tells from π/2.
_LARGEST_TANGENT = 1e8
# Distances have seldom two minima, and the scan is approximate.
_MOST_MINIMA, _NEARLY_AS_LOW = 3, 2.0


def scan(problem: FitProblem) -> tuple[Array, Array]:
    """Return target parameters over the whole legal range, and their approximate distances.

    Parameters
    ----------
    problem : Problem
        A batch of n fits.

    Returns
    -------
    candidates, distance : numpy.ndarray, shape (n, c)
        The parameters rise along a row.
    """
    every = candidates(problem)
    distance = problem.coarse_distance(every)
    if max(problem.metric.kinks, default=1.0) >= 1:
        return every, distance
    closer = _closer(every, lowest_minima(distance))
    every = np.concatenate([every, closer], axis=1)
    distance = np.concatenate([distance, problem.coarse_distance(closer)], axis=1)
    order = np.argsort(every, axis=1, kind="stable")
    return np.take_along_axis(every, order, 1), np.take_along_axis(distance, order, 1)


def lowest_minima(distance: Array) -> Indices:
    """Return the columns of the lowest minima of each row, shape (n, 3); −1 for none.

    The scan is approximate, so a minimum that is nearly as low as the lowest counts as well. Of
    a plateau, which clipping at white makes, both ends count: the minimum may lie beside either.
    """
    padded = np.pad(distance, ((0, 0), (1, 1)), constant_values=np.inf)
    left, right = padded[:, :-2], padded[:, 2:]
    local = (distance <= left) & (distance <= right) & ((distance < left) | (distance < right))
    ranked = np.where(local, distance, np.inf)
    columns = np.argsort(ranked, axis=1, kind="stable")[:, :_MOST_MINIMA]
    values = np.take_along_axis(ranked, columns, axis=1)
    return np.where(values <= _NEARLY_AS_LOW * values[:, :1], columns, -1)


def _closer(candidates: Array, columns: Indices) -> Array:
    """Return more candidates around the lowest minima, shape (n, any)."""
    last = candidates.shape[1] - 1
    log_candidates = np.log(candidates)
    ends = [
        np.take_along_axis(log_candidates, np.clip(columns + side, 0, last), axis=1)[:, :, None]
        for side in (-_NEIGHBOURS, _NEIGHBOURS)
    ]
    share = np.linspace(0, 1, _POINTS_BETWEEN + 2)[1:-1]
    return np.exp(ends[0] + (ends[1] - ends[0]) * share).reshape(len(candidates), -1)


def candidates(problem: FitProblem) -> Array:
    """Return target parameters over the whole legal range, ascending, shape (n, c)."""
    target = problem.target
    count = _MULTIPLES_WITH_KINKS if problem.metric.kinks else _MULTIPLES
    multiples = np.geomspace(_LEAST_MULTIPLE, _MOST_MULTIPLE, count)
    tangents = problem.tangent[:, None] * np.append(multiples, 1e6)
    scaled = target.from_half_tangent(np.minimum(tangents, _LARGEST_TANGENT))
    # Exponents fall as lobes widen.
    falls = target.parameter.larger_is_smoother
    widest = (np.fmin if falls else np.fmax).reduce(scaled, axis=1, keepdims=True)
    wider = widest / _WIDER if falls else widest * _WIDER
    if target.parameter.upper_closed:
        upper = target.parameter.upper
        wider = upper - (upper - widest) * _CLOSER
    missing = np.isnan(scaled)
    beyond = widest * _BEYOND ** (np.cumsum(missing, axis=1) * (-1 if falls else 1))
    return np.sort(np.concatenate([np.where(missing, beyond, scaled), wider], axis=1), axis=1)


# In ln p. The last step of the search is far smaller than the one that is compared with it.
_TOLERANCES = {"xatol": 1e-9, "xrtol": 0.0, "fatol": 0.0, "frtol": 0.0}


def refine(problem: FitProblem, candidates: Array, column: Indices) -> tuple[Array, Array]:
    """Return the minimum near a column of the candidates, and its distance.

    Parameters
    ----------
    problem : Problem
        A batch of n fits.
    candidates : numpy.ndarray, shape (n, c)
        Target parameters, rising along a row.
    column : numpy.ndarray of int, shape (n,)
        Where in each row the minimum is looked for; −1 for none.

    Returns
    -------
    parameter, distance : numpy.ndarray, shape (n,)
        NaN and infinity where there is none: where the distance falls until an end of the
        candidates, unless that end belongs to the legal range.
    """
    best, distance = np.full(problem.size, np.nan), np.full(problem.size, np.inf)
    rows = np.flatnonzero(column >= 0)
    if rows.size == 0:
        return best, distance
    log_candidates = np.log(candidates[rows])
    last = log_candidates.shape[1] - 1
    # Downhill from the column itself: beyond a neighbour there may be another minimum.
    start = column[rows]
    down = problem.distance(log_candidates[np.arange(rows.size), start], rows)[1] > 0
    low, high = np.maximum(start - down, 0), np.minimum(start + ~down, last)
    log_best = _zero_of_slope(problem, log_candidates, low, high, rows)
    missed = np.flatnonzero(np.isnan(log_best))
    if missed.size:
        # The scan is approximate: from here the distance falls on, down or up the candidates.
        ends = _walk(problem, log_candidates[missed], low[missed], high[missed], rows[missed])
        log_best[missed] = _zero_of_slope(problem, log_candidates[missed], *ends, rows[missed])
        low[missed], high[missed] = ends
    # What falls until an end of the candidates has no minimum, but where that end is legal.
    target = problem.target.parameter
    at_end = high == last
    if target.upper_closed:
        log_best[at_end & np.isnan(log_best)] = np.log(target.upper)
    else:
        log_best[at_end] = np.nan
    log_best[low == 0] = np.nan
    there = np.flatnonzero(~np.isnan(log_best))
    if there.size == 0:
        return best, distance
    best[rows[there]] = np.exp(log_best[there])
    distance[rows[there]] = problem.distance(log_best[there], rows[there])[0]
    return best, distance


def _zero_of_slope(
    problem: FitProblem, log_candidates: Array, low: Indices, high: Indices, rows: Indices
) -> Array:
    """Return ln p where the slope turns from − to + between two candidates; NaN if it does not."""
    from scipy.optimize import elementwise

    def slope(log_parameter: Array, index: Array) -> Array:
        return problem.distance(log_parameter, index.astype(int))[1]

    every = np.arange(rows.size)
    result = elementwise.find_root(
        slope,
        (log_candidates[every, low], log_candidates[every, high]),
        args=(rows.astype(float),),
        tolerances=_TOLERANCES,
    )
    rises = result.f_bracket[0] <= result.f_bracket[1]
    return np.where(result.success & rises, result.x, np.nan)


def _walk(
    problem: FitProblem, log_candidates: Array, low: Indices, high: Indices, rows: Indices
) -> tuple[Indices, Indices]:
    """Return neighbouring columns between which the slope turns from − to +, or at an end."""
    last = log_candidates.shape[1] - 1
    low, high = low.copy(), high.copy()
    moving = np.arange(rows.size)
    while moving.size:
        slope = [
            problem.distance(log_candidates[moving, column[moving]], rows[moving])[1]
            for column in (low, high)
        ]
        down = (slope[0] > 0) & (low[moving] > 0)
        up = ~down & (slope[1] < 0) & (high[moving] < last)
        high[moving[down]], low[moving[down]] = low[moving[down]], low[moving[down]] - 1
        low[moving[up]], high[moving[up]] = high[moving[up]], high[moving[up]] + 1
        moving = moving[down | up]
    return low, high


# The intermediates of a scan, 76 candidates × 250 angles a row, stay in the cache, and those of a
# warm start, 68 angles a row.
_ROWS_AT_ONCE, _WARM_ROWS = 32, 256
# A stored fit is within 1e-6 in ln p: a step far beyond leaves the neighbourhood. A start that is
# worse takes some steps to come so near.
_LARGEST_STEP, _MORE_DESCENTS = 1e-4, 2
# Steps that do not shrink to this share lead nowhere; the smallest are rounding.
_MOST_LEFT, _ROUNDING = 0.9, 1e-7
# With more values than knots, those between knots start from a curve through the knots' fits. What
# ends far above their distances has missed the lowest minimum.
_KNOTS, _LEAST_KNOTS, _AS_USUAL = 64, 4, 1.05
# From the hemisphere to samples of a part of it a fit moves by some per cent, from some of them to
# all by 1e-7 and so that one step is enough.
_DESCENTS_ON_FEW, _LARGEST_FROM_FEW = 2, 1e-6
# Of the ends of a plateau, between which all lobes are clipped as a whole, the last.
_AS_LOW = 1 + 1e-9
# The coarse distance at an end of the scan is right to a per cent or so.
_CLEARLY_LOWER = 0.98


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
        The distribution that is replaced and the one that takes its place.
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
    if quadrature is not None:
        found = _on_samples(source, parameter, target, metric, quadrature)
        if np.isnan(found.parameter).any():
            return cold_fit(source, parameter, target, metric, quadrature)
        return found
    nowhere = _nowhere(parameter.size, target)
    best, distance = nowhere.parameter, nowhere.distance
    for search, most_left in _SEARCHES:
        rest = np.flatnonzero(np.isnan(best) & (distance != np.inf))
        if rest.size > most_left:
            found = search(source, parameter[rest], target, metric)
            best[rest], distance[rest] = found.parameter, found.distance
    return _with_limits(best, distance, target)


def _among_many(
    source: Distribution, parameter: Array, target: Distribution, metric: Metric
) -> Fit:
    """Fit where fits of fewer values lie on a smooth curve: NaN elsewhere.

    The distance is infinite where there are no fits around.
    """
    x = np.log(parameter)
    if not np.ptp(x) > 0:
        return _nowhere(parameter.size, target)

    def some(x: Array) -> Array:
        fits = fit(source, np.clip(np.exp(x), parameter.min(), parameter.max()), target, metric)
        return np.stack([np.log(fits.parameter), fits.distance])

    (log_best, distance), nowhere = interpolated(some, x)
    best = np.minimum(np.exp(log_best), target.parameter.upper)
    return _with_limits(best, np.where(nowhere, np.inf, distance), target)


def warm_fit(source: Distribution, parameter: Array, target: Distribution, metric: Metric) -> Fit:
    """Fit from where the minimum is known to be near: as `fit`, NaN where that is not known."""
    way = metric.from_stored()
    stored = StoredFit(source, target, way[0])
    if not stored.known:
        return _nowhere(parameter.size, target)
    with np.errstate(all="ignore"):
        start = stored(parameter)
    found = _fit_near(source, parameter, target, way[1:] or way, start)
    return replace(found, parameter=start) if stored.exact else found


def cold_fit(
    source: Distribution,
    parameter: Array,
    target: Distribution,
    metric: Metric,
    quadrature: Quadrature | None = None,
) -> Fit:
    """Fit without knowing where the minimum is: as `fit`, which it checks."""
    best, distance = np.full((2, parameter.size), np.nan)
    fitted = parameter
    if metric.similar_below:
        scale = source.half_tangent(parameter) / metric.similar_below
        similar = scale < 1
        fitted = np.where(similar, source.from_half_tangent(metric.similar_below), parameter)
    for rows in _batches(parameter.size, _ROWS_AT_ONCE):
        problem = FitProblem(source, fitted, target, metric, quadrature, rows)
        best[rows], distance[rows] = _minimum(problem)
    if metric.similar_below and similar.any():
        tangent = target.half_tangent(best[similar]) * scale[similar]
        best[similar] = target.from_half_tangent(tangent)
    return _with_limits(best, distance, target)


def _nowhere(size: int, target: Distribution) -> Fit:
    nowhere = np.full(size, np.nan)
    return _with_limits(nowhere, nowhere.copy(), target)


def _with_limits(best: Array, distance: Array, target: Distribution) -> Fit:
    limits = target.parameter
    return Fit(best, distance, (best == limits.upper) & limits.upper_closed)


def _fit_near(
    source: Distribution, parameter: Array, target: Distribution, way: Sequence[Metric], near: Array
) -> Fit:
    """Return the fits under the last of some metrics, each near those under the one before.

    NaN where they start from none, or a last step says that another minimum may be the lowest.
    """
    best, distance = np.full((2, parameter.size), np.nan)
    there = np.flatnonzero(target.parameter.accepts(near))
    for part in _batches(there.size, _WARM_ROWS):
        rows = there[part]
        start = near[rows]
        for metric in way if len(way) == 1 else [*way, *[way[-1]] * _MORE_DESCENTS]:
            with np.errstate(all="ignore"):
                problem = near_problem(source, parameter[rows], target, start, metric)
                found, distance[rows] = descend(problem, start)
                step = np.log(found / start)
            legal = target.parameter.accepts(found)
            start = np.where(legal, found, start)
        best[rows] = np.where(legal & (np.abs(step) <= _LARGEST_STEP), found, np.nan)
    return _with_limits(best, distance, target)


def _on_samples(
    source: Distribution,
    parameter: Array,
    target: Distribution,
    metric: Metric,
    quadrature: Quadrature,
) -> Fit:
    """Return the fits on given samples, from those over the hemisphere by way of a few samples."""
    stored = StoredFit(source, target, metric)
    nowhere = _nowhere(parameter.size, target)
    if not stored.known:
        return nowhere
    with np.errstate(all="ignore"):
        near = stored(parameter)
        if not target.parameter.accepts(near).all():
            return nowhere
        few = near_problem(source, parameter, target, near, metric, _Few(quadrature))
        for _ in range(_DESCENTS_ON_FEW):
            near, _ = descend(few, near)
        if not target.parameter.accepts(near).all():
            return nowhere
        problem = near_problem(source, parameter, target, near, metric, quadrature)
        step, distance = problem.step(np.log(near))
        best = near * np.exp(step)
        stays = np.abs(step) <= _LARGEST_FROM_FEW
    best = np.where(stays & target.parameter.accepts(best), best, np.nan)
    return _with_limits(best, distance, target)


class _Few:
    """The coarse samples of a quadrature."""

    def __init__(self, quadrature: Quadrature) -> None:
        self._quadrature = quadrature

    def nodes(
        self, rows: Indices, kinks: Array | None = None, edges: Array | None = None
    ) -> tuple[Array, Array]:
        return self._quadrature.coarse(rows, fine=True)

    def coarse(self, rows: Indices, *, fine: bool = False) -> tuple[Array, Array]:
        return self._quadrature.coarse(rows, fine=fine)


def _between_knots(
    source: Distribution, parameter: Array, target: Distribution, metric: Metric
) -> Fit:
    """Fit many values from fits of a few between which they lie."""
    x = np.log(parameter)
    knots = np.exp(np.linspace(x.min(), x.max(), _KNOTS))
    return FitCurve(source, knots, target, metric)(parameter)


class FitCurve:
    """Fits of a few values, and those of others near a curve through them.

    Parameters
    ----------
    source, target, metric
        As for `fit`.
    knots : numpy.ndarray, shape (k,)
        Legal parameters of the source.
    """

    def __init__(
        self, source: Distribution, knots: Array, target: Distribution, metric: Metric
    ) -> None:
        self._problem = source, target, metric
        fits = cold_fit(source, knots, target, metric)
        order = np.argsort(knots)
        x = np.log(knots[order])
        known = ~np.isnan(fits.parameter[order]) & (np.diff(x, prepend=-np.inf) > 0)
        self._log_knots = x[known]
        self._log_fits = np.log(fits.parameter[order][known])
        self._distances = fits.distance[order][known]

    def __call__(self, parameter: Array) -> Fit:
        """Return the fits of values, shape (n,); NaN where the curve leads astray.

        It does where the lowest minimum changes from one to another, or the fit runs into a limit.
        """
        from scipy.interpolate import PchipInterpolator

        source, target, metric = self._problem
        if self._log_knots.size < _LEAST_KNOTS:
            return _nowhere(parameter.size, target)
        x = np.log(parameter)
        curve = PchipInterpolator(self._log_knots, self._log_fits, extrapolate=False)
        start = np.exp(curve(x))
        found = _fit_near(source, parameter, target, [metric, metric], start)
        usual = np.interp(x, self._log_knots, self._distances)
        astray = ~(found.distance <= _AS_USUAL * usual)
        if metric.similar_below:
            astray |= source.half_tangent(parameter) < metric.similar_below
        best = np.where(astray, np.nan, found.parameter)
        return _with_limits(best, found.distance, target)


def descend(problem: FitProblem, start: Array) -> tuple[Array, Array]:
    """Return the minima near parameters that nearly are, and the distances there.

    A Gauss-Newton step leaves a constant share of the error, a large one where lobes are clipped:
    two of them say where all would lead (Aitken 1926). NaN where they hardly shrink.
    """
    first, _ = problem.step(np.log(start))
    second, distance = problem.step(np.log(start) + first)
    left = second / first
    lost = (np.abs(left) > _MOST_LEFT) & (np.abs(first) > _ROUNDING)
    moved = first + second / (1 - np.where(np.abs(left) <= _MOST_LEFT, left, 0))
    return np.where(lost, np.nan, start * np.exp(moved)), distance


def _batches(size: int, rows: int) -> list[Indices]:
    return [np.arange(start, min(start + rows, size)) for start in range(0, size, rows)]


def _minimum(problem: FitProblem) -> tuple[Array, Array]:
    """Return the global minimum of each problem of a batch, and its distance."""
    best, distance = np.full(problem.size, np.nan), np.full(problem.size, np.inf)
    with np.errstate(all="ignore"):
        candidates, coarse = scan(problem)
        for column in lowest_minima(coarse).T:
            local, value = refine(problem, candidates, column)
            lower = value <= _AS_LOW * distance
            best[lower], distance[lower] = local[lower], value[lower]
        ends = coarse[:, 0]
        if not problem.target.parameter.upper_closed:
            ends = np.minimum(ends, coarse[:, -1])
        return np.where(ends < _CLEARLY_LOWER * distance, np.nan, best), distance


# How a fit is found, and how many there must be for that to pay; the first that answers does.
_SEARCHES = ((_among_many, WORTH_IT), (warm_fit, 0), (_between_knots, _KNOTS), (cold_fit, 0))
