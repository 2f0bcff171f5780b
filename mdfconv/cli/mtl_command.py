"""``mdfconv mtl``."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mdfconv.cli.material_files import (
    InPlaceOption,
    ReportFormat,
    ReportFormatOption,
    ResultOption,
    convert_files,
    number_cell,
)
from mdfconv.cli.options import ExposureOption, MetricOption, chosen_metric
from mdfconv.cli.tables import ROWS_SHOWN, print_table, progress, rich_table, tell_rest
from mdfconv.errors import MdfconvError
from mdfconv.output.records import json_text

if TYPE_CHECKING:
    from mdfconv.fitting.metrics import Metric
    from mdfconv.scene.material_files import Destination
    from mdfconv.scene.mtl import Material, MtlConversion


def command(
    libraries: Annotated[
        list[str],
        typer.Argument(
            metavar="IN.mtl...", help="Material libraries, or patterns such as '*.mtl'."
        ),
    ],
    output: ResultOption = None,
    to: Annotated[
        str,
        typer.Option(
            metavar="WHAT", help="roughness (Pr from Ns) or shininess (Ns from Pr, the inverse)."
        ),
    ] = "roughness",
    metric: MetricOption = "environment",
    exposure: ExposureOption = None,
    replace: Annotated[
        bool, typer.Option("--replace", help="Drop the statement that was converted.")
    ] = False,
    in_place: InPlaceOption = False,
    textures: Annotated[
        bool,
        typer.Option(
            "--textures", help="Convert the textures of map_Ns, too, into map_Pr beside the result."
        ),
    ] = False,
    exponent_max: Annotated[
        float,
        typer.Option(metavar="N", help="Exponent of a white texel in those textures."),
    ] = 1000.0,
    compare: Annotated[
        bool,
        typer.Option("--compare", help="Add what importers' rules make of Ns, and their error."),
    ] = False,
    format_: ReportFormatOption = ReportFormat.table,
) -> None:
    """Convert the shininess of Wavefront material libraries to roughness, or back.

    Adds or replaces Pr from Ns, the best fit of GGX (alpha = Pr squared) to Blinn/Phong; every
    other byte is kept. A statement that is not a number is reported and left, and the exit
    status is 1.

    Examples:

    mdfconv mtl chair.mtl -o chair-pbr.mtl

    mdfconv mtl --in-place --replace --metric display 'assets/*.mtl'

    mdfconv mtl chair.mtl -o chair-pbr.mtl --compare --format json

    mdfconv mtl --to shininess chair-pbr.mtl -o chair-phong.mtl
    """
    from mdfconv.scene.mtl import convert_mtl

    wanted = to.strip().lower()
    if wanted != "roughness" and (compare or textures):
        raise MdfconvError("--compare and --textures go with --to roughness")
    kept = chosen_metric(metric, exposure)

    def convert(destination: Destination, data: bytes) -> MtlConversion:
        names, files, problems = (
            _convert_textures(destination, data, kept, exponent_max) if textures else ({}, {}, [])
        )
        conversion = convert_mtl(data, wanted, metric=kept, replace=replace, texture_names=names)
        every = (*problems, *conversion.problems)
        return dataclasses.replace(conversion, files=files, problems=every)

    convert_files(
        libraries,
        output,
        in_place=in_place,
        convert=convert,
        report=lambda converted: _report(converted, kept, form=format_, compare=compare),
    )


def _convert_textures(
    destination: Destination, data: bytes, metric: Metric, exponent_max: float
) -> tuple[dict[str, str], dict[Path, bytes], list[tuple[int, str]]]:
    """Convert the textures of a library; return new names, new files, and problems by line."""
    from mdfconv.scene.mtl import texture_statements
    from mdfconv.scene.mtl_textures import convert_textures

    textures = texture_statements(data)
    paths = destination.source, destination.output
    with progress("Textures", len(textures)) as advance:
        return convert_textures(textures, *paths, metric, exponent_max, advance)


def _report(
    converted: list[tuple[Destination, MtlConversion]],
    metric: Metric,
    *,
    form: ReportFormat,
    compare: bool,
) -> None:
    records = [
        {
            "file": str(destination.source),
            "output": str(destination.output),
            "metric": str(metric),
            "materials": _rows(conversion.materials, metric, compare=compare),
            "textures": [vars(texture) for texture in conversion.textures],
            "problems": [{"line": line, "problem": text} for line, text in conversion.problems],
        }
        for destination, conversion in converted
    ]
    if form is ReportFormat.json:
        typer.echo(json_text(records))
        return
    for record in records:
        _print_table(record)
        if compare:
            _print_importers(record)


def _rows(
    materials: tuple[Material, ...], metric: Metric, *, compare: bool
) -> list[dict[str, Any]]:
    rows: list[dict[str, Any]] = [
        vars(material) | {"notes": list(material.notes)} for material in materials
    ]
    if compare:
        import numpy as np

        from mdfconv.scene.shininess import importer_results

        exponents = np.array([material.shininess for material in materials])
        for row, results in zip(rows, importer_results(exponents, metric), strict=True):
            row["importers"] = {
                r.importer: {"roughness": r.roughness, "rmse": r.rmse} for r in results
            }
    return rows


def _print_table(record: dict[str, Any]) -> None:
    """Print what was converted to standard error."""
    rows = record["materials"]
    shown = [
        {
            "material": row["name"],
            "Ns": number_cell(row["shininess"], 6),
            "Pr": number_cell(row["roughness"], 6),
            "RMSE": number_cell(row["rmse"], 3),
            "notes": "; ".join(row["notes"]),
        }
        for row in rows[:ROWS_SHOWN]
    ]
    if shown:
        title = f"{record['file']}, {record['metric']} metric"
        right = ["Ns", "Pr", "RMSE"]
        print_table(rich_table(list(shown[0]), shown, title, right=right), err=True)
    else:
        typer.echo(f"{record['file']}: nothing to convert", err=True)
    tell_rest(len(rows), "--format json")
    for texture in record["textures"]:
        typer.echo(f"{texture['keyword']} {texture['file']} (line {texture['line']})", err=True)


def _print_importers(record: dict[str, Any]) -> None:
    """Print what importers make of each material to standard error."""
    rows = [
        {
            "material": row["name"],
            "importer": name,
            "roughness": number_cell(result["roughness"], 3),
            "RMSE": "a mirror" if math.isinf(result["rmse"]) else number_cell(result["rmse"], 3),
        }
        for row in record["materials"]
        for name, result in row["importers"].items()
    ]
    if rows:
        table = rich_table(list(rows[0]), rows[:ROWS_SHOWN], "Importers", right=list(rows[0])[2:])
        print_table(table, err=True)
        tell_rest(len(rows), "--format json")
