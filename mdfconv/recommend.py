"""Distributions in another's place: what an evaluation costs, and what error it buys."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mdfconv.conversion.explanation import remaining_error
from mdfconv.conversion.methods import Method
from mdfconv.distributions import Distribution
from mdfconv.distributions.evaluation import Array
from mdfconv.errors import MdfconvError
from mdfconv.fitting.metrics import Metric, metric_named
from mdfconv.fitting.solve import fit
from mdfconv.studies.bench.methods import answers, covering
from mdfconv.timing import NOISE, Advance, Sizes, Spread, interleave, spread

PRECISIONS = ("float64", "float32")


@dataclass(frozen=True)
class Substitute:
    """One distribution in the place of a reference.

    Parameters
    ----------
    reference : str
        Name of the reference.
    reference_parameter : float
        Its parameter.
    distribution : str
        Name of the distribution in its place.
    operations : int
        `Distribution.operations`: arithmetic from cos β, a transcendental function counting 10.
    parameter : float
        The best fit under the unit metric; NaN where there is none.
    rmse, max_error : float
        The error of the unit form that fit leaves, as in `remaining_error`.
    energy_error : float
        √(∫ (D − D_ref)² cos β dω / ∫ D_ref² cos β dω), for the best fit under the energy metric.
    ns : dict
        From "float64" and "float32" to nanoseconds an evaluation of the unit form from β.
    """

    reference: str
    reference_parameter: float
    distribution: str
    operations: int
    parameter: float
    rmse: float
    max_error: float
    energy_error: float
    ns: dict[str, Spread]

    def record(self) -> dict[str, Any]:
        """Return a flat row of a table."""
        row = {name: value for name, value in vars(self).items() if name != "ns"}
        for precision, times in self.ns.items():
            row |= times.columns(f"ns_{precision}")
        return row


def substitutes(
    reference: Distribution,
    parameters: Array,
    candidates: Sequence[Distribution],
    sizes: Sizes,
    advance: Advance,
) -> list[Substitute]:
    """Measure every candidate in the place of a reference.

    Parameters
    ----------
    reference : Distribution
        What is replaced.
    parameters : numpy.ndarray, shape (n,)
        Its parameters, each a table of its own.
    candidates : sequence of Distribution
        What takes its place; the reference itself among them shows its own cost.
    sizes : Sizes
        How much is measured.
    advance : callable
        Called with 1 after each of `count_steps` rounds.

    Returns
    -------
    list of Substitute
        For each parameter every candidate.
    """
    fits = [_fit_and_errors(reference, parameters, candidate) for candidate in candidates]
    rows = []
    for number, reference_parameter in enumerate(parameters.tolist()):
        answers = [columns[:, number].tolist() for columns in fits]
        # Where there is no best fit a typical lobe is timed.
        timed = [
            (candidate, candidate.parameter.typical_value if np.isnan(answer[0]) else answer[0])
            for candidate, answer in zip(candidates, answers, strict=True)
        ]
        times = [
            evaluation_times(timed, precision, sizes.angles, sizes.rounds, advance)
            for precision in PRECISIONS
        ]
        rows += [
            Substitute(
                reference=reference.name,
                reference_parameter=reference_parameter,
                distribution=candidate.name,
                operations=candidate.operations,
                parameter=answer[0],
                rmse=answer[1],
                max_error=answer[2],
                energy_error=answer[3],
                ns=dict(zip(PRECISIONS, both, strict=True)),
            )
            for candidate, answer, *both in zip(candidates, answers, *times, strict=True)
        ]
    return rows


def count_steps(parameters: int, sizes: Sizes) -> int:
    """Return how often `substitutes` advances for a number of parameters."""
    return parameters * len(PRECISIONS) * (sizes.rounds + 1)


def evaluation_times(
    lobes: Sequence[tuple[Distribution, float]],
    precision: str,
    angles: int,
    rounds: int,
    advance: Advance = lambda steps: None,
) -> list[Spread]:
    """Return the nanoseconds an evaluation of unit forms takes, measured in turns.

    Parameters
    ----------
    lobes : sequence of (Distribution, float)
        Distributions and their parameters.
    precision : str
        ``"float32"`` or ``"float64"``.
    angles : int
        Size of the array of β, uniform on [0, π/2].
    rounds : int
        Repeats.
    advance : callable
        As for `interleave`.
    """
    beta = np.linspace(0, np.pi / 2, angles, dtype=precision)
    functions = {
        str(number): _evaluation(candidate, parameter, beta)
        for number, (candidate, parameter) in enumerate(lobes)
    }
    times = interleave(functions, rounds, advance)
    return [spread(1e9 * samples / angles) for samples in times.values()]


def _evaluation(candidate: Distribution, parameter: float, beta: Array) -> Callable[[], object]:
    return lambda: candidate.unit(beta, parameter)


def best(
    source: Distribution, parameter: Array, target: Distribution, metric: Metric
) -> tuple[Array, Array, Array]:
    """Return the best fits of a target, and the error that they leave under the metric.

    Parameters
    ----------
    source, target : Distribution
        The reference, and what takes its place.
    parameter : numpy.ndarray, shape (n,)
        Legal parameters of the source.
    metric : Metric
        Under which is fitted and compared.

    Returns
    -------
    parameter, rmse, max_error : numpy.ndarray, shape (n,)
        NaN where there is no best fit; the parameter itself, and no error, for the source.
    """
    if source.is_same(target):
        return parameter, np.zeros_like(parameter), np.zeros_like(parameter)
    result = fit(source, parameter, target, metric).parameter
    fitted = ~np.isnan(result)
    errors = np.full((2, parameter.size), np.nan)
    errors[:, fitted] = remaining_error(source, parameter[fitted], target, result[fitted], metric)
    return result, errors[0], errors[1]


def _fit_and_errors(source: Distribution, parameter: Array, target: Distribution) -> Array:
    """Return parameter, RMSE, maximum and energy error, shape (4, n)."""
    _, energy_error, _ = best(source, parameter, target, metric_named("energy"))
    return np.stack([*best(source, parameter, target, metric_named("unit")), energy_error])


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
