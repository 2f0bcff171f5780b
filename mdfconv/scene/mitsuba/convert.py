"""Mitsuba's scenes with another distribution: every number converted, every other byte kept."""

from __future__ import annotations

import gc
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np

from mdfconv.distributions import distribution
from mdfconv.distributions.endpoint import endpoint, one_parameter_endpoint
from mdfconv.distributions.evaluation import Array
from mdfconv.errors import MdfconvError
from mdfconv.fitting.metrics import Metric, metric_named
from mdfconv.fitting.solve import errors_of_many
from mdfconv.scene.material_files import FileConversion
from mdfconv.scene.mitsuba.scene import TARGETS, Bsdf, MitsubaScene, source_of
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
        The one it had, in Mitsuba's words, or what its α was taken for.
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
    source: str | None = None,
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
    source : str, optional
        What every α that the scene gives is, such as ``"ggx:roughness"``, whatever its
        distribution says: for exporters that store another number there. An α that is not given
        is Mitsuba's own. If not given, the distributions say it.
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
        If the target, the source or the metric is not known, or the file is not XML that can be
        read: not well-formed, not in UTF-8, with declared entities, or nested more than 1000
        levels deep.
    """
    target = check_target(target)
    metric = metric_named(metric)
    scene = MitsubaScene(data, one_parameter_endpoint(source).label if source else "")
    pending = [bsdf for bsdf in scene.bsdfs if not bsdf.problem and not bsdf.is_already(target)]
    numbers = _numbers(((bsdf.source, bsdf.numbers) for bsdf in pending), target, metric)
    tables = {name: each.table() for name, each in numbers.items()}
    for bsdf in pending:
        bsdf.problem = _number_problem(bsdf, numbers[bsdf.source], tables[bsdf.source], target)
    scene.leave_what_others_use(pending)
    bitmaps = _convert_bitmaps(scene, pending, texture)
    # What shares something with a BSDF whose bitmap cannot be converted.
    scene.leave_what_others_use(pending)
    edits = XmlEdits(data)
    materials: list[MitsubaMaterial] = []
    textures: dict[Element, MitsubaTexture] = {}
    for bsdf in [bsdf for bsdf in scene.bsdfs if not bsdf.problem]:
        # Those without a table have the target's distribution already.
        table = None if bsdf.is_already(target) else tables[bsdf.source]
        materials.append(_material(bsdf, table))
        if table is None:
            continue
        _edit(edits, bsdf, target, _axes(materials[-1].result))
        for holder in bsdf.textures:
            textures[holder] = bitmaps[holder]
            edits.set_value(scene.bitmap_file(holder), attribute_text(bitmaps[holder].result))
    left = [bsdf for bsdf in scene.bsdfs if bsdf.problem]
    return MitsubaConversion(
        data=edits.result(),
        materials=tuple(materials),
        textures=tuple(textures.values()),
        named=scene.named,
        includes=tuple((each.line, each.get("filename")) for each in scene.includes),
        problems=tuple(MaterialProblem(bsdf.element.line, bsdf.problem) for bsdf in left),
        notes=tuple(_notes(scene, source)),
    )


def _notes(scene: MitsubaScene, source: str | None) -> Iterator[tuple[int, str]]:
    """Yield what there is to know of a scene as a whole, with the lines."""
    taken = [bsdf for bsdf in scene.bsdfs if bsdf.taken_for and not bsdf.other_lobe]
    if taken and source:
        end = endpoint(source)
        rule = f" ({end.encoding.formula})" if end.encoding else ""
        yield (
            taken[0].element.line,
            f"alpha is taken for {end.label}{rule}, whatever the distribution says",
        )
    yield from ((element.line, text) for element, text in scene.right_already)


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
    changed = [each for each in materials if each.distribution != target]
    numbers = _numbers(((x.distribution, _axes(x.value)) for x in changed), target, metric)
    tables = {name: each.unchanged_errors() for name, each in numbers.items()}
    return [
        0.0
        if each.distribution == target
        else _worst([tables[each.distribution].get(x, math.nan) for x in _axes(each.value)])
        for each in materials
    ]


def _numbers(
    values: Iterable[tuple[str, Sequence[float]]], target: str, metric: Metric
) -> dict[str, _Numbers]:
    """Return all numbers of each distribution; NaN is that of a texture."""
    groups: dict[str, set[float]] = {}
    for name, numbers in values:
        groups.setdefault(name, set()).update(x for x in numbers if not math.isnan(x))
    return {name: _Numbers(name, numbers, target, metric) for name, numbers in groups.items()}


class _Numbers:
    """The numbers that a scene has for one distribution.

    Their errors are taken over the parameters, whatever the scene has in their place.
    """

    def __init__(self, source: str, numbers: Iterable[float], target: str, metric: Metric) -> None:
        self._source = endpoint(source_of(source))
        stored = np.array(sorted(numbers), dtype=np.float64)
        parameter = self._source.decode_legal(stored)
        legal = ~np.isnan(parameter)
        self._stored, self._parameter = stored[legal].tolist(), parameter[legal]
        parameters = replace(self._source, encoding=None)
        self._convert = StoredConverter(parameters, endpoint(target), metric, uniform_below=0)

    def refusal(self, value: float) -> str:
        """Return why a number that is not legal is not converted."""
        limits = self._source.stored
        for text, which in self._source.clamped(np.array([value])).items():
            if which.any():
                return f"has no inverse: {text}"
        smoothest = limits.upper if limits.larger_is_smoother else limits.lower
        return "is a mirror" if value == smoothest else "is out of range"

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


def _number_problem(
    bsdf: Bsdf, numbers: _Numbers, table: Mapping[float, ConvertedNumber], target: str
) -> str:
    """Return why a number of a BSDF is not converted, "" if it is."""
    nearest = bsdf.other_lobe
    for each in bsdf.roughness:
        if each.value is None:
            continue
        number = table.get(each.value)
        converted = number is not None and number.outcome is Outcome.CONVERTED
        if bsdf.other_lobe and converted:
            alpha = f"{table[each.value].result:.6g}"
            nearest += f"; {each.name} {each.value:g} is nearest to {target} with alpha {alpha}"
        elif not bsdf.other_lobe and not converted:
            why = f"has no counterpart in {target}" if number else numbers.refusal(each.value)
            return f"alpha {each.value:g} of {bsdf.meaning} {why}"
    return nearest


def _convert_bitmaps(
    scene: MitsubaScene, pending: Sequence[Bsdf], convert: TextureConversion | None
) -> dict[Element, MitsubaTexture]:
    """Convert textures, by their elements; give a problem to BSDFs whose cannot be converted."""
    bitmaps: dict[Element, MitsubaTexture] = {}
    for bsdf in [bsdf for bsdf in pending if not bsdf.problem]:
        try:
            for holder in (each for each in bsdf.textures if each not in bitmaps):
                place = scene.bitmap_file(holder)
                file = place.attributes["value"]
                if convert is None:
                    raise MdfconvError(f"alpha is the texture {file}")
                name = convert(file, bsdf.source)
                bitmaps[holder] = MitsubaTexture(file, name, bsdf.meaning, place.line)
        except MdfconvError as error:
            bsdf.problem = str(error)
    return bitmaps


def _material(bsdf: Bsdf, table: Mapping[float, ConvertedNumber] | None) -> MitsubaMaterial:
    """Return what a BSDF becomes; without a table it has the target's distribution already."""
    # Textures have no number.
    values = [math.nan if each.value is None else each.value for each in bsdf.roughness]
    if table is None:
        results, rmse, notes = values, 0.0, [f"{bsdf.distribution} already"]
    else:
        results = [table[x].result if x in table else math.nan for x in values]
        rmse = _worst([table[x].rmse if x in table else math.nan for x in values])
        parameters = [each.parameter for each in bsdf.roughness if each.parameter]
        notes = [f"parameter {x}: convert what -D gives it, too" for x in parameters]
    notes += ["default α" for each in bsdf.roughness if each.holder is None]
    place, pair = (bsdf.name, bsdf.element.line), (_value(values), _value(results))
    return MitsubaMaterial(*place, bsdf.meaning, *pair, rmse, tuple(dict.fromkeys(notes)))


def _edit(edits: XmlEdits, bsdf: Bsdf, target: str, results: Sequence[float]) -> None:
    """Give a BSDF the target's distribution, and new numbers for its α; NaN of a texture."""
    new: list[tuple[str, str, str]] = []
    if bsdf.distribution == target:
        pass  # its numbers were others
    elif bsdf.named_by is not None:
        edits.set_value(bsdf.named_by, target.encode())
    else:  # it is the default
        new.append(("string", "distribution", target))
    for each, result in zip(bsdf.roughness, results, strict=True):
        number = f"{result:.{_DIGITS}g}"
        if each.holder is None:
            # The default, which the target has, too.
            if result != each.value:
                new.append(("float", "alpha", number))
        elif not each.textured:
            edits.set_value(each.holder, number.encode())
    if new:
        edits.add_properties(bsdf.element, new)


def _worst(errors: Sequence[float]) -> float:
    """Return the largest error; NaN if one is not known."""
    return math.nan if any(map(math.isnan, errors)) else max(errors)


def _axes(value: Value) -> tuple[float, ...]:
    return value if isinstance(value, tuple) else (value,)


def _value(axes: Sequence[float]) -> Value:
    return tuple(axes) if len(axes) > 1 else axes[0]
