"""The numbers of Mitsuba's distributions: converted, with the errors that remain, many at once."""

from __future__ import annotations

import gc
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from mdfconv.conversion.explanation import remaining_error
from mdfconv.conversion.methods import default_method
from mdfconv.distributions import distribution
from mdfconv.distributions.endpoint import Endpoint, endpoints
from mdfconv.distributions.evaluation import Array
from mdfconv.errors import MdfconvError
from mdfconv.fitting.metrics import Metric, metric_named
from mdfconv.fitting.solve import errors_of_many
from mdfconv.scene.material_files import FileConversion
from mdfconv.scene.mitsuba.scene import (
    DISTRIBUTIONS,
    PHONG_EXPONENT,
    TARGETS,
    Bsdf,
    MitsubaScene,
    SceneEdits,
    bitmap_file,
    leave_what_others_use,
    read_scene,
)
from mdfconv.scene.mitsuba.xml_edit import Element
from mdfconv.scene.stored import MaterialProblem

# From parameters of the source to those of the target, NaN where there are none.
_Rule = Callable[[Array], Array]


@dataclass(frozen=True)
class ValueTable:
    """What becomes of the numbers that a scene has for one distribution.

    Parameters
    ----------
    legal : frozenset of float
        Those in the distribution's range.
    result, rmse : dict of float to float
        α of the target, and the error that remains, for those that have an answer.
    """

    legal: frozenset[float]
    result: dict[float, float]
    rmse: dict[float, float]


def converted_values(
    numbers: Iterable[float], source: str, target: str, metric: Metric
) -> ValueTable:
    """Convert the numbers of a distribution by the fit under a metric.

    Parameters
    ----------
    numbers : iterable of float
        Each once; those that are illegal have no result.
    source, target : str
        As for `mdfconv.convert`, of two lobes that are not the same; the target without an
        encoding.
    metric : Metric
        What the fit keeps.

    Returns
    -------
    ValueTable
        The results and their errors.
    """
    ends = endpoints(source, target)
    pair = ends[0].distribution, ends[1].distribution
    method = default_method(*pair)
    return _table(numbers, *ends, metric, lambda x: method.convert(x, *pair, metric))


def kept_values(numbers: Iterable[float], source: str, target: str, metric: Metric) -> ValueTable:
    """Take the numbers of one distribution for those of another, as `converted_values`."""
    ends = endpoints(source, target)
    return _table(numbers, *ends, metric, ends[0].encode)


def _table(
    numbers: Iterable[float], source: Endpoint, target: Endpoint, metric: Metric, rule: _Rule
) -> ValueTable:
    values = np.array(sorted(numbers), dtype=np.float64)
    with np.errstate(all="ignore"):
        parameter = source.decode_legal(values)
    legal = ~np.isnan(parameter)
    result = np.full_like(values, np.nan)
    result[legal] = _answers(rule, parameter[legal], target)

    def errors(parameter: Array) -> Array:
        answers = _answers(rule, parameter, target)
        found, known = np.full_like(parameter, np.nan), ~np.isnan(answers)
        pair = source.distribution, target.distribution
        found[known], _ = remaining_error(
            pair[0], parameter[known], pair[1], answers[known], metric
        )
        return found

    answered = ~np.isnan(result)
    keys, found = values[answered].tolist(), result[answered].tolist()
    rmse = errors_of_many(errors, parameter[answered]).tolist()
    return ValueTable(
        frozenset(values[legal].tolist()),
        dict(zip(keys, found, strict=True)),
        dict(zip(keys, rmse, strict=True)),
    )


def _answers(rule: _Rule, parameter: Array, target: Endpoint) -> Array:
    with np.errstate(all="ignore"):
        result = rule(parameter)
    return np.where(target.distribution.parameter.accepts(result), result, np.nan)


# From the file of a texture and what its texels are, such as "beckmann", to the name of another.
TextureConversion = Callable[[str, str], str]
Value = float | tuple[float, float]


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
    wanted = check_target(target)
    kept = metric_named(metric)
    with _many_objects():
        return _conversion(data, wanted, kept, texture)


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


def _conversion(
    data: bytes, target: str, metric: Metric, texture: TextureConversion | None
) -> MitsubaConversion:
    scene = read_scene(data)
    tables = _tables(scene, target, metric)
    for bsdf in scene.bsdfs:
        bsdf.problem = bsdf.problem or _number_problem(bsdf, tables, target)
    leave_what_others_use(scene, target)
    bitmaps = _convert_bitmaps(scene, target, texture)
    # What shares something with a BSDF whose bitmap cannot be converted.
    leave_what_others_use(scene, target)
    edits = SceneEdits(data, target)
    materials, textures = [], {}
    for bsdf in scene.bsdfs:
        if bsdf.problem:
            continue
        material = _material(bsdf, scene.lines(bsdf.element.start), tables, target)
        materials.append(material)
        if bsdf.distribution != target:
            edits.convert(bsdf, _axes(material.result))
            for each in [bitmaps[x.holder] for x in bsdf.roughness if x.holder in bitmaps]:
                edits.set_file(each.place, each.texture.result)
                textures[each.place] = each.texture
    return MitsubaConversion(
        data=edits.result(),
        materials=tuple(materials),
        textures=tuple(textures.values()),
        named=scene.named,
        includes=tuple(
            (scene.lines(each.start), each.attributes.get("filename", ""))
            for each in scene.includes
        ),
        problems=tuple(
            MaterialProblem(scene.lines(bsdf.element.start), bsdf.problem)
            for bsdf in scene.bsdfs
            if bsdf.problem
        ),
    )


def check_target(name: str) -> str:
    """Return the name of a target distribution; raise `MdfconvError` if Mitsuba 3 has none such."""
    wanted = distribution(name).name
    if wanted not in TARGETS:
        raise MdfconvError(
            f"a scene is not converted to '{name}': Mitsuba knows {' and '.join(TARGETS)} "
            "(0.6 also phong and as)"
        )
    return wanted


def _tables(scene: MitsubaScene, target: str, metric: Metric) -> dict[str, ValueTable]:
    """Return what becomes of numbers by what they are, such as ``"beckmann"``."""
    numbers: dict[str, set[float]] = {}
    for bsdf in scene.bsdfs:
        if not bsdf.problem and bsdf.distribution != target:
            values = {each.value for each in bsdf.roughness if not math.isnan(each.value)}
            numbers.setdefault(bsdf.source, set()).update(values)
    return {
        source: converted_values(values, source, target, metric)
        for source, values in numbers.items()
    }


def _number_problem(bsdf: Bsdf, tables: dict[str, ValueTable], target: str) -> str:
    """Return why a number of a BSDF is not converted, "" if it is."""
    if bsdf.distribution == target:
        return ""
    table = tables[bsdf.source]
    values = [each.value for each in bsdf.roughness if not math.isnan(each.value)]
    if bsdf.source == PHONG_EXPONENT:
        return _phong_problem(values, table, target)
    for value in values:
        if value in table.result:
            continue
        what = f"alpha {value:g} of {bsdf.distribution}"
        if value == 0:
            return f"{what} is a mirror"
        if value not in table.legal:
            return f"{what} is out of range"
        return f"{what} has no answer in {target}"
    return ""


def _phong_problem(values: list[float], table: ValueTable, target: str) -> str:
    problem = "the BSDF phong has no microfacets"
    for exponent in values:
        alpha = table.result.get(exponent)
        if alpha is not None:
            problem += f"; exponent {exponent:g} is nearest to {target} with alpha {alpha:.6g}"
    return problem


@dataclass(frozen=True)
class _Bitmap:
    """A converted texture, and the property that is to name its file."""

    place: Element
    texture: MitsubaTexture


def _convert_bitmaps(
    scene: MitsubaScene, target: str, convert: TextureConversion | None
) -> dict[Element | None, _Bitmap]:
    """Convert textures, by their elements; give a problem to BSDFs whose cannot be converted."""
    found: dict[Element | None, _Bitmap] = {}
    for bsdf in scene.bsdfs:
        if bsdf.problem or bsdf.distribution == target:
            continue
        for each in bsdf.roughness:
            if each.holder is None or not each.textured or each.holder in found:
                continue
            try:
                place = bitmap_file(each.holder, scene.version)
                file = place.attributes["value"]
                if convert is None:
                    raise MdfconvError(f"alpha is the texture {file}")
                texture = MitsubaTexture(
                    file, convert(file, bsdf.source), bsdf.distribution, scene.lines(place.start)
                )
                found[each.holder] = _Bitmap(place, texture)
            except MdfconvError as error:
                bsdf.problem = str(error)
                break
    return found


def _material(bsdf: Bsdf, line: int, tables: dict[str, ValueTable], target: str) -> MitsubaMaterial:
    values = [each.value for each in bsdf.roughness]
    results, rmse, notes = values, 0.0, []
    if bsdf.distribution == target:
        notes = [f"{target} already"]
    else:
        table = tables[bsdf.source]
        results = [table.result.get(value, math.nan) for value in values]
        rmse = _worst(table, values)
    for each in bsdf.roughness:
        if each.parameter and results is not values:
            notes.append(f"parameter {each.parameter}: convert what -D gives it, too")
        elif each.holder is None:
            notes.append("default α")
    return MitsubaMaterial(
        bsdf.name,
        line,
        bsdf.distribution,
        _value(values),
        _value(results),
        rmse,
        tuple(dict.fromkeys(notes)) if notes else (),
    )


def _worst(table: ValueTable, values: list[float]) -> float:
    """Return the largest error; NaN if one is not known."""
    errors = [table.rmse.get(value, math.nan) for value in values]
    if len(errors) == 1:
        return errors[0]
    return math.nan if any(map(math.isnan, errors)) else max(errors)


def _axes(value: Value) -> list[float]:
    return list(value) if isinstance(value, tuple) else [value]


def _value(axes: list[float]) -> Value:
    return (axes[0], axes[1]) if len(axes) > 1 else axes[0]


def unchanged_errors(
    materials: Sequence[MitsubaMaterial], target: str, metric: Metric
) -> list[float]:
    """Return the error that the target has where α is kept as it was.

    Parameters
    ----------
    materials : sequence of MitsubaMaterial
        Those of a converted scene.
    target : str
        The distribution that they have now.
    metric : Metric
        Under which the error is taken.

    Returns
    -------
    list of float
        As `MitsubaMaterial.rmse`; NaN also where the target has no such α.
    """
    numbers: dict[str, set[float]] = {}
    for each in materials:
        values = {value for value in _axes(each.value) if not math.isnan(value)}
        numbers.setdefault(each.distribution, set()).update(values)
    tables = {
        name: kept_values(values, DISTRIBUTIONS[name], target, metric)
        for name, values in numbers.items()
        if name != target
    }
    return [
        0.0 if each.distribution == target else _worst(tables[each.distribution], _axes(each.value))
        for each in materials
    ]
