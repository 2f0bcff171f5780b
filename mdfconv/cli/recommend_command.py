"""``mdfconv recommend``."""

from __future__ import annotations

import sys
from enum import StrEnum
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mdfconv.cli.output import console, print_table, value_text

if TYPE_CHECKING:
    from mdfconv.benchmark.recommendation import Recommendation


class AnswerFormat(StrEnum):
    """The forms in which `recommend` answers."""

    table = "table"
    plain = "plain"
    csv = "csv"
    json = "json"
    markdown = "markdown"


def command(
    value: Annotated[float, typer.Argument(metavar="VALUE", help="Parameter of the surface.")],
    source: Annotated[
        str,
        typer.Option(
            "--from",
            metavar="MDF",
            help="Distribution that the value belongs to; ggx:roughness and ggx:glossiness name "
            "stored forms of α.",
        ),
    ],
    tolerance: Annotated[
        float,
        typer.Option(
            metavar="T",
            help="Largest error allowed under the metric, as a share of the source's peak.",
        ),
    ] = 0.05,
    metric: Annotated[
        str,
        typer.Option(
            metavar="METRIC",
            help="What has to be kept: unit (the shape of the lobe), energy (the light) or "
            "display (the picture on a screen).",
        ),
    ] = "unit",
    exposure: Annotated[
        float, typer.Option(metavar="E", help="Exposure for the display metric.")
    ] = 1.0,
    format_: Annotated[
        AnswerFormat | None,
        typer.Option(
            "--format",
            help="Form of the output: table on a terminal; in a pipe plain, which is name, "
            "parameter and method.",
        ),
    ] = None,
) -> None:
    """Recommend the cheapest distribution and conversion for a surface.

    Times every distribution on this machine, which takes about a second, and leaves out those
    whose best fit exceeds the tolerance. Of the quickest within 10 % it takes the one with the
    fewest operations, and the cheapest conversion that stays within the tolerance.

    Examples:

    mdfconv recommend --from beckmann 0.2

    mdfconv recommend --from blinn-phong 100 --tolerance 0.002

    mdfconv recommend --from ggx:roughness 0.5 --tolerance 0.1 --metric display --format json
    """
    from mdfconv.benchmark.recommendation import recommend
    from mdfconv.cli.names import one_parameter_distributions, one_parameter_names
    from mdfconv.conversion.endpoint import endpoint
    from mdfconv.fitting.metrics import metric as find_metric

    side = endpoint(source)
    one_parameter_names([side.distribution.name])
    found = recommend(
        side.distribution,
        float(side.decode(value)),
        one_parameter_distributions(),
        find_metric(metric, exposure),
        tolerance,
    )
    form = format_ or (AnswerFormat.table if sys.stdout.isatty() else AnswerFormat.plain)
    asked = {"from": side.label, "value": value, "metric": metric, "tolerance": tolerance}
    _write(found, asked, form)


def _write(found: Recommendation, asked: dict[str, Any], form: AnswerFormat) -> None:
    from mdfconv.reports.text import csv_text, json_text, markdown_text

    rows = found.records()
    columns = list(rows[0])
    if form is AnswerFormat.json:
        answer = {"chosen": found.chosen.distribution, "reason": found.reason}
        typer.echo(json_text(asked | answer | {"candidates": rows}))
    elif form is AnswerFormat.markdown:
        typer.echo(f"{markdown_text(columns, rows)}\n\n{_capital(found.reason)}")
    elif form is AnswerFormat.table:
        out = console()
        print_table(_table(rows, asked))
        out.print(_capital(found.reason))
        out.print(
            "[dim]Errors: root mean square and maximum under the metric, relative to the "
            "source's peak, on β from 0 to 4.8 β_half. ns: one evaluation in float32, now.[/dim]"
        )
    else:
        chosen = found.chosen
        line = f"{chosen.distribution} {value_text(chosen.parameter)} {chosen.method}"
        typer.echo(line if form is AnswerFormat.plain else csv_text(columns, rows))
        typer.echo(f"mdfconv: {found.reason}", err=True)


def _capital(sentence: str) -> str:
    return sentence[0].upper() + sentence[1:]


def _table(rows: list[dict[str, Any]], asked: dict[str, Any]) -> Any:
    from rich import box
    from rich.table import Table

    title = f"{asked['from']} {asked['value']:g} within {asked['tolerance']:g}, {asked['metric']}"
    table = Table(box=box.SIMPLE_HEAD, title=title, title_style="bold", title_justify="left")
    for heading in ("distribution", "parameter", "by", "ns", "operations", "RMSE", "max error"):
        text = heading in ("distribution", "by")
        table.add_column(heading, justify="left" if text else "right", no_wrap=True)
    table.add_column("within", justify="center")
    for row in rows:
        table.add_row(
            row["distribution"],
            value_text(row["parameter"]),
            row["method"],
            f"{row['ns']:.3g}",
            str(row["operations"]),
            f"{row['rmse']:.3g}",
            f"{row['max_error']:.3g}",
            "✓" if row["within"] else "",
            style="bold" if row["chosen"] else "" if row["within"] else "dim",
        )
    return table
