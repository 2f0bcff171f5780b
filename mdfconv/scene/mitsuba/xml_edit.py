"""XML files whose values are changed in their bytes: everything else is kept as it stands.

Expat says what is well-formed and where each element starts. Nothing outside the file is read, and
entities, by which a small file can stand for a huge one, are refused before they are used.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any
from xml.parsers import expat
from xml.sax.saxutils import escape

from mdfconv.errors import MdfconvError

# No scene is nested so deeply.
DEEPEST = 1000
_UTF_8 = ("utf-8", "utf8", "us-ascii", "ascii")
_BLANK = rb"[ \t\r\n]"
_ATTRIBUTE = rb"(?:[ \t\r\n]+[^ \t\r\n=/>]+[ \t\r\n]*=[ \t\r\n]*(?:\"[^\"]*\"|'[^']*'))"
_NAME = rb"<[^ \t\r\n/>]+"
_VALUE = re.compile(
    _NAME + _ATTRIBUTE + rb"*?[ \t\r\n]+value[ \t\r\n]*=[ \t\r\n]*(?:\"([^\"]*)\"|'([^']*)')"
)
# What ends it: the blanks before a slash, the slash, and the bracket.
_START_TAG = re.compile(_NAME + _ATTRIBUTE + rb"*([ \t\r\n]*(/?)>)")
_INDENTATION = re.compile(rb"[\r\n]([ \t]+)<")
# Where the usual indentation is looked for, anew for each element.
_FIRST_LINES = 4096
_QUOTE = re.compile(rb"[^\"']*([\"'])")


# Most elements have none in them; never changed.
_NONE: list[Any] = []


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
    """

    __slots__ = ("attributes", "children", "start", "tag")

    def __init__(self, tag: str, attributes: dict[str, str], start: int) -> None:
        self.tag, self.attributes, self.start = tag, attributes, start
        # Those directly in it, in order.
        self.children: list[Element] = _NONE


class Lines:
    """The lines of a file, counted from 1: quick for places that are asked for in order."""

    def __init__(self, data: bytes) -> None:
        self._data = data
        self._position, self._line = 0, 1
        self._returns = b"\r" in data

    def __call__(self, position: int) -> int:
        """Return the line of a byte that does not end one."""
        if position < self._position:
            self._position, self._line = 0, 1
        part = self._position, position
        count = self._data.count
        self._line += count(b"\n", *part)
        if self._returns:
            self._line += count(b"\r", *part) - count(b"\r\n", *part)
        self._position = position
        return self._line


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
    parser.XmlDeclHandler = _check_encoding
    parser.StartDoctypeDeclHandler = _check_document_type
    parser.EntityDeclHandler = _refuse_entity
    elements: list[Element] = []
    open_ones: list[Element] = []

    def start(tag: str, attributes: dict[str, str]) -> None:
        element = Element(tag, attributes, parser.CurrentByteIndex)
        elements.append(element)
        if open_ones:
            parent = open_ones[-1]
            if not parent.children:
                parent.children = [element]
            else:
                parent.children.append(element)
        open_ones.append(element)
        if len(open_ones) > DEEPEST:
            raise MdfconvError(f"elements are nested more than {DEEPEST} levels deep")

    def end(tag: str) -> None:
        open_ones.pop()

    parser.StartElementHandler = start
    parser.EndElementHandler = end
    try:
        parser.Parse(data, True)
    except expat.ExpatError as error:
        reason = expat.ErrorString(error.code)
        raise MdfconvError(f"not well-formed XML, line {error.lineno}: {reason}") from None
    return elements


def _check_encoding(version: str, encoding: str | None, standalone: int) -> None:
    if encoding is not None and encoding.lower() not in _UTF_8:
        raise MdfconvError(f"the file is in {encoding}, not in UTF-8")


def _check_document_type(name: str, system: str | None, public: str | None, internal: bool) -> None:
    if system is not None or public is not None:
        raise MdfconvError("the document type stands in another file, which is not read")


def _refuse_entity(name: str, *_: Any) -> None:
    raise MdfconvError(f"the file declares the entity {name}, and entities are not read")


def value_place(data: bytes, element: Element) -> tuple[int, int]:
    """Return where the attribute ``value``, which an element has, starts and ends in the file.

    The blanks around it do not belong to it.
    """
    match = _VALUE.match(data, element.start)
    assert match is not None
    which = match.lastindex or 1
    start, end = match.span(which)
    text = match[which]
    return start + len(text) - len(text.lstrip()), end - len(text) + len(text.rstrip())


def _start_tag(data: bytes, element: Element) -> re.Match[bytes]:
    match = _START_TAG.match(data, element.start)
    assert match is not None
    return match


def attribute_text(value: str) -> bytes:
    """Return what stands between quotes, of either kind, for a value of an attribute."""
    return escape(value, {'"': "&quot;", "'": "&apos;"}).encode()


def children_insertion(
    data: bytes, element: Element, children: list[tuple[str, dict[str, str]]]
) -> tuple[int, int, bytes]:
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
    int, int, bytes
        Where what is to be replaced starts and ends, and what takes its place.
    """
    tag = _start_tag(data, element)
    ending = b"/>"
    if element.children:
        gap, closing = _blanks_before(data, element.children[0].start), b""
        first = _start_tag(data, element.children[0])
        ending = first[1] if first[2] else ending
    else:
        closing = _blanks_before(data, element.start)
        gap = closing and closing + _step(data, closing)
        if not tag[2] and data[tag.end() : tag.end() + 2] != b"</":
            closing = b""
    quote = _QUOTE.match(tag[0])
    mark = quote[1] if quote else b'"'
    inner = b"".join(gap + _empty_element(*child, mark, ending) for child in children) + closing
    if not tag[2]:
        return tag.end(), tag.end(), inner
    name = element.tag.encode()
    return *tag.span(1), b">" + inner + b"</" + name + b">"


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
    first = _INDENTATION.search(data, 0, _FIRST_LINES)
    return first[1] if first else b"    "


def apply_edits(data: bytes, edits: Mapping[int, tuple[int, bytes]]) -> bytes:
    """Return a file with pieces of it replaced.

    Parameters
    ----------
    data : bytes
        The file.
    edits : mapping of int to (int, bytes)
        From where a piece starts to where it ends, and what takes its place; none overlap.
    """
    pieces: list[bytes] = []
    position = 0
    for start in sorted(edits):
        end, new = edits[start]
        pieces += (data[position:start], new)
        position = end
    return b"".join([*pieces, data[position:]])
