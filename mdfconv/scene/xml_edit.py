"""XML files whose values are changed in their bytes: everything else is kept as it stands.

Expat says what is well-formed and where each element starts. Nothing outside the file is read, and
entities, by which a small file can stand for a huge one, are refused before they are used.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any
from xml.parsers import expat
from xml.sax.saxutils import escape

from mdfconv.errors import MdfconvError

# No scene is nested so deeply.
DEEPEST = 1000
_UTF_8 = ("utf-8", "utf8", "us-ascii", "ascii")
_BLANK = rb"[ \t\r\n]"
_ATTRIBUTE = re.compile(
    _BLANK + rb"+([^ \t\r\n=/>]+)" + _BLANK + rb"*=" + _BLANK + rb"*(\"[^\"]*\"|'[^']*')"
)
_TAG_END = re.compile(rb"(" + _BLANK + rb"*)(/?)>")
_TAG_NAME = re.compile(rb"<[^ \t\r\n/>]+")


@dataclass(slots=True, eq=False)
class Element:
    """An element of an XML file.

    Parameters
    ----------
    tag : str
        Its name.
    attributes : dict of str to str
        The values that its attributes have for a reader: references replaced, blanks normalized.
    start : int
        Where its first byte, ``<``, stands.
    line : int
        Its line, counted from 1.
    children : list of Element
        Those directly in it, in order.
    """

    tag: str
    attributes: dict[str, str]
    start: int
    line: int
    children: list[Element] = field(default_factory=list)


@dataclass(frozen=True)
class StartTag:
    """Where the parts of an element's first tag stand.

    Parameters
    ----------
    values : dict of str to slice
        The values of attributes, between their quotes, by name.
    end : slice
        What ends the tag: ``>``, or ``/>`` with the blanks before it.
    empty : bool
        Whether the element ends with the tag.
    quote : bytes
        The mark around the values, that of the first attribute.
    """

    values: dict[str, slice]
    end: slice
    empty: bool
    quote: bytes


def read_elements(data: bytes) -> list[Element]:
    """Return the elements of an XML file in the order of their starts, the root first.

    Raises
    ------
    MdfconvError
        If it is not well-formed, not in UTF-8, nested more than `DEEPEST` levels deep, declares
        entities, or names a document type that stands in another file.
    """
    if data[:2] in (b"\xff\xfe", b"\xfe\xff") or b"\0" in data[:4]:
        raise MdfconvError("the file is not in UTF-8, the only encoding of XML that is read")
    parser = expat.ParserCreate()
    # Defaults that a document type gives to attributes have no bytes to change.
    parser.specified_attributes = True
    builder = _Builder(parser)
    try:
        parser.Parse(data, True)
    except expat.ExpatError as error:
        reason = expat.ErrorString(error.code)
        raise MdfconvError(f"not well-formed XML, line {error.lineno}: {reason}") from None
    return builder.elements


class _Builder:
    """Collects what Expat finds."""

    def __init__(self, parser: expat.XMLParserType) -> None:
        self.elements: list[Element] = []
        self._open: list[Element] = []
        self._parser = parser
        parser.StartElementHandler = self._start
        parser.EndElementHandler = self._end
        parser.XmlDeclHandler = self._declaration
        parser.StartDoctypeDeclHandler = self._document_type
        parser.EntityDeclHandler = self._entity

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        parser, stack = self._parser, self._open
        element = Element(tag, attributes, parser.CurrentByteIndex, parser.CurrentLineNumber)
        if stack:
            stack[-1].children.append(element)
            if len(stack) >= DEEPEST:
                raise MdfconvError(f"elements are nested more than {DEEPEST} levels deep")
        stack.append(element)
        self.elements.append(element)

    def _end(self, tag: str) -> None:
        self._open.pop()

    def _declaration(self, version: str, encoding: str | None, standalone: int) -> None:
        if encoding is not None and encoding.lower() not in _UTF_8:
            raise MdfconvError(f"the file is in {encoding}, not in UTF-8")

    def _document_type(
        self, name: str, system: str | None, public: str | None, internal: bool
    ) -> None:
        if system is not None or public is not None:
            raise MdfconvError("the document type stands in another file, which is not read")

    def _entity(self, name: str, *_: Any) -> None:
        raise MdfconvError(f"the file declares the entity {name}, and entities are not read")


def start_tag(data: bytes, element: Element) -> StartTag:
    """Return where the parts of an element's first tag stand, in the file it was read from."""
    name = _TAG_NAME.match(data, element.start)
    assert name is not None
    values: dict[str, slice] = {}
    position, quote = name.end(), b'"'
    while match := _ATTRIBUTE.match(data, position):
        if not values:
            quote = match[2][:1]
        values[match[1].decode()] = slice(match.start(2) + 1, match.end(2) - 1)
        position = match.end()
    end = _TAG_END.match(data, position)
    assert end is not None
    return StartTag(values, slice(*end.span()), bool(end[2]), quote)


def attribute_text(value: str) -> bytes:
    """Return what stands between quotes, of either kind, for a value of an attribute."""
    return escape(value, {'"': "&quot;", "'": "&apos;"}).encode()


def children_insertion(
    data: bytes, element: Element, children: list[tuple[str, dict[str, str]]]
) -> tuple[slice, bytes]:
    """Return the edit that puts empty elements before the children of an element.

    They stand as its first child does, or if it has none a step further in than itself, and have
    its quotes.

    Parameters
    ----------
    data : bytes
        The file.
    element : Element
        Read from it.
    children : list of (str, dict)
        Tags and attributes.

    Returns
    -------
    slice, bytes
        What to replace, and by what.
    """
    tag = start_tag(data, element)
    if element.children:
        gap, closing = _blanks_before(data, element.children[0].start), b""
        first = start_tag(data, element.children[0])
        end = data[first.end] if first.empty else b"/>"
    else:
        closing = _blanks_before(data, element.start)
        gap, end = closing and closing + _step(data, closing), b"/>"
        if not tag.empty and data[tag.end.stop : tag.end.stop + 2] != b"</":
            closing = b""
    texts = [gap + _empty_element(*child, tag.quote, end) for child in children]
    inner = b"".join(texts) + closing
    if not tag.empty:
        return slice(tag.end.stop, tag.end.stop), inner
    name = element.tag.encode()
    return tag.end, b">" + inner + b"</" + name + b">"


def _empty_element(tag: str, attributes: dict[str, str], quote: bytes, end: bytes) -> bytes:
    pairs = [
        b" " + name.encode() + b"=" + quote + attribute_text(value) + quote
        for name, value in attributes.items()
    ]
    return b"<" + tag.encode() + b"".join(pairs) + end


def _blanks_before(data: bytes, position: int) -> bytes:
    """Return the end of line and the indentation before an element that starts its line."""
    start = position
    while start and data[start - 1] in b" \t":
        start -= 1
    indentation = data[start:position]
    if data[max(0, start - 2) : start] == b"\r\n":
        return b"\r\n" + indentation
    return data[start - 1 : start] + indentation if data[start - 1 : start] in b"\r\n" else b""


def _step(data: bytes, blanks: bytes) -> bytes:
    """Return by how much the children of an element are indented."""
    indentation = blanks.lstrip(b"\r\n")
    if indentation.startswith(b"\t"):
        return b"\t"
    first = re.search(rb"[\r\n]([ \t]+)<", data)
    return first[1] if first else b"    "


def apply_edits(data: bytes, edits: Mapping[int, tuple[slice, bytes]]) -> bytes:
    """Return a file with pieces of it replaced.

    Parameters
    ----------
    data : bytes
        The file.
    edits : mapping of int to (slice, bytes)
        What to replace, and by what, by where it starts; none overlap.
    """
    pieces, position = [], 0
    for start in sorted(edits):
        where, new = edits[start]
        pieces += [data[position : where.start], new]
        position = where.stop
    return b"".join([*pieces, data[position:]])
