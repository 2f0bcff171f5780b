"""Wavefront material libraries: roughness from exponents and back, every other byte kept."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from mdfconv.errors import MdfconvError
from mdfconv.fitting.metrics import Metric, metric_named
from mdfconv.scene.material_files import FileConversion, TextureFolder
from mdfconv.scene.mtl import statements
from mdfconv.scene.mtl.statements import Line, MaterialBlock
from mdfconv.scene.shininess import ROUGHNESS, SHININESS, exponent_of, fit_error, roughness_of
from mdfconv.scene.stored import MaterialProblem, ProblemKind
from mdfconv.scene.texture.convert import Progress
from mdfconv.scene.texture.rule import TextureRule

# Tools that write libraries end at 1000, some at 10000: more is likely of another scale.
_LARGEST_USUAL = 1e4
_MODEL = re.compile(rb"^[ \t]*mtllib[ \t]+([^\r\n]*)", re.MULTILINE)
# Digits enough that an exponent comes back from a roughness to six.
_DIGITS = {b"Pr": 8, b"Ns": 6}


class To(StrEnum):
    """What a library is converted to."""

    roughness = "roughness"
    shininess = "shininess"


# What is converted, and what it becomes.
_KEYWORDS = {To.roughness: (b"Ns", b"Pr"), To.shininess: (b"Pr", b"Ns")}


@dataclass(frozen=True)
class MtlMaterial:
    """One conversion of a material.

    Parameters
    ----------
    name : str
        From its ``newmtl``; "" for statements before the first.
    line : int
        Line of the statement that was converted, counted from 1.
    shininess, roughness : float
        Ns and Pr: the one that was converted, and its conversion; NaN for a mirror's exponent.
    rmse : float
        The error that the conversion leaves: the relative root mean square of `explain`.
    notes : tuple of str
        What a careful user must know.
    """

    name: str
    line: int
    shininess: float
    roughness: float
    rmse: float
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class TextureStatement:
    """A ``map_Ns`` or ``map_Pr`` in a library.

    Parameters
    ----------
    material, keyword, file : str
        The material's name, the keyword and the file that it names.
    line : int
        Its line, counted from 1.
    """

    material: str
    keyword: str
    file: str
    line: int


@dataclass(frozen=True, kw_only=True)
class MtlConversion(FileConversion):
    """A converted library, with the lines of its problems.

    Parameters
    ----------
    materials : tuple of MtlMaterial
        What was converted, in the order of the library.
    textures : tuple of TextureStatement
        The textures of exponents (or of roughness, towards shininess) that it names.
    """

    materials: tuple[MtlMaterial, ...]
    textures: tuple[TextureStatement, ...]


@dataclass(frozen=True)
class _SourceLines:
    """The statements of one material that are converted; of several readers take the last."""

    block: MaterialBlock
    lines: list[Line]
    value: float


def convert_mtl(
    data: bytes,
    to: str = To.roughness,
    *,
    metric: str | Metric = "environment",
    replace: bool = False,
    texture_names: Mapping[str, str] | None = None,
) -> MtlConversion:
    """Convert the shininess of a material library to roughness, or back.

    Parameters
    ----------
    data : bytes
        The library. Whatever is not converted is kept: comments, order, blanks, line ends.
    to : str
        ``"roughness"``: each material with an Ns gets the Pr of the GGX (α = Pr²) that fits
        best. ``"shininess"``: each with a Pr gets the Ns whose best GGX that is.
    metric : str or Metric
        What the fit keeps; readers of Pr use normalized distributions in scenes with light
        from all around, so by default that.
    replace : bool
        Drop the statement that was converted.
    texture_names : mapping, optional
        From files that ``map_Ns`` names to those that a ``map_Pr`` beside it is to name; for
        shininess the other way round. Without it such statements are problems.

    Returns
    -------
    MtlConversion
        The library and what there is to say about it.

    Raises
    ------
    MdfconvError
        If `to` or the metric is not known, or the file is no library: a model, or any other.
    """
    model = _MODEL.search(data)
    if model:
        library = model[1].decode(errors="replace")
        raise MdfconvError("is a model, not a material library", f"its materials are in {library}")
    if to not in list(To):
        raise MdfconvError(f"a library is converted to roughness or shininess, not to '{to}'")
    source, target = _KEYWORDS[To(to)]
    lines, blocks = statements.read_library(data)
    # What has no such statement may be blank or of comments.
    says_something = any(line.before.partition(b"#")[0].strip() for line in lines)
    if says_something and not any(line.keyword for line in lines):
        raise MdfconvError("is no material library: it has neither newmtl nor Ns nor Pr")
    sources, problems = _sources(blocks, source)
    materials = _converted(sources, to, metric_named(metric))
    for each, material in zip(sources, materials, strict=True):
        result = material.roughness if target == b"Pr" else material.shininess
        if not np.isnan(result):
            value = f"{result:.{_DIGITS[target]}g}".encode()
            _set(target, value, each.lines, each.block.having(target), replace=replace)
    textures = _textures(blocks, b"map_" + source)
    for block, line, texture in textures:
        if texture_names is None:
            kind = ProblemKind.TEXTURE if source == b"Ns" else ProblemKind.OTHER
            text = f"{texture.keyword} {texture.file} is a texture"
            problems.append(MaterialProblem(line.number, text, kind))
        elif texture.file in texture_names:
            options, _ = statements.split_options(line.value)
            value = options + texture_names[texture.file].encode(errors="surrogateescape")
            targets = block.having(b"map_" + target)[-1:]
            _set(b"map_" + target, value, [line], targets, replace=replace)
    return MtlConversion(
        data=b"".join([line.result for line in lines]),
        notes=tuple(
            (line.number, f"{line.shown} was replaced")
            for line in lines
            if line.keyword.removeprefix(b"map_") == target and line.value and line.is_changed
        ),
        materials=tuple(materials),
        textures=tuple(texture for *_, texture in textures),
        named=statements.named_files(lines),
        problems=tuple(problems),
    )


def _sources(
    blocks: Sequence[MaterialBlock], keyword: bytes
) -> tuple[list[_SourceLines], list[MaterialProblem]]:
    """Return what is converted of the materials that have it, and what is not a number."""
    sources, problems = [], []
    for block in blocks:
        numbers: list[tuple[Line, float]] = []
        for line in block.having(keyword):
            try:
                numbers.append((line, statements.number(line)))
            except MdfconvError as error:
                problems.append(MaterialProblem(line.number, str(error)))
        if numbers:
            sources.append(_SourceLines(block, [line for line, _ in numbers], numbers[-1][1]))
    return sources, problems


def _converted(sources: Sequence[_SourceLines], to: str, metric: Metric) -> list[MtlMaterial]:
    """Return the conversion of each material."""
    # A library repeats its values.
    values, index = np.unique(np.array([each.value for each in sources]), return_inverse=True)
    if to == To.roughness:
        exponent, roughness = values, roughness_of(values, metric)
    else:
        exponent, roughness = exponent_of(values, metric), values
    columns = exponent.tolist(), roughness.tolist(), fit_error(exponent, metric).tolist()
    rows = list(zip(*columns, strict=True))
    return [_material(each, *rows[at]) for each, at in zip(sources, index.tolist(), strict=True)]


def _material(source: _SourceLines, shininess: float, roughness: float, rmse: float) -> MtlMaterial:
    remarks = {
        "Ns 0 is no highlight: Pr 1": shininess == 0,
        "Ns beyond 10000": shininess > _LARGEST_USUAL,
        "Pr 0 is a mirror, which has no exponent: nothing written": roughness == 0,
        f"{len(source.lines)} statements: the last counts": len(source.lines) > 1,
    }
    notes = tuple(text for text, holds in remarks.items() if holds)
    line = source.lines[-1].number
    return MtlMaterial(source.block.name, line, shininess, roughness, rmse, notes)


def _set(
    keyword: bytes, value: bytes, sources: list[Line], targets: list[Line], *, replace: bool
) -> None:
    """Give the targets a value; without any, put a line behind the last source, or in its place."""
    last = sources[-1]
    for line in targets:
        line.replacement = line.with_value(keyword, value)
    if replace:
        for line in sources:
            line.replacement = b""
    if not targets:
        last.replacement = (last.with_value if replace else last.and_another)(keyword, value)


def _textures(
    blocks: Sequence[MaterialBlock], keyword: bytes
) -> list[tuple[MaterialBlock, Line, TextureStatement]]:
    """Return the statements of a keyword that name a texture."""
    textures = []
    for block in blocks:
        for line in block.having(keyword):
            if line.value:
                file = statements.split_options(line.value)[1].decode(errors="surrogateescape")
                statement = TextureStatement(block.name, keyword.decode(), file, line.number)
                textures.append((block, line, statement))
    return textures


def texture_rule(metric: Metric, exponent_max: float) -> TextureRule:
    """Return how textures of exponents become roughness.

    Raises
    ------
    MdfconvError
        If the exponent of a white texel is illegal.
    """
    texels = f"{SHININESS}:exponent", ROUGHNESS
    rule = TextureRule(*texels, metric=str(metric), exponent_max=exponent_max)
    rule.endpoints()
    return rule


def convert_library_textures(
    data: bytes, folder: TextureFolder, rule: TextureRule, progress: Progress
) -> tuple[dict[str, str], list[MaterialProblem]]:
    """Convert the textures of exponents that a library names.

    Returns
    -------
    dict of str to str
        Their new names, for `convert_mtl`.
    list of MaterialProblem
        What cannot be converted.
    """
    names: dict[str, str] = {}
    problems: list[MaterialProblem] = []
    textures = _textures(statements.read_library(data)[1], b"map_Ns")
    with progress("Textures", len(textures)) as advance:
        for _, line, texture in textures:
            try:
                names[texture.file] = folder.convert(texture.file, rule, "Pr")
            except MdfconvError as error:
                problems.append(MaterialProblem(line.number, str(error)))
            advance(1)
    return names, problems
