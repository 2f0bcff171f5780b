"""The repair of a glTF document: factors, textures and keyframes, and what is left of them."""

from __future__ import annotations

import json
import warnings
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import inf, isclose
from operator import attrgetter
from pathlib import Path
from typing import TypeAlias

import numpy as np

from mdfconv.conversion.values import Converted
from mdfconv.distributions.endpoint import Endpoint, texels_of
from mdfconv.distributions.parameter import number_text
from mdfconv.errors import MdfconvError, MdfconvWarning
from mdfconv.fitting.metrics import Metric
from mdfconv.scene.gltf.animations import KeyframeConversion
from mdfconv.scene.gltf.buffers import GltfBuffers
from mdfconv.scene.gltf.document import METALLIC_ROUGHNESS, GltfDocument
from mdfconv.scene.gltf.elsewhere import (
    RoughnessTrack,
    StrayRoughness,
    roughness_tracks,
    stray_roughnesses,
)
from mdfconv.scene.gltf.ends import GLOSSINESS, SPECULAR, MaterialEnds
from mdfconv.scene.gltf.images import GltfTextures
from mdfconv.scene.gltf.textures import TextureConversion
from mdfconv.scene.stored import (
    ConvertedNumber,
    MaterialProblem,
    Outcome,
    ProblemKind,
    StoredConverter,
)
from mdfconv.scene.texture.rule import TextureRule

_LIMITS = {Outcome.UNIFORM: "a uniform lobe", Outcome.MIRROR: "a mirror"}
# Digits enough that an exponent comes back from a roughness to six.
_DIGITS = 8
_SAME = 0.5e-8
# From a warning up to who called `convert_gltf`.
_USER = 5
_KINDS = {
    "textures": ProblemKind.TEXTURE, "lossy": ProblemKind.LOSSY, "texels": ProblemKind.TEXELS,
    "specular": ProblemKind.SPECULAR,
}  # fmt: skip

# What is to be known of a file, and which option would change it.
Remark: TypeAlias = tuple[str, ProblemKind]


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
        The factor before, 1 where there was none, and after. Where a glossiness moves it is that
        of the glossiness, and then that of the roughness.
    rmse : float
        The error that the conversion leaves: the relative root mean square of `explain`. NaN for
        a uniform lobe and for a texture.
    parameter : float
        What the program meant by the value, such as an exponent; NaN for a mirror and for a
        texture.
    specular : float
        The weight of its specular lobe, if it says it and the rule depends on it; else NaN.
    notes : tuple of str
        What a careful user must know.
    """

    name: str
    index: int
    value: float
    result: float
    rmse: float
    parameter: float
    specular: float
    notes: tuple[str, ...] = ()


class Repair:
    """The conversion of a document, which is changed."""

    def __init__(
        self,
        document: GltfDocument,
        ends: MaterialEnds,
        metric: Metric,
        textures: GltfTextures | None,
        texels: str | Endpoint,
        folder: Path | None,
    ) -> None:
        self._document, self._ends, self._metric = document, ends, metric
        self._textures, self._texels = textures, texels
        if texels:
            TextureRule(texels, ends.pair[1]).endpoints()
        self._read, self._written = ends.fields
        self._moves = self._read is not self._written
        # By the places of materials.
        self._factors: dict[int, float] = {}
        self._weights: dict[int, float | None] = {}
        self._converters: dict[float | None, StoredConverter] = {}
        self.buffers = GltfBuffers(document, textures.source if textures else folder)
        self.files: Mapping[Path, bytes] = {}
        self.remarks: list[Remark] = []
        # With what they are sorted by: the places of materials, and the rest last.
        self.problems: list[tuple[float, MaterialProblem]] = []

    def convert(self) -> list[GltfMaterial]:
        """Convert everything; return the rows of what was converted."""
        self._read_materials()
        textured = {
            at
            for at, factor in self._factors.items()
            if factor and self._document.texture_of(at, self._read)
        }
        tracks = [] if self._ends.changes_nothing else roughness_tracks(self._document.animations)
        own = [track for track in tracks if track.member == self._read.pointer]
        rows = self._convert_textures(textured, {track.material for track in own})
        plain = self._factors.keys() - textured
        staying = [] if self._moves else own
        keyframes = [track for track in staying if track.material in plain]
        rows += self._convert_numbers(plain, self._convert_keyframes(keyframes))
        # Those before texels that stay are right.
        done = plain | {row.index for row in rows if row.index in textured}
        settled = {track for track in staying if track.material in done}
        self._report_tracks(track for track in tracks if track not in settled)
        self._report_strays()
        if self._moves and rows:
            text = f"viewers that know {self._read.name} still use it, and its values stay"
            self.remarks.append((text, ProblemKind.OTHER))
        return sorted(rows, key=attrgetter("index"))

    def mark(self) -> None:
        """Mark the document as converted."""
        labels = zip(("from", "to"), self._ends.pair, strict=True)
        try:
            self._document.set_mark({name: json.dumps(end.label) for name, end in labels})
        except MdfconvError as error:
            self._add_problem(inf, str(error), place="asset")

    def _add_error(self, at: int, error: MdfconvError) -> None:
        kind = _KINDS.get(error.argument, ProblemKind.OTHER)
        self._add_problem(at, str(error), kind)

    def _add_problem(
        self, at: float, text: str, kind: ProblemKind = ProblemKind.OTHER, place: str = ""
    ) -> None:
        self.problems.append((at, MaterialProblem(place or f"materials[{at}]", text, kind)))

    def _read_materials(self) -> None:
        """Find the factors, and the weights for rules that depend on them."""
        for at, material in enumerate(self._document.materials):
            try:
                factor = self._read.factor_of(material)
                if self._moves:
                    self._written.factor_of(material)
                if factor is None and self._read is not METALLIC_ROUGHNESS:
                    continue
                weight = self._ends.weight_of(material)
                self._ends.of_weight(weight)
            except MdfconvError as error:
                self._add_error(at, error)
            else:
                self._factors[at] = 1.0 if factor is None else factor
                self._weights[at] = weight

    def _converter(self, at: int) -> StoredConverter:
        """Return what converts the numbers of a material."""
        weight = self._weights[at]
        if weight not in self._converters:
            pair = self._ends.of_weight(weight)
            self._converters[weight] = StoredConverter(*pair, self._metric, largest=1)
        return self._converters[weight]

    def _row(
        self, at: int, result: float, rmse: float, parameter: float, *notes: str
    ) -> GltfMaterial:
        name, factor, weight = self._document.name(at), self._factors[at], self._weights[at]
        specular = np.nan if weight is None else weight
        return GltfMaterial(name, at, factor, result, rmse, parameter, specular, notes)

    def _convert_textures(self, textured: set[int], animated: set[int]) -> list[GltfMaterial]:
        """Convert the textures of materials; return the rows of those that were."""
        rows: list[GltfMaterial] = []
        rules: dict[int, TextureRule] = {}
        for at in sorted(textured):
            try:
                rule = self._texture_rule(at)
                read, written = (end.label for end in rule.endpoints())
                if read != written or self._moves:
                    self._check_texture(at, animated)
                    rules[at] = rule
                    continue
            except MdfconvError as error:
                self._add_error(at, error)
            else:
                note = f"the texels of its texture were taken for {read}, and stay"
                rows.append(self._row(at, rule.factor, np.nan, np.nan, note))
        if not (self._textures and rules):
            return rows
        fields = self._read, self._written
        changes = TextureConversion(self._document, self.buffers, self._textures, fields, rules)
        for at, (text, kind) in changes.problems.items():
            self._add_problem(at, text, kind)
        self.files = changes.files
        # The factor is in the texels.
        converted = [self._row(at, 1.0, np.nan, np.nan, *changes.notes[at]) for at in changes.notes]
        if not self._moves:
            self._set_factors(converted)
        return rows + converted

    def _texture_rule(self, at: int) -> TextureRule:
        """Return how the texture of a material is converted."""
        source, target = self._ends.of_weight(self._weights[at])
        texels = self._texels or texels_of(source)
        if not texels and self._textures:
            reason = f"what the texels of its texture are is not known of {source.label}"
            raise MdfconvError(reason, argument="texels")
        if not texels or texels == source.label:
            texels = source
        return TextureRule(texels, target, metric=str(self._metric), factor=self._factors[at])

    def _check_texture(self, at: int, animated: set[int]) -> None:
        """Refuse a texture that is not to be converted, or could not be without a loss."""
        if not self._textures:
            raise MdfconvError("has a roughness texture", argument="textures")
        if at in animated:
            raise MdfconvError(f"has keyframes of {self._read.factor}, which is before a texture")
        self._check_move(at)

    def _check_move(self, at: int) -> None:
        """Refuse a move to where a texture is already, which has a metalness, too."""
        if self._moves and self._document.texture_of(at, self._written):
            raise MdfconvError(f"has a {self._written.texture} beside its {self._read.factor}")

    def _convert_numbers(
        self, materials: set[int], keyframes: Mapping[int, list[str]]
    ) -> list[GltfMaterial]:
        """Convert the factors of materials; return the rows of those that were."""
        groups: defaultdict[float | None, list[int]] = defaultdict(list)
        for at in sorted(materials):
            groups[self._weights[at]].append(at)
        rows: list[GltfMaterial] = []
        for weight, group in groups.items():
            known = [] if weight is None else [f"L = {number_text(weight)} of {SPECULAR}"]
            factors = [self._factors[at] for at in group]
            numbers, reasons, notes = _numbers(factors, self._converter(group[0]))
            for at, factor in zip(group, factors, strict=True):
                number = numbers[factor]
                try:
                    if factor in reasons:
                        raise MdfconvError(reasons[factor])
                    self._check_move(at)
                    self._check_black(at, number.result)
                except MdfconvError as error:
                    self._add_error(at, error)
                    continue
                more = *notes.get(factor, ()), *known, *keyframes.get(at, ())
                rows.append(self._row(at, number.result, number.rmse, number.parameter, *more))
            converted = any(each.outcome is Outcome.CONVERTED for each in numbers.values())
            if converted and self._ends.is_assumed(weight):
                self.remarks.append((self._assumption(), ProblemKind.SPECULAR))
        self._set_factors(rows)
        return rows

    def _check_black(self, at: int, result: float) -> None:
        """Refuse to make what a factor of 0 has hidden seen: its texture."""
        hidden = not self._moves and self._document.texture_of(at, self._read)
        if hidden and result and not self._factors[at]:
            raise MdfconvError(
                f"{self._read.factor} 0 before a texture would be {number_text(result)}"
            )

    def _assumption(self) -> str:
        """Return what was assumed of the specular weight, in words."""
        rules = [form.formula for form in (self._ends.dialect,) if form]
        return (
            "the specular weight L, the luminance of Ks, is not in the file: it was taken for 1 in "
            f"{'; '.join(rules) or self._ends.pair[1].label}; give it where it is known"
        )

    def _set_factors(self, rows: Iterable[GltfMaterial]) -> None:
        """Write the factors of rows into the document, where they are not there."""
        for row in rows:
            before = row.value
            if self._moves:
                former = self._written.factor_of(self._document.materials[row.index])
                before = 1.0 if former is None else former
            if not isclose(before, row.result, rel_tol=_SAME):
                self._document.set_factor(row.index, self._written, f"{row.result:.{_DIGITS}g}")

    def _convert_keyframes(self, tracks: list[RoughnessTrack]) -> dict[int, list[str]]:
        """Convert keyframes; return notes on them by the places of materials."""
        notes: defaultdict[int, list[str]] = defaultdict(list)
        changes = KeyframeConversion(self._document, self.buffers, tracks, self._converter)
        self.buffers.finish()
        for track, count in changes.counts.items():
            notes[track.material].append(f"with {count} keyframes of {track.place}")
        for track, text in changes.problems.items():
            self._add_problem(inf, f"{track.text}, and is not converted: {text}", place=track.place)
        return notes

    def _report_tracks(self, tracks: Iterable[RoughnessTrack]) -> None:
        """Report the animations of roughness that stay as they are."""
        moved = {self._read.pointer, self._written.pointer} if self._moves else set()
        for track in tracks:
            outdated = track.member in moved and track.material in self._factors
            if outdated or not self._ends.is_native:
                self._add_problem(inf, f"{track.text}, and is not converted", place=track.place)

    def _report_strays(self) -> None:
        """Report the roughnesses of other layers, which stay as they are, if that is not right."""
        if self._ends.is_native:
            return
        strays = [
            (at, stray)
            for at, material in enumerate(self._document.materials)
            for stray in stray_roughnesses(material, self._read)
        ]
        for (at, stray), result in zip(strays, self._results(strays), strict=True):
            # What would be the same is right, such as 0 of a mirror.
            if not (stray.is_number and isclose(result, stray.value, rel_tol=_SAME)):
                named = f" ({GLOSSINESS} names it)" if stray.is_glossiness else ""
                place = f"materials[{at}].{stray.path}"
                self._add_problem(at, f"{stray.text} is not converted{named}", place=place)

    def _results(self, strays: Sequence[tuple[int, StrayRoughness]]) -> list[float]:
        """Return what numbers of roughness in materials would become, NaN for all else."""
        groups: defaultdict[float | None, list[int]] = defaultdict(list)
        for row, (at, stray) in enumerate(strays):
            if stray.is_number and at in self._weights:
                groups[self._weights[at]].append(row)
        results = np.full(len(strays), np.nan)
        for rows in groups.values():
            values = np.array([strays[row][1].value for row in rows], float)
            results[rows] = self._converter(strays[rows[0]][0])(values).result
        return results.tolist()


def _numbers(
    factors: Iterable[float], convert: StoredConverter
) -> tuple[dict[float, ConvertedNumber], dict[float, str], dict[float, tuple[str, ...]]]:
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
        warnings.warn("; ".join(sentences), MdfconvWarning, stacklevel=_USER)
    return numbers, reasons, notes
