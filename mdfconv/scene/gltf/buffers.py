"""The buffers of a glTF file: read wherever they are, changed in place, and added to."""

from __future__ import annotations

import base64
import binascii
import json
import re
from functools import cached_property
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from mdfconv.errors import MdfconvError
from mdfconv.scene.gltf.document import GltfDocument, is_address
from mdfconv.scene.gltf.json_edit import object_text
from mdfconv.scene.material_files import read_file

_DATA = re.compile(r"data:([^,]*),", re.IGNORECASE)
_BASE64 = ";base64"
_OCTETS = "application/octet-stream"


def is_count(value: Any) -> bool:
    """Return whether a value of JSON is an integer, however it is written."""
    whole = isinstance(value, int) or (isinstance(value, float) and value.is_integer())
    return whole and not isinstance(value, bool)


def index_of(value: Any, entries: list[Any], what: str) -> int:
    """Return an index into the entries of a file; refuse what names none that is an object."""
    if not is_count(value) or not 0 <= value < len(entries):
        raise MdfconvError(f"names no {what} that is there")
    if not isinstance(entries[int(value)].value, dict):
        raise MdfconvError(f"names a {what} that is no object")
    return int(value)


def is_data(uri: str) -> bool:
    """Return whether a URI has its content in itself."""
    return bool(_DATA.match(uri))


def data_uri(content: bytes, kind: str) -> str:
    """Return an address, in JSON, that has its content in itself."""
    return json.dumps(f"data:{kind}{_BASE64},{base64.b64encode(content).decode()}")


class GltfBuffers:
    """The buffers of a document, which is changed; files are read from a folder, if there is one.

    Files are never written to: what is added goes into the binary chunk of a GLB, else into a
    buffer of its own with a data address.
    """

    def __init__(self, document: GltfDocument, folder: Path | None) -> None:
        self._document, self._folder = document, folder
        self.views, self._buffers = map(document.array, ("bufferViews", "buffers"))
        self._read: dict[Path, bytes] = {}
        self._changed: dict[int, bytearray] = {}

    @property
    def inputs(self) -> tuple[Path, ...]:
        """The files that were read."""
        return tuple(self._read)

    def from_uri(self, uri: Any) -> bytes:
        """Return the content that a URI names."""
        if not isinstance(uri, str):
            raise MdfconvError("names a file by what is no text")
        inside = _DATA.match(uri)
        if inside:
            return _decoded(uri[inside.end() :], inside[1])
        if is_address(uri):
            raise MdfconvError(f"names {uri}, which is no file beside it")
        if self._folder is None:
            raise MdfconvError(f"names {uri}, for which there is no folder")
        path = self._folder / unquote(uri)
        if path not in self._read:
            try:
                self._read[path] = read_file(path)
            except MdfconvError:
                raise
            except ValueError:
                raise MdfconvError("names a file by what is no name of one") from None
        return self._read[path]

    def from_view(self, view: Any) -> bytes:
        """Return the content of the buffer view of an index."""
        at = index_of(view, self.views, "bufferView")
        entry = self.views[at].value
        buffer = index_of(entry.get("buffer"), self._buffers, "buffer")
        uri = self._buffers[buffer].value.get("uri")
        offset, length = entry.get("byteOffset", 0), entry.get("byteLength")
        if not (is_count(offset) and is_count(length)):
            raise MdfconvError(f"bufferViews[{at}] has no place in its buffer")
        content: bytes | memoryview
        if "uri" in self._buffers[buffer].value:
            content = self.from_uri(uri)
        elif buffer == 0 and self._document.binary is not None:
            content = self._document.binary
        else:
            raise MdfconvError(f"buffers[{buffer}] is not there")
        if not 0 <= offset <= offset + length <= len(content):
            raise MdfconvError(f"bufferViews[{at}] is not within its buffer")
        return bytes(content[int(offset) : int(offset + length)])

    def uses(self, view: int) -> int:
        """Return how often the document names a buffer view."""
        return self._views_used.count(view)

    @cached_property
    def _views_used(self) -> list[Any]:
        return [value for key, value in self._document.everything if key == "bufferView"]

    def in_binary(self, view: int) -> bool:
        """Return whether a buffer view, which has been read, is in the binary chunk of a GLB."""
        return self._buffer(view) == 0 and "uri" not in self._buffers[0].value

    def uri_of(self, view: int) -> str:
        """Return the URI of the buffer of a view that has been read and is not in a GLB."""
        uri: str = self._buffers[self._buffer(view)].value["uri"]
        return uri

    def _buffer(self, view: int) -> int:
        return int(self.views[view].value["buffer"])

    def is_alone(self, view: int) -> bool:
        """Return whether a view, which has been read, can be changed without another's notice.

        It is in the file itself, it is named once, and no other view has its bytes.
        """
        start, end = self._span(view)
        try:
            others = [
                self._span(other)
                for other, place in enumerate(self.views)
                if other != view and place.value["buffer"] == self._buffer(view)
            ]
        except (LookupError, TypeError, ValueError):
            # A view that is none may be anything.
            return False
        apart = all(end <= first or last <= start for first, last in others)
        here = self.in_binary(view) or is_data(self.uri_of(view))
        return here and apart and self.uses(view) == 1

    def _span(self, view: int) -> tuple[int, int]:
        entry = self.views[view].value
        start = int(entry.get("byteOffset", 0))
        return start, start + int(entry["byteLength"])

    def patch(self, view: int, offset: int, content: bytes) -> None:
        """Replace bytes of a view that is alone."""
        start = self._span(view)[0] + offset
        if self.in_binary(view):
            self._document.patch_binary(start, content)
            return
        buffer, uri = self._buffer(view), self.uri_of(view)
        changed = self._changed.setdefault(buffer, bytearray(self.from_uri(uri)))
        changed[start : start + len(content)] = content

    def finish(self) -> None:
        """Write what was changed into the document."""
        for buffer, content in self._changed.items():
            kind = _DATA.match(self._buffers[buffer].value["uri"])
            assert kind, "only what is in the file itself is changed"
            named = kind[1][: -len(_BASE64)] if _is_base64(kind[1]) else kind[1]
            members = {"uri": data_uri(bytes(content), named)}
            self._document.json.set_members(self._buffers[buffer].start, members)

    def append(self, content: bytes) -> dict[str, str]:
        """Append to the binary chunk; return the members of a buffer view of it, in JSON."""
        offset = self._document.append_binary(content)
        return {"byteOffset": str(offset), "byteLength": str(len(content))}

    def add_view(self, content: bytes) -> int:
        """Add a buffer view of some bytes; return its index."""
        first = self._buffers[0].value
        if self._document.binary is not None and isinstance(first, dict) and "uri" not in first:
            members = {"buffer": "0"} | self.append(content)
        else:
            size = str(len(content))
            buffer = {"byteLength": size, "uri": data_uri(content, _OCTETS)}
            index = self._document.append("buffers", object_text(buffer))
            members = {"buffer": str(index), "byteLength": size}
        return self._document.append("bufferViews", object_text(members))


def _is_base64(kind: str) -> bool:
    return kind.lower().endswith(_BASE64)


def _decoded(payload: str, kind: str) -> bytes:
    """Return the content of a data address."""
    if not _is_base64(kind):
        return unquote(payload, "latin-1").encode("latin-1", errors="replace")
    try:
        return base64.b64decode(payload, validate=True)
    except (binascii.Error, ValueError):
        raise MdfconvError("has a data address that is no base64") from None
