"""The numbers of Mitsuba's distributions: converted, with the errors that remain, many at once."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from mdfconv.conversion.endpoint import Endpoint, endpoints
from mdfconv.conversion.methods import default_method
from mdfconv.conversion.remaining_error import remaining_error
from mdfconv.distributions.evaluation import Array
from mdfconv.fitting.interpolation import errors_of_many
from mdfconv.fitting.metrics import Metric

# From parameters of the source to those of the target, NaN where there are none.
_Rule = Callable[[Array], Array]


@dataclass(frozen=True)
class ValueTable:
    """What becomes of the numbers that a scene has for one distribution.

    Parameters
    ----------
    legal : frozenset of float
        Those in the distribution's range.
    result, rmse : dict of float to float
        α of the target, and the error that remains, for those that have an answer.
    """

    legal: frozenset[float]
    result: dict[float, float]
    rmse: dict[float, float]


def converted_values(
    numbers: Iterable[float], source: str, target: str, metric: Metric
) -> ValueTable:
    """Convert the numbers of a distribution by the fit under a metric.

    Parameters
    ----------
    numbers : iterable of float
        Each once; those that are illegal have no result.
    source, target : str
        As for `mdfconv.convert`, of two lobes that are not the same; the target without an
        encoding.
    metric : Metric
        What the fit keeps.

    Returns
    -------
    ValueTable
        The results and their errors.
    """
    ends = endpoints(source, target)
    pair = ends[0].distribution, ends[1].distribution
    method = default_method(*pair)
    return _table(numbers, *ends, metric, lambda x: method.convert(x, *pair, metric))


def kept_values(numbers: Iterable[float], source: str, target: str, metric: Metric) -> ValueTable:
    """Take the numbers of one distribution for those of another, as `converted_values`."""
    ends = endpoints(source, target)
    return _table(numbers, *ends, metric, ends[0].encode)


def _table(
    numbers: Iterable[float], source: Endpoint, target: Endpoint, metric: Metric, rule: _Rule
) -> ValueTable:
    values = np.array(sorted(numbers), dtype=np.float64)
    with np.errstate(all="ignore"):
        parameter = source.decode_legal(values)
    legal = ~np.isnan(parameter)
    result = np.full_like(values, np.nan)
    result[legal] = _answers(rule, parameter[legal], target)

    def errors(parameter: Array) -> Array:
        answers = _answers(rule, parameter, target)
        found, known = np.full_like(parameter, np.nan), ~np.isnan(answers)
        pair = source.distribution, target.distribution
        found[known], _ = remaining_error(
            pair[0], parameter[known], pair[1], answers[known], metric
        )
        return found

    answered = ~np.isnan(result)
    keys, found = values[answered].tolist(), result[answered].tolist()
    rmse = errors_of_many(errors, parameter[answered]).tolist()
    return ValueTable(
        frozenset(values[legal].tolist()),
        dict(zip(keys, found, strict=True)),
        dict(zip(keys, rmse, strict=True)),
    )


def _answers(rule: _Rule, parameter: Array, target: Endpoint) -> Array:
    with np.errstate(all="ignore"):
        result = rule(parameter)
    return np.where(target.distribution.parameter.accepts(result), result, np.nan)
