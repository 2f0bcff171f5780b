"""Records as text, and files written whole."""

from __future__ import annotations

import csv
import errno
import io
import json
import math
import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from tempfile import NamedTemporaryFile
from typing import Any

from mdfconv.errors import MdfconvError

Record = Mapping[str, Any]


def json_text(records: Any) -> str:
    """Return records as indented JSON; NaN and infinities become null."""
    return json.dumps(_finite(records), indent=2, ensure_ascii=False, allow_nan=False)


def _finite(value: Any) -> Any:
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {key: _finite(entry) for key, entry in value.items()}
    return [_finite(entry) for entry in value] if isinstance(value, list | tuple) else value


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


def file_bytes(text: str) -> bytes:
    """Return text as the content of a file."""
    return f"{text}\n".encode()


def write_files(contents: Mapping[Path, bytes]) -> None:
    """Write files whole or not at all: all beside their places first, then renamed.

    Raises
    ------
    MdfconvError
        If a place cannot be written; nothing is then changed.
    """
    staged: dict[str, Path] = {}
    path = Path()
    # A temporary file is private; give it the permissions of any other new file.
    mask = os.umask(0)
    os.umask(mask)
    try:
        for path, content in contents.items():
            with NamedTemporaryFile(dir=path.parent, prefix=f".{path.name}.", delete=False) as file:
                staged[file.name] = path
                file.write(content)
            os.chmod(file.name, 0o666 & ~mask)
            if path.is_dir():
                raise IsADirectoryError(errno.EISDIR, "is a directory")
        for beside, path in list(staged.items()):
            os.replace(beside, path)
            del staged[beside]
    except OSError as error:
        raise MdfconvError(f"cannot write {path}: {error.strerror}") from None
    finally:
        for beside in staged:
            Path(beside).unlink(missing_ok=True)
