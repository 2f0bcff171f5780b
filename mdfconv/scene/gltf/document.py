"""A glTF file: JSON alone or in a GLB; its materials found, and changed in place."""

from __future__ import annotations

import re
import struct
from collections import defaultdict
from collections.abc import Sequence
from functools import cached_property
from typing import Any
from urllib.parse import unquote

from mdfconv.errors import MdfconvError
from mdfconv.scene.gltf.json_edit import Place, read_json

_SCHEME = re.compile(r"[A-Za-z][A-Za-z0-9+.-]*:")
FACTOR = "roughnessFactor"
TEXTURE = "metallicRoughnessTexture"
PBR = "pbrMetallicRoughness"
# A GLB has a header, and chunks: their size and type, and content.
_MAGIC, _VERSION = b"glTF", 2
_HEADER, _CHUNK_HEAD = struct.Struct("<4sII"), struct.Struct("<I4s")
_JSON, _BINARY = b"JSON", b"BIN\0"
_ALIGNMENT = 4
_LARGEST = 2**32 - 1


def is_address(uri: str) -> bool:
    """Return whether a URI names no file beside the document: it has a scheme or a host."""
    return uri.startswith("//") or bool(_SCHEME.match(uri))


def is_glb(data: bytes) -> bool:
    """Return whether a file is a GLB by its first bytes."""
    return data.startswith(_MAGIC)


class GltfDocument:
    """A glTF file, and the changes to it; what is no glTF 2.0 is refused."""

    def __init__(self, data: bytes) -> None:
        self._data = data
        # What is behind the JSON in a GLB.
        self._text, self._chunks = _pieces(data) if is_glb(data) else (data, [])
        self._appended = bytearray()
        self._added: defaultdict[str, list[str]] = defaultdict(list)
        self.json = read_json(self._text)
        asset = self.json.value.get("asset")
        self._asset = asset if isinstance(asset, dict) else {}
        version = " ".join(str(self._asset.get("version", "2.0")).split())
        if not version:
            raise MdfconvError("has an empty version of glTF", "2.0 is read: set asset.version")
        if not version.startswith("2."):
            raise MdfconvError(f"is glTF of version {version}, not 2.0")
        self.materials: list[Any] = self.json.value.get("materials", [])
        if not isinstance(self.materials, list):
            raise MdfconvError("is no glTF 2.0: its materials are no array")

    @property
    def binary(self) -> bytes | memoryview | None:
        """The content of the binary chunk, with its padding; None if there is none."""
        kind, content = self._chunks[0] if self._chunks else (b"", b"")
        return content if kind == _BINARY else None

    def append_binary(self, content: bytes) -> int:
        """Add bytes to the binary chunk; return where in it they are."""
        self._appended += bytes(_padding(len(self._appended)))
        place = self._binary_size + len(self._appended)
        self._appended += content
        return place

    @property
    def _binary_size(self) -> int:
        size = len(self.binary or b"")
        return size + _padding(size)

    @property
    def generator(self) -> str:
        """What wrote the file, in one line; "" if it does not say."""
        generator = self._asset.get("generator")
        return " ".join(generator.split()) if isinstance(generator, str) else ""

    @property
    def named_files(self) -> list[str]:
        """The other files that it names: images and buffers."""
        entries = [place.value for name in ("buffers", "images") for place in self.array(name)]
        uris = [entry.get("uri") for entry in entries if isinstance(entry, dict)]
        return [unquote(uri) for uri in uris if isinstance(uri, str) and not is_address(uri)]

    def array(self, name: str) -> list[Place]:
        """Return the elements of one of the file's arrays; none if it has no such array."""
        place = self.json.root.get(name)
        if place is None or not isinstance(place.value, list):
            return []
        return self.json.elements(place.start)

    def append(self, name: str, value: str) -> int:
        """Add a value in JSON to an array of the file that is not empty; return its index."""
        self._added[name].append(value)
        return len(self.json.value[name]) + len(self._added[name]) - 1

    def name(self, at: int) -> str:
        """Return the name of a material, "" if it has none."""
        name = self.materials[at].get("name")
        return name if isinstance(name, str) else ""

    def texture_of(self, at: int) -> Any:
        """Return what a material says of its texture of roughness, None if it has none."""
        return self.materials[at].get(PBR, {}).get(TEXTURE)

    @cached_property
    def _factor_spans(self) -> dict[int, tuple[int, int]]:
        """Where factors stand, by the places of materials, if names alone tell that."""
        owners = [
            at
            for at, material in enumerate(self.materials)
            if isinstance(material, dict)
            and isinstance(pbr := material.get(PBR), dict)
            and FACTOR in pbr
        ]
        if not owners:
            return {}
        spans = self.json.numbers_named(FACTOR, self.json.root["materials"])
        # As many as there are factors: then none of them is anything else.
        same = spans is not None and len(spans) == len(owners)
        return dict(zip(owners, spans, strict=True)) if spans and same else {}

    def set_factor(self, at: int, text: str) -> None:
        """Set the roughness factor of a material to a number in JSON."""
        if at in self._factor_spans:
            self.json.replace(*self._factor_spans[at], text)
            return
        start = self._places[at].start
        if PBR in self.materials[at]:
            self.json.set_members(self.json.members(start)[PBR].start, {FACTOR: text})
        else:
            self.json.set_members(start, {PBR: f'{{"{FACTOR}": {text}}}'})

    def set_texture(self, at: int, index: int) -> None:
        """Let a material's texture of roughness be another one."""
        pbr = self.json.members(self._places[at].start)[PBR]
        texture = self.json.members(pbr.start)[TEXTURE]
        self.json.set_members(texture.start, {"index": str(index)})

    @cached_property
    def _places(self) -> list[Place]:
        return self.array("materials")

    def encoded(self) -> bytes:
        """Return the file with all changes, every other chunk of a GLB as it is."""
        if self._appended:
            length = self._binary_size + len(self._appended)
            self.json.set_members(self.array("buffers")[0].start, {"byteLength": str(length)})
        for name, values in self._added.items():
            self.json.append(self.json.root[name].start, values)
        text = self.json.changed().encode()
        if text == self._text:
            return self._data
        if not is_glb(self._data):
            return text
        chunks: list[tuple[bytes, bytes | memoryview]]
        chunks = [(_JSON, text + b" " * _padding(len(text))), *self._chunks]
        if self._appended:
            end = bytes(_padding(len(self._appended)))
            binary = self._chunks[0][1].tobytes().ljust(self._binary_size, b"\0")
            chunks[1] = _BINARY, b"".join([binary, self._appended, end])
        return _glb(chunks)

    @cached_property
    def everything(self) -> list[tuple[str, Any]]:
        """All members of all objects in the file."""
        return walk(self.json.value)


def walk(value: Any) -> list[tuple[str, Any]]:
    """Return all members of all objects within a value, however deeply."""
    members: list[tuple[str, Any]] = []
    waiting = [value]
    while waiting:
        value = waiting.pop()
        if isinstance(value, dict):
            members += value.items()
            waiting += value.values()
        elif isinstance(value, list):
            waiting += value
    return members


def _padding(size: int) -> int:
    """Return how many bytes are left to the next multiple of four, where parts of a GLB start."""
    return -size % _ALIGNMENT


def _pieces(data: bytes) -> tuple[bytes, list[tuple[bytes, memoryview]]]:
    """Return the JSON of a GLB, and the types and contents of the chunks behind it."""
    if len(data) < _HEADER.size:
        raise MdfconvError(f"is a GLB of {len(data)} bytes, less than its header")
    _, version, length = _HEADER.unpack_from(data)
    if version != _VERSION:
        raise MdfconvError(f"is a GLB of version {version}, not {_VERSION}")
    if length != len(data):
        raise MdfconvError(f"is a GLB of {length} bytes by its header, but has {len(data)}")
    chunks: list[tuple[bytes, memoryview]] = []
    position, view = _HEADER.size, memoryview(data)
    while position < len(data):
        start = position + _CHUNK_HEAD.size
        if start > len(data):
            raise MdfconvError(f"is a GLB that ends within the head of chunk {len(chunks)}")
        size, kind = _CHUNK_HEAD.unpack_from(data, position)
        position = start + size
        if position > len(data):
            raise MdfconvError(
                f"is a GLB whose chunk {len(chunks)} of {size} bytes is larger than what is left "
                f"of the file, {len(data) - start}"
            )
        chunks.append((kind, view[start:position]))
    if not chunks or chunks[0][0] != _JSON:
        raise MdfconvError("is a GLB whose first chunk is no JSON")
    text = bytes(chunks[0][1])
    # It is filled up by blanks, in some files by zeros.
    filled = 1 - _ALIGNMENT
    return text[:filled] + text[filled:].rstrip(b" \0"), chunks[1:]


def _glb(chunks: Sequence[tuple[bytes, bytes | memoryview]]) -> bytes:
    """Return a GLB of the types and contents of its chunks."""
    total = _HEADER.size + sum(_CHUNK_HEAD.size + len(content) for _, content in chunks)
    if total > _LARGEST:
        raise MdfconvError("would no longer fit into a GLB, which ends at 4 GiB")
    parts: list[bytes | memoryview] = [_HEADER.pack(_MAGIC, _VERSION, total)]
    for kind, content in chunks:
        parts += [_CHUNK_HEAD.pack(len(content), kind), content]
    return b"".join(parts)
