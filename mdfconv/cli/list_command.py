"""``mdfconv list``."""

from __future__ import annotations

import sys
from enum import StrEnum
from typing import Annotated, Any

import typer

from mdfconv.cli.output import console
from mdfconv.distributions import Distribution, list_distributions
from mdfconv.distributions.base import AnisotropicDistribution
from mdfconv.distributions.gtr import GTR
from mdfconv.distributions.parameter import Parameter
from mdfconv.reports.text import json_text


class ListFormat(StrEnum):
    """The forms in which `list` writes the distributions."""

    table = "table"
    plain = "plain"
    json = "json"


def command(
    format_: Annotated[
        ListFormat | None,
        typer.Option(
            "--format", help="Form of the output: table on a terminal, plain names in a pipe."
        ),
    ] = None,
) -> None:
    """List the distributions: names, parameters, ranges, formulas and sources.

    Examples:

    mdfconv list

    mdfconv list --format json
    """
    form = format_ or (ListFormat.table if sys.stdout.isatty() else ListFormat.plain)
    if form is ListFormat.json:
        typer.echo(json_text([_record(entry) for entry in list_distributions()]))
    elif form is ListFormat.plain:
        typer.echo("\n".join(entry.name for entry in list_distributions()))
    else:
        console().print(_table())


def _record(entry: Distribution) -> dict[str, Any]:
    parameters = [entry.parameter, *([entry.exponent] if isinstance(entry, GTR) else [])]
    return {
        "name": entry.name,
        "aliases": entry.aliases,
        "anisotropic": isinstance(entry, AnisotropicDistribution),
        "parameters": [_parameter(parameter) for parameter in parameters],
        "encodings": {encoding.name: encoding.formula for encoding in entry.encodings},
        "unit_form": entry.unit_formula,
        "normalized_form": entry.normalized_formula,
        "source": entry.source,
    }


def _parameter(parameter: Parameter) -> dict[str, Any]:
    return {
        "name": parameter.name,
        "symbol": parameter.symbol,
        "legal": parameter.legal,
        "usual": parameter.usual,
    }


def _table() -> Any:
    from rich import box
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD, show_lines=True)
    table.add_column("name", style="bold", no_wrap=True)
    for heading in ("aliases", "parameter", "unit form D̄", "source"):
        table.add_column(heading)
    for entry in list_distributions():
        record = _record(entry)
        parameters = "; ".join(
            f"{parameter['name']}: {parameter['legal']}, usual {parameter['usual']}"
            for parameter in record["parameters"]
        )
        encodings = f"; encodings: {', '.join(record['encodings'])}" * bool(entry.encodings)
        pair = "; or a pair X,Y" * record["anisotropic"]
        table.add_row(
            entry.name,
            ", ".join(entry.aliases),
            parameters + pair + encodings,
            entry.unit_formula,
            entry.source,
        )
    return table
