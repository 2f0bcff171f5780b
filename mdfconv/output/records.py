"""Records as text: JSON, CSV and Markdown."""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

Record = Mapping[str, Any]

# Below it, in units of its first digit, an error has two digits.
_TWO_DIGITS = 3.55
# Powers of ten of numbers that people read without one.
_PLAIN = range(-4, 6)
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


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
    """Return a number with its error, as ``0.101 ± 0.004``, and no digits that it does not support.

    An error has two digits where they are at most 35, and one above (Particle Data Group, Review of
    Particle Physics, introduction). Without an error above 0 the number has three.
    """
    if not math.isfinite(value):
        return "—"
    numbers = [value]
    if error is not None and math.isfinite(error) and error > 0:
        numbers.append(error)
    scale = _magnitude(max(map(abs, numbers)))
    last = scale - 2
    if len(numbers) > 1:
        size = _magnitude(numbers[1])
        last = size - 1 if numbers[1] < _TWO_DIGITS * 10.0**size else size
    power = 0 if scale in _PLAIN else scale
    places = max(power - last, 0)
    # Adding 0 makes 0 of −0.
    texts = [f"{round(number, -last) / 10.0**power + 0.0:.{places}f}" for number in numbers]
    text = " ± ".join(texts).replace("-", "−")
    if power and len(numbers) > 1:
        text = f"({text})"
    return text + (f"·{power_of_ten(power)}" if power else "")


def percent(share: float, *, is_aligned: bool = False) -> str:
    """Return a share in percent: two digits, and of large ones all before the point.

    In a column they are aligned: a second digit that is 0 is written, too.
    """
    number = 100 * share
    if 0 < number < 0.01:
        return "less than 0.01 %"
    if number > 1e4:
        return "more than 10000 %"
    if number >= 9.95:
        return f"{number:.0f} %"
    return f"{number:#.2g} %" if is_aligned else f"{number:.2g} %"


def power_of_ten(power: int) -> str:
    """Return a power of ten for people, as 10⁻⁵."""
    return f"10{str(power).translate(_RAISED)}"


def _magnitude(value: float) -> int:
    return math.floor(math.log10(value)) if value else 0


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
