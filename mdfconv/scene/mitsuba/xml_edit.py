"""XML files whose values are changed in their bytes: everything else is kept as it stands.

Expat says what is well-formed and where each element starts. Nothing outside the file is read, and
entities, by which a small file can stand for a huge one, are refused before they are used.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import Any
from xml.parsers import expat
from xml.sax.saxutils import escape

from mdfconv.errors import MdfconvError
from mdfconv.scene.material_files import spliced

# No scene is nested so deeply.
DEEPEST = 1000
_UTF_8 = ("utf-8", "utf8", "us-ascii", "ascii")
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


@dataclass(slots=True, eq=False)
class Element:
    """An element of an XML file.

    Parameters
    ----------
    tag : str
        Its name.
    attributes : dict of str to str
        The values that its attributes have for a reader: references replaced, blanks normalized.
    start, line : int
        Where its first byte, ``<``, stands, and in which line, counted from 1.
    children : list of Element
        Those directly in it, in order.
    """

    tag: str
    attributes: dict[str, str]
    start: int
    line: int
    children: list[Element] = field(default_factory=list)

    def get(self, attribute: str) -> str:
        """Return the value of an attribute, "" if there is none."""
        return self.attributes.get(attribute, "")


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
    elements: list[Element] = []
    open_elements: list[Element] = []

    def start(tag: str, attributes: dict[str, str]) -> None:
        element = Element(tag, attributes, parser.CurrentByteIndex, parser.CurrentLineNumber)
        elements.append(element)
        if open_elements:
            open_elements[-1].children.append(element)
        open_elements.append(element)
        if len(open_elements) > DEEPEST:
            raise MdfconvError(f"elements are nested more than {DEEPEST} levels deep")

    parser = expat.ParserCreate()
    # Defaults that a document type gives to attributes have no bytes to change.
    parser.specified_attributes = True
    parser.XmlDeclHandler = _check_encoding
    parser.StartDoctypeDeclHandler = _check_document_type
    parser.EntityDeclHandler = _refuse_entity
    parser.StartElementHandler = start
    parser.EndElementHandler = lambda _: open_elements.pop()
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


def attribute_text(value: str) -> bytes:
    """Return what stands between quotes, of either kind, for a value of an attribute."""
    return escape(value, {'"': "&quot;", "'": "&apos;"}).encode()


class XmlEdits:
    """Changes in the bytes of an XML file, of which none overlap."""

    def __init__(self, data: bytes) -> None:
        self._data = data
        # By where a piece starts: that, where it ends, and what takes its place.
        self._edits: dict[int, tuple[int, int, bytes]] = {}

    def result(self) -> bytes:
        """Return the changed file."""
        return spliced(self._data, self._edits.values())

    def set_value(self, element: Element, text: bytes) -> None:
        """Change the attribute ``value``, which an element has; the blanks around it are kept."""
        match = _VALUE.match(self._data, element.start)
        assert match is not None
        start, end = match.span(match.lastindex or 1)
        old = self._data[start:end]
        start, end = start + len(old) - len(old.lstrip()), end - len(old) + len(old.rstrip())
        self._edits[start] = start, end, text

    def add_properties(self, element: Element, properties: list[tuple[str, str, str]]) -> None:
        """Put properties, of a tag, a name and a value, before the children of an element.

        They stand as its first child does, or if it has none a step further in than itself, and
        have its quotes.
        """
        tag = self._start_tag(element)
        ending, closing = b"/>", b""
        if element.children:
            gap = self._blanks_before(element.children[0].start)
            first = self._start_tag(element.children[0])
            ending = first[1] if first[2] else ending
        else:
            closing = self._blanks_before(element.start)
            gap = closing and closing + self._step(closing)
            if not tag[2] and self._data[tag.end() : tag.end() + 2] != b"</":
                closing = b""
        quoted = _QUOTE.match(tag[0])
        quote = quoted[1] if quoted else b'"'
        inner = b""
        for kind, *texts in properties:
            name, value = (quote + attribute_text(text) + quote for text in texts)
            inner += gap + b"<%b name=%b value=%b%b" % (kind.encode(), name, value, ending)
        inner += closing
        if tag[2]:
            start, end = tag.span(1)
            inner = b">" + inner + b"</" + element.tag.encode() + b">"
        else:
            start = end = tag.end()
        self._edits[start] = start, end, inner

    def _start_tag(self, element: Element) -> re.Match[bytes]:
        match = _START_TAG.match(self._data, element.start)
        assert match is not None
        return match

    def _blanks_before(self, position: int) -> bytes:
        """Return the end of line and the indentation before an element that starts its line."""
        start = position
        while start and self._data[start - 1] in b" \t":
            start -= 1
        indentation = self._data[start:position]
        if self._data[max(0, start - 2) : start] == b"\r\n":
            return b"\r\n" + indentation
        end = self._data[start - 1 : start]
        return end + indentation if end in b"\r\n" else b""

    def _step(self, blanks: bytes) -> bytes:
        """Return by how much the children of an element are indented."""
        if blanks.lstrip(b"\r\n").startswith(b"\t"):
            return b"\t"
        first = _INDENTATION.search(self._data, 0, _FIRST_LINES)
        return first[1] if first else b"    "
