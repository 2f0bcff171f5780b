"""The roughness textures of a glTF file: the green channels of what its materials name."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import Any

from mdfconv.distributions.endpoint import Endpoint
from mdfconv.errors import MdfconvError
from mdfconv.fitting.metrics import Metric
from mdfconv.scene.gltf.document import FACTOR, GltfDocument, walk
from mdfconv.scene.gltf.images import GltfImages, GltfTextures, index_of, is_count
from mdfconv.scene.gltf.json_edit import JsonText
from mdfconv.scene.stored import ProblemKind
from mdfconv.scene.texture.convert import convert_texture_bytes
from mdfconv.scene.texture.rule import TextureRule, ValueConverter

_CHANNEL = "g"
_OCCLUSION = "occlusionTexture"


@dataclass
class _Version:
    """An image under one factor, and the materials that show it."""

    image: int
    factor: float
    # From the places of the materials to the textures that they name.
    textures: dict[int, int] = field(default_factory=dict)


class TextureConversion:
    """The conversion of the roughness textures of materials, each with the factor before it.

    A texel t becomes the conversion of factor · t. An image that nothing else needs is replaced;
    where it has another use, or is used with other factors, an image and a texture are added. The
    document is changed, but for the factors, which are those of the materials that have a texture,
    by their places: above 0, at most 1.
    """

    def __init__(
        self,
        document: GltfDocument,
        folders: GltfTextures,
        source: Endpoint,
        target: Endpoint,
        metric: Metric,
        factors: Mapping[int, float],
    ) -> None:
        self._document, self._lossy = document, folders.lossy
        self._pair, self._metric = (source, target), metric
        self._textures = document.array("textures")
        self._new_textures: list[str] = []
        self._images = GltfImages(document, folders, target.label.replace(":", "-"))
        # By the places of materials what a careful user must know of those that were converted,
        # and why the others are left.
        self.notes: dict[int, tuple[str, ...]] = {}
        self.problems: dict[int, tuple[str, ProblemKind]] = {}
        contents = [(version, self._content(version)) for version in self._versions(factors)]
        self._write([(version, content) for version, content in contents if content])
        self.files, self.inputs = self._images.files, self._images.inputs

    def _versions(self, factors: Mapping[int, float]) -> Collection[_Version]:
        """Return the images that are to be converted."""
        versions: dict[tuple[int, float], _Version] = {}
        for at, factor in factors.items():
            try:
                name = _index(self._document.texture_of(at))
                texture = index_of(name, self._textures, "texture")
                image = self._image(texture)
            except MdfconvError as error:
                self.problems[at] = str(error), ProblemKind.OTHER
            else:
                version = versions.setdefault((image, factor), _Version(image, factor))
                version.textures[at] = texture
        return versions.values()

    def _image(self, at: int) -> int:
        """Return which image a texture shows."""
        texture = self._textures[at].value
        if any(name == "source" for name, _ in walk(texture.get("extensions"))):
            raise MdfconvError(
                f"textures[{at}] has an image in an extension, which is not converted"
            )
        return index_of(texture.get("source"), self._images.images, "image")

    def _content(self, version: _Version) -> bytes:
        """Return the converted content of an image, empty if it cannot be converted."""
        source, target = self._pair
        rule = TextureRule(source, target, metric=str(self._metric), factor=version.factor)
        try:
            if not ValueConverter(rule).takes_ends():
                raise MdfconvError(
                    f"{FACTOR} {version.factor:g} with its texture is mostly out of range"
                )
            content, suffix = self._images.read(version.image)
            content, report = convert_texture_bytes(
                content, suffix, rule, _CHANNEL, lossy=self._lossy
            )
        except MdfconvError as error:
            kind = ProblemKind.LOSSY if error.argument == "lossy" else ProblemKind.OTHER
            problem = f"images[{version.image}]: {error}", kind
            self.problems |= dict.fromkeys(version.textures, problem)
            return b""
        notes = f"with the texture of images[{version.image}]", *report.notes()
        self.notes |= dict.fromkeys(version.textures, notes)
        return content

    def _write(self, contents: Collection[tuple[_Version, bytes]]) -> None:
        """Put converted images where their materials find them."""
        used = self._used_elsewhere()
        counts = Counter(version.image for version, _ in contents)
        for version, content in contents:
            if version.image in used or counts[version.image] > 1:
                self._add(version, content)
            else:
                self._images.replace(version.image, content)
        self._document.append("textures", self._new_textures)
        self._images.finish()

    def _add(self, version: _Version, content: bytes) -> None:
        """Add an image, and textures of it for the materials that show it."""
        image = self._images.add(version.image, content)
        added: dict[int, int] = {}
        for texture in sorted(set(version.textures.values())):
            copy = JsonText(self._document.json.text_of(self._textures[texture]))
            copy.set_members(0, {"source": str(image)})
            added[texture] = len(self._textures) + len(self._new_textures)
            self._new_textures.append(copy.changed())
        for at, texture in version.textures.items():
            self._document.set_texture(at, added[texture])

    def _used_elsewhere(self) -> set[int]:
        """Return the images that are used for more than the roughness of converted materials."""
        if self._document.other_texture_users:
            return set(range(len(self._images.images)))
        # The occlusion has another channel of the same image.
        free = {
            id(material.get(_OCCLUSION))
            for material in self._document.materials
            if isinstance(material, dict)
        }
        free |= {id(self._document.texture_of(at)) for at in self.notes}
        textures = [
            _index(value)
            for key, value in self._document.everything
            if key.lower().endswith("texture") and isinstance(value, dict) and id(value) not in free
        ]
        entries = [
            self._textures[int(at)].value
            for at in textures
            if is_count(at) and 0 <= at < len(self._textures)
        ]
        images: list[Any] = [entry.get("source") for entry in entries if isinstance(entry, dict)]
        return {int(image) for image in images if is_count(image)}


def _index(texture: Any) -> Any:
    """Return which texture an object of a material names."""
    return texture.get("index") if isinstance(texture, dict) else None
