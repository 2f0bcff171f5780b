"""What cannot be converted, and why: the refusals, in the words the user reads."""

from __future__ import annotations

from typing import Any

import numpy as np

from mdfconv.conversion.endpoint import Endpoint
from mdfconv.conversion.method import Method
from mdfconv.conversion.registry import list_methods
from mdfconv.distributions.base import AnisotropicDistribution
from mdfconv.distributions.evaluation import Array
from mdfconv.distributions.parameter import number_text
from mdfconv.errors import MdfconvError
from mdfconv.fitting.metrics import Metric


def check_covered(rule: Method, measure: Metric, source: Endpoint, target: Endpoint) -> None:
    """Raise unless a method has a conversion for a pair under a metric."""
    pair = source.distribution, target.distribution
    if not rule.covers_metric(measure):
        raise MdfconvError(f"{rule.name} has the {measure.name} metric at exposure 1 only; use fit")
    if rule.route(*pair) is None:
        others = [entry.name for entry in list_methods() if entry.route(*pair) is not None]
        raise MdfconvError(
            f"{rule.name} has no conversion from {_name(source)} to {_name(target)}; "
            f"use {' or '.join(others)}"
        )


def check_pair(axes: tuple[Any, ...], source: Endpoint, target: Endpoint) -> None:
    """Raise unless a pair of parameters is one, and both sides take it."""
    if len(axes) != 2:
        raise MdfconvError(f"a pair of parameters has two members, not {len(axes)}")
    for side in (source, target):
        if not isinstance(side.distribution, AnisotropicDistribution):
            hint = "; use ashikhmin-shirley" if side.distribution.name == "blinn-phong" else ""
            raise MdfconvError(
                f"{side.distribution.name} is isotropic: it takes one parameter, not a pair{hint}"
            )


def _name(side: Endpoint) -> str:
    gamma = getattr(side.distribution, "gamma", None)
    return side.distribution.name + (f" (γ = {number_text(gamma)})" if gamma else "")


def unreachable(
    rule: Method,
    measure: Metric,
    parameter: Array,
    result: Array,
    index: int,
    source: Endpoint,
    target: Endpoint,
) -> MdfconvError:
    """Return the error for a result that is illegal, naming the methods that answer."""
    given, got = (float(array.flat[index]) for array in (parameter, result))
    wanted = target.distribution.parameter
    which = f" (value {index + 1} of {parameter.size})" if parameter.size > 1 else ""
    start = f"{source.distribution.name} {source.distribution.parameter.symbol}"
    legal = f", outside {wanted.legal}"
    outcome = f"gives {_name(target)} {wanted.symbol} = {number_text(got)}"
    if np.isnan(got):
        outcome = f"has no answer in {_name(target)}"
        covered = rule.range_text(source.distribution, target.distribution, measure)
        legal = f": it covers {covered}" if covered else legal
    elif wanted.accepts(np.asarray(got)):
        legal = f", outside {target.stored.legal}"
        outcome += f", which {target.label} cannot store"
    answers = []
    for other in list_methods():
        pair = source.distribution, target.distribution
        if other is rule or other.route(*pair) is None or not other.covers_metric(measure):
            continue
        one = np.asarray([given])
        with np.errstate(all="ignore"):
            answer = target.encode(
                other.convert(one, source.distribution, target.distribution, measure)
            )
        if target.stored.accepts(answer)[0]:
            answers.append(f"{other.name} answers {number_text(float(answer[0]))}")
    return MdfconvError(
        f"for {start} = {number_text(given)}{which} {rule.name} {outcome}{legal}; "
        + (" and ".join(answers) or "no method answers")
    )
