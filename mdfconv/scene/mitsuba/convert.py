"""Mitsuba's scenes with another distribution: every number converted, every other byte kept."""

from __future__ import annotations

import gc
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np

from mdfconv.distributions import distribution
from mdfconv.distributions.endpoint import endpoint
from mdfconv.distributions.evaluation import Array
from mdfconv.errors import MdfconvError
from mdfconv.fitting.metrics import Metric, metric_named
from mdfconv.fitting.solve import errors_of_many
from mdfconv.scene.material_files import FileConversion
from mdfconv.scene.mitsuba.scene import (
    DEFAULT_ALPHA,
    DEFAULT_DISTRIBUTION,
    DISTRIBUTIONS,
    PHONG_EXPONENT,
    TARGETS,
    Bsdf,
    MitsubaScene,
    bitmap_file,
    leave_what_others_use,
    read_scene,
)
from mdfconv.scene.mitsuba.xml_edit import Element, XmlEdits, attribute_text
from mdfconv.scene.stored import ConvertedNumber, MaterialProblem, Outcome, StoredConverter

# Mitsuba computes with 24 bits, which takes nine digits to tell all apart.
_DIGITS = 9

# From the file of a texture and what its texels are, such as "beckmann", to the name of another.
TextureConversion = Callable[[str, str], str]
Value = float | tuple[float, ...]


@dataclass(frozen=True)
class MitsubaMaterial:
    """A BSDF that has the target's distribution after the conversion.

    Parameters
    ----------
    name : str
        Its id, or its type if it has none.
    line : int
        Its line, counted from 1.
    distribution : str
        The one it had, in Mitsuba's words.
    value, result : float or tuple of two floats
        α before and after, of both axes if it has two; NaN of a texture.
    rmse : float
        The error that the conversion leaves: the relative root mean square of `explain`, for a
        pair that of the worse axis; NaN of a texture.
    notes : tuple of str
        What a careful user must know.
    """

    name: str
    line: int
    distribution: str
    value: Value
    result: Value
    rmse: float
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class MitsubaTexture:
    """A bitmap of α in a scene.

    Parameters
    ----------
    file, result : str
        The file that the scene named, and the one that it names now.
    distribution : str
        What its texels are, such as ``"beckmann"``.
    line : int
        The line of the file's name, counted from 1.
    """

    file: str
    result: str
    distribution: str
    line: int


@dataclass(frozen=True, kw_only=True)
class MitsubaConversion(FileConversion):
    """A converted scene, with the lines of its problems.

    Parameters
    ----------
    materials : tuple of MitsubaMaterial
        What has the target's distribution now, in the order of the scene.
    textures : tuple of MitsubaTexture
        The textures that were exchanged.
    includes : tuple of (int, str)
        The other files whose content belongs to the scene and was not read, with their lines.
    """

    materials: tuple[MitsubaMaterial, ...]
    textures: tuple[MitsubaTexture, ...]
    includes: tuple[tuple[int, str], ...]


@contextmanager
def _many_objects() -> Iterator[None]:
    """Look for no cycles among objects that live to the end: that is two fifths of the time."""
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            gc.enable()


@_many_objects()
def convert_mitsuba(
    data: bytes,
    target: str = "ggx",
    *,
    metric: str | Metric = "environment",
    texture: TextureConversion | None = None,
) -> MitsubaConversion:
    """Convert the distribution of the rough BSDFs in a scene of Mitsuba 0.6 or 3.

    Parameters
    ----------
    data : bytes
        The scene, XML in UTF-8. Whatever is not converted is kept.
    target : str
        ``"ggx"`` or ``"beckmann"``. 0.6's phong and as (Ashikhmin-Shirley) are converted, too.
    metric : str or Metric
        What the fit keeps; renderers use normalized distributions in scenes with light from all
        around, so by default that. The axes of an anisotropic BSDF are converted one by one.
    texture : callable, optional
        ``texture(file, distribution)`` converts a bitmap of α and returns the new file's name, or
        raises `MdfconvError`. If not given, BSDFs with such a bitmap are left with a problem.

    Returns
    -------
    MitsubaConversion
        The scene and what there is to say about it.

    Raises
    ------
    MdfconvError
        If the target or the metric is not known, or the file is not XML that can be read: not
        well-formed, not in UTF-8, with declared entities, or nested more than 1000 levels deep.
    """
    target = check_target(target)
    metric = metric_named(metric)
    scene = read_scene(data)
    pending = [bsdf for bsdf in scene.bsdfs if not bsdf.problem and bsdf.distribution != target]
    numbers = _grouped((bsdf.source, bsdf.numbers) for bsdf in pending)
    tables = {
        source: _Numbers(source, values, target, metric).table()
        for source, values in numbers.items()
    }
    for bsdf in pending:
        bsdf.problem = _number_problem(bsdf, tables[bsdf.source], target)
    leave_what_others_use(scene, pending)
    bitmaps = _convert_bitmaps(scene, pending, texture)
    # What shares something with a BSDF whose bitmap cannot be converted.
    leave_what_others_use(scene, pending)
    edits = XmlEdits(data)
    materials: list[MitsubaMaterial] = []
    textures: dict[Element, MitsubaTexture] = {}
    for bsdf in scene.bsdfs:
        if bsdf.problem:
            continue
        if bsdf.distribution == target:
            materials.append(_left(bsdf, target))
            continue
        materials.append(_converted(bsdf, tables[bsdf.source]))
        _edit(edits, bsdf, target, _axes(materials[-1].result))
        for holder in bsdf.textures:
            textures[holder] = bitmaps[holder]
            file = attribute_text(bitmaps[holder].result)
            edits.set_value(bitmap_file(holder, scene.version), file)
    return MitsubaConversion(
        data=edits.result(),
        materials=tuple(materials),
        textures=tuple(textures.values()),
        named=scene.named,
        includes=tuple((each.line, each.attributes.get("filename", "")) for each in scene.includes),
        problems=tuple(
            MaterialProblem(bsdf.element.line, bsdf.problem) for bsdf in scene.bsdfs if bsdf.problem
        ),
    )


def check_target(name: str) -> str:
    """Return the name of a target distribution; raise `MdfconvError` if Mitsuba 3 has none such."""
    target = distribution(name).name
    if target not in TARGETS:
        raise MdfconvError(
            f"a scene is not converted to '{name}': Mitsuba knows {' and '.join(TARGETS)} "
            "(0.6 also phong and as)"
        )
    return target


def unchanged_errors(
    materials: Sequence[MitsubaMaterial], target: str, metric: Metric
) -> list[float]:
    """Return the error that the target has where the α of converted materials is kept as it was.

    As `MitsubaMaterial.rmse`; NaN also where the target has no such α.
    """
    numbers = _grouped((each.distribution, _axes(each.value)) for each in materials)
    tables = {
        name: _Numbers(DISTRIBUTIONS[name], values, target, metric).unchanged_errors()
        for name, values in numbers.items()
        if name != target
    }
    return [
        0.0
        if each.distribution == target
        else _worst([tables[each.distribution].get(x, math.nan) for x in _axes(each.value)])
        for each in materials
    ]


def _grouped(numbers: Iterable[tuple[str, Sequence[float]]]) -> dict[str, set[float]]:
    """Return all numbers by the names that stand before them; without NaN, that of a texture."""
    groups: dict[str, set[float]] = {}
    for name, values in numbers:
        groups.setdefault(name, set()).update(x for x in values if not math.isnan(x))
    return groups


class _Numbers:
    """The numbers that a scene has for one distribution.

    Their errors are taken over the parameters, whatever the scene has in their place.
    """

    def __init__(self, source: str, numbers: Iterable[float], target: str, metric: Metric) -> None:
        self._source = endpoint(source)
        stored = np.array(sorted(numbers), dtype=np.float64)
        parameter = self._source.decode_legal(stored)
        legal = ~np.isnan(parameter)
        self._stored, self._parameter = stored[legal].tolist(), parameter[legal]
        parameters = replace(self._source, encoding=None)
        self._convert = StoredConverter(parameters, endpoint(target), metric, uniform_below=0)

    def table(self) -> dict[float, ConvertedNumber]:
        """Return what becomes of the legal ones."""
        table = self._convert.table(self._parameter)
        parameters = self._parameter.tolist()
        return {x: table[p] for x, p in zip(self._stored, parameters, strict=True)}

    def unchanged_errors(self) -> dict[float, float]:
        """Return the errors that are left if the target has the same α."""

        def errors(parameter: Array) -> Array:
            return self._convert.remaining(parameter, self._source.encode(parameter))

        rmse = errors_of_many(errors, self._parameter)
        return dict(zip(self._stored, rmse.tolist(), strict=True))


def _number_problem(bsdf: Bsdf, table: Mapping[float, ConvertedNumber], target: str) -> str:
    """Return why a number of a BSDF is not converted, "" if it is."""
    if bsdf.source == PHONG_EXPONENT:
        return _phong_problem(bsdf, table, target)
    for value in bsdf.numbers:
        number = table.get(value)
        if number is None or number.outcome is not Outcome.CONVERTED:
            what = f"alpha {value:g} of {bsdf.distribution}"
            if value == 0:
                return f"{what} is a mirror"
            return (
                f"{what} is out of range" if number is None else f"{what} has no answer in {target}"
            )
    return ""


def _phong_problem(bsdf: Bsdf, table: Mapping[float, ConvertedNumber], target: str) -> str:
    problem = "the BSDF phong has no microfacets"
    for exponent in bsdf.numbers:
        number = table.get(exponent)
        if number and number.outcome is Outcome.CONVERTED:
            alpha = f"{number.result:.6g}"
            problem += f"; exponent {exponent:g} is nearest to {target} with alpha {alpha}"
    return problem


def _convert_bitmaps(
    scene: MitsubaScene, pending: Sequence[Bsdf], convert: TextureConversion | None
) -> dict[Element, MitsubaTexture]:
    """Convert textures, by their elements; give a problem to BSDFs whose cannot be converted."""
    bitmaps: dict[Element, MitsubaTexture] = {}
    for bsdf in pending:
        if bsdf.problem:
            continue
        for holder in bsdf.textures:
            if holder in bitmaps:
                continue
            try:
                place = bitmap_file(holder, scene.version)
                file = place.attributes["value"]
                if convert is None:
                    raise MdfconvError(f"alpha is the texture {file}")
                name = convert(file, bsdf.source)
                bitmaps[holder] = MitsubaTexture(file, name, bsdf.distribution, place.line)
            except MdfconvError as error:
                bsdf.problem = str(error)
                break
    return bitmaps


def _left(bsdf: Bsdf, target: str) -> MitsubaMaterial:
    """Return a BSDF that has the target's distribution already."""
    value = _value([each.value for each in bsdf.roughness])
    notes = [f"{target} already"]
    notes += ["default α" for each in bsdf.roughness if each.holder is None]
    return MitsubaMaterial(bsdf.name, bsdf.element.line, target, value, value, 0.0, tuple(notes))


def _converted(bsdf: Bsdf, table: Mapping[float, ConvertedNumber]) -> MitsubaMaterial:
    values = [each.value for each in bsdf.roughness]
    # Textures have no number.
    results = [table[x].result if x in table else math.nan for x in values]
    rmse = _worst([table[x].rmse if x in table else math.nan for x in values])
    notes = []
    for each in bsdf.roughness:
        if each.parameter:
            notes.append(f"parameter {each.parameter}: convert what -D gives it, too")
        elif each.holder is None:
            notes.append("default α")
    return MitsubaMaterial(
        bsdf.name,
        bsdf.element.line,
        bsdf.distribution,
        _value(values),
        _value(results),
        rmse,
        tuple(dict.fromkeys(notes)),
    )


def _edit(edits: XmlEdits, bsdf: Bsdf, target: str, results: Sequence[float]) -> None:
    """Give a BSDF the target's distribution, and new numbers for its α; NaN of a texture."""
    new: list[tuple[str, dict[str, str]]] = []
    if bsdf.named_by is not None:
        edits.set_value(bsdf.named_by, target.encode())
    elif target != DEFAULT_DISTRIBUTION:
        new.append(("string", {"name": "distribution", "value": target}))
    for each, result in zip(bsdf.roughness, results, strict=True):
        number = f"{result:.{_DIGITS}g}"
        if each.holder is None:
            if result != DEFAULT_ALPHA:
                new.append(("float", {"name": "alpha", "value": number}))
        elif not each.textured:
            edits.set_value(each.holder, number.encode())
    if new:
        edits.add_children(bsdf.element, new)


def _worst(errors: Sequence[float]) -> float:
    """Return the largest error; NaN if one is not known."""
    return math.nan if any(map(math.isnan, errors)) else max(errors)


def _axes(value: Value) -> tuple[float, ...]:
    return value if isinstance(value, tuple) else (value,)


def _value(axes: Sequence[float]) -> Value:
    return tuple(axes) if len(axes) > 1 else axes[0]
