"""What the commands that convert files of materials share."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from enum import StrEnum
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

import typer

from mdfconv.cli.process import tell
from mdfconv.cli.tables import ROWS_SHOWN, print_table
from mdfconv.errors import MdfconvError

if TYPE_CHECKING:
    from mdfconv.fitting.metrics import Metric
    from mdfconv.scene.material_files import Destination, FileConversion

    Conversion = TypeVar("Conversion", bound=FileConversion)
else:
    Conversion = TypeVar("Conversion")


# Two milliseconds a row: of a hundred thousand materials the report is not to take the time.
MATERIALS_SHOWN = 100
_JSON = "--format json"


class ReportFormat(StrEnum):
    """The forms of the report on what was converted."""

    table = "table"
    json = "json"


ResultOption = Annotated[
    str | None,
    typer.Option(
        "--output",
        "-o",
        metavar="OUT",
        help="File, or a folder: one that exists, or out/ with a slash.",
    ),
]
InPlaceOption = Annotated[
    bool,
    typer.Option("--in-place", help="Change the file itself; the original is kept as .bak."),
]
ReportFormatOption = Annotated[
    ReportFormat,
    typer.Option("--format", help="Report: table on standard error or json on standard output."),
]


def convert_files(
    context: typer.Context,
    patterns: Sequence[str],
    output: str | None,
    *,
    in_place: bool,
    force: bool,
    metric: Metric,
    convert: Callable[[Destination, bytes], Conversion],
    report: Callable[[list[tuple[Destination, Conversion]]], None],
) -> None:
    """Convert files, write all or none, report, and exit with 1 if something had to be left.

    Parameters
    ----------
    context : typer.Context
        Of the command.
    patterns : sequence of str
        Names and glob patterns.
    output : str or None
        A file, or a folder; None in place.
    in_place : bool
        Whether the files themselves change.
    force : bool
        Whether files that exist are replaced.
    metric : Metric
        What the conversions keep.
    convert : callable
        From where a file goes, and its bytes, to its conversion.
    report : callable
        Prints what was converted.

    Raises
    ------
    MdfconvError
        If a file cannot be read, converted at all, or written; nothing is then changed.
    """
    from mdfconv.cli.outputs import Outputs, new_folder
    from mdfconv.output.files import find_files, is_stream
    from mdfconv.scene import material_files

    # A second name may be meant for the result.
    material_files.check_place(output, in_place=in_place)
    files = find_files(patterns)
    destinations = material_files.choose_outputs(files, output)
    if output and material_files.is_folder(output):
        new_folder(context, Path(output))
    results = [[] if each.backup else [each.output] for each in destinations]
    Outputs(*chain(*results), force=force, inputs=[*files, *metric.inputs])
    converted = []
    for destination, result in zip(destinations, results, strict=True):
        data = material_files.read_file(destination.source)
        conversion = convert(destination, data)
        if conversion.files and is_stream(destination.output):
            raise MdfconvError(f"no texture can stand beside {destination.output}: it is no file")
        # Which textures there are is known only now.
        inputs = *files, *metric.inputs, *conversion.inputs
        Outputs(*result, *conversion.files, force=force, inputs=inputs)
        converted.append((destination, data, conversion))
    written = material_files.write_conversions(converted, force=force)
    report([(destination, conversion) for destination, _, conversion in converted])
    problems = False
    for destination, _, conversion in converted:
        if destination in written:
            beside = [path for path in (destination.backup, *conversion.files) if path]
            for path in (destination.output, *beside):
                tell(f"wrote {path}")
            _tell_missing(destination, conversion)
        else:
            tell(f"nothing to change in {destination.output}")
        _tell_notes(destination.source, conversion.notes)
        for place, text, _ in conversion.problems:
            tell(f"{destination.source}:{place}: {text}: left as it is")
            problems = True
    if problems:
        raise typer.Exit(1)


def _tell_missing(destination: Destination, conversion: FileConversion) -> None:
    """Say which files a result in another folder names and no longer finds."""
    before, now = destination.source.parent, destination.output.parent
    missing = [
        name
        for name in dict.fromkeys(conversion.named)
        if os.path.isfile(before / name) and not os.path.isfile(now / name)
    ]
    if missing:
        more = f" and {len(missing) - 1} more" if len(missing) > 1 else ""
        tell(
            f"note: {destination.output} names {missing[0]}{more}, which "
            f"{'is' if len(missing) == 1 else 'are'} found from {before} and not from {now}: "
            "copy them, too, or write beside the original"
        )


def _tell_notes(source: Path, notes: Sequence[tuple[int, str]]) -> None:
    for line, text in notes[:MATERIALS_SHOWN]:
        tell(f"note: {source}, line {line}: {text}")
    more = len(notes) - MATERIALS_SHOWN
    if more > 0:
        tell(f"… and {more} more notes; {_JSON} has them all")


@contextmanager
def about(path: Path) -> Iterator[None]:
    """Put the name of a file before what is wrong with it."""
    try:
        yield
    except MdfconvError as error:
        raise MdfconvError(f"{path}: {error.reason}", error.hint, argument=error.argument) from None


def print_materials(
    record: Mapping[str, Any],
    headings: Mapping[str, str],
    count: int,
    secondary: Sequence[str] = (),
) -> None:
    """Print a table of what was converted to standard error.

    Parameters
    ----------
    record : mapping
        What is said of a file: ``file``, ``metric`` and rows of ``materials``.
    headings : mapping
        The keys of the rows that are shown, and their headings.
    count : int
        How many materials there are.
    secondary : sequence of str
        As for `write_table`.
    """
    rows = [{heading: row[key] for key, heading in headings.items()} for row in record["materials"]]
    title = f"{record['file']}, {record['metric']} metric"
    if rows:
        columns = list(headings.values())
        print_table(
            columns, rows, title, secondary=secondary, err=True, everything=_JSON, count=count
        )
    else:
        typer.echo(f"{record['file']}: nothing to convert", err=True)


def material_rows(
    materials: Sequence[Any],
    exponents: Sequence[float],
    metric: Metric,
    *,
    every: bool,
    compare: bool,
) -> list[dict[str, Any]]:
    """Return rows for materials, every one or those that a table shows.

    Parameters
    ----------
    materials : sequence
        What was converted: with `notes`, and more for the rows.
    exponents : sequence of float
        Those of the materials; NaN where there is none.
    metric : Metric
        Under which importers are compared.
    every : bool
        Whether all are wanted.
    compare : bool
        Whether the rows say what importers make of the exponents.
    """
    most = None if every else MATERIALS_SHOWN
    rows = [vars(material) | {"notes": list(material.notes)} for material in materials[:most]]
    if compare:
        _add_importers(rows, exponents[:most], metric, every=every)
    return rows


def _add_importers(
    rows: list[dict[str, Any]], exponents: Sequence[float], metric: Metric, *, every: bool
) -> None:
    """Add to rows of materials what importers make of their exponents, to all or those shown."""
    import numpy as np

    from mdfconv.scene.shininess import IMPORTERS, importer_results

    most = None if every else ROWS_SHOWN // len(IMPORTERS)
    known = [number for number, exponent in enumerate(exponents) if math.isfinite(exponent)][:most]
    results = importer_results(np.array([exponents[number] for number in known]), metric)
    for row in rows:
        row["importers"] = {}
    for number, result in zip(known, results, strict=True):
        rows[number]["importers"] = {
            r.importer: {"roughness": r.roughness, "rmse": r.rmse} for r in result
        }


def print_importers(record: Mapping[str, Any], exponents: Sequence[float]) -> None:
    """Print what importers make of the exponents of a file to standard error."""
    from mdfconv.scene.shininess import IMPORTERS

    rows = [
        {
            "material": row["name"],
            "importer": name,
            "roughness": result["roughness"],
            "RMSE": "a mirror" if math.isinf(result["rmse"]) else result["rmse"],
        }
        for row in record["materials"]
        for name, result in row["importers"].items()
    ]
    if rows:
        count = len(IMPORTERS) * sum(map(math.isfinite, exponents))
        print_table(list(rows[0]), rows, "Importers", err=True, everything=_JSON, count=count)
