"""The other roughnesses of a glTF file, those in its extensions: found, so that none is missed."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any, NamedTuple

from mdfconv.scene.gltf.buffers import is_count
from mdfconv.scene.gltf.document import (
    EXTENSIONS,
    METALLIC_ROUGHNESS,
    SPECULAR_GLOSSINESS,
    RoughnessField,
)

_POINTER = "KHR_animation_pointer"
_OF_ROUGHNESS = re.compile("roughness|gloss|smoothness|shininess", re.IGNORECASE)
_MATERIAL = re.compile(r"/materials/(0|[1-9][0-9]{0,8})/(.+)", re.DOTALL)


class StrayRoughness(NamedTuple):
    """A number or a texture of roughness that is not where a conversion reads."""

    # The object of the material that has it.
    path: str
    name: str
    value: Any

    @property
    def is_glossiness(self) -> bool:
        """Whether it is of the extension for glossiness."""
        return self.path == ".".join(SPECULAR_GLOSSINESS.path)

    @property
    def is_number(self) -> bool:
        """Whether it is a number that a roughness can be."""
        number = isinstance(self.value, int | float) and not isinstance(self.value, bool)
        return number and 0 <= self.value <= 1 and not self.is_glossiness

    @property
    def text(self) -> str:
        """What it is, in words."""
        number = isinstance(self.value, int | float)
        return f"{self.name} {self.value}"[:_LONGEST] if number else self.name


# Of a text that has a number.
_LONGEST = 60


def stray_roughnesses(material: Any, read: RoughnessField) -> Iterator[StrayRoughness]:
    """Yield what a material has that by its name is a roughness, but where a conversion reads.

    The default of a glossiness is one, too: who knows its extension shows nothing else.
    """
    if not isinstance(material, dict):
        return
    extensions = material.get(EXTENSIONS)
    objects: dict[tuple[str, ...], Any] = {
        (name,): material.get(name) for name in METALLIC_ROUGHNESS.path
    }
    if isinstance(extensions, dict):
        objects |= {(EXTENSIONS, name): members for name, members in extensions.items()}
    objects.pop(read.path, None)
    for path, members in objects.items():
        if not isinstance(members, dict):
            continue
        if path == SPECULAR_GLOSSINESS.path:
            members = {SPECULAR_GLOSSINESS.factor: 1} | members
        for name, value in members.items():
            if _OF_ROUGHNESS.search(name):
                yield StrayRoughness(".".join(path), name, value)


class RoughnessTrack(NamedTuple):
    """A channel of an animation that overwrites a roughness at play."""

    animation: int
    channel: int
    # Its number; −1 if the file has none.
    sampler: int
    # Which material it names, and which of its members by a path with slashes.
    material: int
    member: str

    @property
    def place(self) -> str:
        """Where it stands."""
        return f"animations[{self.animation}].channels[{self.channel}]"

    @property
    def text(self) -> str:
        """What it does, in words."""
        return f"animates {self.member.rpartition('/')[2]} of materials[{self.material}]"


def roughness_tracks(animations: list[Any]) -> list[RoughnessTrack]:
    """Return the channels that overwrite a roughness of a material."""
    tracks = []
    for animation, channel, entry in all_channels(animations):
        match = _MATERIAL.fullmatch(_pointer(entry))
        if match and _OF_ROUGHNESS.search(match[2].rpartition("/")[2]):
            sampler: Any = entry.get("sampler")
            number = int(sampler) if is_count(sampler) else -1
            tracks.append(RoughnessTrack(animation, channel, number, int(match[1]), match[2]))
    return tracks


def all_channels(animations: list[Any]) -> Iterator[tuple[int, int, dict[str, Any]]]:
    """Yield all channels with the places of their animations and their own."""
    for animation, entry in enumerate(animations):
        channels = entry.get("channels") if isinstance(entry, dict) else None
        for channel, value in enumerate(channels if isinstance(channels, list) else ()):
            if isinstance(value, dict):
                yield animation, channel, value


def _pointer(channel: dict[str, Any]) -> str:
    """Return which value of the file a channel overwrites, "" if that is none by a pointer."""
    value: Any = channel
    for name in ("target", EXTENSIONS, _POINTER, "pointer"):
        value = value.get(name) if isinstance(value, dict) else None
    return value if isinstance(value, str) else ""
