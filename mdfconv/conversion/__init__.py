"""Conversion of a parameter from one distribution to another."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from mdfconv.conversion.checks import check_covered, check_pair, unreachable
from mdfconv.conversion.endpoint import Endpoint, endpoint, same_family
from mdfconv.conversion.method import Method
from mdfconv.conversion.registry import DEFAULT_METHOD, find_method, list_methods
from mdfconv.distributions.evaluation import Array, as_operand
from mdfconv.distributions.parameter import number_text
from mdfconv.errors import MdfconvError, MdfconvWarning
from mdfconv.fitting.metrics import Metric
from mdfconv.fitting.metrics import metric as find_metric

__all__ = ["DEFAULT_METHOD", "Conversion", "convert", "explain", "find_method", "list_methods"]

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
        ``"closed-form"``, ``"half-angle"``, ``"ward"``, ``"peak"``, ``"fit"`` or ``"fast"``,
        which is the fit within 1e-6 (display: 1e-4) at the price of a closed form.
    metric : str or Metric
        What ``"fit"`` and ``"fast"`` keep: ``"unit"`` (the shape of the lobe), ``"energy"``
        (the light) or ``"display"`` (the picture on a screen).
    exposure : float
        Exposure of the display metric; 1 puts the source's peak at white.
    gamma : float, optional
        γ of GTR on either side, 2 if not given.

    Returns
    -------
    float, numpy.ndarray or tuple
        Parameters of the target, in the shape and the floating type of the values. With
        ``"fast"`` elements of an array that are illegal or outside its range are NaN.

    Raises
    ------
    MdfconvError
        If a name is unknown, a value illegal, the pair not covered by the method, or a
        result outside the target's legal range. It is a ValueError.

    Warns
    -----
    MdfconvWarning
        Once, if elements of an array came back as NaN.

    Examples
    --------
    >>> convert(0.2, "beckmann", "ggx")
    0.23552
    >>> convert([100, 1000], "blinn-phong", "ggx", method="half-angle").round(4)
    array([0.1794, 0.0577])
    """
    sides = endpoint(source, gamma), endpoint(target, gamma)
    rule, measure = find_method(method), find_metric(metric, exposure)
    if not isinstance(values, tuple):
        return _convert(as_operand(values), rule, measure, *sides)
    check_pair(values, *sides)
    x, y = (as_operand(axis) for axis in values)
    try:
        np.broadcast_shapes(np.shape(x), np.shape(y))
    except ValueError:
        raise MdfconvError(f"shapes {np.shape(x)} and {np.shape(y)} are not a pair") from None
    return _convert(x, rule, measure, *sides), _convert(y, rule, measure, *sides)


def _convert(
    operand: Any, rule: Method, measure: Metric, source: Endpoint, target: Endpoint
) -> Any:
    """Convert an operand, in its shape and floating type."""
    sides = source, target
    if rule.gaps_as_nan and np.ndim(operand):
        result = _apply_with_gaps(rule, measure, operand, *sides)
    else:
        result = sides[1].encode(_apply(rule, measure, sides[0].decode(operand), *sides))
    if isinstance(operand, float):
        return float(result)
    dtype = operand.dtype if operand.dtype.kind == "f" else np.dtype(np.float64)
    with np.errstate(over="ignore"):
        cast = result.astype(dtype)
    if np.isinf(cast).any():
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
            check_pair(axis, *sides)
        if any(np.ndim(as_operand(value)) for value in axis):
            raise MdfconvError("explain takes numbers and pairs of numbers, not arrays in a list")
    parameter = sides[0].decode([value for axis in axes for value in axis])
    result = _apply(rule, measure, parameter, *sides)
    stored = sides[1].encode(result).tolist()
    left = (np.full_like(result, np.nan),) * 2
    if errors:
        left = rule.residual(
            parameter, sides[0].distribution, result, sides[1].distribution, measure
        )
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
        check_covered(rule, measure, source, target)
        with np.errstate(all="ignore"):
            result = np.asarray(
                rule.convert(parameter, source.distribution, target.distribution, measure)
            )
    accepted = target.distribution.parameter.accepts(result) & ~np.isnan(target.encode(result))
    if not accepted.all():
        index = int(np.argmin(accepted))
        raise unreachable(rule, measure, parameter, result, index, source, target)
    return result


def _apply_with_gaps(
    rule: Method, measure: Metric, operand: Array, source: Endpoint, target: Endpoint
) -> Array:
    """Convert an array; NaN, with one warning, where there is no answer."""
    same = same_family(source.distribution, target.distribution)
    if not same:
        check_covered(rule, measure, source, target)
    given = np.asarray(operand, dtype=np.float64)
    with np.errstate(all="ignore"):
        parameter = source.decode_legal(given)
        result = parameter
        if not same:
            result = rule.convert(parameter, source.distribution, target.distribution, measure)
    stored = target.encode(result)
    answered = target.distribution.parameter.accepts(result) & ~np.isnan(stored)
    if answered.all():
        return stored
    first = int(np.argmin(answered))
    missing = answered.size - int(np.count_nonzero(answered))
    warnings.warn(
        f"{missing} of {given.size} values have no answer by {rule.name} from {source.label} to "
        f"{target.label} and are NaN, the first is {number_text(float(given.flat[first]))}",
        MdfconvWarning,
        stacklevel=4,
    )
    return np.where(answered, stored, np.nan)
