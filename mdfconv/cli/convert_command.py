"""``mdfconv convert``."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
import typer

from mdfconv.cli import options, process, tables
from mdfconv.cli.options import argument
from mdfconv.conversion import Conversion, explain, list_methods
from mdfconv.conversion.explanation import explained
from mdfconv.conversion.values import FREE, ConversionRule, Gamma, Value, holds_pairs
from mdfconv.distributions import list_distributions, one_parameter_distributions
from mdfconv.distributions.endpoint import endpoint, with_specular
from mdfconv.distributions.parameter import number_text, percent_hint
from mdfconv.errors import MdfconvError
from mdfconv.fitting.metrics import Metric, metric_named
from mdfconv.registry import ALL

# With more values than this, the table leaves out what the other methods would give.
_VALUES_WITH_ALTERNATIVES = 10
_INPUT = "-"
# Characters of standard input read at a time: some hundred thousand numbers.
_BLOCK = 1 << 21
# As a pair this is no surface: one of its axes would be a mirror.
_DECIMAL_COMMA = re.compile(r"\s*[+-]?0,\d+\s*\Z")

_VALUES = argument(
    "VALUE...",
    "Parameters of the source; a pair X,Y for an anisotropic surface; - reads "
    "values from standard input, one a line.",
)


def command(
    values: Annotated[list[str], _VALUES],
    source: options.FromOption,
    target: options.ToOption,
    method: options.MethodOption = None,
    metric: options.OptionalMetricOption = None,
    exposure: options.ExposureOption = None,
    gamma: options.GammaOption = None,
    specular: options.SpecularOption = None,
    format_: options.FormatOption = None,
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
    form = tables.form_of(format_, in_pipe="plain")
    asked, fixed_or_free = options.asked_metric(metric, exposure), options.chosen_gamma(gamma)
    every, free = target.strip().lower() == ALL, fixed_or_free == FREE
    source, target = with_specular(source, source if every else target, specular)
    if form == "plain" and not every and not free:
        _stream(read_blocks(values), ConversionRule(source, target, method, asked, fixed_or_free))
        return
    numbers = [number for block in read_blocks(values) for number in block.numbers]
    groups: list[list[Conversion]] = []
    refusals: list[MdfconvError] = []
    errors = form != "plain"
    for name in _targets(numbers, source) if every else [target]:
        own = fixed_or_free if not every or _takes_gamma(source, name, free=free) else None
        try:
            groups.append(
                explain(numbers, source, name, method, metric=asked, gamma=own, errors=errors)
            )
        except MdfconvError as error:
            refusals.append(error)
    if refusals and (not every or not groups):
        raise refusals[0]
    for refusal in refusals:
        process.tell(f"left out: {refusal}")
    conversions = [conversion for group in groups for conversion in group]
    if form == "plain":
        _write_plain(conversions, named=every, free=free)
    elif form == "table":
        for group in groups:
            _print_group(group, fixed_or_free, exposure)
    else:
        records = [_record(conversion) for conversion in conversions]
        columns = [name for name in records[0] if any(r[name] is not None for r in records)]
        typer.echo(tables.table_text(columns, records, form))


def _targets(numbers: list[Value], source: str) -> list[str]:
    """Return the distributions that `all` stands for: those that take such values."""
    own = endpoint(source).distribution
    targets = one_parameter_distributions()
    if holds_pairs(numbers):
        targets = [target for target in list_distributions() if target.anisotropic]
    return [target.name for target in targets if target is not own]


def _takes_gamma(source: str, target: str, *, free: bool) -> bool:
    """Return whether a γ means something for one of many targets."""
    names = [target] if free else [source, target]
    return any(endpoint(name).distribution.second_parameter for name in names)


@dataclass(frozen=True)
class NumberBlock:
    """Values that are converted together, and their lines if they are from standard input."""

    numbers: list[Value]
    lines: list[int]


def read_blocks(values: list[str]) -> Iterator[NumberBlock]:
    """Yield the values of the arguments, with standard input in place of ``-``."""
    if values.count(_INPUT) > 1:
        raise MdfconvError("standard input can be read only once: give one -")
    numbers: list[Value] = []
    for position, text in enumerate(values, start=1):
        if text == _INPUT:
            if numbers:
                yield NumberBlock(numbers, [])
                numbers = []
            yield from _input_blocks()
        else:
            where = f"value {position} of {len(values)}: " if len(values) > 1 else ""
            numbers.append(_number(text, where))
    if numbers:
        yield NumberBlock(numbers, [])


def _input_blocks() -> Iterator[NumberBlock]:
    if sys.stdin is None:
        raise MdfconvError("standard input is closed")
    start, empty = 1, True
    try:
        while lines := sys.stdin.readlines(_BLOCK):
            if start == 1:
                lines[0] = lines[0].removeprefix("\ufeff")
            block = _block(lines, start)
            start += len(lines)
            if block.numbers:
                empty = False
                yield block
    except UnicodeDecodeError:
        raise MdfconvError("standard input is not text") from None
    if empty:
        raise MdfconvError("standard input holds no values")


def _block(lines: list[str], start: int) -> NumberBlock:
    try:
        return NumberBlock(list(map(float, lines)), list(range(start, start + len(lines))))
    except ValueError:
        # Pairs and blank lines, or a mistake.
        kept = [(line.strip(), number) for number, line in enumerate(lines, start) if line.strip()]
        numbers = [_number(text, f"line {number} of standard input: ") for text, number in kept]
        return NumberBlock(numbers, [number for _, number in kept])


def _number(text: str, where: str) -> Value:
    try:
        parts = [float(part) for part in text.split(",")]
    except ValueError:
        raise MdfconvError(f"{where}'{text}' is not a number", percent_hint(text)) from None
    if _DECIMAL_COMMA.match(text):
        hint = f"did you mean {text.strip().replace(',', '.')}?"
        raise MdfconvError(f"{where}'{text}' is a pair whose first number is 0", hint)
    if len(parts) > 2:
        raise MdfconvError(f"{where}'{text}' is not a pair X,Y")
    return (parts[0], parts[1]) if len(parts) == 2 else parts[0]


def _stream(blocks: Iterable[NumberBlock], rule: ConversionRule) -> None:
    """Convert and write block by block, in the memory of one."""
    # A mistake in the names is none of a line.
    _results([], rule)
    told: set[str] = set()
    for block in blocks:
        try:
            lines, cautions = _results(block.numbers, rule)
        except MdfconvError as error:
            raise _at_its_line(error, block, rule) from None
        _tell_new(cautions, told)
        typer.echo("\n".join(lines))


def _results(numbers: list[Value], rule: ConversionRule) -> tuple[list[str], list[str]]:
    """Return the results of a block as text, and what they call for."""
    if holds_pairs(numbers):
        conversions = explained(numbers, rule, errors=False)
        cautions = [text for conversion in conversions for text in conversion.cautions]
        return [tables.value_text(conversion.result) for conversion in conversions], cautions
    converted = rule.convert(np.array(numbers, dtype=float))
    return list(map(number_text, converted.stored.tolist())), rule.true_cautions(converted)


def _at_its_line(error: MdfconvError, block: NumberBlock, rule: ConversionRule) -> MdfconvError:
    """Return the error of the first value that has one, with its line of standard input."""
    if not block.lines:
        return error
    low, high = 0, len(block.numbers)
    while high - low > 1:
        middle = (low + high) // 2
        try:
            _results(block.numbers[low:middle], rule)
            low = middle
        except MdfconvError:
            high = middle
    try:
        _results(block.numbers[low:high], rule)
    except MdfconvError as alone:
        reason = f"line {block.lines[low]} of standard input: {alone.reason}"
        return MdfconvError(reason, alone.hint)
    return error


def _tell_new(cautions: Iterable[str], told: set[str]) -> None:
    """Tell each caution that has not been told yet."""
    for caution in cautions:
        if caution not in told:
            process.tell(f"note: {caution}")
            told.add(caution)


def _write_plain(conversions: list[Conversion], *, named: bool, free: bool) -> None:
    """Write the bare results, behind their names where there are several targets."""
    _tell_new((text for conversion in conversions for text in conversion.cautions), set())
    for conversion in conversions:
        numbers = [conversion.result, conversion.gamma if free else None]
        words = [tables.value_text(number) for number in numbers if number is not None]
        typer.echo(" ".join([conversion.target, *words] if named else words))


def _print_group(group: list[Conversion], gamma: Gamma, exposure: float | None) -> None:
    """Print the conversions to a target by every method, and the fits under the other metrics."""
    out = tables.console()
    headings = _headings(group[0])
    rows: list[dict[str, Any]] = []
    styles: list[str] = []
    few = len(group) <= _VALUES_WITH_ALTERNATIVES and gamma != FREE
    methods = [method.name for method in list_methods()] if few else []
    for conversion in group[: tables.ROWS_SHOWN]:
        names = [name for name in methods if name != conversion.method and not conversion.exact]
        others = _others(conversion, gamma, [(name, conversion.metric) for name in names])
        rows.append(_row(conversion, headings))
        rows += [_row(other, headings, first=False) for other in others]
        styles += ["bold", *["dim"] * len(others)]
    title = f"{' → '.join(headings[:2])}, {group[0].metric}"
    tables.print_table(list(rows[0]), rows, title, styles, count=len(group))
    for caution in dict.fromkeys(text for conversion in group for text in conversion.cautions):
        out.print(f"Note: {caution}.")
    inexact = [conversion for conversion in group if not conversion.exact]
    if not inexact:
        out.print("Exact: the same form.")
        return
    metric = metric_named(inexact[0].metric)
    out.print(
        f"[dim]Errors under {metric} ({metric.purpose}): root mean square and maximum, "
        "relative to the source's.[/dim]"
    )
    if len(inexact) > _VALUES_WITH_ALTERNATIVES:
        return
    rows = []
    metrics = options.every_metric(exposure)
    for conversion in inexact:
        rules = [(None, metric) for metric in metrics if str(metric) != conversion.metric]
        for number, other in enumerate(_others(conversion, gamma, rules)):
            metric = metric_named(other.metric)
            row = _row(other, headings, first=number == 0)
            rows.append(row | {"fit under": str(metric), "for": metric.purpose})
    tables.print_table([*headings, "fit under", "for"], rows, "Fits under the other metrics")


def _others(
    chosen: Conversion, gamma: Gamma, rules: Iterable[tuple[str | None, str | Metric]]
) -> list[Conversion]:
    """Return what methods and metrics make of a value, but for those that have no answer."""
    found: list[Conversion] = []
    for method, metric in rules:
        with suppress(MdfconvError):
            found += explain(
                chosen.value, chosen.source, chosen.target, method, metric=metric, gamma=gamma
            )
    return found


def _headings(conversion: Conversion) -> list[str]:
    ends = [endpoint(name) for name in (conversion.source, conversion.target)]
    headings = [f"{end.label} {end.stored.symbol}" for end in ends]
    second = ends[1].distribution.second_parameter
    return [*headings, second.symbol] if second else headings


def _row(conversion: Conversion, headings: list[str], *, first: bool = True) -> dict[str, Any]:
    numbers = [conversion.value if first else None, conversion.result, conversion.gamma]
    return dict(zip(headings, numbers, strict=False)) | {
        "method": conversion.method,
        "RMSE": conversion.rmse,
        "max error": conversion.max_error,
    }


def _record(conversion: Conversion) -> dict[str, Any]:
    names = "value", "result", "gamma", "method", "metric", "rmse", "max_error", "notes"
    ends = {"from": conversion.source, "to": conversion.target}
    return ends | {name: getattr(conversion, name) for name in names}
