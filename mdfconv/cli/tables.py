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
from typing import IO, TYPE_CHECKING, Any, Literal

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
# Longer words may be broken.
_LONGEST_WORD = 24
# Columns of text are hard to read in less.
_READABLE_WIDTH = 16
_LETTER = re.compile(r"[^\W\d_eE]")
_ENDINGS: dict[str, Format] = {".json": "json", ".md": "markdown", ".txt": "table"}


def value_text(value: float | tuple[float, ...]) -> str:
    """Return a number, or a pair with a comma, in ten significant digits."""
    return ",".join(map(number_text, value if isinstance(value, tuple) else (value,)))


def form_of(asked: Format | None, output: Path | None = None, *, in_pipe: Format = "csv") -> Format:
    """Return the form that was asked for, or that of a file's name, a terminal or a pipe."""
    if asked is not None:
        return asked
    if output is not None:
        return _ENDINGS.get(output.suffix.lower(), "csv")
    return "table" if sys.stdout.isatty() else in_pipe


def write_table(
    columns: Sequence[str],
    rows: Sequence[Record],
    form: Format | None,
    outputs: Outputs | None = None,
    *,
    beside: Mapping[Path, bytes] | None = None,
    title: str = "",
    secondary: Sequence[str] = (),
) -> None:
    """Write rows to standard output or to the file of the table, in the form asked for.

    `beside` has other files of the command, written with that of the table or before it is printed;
    title and `secondary` are those of `print_table`.
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
    if form == "table":
        print_table(columns, rows, title, secondary=secondary)
    else:
        typer.echo(table_text(columns, rows, form))


def table_text(columns: Sequence[str], rows: Sequence[Record], form: Format) -> str:
    """Return rows as text in a form."""
    if form == "json":
        return json_text([{column: row[column] for column in columns} for row in rows])
    if form == "table":
        buffer = io.StringIO()
        _print(console(buffer), _columns(columns, rows))
        return buffer.getvalue().rstrip()
    number = cell_text if form == "markdown" else str
    flat = [{column: _flat(row[column], number) for column in columns} for row in rows]
    if form == "csv":
        return csv_text(columns, flat)
    if form == "markdown":
        return markdown_text(columns, flat)
    return "\n".join(" ".join(map(_plain_cell, row.values())) for row in flat)


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
    """Print the first `ROWS_SHOWN` of `count` rows, on a terminal no wider than it is.

    Text wraps, numbers do not. Where there is no room for all columns, those that are `secondary`
    are left out first, from the last one, then the last of the others; standard error says which,
    and what option shows `everything`.
    """
    out = console(sys.stderr if err else sys.stdout)
    shown = rows[:ROWS_SHOWN]
    table = _columns(columns, shown)
    printed = _with_room(table, out.width, secondary) if out.is_terminal else table
    _print(out, printed, title, styles)
    left_out = [column.name for column in table if column not in printed]
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
        readable = min(self.widest, _READABLE_WIDTH) if self.words else 0
        return max(readable, *map(_width, self.name.split()), *unbroken)


def _width(text: str) -> int:
    from rich.cells import cell_len

    return cell_len(text)


def _columns(names: Sequence[str], rows: Sequence[Record]) -> list[_Column]:
    return [
        _Column(
            name,
            [cell_text(_flat(row[name], cell_text)) for row in rows],
            not any(_is_number(row[name]) for row in rows),
        )
        for name in names
    ]


def _is_number(cell: Any) -> bool:
    several = isinstance(cell, list | tuple) and len(cell) > 0
    return isinstance(cell[0] if several else cell, int | float)


def _with_room(table: list[_Column], room: int, secondary: Sequence[str]) -> list[_Column]:
    """Return the columns for which there is room, at least one."""
    # The last one goes first: those that are secondary stand behind the others.
    order = {name: number for number, name in enumerate(secondary)}
    ranked = sorted(table, key=lambda column: order.get(column.name, -1))
    while len(ranked) > 1 and _framed(column.narrowest for column in ranked) > room:
        ranked.pop()
    return [column for column in table if column in ranked]


def _widths(table: list[_Column], room: int) -> list[int]:
    """Return what each column gets: all it can use, or of the same for all as much as fits."""
    widths = [column.narrowest for column in table]
    for limit in range(max((column.widest for column in table), default=0) + 1):
        wider = [max(column.narrowest, min(column.widest, limit)) for column in table]
        if _framed(wider) > room:
            break
        widths = wider
    return widths


def _framed(widths: Iterable[int]) -> int:
    """Return the width of a table with what stands between and around its columns."""
    return sum(width + 3 for width in widths) + 1


def _print(out: Console, table: list[_Column], title: str = "", styles: Sequence[str] = ()) -> None:
    """Print columns, in the width of a terminal if they can be as narrow."""
    from rich import box
    from rich.markup import escape
    from rich.table import Table

    widths = _widths(table, out.width)
    rich = Table(box=box.SIMPLE_HEAD, title=title, title_style="bold", title_justify="left")
    for column, width in zip(table, widths, strict=True):
        justify: Literal["left", "right"] = "left" if column.words else "right"
        rich.add_column(escape(column.name), justify=justify, overflow="fold", width=width)
    for number, cells in enumerate(zip(*(column.cells for column in table), strict=True)):
        rich.add_row(*map(escape, cells), style=styles[number] if styles else None)
    # Where no column can be left out a pipe is as wide as it takes.
    console(out.file, max(out.width, _framed(widths))).print(rich)


def console(stream: IO[str] | None = None, width: int | None = None) -> Console:
    """Return a Rich console, usually on standard output, wide enough for a table in a pipe."""
    from rich.console import Console

    file = stream or sys.stdout
    usual = None if file.isatty() else _PIPE_WIDTH
    return Console(file=file, width=width or usual, highlight=False)


@contextmanager
def progress(description: str, total: int) -> Iterator[Callable[[float], None]]:
    """Show a bar on a terminal, nothing in a pipe; yield what advances it."""
    from rich.console import Console
    from rich.progress import Progress

    err = Console(stderr=True)
    with Progress(console=err, transient=True, disable=not sys.stderr.isatty()) as bar:
        task = bar.add_task(description, total=total)
        yield lambda steps: bar.advance(task, steps)


def _flat(cell: Any, text: Callable[[Any], str] = str) -> Any:
    """Return a cell as a single value: nothing is empty, several numbers are one text."""
    if cell is None:
        return ""
    if isinstance(cell, Mapping):
        return "; ".join(f"{key}: {_flat(value, text)}" for key, value in cell.items())
    if isinstance(cell, list | tuple):
        if any(isinstance(value, Mapping) for value in cell):
            return " | ".join(str(_flat(value, text)) for value in cell)
        if any(isinstance(value, str) for value in cell):
            return "; ".join(map(text, cell))
        # A table may wrap between numbers.
        return ("," if text is str else ", ").join(map(text, cell))
    return cell


def _plain_cell(cell: Any) -> str:
    return number_text(cell) if isinstance(cell, float) else str(cell)
