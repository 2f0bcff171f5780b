"""``mdfconv list``."""

from __future__ import annotations

from typing import Any

from mdfconv.cli.options import Format, FormatOption
from mdfconv.cli.tables import console, form_of, write_table
from mdfconv.distributions import Distribution, list_distributions
from mdfconv.distributions.parameter import Parameter


def command(format_: FormatOption = None) -> None:
    """List the distributions: names, parameters, ranges, formulas and sources.

    Examples:

    mdfconv list

    mdfconv list --format json
    """
    form = form_of(format_, in_pipe=Format.plain)
    records = [_record(mdf) for mdf in list_distributions()]
    if form is Format.table:
        console().print(_table(records))
    else:
        columns = ["name"] if form is Format.plain else list(records[0])
        write_table(columns, records, form)


def _record(mdf: Distribution) -> dict[str, Any]:
    return {
        "name": mdf.name,
        "aliases": mdf.aliases,
        "anisotropic": mdf.anisotropic,
        "parameters": [_parameter(parameter) for parameter in mdf.parameters],
        "encodings": {encoding.name: encoding.formula for encoding in mdf.encodings},
        "unit_form": mdf.unit_formula,
        "normalized_form": mdf.normalized_formula,
        "source": mdf.source,
    }


def _parameter(parameter: Parameter) -> dict[str, Any]:
    return {
        "name": parameter.name,
        "symbol": parameter.symbol,
        "legal": parameter.legal,
        "typical": list(parameter.typical),
        "larger_is_smoother": parameter.larger_is_smoother,
    }


def _table(records: list[dict[str, Any]]) -> Any:
    from rich import box
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD, show_lines=True)
    table.add_column("name", style="bold", no_wrap=True)
    for heading in ("aliases", "parameter", "unit form D̄", "source"):
        table.add_column(heading)
    for record in records:
        parameters = "; ".join(
            f"{parameter['name']}: {parameter['legal']}, typically "
            f"{parameter['typical'][0]:g} to {parameter['typical'][1]:g}"
            for parameter in record["parameters"]
        )
        encodings = f"; encodings: {', '.join(record['encodings'])}" * bool(record["encodings"])
        pair = "; or a pair X,Y" * record["anisotropic"]
        table.add_row(
            record["name"],
            ", ".join(record["aliases"]),
            parameters + pair + encodings,
            record["unit_form"],
            record["source"],
        )
    return table
