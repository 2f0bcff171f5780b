"""The statements of a Wavefront material library that matter here, in their bytes."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, field

from mdfconv.errors import MdfconvError

_BYTE_ORDER_MARK = b"\xef\xbb\xbf"
_BLANKS = b" \t"
# Indentation, keyword, blanks, value, and blanks with a comment. Blanks are taken all or none, so
# that a long line takes no long time.
_STATEMENT = re.compile(
    rb"((?:\xef\xbb\xbf)?[ \t]*)(newmtl|Ns|Pr|Ks|map_Ns|map_Pr)(?=[ \t#]|\Z)([ \t]*)"
    rb"((?:[^ \t#]++|[ \t]++(?=[^ \t#]))*+)(.*)\Z"
)
# In any case of letters, as readers take them.
_TEXTURE = re.compile(rb"[ \t]*(?:map_\w+|bump|disp|decal|refl|norm)[ \t]+(.*)\Z", re.IGNORECASE)
_NUMBER = re.compile(rb"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?\Z")
# What follows "1." of an infinity or of what is no number: "#INF00", "#QNAN0", "#IND".
_NO_NUMBER = re.compile(rb"#(?:INF|IND|QNAN|SNAN)")
# In any case of letters; the texels become base + gain · texel.
_BASE_AND_GAIN = re.compile(rb"-mm[ \t]+(\S+)[ \t]+(\S+)", re.IGNORECASE)
_OPTION = re.compile(
    rb"-[A-Za-z]\w*(?:[ \t]+(?:[+-]?[\d.]\S*|on|off|[rgbmlz](?=[ \t])|\w+_\w+))+[ \t]+"
)


@dataclass(slots=True, eq=False)
class Line:
    """A line of a library, in pieces if it is a statement that matters here.

    Parameters
    ----------
    before, keyword, gap, value, after : bytes
        The line: indentation, keyword, blanks, value, and blanks with a comment. Of any other
        line all is in `before`.
    end, usual_end : bytes
        What ends it, nothing at the end of the library; and what would if a line were to follow.
    number : int
        Counted from 1.
    replacement : bytes or None
        What is to stand in its place, ends included; None for the line itself.
    """

    before: bytes
    keyword: bytes
    gap: bytes
    value: bytes
    after: bytes
    end: bytes
    usual_end: bytes
    number: int
    replacement: bytes | None = None

    @property
    def content(self) -> bytes:
        """The line without its end."""
        return self.before + self.keyword + self.gap + self.value + self.after

    @property
    def result(self) -> bytes:
        """What is written, ends included."""
        return self.content + self.end if self.replacement is None else self.replacement

    @property
    def is_changed(self) -> bool:
        """Whether what is written is something else."""
        return self.replacement not in (None, self.content + self.end)

    @property
    def shown(self) -> str:
        """Its keyword and its value."""
        return f"{self.keyword.decode()} {self.value.decode(errors='replace')}"

    def with_value(self, keyword: bytes, value: bytes) -> bytes:
        """Return the line with another keyword and value, all else kept."""
        if self.value:
            return self.before + keyword + self.gap + value + self.after + self.end
        # A keyword alone, or with a comment close by.
        comment = self.after and (self.gap or b" ") + self.after
        return self.before + keyword + b" " + value + comment + self.end

    def and_another(self, keyword: bytes, value: bytes) -> bytes:
        """Return the line and a new one like it: of its indentation, without its comment."""
        indentation = self.before.removeprefix(_BYTE_ORDER_MARK)
        new = indentation + keyword + self.gap + value
        return self.content + self.usual_end + new + self.end


@dataclass(slots=True, eq=False)
class MaterialBlock:
    """The statements of one material, by their keywords.

    Parameters
    ----------
    name : str
        From its ``newmtl``; "" for statements before the first.
    statements : dict of bytes to list of Line
        In the order of the library.
    """

    name: str
    statements: dict[bytes, list[Line]] = field(default_factory=dict)

    def having(self, keyword: bytes) -> list[Line]:
        """Return the statements of a keyword."""
        return self.statements.get(keyword, [])


def read_library(data: bytes) -> tuple[list[Line], list[MaterialBlock]]:
    """Return the lines of a library and its materials, the first for what is before them."""
    lines: list[Line] = []
    blocks = [MaterialBlock("")]
    for number, whole in enumerate(data.splitlines(keepends=True), start=1):
        content = whole.rstrip(b"\r\n")
        end = whole[len(content) :]
        statement = _STATEMENT.match(content)
        before, keyword, gap, value, after = (
            statement.groups() if statement else (content, b"", b"", b"", b"")
        )
        # For a last line that nothing ends: that of the first.
        usual_end = lines[0].end if lines else b"\n"
        line = Line(before, keyword, gap, value, after, end, end or usual_end, number)
        lines.append(line)
        if keyword == b"newmtl":
            blocks.append(MaterialBlock(value.decode(errors="replace")))
        elif keyword:
            blocks[-1].statements.setdefault(keyword, []).append(line)
    return lines, blocks


def number(line: Line) -> float:
    """Return the value of an Ns or a Pr; raise `MdfconvError` if it is not a finite number."""
    shown = f"{line.keyword.decode()} '{line.value.decode(errors='replace')}"
    if _NO_NUMBER.match(line.after):
        shown += line.after.decode(errors="replace").split()[0]
        raise MdfconvError(f"{shown}' is not a number", "a runtime of Microsoft writes that")
    if not _NUMBER.match(line.value):
        point = line.value.replace(b",", b".")
        decimal = b"," in line.value and _NUMBER.match(point)
        hint = f"it has a decimal comma: write {point.decode()}" if decimal else ""
        raise MdfconvError(f"{shown}' is not a number", hint)
    value = float(line.value)
    if line.keyword == b"Pr" and not 0 <= value <= 1:
        raise MdfconvError(f"{shown}' is outside 0 ≤ Pr ≤ 1")
    return value


def colour(line: Line) -> tuple[float, ...]:
    """Return a colour such as Ks; empty if it is not one or three numbers."""
    words = line.value.split()
    if len(words) not in (1, 3) or not all(map(_NUMBER.match, words)):
        return ()
    # A single number stands for all three.
    return tuple(float(word) for word in words) * (3 // len(words))


def comments(lines: Iterable[Line]) -> list[tuple[int, str]]:
    """Return the lines before the first statement that are comments, with their numbers."""
    found = []
    for line in lines:
        if line.keyword:
            break
        text = line.before.removeprefix(_BYTE_ORDER_MARK).strip()
        if text.startswith(b"#"):
            found.append((line.number, text.decode(errors="replace")))
    return found


def named_files(lines: Iterable[Line]) -> list[str]:
    """Return the textures that a library names, in order."""
    statements = (_TEXTURE.match(line.content) for line in lines)
    values = [match[1].partition(b"#")[0].rstrip(_BLANKS) for match in statements if match]
    return [split_options(value)[1].decode(errors="replace") for value in values]


def split_options(value: bytes) -> tuple[bytes, bytes]:
    """Return the options of a texture statement, such as ``-s 2 2 1``, and its file."""
    end = 0
    while match := _OPTION.match(value, end):
        end = match.end()
    return value[:end], value[end:]


def rescales(line: Line) -> bool:
    """Return whether a texture statement has a base and a gain, other than 0 and 1."""
    match = _BASE_AND_GAIN.search(split_options(line.value)[0])
    if not match:
        return False
    return not all(map(_NUMBER.match, match.groups())) or tuple(map(float, match.groups())) != (
        0,
        1,
    )
