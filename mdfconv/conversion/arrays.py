"""`convert`: arrays of parameters from one distribution to another."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable
from typing import Any, Literal, TypeAlias

import numpy as np

from mdfconv.conversion.methods import Method, default_method, list_methods, method_named
from mdfconv.distributions import list_distributions
from mdfconv.distributions.endpoint import Endpoint, endpoints
from mdfconv.distributions.equivalence import exact_route, follow
from mdfconv.distributions.evaluation import Array, Mask, as_operand, in_parts, worth_threads
from mdfconv.distributions.parameter import number_text
from mdfconv.errors import MdfconvError, MdfconvWarning
from mdfconv.fitting.metrics import Metric, list_metrics, metric_named


def in_threads(function: Callable[[Any], Array], values: Any, threads: int) -> Array:
    """Return an elementwise function of a large array, computed in parts by threads.

    Parameters
    ----------
    function : callable
        From an array to one of floats in its shape.
    values : float or numpy.ndarray
        A small array, and a number, is computed at once.
    threads : int
        How many run at a time, from 1.

    Raises
    ------
    MdfconvError
        If the number of threads makes no sense, or as the function does for all of the values.
    """
    size = np.size(values)
    if not worth_threads(size, threads):
        return function(values)
    flat, result = values.reshape(-1), np.empty(size)

    def compute(low: int, high: int) -> None:
        result[low:high] = function(flat[low:high])

    try:
        in_parts(compute, size, threads)
    except MdfconvError:
        # What is wrong is said of all the values, not of a part.
        return function(values)
    return result.reshape(values.shape)


# So many are looked at sooner than their ends are found.
_FEW = 16


def cautions_of(
    method: Method,
    parameter: Array,
    result: Array,
    stored: Array,
    source: Endpoint,
    target: Endpoint,
) -> dict[str, Mask]:
    """Return sentences, and which of some conversions they are true of.

    Parameters
    ----------
    method : Method
        By which they were made, unless both lobes are the same.
    parameter, result : numpy.ndarray, shape (n,)
        Parameters of the source and the target.
    stored : numpy.ndarray, shape (n,)
        The results as the target stores them.
    source, target : Endpoint
        The ends of the conversions.
    """
    every = np.ones(parameter.shape, bool)
    cautions = {end.caution: every for end in (source, target) if end.caution}
    for text, which in target.clamped(stored).items():
        cautions[f"{target.label} clamps: {text}"] = which
    pair = source.distribution, target.distribution
    if exact_route(*pair) is None:
        cautions |= method.cautions(parameter, result, *pair)
    return cautions


def warn_of(
    method: Method,
    conversions: Iterable[tuple[Any, Any]],
    source: Endpoint,
    target: Endpoint,
    stacklevel: int,
) -> None:
    """Warn once of all that arrays of conversions call for.

    Only their least and largest numbers are looked at, as what calls for a caution lies beyond a
    limit; and only where there may be a caution.

    Parameters
    ----------
    method, source, target
        As for `cautions_of`.
    conversions : iterable of two array_like
        Stored values and results, in the same shape.
    stacklevel : int
        Of the warning, as `warnings.warn` takes it in the calling function.
    """
    clamps = target.encoding is not None and bool(target.encoding.clamps)
    silent = not method.has_cautions or source.distribution.is_same(target.distribution)
    if silent and not clamps and not source.caution and not target.caution:
        return
    sentences: dict[str, None] = {}
    for values, results in conversions:
        given = _ends(values)
        # A caution about results is about those at the end of a range.
        stored = _ends(results) if clamps or method.follows_metric else given
        with np.errstate(all="ignore"):
            parameter, result = source.decode_legal(given), target.decode_legal(stored)
            cautions = cautions_of(method, parameter, result, stored, source, target)
        sentences |= dict.fromkeys(text for text, which in cautions.items() if which.any())
    if sentences:
        warnings.warn("; ".join(sentences), MdfconvWarning, stacklevel=stacklevel + 1)


def _ends(values: Any) -> Array:
    """Return the least and the largest of numbers, leaving out NaN (float64); few as they are."""
    array = np.asarray(values)
    if array.size < _FEW:
        return array.astype(float).ravel()
    ends = np.array([array.min(), array.max()], float)
    return ends if not np.isnan(ends[0]) else np.array([np.nanmin(array), np.nanmax(array)], float)


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


FREE: Literal["free"] = "free"
Gamma: TypeAlias = float | Literal["free"] | None


def convert(
    values: Any,
    source: str | Endpoint,
    target: str | Endpoint,
    method: str | None = None,
    *,
    metric: str | Metric | None = None,
    gamma: Gamma = None,
    threads: int = 1,
) -> Any:
    """Convert a parameter from one distribution to another.

    Parameters
    ----------
    values : array_like or tuple of two array_like
        Parameters of the source; a tuple (x, y) is the pair of an anisotropic surface.
    source, target : str
        Distribution, with an encoding after a colon: ``"ggx:roughness"`` (α = r²),
        ``"ggx:glossiness"`` (α = (1−g)²).
    method : str, optional
        ``"closed-form"``, ``"half-angle"``, ``"ward"``, ``"peak"``, ``"fit"`` or ``"fast"``,
        which is the fit within 1e-6 (display: 1e-5, at another exposure 1e-4) at the price of a
        closed form. If not given the fit under the metric, by ``"fast"`` where that reaches;
        without a metric the closed form of a pair that has one.
    metric : str or Metric, optional
        What the fit keeps: ``"unit"`` (the shape of the lobe; also if not given), ``"energy"``
        (the light of the sun or a lamp), ``"environment"`` (the light of a natural environment),
        ``"light:FILE"`` (that of an environment map) or ``"display"`` (the picture on a screen;
        ``"display:4"`` at exposure 4, 1 puts the source's peak at white).
    gamma : float or "free", optional
        The second parameter, on either side that has one; its default if not given. ``"free"``
        fits that of the target along with the first.
    threads : int, optional
        How many share the work on an array of a million values or more. The results are the same.

    Returns
    -------
    float, numpy.ndarray or tuple
        Parameters of the target, in the shape and the floating type of the values. With
        ``"fast"`` elements of an array that are illegal or outside its range are NaN. With a
        free γ a tuple: parameters, and γ.

    Raises
    ------
    MdfconvError
        If a name is unknown, a value illegal, the pair not covered by the method, or a
        result outside the target's legal range. It is a ValueError.

    Warns
    -----
    MdfconvWarning
        Once, if elements of an array came back as NaN; and once for what `explain` has as
        cautions, such as that a value is outside the sweep for which the paper's formulas were
        fitted.

    Examples
    --------
    >>> convert(0.2, "beckmann", "ggx")
    0.23552
    >>> convert([100, 1000], "blinn-phong", "ggx", method="half-angle").round(4)
    array([0.1794, 0.0577])
    """
    ends = endpoints(source, target, given_gamma(gamma))
    kept = given_metric(metric)
    rule = chosen_method(method, *ends, gamma, metric_given=metric is not None)
    if not isinstance(values, tuple):
        operand = as_operand(values)
        if isinstance(gamma, str):
            results = apply_free(kept, ends[0].decode(operand), *ends)
            return _like(results[0], operand, ends[1]), _like(results[1], operand)
        answer = _convert(operand, rule, kept, *ends, threads)
        warn_of(rule, [(operand, answer)], *ends, stacklevel=2)
        return answer
    check_pair(values, *ends)
    x, y = (as_operand(axis) for axis in ends[0].axes(values))
    try:
        np.broadcast_shapes(np.shape(x), np.shape(y))
    except ValueError:
        raise MdfconvError(f"shapes {np.shape(x)} and {np.shape(y)} are not a pair") from None
    first = _convert(x, rule, kept, *ends, threads)
    second = _convert(y, rule, kept, *ends, threads)
    warn_of(rule, [(x, first), (y, second)], *ends, stacklevel=2)
    return ends[1].pair(first, second)


def given_gamma(gamma: Gamma) -> float | None:
    """Return γ, None if it is free; raise `MdfconvError` for any other word."""
    if not isinstance(gamma, str):
        return gamma
    if gamma != FREE:
        raise MdfconvError(f"gamma is a number or '{FREE}', not '{gamma}'")
    return None


def given_metric(metric: str | Metric | None) -> Metric:
    """Return the metric that was asked for, or the first one."""
    return metric_named(list_metrics()[0] if metric is None else metric)


def chosen_method(
    name: str | None, source: Endpoint, target: Endpoint, gamma: Gamma, *, metric_given: bool
) -> Method:
    """Return the method that was asked for, or the one that a pair gets without a choice.

    Raises
    ------
    MdfconvError
        If the name is not known, or γ is free and cannot be for the target or the method.
    """
    if not isinstance(gamma, str):
        pair = source.distribution, target.distribution
        if name is None:
            return default_method(*pair, metric_given=metric_given)
        return method_named(name)
    if target.distribution.second_parameter is None:
        raise MdfconvError(f"{target.distribution.name} has one parameter and no γ to fit")
    method = method_named("fit" if name is None else name)
    if method.name != "fit":
        raise MdfconvError(f"{method.name} takes γ as it is", "fit finds it")
    return method


def apply(
    method: Method, metric: Metric, parameter: Array, source: Endpoint, target: Endpoint
) -> Array:
    """Convert legal parameters; raise unless every result is legal and can be stored."""
    result = _results(method, metric, parameter, source, target)
    _check_results(method, metric, parameter, result, source, target)
    return result


def _results(
    method: Method, metric: Metric, parameter: Array, source: Endpoint, target: Endpoint
) -> Array:
    """Convert parameters, exactly where that is possible; NaN where there is no answer."""
    pair = source.distribution, target.distribution
    exact = exact_route(*pair)
    with np.errstate(all="ignore"):
        if exact is not None:
            return np.asarray(follow(exact, parameter))
        check_covered(method, metric, source, target)
        return np.asarray(method.convert(parameter, *pair, metric))


def apply_free(
    metric: Metric, parameter: Array, source: Endpoint, target: Endpoint
) -> tuple[Array, Array, Mask]:
    """Fit both parameters of the target to legal parameters.

    Returns
    -------
    stored, gamma : numpy.ndarray
        The stored values, and γ.
    at_limit : numpy.ndarray of bool
        Where γ is at the end of the range in which it is looked for.
    """
    from mdfconv.fitting.free_gamma import fit_free_gamma

    fits = fit_free_gamma(source.distribution, parameter.ravel(), target.distribution, metric)
    result, gamma = (array.reshape(parameter.shape) for array in (fits.parameter, fits.gamma))
    _check_results(method_named("fit"), metric, parameter, result, source, target)
    return target.encode(result), gamma, fits.at_limit.reshape(parameter.shape)


def _check_results(
    method: Method,
    metric: Metric,
    parameter: Array,
    result: Array,
    source: Endpoint,
    target: Endpoint,
) -> None:
    legal = target.distribution.parameter.accepts(result) & ~np.isnan(target.encode(result))
    if not legal.all():
        index = int(np.argmin(legal))
        raise unreachable(method, metric, parameter, result, index, source, target)


def _convert(
    operand: Any, method: Method, metric: Metric, source: Endpoint, target: Endpoint, threads: int
) -> Any:
    """Convert an operand, in its shape and floating type."""
    with_gaps = method.gaps_as_nan and np.ndim(operand) > 0

    def stored(values: Any) -> Array:
        if with_gaps:
            return _apply_with_gaps(method, metric, values, source, target)
        return target.encode(apply(method, metric, source.decode(values), source, target))

    results = in_threads(stored, operand, threads)
    if with_gaps:
        _warn_of_gaps(method, operand, results, source, target)
    return _like(results, operand, target)


def _like(result: Array, operand: Any, target: Endpoint | None = None) -> Any:
    """Return results in the floating type of the operand that they came from.

    Raises
    ------
    MdfconvError
        If the type rounds one to a number that the target cannot store, such as 0.
    """
    if isinstance(operand, float):
        return float(result)
    dtype = operand.dtype if operand.dtype.kind == "f" else np.dtype(np.float64)
    with np.errstate(over="ignore", under="ignore"):
        # Without a copy of a large array, unless it would be the caller's own.
        cast = result.astype(dtype, copy=np.may_share_memory(result, operand))
    if dtype.itemsize < result.dtype.itemsize and cast.size:
        _check_rounded(cast, result, target)
    return cast[()]


def _check_rounded(cast: Array, result: Array, target: Endpoint | None) -> None:
    low, high = cast.min(), cast.max()
    stored = target.stored if target else None
    if stored and stored.accepts(low) and stored.accepts(high):
        return
    kept = np.isfinite(cast) if stored is None else stored.accepts(cast)
    # What was refused before is not for the type to answer for.
    wrong = ~kept & (cast != result) & np.isfinite(result)
    if wrong.any():
        value = number_text(float(result.flat[int(np.argmax(wrong))]))
        raise MdfconvError(f"a result, {value}, is none in {cast.dtype.name}", "convert in float64")


def _apply_with_gaps(
    method: Method, metric: Metric, operand: Array, source: Endpoint, target: Endpoint
) -> Array:
    """Convert an array; NaN where there is no answer."""
    with np.errstate(all="ignore"):
        parameter = source.decode_legal(np.asarray(operand, dtype=np.float64))
    result = _results(method, metric, parameter, source, target)
    stored = target.encode(result)
    legal = target.distribution.parameter.accepts(result)
    return stored if legal.all() else np.where(legal, stored, np.nan)


def _warn_of_gaps(
    method: Method, operand: Array, stored: Array, source: Endpoint, target: Endpoint
) -> None:
    missing = np.isnan(stored)
    if not missing.any():
        return
    first = float(operand.flat[int(np.argmax(missing))])
    warnings.warn(
        f"{np.count_nonzero(missing)} of {missing.size} values have no answer by {method.name} "
        f"from {source.label} to {target.label} and are NaN, the first is {number_text(first)}",
        MdfconvWarning,
        stacklevel=4,
    )
