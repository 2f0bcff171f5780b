"""``mdfconv mtl``."""

from __future__ import annotations

import math
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mdfconv.cli.options import ExposureOption, MetricOption, chosen_metric
from mdfconv.cli.tables import ROWS_SHOWN, print_table, progress, rich_table, tell, tell_rest
from mdfconv.errors import MdfconvError
from mdfconv.output.records import json_text

if TYPE_CHECKING:
    from mdfconv.fitting.metrics import Metric
    from mdfconv.scene.mtl import Material, MtlConversion
    from mdfconv.scene.mtl_files import Destination


class ReportFormat(StrEnum):
    """The forms of the report on what was converted."""

    table = "table"
    json = "json"


def command(
    libraries: Annotated[
        list[str],
        typer.Argument(
            metavar="IN.mtl...", help="Material libraries, or patterns such as '*.mtl'."
        ),
    ],
    output: Annotated[
        str | None,
        typer.Option("--output", "-o", metavar="OUT", help="New file, or a folder that exists."),
    ] = None,
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
    in_place: Annotated[
        bool,
        typer.Option("--in-place", help="Change the library itself; the original is kept as .bak."),
    ] = False,
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
    format_: Annotated[
        ReportFormat,
        typer.Option(
            "--format", help="Report: table on standard error or json on standard output."
        ),
    ] = ReportFormat.table,
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
    from mdfconv.scene.mtl_files import (
        choose_outputs,
        find_libraries,
        read_library,
        write_libraries,
    )

    wanted = to.strip().lower()
    if wanted != "roughness" and (compare or textures):
        raise MdfconvError("--compare and --textures go with --to roughness")
    kept = chosen_metric(metric, exposure)
    converted = []
    problems: list[tuple[Path, int, str]] = []
    for destination in choose_outputs(find_libraries(libraries), output, in_place=in_place):
        data = read_library(destination.source)
        names: dict[str, str] = {}
        if textures:
            names, failures = _convert_textures(destination, data, kept, exponent_max)
            problems += [(destination.source, *failure) for failure in failures]
        conversion = convert_mtl(data, wanted, metric=kept, replace=replace, texture_names=names)
        converted.append((destination, data, conversion))
    written = write_libraries(converted)
    _report(converted, kept, form=format_, compare=compare)
    for destination, _, conversion in converted:
        problems += [(destination.source, *problem) for problem in conversion.problems]
        tell(
            f"{'wrote' if destination in written else 'nothing to change in'} {destination.output}"
        )
    for path, line, text in problems:
        tell(f"{path}:{line}: {text}: left as it is")
    if problems:
        raise typer.Exit(1)


def _convert_textures(
    destination: Destination, data: bytes, metric: Metric, exponent_max: float
) -> tuple[dict[str, str], list[tuple[int, str]]]:
    """Convert the textures of a library; return their new names, and problems by line."""
    from mdfconv.scene.mtl import texture_statements
    from mdfconv.scene.mtl_textures import convert_textures

    textures = texture_statements(data)
    paths = destination.source, destination.output
    with progress("Textures", len(textures)) as advance:
        return convert_textures(textures, *paths, metric, exponent_max, advance)


def _report(
    converted: list[tuple[Destination, bytes, MtlConversion]],
    metric: Metric,
    *,
    form: ReportFormat,
    compare: bool,
) -> None:
    from mdfconv.scene.shininess import IMPORTER_RULES

    records = [
        {
            "file": str(destination.source),
            "output": str(destination.output),
            "metric": str(metric),
            "materials": _rows(conversion.materials, metric, compare=compare),
            "textures": [vars(texture) for texture in conversion.textures],
            "problems": [{"line": line, "problem": text} for line, text in conversion.problems],
        }
        for destination, _, conversion in converted
    ]
    if form is ReportFormat.json:
        typer.echo(json_text(records))
        return
    for record in records:
        _print_table(record, list(IMPORTER_RULES) if compare else [])


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
            row |= {r.rule: {"roughness": r.roughness, "rmse": r.rmse} for r in results}
    return rows


def _print_table(record: dict[str, Any], rules: list[str]) -> None:
    """Print what was converted to standard error."""
    rows = record["materials"]
    shown = [
        {
            "material": row["name"],
            "Ns": _number(row["shininess"], 6),
            "Pr": _number(row["roughness"], 6),
            "RMSE": _number(row["rmse"], 3),
            **{rule: _importer(row[rule]) for rule in rules},
            "notes": "; ".join(row["notes"]),
        }
        for row in rows[:ROWS_SHOWN]
    ]
    if shown:
        title = f"{record['file']}, {record['metric']} metric"
        right = ["Ns", "Pr", "RMSE", *rules]
        print_table(rich_table(list(shown[0]), shown, title, right=right), err=True)
    else:
        typer.echo(f"{record['file']}: nothing to convert", err=True)
    tell_rest(len(rows), "--format json")
    for texture in record["textures"]:
        typer.echo(f"{texture['keyword']} {texture['file']} (line {texture['line']})", err=True)


def _number(value: float, digits: int) -> str:
    return "—" if math.isnan(value) else f"{value:.{digits}g}"


def _importer(result: dict[str, float]) -> str:
    mirror = math.isinf(result["rmse"])
    return f"{result['roughness']:.3g} ({'a mirror' if mirror else _number(result['rmse'], 2)})"
