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
from mdfconv.cli.tables import console, form_of, print_table, write_table
from mdfconv.distributions import Distribution, list_distributions
from mdfconv.distributions.dialects import dialects_of
from mdfconv.distributions.parameter import Parameter
from mdfconv.errors import MdfconvError
from mdfconv.fitting.metrics import Metric, metric_named

# Importers' roughness is seen under light from all around.
_NATURAL = "environment"
# Of the table of encodings what a narrow terminal leaves out first.
_SECONDARY = ("N 100", "programs", "N 10", "N 1000")
_FOOTNOTE = (
    "L is the weight of the specular lobe, which --specular gives, too. A mirror is what a rule "
    "makes of a surface that is none."
)


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
        _print_table(records)
    else:
        columns = ["name"] if form is Format.plain else list(records[0])
        write_table(columns, records, form)


def _list_encodings(metric: Metric, format_: Format | None) -> None:
    """Print the table of encodings and dialects."""
    from mdfconv.scene.shininess import EXPONENTS, encoding_records

    form = form_of(format_)
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
    title = f"Encodings, and the RMSE of their rules under {metric}"
    print_table(list(rows[0]), rows, title, secondary=_SECONDARY)
    console().print(_FOOTNOTE)


def _error(rmse: float | None) -> float | str | None:
    """Return an error in two digits; none where there is no roughness."""
    if rmse is None:
        return None
    return "mirror" if math.isinf(rmse) else float(f"{rmse:.2g}")


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


def _print_table(records: list[dict[str, Any]]) -> None:
    rows = [
        {
            "name": record["name"],
            "parameter": "; ".join(
                f"{parameter['name']}: {parameter['legal']}, typically "
                f"{parameter['typical'][0]:g} to {parameter['typical'][1]:g}"
                for parameter in record["parameters"]
            )
            + "; or a pair X,Y" * record["anisotropic"],
            "aliases": ", ".join(record["aliases"]),
            "unit form D̄": record["unit_form"],
            "source": record["source"],
            "encodings": ", ".join(record["encodings"]),
        }
        for record in records
    ]
    print_table(list(rows[0]), rows)
