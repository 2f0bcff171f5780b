"""A glTF file: JSON alone or in a GLB; its materials found, and changed in place."""

from __future__ import annotations

import re
import struct
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any
from urllib.parse import unquote

from mdfconv.errors import MdfconvError
from mdfconv.scene.gltf.json_edit import Place, object_text, read_json

_SCHEME = re.compile(r"[A-Za-z][A-Za-z0-9+.-]*:")
EXTENSIONS = "extensions"
# The member of asset.extras that marks a converted file.
MARK = "mdfconv"
# A GLB has a header, and chunks: their size and type, and content.
_MAGIC, _VERSION = b"glTF", 2
_HEADER, _CHUNK_HEAD = struct.Struct("<4sII"), struct.Struct("<I4s")
_JSON, _BINARY = b"JSON", b"BIN\0"
_ALIGNMENT = 4
_LARGEST = 2**32 - 1


@dataclass(frozen=True)
class RoughnessField:
    """Where a material stores a roughness: a factor, 1 if absent, and a texture that it multiplies.

    Parameters
    ----------
    path : tuple of str
        The object of the material that has both.
    factor, texture : str
        Their names.
    channel : str
        The channel of the texture.
    """

    path: tuple[str, ...]
    factor: str
    texture: str
    channel: str

    @property
    def name(self) -> str:
        """The name of the object."""
        return self.path[-1]

    @property
    def pointer(self) -> str:
        """The factor by a path with slashes, as animations name it."""
        return "/".join((*self.path, self.factor))

    def values(self, material: Any) -> dict[str, Any] | None:
        """Return the object of a material, None if it has none; refuse what is no object."""
        if not isinstance(material, dict):
            raise MdfconvError("is no object")
        for name in self.path:
            if name not in material:
                return None
            material = material[name]
            if not isinstance(material, dict):
                raise MdfconvError(f"its {name} is no object")
        return material

    def factor_of(self, material: Any) -> float | None:
        """Return the factor of a material, None if it has no such object; refuse what is none."""
        values = self.values(material)
        if values is None:
            return None
        factor = values.get(self.factor, 1)
        if not isinstance(factor, int | float) or isinstance(factor, bool) or factor != factor:
            raise MdfconvError(f"{self.factor} is not a number")
        if not 0 <= factor <= 1:
            raise MdfconvError(f"{self.factor} {factor!s:.20} is outside 0 ≤ {self.symbol} ≤ 1")
        return float(factor)

    @property
    def symbol(self) -> str:
        """The symbol of the factor: r of a roughness, g of a glossiness."""
        return self.factor[0]


METALLIC_ROUGHNESS = RoughnessField(
    ("pbrMetallicRoughness",), "roughnessFactor", "metallicRoughnessTexture", "g"
)
SPECULAR_GLOSSINESS = RoughnessField(
    (EXTENSIONS, "KHR_materials_pbrSpecularGlossiness"),
    "glossinessFactor",
    "specularGlossinessTexture",
    "a",
)


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
        self._patches: list[tuple[int, bytes]] = []
        self._spans: dict[RoughnessField, dict[int, tuple[int, int]]] = {}
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
        animations = self.json.value.get("animations")
        self.animations: list[Any] = animations if isinstance(animations, list) else []

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

    def patch_binary(self, start: int, content: bytes) -> None:
        """Replace bytes within the binary chunk."""
        self._patches.append((start, content))

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
    def mark(self) -> Any:
        """What marks a converted file; None if nothing does."""
        extras = self._asset.get("extras")
        return extras.get(MARK) if isinstance(extras, dict) else None

    def set_mark(self, members: Mapping[str, str]) -> None:
        """Mark the file with members in JSON; refuse an asset that cannot have them."""
        if not (self._asset and isinstance(self._asset.get("extras", {}), dict)):
            raise MdfconvError("has no asset with extras that take a mark")
        self.set_in(self.json.root["asset"].start, ("extras",), {MARK: object_text(members)})

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

    def texture_of(self, at: int, field: RoughnessField) -> Any:
        """Return what a material says of its texture of roughness, None if it has none."""
        return (field.values(self.materials[at]) or {}).get(field.texture)

    def texture_place(self, at: int, field: RoughnessField) -> Place:
        """Return where a material names its texture of roughness."""
        start = self._places[at].start
        for name in field.path:
            start = self.json.members(start)[name].start
        return self.json.members(start)[field.texture]

    def _factor_spans(self, field: RoughnessField) -> dict[int, tuple[int, int]]:
        """Return where factors stand, by the places of materials, if names alone tell that."""
        if field not in self._spans:
            owners = [
                at
                for at, material in enumerate(self.materials)
                if field.factor in _object_at(material, field.path)
            ]
            spans = None
            if owners:
                spans = self.json.numbers_named(field.factor, self.json.root["materials"])
            # As many as there are factors: then none of them is anything else.
            same = spans is not None and len(spans) == len(owners)
            self._spans[field] = dict(zip(owners, spans, strict=True)) if spans and same else {}
        return self._spans[field]

    def set_factor(self, at: int, field: RoughnessField, text: str) -> None:
        """Set the roughness factor of a material to a number in JSON."""
        if at in (spans := self._factor_spans(field)):
            self.json.replace(*spans[at], text)
        else:
            self.set_field(at, field, {field.factor: text})

    def set_field(self, at: int, field: RoughnessField, members: Mapping[str, str]) -> None:
        """Set members, in JSON, of the object in which a material has its roughness."""
        self.set_in(self._places[at].start, field.path, members)

    def set_in(self, start: int, path: Sequence[str], members: Mapping[str, str]) -> None:
        """Set members of the object at a path from the one at a character; add what is missing."""
        for depth, name in enumerate(path):
            place = self.json.members(start).get(name)
            if place is None:
                text = object_text(members)
                for outer in reversed(path[depth + 1 :]):
                    text = object_text({outer: text})
                self.json.set_members(start, {name: text})
                return
            start = place.start
        self.json.set_members(start, members)

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
        if text == self._text and not self._patches:
            return self._data
        if not is_glb(self._data):
            return text
        chunks: list[tuple[bytes, bytes | memoryview]]
        chunks = [(_JSON, text + b" " * _padding(len(text))), *self._chunks]
        if self._appended or self._patches:
            chunks[1] = _BINARY, self._changed_binary()
        return _glb(chunks)

    def _changed_binary(self) -> bytes:
        binary = bytearray(self.binary or b"")
        for start, content in self._patches:
            binary[start : start + len(content)] = content
        end = bytes(_padding(len(self._appended)))
        return bytes(binary).ljust(self._binary_size, b"\0") + self._appended + end

    @cached_property
    def everything(self) -> list[tuple[str, Any]]:
        """All members of all objects in the file."""
        return walk(self.json.value)


def _object_at(value: Any, path: Sequence[str]) -> dict[str, Any]:
    """Return the object at a path, an empty one if there is none."""
    for name in path:
        value = value.get(name) if isinstance(value, dict) else None
    return value if isinstance(value, dict) else {}


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
