"""The roughness textures of a glTF file: the green channels of what its materials name."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Collection, Mapping
from contextlib import suppress
from typing import Any

from mdfconv.distributions.endpoint import Endpoint
from mdfconv.errors import MdfconvError
from mdfconv.fitting.metrics import Metric
from mdfconv.scene.gltf.document import FACTOR, GltfDocument, walk
from mdfconv.scene.gltf.images import GltfImages, GltfTextures, index_of
from mdfconv.scene.gltf.json_edit import JsonText
from mdfconv.scene.stored import ProblemKind
from mdfconv.scene.texture.convert import convert_texture_bytes
from mdfconv.scene.texture.rule import TextureRule, ValueConverter

_CHANNEL = "g"
_OCCLUSION = "occlusionTexture"


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
        self._images = GltfImages(document, folders, target.label.replace(":", "-"))
        # By the places of materials what a careful user must know of those that were converted,
        # and why the others are left.
        self.notes: dict[int, tuple[str, ...]] = {}
        self.problems: dict[int, tuple[str, ProblemKind]] = {}
        versions = self._versions(factors)
        contents = {version: self._content(*version, versions[version]) for version in versions}
        converted = {version: content for version, content in contents.items() if content}
        used = self._used_elsewhere()
        counts = Counter(image for image, _ in converted)
        for (image, factor), content in converted.items():
            if image in used or counts[image] > 1:
                self._add(image, content, versions[image, factor])
            else:
                self._images.replace(image, content)
        self.files, self.inputs = self._images.files, self._images.inputs

    def _versions(self, factors: Mapping[int, float]) -> dict[tuple[int, float], dict[int, int]]:
        """Return the images that are to be converted, with their factors.

        Each has the places of the materials that show it, and the textures that they name.
        """
        versions: defaultdict[tuple[int, float], dict[int, int]] = defaultdict(dict)
        for at, factor in factors.items():
            try:
                name = _index(self._document.texture_of(at))
                texture = index_of(name, self._textures, "texture")
                image = self._image(texture)
            except MdfconvError as error:
                self.problems[at] = str(error), ProblemKind.OTHER
            else:
                versions[image, factor][at] = texture
        return versions

    def _image(self, at: int) -> int:
        """Return which image a texture shows."""
        texture = self._textures[at].value
        if any(name == "source" for name, _ in walk(texture.get("extensions"))):
            raise MdfconvError(
                f"textures[{at}] has an image in an extension, which is not converted"
            )
        return index_of(texture.get("source"), self._images.images, "image")

    def _content(self, image: int, factor: float, materials: Collection[int]) -> bytes:
        """Return the converted content of an image, empty if it cannot be converted."""
        rule = TextureRule(*self._pair, metric=str(self._metric), factor=factor)
        try:
            if not ValueConverter(rule).takes_ends():
                raise MdfconvError(f"{FACTOR} {factor:g} with its texture is mostly out of range")
            former = self._images.read(image)
            content, report = convert_texture_bytes(*former, rule, _CHANNEL, lossy=self._lossy)
        except MdfconvError as error:
            kind = ProblemKind.LOSSY if error.argument == "lossy" else ProblemKind.OTHER
            problem = f"images[{image}]: {error}", kind
            self.problems |= dict.fromkeys(materials, problem)
            return b""
        notes = f"with the texture of images[{image}]", *report.notes()
        self.notes |= dict.fromkeys(materials, notes)
        return content

    def _add(self, former: int, content: bytes, textures: Mapping[int, int]) -> None:
        """Add an image, and textures of it for the materials that show it, by their places."""
        image = self._images.add(former, content)
        added: dict[int, int] = {}
        for texture in sorted(set(textures.values())):
            copy = JsonText(self._document.json.text_of(self._textures[texture]))
            copy.set_members(0, {"source": str(image)})
            added[texture] = self._document.append("textures", copy.changed())
        for at, texture in textures.items():
            self._document.set_texture(at, added[texture])

    def _used_elsewhere(self) -> set[int]:
        """Return the images that are used for more than the roughness of converted materials."""
        # An extension of the whole file may use them in a way of its own.
        extensions = walk(self._document.json.value.get("extensions"))
        if any("texture" in key.lower() or "image" in key.lower() for key, _ in extensions):
            return set(range(len(self._images.images)))
        # The occlusion has another channel of the same image.
        objects = (each for each in self._document.materials if isinstance(each, dict))
        free = {id(each.get(_OCCLUSION)) for each in objects}
        free |= {id(self._document.texture_of(at)) for at in self.notes}
        images = set()
        everything = self._document.everything
        for texture in [value for key, value in everything if key.lower().endswith("texture")]:
            if isinstance(texture, dict) and id(texture) not in free:
                # What names nothing uses nothing.
                with suppress(MdfconvError):
                    at = index_of(_index(texture), self._textures, "texture")
                    source = self._textures[at].value.get("source")
                    images.add(index_of(source, self._images.images, "image"))
        return images


def _index(texture: Any) -> Any:
    """Return which texture an object of a material names."""
    return texture.get("index") if isinstance(texture, dict) else None
