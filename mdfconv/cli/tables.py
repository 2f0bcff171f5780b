"""The one writer of tables: rows as text in every form, on a terminal, in a pipe, in a file."""

from __future__ import annotations

import io
import re
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TextIO

import typer

from mdfconv.cli.options import Format
from mdfconv.cli.process import tell
from mdfconv.distributions.parameter import number_text
from mdfconv.output.records import Record, cell_text, csv_text, json_text, markdown_text

if TYPE_CHECKING:
    from rich.console import Console

    from mdfconv.cli.outputs import Outputs

_PIPE_WIDTH = 160
# Nobody reads more in a terminal, and Rich takes a millisecond a row.
ROWS_SHOWN = 500
# Longer words may be broken; text in less than the other is hard to read.
_LONGEST_WORD, _READABLE = 24, 16
_LETTER = re.compile(r"[^\W\d_eE]")
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
    secondary: Sequence[str] = (),
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
    secondary : sequence of str
        Columns that a narrow terminal leaves out before others, from the last one.
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
        print_table(columns, rows, title, styles, secondary=secondary)
    else:
        typer.echo(table_text(columns, rows, form))


def table_text(columns: Sequence[str], rows: Sequence[Record], form: Format) -> str:
    """Return rows as text in a form."""
    if form is Format.json:
        return json_text([{column: row[column] for column in columns} for row in rows])
    if form is Format.table:
        buffer = io.StringIO()
        _print(buffer, _columns(columns, rows))
        return buffer.getvalue().rstrip()
    number = cell_text if form is Format.markdown else str
    flat = [{column: _flat(row[column], number) for column in columns} for row in rows]
    if form is Format.csv:
        return csv_text(columns, flat)
    if form is Format.markdown:
        return markdown_text(columns, flat)
    return "\n".join(" ".join(_plain_cell(row[column]) for column in columns) for row in flat)


def print_table(
    columns: Sequence[str],
    rows: Sequence[Record],
    title: str = "",
    styles: Sequence[str] = (),
    *,
    secondary: Sequence[str] = (),
    err: bool = False,
    everything: str = "--format csv",
    count: int | None = None,
) -> None:
    """Print the first `ROWS_SHOWN` rows, on a terminal no wider than it is.

    Text wraps, numbers do not; where there is no room for all columns, standard error says which
    are left out.

    Parameters
    ----------
    columns, rows, title, styles
        As for `write_table`.
    secondary : sequence of str
        Columns to leave out before others, from the last one; then the last columns go.
    err : bool
        Print to standard error.
    everything : str
        The option that shows what is left out.
    count : int, optional
        How many rows there are, if these are not all.
    """
    stream = sys.stderr if err else sys.stdout
    shown = rows[:ROWS_SHOWN]
    table = _columns(columns, shown)
    kept = _fitting(table, console(err=err).width, secondary) if stream.isatty() else table
    _print(stream, kept, title, styles)
    left_out = [column.name for column in table if column not in kept]
    if left_out:
        tell(f"too narrow for {', '.join(left_out)}: {everything} has all columns")
    more = (len(rows) if count is None else count) - len(shown)
    if more > 0:
        tell(f"… and {more} more; {everything} has them all")


@dataclass(frozen=True, eq=False)
class _Column:
    """A column in print: its heading, its cells, and whether they are words, not numbers."""

    name: str
    cells: list[str]
    words: bool

    @cached_property
    def widest(self) -> int:
        """The width in which nothing wraps."""
        return max(_width(text) for text in (self.name, *self.cells))

    @cached_property
    def narrowest(self) -> int:
        """The least width: numbers stay whole, and words unless they are very long."""
        pieces = {word for text in self.cells for word in text.split()}
        unbroken = [
            min(_width(word), _LONGEST_WORD) if _LETTER.search(word) else _width(word)
            for word in pieces
        ]
        readable = min(self.widest, _READABLE) if self.words else 0
        return max(readable, *map(_width, self.name.split()), *unbroken)


def _width(text: str) -> int:
    from rich.cells import cell_len

    return cell_len(text)


def _columns(names: Sequence[str], rows: Sequence[Record]) -> list[_Column]:
    cells = {name: [row[name] for row in rows] for name in names}
    return [
        _Column(
            name,
            [cell_text(_flat(cell, cell_text)) for cell in cells[name]],
            not any(map(_is_number, cells[name])),
        )
        for name in names
    ]


def _is_number(cell: Any) -> bool:
    several = isinstance(cell, list | tuple) and len(cell) > 0
    return isinstance(cell[0] if several else cell, int | float)


def _fitting(table: list[_Column], width: int, secondary: Sequence[str]) -> list[_Column]:
    """Return the columns for which there is room, at least one."""
    order = {name: number for number, name in enumerate(secondary)}
    kept = sorted(table, key=lambda column: order.get(column.name, -1))
    while len(kept) > 1 and _framed(column.narrowest for column in kept) > width:
        kept.pop()
    return [column for column in table if column in kept]


def _framed(widths: Iterable[int]) -> int:
    """Return the width of a table with what stands between and around its columns."""
    return sum(width + 3 for width in widths) + 1


def _print(
    stream: TextIO, table: list[_Column], title: str = "", styles: Sequence[str] = ()
) -> None:
    """Print columns, in the width of a terminal if they can be as narrow."""
    from rich import box
    from rich.markup import escape
    from rich.table import Table

    out = _console(stream)
    widths, least = ([getattr(c, name) for c in table] for name in ("widest", "narrowest"))
    while _framed(widths) > out.width and widths != least:
        # The widest give way.
        wide = max(range(len(table)), key=lambda n: widths[n] * (widths[n] > least[n]))
        widths[wide] -= 1
    rich = Table(box=box.SIMPLE_HEAD, title=title, title_style="bold", title_justify="left")
    for column, width in zip(table, widths, strict=True):
        justify: Literal["left", "right"] = "left" if column.words else "right"
        rich.add_column(escape(column.name), justify=justify, overflow="fold", width=width)
    for number, cells in enumerate(zip(*(column.cells for column in table), strict=True)):
        rich.add_row(*map(escape, cells), style=styles[number] if styles else None)
    _console(stream, max(out.width, _framed(widths))).print(rich)


def console(*, err: bool = False) -> Console:
    """Return a Rich console on standard output or error, wide enough for a table in a pipe."""
    return _console(sys.stderr if err else sys.stdout)


def _console(stream: TextIO, width: int | None = None) -> Console:
    from rich.console import Console

    usual = None if stream.isatty() else _PIPE_WIDTH
    return Console(file=stream, width=width or usual, highlight=False)


@contextmanager
def progress(description: str, total: int) -> Iterator[Callable[[int], None]]:
    """Show a bar on a terminal, nothing in a pipe; yield what advances it."""
    from rich.console import Console
    from rich.progress import Progress

    err = Console(stderr=True)
    with Progress(console=err, transient=True, disable=not sys.stderr.isatty()) as bar:
        task = bar.add_task(description, total=total)
        yield lambda steps: bar.advance(task, steps)


def _flat(cell: Any, number: Callable[[Any], str] = str) -> Any:
    """Return a cell as a single value: nothing is empty, several numbers are one text."""
    if cell is None:
        return ""
    if isinstance(cell, Mapping):
        return "; ".join(f"{key}: {_flat(value, number)}" for key, value in cell.items())
    if isinstance(cell, list | tuple):
        if any(isinstance(value, Mapping) for value in cell):
            return " | ".join(str(_flat(value, number)) for value in cell)
        words = any(isinstance(value, str) for value in cell)
        # A table may wrap between numbers.
        separator = "; " if words else "," if number is str else ", "
        return separator.join(map(number, cell))
    return cell


def _plain_cell(cell: Any) -> str:
    return number_text(cell) if isinstance(cell, float) else str(cell)
