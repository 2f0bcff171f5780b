"""Pages of the report: templates in Markdown, filled with figures that have names.

A template is ``pages/NAME.md``: a conclusion, prose, tables. ``{error:.1%}`` in it stands for the
figure ``error``, with Python's rules of format; a table is the figure ``{table}``.
"""

from __future__ import annotations

import csv
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from importlib.resources import files
from string import Formatter
from typing import NamedTuple, TypeVar

from mdfconv.output.records import markdown_text

Item = TypeVar("Item")
_tell: ContextVar[Callable[[float], None]] = ContextVar("tell", default=lambda share: None)


@contextmanager
def heard_by(tell: Callable[[float], None]) -> Iterator[None]:
    """Let a function hear how the pages that are made meanwhile get on."""
    token = _tell.set(tell)
    try:
        yield
    finally:
        _tell.reset(token)


def tracked(items: Collection[Item]) -> Iterator[Item]:
    """Yield what most of a page is made from; after each, say which share of the page is done."""
    for item in items:
        yield item
        _tell.get()(1 / len(items))


class PageFiles(NamedTuple):
    """The contents of the files of a page, and the figures of it that the index has."""

    files: Sequence[str | bytes]
    figures: Mapping[str, object]


def fill(name: str, **figures: object) -> str:
    """Return a template with its figures, each of which it has to use.

    Raises
    ------
    ValueError
        If the template and the figures do not go together.
    """
    template = files("mdfconv.studies").joinpath("pages", f"{name}.md").read_text(encoding="utf-8")
    # An element is asked for as ``figure[element]``.
    used = {field.partition("[")[0] for _, field, _, _ in Formatter().parse(template) if field}
    if used != figures.keys():
        missing, spare = sorted(used - figures.keys()), sorted(figures.keys() - used)
        raise ValueError(f"pages/{name}.md: figures missing {missing}, without use {spare}")
    return template.rstrip("\n").format_map(figures)


def read_rows(name: str) -> list[dict[str, str]]:
    """Return the rows of a file of ``data/``, from which studies and their pages are made."""
    text = files("mdfconv.studies").joinpath("data", name).read_text(encoding="utf-8")
    return list(csv.DictReader(text.splitlines()))


def pivot(corner: str, cells: Iterable[tuple[str, str, str]]) -> str:
    """Return cells of a row, a column and a text as a Markdown table, in the order given."""
    rows: dict[str, dict[str, str]] = {}
    for row, column, text in cells:
        rows.setdefault(row, {corner: row})[column] = text
    columns = dict.fromkeys(column for row in rows.values() for column in row)
    return markdown_text([*columns], [dict.fromkeys(columns, "") | row for row in rows.values()])
