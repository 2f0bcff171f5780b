"""Conversion of a parameter from one distribution to another.

A new method is a module that defines ``METHOD``, and one line in `_MODULES`.
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from typing import Any, TypeAlias

import numpy as np

from mdfconv.conversion.endpoint import Endpoint, endpoint, same_family
from mdfconv.conversion.method import Method
from mdfconv.conversion.residual import residual
from mdfconv.distributions.base import AnisotropicDistribution
from mdfconv.distributions.evaluation import Array, as_operand
from mdfconv.distributions.parameter import number_text
from mdfconv.errors import MdfconvError, check_name, unknown_name
from mdfconv.fitting.metrics import Metric
from mdfconv.fitting.metrics import metric as find_metric

__all__ = ["DEFAULT_METHOD", "Conversion", "convert", "explain", "find_method", "list_methods"]

DEFAULT_METHOD = "closed-form"
_MODULES = ("closed_form", "half_angle", "ward", "peak", "least_squares")
_ALL: tuple[Method, ...] = tuple(
    import_module(f"{__name__}.{module}").METHOD for module in _MODULES
)
_BY_NAME = {entry.name: entry for entry in _ALL}

Value: TypeAlias = float | tuple[float, float]


@dataclass(frozen=True)
class Conversion:
    """One converted value, with its error and what a careful user must know.

    Parameters
    ----------
    source, target : str
        Distribution and encoding, such as ``"ggx:roughness"``.
    value, result : float or tuple of two floats
        What was converted, and to what; a pair for an anisotropic surface.
    method, metric : str
        The method used, and the metric of the errors (and of the method, if it is "fit").
    route : tuple of str
        The formulas or conditions applied, in order.
    rmse, max_error : float
        Root mean square and maximum difference, in the metric and relative to the source's
        peak, on β from 0 to 4.8 β_half of the source, at most π/2; for a pair those of the
        worse axis.
    cautions : tuple of str
        What this value in particular calls for.
    notes : tuple of str
        The cautions, what the method keeps, and the route.
    """

    source: str
    target: str
    value: Value
    result: Value
    method: str
    metric: str
    route: tuple[str, ...]
    rmse: float
    max_error: float
    cautions: tuple[str, ...]
    notes: tuple[str, ...]


def list_methods() -> tuple[Method, ...]:
    """Return every conversion method, the default first."""
    return _ALL


def find_method(name: str) -> Method:
    """Return the method with a given name.

    Raises
    ------
    MdfconvError
        If the name is not known; the message offers the nearest ones.
    """
    key = check_name("method", name).strip().lower().replace("_", "-")
    if key not in _BY_NAME:
        raise unknown_name("method", name, list(_BY_NAME))
    return _BY_NAME[key]


def convert(
    values: Any,
    source: str | Endpoint,
    target: str | Endpoint,
    method: str = DEFAULT_METHOD,
    *,
    metric: str | Metric = "unit",
    exposure: float = 1.0,
    gamma: float | None = None,
) -> Any:
    """Convert a parameter from one distribution to another.

    Parameters
    ----------
    values : array_like or tuple of two array_like
        Parameters of the source; a tuple (x, y) is the pair of an anisotropic surface.
    source, target : str
        Distribution, with an encoding after a colon: ``"ggx:roughness"`` (α = r²),
        ``"ggx:glossiness"`` (α = (1−g)²).
    method : str
        ``"closed-form"``, ``"half-angle"``, ``"ward"``, ``"peak"`` or ``"fit"``.
    metric : str or Metric
        What ``"fit"`` keeps: ``"unit"`` (the shape of the lobe), ``"energy"`` (the light) or
        ``"display"`` (the picture on a screen).
    exposure : float
        Exposure of the display metric; 1 puts the source's peak at white.
    gamma : float, optional
        γ of GTR on either side, 2 if not given.

    Returns
    -------
    float, numpy.ndarray or tuple
        Parameters of the target, in the shape and the floating type of the values.

    Raises
    ------
    MdfconvError
        If a name is unknown, a value illegal, the pair not covered by the method, or a
        result outside the target's legal range. It is a ValueError.

    Examples
    --------
    >>> convert(0.2, "beckmann", "ggx")
    0.23552
    >>> convert([100, 1000], "blinn-phong", "ggx", method="half-angle").round(4)
    array([0.1794, 0.0577])
    """
    sides = endpoint(source, gamma), endpoint(target, gamma)
    rule, measure = find_method(method), find_metric(metric, exposure)
    if isinstance(values, tuple):
        _check_pair(values, *sides)
        return tuple(convert(axis, *sides, rule.name, metric=measure) for axis in values)
    operand = as_operand(values)
    parameter = sides[0].decode(operand)
    result = sides[1].encode(_apply(rule, measure, parameter, *sides))
    if isinstance(operand, float):
        return float(result)
    dtype = operand.dtype if operand.dtype.kind == "f" else np.dtype(np.float64)
    with np.errstate(over="ignore"):
        cast = result.astype(dtype)
    if not np.isfinite(cast).all():
        raise MdfconvError(f"a result is too large for {dtype.name}: convert in float64")
    return cast[()]


def explain(
    values: Any,
    source: str | Endpoint,
    target: str | Endpoint,
    method: str = DEFAULT_METHOD,
    *,
    metric: str | Metric = "unit",
    exposure: float = 1.0,
    gamma: float | None = None,
    errors: bool = True,
) -> list[Conversion]:
    """Convert, and say for each value by which route, with which error and caveats.

    Parameters
    ----------
    values : number, tuple of two numbers, list of either, or numpy.ndarray
        Parameters of the source; a tuple (x, y) is the pair of an anisotropic surface.
    source, target, method, metric, exposure, gamma
        As for `convert`.
    errors : bool
        False saves the cost of `rmse` and `max_error`, which are then NaN.

    Returns
    -------
    list of Conversion
        One for each value.

    Raises
    ------
    MdfconvError
        As `convert`.
    """
    sides = endpoint(source, gamma), endpoint(target, gamma)
    rule, measure = find_method(method), find_metric(metric, exposure)
    items = values if isinstance(values, list) else [values]
    if isinstance(values, np.ndarray):
        items = as_operand(values).ravel().tolist()
    axes = [item if isinstance(item, tuple) else (item,) for item in items]
    for axis in axes:
        if len(axis) != 1:
            _check_pair(axis, *sides)
        if any(np.ndim(as_operand(value)) for value in axis):
            raise MdfconvError("explain takes numbers and pairs of numbers, not arrays in a list")
    parameter = sides[0].decode([value for axis in axes for value in axis])
    result = _apply(rule, measure, parameter, *sides)
    stored = sides[1].encode(result).tolist()
    left = (np.full_like(result, np.nan),) * 2
    if errors:
        left = residual(sides[0].distribution, parameter, sides[1].distribution, result, measure)
    route = _route(rule, *sides)
    found = []
    start = 0
    for axis in axes:
        rows = slice(start, start + len(axis))
        start += len(axis)
        found.append(
            Conversion(
                source=sides[0].label,
                target=sides[1].label,
                value=_value([float(entry) for entry in axis]),
                result=_value(stored[rows]),
                method=rule.name,
                metric=measure.name,
                route=route,
                rmse=float(left[0][rows].max()),
                max_error=float(left[1][rows].max()),
                **_remarks(rule, measure, parameter[rows], result[rows], *sides, route),
            )
        )
    return found


def _remarks(
    rule: Method,
    measure: Metric,
    parameter: Array,
    result: Array,
    source: Endpoint,
    target: Endpoint,
    route: tuple[str, ...],
) -> dict[str, tuple[str, ...]]:
    """Return the cautions and notes of one conversion, for `Conversion`."""
    pair = source.distribution, target.distribution
    by = (f"by {', '.join(route)}",) if route else ()
    if same_family(*pair) or rule.is_exact(*pair):
        return {"cautions": (), "notes": ("exact: the same form", *by)}
    axes = zip(parameter.tolist(), result.tolist(), strict=True)
    found = [caution for axis in axes for caution in rule.cautions(*axis, *pair)]
    cautions = tuple(dict.fromkeys(found))
    return {"cautions": cautions, "notes": (*cautions, f"keeps the {rule.keeps(measure)}", *by)}


def _value(axes: list[float]) -> Value:
    return (axes[0], axes[1]) if len(axes) > 1 else axes[0]


def _route(rule: Method, source: Endpoint, target: Endpoint) -> tuple[str, ...]:
    steps = [side.encoding.formula if side.encoding else "" for side in (source, target)]
    same = same_family(source.distribution, target.distribution)
    middle = () if same else rule.route(source.distribution, target.distribution) or ()
    return tuple(step for step in (steps[0], *middle, steps[1]) if step)


def _apply(
    rule: Method, measure: Metric, parameter: Array, source: Endpoint, target: Endpoint
) -> Array:
    """Convert legal parameters; raise unless every result is legal and can be stored."""
    if same_family(source.distribution, target.distribution):
        result = parameter
    else:
        _check_covered(rule, source, target)
        with np.errstate(all="ignore"):
            result = np.asarray(
                rule.convert(parameter, source.distribution, target.distribution, measure)
            )
    accepted = target.distribution.parameter.accepts(result) & ~np.isnan(target.encode(result))
    if not accepted.all():
        index = int(np.argmin(accepted))
        raise _unreachable(rule, measure, parameter, result, index, source, target)
    return result


def _check_covered(rule: Method, source: Endpoint, target: Endpoint) -> None:
    pair = source.distribution, target.distribution
    if rule.route(*pair) is None:
        others = [entry.name for entry in _ALL if entry.route(*pair) is not None]
        raise MdfconvError(
            f"{rule.name} has no conversion from {_name(source)} to {_name(target)}; "
            f"use {' or '.join(others)}"
        )


def _check_pair(axes: tuple[Any, ...], source: Endpoint, target: Endpoint) -> None:
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


def _unreachable(
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
    legal = wanted.legal
    outcome = f"gives {_name(target)} {wanted.symbol} = {number_text(got)}"
    if np.isnan(got):
        outcome = f"has no answer in {_name(target)}"
    elif wanted.accepts(np.asarray(got)):
        legal = target.stored.legal
        outcome += f", which {target.label} cannot store"
    answers = []
    for other in _ALL:
        if other is rule or other.route(source.distribution, target.distribution) is None:
            continue
        one = np.asarray([given])
        with np.errstate(all="ignore"):
            answer = target.encode(
                other.convert(one, source.distribution, target.distribution, measure)
            )
        if target.stored.accepts(answer)[0]:
            answers.append(f"{other.name} answers {number_text(float(answer[0]))}")
    return MdfconvError(
        f"for {start} = {number_text(given)}{which} {rule.name} {outcome}, outside {legal}; "
        + (" and ".join(answers) or "no method answers")
    )
