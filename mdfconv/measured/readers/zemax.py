"""Zemax's tabular BSDF, Radiant Imaging's BSDF Data Interchange format.

The scatter angles are polar coordinates about the specular direction: the radial angle from it,
and the azimuth about it, 0 towards the normal of the surface and counter-clockwise from there
("BSDF Data Interchange file format specification", Zemax knowledge base).
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from mdfconv.brdf import microfacet
from mdfconv.distributions.evaluation import Array
from mdfconv.errors import MdfconvError
from mdfconv.measured.readers.base import Reader, ReadOptions, Source, known_by, turn_from_normal
from mdfconv.measured.readers.tables import number
from mdfconv.measured.samples import DirectionalSamples, about_of, directional_samples

_KNOWN_BY = re.compile(r"^\s*AngleOfIncidence\s", re.M | re.I)
# Comments that only enclose others, as [BEGIN] and [END].
_BRACKET = re.compile(r"\[(begin|end)\]", re.I)
_WORDS = ("source", "symmetry", "spectralcontent", "scattertype")
# The axes of the values, of which the first may be missing.
_ANGLES = ("samplerotation", "angleofincidence", "scatterazimuth", "scatterradial")
_CHANNELS = {"monochrome": "value", "tristimulusx": "X", "tristimulusy": "Y", "tristimulusz": "Z"}


class _Words:
    """A place in a text that moves on from word to word."""

    def __init__(self, source: Source) -> None:
        self._source = source
        lines = source.lines()
        self._words = [
            (number, word)
            for number, line in enumerate(lines, start=1)
            if not line.lstrip().startswith("#")
            for word in line.split()
        ]
        comments = (line.strip(" \t#") for line in lines if line.lstrip().startswith("#"))
        self.about = about_of(comment for comment in comments if not _BRACKET.match(comment))
        self._at = 0

    def peek(self) -> str | None:
        """Return the next word without moving on; None at the end."""
        return self._words[self._at][1] if self._at < len(self._words) else None

    def next(self, what: str) -> str:
        """Return the next word; raise `MdfconvError` if the text ends before it."""
        word = self.peek()
        if word is None:
            raise self._source.error(f"truncated: it ends before {what}")
        self._at += 1
        return word

    def expect(self, word: str) -> None:
        """Pass over a word; raise `MdfconvError` if another one stands there."""
        actual = self.next(word)
        if actual.lower() != word.lower():
            raise self.error(f"'{actual[:30]}' where {word} goes")

    def count(self, what: str) -> int:
        """Return the next word as a count."""
        word = self.next(what)
        if not (word.isascii() and word.isdecimal() and len(word) < 10 and int(word) > 0):
            raise self.error(f"{what}: '{word[:30]}' is no count")
        return int(word)

    def numbers(self, count: int, what: str) -> Array:
        """Return the next numbers, shape (count,)."""
        if len(self._words) - self._at < count:
            raise self._source.error(f"truncated: it ends within {what}")
        word = ""
        try:
            return np.array([number(word := self.next(what)) for _ in range(count)])
        except ValueError:
            hint = "its decimal comma has to be a point" if "," in word else ""
            raise self.error(f"{what}: '{word[:30]}' is no number", hint) from None

    def error(self, reason: str, hint: str = "") -> MdfconvError:
        """Return an error about the word that was last read."""
        return self._source.error(reason, hint, line=self._words[max(self._at - 1, 0)][0])


def _read(source: Source, options: ReadOptions) -> DirectionalSamples:
    options.refuse(source.path, "the header of Zemax's format says what its numbers are")
    words = _Words(source)
    axes = _header(source, words)
    channels, tables = [], []
    while (word := words.peek()) is not None and word.lower() in _CHANNELS:
        channels.append(_CHANNELS[words.next("data").lower()])
        tables.append(_channel(words, [axis.size for axis in axes]))
    if not tables or words.peek() is not None:
        raise words.error(f"no data, or something else than data: {str(words.peek())[:30]}")
    return _samples(source.path, axes, np.stack(tables, axis=-1), channels, words.about)


def _header(source: Source, words: _Words) -> list[Array]:
    """Return the angles of each axis, radians, and move on to the data."""
    angles: dict[str, Array] = {}
    while (key := (words.peek() or "").lower()) not in _CHANNELS:
        words.next("the data")
        if key in _ANGLES:
            angles[key] = np.radians(words.numbers(words.count(key), key))
        elif key in _WORDS:
            value = words.next(key)
            if key == "scattertype" and value.upper() != "BRDF":
                raise words.error(f"ScatterType {value[:30]}: only BRDF, reflection, is read")
        else:
            raise words.error(f"'{key[:30]}' is no word of Zemax's header")
    missing = [key for key in _ANGLES[1:] if key not in angles]
    if missing:
        raise source.error(f"the header lacks {', '.join(missing)}")
    if not all(np.isfinite(values).all() for values in angles.values()):
        raise source.error("an angle of the header is not finite")
    return [angles.get(key, np.zeros(1)) for key in _ANGLES]


def _channel(words: _Words, shape: Sequence[int]) -> Array:
    """Return the values of one channel."""
    words.expect("DataBegin")
    blocks = []
    for _ in range(shape[0] * shape[1]):
        words.expect("TIS")
        words.numbers(1, "TIS")
        blocks.append(words.numbers(shape[2] * shape[3], "the values"))
    words.expect("DataEnd")
    return np.concatenate(blocks).reshape(shape)


def _samples(
    path: Path,
    axes: list[Array],
    values: Array,
    channels: Sequence[str],
    about: tuple[str, ...],
) -> DirectionalSamples:
    # At the specular direction all azimuths are one sample.
    is_sample = np.ones(values.shape[:-1], bool)
    is_sample[:, :, 1:, np.abs(axes[-1]) < 1e-9] = False
    measured = (values != 0).any(axis=-1)
    empty = int(np.count_nonzero(is_sample & ~measured))
    notes = (f"{empty} values of 0 are places without a measurement and left out",) if empty else ()
    rotation, incidence, azimuth, radial = (
        angle[is_sample & measured] for angle in np.meshgrid(*axes, indexing="ij")
    )
    # About the specular direction at azimuth 0, where x points away from the normal.
    scattered = microfacet.direction(radial, np.pi + azimuth)
    outgoing = turn_from_normal(scattered, incidence, rotation)
    view = microfacet.polar_angle(outgoing), microfacet.azimuth(outgoing)
    values = values[is_sample & measured]
    return directional_samples(
        path, incidence, np.pi + rotation, *view, values, tuple(channels), notes, about
    )


READER = Reader("Zemax", known_by(_KNOWN_BY), _read)
