"""``mdfconv list``."""

from __future__ import annotations

import math
from typing import Annotated, Any

import typer

from mdfconv.cli.options import (
    ExposureOption,
    Format,
    FormatOption,
    OptionalMetricOption,
    asked_metric,
)
from mdfconv.cli.tables import console, form_of, print_table, rich_table, write_table
from mdfconv.distributions import Distribution, list_distributions
from mdfconv.distributions.dialects import dialects_of
from mdfconv.distributions.parameter import Parameter
from mdfconv.errors import MdfconvError
from mdfconv.fitting.metrics import Metric, metric_named

# Importers' roughness is seen under light from all around.
_NATURAL = "environment"


def command(
    encodings: Annotated[
        bool,
        typer.Option(
            "--encodings", help="List what follows a colon: how files and programs store it."
        ),
    ] = False,
    metric: OptionalMetricOption = None,
    exposure: ExposureOption = None,
    format_: FormatOption = None,
) -> None:
    """List the distributions, or the forms in which files and programs store their parameters.

    With --encodings the errors are those of GGX with the roughness that a program makes of
    Blinn/Phong's exponent 10, 100 and 1000, under --metric, environment if not given.

    Examples:

    mdfconv list

    mdfconv list --encodings --metric energy

    mdfconv list --encodings --format json
    """
    if encodings:
        _list_encodings(asked_metric(metric, exposure) or metric_named(_NATURAL), format_)
        return
    if metric is not None or exposure is not None:
        raise MdfconvError("--metric is of --encodings")
    form = form_of(format_, in_pipe=Format.plain)
    records = [_record(mdf) for mdf in list_distributions()]
    if form is Format.table:
        console().print(_table(records))
    else:
        columns = ["name"] if form is Format.plain else list(records[0])
        write_table(columns, records, form)


def _list_encodings(metric: Metric, format_: Format | None) -> None:
    """Print the table of encodings and dialects."""
    from mdfconv.scene.encodings import EXPONENTS, encoding_records

    form = form_of(format_, in_pipe=Format.plain)
    records = encoding_records(metric)
    if form is not Format.table:
        write_table(["encoding"] if form is Format.plain else list(records[0]), records, form)
        return
    rows = [
        {
            "encoding": record["encoding"] + "[:L]" * (record["specular"] != "no"),
            "rule": "; ".join(filter(None, (record["formula"], record["clamped"]))),
            **{f"N {n}": _error(record[f"rmse_{n}"]) for n in EXPONENTS},
            "programs": record["programs"],
        }
        for record in records
    ]
    right = [f"N {n}" for n in EXPONENTS]
    title = f"Encodings, and the RMSE of their rules under {metric}"
    print_table(rich_table(list(rows[0]), rows, title, right=right))


def _error(rmse: float | None) -> str:
    if rmse is None:
        return ""
    return "mirror" if math.isinf(rmse) else f"{rmse:.2g}"


def _record(mdf: Distribution) -> dict[str, Any]:
    return {
        "name": mdf.name,
        "aliases": mdf.aliases,
        "anisotropic": mdf.anisotropic,
        "parameters": [_parameter(parameter) for parameter in mdf.parameters],
        "encodings": {encoding.name: encoding.formula for encoding in mdf.encodings}
        | {name: dialect.formula for name, dialect in dialects_of(mdf.name).items()},
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
