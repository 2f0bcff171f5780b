"""The images of a glTF file: read wherever they are, and others put in their places."""

from __future__ import annotations

import json
import re
import struct
import zlib
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from urllib.parse import quote, unquote

import numpy as np
from numpy.typing import NDArray

from mdfconv.errors import MdfconvError
from mdfconv.output.kinds import refuse_foreign
from mdfconv.scene.gltf.buffers import GltfBuffers, data_uri, is_data
from mdfconv.scene.gltf.document import GltfDocument
from mdfconv.scene.gltf.json_edit import JsonText
from mdfconv.scene.material_files import free_name

_PNG = b"\x89PNG\r\n\x1a\n"
_SIGNATURES = {_PNG: ".png", b"\xff\xd8\xff": ".jpg"}
# The colour type of a PNG.
_RGB = 2
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


class GltfImages:
    """The images of a document, which is changed; new files have an ending before the suffix."""

    def __init__(
        self, document: GltfDocument, buffers: GltfBuffers, folders: GltfTextures, ending: str
    ) -> None:
        self._document, self._buffers = document, buffers
        self._folders, self._ending = folders, ending
        self.images = document.array("images")
        self.files: dict[Path, bytes] = {}

    def read(self, image: int) -> tuple[bytes, str]:
        """Return the content of an image and the suffix of its form."""
        entry = self.images[image].value
        if ("uri" in entry) == ("bufferView" in entry):
            raise MdfconvError("has not one of uri and bufferView")
        if "uri" in entry:
            content = self._buffers.from_uri(entry["uri"])
        else:
            content = self._buffers.from_view(entry["bufferView"])
        for signature, suffix in _SIGNATURES.items():
            if content.startswith(signature):
                return content, suffix
        refuse_foreign("", content)
        raise MdfconvError("is neither PNG nor JPEG")

    def replace(self, image: int, content: bytes) -> None:
        """Put another PNG in the place of an image, for all that use it."""
        entry, text = self.images[image].value, self._document.json
        view = None if "uri" in entry else int(entry["bufferView"])
        if view is not None and self._buffers.uses(view) == 1 and self._buffers.in_binary(view):
            text.set_members(self._buffers.views[view].start, self._buffers.append(content))
            text.set_members(self.images[image].start, _kind(entry))
        else:
            text.set_members(self.images[image].start, *self._placed(image, content))

    def add(self, image: int, content: bytes) -> int:
        """Add an image that is like another one but for its content; return its index."""
        copy = JsonText(self._document.json.text_of(self.images[image]))
        copy.set_members(0, *self._placed(image, content))
        return self._document.append("images", copy.changed())

    def _placed(self, image: int, content: bytes) -> tuple[dict[str, str], dict[str, str]]:
        """Store a PNG where an image is; return members to set, and new names of members."""
        entry = self.images[image].value
        if "uri" in entry:
            return {"uri": self._stored(image, content, entry["uri"])} | _kind(entry), {}
        view = int(entry["bufferView"])
        if self._buffers.in_binary(view):
            return {"bufferView": str(self._buffers.add_view(content))} | _kind(entry), {}
        uri = self._stored(image, content, self._buffers.uri_of(view))
        return {"bufferView": uri} | _kind(entry), {"bufferView": "uri"}

    def _stored(self, image: int, content: bytes, former: str) -> str:
        """Return an address in JSON of content: a data address if the former is, or a new file."""
        if is_data(former):
            return data_uri(content, _MIME)
        entry = self.images[image].value
        stem = Path(unquote(entry["uri"])).stem if "uri" in entry else entry.get("name")
        stem = _UNSAFE.sub("_", stem) if isinstance(stem, str) and stem else f"image{image}"
        path = free_name(self._folders.output, f"{stem}_{self._ending}", ".png", self.files)
        self.files[path] = content
        return json.dumps(quote(path.name))


def green_of_alpha(content: bytes) -> bytes:
    """Return a PNG whose green channel is the alpha of another one; red and blue are white."""
    import OpenImageIO

    with TemporaryDirectory() as folder:
        path = Path(folder) / "texture.png"
        path.write_bytes(content)
        config = OpenImageIO.ImageSpec()
        config.attribute("oiio:UnassociatedAlpha", 1)
        file: Any = OpenImageIO.ImageInput.open(str(path), config)
        with closing(file):
            alpha = np.asarray(file.read_image(3, 4, OpenImageIO.UNKNOWN))
    texels = np.full((*alpha.shape[:2], 3), np.iinfo(alpha.dtype).max, alpha.dtype)
    texels[..., 1] = alpha[..., 0]
    return _png(texels)


def _png(texels: NDArray[Any]) -> bytes:
    """Return a PNG of RGB texels of 8 or 16 bits, shape (height, width, 3)."""
    height, width, _ = texels.shape
    rows = texels.astype(texels.dtype.newbyteorder(">")).reshape(height, -1).view(np.uint8)
    # Each row starts with its filter, 0 for none.
    packed = zlib.compress(np.pad(rows, ((0, 0), (1, 0))).tobytes())
    header = struct.pack(">IIBBBBB", width, height, 8 * texels.itemsize, _RGB, 0, 0, 0)
    content = _PNG
    for name, data in ((b"IHDR", header), (b"IDAT", packed), (b"IEND", b"")):
        checksum = struct.pack(">I", zlib.crc32(name + data))
        content += struct.pack(">I", len(data)) + name + data + checksum
    return content


def _kind(entry: dict[str, Any]) -> dict[str, str]:
    """Return what to set for an image that says to be no PNG."""
    return {"mimeType": f'"{_MIME}"'} if entry.get("mimeType", _MIME) != _MIME else {}
