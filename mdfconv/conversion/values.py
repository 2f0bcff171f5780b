"""`convert`: from the numbers that the source stores to those that the target stores."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from itertools import chain, compress
from operator import not_
from typing import Any, Literal, TypeAlias, TypedDict, Unpack, overload

import numpy as np
from numpy.typing import ArrayLike

from mdfconv.conversion import methods
from mdfconv.distributions import list_distributions
from mdfconv.distributions.endpoint import Endpoint, endpoints, exact_route
from mdfconv.distributions.evaluation import Array, Mask, as_operand, in_parts, worth_threads
from mdfconv.distributions.parameter import number_text
from mdfconv.errors import MdfconvError, MdfconvWarning
from mdfconv.fitting.metrics import Metric, list_metrics, metric_named
from mdfconv.fitting.problem import ConversionTask

FREE: Literal["free"] = "free"
Gamma: TypeAlias = float | Literal["free"] | None
Name: TypeAlias = str | Endpoint
Pair: TypeAlias = tuple[float, float]
Value: TypeAlias = float | Pair

_Word: TypeAlias = str | None
_Columns: TypeAlias = tuple[ArrayLike, ArrayLike]
# Fewer numbers are all looked at sooner than their extremes are found.
_FEW = 16


class _Common(TypedDict, total=False):
    metric: str | Metric | None
    threads: int


class _Fixed(_Common, total=False):
    gamma: float | None


class _Free(_Common):
    gamma: Literal["free"]


@overload
def convert(
    values: Any, source: Name, target: Name, method: _Word = ..., **options: Unpack[_Free]
) -> tuple[Any, Any]: ...
@overload
def convert(
    values: float, source: Name, target: Name, method: _Word = ..., **options: Unpack[_Fixed]
) -> float: ...
@overload
def convert(  # type: ignore[overload-overlap]  # a pair of numbers is an array_like, too
    values: Pair, source: Name, target: Name, method: _Word = ..., **options: Unpack[_Fixed]
) -> Pair: ...
@overload
def convert(
    values: _Columns, source: Name, target: Name, method: _Word = ..., **options: Unpack[_Fixed]
) -> tuple[Any, Any]: ...
@overload
def convert(
    values: list[Pair], source: Name, target: Name, method: _Word = ..., **options: Unpack[_Fixed]
) -> list[Value]: ...
@overload
def convert(
    values: ArrayLike, source: Name, target: Name, method: _Word = ..., **options: Unpack[_Fixed]
) -> Array: ...
def convert(
    values: Any,
    source: Name,
    target: Name,
    method: str | None = None,
    *,
    metric: str | Metric | None = None,
    gamma: Gamma = None,
    threads: int = 1,
) -> Any:
    """Convert a parameter from one distribution to another.

    Parameters
    ----------
    values : array_like, tuple of two array_like, or list with tuples
        Parameters of the source; a tuple (x, y) is the pair of an anisotropic surface, in a list,
        too.
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
    float, numpy.ndarray, tuple or list
        Parameters of the target, in the shape and the floating type of the values: a float for a
        number, a tuple for a pair, a list for a list with pairs, else an array. With ``"fast"``
        elements of an array that are illegal or outside its range are NaN. With a free γ a tuple:
        parameters, and γ.

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
    rule = ConversionRule(source, target, method, metric, gamma)
    warned: list[str] = []
    if holds_pairs(values):
        result = in_order(values, lambda part: listed(_convert(part, rule, threads, warned)))
    else:
        result = _convert(values, rule, threads, warned)
    for text in warned:
        warnings.warn(text, MdfconvWarning, stacklevel=2)
    return result


def holds_pairs(values: Any) -> bool:
    """Return whether values are a list with tuples in it, at any depth."""
    if not isinstance(values, list):
        return False
    kinds = set(map(type, values))
    return any(map(_is_pair, kinds)) or (list in kinds and any(map(holds_pairs, values)))


def _is_pair(kind: type) -> bool:
    return issubclass(kind, tuple)


def in_order(values: list[Any], convert_part: Callable[[Any], list[Any]]) -> list[Any]:
    """Convert the pairs of a list and its numbers, each at once; return all in their order."""
    paired = list(map(_is_pair, map(type, values)))
    pairs = list(compress(values, paired))
    numbers = list(compress(values, map(not_, paired)))
    for pair in pairs:
        _check_members(pair)
    if any(np.ndim(number) for number in chain(numbers, *pairs)):
        raise MdfconvError("a list with pairs holds numbers and pairs of numbers, not arrays")
    results = iter(convert_part(tuple(map(list, zip(*pairs, strict=True)))))
    others = iter(convert_part(numbers) if numbers else ())
    return [next(results if is_pair else others) for is_pair in paired]


def listed(result: Any) -> list[Any]:
    """Return the results of an array one by one, or those of a pair of arrays."""
    if isinstance(result, tuple):
        return list(zip(*(axis.tolist() for axis in result), strict=True))
    numbers: list[float] = result.tolist()
    return numbers


@dataclass(frozen=True)
class Converted:
    """Numbers on their way, stage by stage, in one shape; γ and its limits where γ was fitted."""

    parameter: Array
    stored: Array
    result: Array
    gamma: Array | None = None
    gamma_at_limit: Mask | None = None


class ConversionRule:
    """What is converted to what, by which method and under which metric."""

    def __init__(
        self,
        source: Name,
        target: Name,
        method: str | None = None,
        metric: str | Metric | None = None,
        gamma: Gamma = None,
    ) -> None:
        if isinstance(gamma, str) and gamma != FREE:
            raise MdfconvError(f"gamma is a number or '{FREE}', not '{gamma}'")
        self.free = isinstance(gamma, str)
        fixed = None if isinstance(gamma, str) else gamma
        self.ends = self.source, self.target = endpoints(source, target, fixed)
        self.pair = self.source.distribution, self.target.distribution
        self.metric = metric_or_default(metric)
        if self.free:
            self.method = methods.method_with_free_gamma(method, self.pair[1])
        elif method is not None:
            self.method = methods.method_named(method)
        else:
            self.method = methods.default_method(*self.pair, metric_given=metric is not None)
        self._same_lobes = exact_route(*self.pair)
        self.exact = None if self.free else self._same_lobes
        self.solver = self.method if self.exact is None else methods.ExactRoute(self.exact)

    def read(self, values: Any) -> tuple[Any, ...]:
        """Return values as real operands: one of numbers, or two of a pair, which is a tuple."""
        if isinstance(values, tuple):
            self._check_pair(values)
            x, y = map(as_operand, values)
            try:
                np.broadcast_shapes(np.shape(x), np.shape(y))
            except ValueError:
                shapes = f"shapes {np.shape(x)} and {np.shape(y)}"
                raise MdfconvError(f"{shapes} are not a pair") from None
            return x, y
        axis = as_operand(values)
        paired = [end.label for end in self.ends if end.pairing]
        if paired and np.ndim(axis) > 1 and np.shape(axis)[-1] == 2:
            raise MdfconvError(
                f"an array of shape {np.shape(axis)} is pairs or single numbers of {paired[0]}",
                "give pairs as a tuple of both columns, single numbers in one dimension",
            )
        return (axis,)

    def _check_pair(self, values: tuple[Any, ...]) -> None:
        """Raise unless a pair has two members, and both distributions take it."""
        _check_members(values)
        isotropic = [mdf.name for mdf in self.pair if not mdf.anisotropic]
        if isotropic:
            others = [
                f"use {mdf.name}"
                for mdf in list_distributions()
                if mdf.anisotropic and mdf.equivalent and mdf.equivalent.name == isotropic[0]
            ]
            raise MdfconvError(
                f"{isotropic[0]} is isotropic: it takes one parameter, not a pair",
                "".join(others[:1]),
            )

    def convert(self, axis: Any, *, gaps: bool = False) -> Converted:
        """Convert the numbers of an axis; with gaps NaN where there is no answer, else raise."""
        if gaps:
            parameter = self.source.decode_legal(np.asarray(axis, dtype=float))
        else:
            parameter = self.source.decode(axis)
        if self.exact is None:
            methods.check_covered(self.method, self.metric, *self.ends)
        with np.errstate(all="ignore"):
            solution = self.solver.solve(self.task(parameter))
        stored = self.target.encode(solution.parameter)
        if not gaps and np.isnan(stored).any():
            index, size = int(np.argmax(np.isnan(stored))), np.size(stored)
            which = f" (value {index + 1} of {size})" if size > 1 else ""
            result = solution.parameter.flat[index]
            raise self.refusal(float(parameter.flat[index]), float(result), which)
        return Converted(parameter, stored, *solution)

    def task(self, parameter: Array) -> ConversionTask:
        """Return what is to be done with parameters of the source."""
        return ConversionTask(self.pair[0], parameter, self.pair[1], self.metric)

    def cautions(self, converted: Converted) -> dict[str, Mask]:
        """Return sentences, and of which of the numbers they are true."""
        everywhere = np.ones(converted.parameter.shape, bool)
        cautions = {end.caution: everywhere for end in self.ends if end.caution}
        clamped = self.target.clamped(converted.stored)
        cautions |= {f"{self.target.label} clamps: {text}": clamped[text] for text in clamped}
        if self._same_lobes is None:
            with np.errstate(all="ignore"):
                cautions |= self.method.cautions(self.task(converted.parameter), converted.result)
        if converted.gamma_at_limit is not None:
            low, high = self.pair[1].parameters[1].fit_range
            sentence = (
                f"γ of {self.pair[1].name} is at the end of the range in which it is looked for, "
                f"{low:g} to {high:g}"
            )
            cautions[sentence] = converted.gamma_at_limit
        return cautions

    def true_cautions(self, converted: Converted) -> list[str]:
        """Return the sentences that are true of any of the numbers."""
        return [text for text, which in self.cautions(converted).items() if which.any()]

    def refusal(self, parameter: float, result: float, which: str = "") -> MdfconvError:
        """Return the error for a result that is illegal, with what the other methods make of it."""
        source, target = self.pair
        start = f"{source.name} {source.parameter.symbol} = {number_text(parameter)}{which}"
        if self.exact is not None and source.is_same(target):
            return MdfconvError(
                f"{self.target.label} cannot store {start}: outside {self.target.stored.legal}"
            )
        method = self.method.name if self.exact is None else "the exact conversion"
        if np.isnan(result):
            covered = self.method.range_text(*self.pair, self.metric)
            why = f"has no answer in {target.label}"
            why += f": it covers {covered}" if covered else f", outside {target.parameter.legal}"
        else:
            why = f"gives {target.label} {target.parameter.symbol} = {number_text(result)}, "
            if target.parameter.accepts(np.asarray(result)):
                why += f"which {self.target.label} cannot store, outside {self.target.stored.legal}"
            else:
                why += f"outside {target.parameter.legal}"
        reason = f"for {start} {method} {why}"
        answers = self._other_answers(parameter) if self.exact is None else ""
        if not answers:
            return MdfconvError(reason, "no method answers")
        return MdfconvError(reason, answers, argument="method")

    def _other_answers(self, parameter: float) -> str:
        """Return what the other methods make of a parameter, in words."""
        answers: list[str] = []
        for method in methods.list_methods():
            if method.name == self.method.name or not method.covers(*self.pair, self.metric):
                continue
            with np.errstate(all="ignore"):
                result = method.convert(self.task(np.asarray([parameter])))
            stored = self.target.encode(result)
            if self.target.stored.accepts(stored)[0]:
                verb = "" if answers else " answers"
                answers.append(f"{method.name}{verb} {number_text(float(stored[0]))}")
        return ", ".join(answers)


def _check_members(values: tuple[Any, ...]) -> None:
    if len(values) != 2:
        raise MdfconvError(f"a pair of parameters has two members, not {len(values)}")


def metric_or_default(metric: str | Metric | None) -> Metric:
    """Return the metric that was asked for, or the first one."""
    return metric_named(list_metrics()[0] if metric is None else metric)


def _convert(values: Any, rule: ConversionRule, threads: int, warned: list[str]) -> Any:
    """Convert numbers, or a pair; add what the caller is to be warned of."""
    results: list[Any] = []
    cautions: dict[str, None] = {}
    values = rule.read(values)
    for axis in rule.source.axes(values):
        results.append(_convert_axis(axis, rule, threads, warned, cautions))
    if cautions:
        warned.append("; ".join(cautions))
    return results[0] if len(results) == 1 else rule.target.pair(*results)


def _convert_axis(
    axis: Any, rule: ConversionRule, threads: int, warned: list[str], cautions: dict[str, None]
) -> Any:
    """Return the stored results for the numbers of an axis, in their shape and floating type."""
    if rule.free:
        converted = rule.convert(axis)
        assert converted.gamma is not None, "it was fitted"
        return _like(axis, converted.stored, rule.target), _like(axis, converted.gamma)
    gaps = rule.method.gaps_as_nan and np.ndim(axis) > 0

    def convert_part(numbers: Any) -> Array:
        converted = rule.convert(numbers, gaps=gaps)
        cautions.update(dict.fromkeys(_cautions_of_extremes(converted, rule)))
        return converted.stored

    stored = _in_threads(convert_part, axis, threads)
    missing = np.isnan(stored) if gaps else np.zeros(0, bool)
    if missing.any():
        first = float(axis.flat[int(np.argmax(missing))])
        warned.append(
            f"{np.count_nonzero(missing)} of {missing.size} values have no answer by "
            f"{rule.method.name} from {rule.source.label} to {rule.target.label} and are NaN, "
            f"the first is {number_text(first)}"
        )
    return _like(axis, stored, rule.target)


def _in_threads(function: Callable[[Any], Array], axis: Any, threads: int) -> Array:
    """Return an elementwise function of numbers, those of a large array shared by threads."""
    size = np.size(axis)
    if not worth_threads(size, threads):
        return function(axis)
    flat, result = axis.reshape(-1), np.empty(size)

    def compute(low: int, high: int) -> None:
        result[low:high] = function(flat[low:high])

    try:
        in_parts(compute, size, threads)
    except MdfconvError:
        # What is wrong is said of all the values, not of a part.
        return function(axis)
    return result.reshape(axis.shape)


def _cautions_of_extremes(converted: Converted, rule: ConversionRule) -> list[str]:
    """Return the cautions about the least and the largest numbers: those are beyond a limit."""
    clamps = rule.target.encoding is not None and bool(rule.target.encoding.clamps)
    silent = not rule.method.has_cautions or rule.pair[0].is_same(rule.pair[1])
    if silent and not clamps and not any(end.caution for end in rule.ends):
        return []
    parameter = _extremes(converted.parameter)
    result = _extremes(converted.result) if rule.method.follows_metric else parameter
    stored = _extremes(converted.stored) if clamps else result
    return rule.true_cautions(Converted(parameter, stored, result))


def _extremes(values: Array) -> Array:
    """Return the least and the largest of numbers, leaving out NaN; few as they are."""
    if values.size < _FEW:
        return values.ravel()
    if np.isnan(values.min()):
        values = values[~np.isnan(values)]
    return np.array([values.min(), values.max()]) if values.size else values


def _like(axis: Any, stored: Array, target: Endpoint | None = None) -> Any:
    """Return stored numbers in the floating type of the axis that they came from.

    Raises `MdfconvError` if the type rounds one to a number that the target cannot store.
    """
    if isinstance(axis, float):
        return float(stored)
    dtype = axis.dtype if axis.dtype.kind == "f" else np.dtype(np.float64)
    with np.errstate(over="ignore", under="ignore"):
        # Without a copy of a large array, unless it would be the caller's own.
        cast = stored.astype(dtype, copy=np.may_share_memory(stored, axis))
    if dtype.itemsize < stored.dtype.itemsize and cast.size:
        _check_rounded(cast, stored, target)
    return cast[()]


def _check_rounded(cast: Array, stored: Array, target: Endpoint | None) -> None:
    accepts = np.isfinite if target is None else target.stored.accepts
    # Two reductions need no memory; NaN fails both.
    if accepts(cast.min()) and accepts(cast.max()):
        return
    # What was refused before is not for the type to answer for.
    wrong = ~accepts(cast) & (cast != stored) & np.isfinite(stored)
    if wrong.any():
        value = number_text(float(stored.flat[int(np.argmax(wrong))]))
        raise MdfconvError(f"a stored, {value}, is none in {cast.dtype.name}", "convert in float64")
