"""Records as text: JSON, CSV and Markdown."""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

Record = Mapping[str, Any]


def json_text(records: Any) -> str:
    """Return records as indented JSON; NaN and infinities become null."""
    return json.dumps(_finite(records), indent=2, ensure_ascii=False, allow_nan=False)


def _finite(value: Any) -> Any:
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {key: _finite(item) for key, item in value.items()}
    return [_finite(item) for item in value] if isinstance(value, list | tuple) else value


def csv_text(columns: Sequence[str], rows: Iterable[Record]) -> str:
    """Return rows as CSV with a header; floats keep their full precision."""
    buffer = io.StringIO()
    writer = csv.DictWriter(buffer, columns, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return buffer.getvalue().rstrip("\n")


def cell_text(value: Any) -> str:
    """Return a cell for people: six significant digits, a mark for yes and for no number."""
    if isinstance(value, bool):
        return "✓" if value else ""
    if not isinstance(value, float):
        return str(value)
    return "—" if math.isnan(value) else f"{value:.6g}"


def with_error(value: float, error: float | None) -> str:
    """Return a number to the digits that its standard error supports, with it: 0.1008 ± 0.0032.

    The error has two significant digits; without one, or with 0, the number has four.
    """
    if error is None or not 0 < error < math.inf or not math.isfinite(value):
        return f"{value:.4g}"
    if error >= abs(value) * 1e6 or error < 1e-12 * abs(value):
        return f"{value:.4g} ± {error:.2g}"
    places = 1 - math.floor(math.log10(float(f"{error:.2g}")))
    if places > 6 or places < -3:
        return f"{value:.{max(1, places + math.floor(math.log10(abs(value) or error)) + 1)}g} ± {error:.2g}"
    return f"{round(value, places):.{max(0, places)}f} ± {round(error, places):.{max(0, places)}f}"


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
