"""glTF 2.0: the roughness of every material from what a program stored, every other byte kept."""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from dataclasses import dataclass
from math import isclose
from operator import attrgetter
from typing import Any

import numpy as np

from mdfconv.conversion.values import Converted
from mdfconv.distributions.dialects import DIALECTS, Dialect
from mdfconv.distributions.endpoint import Endpoint, endpoints
from mdfconv.distributions.parameter import number_text
from mdfconv.errors import MdfconvError, MdfconvWarning
from mdfconv.fitting.metrics import Metric, metric_named
from mdfconv.scene import stored
from mdfconv.scene.gltf.document import FACTOR, PBR, GltfDocument
from mdfconv.scene.gltf.images import GltfTextures
from mdfconv.scene.gltf.textures import TextureConversion
from mdfconv.scene.material_files import FileConversion
from mdfconv.scene.shininess import ROUGHNESS
from mdfconv.scene.stored import MaterialProblem, Outcome, ProblemKind

_LIMITS = {Outcome.UNIFORM: "a uniform lobe", Outcome.MIRROR: "a mirror"}
# Digits enough that an exponent comes back from a roughness to six.
_DIGITS = 8
_SAME = 0.5e-8


@dataclass(frozen=True)
class GltfMaterial:
    """One conversion of a material.

    Parameters
    ----------
    name : str
        Its name; "" if it has none.
    index : int
        Its place among the materials, from 0.
    value, result : float
        The roughness factor before, 1 where there was none, and after.
    rmse : float
        The error that the conversion leaves: the relative root mean square of `explain`. NaN for
        a uniform lobe and for a texture.
    parameter : float
        What the program meant by the value, such as an exponent; NaN for a mirror and for a
        texture.
    notes : tuple of str
        What a careful user must know.
    """

    name: str
    index: int
    value: float
    result: float
    rmse: float
    parameter: float
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class GltfConversion(FileConversion):
    """A converted glTF file; the places of its problems are such as ``materials[3]``.

    Parameters
    ----------
    materials : tuple of GltfMaterial
        What was converted, in the order of the file.
    generator : str
        What wrote the file; "" if it does not say.
    """

    materials: tuple[GltfMaterial, ...]
    generator: str


def convert_gltf(
    data: bytes,
    source: str | Endpoint,
    target: str | Endpoint = ROUGHNESS,
    *,
    metric: str | Metric = "environment",
    textures: GltfTextures | None = None,
) -> GltfConversion:
    """Convert the roughness of all materials of a glTF 2.0 file.

    Parameters
    ----------
    data : bytes
        A glTF or a GLB. What is not converted is kept: all other JSON byte by byte, and the
        chunks behind it.
    source, target : str or Endpoint
        What the numbers are, such as ``"blinn-phong:obj2gltf"``, and what they become: glTF
        defines ``"ggx:roughness"``, α = r².
    metric : str or Metric
        What the fit keeps.
    textures : GltfTextures, optional
        Where the file's textures are, if they are to be converted; materials with a texture of
        roughness are left as they are without.

    Returns
    -------
    GltfConversion
        The file and what there is to say about it.

    Raises
    ------
    MdfconvError
        If the file is no glTF 2.0, or a name or the metric is not known.
    """
    pair = factor_endpoints(source, target)
    metric = metric_named(metric)
    document = GltfDocument(data)
    factors, problems = _factors(document)
    textured = {at: factor for at, factor in factors.items() if factor and document.texture_of(at)}
    plain = {at: factor for at, factor in factors.items() if at not in textured}
    materials: list[GltfMaterial] = []
    changes = None
    if textures:
        changes = TextureConversion(document, textures, *pair, metric, textured)
        materials = [
            GltfMaterial(document.name(at), at, factors[at], 1.0, np.nan, np.nan, notes)
            for at, notes in changes.notes.items()
        ]
        problems |= changes.problems
    else:
        problems |= dict.fromkeys(textured, ("has a roughness texture", ProblemKind.TEXTURE))
    convert = stored.StoredConverter(*pair, metric, largest=1)
    numbers, reasons, notes = _numbers(plain.values(), convert)
    for at, factor in plain.items():
        if factor in reasons:
            problems[at] = reasons[factor], ProblemKind.OTHER
        else:
            _, parameter, result, _, rmse = numbers[factor]
            row = factor, result, rmse, parameter, notes.get(factor, ())
            materials.append(GltfMaterial(document.name(at), at, *row))
    for each in materials:
        if not isclose(each.value, each.result, rel_tol=_SAME):
            document.set_factor(each.index, f"{each.result:.{_DIGITS}g}")
    left = sorted(problems.items())
    return GltfConversion(
        data=document.encoded(),
        materials=tuple(sorted(materials, key=attrgetter("index"))),
        problems=tuple(MaterialProblem(f"materials[{at}]", *problem) for at, problem in left),
        files=changes.files if changes else {},
        inputs=changes.inputs if changes else (),
        generator=document.generator,
        named=document.named_files,
    )


def factor_endpoints(source: str | Endpoint, target: str | Endpoint) -> tuple[Endpoint, Endpoint]:
    """Return both ends of a conversion; refuse what is used beyond 1, as an exponent is."""
    pair = endpoints(source, target)
    for argument, end in zip(("source", "target"), pair, strict=True):
        if end.stored.typical[1] > 1:
            raise MdfconvError(
                f"a roughness factor is at most 1, {end.label} is more as a rule",
                "name what the program stores",
                argument=argument,
            )
    return pair


def _factors(document: GltfDocument) -> tuple[dict[int, float], dict[int, tuple[str, ProblemKind]]]:
    """Return the roughness factors by the places of their materials, and what is wrong."""
    factors: dict[int, float] = {}
    problems: dict[int, tuple[str, ProblemKind]] = {}
    for at, material in enumerate(document.materials):
        try:
            factors[at] = _factor(material)
        except MdfconvError as error:
            problems[at] = str(error), ProblemKind.OTHER
    return factors, problems


def _factor(material: Any) -> float:
    """Return the roughness factor of a material, 1 if it has none."""
    if not isinstance(material, dict):
        raise MdfconvError("is no object")
    pbr = material.get(PBR, {})
    if not isinstance(pbr, dict):
        raise MdfconvError(f"its {PBR} is no object")
    factor = pbr.get(FACTOR, 1)
    if not isinstance(factor, int | float) or isinstance(factor, bool) or factor != factor:
        raise MdfconvError(f"{FACTOR} is not a number")
    if not 0 <= factor <= 1:
        raise MdfconvError(f"{FACTOR} {factor!s:.20} is outside 0 ≤ r ≤ 1")
    return float(factor)


def _numbers(
    factors: Iterable[float], convert: stored.StoredConverter
) -> tuple[dict[float, stored.ConvertedNumber], dict[float, str], dict[float, tuple[str, ...]]]:
    """Return conversions of factors, why some have none, and what to know of mirrors and such."""
    numbers = convert.table(factors)
    reasons: dict[float, str] = {}
    notes: dict[float, tuple[str, ...]] = {}
    for factor, number in numbers.items():
        if number.outcome in _LIMITS:
            symbol = convert.source.stored.symbol
            text = f"{symbol} = {number_text(factor)} is {_LIMITS[number.outcome]}"
            notes[factor] = (f"{text}: {number_text(number.result)}",)
        elif number.outcome is not Outcome.CONVERTED:
            reasons[factor] = convert.refusal(number)
    converted = [each for each in numbers.values() if each.outcome is Outcome.CONVERTED]
    parameter, result = (np.array([each[at] for each in converted]) for at in (1, 2))
    results = Converted(parameter, result, convert.target.decode_legal(result))
    if sentences := convert.rule.true_cautions(results):
        warnings.warn("; ".join(sentences), MdfconvWarning, stacklevel=3)
    return numbers, reasons, notes


def generator_of(data: bytes) -> str:
    """Return what wrote a glTF file, as it says itself in ``asset.generator``; "" if nothing."""
    return GltfDocument(data).generator


def dialects_by_generator(generator: str) -> list[Dialect]:
    """Return the dialects of the programs that a generator may name."""
    text = generator.lower()
    return [each for each in DIALECTS if any(piece in text for piece in each.generators)]
