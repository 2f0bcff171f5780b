"""What the texts of several pages share."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import fill

_WIDTH = 100


def wrapped(text: str) -> str:
    """Return a text in lines of the usual length; each of its lines is a paragraph or an item."""
    return "\n".join(
        fill(line, _WIDTH, subsequent_indent="  " * line.startswith("- "), break_on_hyphens=False)
        for line in text.splitlines()
    )


def percent(share: float) -> str:
    """Return a share in two digits; no line breaks before its sign."""
    return f"{float(f'{100 * share:.2g}'):g}\N{NO-BREAK SPACE}%"


def enumeration(names: Sequence[str]) -> str:
    """Return names with commas and an "and" before the last."""
    return " and ".join([", ".join(names[:-1])] * (len(names) > 1) + list(names[-1:]))
