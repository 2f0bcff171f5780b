"""Wavefront material libraries: roughness from exponents and back, every other byte kept."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from mdfconv.errors import MdfconvError
from mdfconv.fitting.metrics import Metric, metric_named
from mdfconv.scene.material_files import FileConversion
from mdfconv.scene.mtl.statements import Line, lines, named_files, number, split_options
from mdfconv.scene.shininess import exponent_of, fit_error, roughness_of
from mdfconv.scene.stored import MaterialProblem, ProblemKind

# Tools that write libraries end at 1000, some at 10000: more is likely of another scale.
_LARGEST_USUAL = 1e4
_MODEL = re.compile(rb"^[ \t]*mtllib[ \t]+([^\r\n]*)", re.MULTILINE)
# Digits enough that an exponent comes back from a roughness to six.
_DIGITS = {b"Pr": 8, b"Ns": 6}


class To(StrEnum):
    """What a library is converted to."""

    roughness = "roughness"
    shininess = "shininess"


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
        Ns and Pr: the one that was converted, and its conversion.
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
    materials : tuple of Material
        What was converted, in the order of the library.
    textures : tuple of TextureStatement
        The textures of exponents (or of roughness, towards shininess) that it names.
    """

    materials: tuple[MtlMaterial, ...]
    textures: tuple[TextureStatement, ...]


@dataclass
class _MaterialBlock:
    """What is known of one material while its library is converted."""

    name: str
    sources: list[Line] = field(default_factory=list)
    targets: list[Line] = field(default_factory=list)
    value: float | None = None


def convert_mtl(
    data: bytes,
    to: str = To.roughness,
    *,
    metric: str | Metric = "environment",
    replace: bool = False,
    texture_names: dict[str, str] | None = None,
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
    texture_names : dict, optional
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
    keywords = (b"Ns", b"Pr") if to == To.roughness else (b"Pr", b"Ns")
    content = list(lines(data))
    if not any(line.keyword for line in content) and any(map(_says_something, content)):
        raise MdfconvError("is no material library: it has neither newmtl nor Ns nor Pr")
    blocks, problems = _blocks(content, keywords)
    materials = _converted(blocks, to, metric_named(metric))
    texts = _edited(content, blocks, materials, keywords, replace=replace)
    textures = _textures(content, blocks, b"map_" + keywords[0])
    if texture_names is None:
        # Only those of exponents can be converted.
        kind = ProblemKind.TEXTURE if to == To.roughness else ProblemKind.OTHER
        problems += [
            MaterialProblem(each.line, f"{each.keyword} {each.file} is a texture", kind)
            for each in textures
        ]
    names = texture_names or {}
    _set_textures(texts, content, textures, b"map_" + keywords[1], names, replace=replace)
    return MtlConversion(
        data=b"".join(texts),
        notes=_replaced(content, texts, keywords[1]),
        materials=tuple(filter(None, materials)),
        textures=textures,
        named=named_files(content),
        problems=tuple(problems),
    )


def _says_something(line: Line) -> bool:
    """Return whether a line without a statement that matters is more than blank or a comment."""
    return bool(line.before.partition(b"#")[0].strip())


def texture_statements(data: bytes) -> tuple[TextureStatement, ...]:
    """Return the textures of exponents, ``map_Ns``, that a library names."""
    content = list(lines(data))
    blocks, _ = _blocks(content, (b"Ns", b"Pr"))
    return _textures(content, blocks, b"map_Ns")


def _blocks(
    lines: list[Line], keywords: tuple[bytes, bytes]
) -> tuple[list[_MaterialBlock], list[MaterialProblem]]:
    """Return the materials, before the first ``newmtl`` one without a name, and problems."""
    blocks, problems = [_MaterialBlock("")], []
    for line in lines:
        if line.keyword == b"newmtl":
            blocks.append(_MaterialBlock(line.value.decode(errors="replace")))
        block = blocks[line.material]
        if line.keyword == keywords[1]:
            block.targets.append(line)
        elif line.keyword == keywords[0]:
            problem, value = number(line.value, keywords[0])
            if problem:
                problems.append(MaterialProblem(line.number, problem))
            else:
                # Of several statements readers take the last.
                block.sources.append(line)
                block.value = value
    return blocks, problems


def _converted(blocks: list[_MaterialBlock], to: str, metric: Metric) -> list[MtlMaterial | None]:
    """Return the conversion of each material; None where there is nothing to convert."""
    values = np.array([np.nan if block.value is None else block.value for block in blocks])
    results, rmse = np.full((2, values.size), np.nan)
    # Pr 0 is a mirror, which has no exponent.
    convertible = ~np.isnan(values) & ((values > 0) | (to == To.roughness))
    # A library repeats its values.
    unique, index = np.unique(values[convertible], return_inverse=True)
    if to == To.roughness:
        answers = roughness_of(unique, metric)
        errors = fit_error(unique, metric)
    else:
        answers = exponent_of(unique, metric)
        errors = fit_error(answers, metric)
    results[convertible], rmse[convertible] = answers[index], errors[index]
    return [
        None if np.isnan(value) else _material(block, to, float(value), float(result), float(error))
        for block, value, result, error in zip(blocks, values, results, rmse, strict=True)
    ]


def _material(
    block: _MaterialBlock, to: str, value: float, result: float, error: float
) -> MtlMaterial:
    pair = (value, result) if to == To.roughness else (result, value)
    notes = []
    if pair[0] == 0:
        notes.append("Ns 0 is no highlight: Pr 1")
    if pair[0] > _LARGEST_USUAL:
        notes.append("Ns beyond 10000")
    if pair[1] == 0:
        notes.append("Pr 0 is a mirror, which has no exponent: nothing written")
    if len(block.sources) > 1:
        notes.append(f"{len(block.sources)} statements: the last counts")
    return MtlMaterial(block.name, block.sources[-1].number, *pair, error, tuple(notes))


def _usual_end(lines: list[Line]) -> bytes:
    """Return what ends the lines of a library, for a last line that nothing ends."""
    return next((line.end for line in lines if line.end), b"\n")


def _edited(
    lines: list[Line],
    blocks: list[_MaterialBlock],
    materials: list[MtlMaterial | None],
    keywords: tuple[bytes, bytes],
    *,
    replace: bool,
) -> list[bytes]:
    """Return the lines, ends included, with the targets set; a dropped line is empty."""
    texts = [line.content + line.end for line in lines]
    default_end = _usual_end(lines)
    for block, material in zip(blocks, materials, strict=True):
        result = None if material is None else _result(material, keywords[1])
        if result is None:
            continue
        last = block.sources[-1]
        for line in block.targets:
            texts[line.number - 1] = line.with_value(keywords[1], result) + line.end
        if replace:
            for line in block.sources:
                texts[line.number - 1] = b""
        if not block.targets:
            new = last.with_value(keywords[1], result)
            if not replace:
                new = last.content + (last.end or default_end) + last.another(keywords[1], result)
            texts[last.number - 1] = new + last.end
    return texts


def _replaced(lines: list[Line], texts: list[bytes], keyword: bytes) -> tuple[tuple[int, str], ...]:
    """Return notes on the values of the target that somebody wrote and that are gone."""
    return tuple(
        (line.number, f"{line.keyword.decode()} {line.value.decode(errors='replace')} was replaced")
        for line, text in zip(lines, texts, strict=True)
        if line.keyword in (keyword, b"map_" + keyword)
        and line.value
        and text != line.content + line.end
    )


def _result(material: MtlMaterial, keyword: bytes) -> bytes | None:
    """Return the number to write; None if there is none."""
    value = material.roughness if keyword == b"Pr" else material.shininess
    return None if np.isnan(value) else f"{value:.{_DIGITS[keyword]}g}".encode()


def _textures(
    lines: list[Line], blocks: list[_MaterialBlock], keyword: bytes
) -> tuple[TextureStatement, ...]:
    return tuple(
        TextureStatement(
            blocks[line.material].name,
            keyword.decode(),
            split_options(line.value)[1].decode(errors="surrogateescape"),
            line.number,
        )
        for line in lines
        if line.keyword == keyword and line.value
    )


def _set_textures(
    texts: list[bytes],
    lines: list[Line],
    textures: tuple[TextureStatement, ...],
    keyword: bytes,
    names: dict[str, str],
    *,
    replace: bool,
) -> None:
    """Name the converted textures, in a line of their own or in the place of the others."""
    default_end = _usual_end(lines)
    targets = {line.material: line for line in lines if line.keyword == keyword}
    for texture in textures:
        line = lines[texture.line - 1]
        if texture.file not in names:
            continue
        options, _ = split_options(line.value)
        value = options + names[texture.file].encode(errors="surrogateescape")
        target = targets.get(line.material)
        if target:
            texts[target.number - 1] = target.with_value(keyword, value) + target.end
        if replace:
            texts[line.number - 1] = b"" if target else line.with_value(keyword, value) + line.end
        elif not target:
            new = (b"" if line.end else default_end) + line.another(keyword, value) + line.end
            texts[line.number - 1] += new
