"""The images of a glTF file: read wherever they are, and others put in their places."""

from __future__ import annotations

import base64
import binascii
import json
import re
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any
from urllib.parse import quote, unquote

from mdfconv.errors import MdfconvError
from mdfconv.output.kinds import refuse_foreign
from mdfconv.scene.gltf.document import GltfDocument, is_address
from mdfconv.scene.gltf.json_edit import JsonText
from mdfconv.scene.material_files import free_name, read_file

_DATA = re.compile(r"data:([^,]*),", re.IGNORECASE)
_SIGNATURES = {b"\x89PNG\r\n\x1a\n": ".png", b"\xff\xd8\xff": ".jpg"}
_UNSAFE = re.compile(r"[^\w.-]+")
_MIME = "image/png"


@dataclass(frozen=True)
class GltfTextures:
    """Where the textures of a file are, and which are taken.

    Parameters
    ----------
    source : Path
        The folder that relative addresses start from: that of the file.
    output : Path
        The folder of the result, for new files beside it.
    lossy : bool
        Whether to take a JPEG, although it has altered the values; it becomes a PNG.
    """

    source: Path
    output: Path
    lossy: bool = False


def index_of(value: Any, entries: list[Any], what: str) -> int:
    """Return an index into the entries of a file; refuse what names none that is an object."""
    if not is_count(value) or not 0 <= value < len(entries):
        raise MdfconvError(f"names no {what} that is there")
    if not isinstance(entries[int(value)].value, dict):
        raise MdfconvError(f"names a {what} that is no object")
    return int(value)


def is_count(value: Any) -> bool:
    """Return whether a value of JSON is an integer, however it is written."""
    whole = isinstance(value, int) or (isinstance(value, float) and value.is_integer())
    return whole and not isinstance(value, bool)


class GltfImages:
    """The images of a document, which is changed; new files have an ending before the suffix."""

    def __init__(self, document: GltfDocument, folders: GltfTextures, ending: str) -> None:
        self._document, self._folders, self._ending = document, folders, ending
        names = "images", "bufferViews", "buffers"
        self.images, self._views, self._buffers = map(document.array, names)
        self.files: dict[Path, bytes] = {}
        self._read: dict[Path, bytes] = {}

    def read(self, image: int) -> tuple[bytes, str]:
        """Return the content of an image and the suffix of its form."""
        entry = self.images[image].value
        if ("uri" in entry) == ("bufferView" in entry):
            raise MdfconvError("has not one of uri and bufferView")
        if "uri" in entry:
            content = self._from_uri(entry["uri"])
        else:
            content = self._from_view(index_of(entry["bufferView"], self._views, "bufferView"))
        for signature, suffix in _SIGNATURES.items():
            if content.startswith(signature):
                return content, suffix
        refuse_foreign("", content)
        raise MdfconvError("is neither PNG nor JPEG")

    def replace(self, image: int, content: bytes) -> None:
        """Put another PNG in the place of an image, for all that use it."""
        entry, text = self.images[image].value, self._document.json
        alone = "uri" not in entry and self._views_used.count(entry["bufferView"]) == 1
        if alone and self._in_binary(entry):
            text.set_members(self._views[int(entry["bufferView"])].start, self._append(content))
            text.set_members(self.images[image].start, _kind(entry))
        else:
            text.set_members(self.images[image].start, *self._placed(image, content))

    def add(self, image: int, content: bytes) -> int:
        """Add an image that is like another one but for its content; return its index."""
        copy = JsonText(self._document.json.text_of(self.images[image]))
        copy.set_members(0, *self._placed(image, content))
        return self._document.append("images", copy.changed())

    @property
    def inputs(self) -> tuple[Path, ...]:
        """The files that were read."""
        return tuple(self._read)

    @cached_property
    def _views_used(self) -> list[Any]:
        """What the document names of its buffer views, each as often as it does."""
        return [value for key, value in self._document.everything if key == "bufferView"]

    def _in_binary(self, entry: dict[str, Any]) -> bool:
        """Return whether an image in a buffer view is in the binary chunk of a GLB."""
        view = self._views[int(entry["bufferView"])].value
        return view["buffer"] == 0 and "uri" not in self._buffers[0].value

    def _append(self, content: bytes) -> dict[str, str]:
        """Append to the binary chunk; return the members of a buffer view of it."""
        offset = self._document.append_binary(content)
        return {"byteOffset": str(offset), "byteLength": str(len(content))}

    def _placed(self, image: int, content: bytes) -> tuple[dict[str, str], dict[str, str]]:
        """Store a PNG where an image is; return members to set, and new names of members."""
        entry = self.images[image].value
        if "uri" in entry:
            return {"uri": self._stored(image, content, entry["uri"])} | _kind(entry), {}
        if self._in_binary(entry):
            members = {"buffer": "0"} | self._append(content)
            pairs = ", ".join(f'"{name}": {value}' for name, value in members.items())
            view = self._document.append("bufferViews", f"{{{pairs}}}")
            return {"bufferView": str(view)} | _kind(entry), {}
        buffer = self._buffers[int(self._views[int(entry["bufferView"])].value["buffer"])].value
        uri = self._stored(image, content, buffer["uri"])
        return {"bufferView": uri} | _kind(entry), {"bufferView": "uri"}

    def _stored(self, image: int, content: bytes, former: str) -> str:
        """Return an address in JSON of content: a data address if the former is, or a new file."""
        if _DATA.match(former):
            return json.dumps(f"data:{_MIME};base64,{base64.b64encode(content).decode()}")
        entry = self.images[image].value
        stem = Path(unquote(entry["uri"])).stem if "uri" in entry else entry.get("name")
        stem = _UNSAFE.sub("_", stem) if isinstance(stem, str) and stem else f"image{image}"
        path = free_name(self._folders.output, f"{stem}_{self._ending}", ".png", self.files)
        self.files[path] = content
        return json.dumps(quote(path.name))

    def _from_uri(self, uri: Any) -> bytes:
        if not isinstance(uri, str):
            raise MdfconvError("names a file by what is no text")
        inside = _DATA.match(uri)
        if inside:
            return _decoded(uri[inside.end() :], inside[1])
        if is_address(uri):
            raise MdfconvError(f"names {uri}, which is no file beside it")
        path = self._folders.source / unquote(uri)
        if path not in self._read:
            try:
                self._read[path] = read_file(path)
            except MdfconvError:
                raise
            except ValueError:
                raise MdfconvError("names a file by what is no name of one") from None
        return self._read[path]

    def _from_view(self, at: int) -> bytes:
        view = self._views[at].value
        buffer = index_of(view.get("buffer"), self._buffers, "buffer")
        entry = self._buffers[buffer].value
        offset, length = view.get("byteOffset", 0), view.get("byteLength")
        if not (is_count(offset) and is_count(length)):
            raise MdfconvError(f"bufferViews[{at}] has no place in its buffer")
        content: bytes | memoryview
        if "uri" in entry:
            content = self._from_uri(entry["uri"])
        elif buffer == 0 and self._document.binary is not None:
            content = self._document.binary
        else:
            raise MdfconvError(f"buffers[{buffer}] is not there")
        if not 0 <= offset <= offset + length <= len(content):
            raise MdfconvError(f"bufferViews[{at}] is not within its buffer")
        return bytes(content[int(offset) : int(offset + length)])


def _kind(entry: dict[str, Any]) -> dict[str, str]:
    """Return what to set for an image that says to be no PNG."""
    return {"mimeType": f'"{_MIME}"'} if entry.get("mimeType", _MIME) != _MIME else {}


def _decoded(payload: str, kind: str) -> bytes:
    """Return the content of a data address."""
    if not kind.lower().endswith(";base64"):
        return unquote(payload, "latin-1").encode("latin-1", errors="replace")
    try:
        return base64.b64decode(payload, validate=True)
    except (binascii.Error, ValueError):
        raise MdfconvError("has a data address that is no base64") from None
