"""``mdfconv convert``."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Annotated, Any

import typer

from mdfconv.cli.options import (
    ExposureOption,
    Format,
    FormatOption,
    FromOption,
    GammaOption,
    MethodOption,
    MetricOption,
    ToOption,
    chosen_gamma,
    chosen_metric,
    every_metric,
)
from mdfconv.cli.tables import (
    console,
    form_of,
    print_table,
    rich_table,
    table_text,
    tell,
    value_text,
)
from mdfconv.conversion import Conversion, explain, list_methods, method_named
from mdfconv.conversion.arrays import Gamma
from mdfconv.conversion.endpoint import endpoint
from mdfconv.distributions import list_distributions, one_parameter_distributions
from mdfconv.errors import MdfconvError
from mdfconv.fitting.metrics import Metric, list_metrics

# With more values than this, the table leaves out what the other methods would give.
_VALUES_WITH_ALTERNATIVES = 10
_EVERY = "all"
_FOOTNOTE = (
    "[dim]Errors: root mean square and maximum, relative to the source's peak (environment: "
    "to all facets), on β from 0 to 4.8 β_half; of the unit forms, or in the metric of a fit.[/dim]"
)


def command(
    values: Annotated[
        list[str],
        typer.Argument(
            metavar="VALUE...",
            help="Parameters of the source; a pair X,Y for an anisotropic surface; - reads "
            "values from standard input, one a line.",
        ),
    ],
    source: FromOption,
    target: ToOption,
    method: MethodOption = None,
    metric: MetricOption = "unit",
    exposure: ExposureOption = None,
    gamma: GammaOption = None,
    format_: FormatOption = None,
) -> None:
    """Convert parameters from one distribution to another.

    Prints the bare numbers in a pipe, a table with errors and alternatives on a terminal. Without
    --method it is the closed form, or the fit of a pair that has none; --to all is every
    distribution. With --gamma free both parameters of the target are fitted and printed.

    Examples:

    mdfconv convert --from beckmann --to ggx 0.2

    mdfconv convert --from blinn-phong --to ggx:roughness 10 100 1000

    mdfconv convert --from beckmann --to ggx --method fit --metric energy 0.2

    mdfconv convert --from beckmann --to gtr --gamma free --metric energy 0.2

    mdfconv convert --from ashikhmin-shirley --to ggx 100,20

    mdfconv convert --from beckmann --to all --format json 0.2

    seq 0.1 0.1 0.4 | mdfconv convert --from ggx --to beckmann --method half-angle -
    """
    numbers = _read(values)
    form = form_of(format_, in_pipe=Format.plain)
    rule = _Rule(method, chosen_metric(metric, exposure), exposure, chosen_gamma(gamma))
    every = target.strip().lower() == _EVERY
    targets = _targets(numbers, source) if every else [target]
    conversions, refusals = _convert(numbers, source, targets, rule, errors=form != Format.plain)
    if refusals and (not every or not conversions):
        raise refusals[0]
    _tell_metric(conversions, rule)
    for refusal in refusals:
        tell(f"left out: {refusal}")
    if form is Format.plain:
        _write_plain(conversions, named=every, free=rule.gamma == "free")
    elif form is Format.table:
        _write_tables(conversions, rule)
    else:
        records = [_record(conversion) for group in conversions for conversion in group]
        columns = [name for name in records[0] if any(r[name] is not None for r in records)]
        typer.echo(table_text(columns, records, form))


@dataclass(frozen=True)
class _Rule:
    """How to convert: the options of the command that all targets share."""

    method: str | None
    metric: Metric
    exposure: float | None
    gamma: Gamma

    def explain(self, values: Any, source: str, target: str, *, errors: bool) -> list[Conversion]:
        options: dict[str, Any] = {"metric": self.metric, "gamma": self.gamma, "errors": errors}
        return explain(values, source, target, self.method, **options)

    def others(self, chosen: Conversion) -> Iterator[_Rule]:
        """Yield the other methods, the fit under every metric; fast is the fit again."""
        for method in list_methods():
            if method.name == "fast" or (self.gamma == "free" and method.name != "fit"):
                continue
            if not method.follows_metric:
                if method.name != chosen.method:
                    yield replace(self, method=method.name)
                continue
            for metric in every_metric(self.exposure):
                if (method.name, str(metric)) != (chosen.method, chosen.metric):
                    yield replace(self, method=method.name, metric=metric)


def _read(values: list[str]) -> list[Any]:
    """Return numbers and pairs for the arguments, with standard input in place of ``-``."""
    if values.count("-") > 1:
        raise MdfconvError("standard input can be read only once: give one -")
    numbers: list[Any] = []
    for position, text in enumerate(values, start=1):
        if text == "-":
            numbers += _read_lines()
        else:
            where = f"value {position} of {len(values)}: " if len(values) > 1 else ""
            numbers.append(_number(text, where))
    return numbers


def _read_lines() -> list[Any]:
    if sys.stdin is None:
        raise MdfconvError("standard input is closed")
    try:
        lines = sys.stdin.read().removeprefix("\ufeff").splitlines()
    except UnicodeDecodeError:
        raise MdfconvError("standard input is not text") from None
    numbers = [
        _number(line.strip(), f"line {number} of standard input: ")
        for number, line in enumerate(lines, start=1)
        if line.strip()
    ]
    if not numbers:
        raise MdfconvError("standard input holds no values")
    return numbers


def _number(text: str, where: str) -> Any:
    try:
        parts = tuple(float(part) for part in text.split(","))
    except ValueError:
        raise MdfconvError(f"{where}'{text}' is not a number") from None
    if len(parts) > 2:
        raise MdfconvError(f"{where}'{text}' is not a pair X,Y")
    return parts if len(parts) == 2 else parts[0]


def _targets(numbers: list[Any], source: str) -> list[str]:
    """Return the distributions that `all` stands for: those that take such values."""
    own = endpoint(source).distribution
    targets = one_parameter_distributions()
    if any(isinstance(number, tuple) for number in numbers):
        targets = [target for target in list_distributions() if target.anisotropic]
    return [target.name for target in targets if target is not own]


def _convert(
    numbers: list[Any], source: str, targets: list[str], rule: _Rule, *, errors: bool
) -> tuple[list[list[Conversion]], list[MdfconvError]]:
    """Return the conversions to each target, and why a target has none."""
    conversions, refusals = [], []
    for target in targets:
        own = rule
        if len(targets) > 1 and rule.gamma is not None and not _takes_gamma(source, target, rule):
            own = replace(rule, gamma=None)
        try:
            conversions.append(own.explain(numbers, source, target, errors=errors))
        except MdfconvError as error:
            refusals.append(error)
    return conversions, refusals


def _takes_gamma(source: str, target: str, rule: _Rule) -> bool:
    """Return whether a γ means something for one of many targets."""
    names = [target] if rule.gamma == "free" else [source, target]
    return any(endpoint(name).distribution.second_parameter for name in names)


def _tell_metric(conversions: list[list[Conversion]], rule: _Rule) -> None:
    """Say that a metric that was asked for does not decide the answer."""
    methods = dict.fromkeys(conversion.method for group in conversions for conversion in group)
    for method in methods:
        if rule.metric.name != list_metrics()[0] and not method_named(method).follows_metric:
            tell(
                f"note: the metric is that of the errors; {method} does not depend on it, "
                "--method fit and --method fast do"
            )


def _write_plain(conversions: list[list[Conversion]], *, named: bool, free: bool) -> None:
    """Write the bare results, behind their names where there are several targets."""
    every = [conversion for group in conversions for conversion in group]
    for caution in dict.fromkeys(text for conversion in every for text in conversion.cautions):
        tell(f"note: {caution}")
    lines = []
    for conversion in every:
        words = [conversion.target] if named else []
        words.append(value_text(conversion.result))
        if free and conversion.gamma is not None:
            words.append(value_text(conversion.gamma))
        lines.append(" ".join(words))
    typer.echo("\n".join(lines))


def _write_tables(conversions: list[list[Conversion]], rule: _Rule) -> None:
    """Write a table a target: the chosen answer, and what the other methods would give."""
    out = console()
    for group in conversions:
        print_table(_table(group, rule))
        for caution in dict.fromkeys(text for conversion in group for text in conversion.cautions):
            out.print(f"Note: {caution}.")
    out.print(_FOOTNOTE)


def _table(group: list[Conversion], rule: _Rule) -> Any:
    ends = [endpoint(name) for name in (group[0].source, group[0].target)]
    headings = [f"{end.label} {end.stored.symbol}" for end in ends]
    second = ends[1].distribution.second_parameter
    symbol = second.symbol if second else None
    numbers = [*headings, *([symbol] if symbol else []), "RMSE", "max error"]
    columns = [*numbers[:-2], "method", *numbers[-2:], "keeps"]
    rows, styles = [], []
    for conversion in group:
        rows.append(_row(conversion, headings, symbol))
        styles.append("bold")
        if len(group) <= _VALUES_WITH_ALTERNATIVES:
            rows += _alternatives(conversion, rule, headings, symbol)
            styles += ["dim"] * (len(rows) - len(styles))
    return rich_table(columns, rows, " → ".join(headings), styles, right=numbers)


def _row(
    conversion: Conversion, headings: list[str], symbol: str | None, *, first: bool = True
) -> dict[str, str]:
    follows = method_named(conversion.method).follows_metric
    numbers = [value_text(conversion.value) if first else "", value_text(conversion.result)]
    row = dict(zip(headings, numbers, strict=True))
    if symbol:
        row[symbol] = "" if conversion.gamma is None else value_text(conversion.gamma)
    return row | {
        "method": f"{conversion.method} {conversion.metric}" if follows else conversion.method,
        "RMSE": f"{conversion.rmse:.3g}",
        "max error": f"{conversion.max_error:.3g}",
        "keeps": conversion.notes[0] if conversion.exact else conversion.keeps,
    }


def _alternatives(
    conversion: Conversion, rule: _Rule, headings: list[str], symbol: str | None
) -> list[dict[str, str]]:
    """Return the rows of the methods that were not chosen, with their reason if none."""
    rows: list[dict[str, str]] = []
    for other in rule.others(conversion):
        try:
            (alternative,) = other.explain(
                conversion.value, conversion.source, conversion.target, errors=True
            )
        except MdfconvError as error:
            row = dict.fromkeys([*headings, symbol or headings[0], "RMSE", "max error"], "")
            row |= {headings[1]: "—", "method": other.method or "", "keeps": error.reason}
            rows.append(row)
        else:
            rows.append(_row(alternative, headings, symbol, first=False))
    return rows


def _record(conversion: Conversion) -> dict[str, Any]:
    return {
        "from": conversion.source,
        "to": conversion.target,
        "value": conversion.value,
        "result": conversion.result,
        "gamma": conversion.gamma,
        "method": conversion.method,
        "metric": conversion.metric,
        "rmse": conversion.rmse,
        "max_error": conversion.max_error,
        "notes": conversion.notes,
    }
