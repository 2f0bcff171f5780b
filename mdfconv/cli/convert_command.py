"""``mdfconv convert``."""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace
from typing import Annotated, Any

import typer

from mdfconv.cli.names import one_parameter_distributions
from mdfconv.cli.output import Format, console, print_table, value_text
from mdfconv.conversion import DEFAULT_METHOD, Conversion, explain, find_method, list_methods
from mdfconv.conversion.endpoint import endpoint
from mdfconv.distributions import list_distributions
from mdfconv.distributions.base import AnisotropicDistribution
from mdfconv.errors import MdfconvError
from mdfconv.fitting.metrics import list_metrics
from mdfconv.reports.text import csv_text, json_text

_COLUMNS = ("from", "to", "value", "result", "method", "metric", "rmse", "max_error", "notes")
# With more values than this, the table leaves out what the other methods would give.
_VALUES_WITH_ALTERNATIVES = 10


def _names(incomplete: str) -> list[str]:
    return [entry.name for entry in list_distributions() if entry.name.startswith(incomplete)]


def _methods(incomplete: str) -> list[str]:
    return [entry.name for entry in list_methods() if entry.name.startswith(incomplete)]


def _metrics(incomplete: str) -> list[str]:
    return [name for name in list_metrics() if name.startswith(incomplete)]


def command(
    values: Annotated[
        list[str],
        typer.Argument(
            metavar="VALUE...",
            help="Parameters of the source; a pair X,Y for an anisotropic surface; - reads "
            "values from standard input, one a line.",
        ),
    ],
    source: Annotated[
        str,
        typer.Option(
            "--from",
            metavar="MDF",
            autocompletion=_names,
            help="Distribution that the values belong to, such as beckmann, ggx or "
            "blinn-phong; ggx:roughness and ggx:glossiness name stored forms of α.",
        ),
    ],
    target: Annotated[
        str,
        typer.Option(
            "--to",
            metavar="MDF",
            autocompletion=_names,
            help="Distribution to convert to, as for --from; all for every one.",
        ),
    ],
    method: Annotated[
        str,
        typer.Option(
            metavar="METHOD",
            autocompletion=_methods,
            help="closed-form (keeps the lobe's shape, approximately), half-angle, ward, peak, "
            "fit: exact, under the metric, or fast: the same from stored polynomials.",
        ),
    ] = DEFAULT_METHOD,
    metric: Annotated[
        str,
        typer.Option(
            metavar="METRIC",
            autocompletion=_metrics,
            help="What fit and fast keep, and what the errors measure: unit (the shape of the "
            "lobe), energy (the light) or display (the picture on a screen).",
        ),
    ] = "unit",
    exposure: Annotated[
        float,
        typer.Option(
            metavar="E", help="Exposure for the display metric; 1 puts the source's peak at white."
        ),
    ] = 1.0,
    gamma: Annotated[
        float | None, typer.Option(metavar="G", help="γ of gtr; 2 if not given, which is ggx.")
    ] = None,
    format_: Annotated[
        Format | None,
        typer.Option(
            "--format", help="Form of the output: table on a terminal, plain numbers in a pipe."
        ),
    ] = None,
) -> None:
    """Convert parameters from one distribution to another.

    Prints the bare numbers in a pipe, a table with errors and alternatives on a terminal.

    Examples:

    mdfconv convert --from beckmann --to ggx 0.2

    mdfconv convert --from blinn-phong --to ggx:roughness 10 100 1000

    mdfconv convert --from beckmann --to ggx --method fit --metric energy 0.2

    mdfconv convert --from ashikhmin-shirley --to ggx 100,20

    mdfconv convert --from beckmann --to all --format json 0.2

    seq 0.1 0.1 0.4 | mdfconv convert --from ggx --to beckmann --method half-angle -
    """
    numbers = _read(values)
    form = format_ or (Format.table if sys.stdout.isatty() else Format.plain)
    every = target.strip().lower() == "all"
    targets = _targets(numbers, source) if every else [target]
    rule = _Rule(method, metric, exposure, gamma)
    found, reasons = _convert(numbers, source, targets, rule, errors=form is not Format.plain)
    if reasons and (not every or not found):
        raise reasons[0]
    if metric != "unit" and not find_method(method).follows_metric:
        typer.echo(
            f"mdfconv: note: the metric is that of the errors; {method} does not depend on it, "
            "--method fit and --method fast do",
            err=True,
        )
    for reason in reasons:
        typer.echo(f"mdfconv: left out: {reason}", err=True)
    if form is Format.plain:
        _write_plain(found, named=every)
    elif form is Format.table:
        _write_tables(found, rule)
    else:
        records = [_record(entry) for group in found.values() for entry in group]
        typer.echo(json_text(records) if form is Format.json else _csv(records))


@dataclass(frozen=True)
class _Rule:
    """How to convert: the options of the command that all targets share."""

    method: str
    metric: str
    exposure: float
    gamma: float | None

    def explain(self, values: Any, source: str, target: str, *, errors: bool) -> list[Conversion]:
        return explain(
            values,
            source,
            target,
            self.method,
            metric=self.metric,
            exposure=self.exposure,
            gamma=self.gamma,
            errors=errors,
        )

    def others(self) -> list[_Rule]:
        """Return the other methods, the fit under every metric; fast is the fit again."""
        every = [
            replace(self, method=entry.name, metric=metric)
            for entry in list_methods()
            if entry.name != "fast"
            for metric in (list_metrics() if entry.follows_metric else [self.metric])
        ]
        return [rule for rule in every if rule != self]


def _read(values: list[str]) -> list[Any]:
    """Return numbers and pairs for the arguments, with standard input in place of ``-``."""
    if values.count("-") > 1:
        raise MdfconvError("standard input can be read only once: give one -")
    found: list[Any] = []
    for position, text in enumerate(values, start=1):
        if text == "-":
            found += _read_lines()
        else:
            where = f"value {position} of {len(values)}: " if len(values) > 1 else ""
            found.append(_number(text, where))
    return found


def _read_lines() -> list[Any]:
    if sys.stdin is None:
        raise MdfconvError("standard input is closed")
    try:
        lines = sys.stdin.read().removeprefix("\ufeff").splitlines()
    except UnicodeDecodeError:
        raise MdfconvError("standard input is not text") from None
    found = [
        _number(line.strip(), f"line {number} of standard input: ")
        for number, line in enumerate(lines, start=1)
        if line.strip()
    ]
    if not found:
        raise MdfconvError("standard input holds no values")
    return found


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
    pairs = any(isinstance(number, tuple) for number in numbers)
    fitting = one_parameter_distributions()
    if pairs:
        fitting = [e for e in list_distributions() if isinstance(e, AnisotropicDistribution)]
    return [entry.name for entry in fitting if entry is not own]


def _convert(
    numbers: list[Any],
    source: str,
    targets: list[str],
    rule: _Rule,
    *,
    errors: bool,
) -> tuple[dict[str, list[Conversion]], list[MdfconvError]]:
    """Return the conversions to each target, and why a target has none."""
    found, reasons = {}, []
    for target in targets:
        try:
            found[target] = rule.explain(numbers, source, target, errors=errors)
        except MdfconvError as error:
            reasons.append(error)
    return found, reasons


def _write_plain(found: dict[str, list[Conversion]], *, named: bool) -> None:
    """Write the bare results, behind their names where there are several targets."""
    entries = [entry for group in found.values() for entry in group]
    for caution in dict.fromkeys(caution for entry in entries for caution in entry.cautions):
        typer.echo(f"mdfconv: note: {caution}", err=True)
    lines = (f"{entry.target} " * named + value_text(entry.result) for entry in entries)
    typer.echo("\n".join(lines))


def _write_tables(found: dict[str, list[Conversion]], rule: _Rule) -> None:
    """Write a table a target: the chosen answer, and what the other methods would give."""
    out = console()
    for group in found.values():
        print_table(_table(group, rule))
        for note in dict.fromkeys(note for entry in group for note in entry.cautions):
            out.print(f"Note: {note}.")
    out.print(
        "[dim]Errors: root mean square and maximum, relative to the source's peak, on β from 0 "
        "to 4.8 β_half; of the unit forms, or in the metric of a fit.[/dim]"
    )


def _table(group: list[Conversion], rule: _Rule) -> Any:
    from rich import box
    from rich.table import Table

    first = group[0]
    sides = [endpoint(name, rule.gamma) for name in (first.source, first.target)]
    given, wanted = (f"{side.label} {side.stored.symbol}" for side in sides)
    table = Table(
        box=box.SIMPLE_HEAD, title=f"{given} → {wanted}", title_style="bold", title_justify="left"
    )
    table.add_column(given, justify="right", no_wrap=True)
    table.add_column(wanted, justify="right", style="bold", no_wrap=True)
    table.add_column("method", no_wrap=True)
    for heading in ("RMSE", "max error"):
        table.add_column(heading, justify="right", no_wrap=True)
    table.add_column("keeps", overflow="fold")
    for entry in group:
        table.add_row(*_cells(entry))
        if len(group) <= _VALUES_WITH_ALTERNATIVES:
            for cells in _alternatives(entry, rule):
                table.add_row(*cells, style="dim not bold")
            table.add_section()
    return table


def _cells(entry: Conversion) -> tuple[str, ...]:
    exact = entry.notes[0].startswith("exact")
    keeps = entry.notes[0] if exact else entry.notes[len(entry.cautions)].removeprefix("keeps the ")
    return (
        value_text(entry.value),
        value_text(entry.result),
        f"{entry.method} {entry.metric}"
        if find_method(entry.method).follows_metric
        else entry.method,
        f"{entry.rmse:.3g}",
        f"{entry.max_error:.3g}",
        keeps,
    )


def _alternatives(entry: Conversion, rule: _Rule) -> list[tuple[str, ...]]:
    """Return the rows of the methods that were not chosen, with their reason if none."""
    rows: list[tuple[str, ...]] = []
    for other in rule.others():
        try:
            found = other.explain(entry.value, entry.source, entry.target, errors=True)[0]
        except MdfconvError as error:
            rows.append(("", "—", other.method, "", "", str(error).split(";")[0]))
        else:
            rows.append(("", *_cells(found)[1:]))
    return rows


def _record(entry: Conversion) -> dict[str, Any]:
    return {
        "from": entry.source,
        "to": entry.target,
        "value": entry.value,
        "result": entry.result,
        "method": entry.method,
        "metric": entry.metric,
        "rmse": entry.rmse,
        "max_error": entry.max_error,
        "notes": entry.notes,
    }


def _csv(records: list[dict[str, Any]]) -> str:
    rows = [
        record
        | {
            key: ",".join(map(repr, record[key]))
            for key in ("value", "result")
            if isinstance(record[key], tuple)
        }
        | {"notes": "; ".join(record["notes"])}
        for record in records
    ]
    return csv_text(_COLUMNS, rows)
