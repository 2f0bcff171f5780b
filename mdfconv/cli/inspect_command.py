"""``mdfconv inspect``."""

from __future__ import annotations

import shlex
import textwrap
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from mdfconv.cli import tables
from mdfconv.cli.options import argument
from mdfconv.cli.process import tell
from mdfconv.errors import MdfconvError
from mdfconv.output.records import json_text

if TYPE_CHECKING:
    from mdfconv.scene.inspection.records import FileInspection

_FILES = argument("FILE...", "Files of any kind, or patterns such as 'assets/*'.")
_FORMAT = typer.Option("--format", help="table or json, on standard output.")
_EVERYTHING = "--format json"
# The columns of numbers and of textures, and their headings.
_NUMBERS = {
    "name": "name", "place": "place", "quantity": "quantity", "stored": "stored",
    "taken_for": "taken for", "exponent": "N", "alpha": "GGX α", "roughness": "r", "notes": "notes",
}  # fmt: skip
_TEXTURES = {
    "file": "texture", "place": "place", "form": "form", "size": "size", "depth": "depth",
    "channels": "channels", "channel": "read", "taken_for": "taken for",
}  # fmt: skip
# What a narrow terminal leaves out first.
_SECONDARY = ("place", "form", "notes")
# Rows of a table: the rest is in JSON.
_MOST_ROWS = 100
_INDENT = "  "


def command(
    context: typer.Context,
    files: Annotated[list[str], _FILES],
    format_: Annotated[Literal["table", "json"], _FORMAT] = "table",
) -> None:
    """Say what files are, what their numbers mean, and what converts them; write nothing.

    For material libraries, glTF, Mitsuba scenes, textures, environment maps and measurements:
    who wrote a file, each number with the exponent N, the α of the nearest GGX and its roughness
    r, what has no conversion, and the command line that converts it. The exit status is 1 if
    something has no conversion, 2 if a file cannot be read.

    Examples:

    mdfconv inspect chair.mtl

    mdfconv inspect 'assets/**/*'

    mdfconv inspect scene.xml rough.png --format json
    """
    from mdfconv.scene.inspection.files import inspect_files

    inspections = inspect_files(files)
    lines = {each.file: _line(context, each) for each in inspections}
    if format_ == "json":
        typer.echo(json_text([_record(each, lines[each.file]) for each in inspections]))
    else:
        for number, each in enumerate(inspections):
            _print(each, lines[each.file], first=number == 0)
    unread = [each for each in inspections if not each.is_read]
    if unread:
        more = f" and {len(unread) - 1} more" if len(unread) > 1 else ""
        raise MdfconvError(f"cannot read {unread[0].file}{more}: the report says why")
    if any(each.problems for each in inspections):
        raise typer.Exit(1)


def _record(inspection: FileInspection, line: Sequence[Sequence[str]]) -> dict[str, Any]:
    """Return what JSON has of a file."""
    return {
        "file": str(inspection.file),
        "kind": inspection.kind,
        "read": inspection.is_read,
        "writer": inspection.writer,
        "taken_for": inspection.taken_for,
        "facts": dict(inspection.facts),
        "numbers": [vars(each) | {"notes": list(each.notes)} for each in inspection.numbers],
        "textures": [vars(each) for each in inspection.textures],
        "problems": [
            {"place": problem.place, "problem": problem.text} for problem in inspection.problems
        ],
        "remedy": inspection.remedy,
        "notes": list(inspection.notes),
        "repaired": inspection.repaired,
        "command": " ".join(map(shlex.join, line)),
    }


def _line(context: typer.Context, inspection: FileInspection) -> list[list[str]]:
    """Return the command line for the next step, an option a part; empty if there is none."""
    step = inspection.next_step
    if step is None:
        return []
    assert context.parent is not None
    group: Any = context.parent.command
    parameters = {each.name: each for each in group.get_command(context, step.command).params}
    parts = [["mdfconv", step.command, str(inspection.file)]]
    if step.output:
        parts.append(["-o", str(step.output)])
    for name, value in step.arguments.items():
        option = parameters[name]
        # The option's word stands for what the user has to say.
        words = [option.metavar] if value is None else [] if value is True else [str(value)]
        parts.append([option.opts[0], *words])
    return parts


def _print(inspection: FileInspection, line: Sequence[Sequence[str]], *, first: bool) -> None:
    """Print what a file is, for people."""
    width = tables.console().width
    if not first:
        typer.echo()
    typer.echo(_wrapped(f"{inspection.file}: {inspection.kind}", "", width))
    facts = {"written by": inspection.writer, "taken for": inspection.taken_for}
    facts |= dict(inspection.facts) | {"looks repaired": inspection.repaired}
    shown = {label: text for label, text in facts.items() if text}
    space = max(map(len, shown), default=0)
    for label, text in shown.items():
        typer.echo(_wrapped(text, f"{_INDENT}{label:{space}}{_INDENT}", width))
    _print_numbers(inspection)
    # Of a picture by itself all is said above.
    named = [each for each in inspection.textures if each.place != ""]
    _print_rows(_TEXTURES, [vars(each) | {"size": f"{each.width}×{each.height}"} for each in named])
    what = "cannot convert" if inspection.is_read else "cannot read"
    problems = [
        f"line {place}: {text}" if isinstance(place, int) else f"{place}: {text}" if place else text
        for place, text, _ in inspection.problems
    ]
    _print_lines(problems, what, width)
    if inspection.remedy:
        _print_lines([inspection.remedy], "to do", width)
    _print_lines(inspection.notes, "note", width)
    if line:
        typer.echo(_continued(line, f"{_INDENT}$ ", width))
    elif inspection.is_read and not inspection.problems:
        typer.echo(f"{_INDENT}nothing to convert")


def _print_lines(texts: Sequence[str], label: str, width: int) -> None:
    """Print texts behind a label each, the first of them if there are many."""
    for text in texts[:_MOST_ROWS]:
        typer.echo(_wrapped(text, f"{_INDENT}{label}: ", width))
    more = len(texts) - _MOST_ROWS
    if more > 0:
        tell(f"… and {more} more; {_EVERYTHING} has them all")


def _print_numbers(inspection: FileInspection) -> None:
    """Print numbers; what is the same of all stands in a heading, or above them."""
    headings, numbers = dict(_NUMBERS), inspection.numbers
    quantities = {each.quantity for each in numbers}
    if len(quantities) == 1:
        headings |= {"stored": quantities.pop(), "quantity": ""}
    meanings = {each.taken_for for each in numbers}
    if len(meanings) == 1 and meanings.pop() in inspection.taken_for:
        headings["taken_for"] = ""
    shown = {key: text for key, text in headings.items() if text}
    _print_rows(shown, [vars(each) for each in numbers])


def _print_rows(headings: Mapping[str, str], records: Sequence[Mapping[str, Any]]) -> None:
    """Print a table of those columns in which something stands."""
    shown = {key: text for key, text in headings.items() if any(_says(x[key]) for x in records)}
    if not records:
        return
    rows = [{text: each[key] for key, text in shown.items()} for each in records[:_MOST_ROWS]]
    secondary = [name for name in _SECONDARY if name in shown.values()]
    names = list(shown.values())
    tables.print_table(names, rows, secondary=secondary, everything=_EVERYTHING, count=len(records))


def _says(cell: Any) -> bool:
    """Return whether a cell is neither empty nor NaN."""
    if isinstance(cell, tuple):
        return any(map(_says, cell))
    return bool(cell == cell) and cell != ""


def _wrapped(text: str, start: str, width: int) -> str:
    """Return a text in lines behind a start, the next ones as far in."""
    return textwrap.fill(
        " ".join(text.split()),
        width,
        initial_indent=start,
        subsequent_indent=" " * (len(start) or len(_INDENT)),
        break_long_words=False,
        break_on_hyphens=False,
    )


def _continued(parts: Sequence[Sequence[str]], start: str, width: int) -> str:
    """Return a command line as a shell takes it, with long ones in several lines."""
    mark = " \\"
    lines = [start]
    for number, part in enumerate(map(shlex.join, parts)):
        if number and len(lines[-1]) + len(part) + 1 > width - len(mark):
            lines[-1] += mark
            lines.append(" " * (len(start) + len(_INDENT)) + part)
        else:
            lines[-1] += f" {part}" if number else part
    return "\n".join(lines)
