"""Distributions in another's place: what an evaluation costs, and what error it buys."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mdfconv.benchmark.timing import Advance, Sizes, Spread, interleave, spread
from mdfconv.conversion.remaining_error import remaining_error
from mdfconv.distributions import Distribution
from mdfconv.distributions.evaluation import Array
from mdfconv.fitting.fit import fit
from mdfconv.fitting.metrics import Metric, metric_named

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
