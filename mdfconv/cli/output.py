"""What the commands share in writing their results."""

from __future__ import annotations

import csv
import io
import json
import sys
from collections.abc import Iterable, Mapping, Sequence
from enum import StrEnum
from typing import TYPE_CHECKING, Any

from mdfconv.distributions.parameter import number_text

if TYPE_CHECKING:
    from rich.console import Console

_PIPE_WIDTH = 120


class Format(StrEnum):
    """The forms in which `convert` writes its results."""

    table = "table"
    plain = "plain"
    csv = "csv"
    json = "json"


def value_text(value: float | tuple[float, ...]) -> str:
    """Return a number, or a pair with a comma, in ten significant digits."""
    return ",".join(map(number_text, value if isinstance(value, tuple) else (value,)))


def console() -> Console:
    """Return a Rich console on standard output, wide enough for a table in a pipe."""
    from rich.console import Console

    return Console(width=None if sys.stdout.isatty() else _PIPE_WIDTH, highlight=False)


def json_text(records: Any) -> str:
    """Return records as indented JSON; NaN and infinities are refused."""
    return json.dumps(records, indent=2, ensure_ascii=False, allow_nan=False)


def csv_text(columns: Sequence[str], rows: Iterable[Mapping[str, Any]]) -> str:
    """Return rows as CSV with a header; floats keep their full precision."""
    buffer = io.StringIO()
    writer = csv.DictWriter(buffer, columns, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return buffer.getvalue().rstrip("\n")
