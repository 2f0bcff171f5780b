"""Records as text, and files written whole."""

from __future__ import annotations

import csv
import io
import json
import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from tempfile import NamedTemporaryFile
from typing import Any

from mdfconv.errors import MdfconvError

Record = Mapping[str, Any]


def json_text(records: Any) -> str:
    """Return records as indented JSON; NaN and infinities are refused."""
    return json.dumps(records, indent=2, ensure_ascii=False, allow_nan=False)


def csv_text(columns: Sequence[str], rows: Iterable[Record]) -> str:
    """Return rows as CSV with a header; floats keep their full precision."""
    buffer = io.StringIO()
    writer = csv.DictWriter(buffer, columns, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return buffer.getvalue().rstrip("\n")


def cell_text(value: Any) -> str:
    """Return a cell for people: six significant digits, and a mark for yes."""
    if isinstance(value, bool):
        return "✓" if value else ""
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def rounded_rows(columns: Mapping[str, Any]) -> list[dict[str, float]]:
    """Return arrays of one length as rows, to nine digits: what a curve's file needs."""
    table = zip(*(column.tolist() for column in columns.values()), strict=True)
    return [
        {name: float(f"{value:.9g}") for name, value in zip(columns, row, strict=True)}
        for row in table
    ]


def markdown_text(columns: Sequence[str], rows: Sequence[Record]) -> str:
    """Return rows as a Markdown table, numbers as `cell_text` writes them."""
    lines = [columns, ["---"] * len(columns)]
    lines += [[cell_text(row[column]) for column in columns] for row in rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def write_file(path: Path, content: bytes) -> None:
    """Write a file whole or not at all: beside its place first, then renamed.

    Raises
    ------
    MdfconvError
        If the place cannot be written.
    """
    beside = None
    try:
        with NamedTemporaryFile(dir=path.parent, prefix=f".{path.name}.", delete=False) as file:
            beside = file.name
            file.write(content)
        # A temporary file is private; give it the permissions of any other new file.
        mask = os.umask(0)
        os.umask(mask)
        os.chmod(beside, 0o666 & ~mask)
        os.replace(beside, path)
    except OSError as error:
        if beside:
            Path(beside).unlink(missing_ok=True)
        raise MdfconvError(f"cannot write {path}: {error.strerror}") from None
