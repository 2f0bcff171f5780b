"""Wavefront material libraries: roughness from exponents and back, every other byte kept."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Container, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from enum import StrEnum
from math import isclose

import numpy as np

from mdfconv.distributions.evaluation import Array
from mdfconv.errors import MdfconvError
from mdfconv.fitting.metrics import Metric, metric_named
from mdfconv.scene.material_files import FileConversion, TextureFolder
from mdfconv.scene.mtl import statements
from mdfconv.scene.mtl.meaning import AUTO, NsMeaning, asked_meaning, likely_meaning
from mdfconv.scene.mtl.statements import Line, MaterialBlock
from mdfconv.scene.shininess import ROUGHNESS, luminance
from mdfconv.scene.stored import UNIFORM_BELOW, MaterialProblem, ProblemKind
from mdfconv.scene.texture.convert import Progress
from mdfconv.scene.texture.rule import TextureRule

# Tools that write libraries end at 1000, some at 10000: more is likely of another scale.
_LARGEST_USUAL = 1e4
_MODEL = re.compile(rb"^[ \t]*mtllib[ \t]+([^\r\n]*)", re.MULTILINE)
# Digits enough that an exponent comes back from a roughness to six.
_DIGITS = {b"Pr": 8, b"Ns": 6}
# A Pr that is so near to what would be written is that.
_SAME = 1e-6
_UTF_16 = (b"\xff\xfe", b"\xfe\xff")
_ROUGHEST_HARDNESS = -1.960784


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
    exponent : float
        Blinn's exponent that Ns stands for; NaN where it stands for a roughness, which is Pr.
    specular : float
        The luminance of Ks; NaN without one.
    rmse : float
        The error that the conversion leaves: the relative root mean square of `explain`.
    notes : tuple of str
        What a careful user must know.
    """

    name: str
    line: int
    shininess: float
    roughness: float
    exponent: float
    specular: float
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
    source, writer, why : str
        What Ns was taken for, such as ``"blinn-phong:blender-obj"``, the program that wrote the
        library, "" if it is not known, and why in words.
    texels : str
        What the texels of converted textures were taken for; "" if none were converted.
    """

    materials: tuple[MtlMaterial, ...]
    textures: tuple[TextureStatement, ...]
    source: str
    writer: str
    why: str
    texels: str = ""


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
    source: str = AUTO,
    metric: str | Metric = "environment",
    replace: bool = False,
    overwrite: bool = False,
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
    source : str
        What Ns is, or becomes: ``"blinn-phong"`` for an exponent, or what a program made of one,
        such as ``"blinn-phong:blender-obj"``. By default the header and the numbers of the library
        say who wrote it, and without such a header it is an exponent.
    metric : str or Metric
        What the fit keeps; readers of Pr use normalized distributions in scenes with light
        from all around, so by default that.
    replace : bool
        Drop the statement that was converted.
    overwrite : bool
        Towards roughness, overwrite a Pr or a map_Pr that a material has already. Without it such
        a material is left, as its Ns is as a rule only for readers that know no Pr.
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
        If `to`, the source or the metric is not known, or the file is no library: a model, or any
        other.
    """
    if to not in list(To):
        raise MdfconvError(f"a library is converted to roughness or shininess, not to '{to}'")
    keyword, target = _KEYWORDS[To(to)]
    lines, blocks = _read(data)
    meaning = _meaning(data, lines, blocks, source)
    sources, problems = _sources(blocks, keyword, meaning)
    materials = _converted(sources, to, metric_named(metric), meaning)
    edit = _Edit(keyword, target, replace, overwrite, texture_names)
    converted, left = edit.set_numbers(sources, materials)
    textures, left_textures = edit.set_textures(blocks)
    return MtlConversion(
        data=b"".join([line.result for line in lines]),
        notes=_notes(lines, target, meaning),
        materials=tuple(converted),
        textures=tuple(textures),
        named=statements.named_files(lines),
        problems=tuple(problems + left + left_textures),
        source=meaning.end.label,
        writer=meaning.writer,
        why=meaning.why,
    )


@dataclass(frozen=True)
class _Edit:
    """What is written into a library: the arguments of `convert_mtl`, and both keywords."""

    keyword: bytes
    target: bytes
    replace: bool
    overwrite: bool
    texture_names: Mapping[str, str] | None

    @property
    def keeps_authored(self) -> bool:
        """Whether a roughness that a material has already stays."""
        return self.target == b"Pr" and not self.overwrite

    def set_numbers(
        self, sources: Sequence[_SourceLines], materials: Sequence[MtlMaterial]
    ) -> tuple[list[MtlMaterial], list[MaterialProblem]]:
        """Write numbers; return the materials that have theirs, and why others are left."""
        converted: list[MtlMaterial] = []
        problems: list[MaterialProblem] = []
        for source, material in zip(sources, materials, strict=True):
            value = _written(material, self.target)
            authored = _authored(source.block) if self.keeps_authored else None
            if authored and not _is_same(authored, value):
                gives = f"{source.lines[-1].shown} gives {self.target.decode()} {value.decode()}"
                text = f"{authored.shown} is authored, {gives}"
                problems.append(MaterialProblem(authored.number, text, ProblemKind.AUTHORED))
                continue
            mapped = self.target == b"Pr" and self._names(source.block)
            if self._fails(source.block) and not mapped:
                # What its map would have replaced is better than the number alone.
                continue
            if mapped and not authored:
                # The map has the whole roughness, and readers multiply it by the number.
                value, notes = b"1", (*material.notes, "Pr 1, as map_Pr has the roughness")
                material = dataclasses.replace(material, roughness=1.0, rmse=np.nan, notes=notes)
            converted.append(material)
            if value and not authored:
                self._set_number(source, value, mapped=mapped)
        return converted, problems

    def _fails(self, block: MaterialBlock) -> bool:
        """Return whether a map that was to be overwritten has no texture to be overwritten by."""
        asked = self.texture_names is not None and self.target == b"Pr"
        return asked and bool(block.having(b"map_Ns")) and bool(block.having(b"map_Pr"))

    def _set_number(self, source: _SourceLines, value: bytes, *, mapped: bool) -> None:
        targets = source.block.having(self.target)
        _set(self.target, value, source.lines, targets, replace=self.replace)
        if self.target == b"Pr" and self.overwrite and not mapped:
            for line in source.block.having(b"map_Pr"):
                line.replacement = b""

    def set_textures(
        self, blocks: Sequence[MaterialBlock]
    ) -> tuple[list[TextureStatement], list[MaterialProblem]]:
        """Write names of textures; return the statements that there are, and what is left."""
        problems: list[MaterialProblem] = []
        textures = _textures(blocks, b"map_" + self.keyword)
        for block, line, texture in textures:
            if self.keeps_authored and _authored(block):
                continue
            if self.texture_names is None:
                kind = ProblemKind.TEXTURE if self.keyword == b"Ns" else ProblemKind.OTHER
                text = f"{texture.keyword} {texture.file} is a texture"
                problems.append(MaterialProblem(line.number, text, kind))
            elif name := self._new_name(line, texture):
                options, _ = statements.split_options(line.value)
                value = options + name.encode(errors="surrogateescape")
                targets = block.having(b"map_" + self.target)[-1:]
                _set(b"map_" + self.target, value, [line], targets, replace=self.replace)
        return [texture for *_, texture in textures], problems

    def _names(self, block: MaterialBlock) -> bool:
        """Return whether a map of a material gets a new name."""
        textures = _textures([block], b"map_" + self.keyword)
        return any(self._new_name(line, texture) for _, line, texture in textures)

    def _new_name(self, line: Line, texture: TextureStatement) -> str:
        """Return the name of a converted texture, "" if it has none."""
        name = (self.texture_names or {}).get(texture.file, "")
        # Texels that stay may be rescaled as before.
        return "" if name != texture.file and statements.rescales(line) else name


def _authored(block: MaterialBlock) -> Line | None:
    """Return the last statement that gives a material a roughness; None without one."""
    lines = [*block.having(b"Pr"), *block.having(b"map_Pr")]
    return next((line for line in reversed(lines) if line.value), None)


def _read(data: bytes) -> tuple[list[Line], list[MaterialBlock]]:
    """Return the lines and the materials of a library; refuse what is none."""
    model = _MODEL.search(data)
    if model:
        library = model[1].decode(errors="replace")
        raise MdfconvError("is a model, not a material library", f"its materials are in {library}")
    if data.startswith(_UTF_16):
        raise MdfconvError("is text in UTF-16", "save it as UTF-8")
    lines, blocks = statements.read_library(data)
    # What has no such statement may be blank or of comments.
    says_something = any(line.before.partition(b"#")[0].strip() for line in lines)
    if says_something and not any(line.keyword for line in lines):
        raise MdfconvError("is no material library: it has neither newmtl nor Ns nor Pr")
    return lines, blocks


def _meaning(
    data: bytes, lines: Sequence[Line], blocks: Sequence[MaterialBlock], source: str
) -> NsMeaning:
    """Return what Ns is, as given or by what the library says."""
    if source.strip().lower() != AUTO:
        return asked_meaning(source)
    return likely_meaning(statements.comments(lines), _numbers(blocks, b"Ns"), data)


def _numbers(blocks: Sequence[MaterialBlock], keyword: bytes) -> Array:
    """Return the numbers of all statements of a keyword that are numbers, shape (n,)."""
    numbers = []
    for line in (line for block in blocks for line in block.having(keyword)):
        with suppress(MdfconvError):
            numbers.append(statements.number(line))
    return np.array(numbers, float)


def _sources(
    blocks: Sequence[MaterialBlock], keyword: bytes, meaning: NsMeaning
) -> tuple[list[_SourceLines], list[MaterialProblem]]:
    """Return what is converted of the materials that have it, and which numbers cannot be."""
    sources, problems = [], []
    illegal: set[float] = set()
    if keyword == b"Ns":
        known = np.unique(_numbers(blocks, keyword))
        illegal |= set(known[~meaning.accepts(known)].tolist())
    for block in blocks:
        numbers: list[tuple[Line, float]] = []
        for line in block.having(keyword):
            try:
                numbers.append((line, _legal_number(line, meaning, illegal)))
            except MdfconvError as error:
                problems.append(MaterialProblem(line.number, str(error)))
        if numbers:
            sources.append(_SourceLines(block, [line for line, _ in numbers], numbers[-1][1]))
    return sources, problems


def _legal_number(line: Line, meaning: NsMeaning, illegal: Container[float]) -> float:
    number = statements.number(line)
    if number in illegal:
        what = f" of {meaning.end.label}" if meaning.dialect else ""
        hint = "Blender 2.7 wrote that for the roughest" if number == _ROUGHEST_HARDNESS else ""
        shown = line.value.decode(errors="replace")
        raise MdfconvError(f"Ns '{shown}' is outside {meaning.legal}{what}", hint)
    return number


def _converted(
    sources: Sequence[_SourceLines], to: str, metric: Metric, meaning: NsMeaning
) -> list[MtlMaterial]:
    """Return the conversion of each material."""
    # A library repeats its values.
    values, index = np.unique(np.array([each.value for each in sources]), return_inverse=True)
    if to == To.roughness:
        exponent, roughness, rmse = meaning.converted(values, metric)
        shininess = values
    else:
        shininess, exponent, rmse = meaning.of_roughness(values, metric)
        roughness = values
    columns = (column.tolist() for column in (shininess, roughness, exponent, rmse))
    rows = list(zip(*columns, strict=True))
    return [_material(each, *rows[at]) for each, at in zip(sources, index.tolist(), strict=True)]


def _material(
    source: _SourceLines, shininess: float, roughness: float, exponent: float, rmse: float
) -> MtlMaterial:
    remarks = {
        f"Ns {shininess:g} is no highlight: Pr 1": exponent < UNIFORM_BELOW,
        "Ns beyond 10000": exponent > _LARGEST_USUAL,
        "Pr 0 is a mirror, which has no exponent: nothing written": np.isnan(shininess)
        and roughness == 0,
        "beyond what the writer of the library stores: nothing written": np.isnan(shininess)
        and roughness > 0,
        f"{len(source.lines)} statements: the last counts": len(source.lines) > 1,
    }
    notes = tuple(text for text, holds in remarks.items() if holds)
    line = source.lines[-1].number
    colours = [statements.colour(line) for line in source.block.having(b"Ks")]
    specular = luminance(colours[-1]) if colours and colours[-1] else np.nan
    return MtlMaterial(
        source.block.name, line, shininess, roughness, exponent, specular, rmse, notes
    )


def _written(material: MtlMaterial, target: bytes) -> bytes:
    """Return what is written of a conversion; nothing for a mirror's exponent."""
    result = material.roughness if target == b"Pr" else material.shininess
    return b"" if np.isnan(result) else f"{result:.{_DIGITS[target]}g}".encode()


def _is_same(authored: Line, value: bytes) -> bool:
    """Return whether an authored roughness is what would be written."""
    if authored.keyword != b"Pr":
        return False
    with suppress(MdfconvError):
        return isclose(statements.number(authored), float(value), rel_tol=_SAME)
    return False


def _notes(lines: Sequence[Line], target: bytes, meaning: NsMeaning) -> tuple[tuple[int, str], ...]:
    """Return what a careful user must know, with the lines that it is about."""
    replaced = [
        (line.number, f"{line.shown} was replaced")
        for line in lines
        if line.keyword.removeprefix(b"map_") == target and line.value and line.is_changed
    ]
    return tuple(([(meaning.line, meaning.why)] if meaning.line else []) + replaced)


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
        # As of numbers, the last counts.
        for line in [line for line in block.having(keyword) if line.value][-1:]:
            file = statements.split_options(line.value)[1].decode(errors="surrogateescape")
            statement = TextureStatement(block.name, keyword.decode(), file, line.number)
            textures.append((block, line, statement))
    return textures


def library_texels(data: bytes, source: str = AUTO) -> str:
    """Return what the texels of ``map_Ns`` in a library are, "" if it is not known.

    It is the name of an endpoint; the source as for `convert_mtl`.
    """
    return _meaning(data, *_read(data), source).texels


def texture_rule(texels: str, metric: Metric, exponent_max: float) -> TextureRule:
    """Return how textures of ``map_Ns``, whose texels are those of an endpoint, become roughness.

    Raises
    ------
    MdfconvError
        If the name is not known or the exponent of a white texel is illegal.
    """
    rule = TextureRule(texels, ROUGHNESS, metric=str(metric), exponent_max=exponent_max)
    rule.endpoints()
    return rule


def convert_library_textures(
    data: bytes,
    folder: TextureFolder,
    rule: TextureRule | None,
    progress: Progress,
    *,
    overwrite: bool = False,
) -> tuple[dict[str, str], list[MaterialProblem]]:
    """Convert the textures of ``map_Ns`` that a library names, `overwrite` as for `convert_mtl`.

    Returns
    -------
    dict of str to str
        Their new names, for `convert_mtl`; a texture of roughness keeps its name.
    list of MaterialProblem
        What cannot be converted: without a rule all of them.
    """
    names: dict[str, str] = {}
    problems: list[MaterialProblem] = []
    blocks = [block for block in _read(data)[1] if overwrite or not _authored(block)]
    textures = _textures(blocks, b"map_Ns")
    with progress("Textures", len(textures)) as advance:
        for _, line, texture in textures:
            if rule is None:
                text = f"what the texels of map_Ns {texture.file} are is not known"
                problems.append(MaterialProblem(line.number, text, ProblemKind.TEXELS))
                continue
            try:
                if statements.rescales(line) and rule.endpoints()[0].label != ROUGHNESS:
                    options = statements.split_options(line.value)[0].decode(errors="replace")
                    raise MdfconvError(
                        f"map_Ns {texture.file} has {options.strip()}, by which its texels are "
                        "rescaled before they are read",
                        "rescale the texture itself",
                    )
                names[texture.file] = _converted_texture(texture.file, folder, rule)
            except MdfconvError as error:
                problems.append(MaterialProblem(line.number, str(error)))
            advance(1)
    return names, problems


def _converted_texture(file: str, folder: TextureFolder, rule: TextureRule) -> str:
    """Return the name of a converted texture; that of the texture where nothing is to be done."""
    source, target = rule.endpoints()
    return file if source.label == target.label else folder.convert(file, rule, "Pr")
