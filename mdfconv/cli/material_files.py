"""What the commands that convert files of materials share."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from enum import StrEnum
from typing import TYPE_CHECKING, Annotated, TypeVar

import typer

from mdfconv.cli.tables import tell

if TYPE_CHECKING:
    from mdfconv.scene.material_files import Destination, FileConversion

    Conversion = TypeVar("Conversion", bound=FileConversion)
else:
    Conversion = TypeVar("Conversion")


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
        help="New file, or a folder: one that exists, or out/ with a slash.",
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
    patterns: Sequence[str],
    output: str | None,
    *,
    in_place: bool,
    convert: Callable[[Destination, bytes], Conversion],
    report: Callable[[list[tuple[Destination, Conversion]]], None],
) -> None:
    """Convert files, write all or none, report, and exit with 1 if something had to be left.

    Parameters
    ----------
    patterns : sequence of str
        Names and glob patterns.
    output : str or None
        A new file, or a folder; None in place.
    in_place : bool
        Whether the files themselves change.
    convert : callable
        From where a file goes, and its bytes, to its conversion.
    report : callable
        Prints what was converted.

    Raises
    ------
    MdfconvError
        If a file cannot be read, converted at all, or written; nothing is then changed.
    """
    from mdfconv.scene.material_files import (
        choose_outputs,
        find_files,
        read_file,
        write_conversions,
    )

    converted = []
    for destination in choose_outputs(find_files(patterns), output, in_place=in_place):
        data = read_file(destination.source)
        converted.append((destination, data, convert(destination, data)))
    written = write_conversions(converted)
    report([(destination, conversion) for destination, _, conversion in converted])
    problems = False
    for destination, _, conversion in converted:
        outcome = "wrote" if destination in written else "nothing to change in"
        tell(f"{outcome} {destination.output}")
        for place, text in conversion.problems:
            tell(f"{destination.source}:{place}: {text}: left as it is")
            problems = True
    if problems:
        raise typer.Exit(1)


def number_cell(value: float, digits: int) -> str:
    """Return a number as the tables of these commands show it."""
    return "—" if math.isnan(value) else f"{value:.{digits}g}"
