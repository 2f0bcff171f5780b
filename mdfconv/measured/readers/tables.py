"""Text as a table of numbers: which marks separate columns, and which lines name them."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from pathlib import Path

import numpy as np

from mdfconv.distributions.evaluation import Array
from mdfconv.errors import MdfconvError


class Role(StrEnum):
    """What a column of angles can hold."""

    theta_i = "zenith of the incident direction"
    phi_i = "azimuth of the incident direction"
    theta_o = "zenith of the outgoing direction"
    phi_o = "azimuth of the outgoing direction"
    phi = "difference of the azimuths"
    angle = "angle"


_LETTERS = {"θ": "theta", "ϑ": "theta", "φ": "phi", "ϕ": "phi", "Δ": " delta ", "δ": " delta "}
_ZENITH = {"theta", "zenith", "polar", "colatitude", "th"}
_AZIMUTH = {"phi", "azimuth", "azimuthal", "azi", "az", "ph"}
_ANGLE = {"angle", "beta", "alpha"}
_INCIDENT = {
    "i", "in", "inc", "incident", "incidence", "incoming", "ingoing", "input", "light", "l",
    "source", "src", "illumination", "aoi",
}  # fmt: skip
_OUTGOING = {
    "o", "out", "outgoing", "output", "r", "refl", "reflected", "reflection", "s", "scat",
    "scatter", "scattered", "scattering", "v", "view", "viewing", "viewer", "detector", "det",
    "observer", "observation", "e", "exit", "emergent", "emission", "exitant",
}  # fmt: skip
_DIFFERENCE = {"delta", "relative", "rel", "diff", "difference"}
_HALF = {"h", "half", "halfway"}
_OF_HALF = _HALF | {"beta"}
_UNITS = {"deg", "degree", "degrees", "rad", "radian", "radians", "cos", "cosine"}
_FILLERS = {"of", "the", "direction", "dir", "vector", "normal", "w", "omega"}
_JOINED = re.compile(r"(delta|d)?(theta|phi|zenith|azimuth)(\w*)")
_VALUES = {
    "brdf", "bsdf", "f", "fr", "value", "values", "val", "r", "g", "b", "red", "green", "blue",
    "x", "y", "z", "luminance", "ndf", "d", "reflectance",
}  # fmt: skip
_WAVELENGTH = re.compile(r"(lambda|wl|brdf|bsdf|r)?\s*_?\d{3,4}(\.\d+)?\s*(nm)?", re.I)
_INDEX = {"", "index", "idx", "no", "nr", "n", "id", "row", "sample", "point", "num", "number", "i"}


def role_of(name: str) -> Role | None:
    """Return what kind of angle a name speaks of; None if of none, or of another coordinate."""
    words = _words(name)
    kinds = set(words)
    sides = kinds - _ZENITH - _AZIMUTH - _ANGLE - _UNITS
    incident, outgoing = bool(sides & _INCIDENT), bool(sides & _OUTGOING)
    if kinds & _AZIMUTH:
        if sides & _DIFFERENCE or not sides - _FILLERS:
            return Role.phi
        if incident != outgoing:
            return Role.phi_i if incident else Role.phi_o
        return None
    if kinds & (_ZENITH | _ANGLE) or "aoi" in kinds:
        if sides & _HALF or not sides - _FILLERS:
            return Role.angle
        return _side(incident, outgoing)
    return Role.angle if kinds & _UNITS and not kinds - _UNITS else None


def _side(incident: bool, outgoing: bool) -> Role | None:
    if incident == outgoing:
        return None
    return Role.theta_i if incident else Role.theta_o


def is_half(name: str) -> bool:
    """Return whether a name is one of the angle of half vectors."""
    return bool(set(_words(name)) & _OF_HALF)


def is_angle(name: str) -> bool:
    """Return whether a name is one of an angle, be it of coordinates that are not read."""
    return bool(set(_words(name)) & (_ZENITH | _AZIMUTH | _ANGLE)) or role_of(name) is not None


def is_value(name: str) -> bool:
    """Return whether a name is one of values: of a BRDF, a channel or a wavelength."""
    bare = _bare(name)
    joined = re.sub(r"[^a-z0-9]", "", bare)
    return joined in _VALUES or bool(_WAVELENGTH.fullmatch(bare.strip()))


def is_wavelength(name: str) -> bool:
    """Return whether a name is that of a column of wavelengths."""
    return re.sub(r"[^a-zλ]", "", _bare(name)) in {"wavelength", "lambda", "λ", "wavelengthnm"}


def counts_rows(name: str, numbers: Array) -> bool:
    """Return whether a column is called an index and counts, from 0 or 1."""
    called = re.sub(r"[^a-z]|unnamed", "", name.lower()) in _INDEX and role_of(name) is None
    return called and is_counting(numbers)


def is_counting(numbers: Array) -> bool:
    """Return whether numbers count, from 0 or 1."""
    first = numbers[0]
    return (
        numbers.size > 2
        and first in (0, 1)
        and bool(np.array_equal(numbers, first + np.arange(numbers.size)))
    )


def _bare(name: str) -> str:
    """Return a name in small letters, without what stands in brackets."""
    return re.sub(r"[\[({].*?[\])}]", " ", name).lower()


def _words(name: str) -> list[str]:
    """Return the words of a name: thetaIn, theta_in and θ in are theta and in."""
    text = name.replace("°", " deg ")
    for letter, word in _LETTERS.items():
        text = text.replace(letter, word)
    text = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", text)
    words = []
    for word in re.findall(r"[a-z]+", text.lower()):
        joined = _JOINED.fullmatch(word)
        if joined:
            difference, kind, side = joined.groups()
            words += ["delta"] * bool(difference) + [kind] + [side] * bool(side)
        else:
            words.append(word)
    return words


_COMMENT = re.compile(r"^\s*(#+|%+|//+|!+)\s?")
# Lines by which the form of a table is decided.
_LOOKED_AT = 50
# What a cell of a second line of headers holds.
_UNIT = re.compile(
    r"\W*|\W*(deg(ree)?s?|°|rad(ian)?s?|(1/)?sr(\^?-?1)?|nm|none|a\.?u\.?|w/.*)\W*", re.I
)


@dataclass(frozen=True)
class TableForm:
    """How the cells of a line are set apart; blanks if the separator is None."""

    separator: str | None
    decimal_comma: bool = False

    def cells(self, line: str) -> list[str]:
        """Return the cells of a line, without blanks and quotes around them."""
        if self.separator is None:
            parts = line.split()
        elif '"' in line:
            try:
                parts = next(csv.reader([line], delimiter=self.separator, skipinitialspace=True))
            except csv.Error:
                parts = line.split(self.separator)
        else:
            parts = line.split(self.separator)
        return [part.strip().strip("\"'").strip() for part in parts]

    def numbers(self, line: str) -> list[float] | None:
        """Return the numbers of a line, NaN for an empty cell; None if a cell holds none."""
        try:
            return [self._number(cell) for cell in self.cells(line)]
        except ValueError:
            return None

    def _number(self, cell: str) -> float:
        if not cell:
            return np.nan
        return float(cell.replace(",", ".") if self.decimal_comma else cell)


# Those with decimal points first: of forms that read a table alike, the first is taken.
_FORMS = (
    TableForm(";"),
    TableForm("\t"),
    TableForm(","),
    TableForm(None),
    TableForm(";", decimal_comma=True),
    TableForm("\t", decimal_comma=True),
    TableForm(None, decimal_comma=True),
    TableForm(",", decimal_comma=True),
)


@dataclass(frozen=True)
class Table:
    """The numbers of a text file.

    Parameters
    ----------
    names : list of str
        The names of the columns; their numbers from 1 if the file has none.
    units : list of str
        What a second line of headers says of each column, or empty strings.
    numbers : numpy.ndarray, shape (rows, columns)
        The cells, NaN where one is empty.
    is_named : bool
        Whether the file names its columns.
    comments : list of str
        The lines that are comments, without their marks.
    notes : tuple of str
        What was assumed.
    """

    names: list[str]
    units: list[str]
    numbers: Array
    is_named: bool
    comments: list[str] = field(default_factory=list)
    notes: tuple[str, ...] = ()


def parse_table(path: Path, lines: Sequence[str]) -> Table:
    """Return the table that lines of text hold.

    Parameters
    ----------
    path : Path
        The file, for messages.
    lines : sequence of str
        Its lines. Those that start with #, %, // or ! are comments.

    Raises
    ------
    MdfconvError
        If there are no numbers, or a line has others than numbers or too many or few of them.
    """
    rows, comments = [], []
    for number, line in enumerate(lines, start=1):
        mark = _COMMENT.match(line)
        if mark:
            comments.append(line[mark.end() :].strip())
        elif line.strip():
            rows.append((number, line.strip()))
    form = _form_of([line for _, line in rows[: _LOOKED_AT + 2]])
    headers, numbers = _numbers(path, rows, form)
    width = numbers.shape[1]
    names, units = _names(path, headers, width, form)
    notes = ("commas are read as decimal points",) if form.decimal_comma else ()
    is_named = bool(names)
    names = names or [str(index + 1) for index in range(width)]
    table = Table(names, units or [""] * width, numbers, is_named, comments, notes)
    table = _without_empty_columns(table)
    return table if is_named else _named_in_comments(table, form)


def _form_of(lines: Sequence[str]) -> TableForm:
    """Return the form under which the most lines are numbers, more than one a line if any is."""
    rows = [[form.numbers(line) for line in lines] for form in _FORMS]
    wide = [sum(row is not None and len(row) > 1 for row in read) for read in rows]
    if max(wide, default=0):
        return _FORMS[wide.index(max(wide))]
    separators = (
        form for form in _FORMS if form.separator and lines and form.separator in lines[0]
    )
    return next(separators, TableForm(None))


def _numbers(
    path: Path, rows: Sequence[tuple[int, str]], form: TableForm
) -> tuple[list[tuple[int, str]], Array]:
    """Return the lines before the first row of numbers, and the numbers."""
    headers: list[tuple[int, str]] = []
    numbers: list[list[float]] = []
    places: list[int] = []
    for place, line in rows:
        row = form.numbers(line)
        if row is not None:
            numbers.append(row)
            places.append(place)
        elif numbers or len(headers) > 1:
            raise MdfconvError(
                f"{path}, line {place}: not numbers: {line[:60]}",
                "comments start with #, %, // or !",
            )
        else:
            headers.append((place, line))
    if not numbers:
        raise MdfconvError(f"{path}: no numeric rows")
    header = _split_to_width(headers[0][1], form, None) if headers else numbers[0]
    width = len(numbers[0]) if headers and len(header) != len(numbers[0]) else len(header)
    for place, row in zip(places, numbers, strict=True):
        if len(row) != width:
            raise MdfconvError(f"{path}, line {place}: {len(row)} columns where {width} go")
    return headers, np.array(numbers)


def _names(
    path: Path, headers: Sequence[tuple[int, str]], width: int, form: TableForm
) -> tuple[list[str], list[str]]:
    """Return the names and the units that the lines above the numbers give."""
    if not headers:
        return [], []
    names = _split_to_width(headers[0][1], form, width)
    if len(names) != width:
        raise MdfconvError(
            f"{path}, line {headers[0][0]}: names {len(names)} columns where {width} are",
            "comments start with #, %, // or !",
        )
    if len(headers) == 1:
        return names, []
    place, line = headers[1]
    units = _split_to_width(line, form, width)
    if len(units) != width or not all(_UNIT.fullmatch(unit) for unit in units):
        raise MdfconvError(
            f"{path}, line {place}: not numbers: {line[:60]}", "comments start with #, %, // or !"
        )
    return names, units


def _split_to_width(line: str, form: TableForm, width: int | None) -> list[str]:
    """Return the cells of a line of words, which may be separated otherwise than the numbers."""
    cells = form.cells(line)
    if width is None or len(cells) == width:
        return cells
    others = (other.cells(line) for other in _FORMS)
    return next((other for other in others if len(other) == width), cells)


def _without_empty_columns(table: Table) -> Table:
    """Leave out a last column that only a separator at the end of every line makes."""
    if table.numbers.shape[1] < 2 or not np.isnan(table.numbers[:, -1]).all():
        return table
    if table.is_named and table.names[-1]:
        return table
    return replace(
        table, names=table.names[:-1], units=table.units[:-1], numbers=table.numbers[:, :-1]
    )


def _named_in_comments(table: Table, form: TableForm) -> Table:
    """Take the names from the last comment that can be one: as many, and some known ones."""
    width = table.numbers.shape[1]
    for comment in reversed(table.comments):
        names = _split_to_width(comment, form, width)
        if len(names) != width:
            continue
        roles = [role_of(name) for name in names]
        angles = sum(role is not None for role in roles)
        if angles and (angles > 1 or any(is_value(name) for name in names)):
            note = f"the names of the columns are taken from the comment '{comment[:60]}'"
            return replace(table, names=names, is_named=True, notes=(*table.notes, note))
    return table
