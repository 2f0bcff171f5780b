"""What the commands share in writing their results."""

from __future__ import annotations

import io
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from mdfconv.distributions.parameter import number_text
from mdfconv.errors import MdfconvError
from mdfconv.reports.text import (
    Record,
    cell_text,
    csv_text,
    file_bytes,
    json_text,
    markdown_text,
    write_files,
)

if TYPE_CHECKING:
    from rich.console import Console

_PIPE_WIDTH = 160
_WIDEST = 1000


class Format(StrEnum):
    """The forms in which `convert` writes its results."""

    table = "table"
    plain = "plain"
    csv = "csv"
    json = "json"


class TableFormat(StrEnum):
    """The forms in which tables are written."""

    table = "table"
    csv = "csv"
    json = "json"
    markdown = "markdown"


# Options that several commands share.
FormOption = Annotated[
    TableFormat | None,
    typer.Option("--format", help="Form of the output: table on a terminal, csv in a pipe."),
]
FileOption = Annotated[
    Path | None, typer.Option("--output", metavar="FILE", help="Write to a file instead.")
]


def value_text(value: float | tuple[float, ...]) -> str:
    """Return a number, or a pair with a comma, in ten significant digits."""
    return ",".join(map(number_text, value if isinstance(value, tuple) else (value,)))


def console() -> Console:
    """Return a Rich console on standard output, wide enough for a table in a pipe."""
    from rich.console import Console

    return Console(width=None if sys.stdout.isatty() else _PIPE_WIDTH, highlight=False)


def write_records(
    columns: Sequence[str],
    rows: Sequence[Record],
    form: TableFormat | None,
    output: Path | None,
    title: str,
) -> None:
    """Write rows to standard output or to a file, in the form asked for.

    Without a form it is a table on a terminal and CSV in a pipe; for a file, what its name
    ends in.
    """
    form = form or default_form(output)
    if output is not None:
        write_files({output: file_bytes(record_text(columns, rows, form))})
    elif form is TableFormat.table:
        print_table(_rich_table(columns, rows, title))
    else:
        typer.echo(record_text(columns, rows, form))


@contextmanager
def progress(description: str, total: int) -> Iterator[Callable[[int], None]]:
    """Show a bar on a terminal, nothing in a pipe; yield what advances it."""
    from rich.console import Console
    from rich.progress import Progress

    err = Console(stderr=True)
    with Progress(console=err, transient=True, disable=not sys.stderr.isatty()) as bar:
        task = bar.add_task(description, total=total)
        yield lambda steps: bar.advance(task, steps)


def record_text(columns: Sequence[str], rows: Sequence[Record], form: TableFormat) -> str:
    """Return rows as text in a form."""
    if form is TableFormat.csv:
        return csv_text(columns, rows)
    if form is TableFormat.markdown:
        return markdown_text(columns, rows)
    if form is TableFormat.json:
        return json_text([{column: row[column] for column in columns} for row in rows])
    return _plain_table(columns, rows)


def print_table(table: Any) -> None:
    """Print a Rich table, wider than the terminal rather than with numbers broken."""
    from rich.console import Console

    out = console()
    needed = out.measure(table, options=out.options.update(max_width=_WIDEST)).minimum
    if needed > out.width:
        out = Console(width=needed, highlight=False)
    out.print(table)


def check_distinct(png: Path | None, output: Path | None) -> None:
    """Raise if a picture and a table are to go into one file."""
    if png and output and png.resolve() == output.resolve():
        raise MdfconvError(f"{png} is named for two results")


def default_form(output: Path | None) -> TableFormat:
    """Return the form for a file's name, a terminal or a pipe."""
    if output is None:
        return TableFormat.table if sys.stdout.isatty() else TableFormat.csv
    endings = {".json": TableFormat.json, ".md": TableFormat.markdown, ".txt": TableFormat.table}
    return endings.get(output.suffix.lower(), TableFormat.csv)


def _rich_table(columns: Sequence[str], rows: Sequence[Record], title: str) -> Any:
    from rich import box
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD, title=title, title_style="bold", title_justify="left")
    for column in columns:
        text = any(isinstance(row[column], str) for row in rows)
        justify: Literal["left", "right"] = "left" if text else "right"
        table.add_column(column, justify=justify, overflow="fold", no_wrap=not text)
    for row in rows:
        table.add_row(*(cell_text(row[column]) for column in columns))
    return table


def _plain_table(columns: Sequence[str], rows: Sequence[Record]) -> str:
    from rich.console import Console

    buffer = io.StringIO()
    Console(file=buffer, width=_PIPE_WIDTH).print(_rich_table(columns, rows, ""))
    return buffer.getvalue().rstrip()
