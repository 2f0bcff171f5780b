"""``mdfconv convert``."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np
import typer

from mdfconv.cli.numbers import NumberBlock, read_blocks
from mdfconv.cli.options import (
    ExposureOption,
    Format,
    FormatOption,
    FromOption,
    GammaOption,
    MethodOption,
    OptionalMetricOption,
    SpecularOption,
    ToOption,
    asked_metric,
    chosen_gamma,
    every_metric,
)
from mdfconv.cli.process import tell
from mdfconv.cli.tables import (
    ROWS_SHOWN,
    console,
    form_of,
    print_table,
    table_text,
    value_text,
)
from mdfconv.conversion import Conversion, explain, list_methods
from mdfconv.conversion.arrays import FREE, Gamma
from mdfconv.conversion.explanation import results_and_cautions
from mdfconv.distributions import list_distributions, one_parameter_distributions
from mdfconv.distributions.endpoint import endpoint, with_specular
from mdfconv.distributions.parameter import number_text
from mdfconv.errors import MdfconvError
from mdfconv.fitting.metrics import Metric, metric_named

# With more values than this, the table leaves out what the other methods would give.
_VALUES_WITH_ALTERNATIVES = 10
_EVERY = "all"


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
    metric: OptionalMetricOption = None,
    exposure: ExposureOption = None,
    gamma: GammaOption = None,
    specular: SpecularOption = None,
    format_: FormatOption = None,
) -> None:
    """Convert parameters from one distribution to another.

    Prints the bare numbers in a pipe, a table with errors and alternatives on a terminal. With
    --metric it is the fit under that metric, without either the paper's closed form, or the fit of
    a pair that has none; --to all is every distribution. With --gamma free both parameters of the
    target are fitted and printed.

    Examples:

    mdfconv convert --from beckmann --to ggx 0.2

    mdfconv convert --from blinn-phong --to ggx:roughness 10 100 1000

    mdfconv convert --from beckmann --to ggx --metric environment 0.2

    mdfconv convert --from blinn-phong:obj2gltf --to ggx:roughness --metric environment 0.9

    mdfconv convert --from beckmann --to gtr --gamma free --metric energy 0.2

    mdfconv convert --from ashikhmin-shirley --to ggx 100,20

    mdfconv convert --from beckmann --to all --format json 0.2

    seq 0.1 0.1 0.4 | mdfconv convert --from ggx --to beckmann --method half-angle -
    """
    form = form_of(format_, in_pipe=Format.plain)
    rule = _ValueRule(method, asked_metric(metric, exposure), exposure, chosen_gamma(gamma))
    every = target.strip().lower() == _EVERY
    source, target = with_specular(source, source if every else target, specular)
    if form is Format.plain and not every and rule.gamma != FREE:
        _stream(read_blocks(values), source, target, rule)
        return
    numbers = [number for block in read_blocks(values) for number in block.numbers]
    targets = _targets(numbers, source) if every else [target]
    conversions, refusals = _convert(numbers, source, targets, rule, errors=form != Format.plain)
    if refusals and (not every or not conversions):
        raise refusals[0]
    for refusal in refusals:
        tell(f"left out: {refusal}")
    if form is Format.plain:
        _write_plain(conversions, named=every, free=rule.gamma == FREE)
    elif form is Format.table:
        _write_tables(conversions, rule)
    else:
        records = [_record(conversion) for group in conversions for conversion in group]
        columns = [name for name in records[0] if any(r[name] is not None for r in records)]
        typer.echo(table_text(columns, records, form))


@dataclass(frozen=True)
class _ValueRule:
    """How to convert: the options of the command that all targets share."""

    method: str | None
    metric: Metric | None
    exposure: float | None
    gamma: Gamma

    def explain(self, values: Any, source: str, target: str, *, errors: bool) -> list[Conversion]:
        options: dict[str, Any] = {"metric": self.metric, "gamma": self.gamma, "errors": errors}
        return explain(values, source, target, self.method, **options)

    def results(
        self, block: NumberBlock, source: str, target: str
    ) -> tuple[list[str], Sequence[str]]:
        """Return the results of a block as text, and what they call for."""
        if block.has_pairs:
            found = self.explain(block.numbers, source, target, errors=False)
            texts = [text for conversion in found for text in conversion.cautions]
            return [value_text(conversion.result) for conversion in found], texts
        options: dict[str, Any] = {"metric": self.metric, "gamma": self.gamma}
        numbers = np.array(block.numbers, dtype=float)
        stored, cautions = results_and_cautions(numbers, source, target, self.method, **options)
        return list(map(number_text, stored.tolist())), cautions

    def others(self, chosen: Conversion) -> Iterator[_ValueRule]:
        """Yield the other methods under the metric of an answer."""
        for method in list_methods():
            if method.name != chosen.method and (self.gamma != FREE or method.name == "fit"):
                yield replace(self, method=method.name, metric=metric_named(chosen.metric))

    def under_other_metrics(self, chosen: Conversion) -> Iterator[_ValueRule]:
        """Yield the fits under the other metrics."""
        for metric in every_metric(self.exposure):
            if str(metric) != chosen.metric:
                yield replace(self, method=None, metric=metric)


def _targets(numbers: list[Any], source: str) -> list[str]:
    """Return the distributions that `all` stands for: those that take such values."""
    own = endpoint(source).distribution
    targets = one_parameter_distributions()
    if any(isinstance(number, tuple) for number in numbers):
        targets = [target for target in list_distributions() if target.anisotropic]
    return [target.name for target in targets if target is not own]


def _convert(
    numbers: list[Any], source: str, targets: list[str], rule: _ValueRule, *, errors: bool
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


def _takes_gamma(source: str, target: str, rule: _ValueRule) -> bool:
    """Return whether a γ means something for one of many targets."""
    names = [target] if rule.gamma == FREE else [source, target]
    return any(endpoint(name).distribution.second_parameter for name in names)


def _stream(blocks: Iterator[NumberBlock], source: str, target: str, rule: _ValueRule) -> None:
    """Convert and write block by block, in the memory of one."""
    # A mistake in the names is none of a line.
    rule.results(NumberBlock([], []), source, target)
    told: set[str] = set()
    for block in blocks:
        try:
            lines, cautions = rule.results(block, source, target)
        except MdfconvError as error:
            raise _at_its_line(error, block, source, target, rule) from None
        for caution in dict.fromkeys(cautions):
            if caution not in told:
                tell(f"note: {caution}")
                told.add(caution)
        typer.echo("\n".join(lines))


def _at_its_line(
    error: MdfconvError, block: NumberBlock, source: str, target: str, rule: _ValueRule
) -> MdfconvError:
    """Return the error of the first value that has one, with its line of standard input."""
    if not block.lines:
        return error
    low, high = 0, len(block.numbers)
    while high - low > 1:
        middle = (low + high) // 2
        try:
            rule.results(NumberBlock(block.numbers[low:middle], []), source, target)
            low = middle
        except MdfconvError:
            high = middle
    try:
        rule.results(NumberBlock(block.numbers[low:high], []), source, target)
    except MdfconvError as alone:
        reason = f"line {block.lines[low]} of standard input: {alone.reason}"
        return MdfconvError(reason, alone.hint)
    return error


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


def _write_tables(conversions: list[list[Conversion]], rule: _ValueRule) -> None:
    """Write tables a target: the methods under the metric, and the fits under the others."""
    out = console()
    for group in conversions:
        _print_methods(group, rule)
        for caution in dict.fromkeys(text for conversion in group for text in conversion.cautions):
            out.print(f"Note: {caution}.")
        inexact = [conversion for conversion in group if not conversion.exact]
        if not inexact:
            out.print("Exact: the same form.")
            continue
        metric = metric_named(inexact[0].metric)
        out.print(
            f"[dim]Errors under {metric} ({metric.purpose}): root mean square and maximum, "
            "relative to the source's.[/dim]"
        )
        if len(inexact) <= _VALUES_WITH_ALTERNATIVES:
            _print_metrics(inexact, rule)


def _headings(conversion: Conversion) -> list[str]:
    ends = [endpoint(name) for name in (conversion.source, conversion.target)]
    second = ends[1].distribution.second_parameter
    return [f"{end.label} {end.stored.symbol}" for end in ends] + (
        [second.symbol] if second else []
    )


def _print_methods(group: list[Conversion], rule: _ValueRule) -> None:
    headings = _headings(group[0])
    rows, styles = [], []
    for conversion in group[:ROWS_SHOWN]:
        rows.append(_row(conversion, headings))
        styles.append("bold")
        if len(group) <= _VALUES_WITH_ALTERNATIVES and not conversion.exact:
            others = _answers(conversion, rule.others(conversion))
            rows += [_row(other, headings, first=False) for other in others]
            styles += ["dim"] * (len(rows) - len(styles))
    title = f"{' → '.join(headings[:2])}, {group[0].metric}"
    print_table(list(rows[0]), rows, title, styles, count=len(group))


def _print_metrics(group: list[Conversion], rule: _ValueRule) -> None:
    headings = _headings(group[0])
    rows = []
    for conversion in group:
        others = _answers(conversion, rule.under_other_metrics(conversion))
        for number, other in enumerate(others):
            metric = metric_named(other.metric)
            row = _row(other, headings, first=number == 0)
            rows.append(row | {"fit under": str(metric), "for": metric.purpose})
    columns = [*headings, "fit under", "for"]
    print_table(columns, rows, "Fits under the other metrics")


def _row(conversion: Conversion, headings: list[str], *, first: bool = True) -> dict[str, Any]:
    numbers = [conversion.value if first else None, conversion.result, conversion.gamma]
    return dict(zip(headings, numbers, strict=False)) | {
        "method": conversion.method,
        "RMSE": conversion.rmse,
        "max error": conversion.max_error,
    }


def _answers(conversion: Conversion, rules: Iterator[_ValueRule]) -> Iterator[Conversion]:
    """Yield what other rules make of a value; nothing for one that has no answer."""
    for rule in rules:
        with suppress(MdfconvError):
            yield from rule.explain(
                conversion.value, conversion.source, conversion.target, errors=True
            )


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
