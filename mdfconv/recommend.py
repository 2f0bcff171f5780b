"""What to model a surface with: the cheapest distribution whose error a scene can bear."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from mdfconv.conversion import list_methods
from mdfconv.conversion.explanation import remaining_error
from mdfconv.conversion.methods import Method
from mdfconv.distributions import Distribution
from mdfconv.distributions.evaluation import Array
from mdfconv.errors import MdfconvError
from mdfconv.fitting.metrics import Metric
from mdfconv.fitting.problem import ConversionTask
from mdfconv.fitting.solve import fit
from mdfconv.timing import NOISE, Advance, Spread, interleave, spread

# Timed angles and rounds: a millisecond or a few an evaluation.
_ANGLES = 1 << 18
_ROUNDS = 9
_CONVERSION_ROUNDS = 3
# A surface is converted once: conversions whose times differ by a smaller factor cost the same.
_SAME_COST = 10.0
# The method of the source itself, which is not converted.
NOT_CONVERTED = "none"
# A shader pays for operations, NumPy for the time that its whole arrays take.
SHADER, NUMPY = "shader", "numpy"
_COSTS = {SHADER: "for a shader, by operations", NUMPY: "for NumPy, by the time measured now"}
# Errors that agree in so many decimals are the same: one lobe in several parameters.
DECIMALS = 6


def covering(source: Distribution, target: Distribution, metric: Metric) -> list[Method]:
    """Return the methods that convert a pair under a metric."""
    return [method for method in list_methods() if method.covers(source, target, metric)]


def answers(
    method: Method, parameter: Array, source: Distribution, target: Distribution, metric: Metric
) -> Array:
    """Return the results of a method that covers the pair, NaN outside the target's range."""
    with np.errstate(all="ignore"):
        result = np.asarray(method.convert(ConversionTask(source, parameter, target, metric)))
        return np.where(target.parameter.accepts(result), result, np.nan)


def best(
    source: Distribution, parameter: Array, target: Distribution, metric: Metric
) -> tuple[Array, Array, Array]:
    """Return the best fits of a target, and the RMSE and maximum error under the metric.

    They are NaN where there is no best fit. For the source itself they are its own parameter
    and no error.
    """
    if source.is_same(target):
        return parameter, np.zeros_like(parameter), np.zeros_like(parameter)
    result = fit(source, parameter, target, metric).parameter
    fitted = ~np.isnan(result)
    errors = np.full((2, parameter.size), np.nan)
    errors[:, fitted] = remaining_error(source, parameter[fitted], target, result[fitted], metric)
    return result, errors[0], errors[1]


def evaluation_times(
    lobes: Sequence[tuple[Distribution, float]],
    precision: str,
    angles: int,
    rounds: int,
    advance: Advance = lambda steps: None,
) -> list[Spread]:
    """Return the nanoseconds that one evaluation of each unit form takes, from an array of β.

    `lobes` are distributions with their parameters, `precision` is the type of β, uniform on
    [0, π/2]; `rounds` and `advance` are those of `interleave`.
    """
    beta = np.linspace(0, np.pi / 2, angles, dtype=precision)
    evaluations = [partial(candidate.unit, beta, parameter) for candidate, parameter in lobes]
    times = interleave(dict(enumerate(evaluations)), rounds, advance)
    return [spread(1e9 * samples / angles) for samples in times.values()]


@dataclass(frozen=True)
class Candidate:
    """One distribution in the source's place.

    Parameters
    ----------
    distribution : str
        Its name.
    parameter : float
        Its parameter.
    method : str
        The method that gives the parameter; "none" for the source itself.
    ns : float
        Nanoseconds to evaluate the unit form at one angle in float32: the median.
    operations : int
        `Distribution.operations`.
    rmse, max_error : float
        The error under the metric, as in `remaining_error`.
    """

    distribution: str
    parameter: float
    method: str
    ns: float
    operations: int
    rmse: float
    max_error: float


@dataclass(frozen=True)
class Recommendation:
    """What to model a surface with.

    Parameters
    ----------
    chosen : mapping of str to Candidate
        For a ``"shader"`` the distribution within the tolerance with the fewest operations, for
        ``"numpy"`` the quickest, each by the cheapest method within the tolerance.
    others : tuple of Candidate
        The other distributions by their best fits, those within the tolerance first.
    tolerance : float
        The largest error that is allowed.
    reason : str
        Why, in a sentence.
    """

    chosen: Mapping[str, Candidate]
    others: tuple[Candidate, ...]
    tolerance: float
    reason: str

    def records(self) -> list[dict[str, Any]]:
        """Return the candidates as rows of a table, the chosen ones first."""
        uses = _uses(self.chosen) | {candidate: [] for candidate in self.others}
        return [
            vars(candidate)
            | {
                "within": candidate.max_error <= self.tolerance,
                "chosen": use_text(names),
            }
            for candidate, names in uses.items()
        ]


def use_text(uses: Sequence[str]) -> str:
    """Return what something is for: ``"shader"``, ``"numpy"``, ``"both"`` or ``""``."""
    return "both" if len(uses) == len(_COSTS) else "".join(uses)


def _uses(chosen: Mapping[str, Candidate]) -> dict[Candidate, list[str]]:
    """Return the chosen candidates with what each is for."""
    uses: dict[Candidate, list[str]] = {}
    for use, candidate in chosen.items():
        uses.setdefault(candidate, []).append(use)
    return uses


def recommend(
    source: Distribution,
    parameter: float,
    distributions: Sequence[Distribution],
    metric: Metric,
    tolerance: float,
) -> Recommendation:
    """Find the cheapest distribution and conversion whose error stays within a tolerance.

    The cost of a distribution is in a shader the count of its operations, in NumPy its time
    measured now, in float32. Of those as cheap as the cheapest, times but for noise, it is the one
    with the smallest error: the first of those that are `unbeaten`. The cost of a conversion is
    the time that it takes for one value: of the methods within a tenfold of the quickest, the one
    with the smallest error.

    Parameters
    ----------
    source : Distribution
        That of the surface; it is a candidate without an error, so that one is always chosen.
    parameter : float
        Its parameter.
    distributions : sequence of Distribution
        The candidates, the source among them by its name.
    metric : Metric
        Under which errors are taken.
    tolerance : float
        The largest `max_error` allowed.

    Raises
    ------
    MdfconvError
        If the tolerance is not a positive number, or float32 does not hold the surface.
    """
    source.parameter.check(parameter, source.name, np.dtype(np.float32))
    if not 0 < tolerance < np.inf:
        raise MdfconvError(f"a tolerance is a number above 0, not {tolerance:g}")
    surface = np.array([parameter])
    targets = {target.name: target for target in distributions} | {source.name: source}
    candidates = _timed_fits(source, surface, list(targets.values()), metric)
    cheapest = {use: choose(candidates, tolerance, use) for use in _COSTS}
    conversions = {
        one: _cheapest_conversion(
            ConversionTask(source, surface, targets[one.distribution], metric), one, tolerance
        )
        for one in dict.fromkeys(cheapest.values())
    }
    chosen = {use: conversions[candidate] for use, candidate in cheapest.items()}
    rest = [candidate for candidate in candidates if candidate not in conversions]
    others = sorted(rest, key=lambda one: (one.max_error > tolerance, one.ns))
    reason = _reason(chosen, candidates, source.name, tolerance)
    return Recommendation(chosen, tuple(others), tolerance, reason)


def choose(candidates: Sequence[Candidate], tolerance: float, use: str) -> Candidate:
    """Return the cheapest candidate within a tolerance, for ``"shader"`` or ``"numpy"``."""
    rivals = _within(candidates, tolerance)
    costs = [(rival.ns, rival.operations, rival.max_error) for rival in rivals]
    return rivals[unbeaten(costs, use)[0]]


def unbeaten(candidates: Sequence[tuple[float, int, float]], use: str) -> list[int]:
    """Return which candidates nothing beats, by nanoseconds, operations and error of each.

    Those are what nothing is both cheaper and nearer than, the cheapest first: the front of the
    costs of ``"shader"`` or ``"numpy"`` and the errors. Times that differ by noise are the same,
    and where errors are the same, too, fewer operations win.
    """
    rounded = [(ns, operations, round(error, DECIMALS)) for ns, operations, error in candidates]
    if use == SHADER:
        return front([(operations, error) for _, operations, error in rounded])
    return front([(ns, error, operations) for ns, operations, error in rounded], NOISE)


def front(points: Sequence[tuple[float, ...]], tie: float = 0.0) -> list[int]:
    """Return which points are the Pareto front of a cost and an error, the cost rising.

    Costs count as equal that exceed the least of them by at most the share `tie`. What follows the
    error in a point decides between equal errors. Of equal points the first is on the front; a
    point with NaN as the cost or the error never is.

    Examples
    --------
    >>> front([(3.0, 0.0), (1.0, 0.2), (2.0, 0.3), (1.0, 0.2)])
    [1, 0]
    """
    indices: list[int] = []
    lowest: tuple[float, ...] = (np.inf,)
    least = -np.inf
    comparable = [index for index, point in enumerate(points) if not np.isnan(point[:2]).any()]
    for index in sorted(comparable, key=lambda index: points[index]):
        cost, *error = points[index]
        if tuple(error) < lowest:
            lowest = tuple(error)
            if cost <= (1 + tie) * least:
                indices[-1] = index
            else:
                indices.append(index)
                least = cost
    return indices


def _within(candidates: Sequence[Candidate], tolerance: float) -> list[Candidate]:
    return [candidate for candidate in candidates if candidate.max_error <= tolerance]


def _timed_fits(
    source: Distribution, surface: Array, targets: Sequence[Distribution], metric: Metric
) -> list[Candidate]:
    """Return every distribution that has a best fit, timed."""
    fits = [(target, *best(source, surface, target, metric)) for target in targets]
    fits = [fit for fit in fits if not np.isnan(fit[1][0])]
    lobes = [(target, float(parameter[0])) for target, parameter, *_ in fits]
    times = evaluation_times(lobes, "float32", _ANGLES, _ROUNDS)
    candidates = []
    for (target, *arrays), time in zip(fits, times, strict=True):
        parameter, rmse, max_error = (float(array[0]) for array in arrays)
        method = NOT_CONVERTED if source.is_same(target) else "fit"
        cost = time.median, target.operations
        candidates.append(Candidate(target.name, parameter, method, *cost, rmse, max_error))
    return candidates


def _cheapest_conversion(task: ConversionTask, candidate: Candidate, tolerance: float) -> Candidate:
    """Return a candidate by the cheapest method that keeps it within the tolerance."""
    if candidate.method == NOT_CONVERTED:
        return candidate
    source, surface, target, metric, _ = task
    trials: dict[Candidate, Callable[[], object]] = {}
    for method in covering(source, target, metric):
        convert = partial(answers, method, surface, source, target, metric)
        result = convert()
        if np.isnan(result[0]):
            continue
        errors = remaining_error(source, surface, target, result, metric)
        new, rmse, largest = (float(each[0]) for each in (result, *errors))
        trial = replace(candidate, parameter=new, method=method.name, rmse=rmse, max_error=largest)
        if trial.max_error <= tolerance:
            trials[trial] = convert
    samples = interleave(trials, _CONVERSION_ROUNDS, lambda steps: None)
    times = {trial: float(np.median(seconds)) for trial, seconds in samples.items()}
    quick = [trial for trial, time in times.items() if time <= _SAME_COST * min(times.values())]
    return min(quick, key=lambda trial: trial.max_error)


def _reason(
    chosen: Mapping[str, Candidate], candidates: Sequence[Candidate], source: str, tolerance: float
) -> str:
    within = _within(candidates, tolerance)
    if len(within) == 1:
        return f"keep {source}: nothing else stays within {tolerance:g} of it."
    own = next(candidate for candidate in candidates if candidate.method == NOT_CONVERTED)
    parts = []
    for candidate, uses in _uses(chosen).items():
        costs = {
            SHADER: f"{candidate.operations} operations to its {own.operations}",
            NUMPY: f"{candidate.ns / own.ns:.2g} of its time{_tie(candidate, within)}",
        }
        cost = ", ".join(costs[use] for use in uses)
        what = f"keep {source}"
        if candidate.method != NOT_CONVERTED:
            what = f"{candidate.distribution} by {candidate.method} "
            what += f"(maximum error {candidate.max_error:.2g}, {cost})"
        parts.append(f"{' and '.join(_COSTS[use] for use in uses)}: {what}")
    return f"{'; '.join(parts)}. {len(within)} stay within {tolerance:g} of {source}."


def _tie(candidate: Candidate, within: Sequence[Candidate]) -> str:
    least = min(rival.ns for rival in within)
    rivals = [
        rival.distribution
        for rival in within
        if rival.ns <= (1 + NOISE) * least and rival.distribution != candidate.distribution
    ]
    return f"; {' and '.join(rivals)} as quick, but for noise" if rivals else ""
