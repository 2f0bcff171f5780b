"""Keyframes of roughness (KHR_animation_pointer): converted as the factors that they overwrite."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from mdfconv.distributions.evaluation import Array
from mdfconv.errors import MdfconvError
from mdfconv.scene.gltf.buffers import GltfBuffers, index_of, is_count
from mdfconv.scene.gltf.document import GltfDocument
from mdfconv.scene.gltf.elsewhere import RoughnessTrack, all_channels
from mdfconv.scene.gltf.json_edit import JsonText, Place, object_text
from mdfconv.scene.stored import ConvertedNumber, Outcome, StoredConverter

# By componentType: how a number is stored, and what is 1 if it is normalized.
_COMPONENTS = {
    5120: ("<i1", 127), 5121: ("<u1", 255), 5122: ("<i2", 32767), 5123: ("<u2", 65535),
    5125: ("<u4", 2**32 - 1), 5126: ("<f4", 1),
}  # fmt: skip
_FLOAT = 5126
_CUBIC = "CUBICSPLINE"
# A keyframe of a cubic spline: the tangent before it, the value, the tangent behind it.
_PARTS = 3
# Of a stored number: the step over which the slope of a conversion is taken.
_STEP = 1e-5
_ANSWERED = (Outcome.CONVERTED, Outcome.MIRROR, Outcome.UNIFORM)
# What names an accessor, but for attributes, whose names are in capitals or start with _.
_USES = ("input", "output", "indices", "inverseBindMatrices")


class _Version(NamedTuple):
    """Keyframes that are converted in one way."""

    accessor: int
    cubic: bool
    converter: StoredConverter


class KeyframeConversion:
    """The conversion of the keyframes of some tracks.

    They are replaced where they stand if they are floats in the file itself that nothing else
    uses; else an accessor with new ones is added. Tangents of splines are multiplied by the slope
    of the conversion. The document is changed; `converter_of` returns what converts the numbers
    of a material, by its place.
    """

    def __init__(
        self,
        document: GltfDocument,
        buffers: GltfBuffers,
        tracks: Sequence[RoughnessTrack],
        converter_of: Callable[[int], StoredConverter],
    ) -> None:
        self._document, self._buffers = document, buffers
        self._accessors = document.array("accessors")
        self._samplers: dict[int, list[Place]] = {}
        self._added: Counter[int] = Counter()
        # How many keyframes each track has whose keyframes were converted, and why others are left.
        self.counts: dict[RoughnessTrack, int] = {}
        self.problems: dict[RoughnessTrack, str] = {}
        versions: defaultdict[_Version, list[RoughnessTrack]] = defaultdict(list)
        for track in tracks:
            try:
                sampler = self._sampler(track)
                output = index_of(sampler.get("output"), self._accessors, "accessor")
                cubic = sampler.get("interpolation") == _CUBIC
                versions[_Version(output, cubic, converter_of(track.material))].append(track)
            except MdfconvError as error:
                self.problems[track] = str(error)
        for version, same in versions.items():
            try:
                count = self._convert(version, same)
            except MdfconvError as error:
                self.problems |= dict.fromkeys(same, str(error))
            else:
                self.counts |= dict.fromkeys(same, count)

    def _sampler(self, track: RoughnessTrack) -> dict[str, Any]:
        if track.animation not in self._samplers:
            animation = self._document.array("animations")[track.animation]
            place = self._document.json.members(animation.start).get("samplers")
            is_list = place is not None and isinstance(place.value, list)
            elements = self._document.json.elements(place.start) if place and is_list else []
            self._samplers[track.animation] = elements
        samplers = self._samplers[track.animation]
        sampler: dict[str, Any] = samplers[index_of(track.sampler, samplers, "sampler")].value
        return sampler

    def _convert(self, version: _Version, tracks: list[RoughnessTrack]) -> int:
        """Convert what some tracks share; return the number of keyframes."""
        entry = self._accessors[version.accessor].value
        stored = self._values(entry)
        if version.cubic and stored.size % _PARTS:
            raise MdfconvError(f"accessors[{version.accessor}] has no three numbers a keyframe")
        parts = stored.reshape(-1, _PARTS if version.cubic else 1)
        values = parts[:, parts.shape[1] // 2]
        results = parts.copy()
        results[:, parts.shape[1] // 2] = _converted(values, version.converter)
        if version.cubic:
            results[:, ::2] *= _slopes(values, version.converter)[:, np.newaxis]
        floats = results.astype("<f4").ravel()
        if not np.array_equal(floats, stored):
            self._store(version.accessor, floats, tracks)
        return len(parts)

    def _values(self, entry: dict[str, Any]) -> Array:
        """Return the numbers of an accessor; refuse what is none of single numbers."""
        component, count = entry.get("componentType"), entry.get("count", -1)
        offset = entry.get("byteOffset", 0)
        counts = all(map(is_count, (component, count, offset)))
        if not counts or entry.get("type") != "SCALAR" or component not in _COMPONENTS:
            raise MdfconvError("its keyframes are no single numbers")
        if "sparse" in entry:
            raise MdfconvError("its keyframes are in a sparse accessor, which is not converted")
        content = self._buffers.from_view(entry.get("bufferView"))
        view = self._buffers.views[int(entry["bufferView"])].value
        if "extensions" in view or "byteStride" in view:
            raise MdfconvError("its keyframes are compressed or apart, which is not converted")
        kind, one = _COMPONENTS[component]
        end = offset + np.dtype(kind).itemsize * count
        if not 0 <= offset <= end <= len(content):
            raise MdfconvError("its keyframes are not within their buffer")
        numbers = np.frombuffer(content[int(offset) : int(end)], kind).astype(float)
        return np.maximum(numbers / one, -1) if entry.get("normalized") is True else numbers

    def _store(self, at: int, numbers: Array, tracks: list[RoughnessTrack]) -> None:
        """Put numbers in the place of an accessor's, or into one that is added for some tracks."""
        accessor = self._accessors[at]
        samplers = {(track.animation, track.sampler) for track in tracks}
        ours = {track[:2] for track in tracks}
        # Samplers that other channels share.
        shared = {
            (animation, entry["sampler"])
            for animation, channel, entry in all_channels(self._document.animations)
            if (animation, channel) not in ours and is_count(entry.get("sampler"))
        }
        limits = {"min": f"[{numbers.min()!s}]", "max": f"[{numbers.max()!s}]"}
        limits = {name: text for name, text in limits.items() if name in accessor.value}
        view = int(accessor.value["bufferView"])
        alone = not samplers & shared and self._uses(at) == len(samplers)
        if alone and accessor.value["componentType"] == _FLOAT and self._buffers.is_alone(view):
            self._buffers.patch(view, int(accessor.value.get("byteOffset", 0)), numbers.tobytes())
            self._document.json.set_members(accessor.start, limits)
            return
        members = {
            "bufferView": str(self._buffers.add_view(numbers.tobytes())),
            "componentType": str(_FLOAT),
            "count": str(numbers.size),
            "type": '"SCALAR"',
        }
        output = {"output": str(self._document.append("accessors", object_text(members | limits)))}
        for animation, sampler in sorted(samplers):
            place = self._samplers[animation][sampler]
            if (animation, sampler) in shared:
                copy = JsonText(self._document.json.text_of(place))
                copy.set_members(0, output)
                self._redirect(animation, sampler, copy.changed(), tracks)
            else:
                self._document.json.set_members(place.start, output)

    def _redirect(
        self, animation: int, former: int, sampler: str, tracks: list[RoughnessTrack]
    ) -> None:
        """Add a sampler to an animation, for those tracks of it that have had another one."""
        members = self._document.json.members(self._document.array("animations")[animation].start)
        index = len(self._samplers[animation]) + self._added[animation]
        self._added[animation] += 1
        self._document.json.append(members["samplers"].start, [sampler])
        channels = self._document.json.elements(members["channels"].start)
        for track in tracks:
            if (track.animation, track.sampler) == (animation, former):
                start = channels[track.channel].start
                self._document.json.set_members(start, {"sampler": str(index)})

    def _uses(self, accessor: int) -> int:
        """Return how often the document may name an accessor."""
        return sum(
            value == accessor
            for key, value in self._document.everything
            if is_count(value) and (key in _USES or key.isupper() or key.startswith("_"))
        )


def _converted(values: Array, converter: StoredConverter) -> Array:
    """Return what keyframes become; refuse them all if there is one that has no conversion."""
    parameter, result, outcome = converter(values)
    bad = np.flatnonzero(~np.isin(outcome, _ANSWERED))
    if bad.size:
        at = int(bad[0])
        row = float(values[at]), float(parameter[at]), float(result[at]), Outcome(outcome[at])
        reason = converter.refusal(ConvertedNumber(*row, np.nan))
        raise MdfconvError(f"keyframe {at}: {reason}")
    return result


def _slopes(values: Array, converter: StoredConverter) -> Array:
    """Return the slopes of a conversion, from one side at an end of what is converted."""
    middle = converter(values).result
    sides = []
    for step in (-_STEP, _STEP):
        near = np.clip(values + step, 0, 1)
        result = converter(near).result
        missing = np.isnan(result)
        sides.append((np.where(missing, values, near), np.where(missing, middle, result)))
    (low, below), (high, above) = sides
    return np.asarray((above - below) / (high - low))
