"""Model only what the scene needs: the cheapest distribution and conversion within a tolerance."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mdfconv.benchmark.methods import answers, covering
from mdfconv.benchmark.substitutes import best, evaluation_times
from mdfconv.benchmark.timing import NOISE, interleave, spread
from mdfconv.conversion.method import Method
from mdfconv.conversion.remaining_error import remaining_error
from mdfconv.distributions import Distribution
from mdfconv.distributions.evaluation import Array
from mdfconv.errors import MdfconvError
from mdfconv.fitting.metrics import Metric

# Half a second for eight distributions.
_ANGLES, _ROUNDS = 4_000_000, 5
# A surface is converted once: costs of a conversion that differ by less are the same.
_SAME_COST = 10.0
NOT_CONVERTED = "none"
# A shader pays for operations, NumPy for the time that its whole arrays take.
SHADER, NUMPY = "shader", "numpy"
_COSTS = {SHADER: "for a shader, by operations", NUMPY: "for NumPy, by the time measured now"}


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
    answers : mapping of str to Candidate
        For a ``"shader"`` the distribution within the tolerance with the fewest operations, for
        ``"numpy"`` the quickest, each by the cheapest method within the tolerance.
    others : tuple of Candidate
        The other distributions by their best fits, those within the tolerance first.
    tolerance : float
        The largest error that is allowed.
    reason : str
        Why, in a sentence.
    """

    answers: Mapping[str, Candidate]
    others: tuple[Candidate, ...]
    tolerance: float
    reason: str

    def records(self) -> list[dict[str, Any]]:
        """Return the candidates as rows of a table, the answers first."""
        chosen = list(dict.fromkeys(self.answers.values()))
        return [
            vars(candidate)
            | {"within": candidate.max_error <= self.tolerance, "chosen": self._use(candidate)}
            for candidate in (*chosen, *self.others)
        ]

    def _use(self, candidate: Candidate) -> str:
        uses = [use for use, answer in self.answers.items() if answer is candidate]
        return "both" if len(uses) > 1 else "".join(uses)


def recommend(
    source: Distribution,
    parameter: float,
    distributions: Sequence[Distribution],
    metric: Metric,
    tolerance: float,
) -> Recommendation:
    """Find the cheapest distribution and conversion whose error stays within a tolerance.

    The cost of a distribution is in a shader the count of its operations, then its error. In
    NumPy it is its time measured now, in float32: of those as quick as the quickest but for
    noise, the one with the fewest operations, then the one with the smallest error. The cost of
    a conversion is the time that it takes for one value: of the methods within a tenfold of the
    quickest, the one with the smallest error.

    Parameters
    ----------
    source : Distribution
        That of the surface; it is a candidate without an error, so there is always an answer.
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
    converted = {
        candidate: candidate
        if candidate.method == NOT_CONVERTED
        else _cheapest_conversion(
            source, surface, targets[candidate.distribution], metric, candidate, tolerance
        )
        for candidate in cheapest.values()
    }
    answers = {use: converted[candidate] for use, candidate in cheapest.items()}
    others = sorted(
        (candidate for candidate in candidates if candidate not in converted),
        key=lambda candidate: (candidate.max_error > tolerance, candidate.ns),
    )
    reason = _reason(answers, candidates, source.name, tolerance)
    return Recommendation(answers, tuple(others), tolerance, reason)


def choose(candidates: Sequence[Candidate], tolerance: float, use: str) -> Candidate:
    """Return the cheapest of the candidates within a tolerance.

    Parameters
    ----------
    candidates : sequence of Candidate
        At least one of them is within the tolerance.
    tolerance : float
        The largest `max_error` allowed.
    use : str
        What it is for, ``"shader"`` or ``"numpy"``.
    """
    rivals = _within(candidates, tolerance)
    if use == NUMPY:
        rivals = _quickest(rivals)
    return min(rivals, key=lambda one: (one.operations, one.max_error))


def _within(candidates: Sequence[Candidate], tolerance: float) -> list[Candidate]:
    return [candidate for candidate in candidates if candidate.max_error <= tolerance]


def _quickest(candidates: Sequence[Candidate]) -> list[Candidate]:
    """Return those that are as quick as the quickest but for noise."""
    least = min(candidate.ns for candidate in candidates)
    return [candidate for candidate in candidates if candidate.ns <= (1 + NOISE) * least]


def _timed_fits(
    source: Distribution, surface: Array, targets: Sequence[Distribution], metric: Metric
) -> list[Candidate]:
    """Return every distribution that has a best fit, timed."""
    fits = [(target, *best(source, surface, target, metric)) for target in targets]
    fits = [fit for fit in fits if not np.isnan(fit[1][0])]
    lobes = [(target, float(parameter[0])) for target, parameter, *_ in fits]
    times = evaluation_times(lobes, "float32", _ANGLES, _ROUNDS)
    return [
        Candidate(
            target.name,
            float(parameter[0]),
            NOT_CONVERTED if source.is_same(target) else "fit",
            time.median,
            target.operations,
            float(rmse[0]),
            float(max_error[0]),
        )
        for (target, parameter, rmse, max_error), time in zip(fits, times, strict=True)
    ]


def _cheapest_conversion(
    source: Distribution,
    surface: Array,
    target: Distribution,
    metric: Metric,
    candidate: Candidate,
    tolerance: float,
) -> Candidate:
    """Return a candidate by the cheapest method that keeps it within the tolerance."""
    conversions: dict[str, Candidate] = {}
    runs: dict[str, Callable[[], object]] = {}
    for method in covering(source, target, metric):
        result = answers(method, surface, source, target, metric)
        if np.isnan(result[0]):
            continue
        rmse, max_error = (
            float(error[0]) for error in remaining_error(source, surface, target, result, metric)
        )
        if max_error <= tolerance:
            conversions[method.name] = replace(
                candidate,
                parameter=float(result[0]),
                method=method.name,
                rmse=rmse,
                max_error=max_error,
            )
            runs[method.name] = _conversion(method, surface, source, target, metric)
    times = {name: spread(t).median for name, t in interleave(runs, 3, lambda steps: None).items()}
    quick = [name for name, time in times.items() if time <= _SAME_COST * min(times.values())]
    return conversions[min(quick, key=lambda name: conversions[name].max_error)]


def _conversion(
    method: Method, surface: Array, source: Distribution, target: Distribution, metric: Metric
) -> Callable[[], object]:
    return lambda: answers(method, surface, source, target, metric)


def _reason(
    answers: Mapping[str, Candidate],
    candidates: Sequence[Candidate],
    source: str,
    tolerance: float,
) -> str:
    within = _within(candidates, tolerance)
    if len(within) == 1:
        return f"keep {source}: nothing else stays within {tolerance:g} of it."
    own = next(candidate for candidate in candidates if candidate.method == NOT_CONVERTED)
    costs = {
        use: f"{answer.operations} operations to its {own.operations}"
        if use == SHADER
        else f"{answer.ns / own.ns:.2g} of its time{_tie(answer, within)}"
        for use, answer in answers.items()
    }
    said: dict[Candidate, list[str]] = {}
    for use, answer in answers.items():
        said.setdefault(answer, []).append(use)
    parts = []
    for answer, uses in said.items():
        cost = ", ".join(costs[use] for use in uses)
        what = (
            f"keep {source}"
            if answer.method == NOT_CONVERTED
            else f"{answer.distribution} by {answer.method} (maximum error {answer.max_error:.2g}, "
            f"{cost})"
        )
        parts.append(f"{' and '.join(_COSTS[use] for use in uses)}: {what}")
    return f"{'; '.join(parts)}. {len(within)} stay within {tolerance:g} of {source}."


def _tie(answer: Candidate, within: Sequence[Candidate]) -> str:
    rivals = [
        candidate.distribution
        for candidate in _quickest(within)
        if candidate.distribution != answer.distribution
    ]
    return f"; {' and '.join(rivals)} as quick, but for noise" if rivals else ""
