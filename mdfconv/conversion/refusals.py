"""What cannot be converted, and why, in the words the user reads."""

from __future__ import annotations

from typing import Any

import numpy as np

from mdfconv.conversion.endpoint import Endpoint
from mdfconv.conversion.method import Method
from mdfconv.conversion.methods import list_methods
from mdfconv.distributions import list_distributions
from mdfconv.distributions.evaluation import Array
from mdfconv.distributions.parameter import number_text
from mdfconv.errors import MdfconvError
from mdfconv.fitting.metrics import Metric


def check_covered(method: Method, metric: Metric, source: Endpoint, target: Endpoint) -> None:
    """Raise unless a method has a conversion for a pair under a metric."""
    pair = source.distribution, target.distribution
    if method.route(*pair) is None:
        others = [other.name for other in list_methods() if other.route(*pair) is not None]
        raise MdfconvError(
            f"{method.name} has no conversion from {pair[0].label} to {pair[1].label}",
            f"use {' or '.join(others)}",
        )
    if not method.covers(*pair, metric):
        raise MdfconvError(
            f"{method.name} has no conversion stored from {pair[0].label} to {pair[1].label} "
            f"under the {metric} metric",
            "use fit",
        )


def check_pair(axes: tuple[Any, ...], source: Endpoint, target: Endpoint) -> None:
    """Raise unless a pair of parameters is one, and both ends take it."""
    if len(axes) != 2:
        raise MdfconvError(f"a pair of parameters has two members, not {len(axes)}")
    for end in (source, target):
        mdf = end.distribution
        if not mdf.anisotropic:
            others = [
                other.name
                for other in list_distributions()
                if other.anisotropic and other.equivalent and other.equivalent.name == mdf.name
            ]
            raise MdfconvError(
                f"{mdf.name} is isotropic: it takes one parameter, not a pair",
                f"use {others[0]}" if others else "",
            )


def unreachable(
    method: Method,
    metric: Metric,
    parameter: Array,
    result: Array,
    index: int,
    source: Endpoint,
    target: Endpoint,
) -> MdfconvError:
    """Return the error for a result that is illegal, naming the methods that answer."""
    pair = source.distribution, target.distribution
    value, outcome = (float(array.flat[index]) for array in (parameter, result))
    limits = pair[1].parameter
    which = f" (value {index + 1} of {parameter.size})" if parameter.size > 1 else ""
    start = f"for {pair[0].name} {pair[0].parameter.symbol} = {number_text(value)}{which}"
    if np.isnan(outcome):
        covered = method.range_text(*pair, metric)
        why = f"has no answer in {pair[1].label}"
        why += f": it covers {covered}" if covered else f", outside {limits.legal}"
    else:
        why = f"gives {pair[1].label} {limits.symbol} = {number_text(outcome)}"
        storable = limits.accepts(np.asarray(outcome))
        why += f", which {target.label} cannot store" if storable else ""
        why += f", outside {target.stored.legal if storable else limits.legal}"
    answers = _answers(method, metric, value, source, target)
    if not answers:
        return MdfconvError(f"{start} {method.name} {why}", "no method answers")
    return MdfconvError(f"{start} {method.name} {why}", answers, argument="method")


def _answers(
    refused: Method, metric: Metric, value: float, source: Endpoint, target: Endpoint
) -> str:
    """Return what the other methods make of a value, in words."""
    pair = source.distribution, target.distribution
    answers: list[str] = []
    for method in list_methods():
        if method.name == refused.name or not method.covers(*pair, metric):
            continue
        with np.errstate(all="ignore"):
            stored = target.encode(method.convert(np.asarray([value]), *pair, metric))
        if target.stored.accepts(stored)[0]:
            verb = "" if answers else " answers"
            answers.append(f"{method.name}{verb} {number_text(float(stored[0]))}")
    return ", ".join(answers)
