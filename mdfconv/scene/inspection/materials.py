"""Mitsuba's scenes and Wavefront's material libraries inspected."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from mdfconv.distributions.endpoint import Endpoint, endpoint
from mdfconv.errors import MdfconvError
from mdfconv.scene.inspection.pictures import picture_beside
from mdfconv.scene.inspection.records import (
    TARGET,
    Arguments,
    FileInspection,
    InspectedNumber,
    InspectedTexture,
    NextStep,
    Value,
    result_path,
    unread,
)
from mdfconv.scene.material_files import read_file
from mdfconv.scene.mitsuba.convert import MitsubaMaterial, convert_mitsuba
from mdfconv.scene.mitsuba.scene import MitsubaScene, source_of
from mdfconv.scene.mtl.library import MtlConversion, MtlMaterial, To, convert_mtl
from mdfconv.scene.mtl.meaning import asked_meaning
from mdfconv.scene.shininess import ROUGHNESS
from mdfconv.scene.stored import MaterialProblem, ProblemKind

# The outermost elements of what Mitsuba loads.
_ROOTS = ("scene", "bsdf", "shape")


def inspect_scene(path: Path) -> FileInspection:
    """Return what a Mitsuba scene is."""
    data = read_file(path)
    scene = MitsubaScene(data)
    if scene.root not in _ROOTS:
        return unread(path, "XML", MdfconvError(f"it is no scene: its root is {scene.root}"))
    pictures: dict[tuple[str, str], InspectedTexture] = {}

    def texture(file: str, taken_for: str) -> str:
        pictures[file, taken_for] = replace(picture_beside(path, file), taken_for=taken_for)
        return file

    target = TARGET.name
    found = convert_mitsuba(data, target, texture=texture)
    textures = [
        replace(pictures[each.file, source_of(each.distribution)], place=each.line)
        for each in found.textures
    ]
    left = [each for each in found.materials if each.distribution != target]
    included = [(line, f"{file} is included, and is not read") for line, file in found.includes]
    step = NextStep("mitsuba", {"textures": True} if textures else {}, result_path(path))
    version = {None: "not said", 0: "Mitsuba 0.6"}.get(scene.version, f"Mitsuba {scene.version}")
    return FileInspection(
        file=path,
        kind="Mitsuba scene",
        facts={"version": version},
        taken_for="the distribution of each BSDF, as Mitsuba reads it",
        numbers=[_bsdf(each) for each in found.materials],
        textures=textures,
        problems=found.problems,
        notes=[f"line {line}: {text}" for line, text in (*found.notes, *included)],
        repaired="" if left or not found.materials else f"every BSDF is {target} already",
        next_step=step if left else None,
    )


def _bsdf(material: MitsubaMaterial) -> InspectedNumber:
    source = endpoint(source_of(material.distribution))
    return InspectedNumber(
        material.name,
        material.line,
        "alpha",
        material.value,
        material.distribution,
        _each(material.value, lambda value: _exponent(source, value)),
        material.result,
        _each(material.result, lambda alpha: float(np.sqrt(alpha))),
        material.notes,
    )


def _each(value: Value, function: Callable[[float], float]) -> Value:
    return tuple(map(function, value)) if isinstance(value, tuple) else function(value)


def _exponent(source: Endpoint, stored: float) -> float:
    """Return the exponent that a number stands for, NaN if it stands for none."""
    if not source.distribution.parameter.larger_is_smoother:
        return float("nan")
    return float(source.decode_legal(np.array(stored)))


def inspect_library(path: Path) -> FileInspection:
    """Return what a Wavefront material library is."""
    data = read_file(path)
    found = convert_mtl(data)
    textures, problems = _textures_of(path, found, asked_meaning(found.source).texels)
    problems += [each for each in found.problems if each.kind is ProblemKind.OTHER]
    # What has a roughness by its author needs none.
    authored = [(each.place, each.text) for each in found.problems if _is_authored(each)]
    numbers = [_exponent_of(each, found.source) for each in found.materials]
    known = {each.name for each in numbers}
    others = convert_mtl(data, To.shininess).materials
    numbers += [_authored_of(each) for each in others if each.name not in known]
    notes = [(line, text) for line, text in found.notes if text != found.why]
    arguments: Arguments = {"textures": True} if textures else {}
    if textures and not textures[0].taken_for:
        arguments["texels"] = None
    done = found.data == data and not textures
    why = found.why.removeprefix(f"written by {found.writer}: ")
    return FileInspection(
        file=path,
        kind="Wavefront material library",
        writer=found.writer,
        taken_for=f"{found.source}: {why}" if found.materials or found.problems else "",
        numbers=sorted(numbers, key=_line),
        textures=textures,
        problems=sorted(problems, key=_line),
        notes=[f"line {line}: {text}" for line, text in (*authored, *notes)],
        repaired="every Ns has its Pr already" if done and found.materials else "",
        next_step=None if done else NextStep("mtl", arguments, result_path(path)),
    )


def _textures_of(
    path: Path, found: MtlConversion, texels: str
) -> tuple[list[InspectedTexture], list[MaterialProblem]]:
    """Return the textures of a library that are to be converted, and which cannot be read."""
    textures: list[InspectedTexture] = []
    problems: list[MaterialProblem] = []
    files = {each.line: each.file for each in found.textures}
    for line in (each.place for each in found.problems if each.kind is ProblemKind.TEXTURE):
        try:
            picture = picture_beside(path, files[int(line)])
        except MdfconvError as error:
            problems.append(MaterialProblem(line, str(error)))
        else:
            textures.append(replace(picture, place=line, taken_for=texels))
    return textures, problems


def _is_authored(problem: MaterialProblem) -> bool:
    return problem.kind is ProblemKind.AUTHORED


def _line(each: InspectedNumber | MaterialProblem) -> int:
    return int(each.place)


def _exponent_of(material: MtlMaterial, source: str) -> InspectedNumber:
    return InspectedNumber(
        material.name,
        material.line,
        "Ns",
        material.shininess,
        source,
        material.exponent,
        material.roughness**2,
        material.roughness,
        material.notes,
    )


def _authored_of(material: MtlMaterial) -> InspectedNumber:
    """Return the roughness of a material that has no other number, or one that it keeps."""
    roughness = material.roughness
    place = material.name, material.line
    return InspectedNumber(*place, "Pr", roughness, ROUGHNESS, math.nan, roughness**2, roughness)
