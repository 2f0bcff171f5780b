"""What a reader of measurements is, what it is given, and what its user may choose."""

from __future__ import annotations

import mmap
import re
import struct
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from mdfconv.brdf.microfacet import azimuth, direction, mirrored, polar_angle
from mdfconv.distributions.evaluation import Array
from mdfconv.errors import MdfconvError
from mdfconv.measured.samples import DirectionalSamples, Measurements, directional_samples
from mdfconv.output.files import STANDARD_INPUT

# Laboratories write pages of comments before the words that a format is known by.
_HEAD_BYTES = 65536
_BYTE_ORDER_MARKS = {b"\xef\xbb\xbf": "utf-8-sig", b"\xff\xfe": "utf-16", b"\xfe\xff": "utf-16"}

# They are quoted in messages, which are one line and say nothing to a terminal.
_CONTROLS = dict.fromkeys(
    {*range(32), *range(127, 160), 0x2028, 0x2029} - {ord("\t"), ord("\n"), ord("\r"), ord("\f")},
    "\ufffd",
)
# What Python raises about bytes that are not what a reader takes them for.
_MALFORMED = (ArithmeticError, LookupError, StopIteration, ValueError, struct.error)


@dataclass(frozen=True)
class ReadOptions:
    """What the user says about a file; columns of a table by name or by number from 1.

    Parameters
    ----------
    angle : str or None
        The column of angles of a table of one angle; None to find it.
    theta_i, phi_i, theta_o, phi_o : str or None
        The columns of zenith and azimuth of the incident and the outgoing direction; None to
        find them by their names.
    values : tuple of str
        The columns of values; empty for all that are none of angles.
    uncertainty : tuple of str
        The columns of the standard uncertainties of the values, one for all channels or one for
        each; empty to find them by their names.
    unit : str or None
        ``"degrees"``, ``"radians"`` or ``"cosine"``; None to find it.
    angle_is : str or None
        Of a table of one angle: ``"half"``, the angle between normal and half vector;
        ``"reflected"`` or ``"incident"``, the zenith of that direction; ``"specular"``, the angle
        from the mirror direction in the plane of incidence, positive towards the horizon. None
        for what its name says, and half for the name of no direction.
    incidence : float or None
        Of a table with one direction: the zenith of the other one, degrees, [0, 90); None for
        what the comments say. With ``angle_is="incident"`` it is that of the outgoing direction.
    wavelength : float or None
        Of a table with a column of wavelengths: the one whose rows are read, nm; None for all,
        a channel each.
    values_are : str or None
        ``"brdf"``, which is what None takes them for, or ``"factor"``: reflectance factors π f_r.
    cells : int or None
        Of a MERL file: how many cells of the whole are taken; None for the slice θ_d ≈ 0.
    """

    angle: str | None = None
    theta_i: str | None = None
    phi_i: str | None = None
    theta_o: str | None = None
    phi_o: str | None = None
    values: tuple[str, ...] = ()
    uncertainty: tuple[str, ...] = ()
    unit: str | None = None
    angle_is: str | None = None
    incidence: float | None = None
    wavelength: float | None = None
    values_are: str | None = None
    cells: int | None = None

    @property
    def by_number(self) -> bool:
        """Whether columns are chosen, all of them by their numbers."""
        directions = self.theta_i, self.phi_i, self.theta_o, self.phi_o
        columns = self.angle, *directions, *self.values, *self.uncertainty
        chosen = [name for name in columns if name is not None]
        return bool(chosen) and all(name.isdecimal() for name in chosen)

    def refuse(self, path: Path, reason: str) -> None:
        """Raise if anything is chosen for a file that leaves no choice."""
        if replace(self, cells=None, values_are=None) != ReadOptions():
            raise MdfconvError(f"{path}: {reason}", "choose no columns and no unit or angle")


@dataclass(frozen=True)
class Source:
    """The bytes of a file or of standard input, and what messages call it."""

    path: Path
    content: bytes | mmap.mmap

    @property
    def head(self) -> bytes:
        """The first bytes, by which a reader knows its format."""
        return self.content[:_HEAD_BYTES]

    def error(self, reason: str, hint: str = "", *, line: int | None = None) -> MdfconvError:
        """Return an error about the file, or about one of its lines."""
        place = "" if line is None else f", line {line}"
        return MdfconvError(f"{self.path}{place}: {reason}", hint)

    def lines(self) -> list[str]:
        """Return its lines: UTF-8, or what its byte order mark says; no control characters.

        Raises `MdfconvError` if it is not text.
        """
        content = self.content[:]
        encoding = _encoding(content)
        try:
            return content.decode(encoding).translate(_CONTROLS).splitlines()
        except UnicodeDecodeError as error:
            name = "UTF-16" if encoding == "utf-16" else "UTF-8"
            reason = f"not {name} text (byte {error.start + 1})"
            raise self.error(reason, "convert its encoding first") from None


@dataclass(frozen=True)
class Reader:
    """A format.

    Parameters
    ----------
    name : str
        What the format is called.
    recognizes : callable
        Of the file's name and its first bytes: whether the file is of this format.
    read : callable
        Of a `Source` and `ReadOptions`: the samples. Raises `MdfconvError` where it can say what
        is wrong; what else Python raises about a malformed file becomes one in `samples`.
    """

    name: str
    recognizes: Callable[[str, bytes], bool]
    read: Callable[[Source, ReadOptions], Measurements]

    def samples(self, source: Source, options: ReadOptions) -> Measurements:
        """Return the samples of a file of this format; raise `MdfconvError` if it is malformed."""
        try:
            return self.read(source, options)
        except MdfconvError:
            raise
        except _MALFORMED as error:
            reason = " ".join(f"{type(error).__name__} {error}".split())
            raise MdfconvError(f"cannot read {source.path} as {self.name}: {reason}") from error


def open_source(path: Path | str) -> Source:
    """Return the content of a file, or of standard input for ``"-"``."""
    if str(path) == STANDARD_INPUT:
        return Source(Path("standard input"), sys.stdin.buffer.read() if sys.stdin else b"")
    path = Path(path)
    with path.open("rb") as file:
        try:
            return Source(path, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ))
        except (ValueError, OSError):  # empty, or a pipe
            return Source(path, file.read())


def known_by(line: re.Pattern[str]) -> Callable[[str, bytes], bool]:
    """Return what recognizes a format by a line in its head."""
    return lambda name, head: bool(line.search(decode_head(head)))


def decode_head(head: bytes) -> str:
    """Return the beginning of a file as text, with replacements for what is none."""
    return head.decode(_encoding(head), errors="replace").translate(_CONTROLS)


def _encoding(content: bytes) -> str:
    marks = (name for mark, name in _BYTE_ORDER_MARKS.items() if content.startswith(mark))
    return next(marks, "utf-8")


def samples_of_vectors(
    path: Path,
    incident: Array,
    outgoing: Array,
    values: Array,
    channels: tuple[str, ...],
    notes: tuple[str, ...],
    about: tuple[str, ...] = (),
) -> DirectionalSamples:
    """Return samples of directions that are vectors, shape (n, 3), as `directional_samples`."""
    light = polar_angle(incident), azimuth(incident)
    view = polar_angle(outgoing), azimuth(outgoing)
    return directional_samples(path, *light, *view, values, channels, notes, about)


def turn_from_normal(vectors: Array, theta: Array, phi: Array) -> Array:
    """Return vectors, shape (n, 3), turned as the normal has to be to come to (θ, φ).

    First by θ in the plane of x and z, then by φ about the normal.
    """
    x, y, z = np.moveaxis(vectors, -1, 0)
    x, z = np.cos(theta) * x + np.sin(theta) * z, np.cos(theta) * z - np.sin(theta) * x
    return np.stack([np.cos(phi) * x - np.sin(phi) * y, np.sin(phi) * x + np.cos(phi) * y, z], -1)


def from_half_and_difference(
    theta_half: Array, phi_half: Array, theta_difference: Array, phi_difference: Array
) -> tuple[Array, Array]:
    """Return the two directions of the coordinates of Rusinkiewicz 1998, each of shape (n, 3).

    The angles of the difference are those of the first direction where the half vector is the
    normal; the second direction is the one on the other side of the half vector.
    """
    first = direction(theta_difference, phi_difference)
    both = (first, mirrored(first))
    first, second = (turn_from_normal(vectors, theta_half, phi_half) for vectors in both)
    return first, second
