"""``mdfconv mtl``."""

from __future__ import annotations

import math
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mdfconv.errors import MdfconvError

if TYPE_CHECKING:
    from mdfconv.scene.mtl import Material, MtlConversion
    from mdfconv.scene.mtl_files import Place

# Longer tables are cut on the screen; JSON has every row.
_ROWS_SHOWN = 100


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
    metric: Annotated[
        str,
        typer.Option(
            metavar="METRIC",
            help="What is kept: energy (the light), display (the picture on a screen) or unit "
            "(the shape of the lobe).",
        ),
    ] = "energy",
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
    from mdfconv.fitting.metrics import metric as find_metric
    from mdfconv.scene.mtl import convert_mtl
    from mdfconv.scene.mtl_files import find_libraries, place_outputs, read_library, write_libraries

    wanted = to.strip().lower()
    if wanted != "roughness" and (compare or textures):
        raise MdfconvError("--compare and --textures go with --to roughness")
    measure = find_metric(metric)
    found = []
    problems: list[tuple[Path, int, str]] = []
    for place in place_outputs(find_libraries(libraries), output, in_place=in_place):
        data = read_library(place.source)
        names: dict[str, str] = {}
        if textures:
            names, failed = _convert_textures(place, data, metric, exponent_max)
            problems += [(place.source, *problem) for problem in failed]
        conversion = convert_mtl(data, wanted, metric=measure, replace=replace, texture_names=names)
        found.append((place, data, conversion))
    written = write_libraries(found)
    _report(found, measure, form=format_, compare=compare)
    for place, _, conversion in found:
        problems += [(place.source, *problem) for problem in conversion.problems]
        done = "wrote" if place in written else "nothing to change in"
        typer.echo(f"mdfconv: {done} {place.output}", err=True)
    for path, line, text in problems:
        typer.echo(f"mdfconv: {path}:{line}: {text}: left as it is", err=True)
    if problems:
        raise typer.Exit(1)


def _convert_textures(
    place: Place, data: bytes, metric: str, exponent_max: float
) -> tuple[dict[str, str], list[tuple[int, str]]]:
    """Convert the textures of a library; return their new names, and problems by line."""
    from mdfconv.cli.output import progress
    from mdfconv.scene.mtl import texture_statements
    from mdfconv.scene.mtl_textures import convert_textures

    textures = texture_statements(data)
    with progress("Textures", len(textures)) as advance:
        return convert_textures(textures, place.source, place.output, metric, exponent_max, advance)


def _report(
    found: list[tuple[Place, bytes, MtlConversion]],
    measure: Any,
    *,
    form: ReportFormat,
    compare: bool,
) -> None:
    from mdfconv.reports.text import json_text

    records = [
        {
            "file": str(place.source),
            "output": str(place.output),
            "metric": measure.name,
            "materials": _rows(conversion.materials, measure, compare=compare),
            "textures": [vars(texture) for texture in conversion.textures],
            "problems": [{"line": line, "problem": text} for line, text in conversion.problems],
        }
        for place, _, conversion in found
    ]
    if form is ReportFormat.json:
        typer.echo(json_text(records))
        return
    for record in records:
        _print_table(record)


def _rows(materials: tuple[Material, ...], measure: Any, *, compare: bool) -> list[dict[str, Any]]:
    rows: list[dict[str, Any]] = [
        vars(material) | {"notes": list(material.notes)} for material in materials
    ]
    if compare:
        import numpy as np

        from mdfconv.scene.shininess import IMPORTER_RULES, error_of, importer_roughness

        exponents = np.array([material.shininess for material in materials])
        for rule in IMPORTER_RULES:
            given = importer_roughness(rule, exponents)
            errors = error_of(exponents, given, measure)
            for row, roughness, error in zip(rows, given.tolist(), errors.tolist(), strict=True):
                row[rule] = {"roughness": roughness, "rmse": error}
    return rows


def _print_table(record: dict[str, Any]) -> None:
    """Print what was converted to standard error."""
    from rich import box
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    rows = record["materials"]
    rules = [key for key in (rows[0] if rows else ()) if key.startswith("1 -")]
    table = Table(
        box=box.SIMPLE_HEAD,
        title=f"{record['file']}, {record['metric']} metric",
        title_style="bold",
        title_justify="left",
    )
    for heading in ("material", "Ns", "Pr", "RMSE", *rules, "notes"):
        table.add_column(heading, justify="left" if heading in ("material", "notes") else "right")
    for row in rows[:_ROWS_SHOWN]:
        numbers = (row["shininess"], row["roughness"])
        table.add_row(
            escape(row["name"]),
            *("—" if math.isnan(number) else f"{number:.6g}" for number in numbers),
            "—" if math.isnan(row["rmse"]) else f"{row['rmse']:.3g}",
            *(f"{row[rule]['roughness']:.3g} ({_error(row[rule]['rmse'])})" for rule in rules),
            "; ".join(row["notes"]),
        )
    out = Console(stderr=True, width=None if Console(stderr=True).is_terminal else 160)
    if rows:
        out.print(table)
    else:
        out.print(f"{record['file']}: nothing to convert", highlight=False)
    if len(rows) > _ROWS_SHOWN:
        out.print(
            f"… and {len(rows) - _ROWS_SHOWN} more; --format json has them all", highlight=False
        )
    for texture in record["textures"]:
        typer.echo(f"{texture['keyword']} {texture['file']} (line {texture['line']})", err=True)


def _error(rmse: float) -> str:
    return "a mirror" if rmse == float("inf") else f"{rmse:.2g}"
