"""Roughness factors from one stored form to another, each with an answer or a reason for none."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from mdfconv.conversion import convert
from mdfconv.conversion.explanation import remaining_error
from mdfconv.distributions.endpoint import Endpoint, endpoints
from mdfconv.distributions.evaluation import Array, Mask
from mdfconv.distributions.parameter import number_text
from mdfconv.errors import MdfconvError
from mdfconv.fitting.metrics import Metric
from mdfconv.fitting.solve import errors_of_many

# An exponent below this is that of a uniform lobe: the best roughness is 1 − 2e-7.
_UNIFORM = 1e-6


@dataclass
class FactorAnswers:
    """What becomes of factors, by their positions.

    Parameters
    ----------
    parameter : numpy.ndarray, shape (n,)
        What the source means by each: 0 for a uniform lobe of an exponent, NaN where it means
        nothing.
    result : numpy.ndarray, shape (n,)
        What the target stores for it, from 0 to 1; NaN where there is nothing.
    rmse : numpy.ndarray, shape (n,)
        The relative root mean square of `remaining_error`; 0 for mirrors, NaN for uniform lobes,
        of which there is no relative error.
    notes, problems : dict of int to str
        What a careful user must know, and why there is no answer.
    """

    parameter: Array
    result: Array
    rmse: Array
    notes: dict[int, str] = field(default_factory=dict)
    problems: dict[int, str] = field(default_factory=dict)


def factor_endpoints(source: str | Endpoint, target: str | Endpoint) -> tuple[Endpoint, Endpoint]:
    """Return both ends of a conversion of factors, which are at most 1.

    Raises
    ------
    MdfconvError
        If a name is not known, or what it stands for is used beyond 1, as an exponent is.
    """
    ends = endpoints(source, target)
    for end in ends:
        if end.stored.typical[1] > 1:
            raise MdfconvError(
                f"a roughness factor is at most 1, {end.label} is more as a rule",
                "name what the program stores (mdfconv list --encodings)",
            )
    return ends


def convert_factors(
    values: Array, source: Endpoint, target: Endpoint, metric: Metric
) -> FactorAnswers:
    """Convert factors.

    Parameters
    ----------
    values : numpy.ndarray, shape (n,)
        Different factors from 0 to 1, in order.
    source, target : Endpoint
        As `factor_endpoints` returns them.
    metric : Metric
        What the fit keeps.

    Returns
    -------
    FactorAnswers
        A uniform lobe becomes the target's roughest number, a mirror its smoothest; what the
        source clamps, or does not store, has no answer.
    """
    uniform, mirror, ordinary = _sorted_out(values, source)
    answers = FactorAnswers(source.decode_legal(values), *np.full((2, values.size), np.nan))
    symbol = source.stored.symbol
    smoothest = float(target.stored.larger_is_smoother)
    for which, result, what in (
        (uniform, 1 - smoothest, "a uniform lobe"),
        (mirror, smoothest, "a mirror"),
    ):
        answers.result[which] = result
        for at in np.flatnonzero(which).tolist():
            text = f"{symbol} = {number_text(values[at])} is {what}"
            answers.notes[at] = f"{text}: {number_text(result)}"
    answers.rmse[mirror] = 0
    answers.parameter[uniform] = 0
    places = np.flatnonzero(ordinary)
    results, answers.problems = _results(values[places], places.tolist(), source, target, metric)
    answers.result[places] = results
    for at in np.flatnonzero(~(uniform | mirror | ordinary)).tolist():
        answers.problems[at] = _refusal(values[at], source)
    lobes = ordinary & ~np.isnan(answers.result)
    answers.rmse[lobes] = _errors(values[lobes], answers, lobes, source, target, metric)
    return answers


def _sorted_out(values: Array, source: Endpoint) -> tuple[Mask, Mask, Mask]:
    """Return which factors are uniform lobes, mirrors, and lobes that can be converted."""
    stored, parameter = source.stored, source.distribution.parameter
    decoded = values
    clamped = np.zeros(values.shape, bool)
    if source.encoding:
        clamped = source.encoding.clamped(values)
        with np.errstate(all="ignore"):
            decoded = source.encoding.decode(values)
    uniform = ~clamped & parameter.larger_is_smoother & (np.abs(decoded) < _UNIFORM)
    smoothest, end = (1, stored.upper) if stored.larger_is_smoother else (0, stored.lower)
    mirror = ~clamped & ~stored.accepts(values) & (values == smoothest) & (end == smoothest)
    with np.errstate(all="ignore"):
        legal = ~np.isnan(source.decode_legal(values))
    return uniform, mirror & ~uniform, legal & ~uniform


def _refusal(value: float, source: Endpoint) -> str:
    """Return why a factor stands for no parameter."""
    try:
        source.decode(value)
    except MdfconvError as error:
        return str(error)
    return f"{source.label} {source.stored.symbol} = {number_text(value)} has no answer"


def _results(
    values: Array, places: list[int], source: Endpoint, target: Endpoint, metric: Metric
) -> tuple[Array, dict[int, str]]:
    """Return conversions, NaN where there is none, and at which places that is, and why."""
    if not values.size:
        return values, {}
    try:
        results = convert(values, source, target, metric=metric)
    except MdfconvError as error:
        # The message is about one value: the others have answers.
        if values.size == 1:
            return np.full(1, np.nan), {places[0]: error.reason}
        half = values.size // 2
        ends = source, target, metric
        first, second = (
            _results(values[part], places[part], *ends)
            for part in (slice(None, half), slice(half, None))
        )
        return np.concatenate([first[0], second[0]]), first[1] | second[1]
    beyond = results > 1
    problems = {
        places[at]: f"{target.label} would be {number_text(results[at])}, above 1"
        for at in np.flatnonzero(beyond).tolist()
    }
    return np.where(beyond, np.nan, results), problems


def _errors(
    values: Array,
    answers: FactorAnswers,
    which: Mask,
    source: Endpoint,
    target: Endpoint,
    metric: Metric,
) -> Array:
    """Return the errors that lobes keep; of many from those of some."""
    if values.min(initial=1.0) <= 0:
        return _error(answers.parameter[which], answers.result[which], source, target, metric)

    def error(values: Array) -> Array:
        results, _ = _results(values, [0] * values.size, source, target, metric)
        return _error(source.decode_legal(values), results, source, target, metric)

    return errors_of_many(error, values)


def _error(
    parameter: Array, result: Array, source: Endpoint, target: Endpoint, metric: Metric
) -> Array:
    exponents = source.distribution.parameter.larger_is_smoother
    lobes = np.maximum(parameter, _UNIFORM) if exponents else parameter
    stored = target.decode_legal(result)
    # What the target clamps is no particular lobe.
    known = ~np.isnan(stored)
    rmse = np.full(stored.shape, np.nan)
    rmse[known], _ = remaining_error(
        source.distribution, lobes[known], target.distribution, stored[known], metric
    )
    return rmse
