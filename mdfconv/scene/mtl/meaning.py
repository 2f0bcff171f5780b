"""What Ns means in a material library: who wrote it, and by which rule."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mdfconv.distributions.dialects import DIALECTS, Dialect, LibraryNumbers
from mdfconv.distributions.endpoint import Endpoint, dialect_of, endpoint, texels_of
from mdfconv.distributions.evaluation import Array, Mask
from mdfconv.distributions.parameter import Encoding, number_text
from mdfconv.errors import MdfconvError
from mdfconv.fitting.metrics import Metric
from mdfconv.scene.shininess import SHININESS, exponent_of, fit_error, roughness_of
from mdfconv.scene.stored import UNIFORM_BELOW

AUTO = "auto"
# What a texture of exponents holds, as a share of the largest.
TEXTURE_EXPONENT = f"{SHININESS}:exponent"
# Numbers have six decimals in libraries, and were single-precision before.
_LAST_DECIMAL, _SINGLE = 1e-6, 1e-7
_LARGEST = 1000.0


@dataclass(frozen=True)
class NsMeaning:
    """What Ns is.

    Parameters
    ----------
    end : Endpoint
        Blinn's exponent, or a dialect of it. Of a program that makes Ns from a roughness, Ns is
        the exponent of its rule; of any other, the number that it stores.
    writer : str
        The program that wrote the library, as in ``"Blender 3.3.1"``; "" where it is not known.
    why : str
        Why Ns is taken for that, in words.
    line : int
        The line that says so, counted from 1; 0 for none.
    """

    end: Endpoint
    writer: str
    why: str
    line: int = 0

    @cached_property
    def dialect(self) -> Dialect | None:
        """The dialect that it is; None of an exponent."""
        return dialect_of(self.end)

    @property
    def texels(self) -> str:
        """The endpoint that names what texels of ``map_Ns`` are; "" if it is not known."""
        return texels_of(self.end) if self.dialect else TEXTURE_EXPONENT

    @cached_property
    def _rule(self) -> tuple[Encoding, Callable[[Array], Array]] | None:
        """The encoding of what a program makes Ns from, and the roughness of that; None of others.

        The roughness of GGX is then known exactly.
        """
        encoding, dialect = self.end.encoding, self.dialect
        return (encoding, dialect.roughness) if encoding and dialect and dialect.roughness else None

    def accepts(self, numbers: Array) -> Mask:
        """Return which Ns the program writes, shape (n,)."""
        if not self._rule:
            zero = not self.dialect and numbers == 0
            legal: Mask = self.end.stored.accepts(numbers) | zero
            return legal
        encoding, _ = self._rule
        with np.errstate(all="ignore"):
            back = encoding.decode(encoding.encode(numbers))
        return np.isclose(back, numbers, rtol=1e-9, atol=1e-9)

    @property
    def legal(self) -> str:
        """The range of Ns in words."""
        if self.dialect is None:
            return "Ns ≥ 0"
        if not self._rule:
            return self.end.stored.legal
        encoding, _ = self._rule
        above = [f" ≤ {number_text(clamp.limit)}" for clamp in encoding.clamps if clamp.above]
        return f"0 ≤ Ns{above[0]}" if above else "Ns ≥ 0"

    def converted(self, numbers: Array, metric: Metric) -> tuple[Array, Array, Array]:
        """Return the exponents, NaN of a known roughness, the Pr and their errors, shape (n,)."""
        if self._rule:
            encoding, roughness_of_stored = self._rule
            roughness = np.clip(roughness_of_stored(encoding.encode(numbers)), 0, 1)
            return np.full_like(numbers, np.nan), roughness, np.zeros_like(numbers)
        exponent = self.end.encoding.decode(numbers) if self.end.encoding else numbers
        # A rounded number may be a little beside the exponent 0.
        exponent = np.where(exponent < UNIFORM_BELOW, 0, exponent)
        return exponent, roughness_of(exponent, metric), fit_error(exponent, metric)

    def of_roughness(self, roughness: Array, metric: Metric) -> tuple[Array, Array, Array]:
        """Return the Ns for each Pr, the exponents and their errors, as `converted` has them.

        NaN is what has none: a mirror of an exponent.
        """
        if self._rule:
            encoding, roughness_of_stored = self._rule
            # A roughness is stored as itself or as 1 − it: the way back is the same.
            with np.errstate(divide="ignore"):
                shininess = encoding.decode(roughness_of_stored(roughness))
            shininess = np.where(np.isfinite(shininess), shininess, np.nan)
            return shininess, np.full_like(roughness, np.nan), np.zeros_like(roughness)
        exponent = exponent_of(roughness, metric)
        shininess = self.end.encoding.encode(exponent) if self.end.encoding else exponent
        shininess = np.where(self.accepts(shininess) | (exponent == 0), shininess, np.nan)
        return shininess, exponent, fit_error(exponent, metric)


def is_of_libraries(dialect: Dialect) -> bool:
    """Return whether Ns can be what a dialect of Blinn's exponent says."""
    return dialect.roughness is not None or dialect.library is not None


def asked_meaning(name: str) -> NsMeaning:
    """Return what Ns is by a name such as ``"blinn-phong:blender-obj"``.

    Raises
    ------
    MdfconvError
        If it is not known, or does not say what Ns is.
    """
    end = endpoint(name)
    dialect = dialect_of(end)
    exponent = end.distribution.name == SHININESS
    if not exponent or (end.encoding and not (dialect and is_of_libraries(dialect))):
        known = ", ".join(
            f"{SHININESS}:{each.name}" for each in DIALECTS if each.library is not None
        )
        raise MdfconvError(
            f"Ns of a library is not stored as {end.label}",
            f"it is an exponent ({SHININESS}), or what a program made of one: {known}, …",
            argument="source",
        )
    return NsMeaning(end, "", f"as given, {_rule(end)}")


def likely_meaning(
    comments: Sequence[tuple[int, str]], numbers: Array, data: bytes = b""
) -> NsMeaning:
    """Return what Ns is by the comments of a library, with their lines, its numbers and lines."""
    for line, comment in comments:
        found = [
            (dialect, match)
            for dialect in DIALECTS
            if dialect.library
            and (match := re.match(dialect.library.header, comment))
            and _is_before(match, dialect.library)
            and not _is_excluded(dialect.library, data)
        ]
        if found:
            return _chosen(line, found, numbers)
    exponent = endpoint(SHININESS)
    return NsMeaning(exponent, "", "nothing says who wrote it: Ns is Blinn's exponent N")


def _chosen(line: int, found: list[tuple[Dialect, re.Match[str]]], numbers: Array) -> NsMeaning:
    """Return the meaning under which most numbers are such as authors set."""
    # What cannot be of a program was not written by it.
    possible = [each for each in found if _meaning_of(each[0]).accepts(numbers).all()]
    found = possible or found
    match = found[0][1]
    version = (match.groupdict().get("version") or "").strip(".")
    writer = f"{match['name']} {version}".strip()
    counts = [int(_usual(dialect, numbers).sum()) for dialect, _ in found]
    best = int(np.argmax(counts))
    dialect = found[best][0]
    end = endpoint(f"{dialect.owners[0]}:{dialect.name}")
    why = f"written by {writer}: {_rule(end)}"
    others = [
        other.name
        for (other, _), count in zip(found, counts, strict=True)
        if other is not dialect and count == counts[best] and _differs(dialect, other, numbers)
    ]
    if others:
        why += f"; its numbers may be those of {' or '.join(others)} instead"
    elif len(found) > 1 and numbers.size:
        why += ", as its numbers say"
        if counts[best] < numbers.size:
            why += f" ({counts[best]} of {numbers.size})"
    return NsMeaning(end, writer, why, line)


def _is_before(match: re.Match[str], library: LibraryNumbers) -> bool:
    """Return whether the version of a header is one that writes such numbers, or not given."""
    version = match.groupdict().get("version")
    if not version or not library.before:
        return True
    return tuple(int(part) for part in re.findall(r"\d+", version)) < library.before


def _is_excluded(library: LibraryNumbers, data: bytes) -> bool:
    """Return whether a library has a line that the program does not write."""
    never = library.never.encode()
    return bool(never) and re.search(rb"^\s*" + never, data, re.MULTILINE) is not None


def _usual(dialect: Dialect, numbers: Array) -> Mask:
    """Return which Ns a program writes for what authors set, shape (n,)."""
    assert dialect.library is not None
    read, write = dialect.encode, dialect.decode
    if dialect.roughness is None:
        read, write = write, read
    setting, step = dialect.setting_value(), dialect.library.step
    with np.errstate(all="ignore"):
        authored = step * np.rint(read(numbers, setting) / step)
        written = write(authored, setting)
    tolerance = _LAST_DECIMAL + _SINGLE * np.sqrt(_LARGEST * np.abs(numbers))
    usual: Mask = np.abs(written - numbers) <= tolerance
    return usual & _meaning_of(dialect).accepts(written)


def _meaning_of(dialect: Dialect) -> NsMeaning:
    return NsMeaning(endpoint(f"{SHININESS}:{dialect.example}"), "", "")


def _differs(one: Dialect, other: Dialect, numbers: Array) -> bool:
    """Return whether two rules say different things of the numbers."""
    if (one.roughness is None) != (other.roughness is None):
        return numbers.size > 0
    first, second = (each.encode(numbers, each.setting_value()) for each in (one, other))
    return not np.allclose(first, second)


def _rule(end: Endpoint) -> str:
    """Return what Ns is, as a formula where one is known."""
    dialect = dialect_of(end)
    if dialect is None:
        return "Ns is Blinn's exponent N"
    if dialect.library:
        return dialect.library.rule
    return f"{dialect.formula}, N is Ns"
