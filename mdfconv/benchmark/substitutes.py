"""Distributions in another's place: what an evaluation costs, and what error it buys."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mdfconv.benchmark.samples import hemisphere
from mdfconv.benchmark.timing import Advance, Sizes, Spread, interleave, spread
from mdfconv.conversion.endpoint import same_family
from mdfconv.conversion.residual import residual
from mdfconv.distributions import Distribution
from mdfconv.distributions.evaluation import Array
from mdfconv.fitting.core import fit
from mdfconv.fitting.metrics import Metric, metric

PRECISIONS = ("float64", "float32")
# Legal for every distribution: what is timed where there is no best fit.
_ANY_PARAMETER = 1.0


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
        What that fit leaves of the unit form: root mean square and maximum, on β from 0 to
        4.8 β_half of the reference.
    energy_error : float
        √(∫ (D − D_ref)² cos β dω / ∫ D_ref² cos β dω) of normalized forms over the hemisphere,
        for the best fit under the energy metric.
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
    found = []
    errors = [_errors(reference, parameters, entry) for entry in candidates]
    for row, given in enumerate(parameters.tolist()):
        answers = [columns[:, row].tolist() for columns in errors]
        pairs = [
            (entry, _ANY_PARAMETER if np.isnan(answer[0]) else answer[0])
            for entry, answer in zip(candidates, answers, strict=True)
        ]
        times = [
            evaluation_times(pairs, precision, sizes.angles, sizes.rounds, advance)
            for precision in PRECISIONS
        ]
        found += [
            Substitute(
                reference=reference.name,
                reference_parameter=given,
                distribution=entry.name,
                operations=entry.operations,
                parameter=answer[0],
                rmse=answer[1],
                max_error=answer[2],
                energy_error=answer[3],
                ns=dict(zip(PRECISIONS, both, strict=True)),
            )
            for entry, answer, *both in zip(candidates, answers, *times, strict=True)
        ]
    return found


def count_steps(parameters: int, sizes: Sizes) -> int:
    """Return how often `substitutes` advances for a number of parameters."""
    return parameters * len(PRECISIONS) * (sizes.rounds + 1)


def evaluation_times(
    pairs: Sequence[tuple[Distribution, float]],
    precision: str,
    angles: int,
    rounds: int,
    advance: Advance = lambda steps: None,
) -> list[Spread]:
    """Return the nanoseconds an evaluation of unit forms takes, measured in turns.

    Parameters
    ----------
    pairs : sequence of (Distribution, float)
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
        str(place): _evaluation(entry, parameter, beta)
        for place, (entry, parameter) in enumerate(pairs)
    }
    times = interleave(functions, rounds, advance)
    return [spread(1e9 * samples / angles) for samples in times.values()]


def _evaluation(entry: Distribution, parameter: float, beta: Array) -> Callable[[], object]:
    return lambda: entry.unit(beta, parameter)


def best(
    source: Distribution, parameter: Array, target: Distribution, measure: Metric
) -> tuple[Array, Array, Array]:
    """Return the best fits of a target, and the error that they leave under the metric.

    Parameters
    ----------
    source, target : Distribution
        The reference, and what takes its place.
    parameter : numpy.ndarray, shape (n,)
        Legal parameters of the source.
    measure : Metric
        Under which is fitted and compared.

    Returns
    -------
    parameter, rmse, max_error : numpy.ndarray, shape (n,)
        NaN where there is no best fit; the parameter itself, and no error, for the source.
    """
    if same_family(source, target):
        return parameter, np.zeros_like(parameter), np.zeros_like(parameter)
    result = fit(source, parameter, target, measure).parameter
    there = ~np.isnan(result)
    errors = np.full((2, parameter.size), np.nan)
    errors[:, there] = residual(source, parameter[there], target, result[there], measure)
    return result, errors[0], errors[1]


def _errors(source: Distribution, parameter: Array, target: Distribution) -> Array:
    """Return parameter, RMSE, maximum and energy error, shape (4, n)."""
    columns = best(source, parameter, target, metric("unit"))
    return np.stack([*columns, _energy_error(source, parameter, target)])


def _energy_error(source: Distribution, parameter: Array, target: Distribution) -> Array:
    measure = metric("energy")
    result, *_ = best(source, parameter, target, measure)
    beta, weight, wanted, peak = hemisphere(source, parameter, measure)
    got = measure.signal_of(target, beta, result[:, None], peak)
    share: Array = np.sqrt(
        np.sum(weight * np.square(got - wanted), axis=1)
        / np.sum(weight * np.square(wanted), axis=1)
    )
    return share
