"""The roughness textures of a glTF file: the green channels of what its materials name."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from mdfconv.distributions.endpoint import Endpoint
from mdfconv.distributions.evaluation import Array
from mdfconv.distributions.parameter import Encoding
from mdfconv.errors import MdfconvError
from mdfconv.fitting.metrics import Metric
from mdfconv.scene.gltf.container import Container
from mdfconv.scene.gltf.document import FACTOR, GltfDocument, material_problem, walk
from mdfconv.scene.gltf.images import GltfImages, GltfTextures, index_of, is_count
from mdfconv.scene.gltf.json_edit import JsonText, Place
from mdfconv.scene.stored import MaterialProblem, ProblemKind
from mdfconv.scene.texture.convert import converted_and_report
from mdfconv.scene.texture.rule import TextureRule

_CHANNEL = "g"
_OCCLUSION = "occlusionTexture"
_MIDDLE, _TEXELS = 0.5, 257


@dataclass
class TextureChanges:
    """What became of the textures of materials.

    Parameters
    ----------
    notes, problems : dict
        By the places of materials: what a careful user must know of those that were converted,
        and why the others are left as they are.
    files : dict
        New files.
    inputs : tuple of Path
        The files that were read.
    appended : bytes
        What is added to the binary chunk.
    """

    notes: dict[int, tuple[str, ...]] = field(default_factory=dict)
    problems: dict[int, MaterialProblem] = field(default_factory=dict)
    files: dict[Path, bytes] = field(default_factory=dict)
    inputs: tuple[Path, ...] = ()
    appended: bytes = b""


def convert_textures(
    document: GltfDocument,
    container: Container,
    wanted: Mapping[int, float],
    ends: tuple[Endpoint, Endpoint],
    metric: Metric,
    folders: GltfTextures,
) -> TextureChanges:
    """Convert the roughness textures of materials, each with the factor before it.

    A texel t becomes the conversion of factor · t. An image that nothing else needs is replaced;
    where it has another use, or is used with other factors, an image and a texture are added.

    Parameters
    ----------
    document : GltfDocument
        The JSON, which is changed, but for the factors.
    container : Container
        The file.
    wanted : mapping of int to float
        The factors of the materials, by their places: above 0, at most 1.
    ends : tuple of two Endpoint
        What effective roughness is, and what it becomes.
    metric : Metric
        What the fit keeps.
    folders : GltfTextures
        Where files are.
    """
    changes = TextureChanges()
    textures = document.array("textures")
    images = GltfImages(document, container, folders, ends[1].label.replace(":", "-"))
    versions: dict[tuple[int, float], list[int]] = defaultdict(list)
    named: dict[int, int] = {}
    for at, factor in wanted.items():
        try:
            named[at] = index_of(_index(document.texture_of(at)), textures, "texture")
            versions[_image(textures, named[at], images), factor].append(at)
        except MdfconvError as error:
            changes.problems[at] = material_problem(at, str(error))
    contents: dict[tuple[int, float], bytes] = {}
    notes: dict[tuple[int, float], list[str]] = {}
    for (image, factor), materials in versions.items():
        try:
            rule = _rule(factor, ends, metric)
            content, suffix = images.read(image)
            contents[image, factor], report = converted_and_report(
                content, suffix, rule, _CHANNEL, lossy=folders.lossy
            )
            notes[image, factor] = report.notes()
        except MdfconvError as error:
            kind = ProblemKind.LOSSY if error.argument == "lossy" else ProblemKind.OTHER
            text = f"images[{image}]: {error}"
            changes.problems |= {at: material_problem(at, text, kind) for at in materials}
    _write(document, textures, images, versions, contents, named, changes)
    for version, texts in notes.items():
        for at in changes.notes.keys() & versions[version]:
            changes.notes[at] += tuple(texts)
    changes.files, changes.inputs, changes.appended = images.files, images.inputs, images.appended
    return changes


def _index(texture: Any) -> Any:
    """Return which texture an object of a material names."""
    return texture.get("index") if isinstance(texture, dict) else None


def _image(textures: list[Place], at: int, images: GltfImages) -> int:
    """Return which image a texture shows."""
    texture = textures[at].value
    others = [name for name, value in walk(texture.get("extensions")) if name == "source"]
    if others:
        raise MdfconvError(f"textures[{at}] has an image in an extension, which is not converted")
    return index_of(texture.get("source"), images.images, "image")


def _rule(factor: float, ends: tuple[Endpoint, Endpoint], metric: Metric) -> TextureRule:
    """Return how texels with a factor before them are converted."""
    source = ends[0] if factor == 1 else scaled(ends[0], factor)
    _check_ends(source, factor)
    return TextureRule(source, ends[1], metric=str(metric))


def _check_ends(source: Endpoint, factor: float) -> None:
    """Refuse a source of which texels are illegal that are not at the end they are taken for.

    An illegal texel below one half is taken for 0, another for 1.
    """
    texels = np.linspace(0, 1, _TEXELS)
    with np.errstate(all="ignore"):
        legal = texels[~np.isnan(source.decode_legal(texels))]
    if not legal.size or legal[0] > _MIDDLE or legal[-1] < _MIDDLE:
        raise MdfconvError(f"{FACTOR} {factor:g} with its texture is mostly out of range")


def scaled(end: Endpoint, factor: float) -> Endpoint:
    """Return an endpoint whose stored numbers, times a factor, are those of another one."""
    own = end.encoding
    stored = replace(
        end.stored,
        lower=end.stored.lower / factor,
        upper=end.stored.upper / factor,
        typical=(end.stored.typical[0] / factor, end.stored.typical[1] / factor),
    )

    def decode(value: Array) -> Array:
        return own.decode(value * factor) if own else value * factor

    def encode(parameter: Array) -> Array:
        return (own.encode(parameter) if own else parameter) / factor

    clamps = tuple(
        replace(clamp, stored=clamp.stored / factor, edge=clamp.edge / factor)
        for clamp in (own.clamps if own else ())
    )
    name = f"{own.name} of {factor:g} v" if own else f"{factor:g} v"
    return Endpoint(
        end.distribution, Encoding(name, stored, decode, encode, f"{factor:g} v", clamps)
    )


def _write(
    document: GltfDocument,
    textures: list[Place],
    images: GltfImages,
    versions: Mapping[tuple[int, float], list[int]],
    contents: Mapping[tuple[int, float], bytes],
    named: Mapping[int, int],
    changes: TextureChanges,
) -> None:
    """Put converted images where their materials find them."""
    done = {at for version in contents for at in versions[version]}
    taken = _other_uses(document, textures, done)
    counts = Counter(image for image, _ in contents)
    new_textures: list[str] = []
    for (image, factor), content in contents.items():
        materials = versions[image, factor]
        try:
            if image in taken or counts[image] > 1:
                added = images.add(image, content)
                for texture in sorted({named[at] for at in materials}):
                    copy = JsonText(document.json.text_of(textures[texture]))
                    copy.set_members(0, {"source": str(added)})
                    new_textures.append(copy.changed())
                    for at in materials:
                        if named[at] == texture:
                            document.set_texture(at, len(textures) + len(new_textures) - 1)
            else:
                images.replace(image, content)
        except MdfconvError as error:
            changes.problems |= {at: material_problem(at, str(error)) for at in materials}
            continue
        changes.notes |= dict.fromkeys(materials, (f"with the texture of images[{image}]",))
    document.append("textures", new_textures)
    images.finish()


def _other_uses(document: GltfDocument, textures: list[Place], done: set[int]) -> set[int]:
    """Return the images that are used for more than the roughness of converted materials."""
    if document.other_texture_users:
        return set(range(len(document.array("images"))))
    # The occlusion has another channel of the same image.
    free = {
        id(material.get(_OCCLUSION))
        for material in document.materials
        if isinstance(material, dict)
    }
    free |= {id(document.texture_of(at)) for at in done}
    used = [
        _index(value)
        for key, value in document.everything
        if key.lower().endswith("texture") and isinstance(value, dict) and id(value) not in free
    ]
    sources = [textures[int(at)].value for at in used if is_count(at) and 0 <= at < len(textures)]
    images: list[Any] = [entry.get("source") for entry in sources if isinstance(entry, dict)]
    return {int(image) for image in images if is_count(image)}
