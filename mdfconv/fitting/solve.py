"""Least-squares fits of many values, each by the quickest search that answers it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from mdfconv.distributions import Distribution
from mdfconv.distributions.evaluation import Array, Indices, Mask
from mdfconv.fitting.maps import StoredFit
from mdfconv.fitting.metrics import Metric
from mdfconv.fitting.problem import ConversionTask, FitProblem
from mdfconv.fitting.quadrature import NO_BREAKS, Breaks, Quadrature, Samples

# Even, so that every other knot is checked by its neighbours.
_INTERVALS = 4096
# Four knots predict the one in their middle to this; between it and them the error is a
# sixteenth of that.
_TOLERANCE = 1e-7
# With fewer values the function itself is as quick.
WORTH_IT = 2 * _INTERVALS
# Errors are shown with three digits.
_COARSE, _COARSE_TOLERANCE = 512, 1e-4
# The cubic through the first, third, fifth and last of seven even knots, at the one in the middle.
_OUTER_KNOTS, _AT_THE_MIDDLE = [0, 2, 4, 6], np.array([-1, 9, 9, -1]) / 16


def errors_of_many(function: Callable[[Array], Array], parameter: Array) -> Array:
    """Return an error for each of many parameters, from those of some where it is smooth.

    `function` returns errors, shape (n,), of parameters, NaN where there are none. Of fewer than
    a thousand parameters the result is the function's, of more within 1e-4.
    """
    if parameter.size < 2 * _COARSE or not np.ptp(parameter) > 0:
        return function(parameter)
    low, high = parameter.min(), parameter.max()

    def knots(x: Array) -> Array:
        return function(np.clip(np.exp(x), low, high))[None]

    (errors,), _ = interpolated(knots, np.log(parameter), _COARSE, _COARSE_TOLERANCE)
    rest = np.isnan(errors)
    errors[rest] = function(parameter[rest])
    return errors


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
        Places, not all the same.
    intervals : int
        Even: so many lie between the knots.
    tolerance : float
        By how much four knots may miss the one in their middle.

    Returns
    -------
    values : numpy.ndarray, shape (c, m)
        NaN where the first value jumps or bends, by more than the tolerance from the knots
        around.
    absent : numpy.ndarray of bool, shape (m,)
        Where none of the knots around has a value.
    """
    start, step = x.min(), np.ptp(x) / intervals
    knots = function(np.linspace(start, x.max(), intervals + 1))
    place = (x - start) / step
    # Between two knots of four, which are at -1, 0, 1 and 2 in t.
    left = np.clip(place.astype(int), 1, intervals - 2)
    t = place - left
    cubic = {
        -1: t * (t - 1) * (2 - t) / 6,
        0: (t + 1) * (t - 1) * (t - 2) / 2,
        1: (t + 1) * t * (2 - t) / 2,
        2: (t + 1) * t * (t - 1) / 6,
    }
    with np.errstate(invalid="ignore"):
        values = sum(weight * knots[:, left + knot] for knot, weight in cubic.items())

    def holds_around(condition: Mask) -> Mask:
        four: Mask = np.all(sliding_window_view(condition, len(cubic)), axis=-1)
        return four[left - 1]

    smooth = holds_around(_lie_on_cubics(knots[0], tolerance))
    return np.where(smooth, values, np.nan), holds_around(np.isnan(knots[0]))


def _lie_on_cubics(knots: Array, tolerance: float) -> Mask:
    """Return whether knots lie on cubics through others, as far as that is known."""
    sevens = sliding_window_view(knots, 7)[::2]
    good = np.abs(sevens[:, _OUTER_KNOTS] @ _AT_THE_MIDDLE - sevens[:, 3]) <= tolerance
    checked = np.ones(knots.size, bool)
    checked[3:-3:2] = good
    checked[1], checked[-2] = good[0], good[-1]
    return checked


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
# In ln p. The last step of the search is far smaller than the one that is compared with it.
_ROOT_TOLERANCES = {"xatol": 1e-9, "xrtol": 0.0, "fatol": 0.0, "frtol": 0.0}
# Of the ends of a plateau, between which all lobes are clipped as a whole, the last.
_AS_LOW = 1 + 1e-9
# The coarse distance at an end of the scan is right to a per cent or so.
_CLEARLY_LOWER = 0.98
# Steps of a descent that do not shrink to this share lead nowhere; the smallest are rounding.
_MOST_LEFT, _ROUNDING = 0.9, 1e-7
# Over a shorter step panels that end at a kink may stay, which leaves less than that step. Those
# that end at an edge may not: there the signal rises steeply.
_STANDS_STILL = 2e-6


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


def _scan(problem: FitProblem) -> tuple[Array, Array]:
    """Return ascending candidates of each problem and their approximate distances."""
    scanned = candidates(problem)
    distance = problem.coarse_distance(scanned)
    if max(problem.metric.kinks, default=1.0) >= 1:
        return scanned, distance
    closer = _closer(scanned, *_lowest_minima(distance))
    scanned = np.concatenate([scanned, closer], axis=1)
    distance = np.concatenate([distance, problem.coarse_distance(closer)], axis=1)
    order = np.argsort(scanned, axis=1, kind="stable")
    return np.take_along_axis(scanned, order, 1), np.take_along_axis(distance, order, 1)


def _lowest_minima(distance: Array) -> tuple[Indices, Mask]:
    """Return the columns of the lowest minima of each row, and which of them there are.

    The scan is approximate, so a minimum that is nearly as low as the lowest counts as well. Of
    a plateau, which clipping at white makes, both ends count: the minimum may lie beside either.
    """
    padded = np.pad(distance, ((0, 0), (1, 1)), constant_values=np.inf)
    left, right = padded[:, :-2], padded[:, 2:]
    local = (distance <= left) & (distance <= right) & ((distance < left) | (distance < right))
    ranked = np.where(local, distance, np.inf)
    columns = np.argsort(ranked, axis=1, kind="stable")[:, :_MOST_MINIMA]
    values = np.take_along_axis(ranked, columns, axis=1)
    return columns, values <= _NEARLY_AS_LOW * values[:, :1]


def _closer(scanned: Array, columns: Indices, exists: Mask) -> Array:
    """Return more candidates around the lowest minima, shape (n, any)."""
    last = scanned.shape[1] - 1
    log_scanned = np.log(scanned)
    # Where there is no further minimum, the narrowest lobes are as good as any.
    columns = np.where(exists, columns, -1)
    low, high = (
        np.take_along_axis(log_scanned, np.clip(columns + side, 0, last), axis=1)[:, :, None]
        for side in (-_NEIGHBOURS, _NEIGHBOURS)
    )
    share = np.linspace(0, 1, _POINTS_BETWEEN + 2)[1:-1]
    return np.exp(low + (high - low) * share).reshape(len(scanned), -1)


def _global_minimum(problem: FitProblem) -> tuple[Array, Array]:
    """Return the best parameter of each problem of a batch, NaN where none is, and its distance."""
    best, distance = np.full(problem.size, np.nan), np.full(problem.size, np.inf)
    with np.errstate(all="ignore"):
        scanned, coarse = _scan(problem)
        for column, exists in zip(*(part.T for part in _lowest_minima(coarse)), strict=True):
            rows: Indices = np.flatnonzero(exists)
            rows, local, value = _local_minima(problem, rows, np.log(scanned[rows]), column[rows])
            lower = value <= _AS_LOW * distance[rows]
            best[rows[lower]], distance[rows[lower]] = local[lower], value[lower]
        ends = coarse[:, 0]
        if not problem.target.parameter.upper_closed:
            ends = np.minimum(ends, coarse[:, -1])
        return np.where(ends < _CLEARLY_LOWER * distance, np.nan, best), distance


def _local_minima(
    problem: FitProblem, rows: Indices, log_scanned: Array, column: Indices
) -> tuple[Indices, Array, Array]:
    """Return the minima near a column of the candidates.

    Returns
    -------
    rows : numpy.ndarray of int
        Those that have one: none has where the distance falls until an end of the candidates,
        unless that end belongs to the legal range.
    parameter, distance : numpy.ndarray
        The minimum of each of these.
    """
    if rows.size == 0:
        return rows, np.empty(0), np.empty(0)
    limits, last = problem.target.parameter, log_scanned.shape[1] - 1
    # Downhill from the column itself: beyond a neighbour there may be another minimum.
    down = problem.distance(log_scanned[np.arange(rows.size), column], rows)[1] > 0
    low, high = np.maximum(column - down, 0), np.minimum(column + ~down, last)
    log_best, turns = _zero_of_slope(problem, rows, log_scanned, low, high)
    missed = np.flatnonzero(~turns)
    if missed.size:
        # The scan is approximate: from here the distance falls on, down or up the candidates.
        again = problem, rows[missed], log_scanned[missed]
        low[missed], high[missed] = _walk(*again, low[missed], high[missed])
        log_best[missed], turns[missed] = _zero_of_slope(*again, low[missed], high[missed])
    at_end = high == last
    if limits.upper_closed:
        log_best[at_end & ~turns] = np.log(limits.upper)
        exists = (turns | at_end) & (low > 0)
    else:
        exists = turns & ~at_end & (low > 0)
    rows, log_best = rows[exists], log_best[exists]
    if rows.size == 0:
        return rows, log_best, log_best
    return rows, np.exp(log_best), problem.distance(log_best, rows)[0]


def _zero_of_slope(
    problem: FitProblem, rows: Indices, log_scanned: Array, low: Indices, high: Indices
) -> tuple[Array, Mask]:
    """Return ln p where the slope is 0 between two candidates, and whether it turns there to +."""
    from scipy.optimize import elementwise

    def slope(log_parameter: Array, index: Array) -> Array:
        return problem.distance(log_parameter, index.astype(int))[1]

    every_row = np.arange(rows.size)
    result = elementwise.find_root(
        slope,
        (log_scanned[every_row, low], log_scanned[every_row, high]),
        args=(rows.astype(float),),
        tolerances=_ROOT_TOLERANCES,
    )
    return result.x, result.success & (result.f_bracket[0] <= result.f_bracket[1])


def _walk(
    problem: FitProblem, rows: Indices, log_scanned: Array, low: Indices, high: Indices
) -> tuple[Indices, Indices]:
    """Return neighbouring columns between which the slope turns from − to +, or at an end."""
    last = log_scanned.shape[1] - 1
    low, high = low.copy(), high.copy()
    moving = np.arange(rows.size)
    while moving.size:
        at_low, at_high = (
            problem.distance(log_scanned[moving, column[moving]], rows[moving])[1]
            for column in (low, high)
        )
        down = (at_low > 0) & (low[moving] > 0)
        up = ~down & (at_high < 0) & (high[moving] < last)
        high[moving[down]], low[moving[down]] = low[moving[down]], low[moving[down]] - 1
        low[moving[up]], high[moving[up]] = high[moving[up]], high[moving[up]] + 1
        moving = moving[down | up]
    return low, high


def descend(problem: FitProblem, start: Array) -> tuple[Array, Array]:
    """Return the minima near parameters that nearly are, and the distances there.

    A Gauss-Newton step leaves a constant share of the error, a large one where lobes are clipped:
    two of them say where all would lead (Aitken 1926). NaN where they hardly shrink.
    """
    log_start = np.log(start)
    samples = problem.samples(log_start)
    first, _ = problem.step(log_start, samples)
    if problem.target_has_edge or (np.abs(first) > _STANDS_STILL).any():
        samples = problem.samples(log_start + first)
    second, distance = problem.step(log_start + first, samples)
    left = second / first
    lost = (np.abs(left) > _MOST_LEFT) & (np.abs(first) > _ROUNDING)
    moved = first + second / (1 - np.where(np.abs(left) <= _MOST_LEFT, left, 0))
    return np.where(lost, np.nan, start * np.exp(moved)), distance


# The intermediates of a scan, 76 candidates × 250 angles a row, stay in the cache, and those of a
# warm start, 68 angles a row.
_ROWS_AT_ONCE, _WARM_ROWS = 32, 256
# A stored fit is within 1e-6 in ln p: a step far beyond leaves the neighbourhood.
_LARGEST_STEP = 1e-4
# A start that is worse takes some steps to come so near.
_MORE_DESCENTS = 2
# With more values than knots, those between knots start from a curve through the knots' fits.
_KNOTS, _LEAST_KNOTS = 64, 4
# What ends so far above the distances of the knots has missed the lowest minimum.
_AS_USUAL = 1.05
# From the hemisphere to samples of a part of it a fit moves by some per cent.
_DESCENTS_ON_FEW = 2
# From some samples to all it moves by 1e-7, so that one step is enough.
_LARGEST_FROM_FEW = 1e-6


@dataclass(frozen=True)
class Attempt:
    """What a search has to say of n values: of those that are not settled, nothing.

    Of those that are, the parameter is the fit's, or NaN where there is none.
    """

    parameter: Array
    distance: Array
    settled: Mask

    @classmethod
    def nothing(cls, size: int) -> Attempt:
        """Return that of a search that does not apply."""
        return cls(np.full(size, np.nan), np.full(size, np.nan), np.zeros(size, bool))

    @property
    def fits(self) -> Array:
        """The parameters of the fits, NaN where there is none or none is known."""
        return np.where(self.settled, self.parameter, np.nan)


def _interpolate(task: ConversionTask) -> Attempt:
    """Settle what lies on a smooth curve through fits of fewer values."""
    parameter = task.parameter
    x = np.log(parameter)
    if not np.ptp(x) > 0:
        return Attempt.nothing(parameter.size)

    def knots(x: Array) -> Array:
        inside = np.clip(np.exp(x), parameter.min(), parameter.max())
        fits = fit(task.source, inside, task.target, task.metric)
        return np.stack([np.log(fits.parameter), fits.distance])

    (log_best, distance), absent = interpolated(knots, x)
    best = np.minimum(np.exp(log_best), task.target.parameter.upper)
    return Attempt(best, np.where(absent, np.inf, distance), absent | ~np.isnan(best))


def follow_stored(task: ConversionTask) -> Attempt:
    """Settle what a descent from the stored fit reaches, by way of metrics in between."""
    path = task.metric.from_stored()
    stored = StoredFit(task.source, task.target, path[0])
    if not stored.known:
        return Attempt.nothing(task.parameter.size)
    with np.errstate(all="ignore"):
        start = stored(task.parameter)
    if stored.exact:
        return Attempt(start, _similar_distances(task, start), ~np.isnan(start))
    steps = path[1:] or path
    if len(steps) > 1:
        steps = [*steps, *[task.metric] * _MORE_DESCENTS]
    return _follow(task, steps, start)


def _similar_distances(task: ConversionTask, fits: Array) -> Array:
    """Return the distances of fits that are a constant multiple: of similar lobes they are one."""
    limits = task.target.parameter
    some = np.flatnonzero(limits.accepts(fits) & (fits == limits.upper))
    similar = np.flatnonzero(fits < limits.upper)
    some = np.append(some, similar[:1])
    distance = np.full(fits.size, np.nan)
    if some.size:
        problem = task.part(some).problem_near(fits[some])
        distance[some], _ = problem.distance(np.log(fits[some]), np.arange(some.size))
    distance[similar[1:]] = distance[similar[:1]]
    return distance


def _follow(task: ConversionTask, steps: Sequence[Metric], start: Array) -> Attempt:
    """Descend under one metric after the other; the last step is settled if it is a short one."""
    if task.metric.root > 1 and task.target_has_edge:
        # A root of a lobe has a slope at its edge whose square has no integral: as the edge moves
        # with the parameter, Gauss-Newton steps tend to 0 anywhere.
        return Attempt.nothing(start.size)
    accepts = task.target.parameter.accepts
    best, distance, before = np.full((3, task.parameter.size), np.nan)
    for rows in batches(np.flatnonzero(accepts(start)), _WARM_ROWS):
        part, near = task.part(rows), start[rows]
        with np.errstate(all="ignore"):
            for metric in steps[:-1]:
                reached, _ = descend(part._replace(metric=metric).problem_near(near), near)
                near = np.where(accepts(reached), reached, near)
            problem = part._replace(metric=steps[-1]).problem_near(near)
            before[rows] = near
            best[rows], distance[rows] = descend(problem, near)
    with np.errstate(all="ignore"):
        settled = accepts(best) & (np.abs(np.log(best / before)) <= _LARGEST_STEP)
    return Attempt(best, distance, settled)


class FitCurve:
    """Fits of a few values, and those of others near a curve through them."""

    def __init__(self, knots: ConversionTask) -> None:
        self._task = knots
        fits = cold_fit(knots)
        order = np.argsort(knots.parameter)
        x = np.log(knots.parameter[order])
        known = ~np.isnan(fits.parameter[order]) & (np.diff(x, prepend=-np.inf) > 0)
        self._log_knots = x[known]
        self._log_fits = np.log(fits.parameter[order][known])
        self._distances = fits.distance[order][known]

    def __call__(self, parameter: Array) -> Attempt:
        """Settle values, shape (n,), except where the curve leads to no minimum or another one.

        It does where the lowest minimum changes from one to another, or the fit runs into a limit.
        """
        from scipy.interpolate import PchipInterpolator

        task = self._task._replace(parameter=parameter)
        if self._log_knots.size < _LEAST_KNOTS:
            return Attempt.nothing(parameter.size)
        x = np.log(parameter)
        curve = PchipInterpolator(self._log_knots, self._log_fits, extrapolate=False)
        attempt = _follow(task, [task.metric] * (2 + _MORE_DESCENTS), np.exp(curve(x)))
        usual = np.interp(x, self._log_knots, self._distances)
        settled = attempt.settled & (attempt.distance <= _AS_USUAL * usual)
        if task.metric.similar_below:
            settled &= ~(task.source.half_tangent(parameter) < task.metric.similar_below)
        return Attempt(attempt.parameter, attempt.distance, settled)


def _follow_knots(task: ConversionTask) -> Attempt:
    """Settle many values from the fits of a few between which they lie."""
    x = np.log(task.parameter)
    knots = np.exp(np.linspace(x.min(), x.max(), _KNOTS))
    return FitCurve(task._replace(parameter=knots))(task.parameter)


def _search(task: ConversionTask) -> Attempt:
    """Settle every value, without knowing where its minimum is."""
    source, parameter, target, metric, _ = task
    best, distance = np.full((2, parameter.size), np.nan)
    if metric.similar_below:
        scale = source.half_tangent(parameter) / metric.similar_below
        similar = scale < 1
        widened = source.from_half_tangent(metric.similar_below)
        task = task._replace(parameter=np.where(similar, widened, parameter))
    for rows in batches(np.arange(parameter.size), _ROWS_AT_ONCE):
        best[rows], distance[rows] = _global_minimum(task.problem(rows))
    if metric.similar_below and similar.any():
        tangent = target.half_tangent(best[similar]) * scale[similar]
        best[similar] = target.from_half_tangent(tangent)
    return Attempt(best, distance, np.ones(best.size, bool))


def _follow_to_samples(task: ConversionTask) -> Attempt:
    """Settle fits on samples from those over the hemisphere by way of a few samples, or none."""
    nothing = Attempt.nothing(task.parameter.size)
    stored = StoredFit(task.source, task.target, task.metric)
    if not stored.known or task.quadrature is None:
        return nothing
    accepts = task.target.parameter.accepts
    with np.errstate(all="ignore"):
        near = stored(task.parameter)
        if not accepts(near).all():
            return nothing
        few = task._replace(quadrature=_CoarseSamples(task.quadrature)).problem_near(near)
        for _ in range(_DESCENTS_ON_FEW):
            near, _ = descend(few, near)
        if not accepts(near).all():
            return nothing
        problem, log_near = task.problem_near(near), np.log(near)
        step, distance = problem.step(log_near, problem.samples(log_near))
        best = near * np.exp(step)
        stays = (np.abs(step) <= _LARGEST_FROM_FEW) & accepts(best)
    return Attempt(best, distance, stays) if stays.all() else nothing


class _CoarseSamples:
    """The coarse samples of a quadrature in the place of all."""

    def __init__(self, quadrature: Quadrature) -> None:
        self.coarse = quadrature.coarse

    def nodes(self, rows: Indices, breaks: Breaks = NO_BREAKS) -> Samples:
        return self.coarse(rows, fine=True)


def batches(rows: Indices, size: int) -> Iterator[Indices]:
    """Yield rows in parts of a size."""
    return (rows[start : start + size] for start in range(0, rows.size, size))


# The searches in the order in which they are asked, each for what is not settled yet, and how many
# values must be left for it to pay.
_Searches: TypeAlias = Sequence[tuple[Callable[[ConversionTask], Attempt], int]]
_SEARCHES = ((_interpolate, WORTH_IT), (follow_stored, 0), (_follow_knots, _KNOTS), (_search, 0))
_SEARCHES_ON_SAMPLES = ((_follow_to_samples, 0), (_search, 0))


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
    at_limit: Mask


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
    searches = _SEARCHES if quadrature is None else _SEARCHES_ON_SAMPLES
    return _solved(ConversionTask(source, parameter, target, metric, quadrature), searches)


def cold_fit(task: ConversionTask) -> Fit:
    """Fit without knowing where the minimum is: as `fit`, which it checks."""
    return _solved(task, ((_search, 0),))


def _solved(task: ConversionTask, searches: _Searches) -> Fit:
    """Return the fits of a task, each from the first search that settles it."""
    best, distance = np.full((2, task.parameter.size), np.nan)
    left = np.arange(task.parameter.size)
    for search, fewest in searches:
        if left.size > fewest:
            attempt = search(task if left.size == best.size else task.part(left))
            settled = left[attempt.settled]
            best[settled] = attempt.parameter[attempt.settled]
            distance[settled] = attempt.distance[attempt.settled]
            left = left[~attempt.settled]
    limits = task.target.parameter
    return Fit(best, distance, (best == limits.upper) & limits.upper_closed)
