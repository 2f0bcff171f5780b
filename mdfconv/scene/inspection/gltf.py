"""glTF files inspected."""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import dataclass, replace
from dataclasses import field as dataclass_field
from pathlib import Path
from typing import Any

from mdfconv.distributions.endpoint import endpoint, texels_of
from mdfconv.errors import MdfconvError
from mdfconv.scene.gltf.asset import GltfConversion, convert_gltf, dialects_by_generator
from mdfconv.scene.gltf.buffers import GltfBuffers, is_data
from mdfconv.scene.gltf.document import (
    METALLIC_ROUGHNESS,
    SPECULAR_GLOSSINESS,
    GltfDocument,
    RoughnessField,
    is_glb,
)
from mdfconv.scene.gltf.elsewhere import roughness_tracks, stray_roughnesses
from mdfconv.scene.gltf.ends import GLOSSINESS
from mdfconv.scene.gltf.images import GltfImages, GltfTextures
from mdfconv.scene.gltf.textures import image_shown, texture_named
from mdfconv.scene.inspection.pictures import picture_of_bytes
from mdfconv.scene.inspection.records import (
    Arguments,
    FileInspection,
    InspectedNumber,
    InspectedTexture,
    NextStep,
    result_path,
)
from mdfconv.scene.material_files import read_file
from mdfconv.scene.shininess import ROUGHNESS
from mdfconv.scene.stored import MaterialProblem, ProblemKind


@dataclass
class _Reading:
    """A file as its converter reads it, and what is to be known of that."""

    found: GltfConversion
    # What the numbers are, without a weight that is assumed.
    source: str
    field: RoughnessField = METALLIC_ROUGHNESS
    arguments: Arguments = dataclass_field(default_factory=dict)
    notes: list[str] = dataclass_field(default_factory=list)
    # Those of another field.
    numbers: list[InspectedNumber] = dataclass_field(default_factory=list)


def inspect_gltf(path: Path) -> FileInspection:
    """Return what a glTF file is."""
    data = read_file(path)
    document = GltfDocument(data)
    reading = _read(data, document, path.parent)
    found, field, arguments = reading.found, reading.field, reading.arguments
    textures, unreadable = _textures_of(path, document, field, texels_of(endpoint(found.source)))
    kinds = {problem.kind for problem in found.problems}
    problems = [each for each in found.problems if each.kind is ProblemKind.OTHER]
    notes = reading.notes
    if ProblemKind.TEXTURE in kinds:
        problems += unreadable
        if textures:
            arguments["textures"] = True
            arguments |= {"lossy": True} if any(each.lossy for each in textures) else {}
            arguments |= {} if textures[0].taken_for else {"texels": None}
    else:
        notes += [f"{place}: {text}" for place, text, _ in unreadable]
    written = f"written by '{document.generator}': "
    remarks = [text for text, _ in found.remarks]
    rules = [text.removeprefix(written) for text in remarks if text.startswith(written)]
    marked = document.mark is not None
    notes += [text for text in remarks if not (marked or text.startswith(written))]
    changes = bool(arguments) or found.data != data
    meant = found.source if field is METALLIC_ROUGHNESS else "what each is called"
    return FileInspection(
        file=path,
        kind="GLB (glTF 2.0)" if is_glb(data) else "glTF 2.0",
        writer=document.generator,
        taken_for=rules[0] if rules else f"{meant}, as glTF defines it",
        numbers=[*reading.numbers, *_numbers_of(reading, document)],
        textures=textures,
        problems=problems,
        notes=notes,
        repaired=remarks[0] if marked else "",
        next_step=NextStep("gltf", arguments, result_path(path)) if changes else None,
    )


def _read(data: bytes, document: GltfDocument, folder: Path) -> _Reading:
    """Return a file as its generator meant it, or else as glTF defines it."""
    try:
        found = convert_gltf(data, folder=folder)
        reading = _Reading(found, found.source.removesuffix(":1"))
        if any(each.kind is ProblemKind.SPECULAR for each in found.problems):
            reading.found = convert_gltf(data, specular=1.0, folder=folder)
            reading.arguments["specular"] = None
            reading.notes.append("its rule depends on the specular weight L: numbers are for L = 1")
        return reading
    except MdfconvError as error:
        if error.argument != "source":
            raise
        unknown = error.reason
    reading = _Reading(convert_gltf(data, ROUGHNESS, folder=folder), ROUGHNESS)
    reading.notes += _as_defined(document)
    if candidates := dialects_by_generator(document.generator):
        reading.notes.append(f"it {unknown}")
        sure = [f"{each.owners[0]}:{each.name}" for each in candidates if not each.provided]
        reading.arguments |= {"source": sure[0]} if sure else {}
    elif any(map(_has_glossiness, document.materials)):
        reading.numbers = _numbers_of(reading, document)
        reading.field, reading.source = SPECULAR_GLOSSINESS, GLOSSINESS
        reading.found = convert_gltf(data, GLOSSINESS, folder=folder)
        reading.arguments["source"] = GLOSSINESS
    return reading


def _has_glossiness(material: Any) -> bool:
    """Return whether a material has the extension, for which viewers leave its roughness."""
    with suppress(MdfconvError):
        return SPECULAR_GLOSSINESS.values(material) is not None
    return False


def _as_defined(document: GltfDocument) -> list[str]:
    """Return which other roughnesses a file has, all as glTF defines them."""
    strays = [
        f"materials[{at}].{stray.path}: {stray.text}, as glTF defines it"
        for at, material in enumerate(document.materials)
        for stray in stray_roughnesses(material, METALLIC_ROUGHNESS)
        if not stray.is_glossiness
    ]
    tracks = roughness_tracks(document.animations)
    return strays + [f"{track.place} {track.text}" for track in tracks]


def _numbers_of(reading: _Reading, document: GltfDocument) -> list[InspectedNumber]:
    """Return the factors of a file."""
    field, source = reading.field, endpoint(reading.found.source)
    is_exponent = source.distribution.parameter.larger_is_smoother
    numbers = []
    for material in reading.found.materials:
        # Before a texture it is only a factor.
        textured = document.texture_of(material.index, field)
        result = math.nan if textured else material.result
        numbers.append(
            InspectedNumber(
                material.name,
                f"materials[{material.index}]",
                field.factor,
                material.value,
                reading.source,
                material.parameter if is_exponent else math.nan,
                result**2,
                result,
                material.notes,
            )
        )
    return numbers


def _textures_of(
    path: Path, document: GltfDocument, field: RoughnessField, texels: str
) -> tuple[list[InspectedTexture], list[MaterialProblem]]:
    """Return the textures of roughness that the materials of a glTF file name, each once."""
    buffers = GltfBuffers(document, path.parent)
    pictures = GltfImages(document, buffers, GltfTextures(path.parent, path.parent), "")
    entries = document.array("textures")
    textures: dict[int, InspectedTexture] = {}
    problems: list[MaterialProblem] = []
    for at in range(len(document.materials)):
        place = f"materials[{at}]"
        try:
            named = document.texture_of(at, field)
            if not named:
                continue
            image = image_shown(texture_named(named, entries), entries, pictures.images)
            if image in textures:
                continue
            picture = picture_of_bytes(*pictures.read(image), field.channel)
        except MdfconvError as error:
            problems.append(MaterialProblem(place, str(error)))
        else:
            entry = pictures.images[image].value
            name = entry.get("uri", entry.get("name"))
            is_name = isinstance(name, str) and not is_data(name)
            textures[image] = replace(
                picture,
                file=name if is_name else f"images[{image}]",
                place=place,
                taken_for=texels,
            )
    return list(textures.values()), problems
