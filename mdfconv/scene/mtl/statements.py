"""The statements of a Wavefront material library that matter here, in their bytes."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

_BYTE_ORDER_MARK = b"\xef\xbb\xbf"
_BLANKS = b" \t"
# A line and what ends it.
_LINE = re.compile(rb"([^\r\n]*)(\r\n|\n|\r|\Z)")
_START = re.compile(
    rb"((?:\xef\xbb\xbf)?[ \t]*)(newmtl|Ns|Pr|map_Ns|map_Pr)(?=[ \t#]|\Z)",
)
# In any case of letters, as readers take them.
_TEXTURE = re.compile(rb"[ \t]*(?:map_\w+|bump|disp|decal|refl|norm)[ \t]+(.*)\Z", re.IGNORECASE)
_NUMBER = re.compile(rb"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?\Z")
_OPTION = re.compile(
    rb"-[A-Za-z]\w*(?:[ \t]+(?:[+-]?[\d.]\S*|on|off|[rgbmlz](?=[ \t])|\w+_\w+))+[ \t]+"
)


class Line(NamedTuple):
    """A line of a library, in pieces if it is a statement that matters here.

    Parameters
    ----------
    before, keyword, gap, value, after : bytes
        The line: indentation, keyword, blanks, value, and blanks with a comment. Of any other
        line all is in `before`.
    end : bytes
        What ends it; nothing at the end of the library.
    number : int
        Counted from 1.
    material : int
        The number of ``newmtl`` statements up to it.
    """

    before: bytes
    keyword: bytes
    gap: bytes
    value: bytes
    after: bytes
    end: bytes
    number: int
    material: int

    @property
    def content(self) -> bytes:
        """The line without its end."""
        return self.before + self.keyword + self.gap + self.value + self.after

    def with_value(self, keyword: bytes, value: bytes) -> bytes:
        """Return the content with another keyword and value, all else kept."""
        if self.value:
            return self.before + keyword + self.gap + value + self.after
        # A keyword alone, or with a comment close by.
        comment = self.after and (self.gap or b" ") + self.after
        return self.before + keyword + b" " + value + comment

    def another(self, keyword: bytes, value: bytes) -> bytes:
        """Return the content of a new line like this one: its indentation, not its comment."""
        return self.before.removeprefix(_BYTE_ORDER_MARK) + keyword + self.gap + value


def lines(data: bytes) -> Iterator[Line]:
    """Yield the lines of a library."""
    material = 0
    for count, match in enumerate(_LINE.finditer(data), start=1):
        if not match[0]:
            break
        pieces = _pieces(match[1])
        material += pieces[1] == b"newmtl"
        yield Line(*pieces, match[2], count, material)


def _pieces(content: bytes) -> tuple[bytes, bytes, bytes, bytes, bytes]:
    start = _START.match(content)
    if not start:
        return content, b"", b"", b"", b""
    rest = content[start.end() :]
    gap = rest[: len(rest) - len(rest.lstrip(_BLANKS))]
    text, mark, comment = rest[len(gap) :].partition(b"#")
    value = text.rstrip(_BLANKS)
    return start[1], start[2], gap, value, text[len(value) :] + mark + comment


def number(text: bytes, keyword: bytes) -> tuple[str, float]:
    """Return what is wrong with the value of an Ns or a Pr, "" if nothing, and the value."""
    shown = f"{keyword.decode()} '{text.decode(errors='replace')}'"
    if not _NUMBER.match(text):
        return f"{shown} is not a number", np.nan
    value = float(text)
    if not 0 <= value < np.inf or (keyword == b"Pr" and value > 1):
        return f"{shown} is outside {'0 ≤ Pr ≤ 1' if keyword == b'Pr' else 'Ns ≥ 0'}", np.nan
    return "", value


def named_files(content: Iterable[Line]) -> list[str]:
    """Return the textures that a library names, in order."""
    statements = (_TEXTURE.match(line.content) for line in content)
    values = [match[1].partition(b"#")[0].rstrip(_BLANKS) for match in statements if match]
    return [split_options(value)[1].decode(errors="replace") for value in values]


def split_options(value: bytes) -> tuple[bytes, bytes]:
    """Return the options of a texture statement, such as ``-s 2 2 1``, and its file."""
    end = 0
    while match := _OPTION.match(value, end):
        end = match.end()
    return value[:end], value[end:]
