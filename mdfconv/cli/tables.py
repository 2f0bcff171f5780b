"""The one writer of tables: rows as text in every form, on a terminal, in a pipe, in a file."""

from __future__ import annotations

import io
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import typer

from mdfconv.cli.options import Format
from mdfconv.cli.process import tell as tell
from mdfconv.distributions.parameter import number_text
from mdfconv.output.records import Record, cell_text, csv_text, json_text, markdown_text

if TYPE_CHECKING:
    from rich.console import Console

    from mdfconv.cli.outputs import Outputs

_PIPE_WIDTH = 160
# Nobody reads more in a terminal, and Rich takes a millisecond a row.
ROWS_SHOWN = 500
_WIDEST = 1000
_ENDINGS = {".json": Format.json, ".md": Format.markdown, ".txt": Format.table}


def value_text(value: float | tuple[float, ...]) -> str:
    """Return a number, or a pair with a comma, in ten significant digits."""
    return ",".join(map(number_text, value if isinstance(value, tuple) else (value,)))


def form_of(
    asked: Format | None, output: Path | None = None, *, in_pipe: Format = Format.csv
) -> Format:
    """Return the form that was asked for, or that of a file's name, a terminal or a pipe."""
    if asked is not None:
        return asked
    if output is not None:
        return _ENDINGS.get(output.suffix.lower(), Format.csv)
    return Format.table if sys.stdout.isatty() else in_pipe


def write_table(
    columns: Sequence[str],
    rows: Sequence[Record],
    form: Format | None,
    outputs: Outputs | None = None,
    *,
    beside: Mapping[Path, bytes] | None = None,
    title: str = "",
    styles: Sequence[str] = (),
) -> None:
    """Write rows to standard output or to a file, in the form asked for.

    Parameters
    ----------
    columns : sequence of str
        Keys of the rows, in order: the headings.
    rows : sequence of mapping
        Cells: numbers, text, None for an empty one, tuples and lists of numbers or text.
    form : Format or None
        As for `form_of`.
    outputs : Outputs, optional
        The files of the command, of which one may be that of the table.
    beside : mapping of Path to bytes, optional
        Its other files, written with that of the table or before it is printed.
    title : str
        Above a table on a terminal.
    styles : sequence of str
        Rich's style of each row of a table on a terminal.
    """
    output = outputs.table if outputs else None
    form = form_of(form, output)
    if outputs:
        # Most calls write no file, and its imports would be a tenth of their start.
        from mdfconv.output.files import file_bytes

        table = {output: file_bytes(table_text(columns, rows, form))} if output else {}
        outputs.write({**(beside or {}), **table})
    if output:
        return
    if form is Format.table:
        print_table(rich_table(columns, rows[:ROWS_SHOWN], title, styles))
        tell_rest(len(rows))
    else:
        typer.echo(table_text(columns, rows, form))


def table_text(columns: Sequence[str], rows: Sequence[Record], form: Format) -> str:
    """Return rows as text in a form."""
    if form is Format.json:
        return json_text([{column: row[column] for column in columns} for row in rows])
    flat = [{column: _flat(row[column]) for column in columns} for row in rows]
    if form is Format.csv:
        return csv_text(columns, flat)
    if form is Format.markdown:
        return markdown_text(columns, flat)
    if form is Format.plain:
        return "\n".join(" ".join(_plain_cell(row[column]) for column in columns) for row in flat)
    from rich.console import Console

    buffer = io.StringIO()
    Console(file=buffer, width=_PIPE_WIDTH).print(rich_table(columns, rows))
    return buffer.getvalue().rstrip()


def rich_table(
    columns: Sequence[str],
    rows: Sequence[Record],
    title: str = "",
    styles: Sequence[str] = (),
    right: Sequence[str] = (),
) -> Any:
    """Return a table for a terminal; numbers, and the columns named, stand to the right."""
    from rich import box
    from rich.cells import cell_len
    from rich.markup import escape
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD, title=title, title_style="bold", title_justify="left")
    cells = [[cell_text(_flat(row[column])) for column in columns] for row in rows]
    for number, column in enumerate(columns):
        text = column not in right and any(isinstance(row[column], str) for row in rows)
        justify: Literal["left", "right"] = "left" if text else "right"
        # Rich takes a column that does not wrap for as narrow as its longest word.
        widest = None if text else max(cell_len(row[number]) for row in [columns, *cells])
        table.add_column(
            column, justify=justify, overflow="fold", no_wrap=not text, min_width=widest
        )
    for number, row_cells in enumerate(cells):
        table.add_row(*map(escape, row_cells), style=styles[number] if styles else None)
    return table


def print_table(table: Any, *, err: bool = False) -> None:
    """Print a Rich table, wider than the terminal rather than with numbers broken."""
    from rich.console import Console

    out = console(err=err)
    needed = out.measure(table, options=out.options.update(max_width=_WIDEST)).minimum
    if needed > out.width:
        out = Console(stderr=err, width=needed, highlight=False)
    out.print(table)


def tell_rest(count: int, everything: str = "--format csv", shown: int = ROWS_SHOWN) -> None:
    """Say how many rows a table on a terminal leaves out, and what shows them."""
    if count > shown:
        tell(f"… and {count - shown} more; {everything} has them all")


def console(*, err: bool = False) -> Console:
    """Return a Rich console on standard output or error, wide enough for a table in a pipe."""
    from rich.console import Console

    stream = sys.stderr if err else sys.stdout
    return Console(stderr=err, width=None if stream.isatty() else _PIPE_WIDTH, highlight=False)


@contextmanager
def progress(description: str, total: int) -> Iterator[Callable[[int], None]]:
    """Show a bar on a terminal, nothing in a pipe; yield what advances it."""
    from rich.console import Console
    from rich.progress import Progress

    err = Console(stderr=True)
    with Progress(console=err, transient=True, disable=not sys.stderr.isatty()) as bar:
        task = bar.add_task(description, total=total)
        yield lambda steps: bar.advance(task, steps)


def _flat(cell: Any) -> Any:
    """Return a cell as a single value: nothing is empty, several numbers are one text."""
    if cell is None:
        return ""
    if isinstance(cell, Mapping):
        return "; ".join(f"{key}: {_flat(value)}" for key, value in cell.items())
    if isinstance(cell, list | tuple):
        if any(isinstance(value, Mapping) for value in cell):
            return " | ".join(str(_flat(value)) for value in cell)
        separator = "; " if any(isinstance(value, str) for value in cell) else ","
        return separator.join(str(value) for value in cell)
    return cell


def _plain_cell(cell: Any) -> str:
    return number_text(cell) if isinstance(cell, float) else str(cell)
