"""The JSON of a glTF file: its materials found, and changed in place."""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import cached_property
from typing import Any
from urllib.parse import unquote

from mdfconv.errors import MdfconvError
from mdfconv.scene.gltf.json_edit import JsonText, Place, read_json
from mdfconv.scene.stored import MaterialProblem, ProblemKind

_SCHEME = re.compile(r"[A-Za-z][A-Za-z0-9+.-]*:")
FACTOR = "roughnessFactor"
TEXTURE = "metallicRoughnessTexture"
PBR = "pbrMetallicRoughness"


def material_problem(at: int, text: str, kind: ProblemKind = ProblemKind.OTHER) -> MaterialProblem:
    """Return what is wrong with a material, by its place among them."""
    return MaterialProblem(f"materials[{at}]", text, kind)


def is_address(uri: str) -> bool:
    """Return whether a URI names no file beside the document: it has a scheme or a host."""
    return uri.startswith("//") or bool(_SCHEME.match(uri))


class GltfDocument:
    """The JSON of a glTF file.

    Parameters
    ----------
    json : JsonText
        The text.

    Raises
    ------
    MdfconvError
        If it is no glTF 2.0.
    """

    def __init__(self, json: JsonText) -> None:
        self.json = json
        asset = json.value.get("asset")
        self._asset = asset if isinstance(asset, dict) else {}
        version = str(self._asset.get("version", "2.0"))
        if not version.startswith("2."):
            raise MdfconvError(f"is glTF of version {' '.join(version.split())}, not 2.0")
        self.materials: list[Any] = json.value.get("materials", [])
        if not isinstance(self.materials, list):
            raise MdfconvError("is no glTF 2.0: its materials are no array")

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

    def append(self, name: str, values: list[str]) -> None:
        """Add values in JSON to an array of the file that is not empty."""
        if values:
            self.json.append(self.json.root[name].start, values)

    def name(self, at: int) -> str:
        """Return the name of a material, "" if it has none."""
        name = self.materials[at].get("name")
        return name if isinstance(name, str) else ""

    def texture_of(self, at: int) -> Any:
        """Return what a material says of its texture of roughness, None if it has none."""
        return self.materials[at].get(PBR, {}).get(TEXTURE)

    def set_factors(self, factors: Mapping[int, str]) -> None:
        """Set the roughness factors of materials, by their places, to numbers in JSON."""
        known = self._factor_spans
        for at, text in factors.items():
            if at in known:
                self.json.replace(*known[at], text)
            else:
                self._set_factor(at, text)

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

    def _set_factor(self, at: int, text: str) -> None:
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
        """Return the text with all changes as bytes."""
        return self.json.changed().encode()

    @cached_property
    def everything(self) -> list[tuple[str, Any]]:
        """All members of all objects in the file."""
        return walk(self.json.value)

    @cached_property
    def other_texture_users(self) -> bool:
        """Whether an extension of the whole file may use textures in a way of its own."""
        keys = [key.lower() for key, _ in walk(self.json.value.get("extensions"))]
        return any("texture" in key or "image" in key for key in keys)


def walk(value: Any) -> list[tuple[str, Any]]:
    """Return all members of all objects within a value, however deeply."""
    found: list[tuple[str, Any]] = []
    waiting = [value]
    while waiting:
        value = waiting.pop()
        if isinstance(value, dict):
            found += value.items()
            waiting += value.values()
        elif isinstance(value, list):
            waiting += value
    return found


def read_document(data: bytes) -> GltfDocument:
    """Return the document of a glTF file's JSON.

    Raises
    ------
    MdfconvError
        If it is no JSON, or no glTF 2.0.
    """
    return GltfDocument(read_json(data))
