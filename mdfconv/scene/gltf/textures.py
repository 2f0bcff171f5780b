"""The roughness textures of a glTF file: the green channels of what its materials name."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Collection, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from mdfconv.errors import MdfconvError
from mdfconv.scene.gltf.buffers import GltfBuffers, index_of
from mdfconv.scene.gltf.document import METALLIC_ROUGHNESS, GltfDocument, RoughnessField, walk
from mdfconv.scene.gltf.images import GltfImages, GltfTextures, green_of_alpha
from mdfconv.scene.gltf.json_edit import JsonText, Place
from mdfconv.scene.stored import ProblemKind
from mdfconv.scene.texture.convert import convert_texture_bytes
from mdfconv.scene.texture.rule import TextureRule, ValueConverter

_OCCLUSION = "occlusionTexture"


class TextureConversion:
    """The conversion of the roughness textures of materials, each with the factor before it.

    A texel t becomes the conversion of factor · t. An image that nothing else needs is replaced;
    where it has another use, or is used by other rules, an image and a texture are added, as they
    are for a roughness that moves from one object of the material to another. The document is
    changed, but for the factors of textures that stay; the rules, by the places of materials,
    have the factors.
    """

    def __init__(
        self,
        document: GltfDocument,
        buffers: GltfBuffers,
        folders: GltfTextures,
        fields: tuple[RoughnessField, RoughnessField],
        rules: Mapping[int, TextureRule],
    ) -> None:
        self._document, self._lossy = document, folders.lossy
        self._read, self._written = fields
        self._textures = document.array("textures")
        # By the places of materials what a careful user must know of those that were converted,
        # and why the others are left.
        self.notes: dict[int, tuple[str, ...]] = {}
        self.problems: dict[int, tuple[str, ProblemKind]] = {}
        self.files: Mapping[Path, bytes] = {}
        if not rules:
            return
        label = next(iter(rules.values())).endpoints()[1].label
        self._images = GltfImages(document, buffers, folders, label.replace(":", "-"))
        versions = self._versions(rules)
        contents = {version: self._content(*version, versions[version]) for version in versions}
        converted = {version: content for version, content in contents.items() if content}
        used = self._used_elsewhere()
        counts = Counter(image for image, _ in converted)
        for (image, rule), content in converted.items():
            if self._moves:
                self._move(image, green_of_alpha(content), versions[image, rule])
            elif image in used or counts[image] > 1:
                self._add(image, content, versions[image, rule])
            else:
                self._images.replace(image, content)
        self.files = self._images.files

    @property
    def _moves(self) -> bool:
        return self._read is not self._written

    def _versions(
        self, rules: Mapping[int, TextureRule]
    ) -> dict[tuple[int, TextureRule], dict[int, int]]:
        """Return the images that are to be converted, with their rules.

        Each has the places of the materials that show it, and the textures that they name.
        """
        versions: defaultdict[tuple[int, TextureRule], dict[int, int]] = defaultdict(dict)
        for at, rule in rules.items():
            try:
                texture = texture_named(self._document.texture_of(at, self._read), self._textures)
                image = image_shown(texture, self._textures, self._images.images)
            except MdfconvError as error:
                self.problems[at] = str(error), ProblemKind.OTHER
            else:
                versions[image, rule][at] = texture
        return versions

    def _content(self, image: int, rule: TextureRule, materials: Collection[int]) -> bytes:
        """Return the converted content of an image, empty if it cannot be converted."""
        channel = self._read.channel
        try:
            if not ValueConverter(rule).takes_ends():
                raise MdfconvError(
                    f"{self._read.factor} {rule.factor:g} with its texture is mostly out of range"
                )
            former = self._images.read(image)
            content, report = convert_texture_bytes(*former, rule, channel, lossy=self._lossy)
        except MdfconvError as error:
            kind = ProblemKind.LOSSY if error.argument == "lossy" else ProblemKind.OTHER
            problem = f"images[{image}]: {error}", kind
            self.problems |= dict.fromkeys(materials, problem)
            return b""
        texels = f"its texels taken for {rule.endpoints()[0].label}"
        notes = f"with the texture of images[{image}]", texels, *report.notes()
        self.notes |= dict.fromkeys(materials, notes)
        return content

    def _add(self, former: int, content: bytes, textures: Mapping[int, int]) -> None:
        """Add an image, and textures of it for the materials that show it, by their places."""
        for at, texture in self._added(former, content, textures).items():
            place = self._document.texture_place(at, self._read)
            self._document.json.set_members(place.start, {"index": str(texture)})

    def _move(self, former: int, content: bytes, textures: Mapping[int, int]) -> None:
        """Add an image, as the texture of roughness that materials get, with a factor of 1."""
        for at, texture in self._added(former, content, textures).items():
            place = self._document.texture_place(at, self._read)
            # With its coordinates.
            copy = JsonText(self._document.json.text_of(place))
            copy.set_members(0, {"index": str(texture)})
            members = {self._written.factor: "1", self._written.texture: copy.changed()}
            self._document.set_field(at, self._written, members)

    def _added(self, former: int, content: bytes, textures: Mapping[int, int]) -> dict[int, int]:
        """Add an image and textures of it; return the new one of each material."""
        image = self._images.add(former, content)
        added: dict[int, int] = {}
        for texture in sorted(set(textures.values())):
            copy = JsonText(self._document.json.text_of(self._textures[texture]))
            copy.set_members(0, {"source": str(image)})
            added[texture] = self._document.append("textures", copy.changed())
        return {at: added[texture] for at, texture in textures.items()}

    def _used_elsewhere(self) -> set[int]:
        """Return the images that are used for more than the roughness of converted materials."""
        # An extension of the whole file may use them in a way of its own.
        extensions = walk(self._document.json.value.get("extensions"))
        if any("texture" in key.lower() or "image" in key.lower() for key, _ in extensions):
            return set(range(len(self._images.images)))
        # The occlusion has another channel of the same image.
        objects = (each for each in self._document.materials if isinstance(each, dict))
        free = {id(self._document.texture_of(at, self._read)) for at in self.notes}
        if self._read is METALLIC_ROUGHNESS:
            free |= {id(each.get(_OCCLUSION)) for each in objects}
        images = set()
        everything = self._document.everything
        for texture in [value for key, value in everything if key.lower().endswith("texture")]:
            if isinstance(texture, dict) and id(texture) not in free:
                # What names nothing uses nothing.
                with suppress(MdfconvError):
                    at = texture_named(texture, self._textures)
                    source = self._textures[at].value.get("source")
                    images.add(index_of(source, self._images.images, "image"))
        return images


def texture_named(named: Any, textures: list[Place]) -> int:
    """Return which texture an object of a material names."""
    return index_of(named.get("index") if isinstance(named, dict) else None, textures, "texture")


def image_shown(texture: int, textures: list[Place], images: list[Place]) -> int:
    """Return which image a texture shows."""
    value = textures[texture].value
    if any(name == "source" for name, _ in walk(value.get("extensions"))):
        raise MdfconvError(
            f"textures[{texture}] has an image in an extension, which is not converted"
        )
    return index_of(value.get("source"), images, "image")
