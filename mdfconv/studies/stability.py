"""The audit of hard cases: where formulas lose their digits, and what is left of them here.

Exact values are stored, computed with mpmath at 60 digits from the printed formulas and for the
very numbers that the types hold (``python -m tests.generate_stability`` writes them), and compared
in decimal arithmetic, so that neither the references nor the comparison add an error of their own.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, fields
from decimal import Decimal
from itertools import groupby, product
from operator import attrgetter
from typing import Any, TypeAlias

import numpy as np

from mdfconv.conversion import convert, list_methods
from mdfconv.conversion.methods import FormulaMethod, Method
from mdfconv.distributions import Distribution, distribution, list_distributions
from mdfconv.distributions.endpoint import Endpoint, exact_route
from mdfconv.distributions.evaluation import Array
from mdfconv.errors import MdfconvWarning
from mdfconv.fitting.metrics import metric_named
from mdfconv.fitting.problem import ConversionTask
from mdfconv.output.records import csv_text
from mdfconv.studies.pages import PageFiles, fill, pivot, read_rows, tracked

# Of the kernels. Conversions compute in float64 throughout: float32 rounds input and result.
_KERNEL_TYPES = (np.float64, np.float32, np.float16)
_CONVERSION_TYPES = (np.float64, np.float32)
# Under which fits are compared.
_FIT_METRICS = ("unit", "energy")
# Methods of which one direction undoes the other, for every pair, with the printed expressions
# that they go through.
_INVERTIBLE = {"half-angle": ("cosine", "from_cosine"), "peak": ("peak_alpha", "from_peak_alpha")}
# What is stored and read back in the forms of programs.
_ENCODED = {"mirror-smooth": ("1e-08", "1e-06", "1e-04"), "rough": ("0.25", "0.5", "1")}
_ENCODED_EXPONENTS = {"mirror-smooth": ("1000", "10000", "60000"), "rough": ("4", "10", "100")}
# Columns of conversions.csv that are not a target's.
_KEYS = ("method", "source", "regime", "gamma", "value")

_Rows: TypeAlias = list[dict[str, str]]


@dataclass(frozen=True)
class Finding:
    """The worst of a group of hard cases, ours beside the printed expression.

    Parameters
    ----------
    distribution : str
        The distribution; of a conversion the source.
    rule : str
        ``"unit"`` or ``"normalized"`` for a kernel, else the method, ``"... and back"`` for a
        round trip.
    regime : str
        What makes the cases hard.
    dtype : str
        Type of the input and of the result.
    cases : int
        The number of cases.
    out_of_range : int
        How many of them have an exact value that the type holds only as 0, a subnormal number
        or infinity. They are right if the result is that; no error can be stated.
    error : float or str
        The largest relative error against the exact value; inf or NaN for a failure, empty where
        there is no case.
    error_in_eps : float or str
        The same in units of the type's rounding, ``numpy.finfo(dtype).eps``; a correctly
        rounded result has at most ½.
    textbook : float or str
        The largest relative error of the printed expression in plain NumPy, in the same type;
        ``"NaN"`` or ``"inf"`` where it comes to that, and empty where nothing is printed.
    worst : str
        Where `error` is largest.
    round_trip : bool
        Whether the rule is applied forth and back.
    """

    distribution: str
    rule: str
    regime: str
    dtype: str
    cases: int = 0
    out_of_range: int = 0
    error: float | str = ""
    error_in_eps: float | str = ""
    textbook: float | str = ""
    worst: str = ""
    round_trip: bool = False

    def record(self) -> dict[str, Any]:
        """Return a row of a table."""
        return {name: value for name, value in vars(self).items() if name != "round_trip"}


COLUMNS = [field.name for field in fields(Finding) if field.name != "round_trip"]


@dataclass(frozen=True)
class HardCases:
    """Results for some cases of a group beside exact ones, and what each case is, in words.

    The textbook's results are None where nothing is printed.
    """

    rule: str
    regime: str
    values: Array
    textbook: Array | None
    exact: Sequence[Decimal]
    cases: Sequence[str]
    round_trip: bool = False


def findings(audited: str, cases: Iterable[HardCases]) -> Iterator[Finding]:
    """Yield the worst of each group of a distribution, in the order of their first cases."""
    groups: dict[tuple[str, str, np.dtype], list[HardCases]] = {}
    for each in cases:
        groups.setdefault((each.rule, each.regime, each.values.dtype), []).append(each)
    for (rule, regime, dtype), members in groups.items():
        errors = np.concatenate([relative_errors(one.values, one.exact) for one in members])
        compared = ((one.textbook, one.exact) for one in members if one.textbook is not None)
        printed = [error for pair in compared for error in relative_errors(*pair)]
        worst = int(np.argmax(np.nan_to_num(errors, nan=np.inf)))
        textbook = float(np.max(printed)) if printed else None
        yield Finding(
            audited,
            rule,
            regime,
            dtype.name,
            cases=errors.size,
            out_of_range=sum(not _in_range(e, dtype) for one in members for e in one.exact),
            error=two_digits(errors[worst]),
            error_in_eps=two_digits(errors[worst] / float(np.finfo(dtype).eps)),
            textbook="" if textbook is None else _number_or_word(textbook),
            worst=[case for one in members for case in one.cases][worst],
            round_trip=members[0].round_trip,
        )


def relative_errors(values: Array, exact: Sequence[Decimal]) -> list[float]:
    """Return |value − exact|/|exact| of each value, rounded only at the end.

    Where the exact value is below the smallest normal number or above the largest number of
    the type, the error is 0 if the value is so too and inf otherwise; NaN stays NaN.
    """
    return [_error(float(v), e, values.dtype) for v, e in zip(values, exact, strict=True)]


def _error(value: float, exact: Decimal, dtype: np.dtype) -> float:
    if np.isnan(value):
        return np.nan
    if not _in_range(exact, dtype):
        limits = np.finfo(dtype)
        small = float(limits.smallest_normal)
        # The last rounding may lift a value just across the limit.
        fits = 0 <= value <= small * 1.01 if exact < small else value >= 0.99 * float(limits.max)
        return 0.0 if fits else np.inf
    return np.inf if np.isinf(value) else float(abs(Decimal(value) - exact) / exact)


def _in_range(exact: Decimal, dtype: np.dtype) -> bool:
    limits = np.finfo(dtype)
    return float(limits.smallest_normal) <= exact <= float(limits.max)


def _number_or_word(error: float) -> float | str:
    return two_digits(error) if np.isfinite(error) else str(error).replace("nan", "NaN")


def two_digits(value: float) -> float:
    """Return a value rounded to two significant digits: an error's size is what matters."""
    return float(f"{value:.1e}")


def audit_kernels(chosen: Sequence[Distribution]) -> Iterator[Finding]:
    """Yield the findings of the unit and the normalized forms, one for each regime and type.

    β is compared as stored: of a β beyond π/2, which float32's π/2 is, the mirrored angle counts.
    The normalized forms are compared at β = 0; elsewhere they are a multiple of the unit forms.
    """
    stored = {dtype: read_rows(f"kernels-{dtype.__name__}.csv") for dtype in _KERNEL_TYPES}
    for audited in chosen:
        for dtype, references in stored.items():
            names = {row["distribution"] for row in references}
            name = audited.name if audited.name in names else _same_function(audited)
            if name in names:
                rows = [row for row in references if row["distribution"] == name]
                yield from findings(audited.name, _kernel_cases(audited, rows, dtype))
            else:
                yield Finding(audited.name, "unit", "no stored references", dtype.__name__)


def _same_function(audited: Distribution) -> str:
    """Return the name of the distribution that is this one in the same parameter, if any."""
    equal = audited.equivalent
    return equal.name if equal and equal.same_lobe and equal.same_parameter else ""


def _kernel_cases(audited: Distribution, rows: _Rows, dtype: Any) -> Iterator[HardCases]:
    for row in rows:
        form, parameter, gamma = row["form"], row["parameter"], row["gamma"]
        angles = row["beta"].split()
        beta = np.array(angles, dtype=dtype)
        p, shape = dtype(parameter), audited
        if audited.second_parameter:
            shape = audited.with_gamma(float(dtype(gamma or audited.gamma)))
        evaluate = shape.unit if form == "unit" else shape.normalized
        where = f"{audited.parameter.symbol} = {parameter}" + (f", γ = {gamma}" if gamma else "")
        # float16 overflows where the normalized form of a mirror-smooth surface exceeds 65504.
        with np.errstate(over="ignore"):
            values = evaluate(beta, p)
        printed = printed_form(shape, form, beta, p)
        exact = [Decimal(text) for text in row["value"].split()]
        cases = [f"β = {angle}, {where}" for angle in angles]
        yield HardCases(form, row["regime"], values, printed, exact, cases)


def printed_form(shape: Distribution, form: str, beta: Array, parameter: Any) -> Array:
    """Return the printed unit form, or for ``"normalized"`` that form at the normal, β = 0.

    The parameter is a numpy scalar of the type of the angles.
    """
    printed = shape.printed
    arguments = [parameter] + [beta.dtype.type(shape.gamma)] * bool(shape.second_parameter)
    with np.errstate(all="ignore"):
        # Where the maximum is off the normal, D̄ is not D(β)/D(0): that is 1 at the normal.
        off_axis = form == "normalized" and shape.mode(np.asarray(float(parameter))) > 0
        value = np.ones_like(beta) if off_axis else printed.unit(beta, *arguments)
        return value if form == "unit" else value * printed.at_normal(*arguments)


@dataclass(frozen=True)
class _Batch:
    """Values at one end of the source's range, float32's, and their exact results in a target."""

    source: Distribution
    target: Distribution
    regime: str
    values: list[str]
    exact: list[Decimal]

    def of_type(self, dtype: Any) -> Array:
        return np.array(self.values, dtype=np.float32).astype(dtype)

    @property
    def cases(self) -> list[str]:
        return [f"{value} → {self.target.name}" for value in self.values]


def audit_conversions(chosen: Sequence[Distribution]) -> Iterator[Finding]:
    """Yield the findings of all conversions from the chosen distributions.

    There is one for each source, method, end of the range and type. A round trip is compared with
    where it started: where a conversion is nearly constant, no stored result leads back.
    """
    formulas, fits = read_rows("conversions.csv"), read_rows("fits.csv")
    for source in chosen:
        fitted = [row for row in fits if row["source"] == source.name]
        for method in list_methods():
            names = (method.name, source.name)
            rows = [row for row in formulas if (row["method"], row["source"]) == names]
            cases = [
                case
                for batch in _formula_batches(source, rows)
                for dtype in _CONVERSION_TYPES
                for case in _forth_and_back(method, batch, dtype)
            ]
            yield from findings(source.name, sorted(cases, key=attrgetter("round_trip")))
            if method.follows_metric:
                yield from findings(source.name, _fits(method, source, fitted))
        yield from findings(source.name, _encodings(source))


def _formula_batches(source: Distribution, rows: _Rows) -> Iterator[_Batch]:
    for (regime, gamma), group in groupby(rows, lambda row: (row["regime"], row["gamma"])):
        members = list(group)
        for name in [column for column in members[0] if column not in _KEYS]:
            converted = [row for row in members if row[name]]
            if converted:
                ends = _with_gamma(source, gamma), _with_gamma(distribution(name), gamma)
                values = [row["value"] for row in converted]
                exact = [Decimal(row[name]) for row in converted]
                yield _Batch(*ends, regime, values, exact)


def _with_gamma(end: Distribution, gamma: str) -> Distribution:
    return end.with_gamma(float(gamma)) if end.second_parameter else end


def _converted(values: Array, source: Distribution, target: Distribution, method: Method) -> Any:
    """Convert hard cases, of which nobody is to be warned."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", MdfconvWarning)
        return convert(values, Endpoint(source), Endpoint(target), method.name)


def _forth_and_back(method: Method, batch: _Batch, dtype: Any) -> Iterator[HardCases]:
    """Yield a conversion, and the way back from it if the method has one that undoes it."""
    source, target, values = batch.source, batch.target, batch.of_type(dtype)
    converted = _converted(values, source, target, method)
    textbook = printed_conversion(method, source, target, values)
    yield HardCases(method.name, batch.regime, converted, textbook, batch.exact, batch.cases)
    if method.name not in _INVERTIBLE and exact_route(source, target) is None:
        return
    if textbook is not None:
        textbook = printed_conversion(method, target, source, textbook)
    rule, back = f"{method.name} and back", _converted(converted, target, source, method)
    start = [Decimal(float(value)) for value in values]
    cases = [f"{case} → {source.name}" for case in batch.cases]
    yield HardCases(rule, batch.regime, back, textbook, start, cases, round_trip=True)


def printed_conversion(
    method: Method, source: Distribution, target: Distribution, values: Array
) -> Array | None:
    """Return what the printed formulas give in the type of the values; None if none is printed."""
    with np.errstate(all="ignore"):
        if isinstance(method, FormulaMethod):
            # It holds the formulas as printed.
            result = method.convert(ConversionTask(source, values, target, metric_named("unit")))
        else:
            ends = zip((source, target), _INVERTIBLE[method.name], strict=True)
            first, last = (getattr(end.printed, name) for end, name in ends)
            if first is None or last is None:
                return None
            result = last(first(values, *_gammas(source, values)), *_gammas(target, values))
    return np.asarray(result).astype(values.dtype)


def _gammas(end: Distribution, values: Array) -> list[Array]:
    return [np.full_like(values, end.gamma)] if end.second_parameter else []


def _fits(method: Method, source: Distribution, rows: _Rows) -> Iterator[HardCases]:
    for (name, regime), group in groupby(rows, lambda row: (row["target"], row["regime"])):
        members = list(group)
        target = distribution(name)
        for metric in map(metric_named, _FIT_METRICS):
            if not method.covers(source, target, metric):
                continue
            exact = [Decimal(row[metric.name]) for row in members]
            batch = _Batch(source, target, regime, [row["value"] for row in members], exact)
            for dtype in _CONVERSION_TYPES:
                ours = convert(batch.of_type(dtype), source.name, name, method.name, metric=metric)
                rule = f"{method.name} {metric.name}"
                yield HardCases(rule, regime, ours, None, exact, batch.cases)


def _encodings(source: Distribution) -> Iterator[HardCases]:
    for encoding in source.encodings:
        label = f"{source.name}:{encoding.name}"
        smooth = source.parameter.larger_is_smoother
        for regime, texts in (_ENCODED_EXPONENTS if smooth else _ENCODED).items():
            for dtype in _CONVERSION_TYPES:
                values = np.array(texts, dtype=dtype)
                back = convert(convert(values, source.name, label), label, source.name)
                start = [Decimal(float(value)) for value in values]
                cases = [f"{text} → {encoding.name} → {source.parameter.symbol}" for text in texts]
                rule = f"{encoding.name} and back"
                yield HardCases(rule, regime, back, None, start, cases, round_trip=True)


_PARTS = {"kernels": audit_kernels, "conversions": audit_conversions}


def audit(names: Sequence[str] = (), part: str | None = None) -> Iterator[Finding]:
    """Yield the worst error of every group of hard cases.

    First come the kernels (float64, float32, float16), then the conversions (float64, float32). A
    distribution without stored references has a finding without cases.

    Parameters
    ----------
    names : sequence of str
        Names or aliases of the distributions to audit, of conversions the sources; all if empty.
    part : str, optional
        ``"kernels"`` or ``"conversions"``; both if not given.

    Raises
    ------
    MdfconvError
        If a name is not known.
    """
    chosen = list(dict.fromkeys(map(distribution, names))) or list_distributions()
    for name, audit_part in _PARTS.items():
        if part in (None, name):
            yield from audit_part(chosen)


# Digits and the places of the worst cases differ from one processor to the next.
_PAGE_COLUMNS = [name for name in COLUMNS if name not in ("error_in_eps", "worst")]
_KERNELS = ("unit", "normalized")
_NO_DIGIT, _FAILS = "1", "fails"
_NO_REFERENCES = "—"


def stability() -> PageFiles:
    """Return the audit of hard cases.

    Errors are orders of magnitude, rounded up: their digits differ from one processor to the
    next.
    """
    rows = [
        finding.record()
        | {name: _magnitude(getattr(finding, name)) for name in ("error", "textbook")}
        for part, mdf in tracked([*product(_PARTS, list_distributions())])
        for finding in audit([mdf.name], part)
    ]
    kernels = [row for row in rows if row["rule"] in _KERNELS]
    by_type = {
        dtype: _table([row for row in kernels if row["dtype"] == dtype], "distribution", "regime")
        for dtype in ("float64", "float32")
    }
    conversions = [row for row in rows if row["rule"] not in _KERNELS]
    figures = {
        "cases": sum(row["cases"] for row in rows),
        "distributions": len({row["distribution"] for row in rows}),
        "groups": len(rows),
        "failures": sum(row["error"] == _FAILS for row in rows),
        "textbook_failures": sum(row["textbook"] == _FAILS for row in rows),
    }
    page = fill("stability", **by_type, conversions=_table(conversions, "rule", "dtype"), **figures)
    shown = [{name: row[name] for name in _PAGE_COLUMNS} for row in rows]
    return PageFiles([page, csv_text(_PAGE_COLUMNS, shown)], figures)


def _table(rows: Sequence[dict[str, Any]], row: str, column: str) -> str:
    """Return the worst errors, ours and the textbook's, by two columns."""
    groups: dict[tuple[str, str], list[dict[str, Any]]] = {}
    for each in rows:
        groups.setdefault((each[row], each[column]), []).append(each)
    return pivot(row, ((*key, _worst(group)) for key, group in groups.items()))


def _worst(group: Sequence[dict[str, Any]]) -> str:
    if not any(row["cases"] for row in group):
        return _NO_REFERENCES
    texts = ([row[name] for row in group] for name in ("error", "textbook"))
    return " / ".join(max(each, key=_order) for each in texts if any(each))


def _order(magnitude: str) -> float:
    return math.inf if magnitude == _FAILS else float(magnitude or 0)


def _magnitude(error: float | str) -> str:
    """Return an error's order of magnitude, rounded up; at most 1."""
    if error == "":
        return ""
    if isinstance(error, str) or not math.isfinite(error):
        return _FAILS
    if error == 0:
        return "0"
    power = math.ceil(math.log10(error))
    return _NO_DIGIT if power >= 0 else f"1e{power:03d}"
