"""Text as a table of numbers: what the names of columns say, and which marks separate cells."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from enum import StrEnum
from functools import cache
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


# The words of names, by what they speak of.
_WORDS = {
    "zenith": "theta zenith polar colatitude th",
    "azimuth": "phi azimuth azimuthal azi az ph",
    "angle": "angle beta alpha",
    "incident": "i in inc incident incidence incoming ingoing input light l source src "
    "illumination aoi",
    "outgoing": "o out outgoing output r refl reflected reflection s scat scatter scattered "
    "scattering v view viewing viewer detector det observer observation e exit emergent emission "
    "exitant measure measured measurement",
    "difference": "delta relative rel diff difference",
    "half": "h half halfway",
    "unit": "deg degree degrees rad radian radians cos cosine",
    "filler": "of the direction dir vector normal w omega",
    # The others are names as a whole.
    "value": "brdf bsdf f fr value values val r g b red green blue x y z luminance ndf d "
    "reflectance",
    "wavelength": "wavelength lambda λ wavelengthnm",
    "index": "index idx no nr n id row sample point num number i",
}
_VOCABULARY = {kind: frozenset(words.split()) for kind, words in _WORDS.items()}
_ANGULAR = ("zenith", "azimuth", "angle")
_SPELLED = {"θ": "theta", "ϑ": "theta", "φ": "phi", "ϕ": "phi", "Δ": " delta ", "δ": " delta "}
_JOINED = re.compile(r"(delta|d)?(theta|phi|zenith|azimuth)(\w*)")
_CHANNEL = re.compile(r"(lambda|wl|brdf|bsdf|r)?\s*_?\d{3,4}(\.\d+)?\s*(nm)?", re.I)


@cache
def role_of(name: str) -> Role | None:
    """Return what kind of angle a name speaks of; None if of none, or of another coordinate."""
    words = _words(name)
    sides = words - _vocabulary(*_ANGULAR, "unit")
    is_whole = not sides - _vocabulary("filler")
    incident, outgoing = (bool(sides & _VOCABULARY[side]) for side in ("incident", "outgoing"))
    if words & _VOCABULARY["azimuth"]:
        if is_whole or sides & _VOCABULARY["difference"]:
            return Role.phi
        one_side = (Role.phi_i, Role.phi_o)
    elif words & _vocabulary("zenith", "angle") or "aoi" in words:
        if is_whole or sides & _VOCABULARY["half"]:
            return Role.angle
        one_side = (Role.theta_i, Role.theta_o)
    else:
        return Role.angle if words and words <= _VOCABULARY["unit"] else None
    return one_side[outgoing] if incident != outgoing else None


def is_half(name: str) -> bool:
    """Return whether a name is one of the angle of half vectors."""
    return bool(_words(name) & {*_VOCABULARY["half"], "beta"})


def is_angle(name: str) -> bool:
    """Return whether a name is one of an angle, be it of coordinates that are not read."""
    return bool(_words(name) & _vocabulary(*_ANGULAR)) or role_of(name) is not None


def is_value(name: str) -> bool:
    """Return whether a name is one of values: of a BRDF, a channel or a wavelength."""
    bare = _bare(name)
    is_known = re.sub(r"[^a-z0-9]", "", bare) in _VOCABULARY["value"]
    return is_known or bool(_CHANNEL.fullmatch(bare.strip()))


def is_wavelength(name: str) -> bool:
    """Return whether a name is that of a column of wavelengths."""
    return re.sub(r"[^a-zλ]", "", _bare(name)) in _VOCABULARY["wavelength"]


def counts_rows(name: str, numbers: Array) -> bool:
    """Return whether a column is called an index and counts, from 0 or 1."""
    bare = re.sub(r"[^a-z]|unnamed", "", name.lower())
    is_index = bare in {"", *_VOCABULARY["index"]} and role_of(name) is None
    return is_index and is_counting(numbers)


def is_counting(numbers: Array) -> bool:
    """Return whether numbers count, from 0 or 1."""
    first = numbers[0]
    counted = first + np.arange(numbers.size)
    return numbers.size > 2 and first in (0, 1) and bool(np.array_equal(numbers, counted))


def _vocabulary(*kinds: str) -> frozenset[str]:
    return frozenset().union(*(_VOCABULARY[kind] for kind in kinds))


def _bare(name: str) -> str:
    """Return a name in small letters, without what stands in brackets."""
    return re.sub(r"[\[({].*?[\])}]", " ", name).lower()


def _words(name: str) -> frozenset[str]:
    """Return the words of a name: thetaIn, theta_in and θ in are theta and in."""
    text = name.replace("°", " deg ")
    for letter, word in _SPELLED.items():
        text = text.replace(letter, word)
    words: set[str] = set()
    for word in re.findall(r"[a-z]+", re.sub(r"(?<=[a-z])(?=[A-Z])", " ", text).lower()):
        joined = _JOINED.fullmatch(word)
        if joined:
            difference, kind, side = joined.groups()
            words |= {"delta" if difference else kind, kind, side or kind}
        else:
            words.add(word)
    return frozenset(words)


_COMMENT = re.compile(r"^\s*(#+|%+|//+|!+)\s?")
_COMMENT_HINT = "comments start with #, %, // or !"
_DECIMAL_COMMA = re.compile(r"(?<=\d),(?=\d)")
# What C programs of Windows print for what is no number: 1.#INF00, -1.#IND00, 1.#QNAN0.
_MSVC = re.compile(r"([-+]?)1\.#(INF|IND|QNAN|SNAN)0*", re.I)
# Lines by which the form of a table is decided.
_LOOKED_AT = 50
# What a cell of a second line of headers holds.
_UNIT = re.compile(
    r"\W*|\W*(deg(ree)?s?|°|rad(ian)?s?|(1/)?sr(\^?-?1)?|nm|none|a\.?u\.?|w/.*)\W*", re.I
)


def number(text: str) -> float:
    """Return the number that a text is, infinity and NaN included; raise ValueError if it is none.

    Those are also known as older C libraries print them.
    """
    try:
        return float(text)
    except ValueError:
        unusual = _MSVC.fullmatch(text)
        if not unusual:
            raise
        return float(unusual[1] + ("inf" if unusual[2].upper() == "INF" else "nan"))


@dataclass(frozen=True)
class TableForm:
    """How the cells of a line are set apart; blanks if the separator is None."""

    separator: str | None
    decimal_comma: bool = False

    def cells(self, line: str) -> list[str]:
        """Return the cells of a line, without blanks and quotes around them."""
        parts = line.split(self.separator)
        if self.separator and '"' in line:
            with suppress(csv.Error):
                parts = next(csv.reader([line], delimiter=self.separator, skipinitialspace=True))
        return [part.strip().strip("\"'").strip() for part in parts]

    def numbers(self, line: str) -> list[float] | None:
        """Return the numbers of a line, NaN for an empty cell; None if a cell holds none."""
        cells = self.cells(line)
        if self.decimal_comma:
            cells = [cell.replace(",", ".") for cell in cells]
        try:
            return [number(cell) if cell else np.nan for cell in cells]
        except ValueError:
            return None

    def names(self, line: str, width: int) -> list[str]:
        """Return the cells of a line of words, which may be set apart otherwise than numbers."""
        cells = self.cells(line)
        if len(cells) == width:
            return cells
        others = (form.cells(line) for form in _FORMS)
        return next((other for other in others if len(other) == width), cells)


_BLANKS = TableForm(None)
# Those with decimal points first: of forms that read a table alike, the first is taken.
_FORMS = (
    *(TableForm(separator) for separator in (";", "\t", ",", None)),
    *(TableForm(separator, decimal_comma=True) for separator in (";", "\t", None, ",")),
)


@dataclass(frozen=True)
class Table:
    """The numbers of a text file.

    Columns have names, their numbers from 1 if the file gives none, and units, which a second line
    of headers gives. Empty cells are NaN, comments are without their marks.
    """

    path: Path
    names: list[str]
    units: list[str]
    numbers: Array
    is_named: bool
    comments: list[str] = field(default_factory=list)
    notes: tuple[str, ...] = ()

    def column(self, name: str) -> int:
        """Return the index of a column that the user names, or numbers from 1."""
        lowered = [heading.lower() for heading in self.names]
        if name.lower() in lowered:
            return lowered.index(name.lower())
        if name.isdecimal() and 1 <= int(name) <= len(self.names):
            return int(name) - 1
        raise self.error(f"no column '{name}'", f"there are {', '.join(self.names)}")

    def listed(self, columns: Sequence[int]) -> str:
        """Return columns as a message names them."""
        names = ", ".join(f"'{self.names[index]}'" for index in columns)
        return f"column{'s' if len(columns) > 1 else ''} {names}"

    def error(self, reason: str, hint: str = "", *, argument: str = "") -> MdfconvError:
        """Return an error about the file."""
        return MdfconvError(f"{self.path}: {reason}", hint, argument=argument)


def parse_table(path: Path, lines: Iterable[str], *, by_number: bool = False) -> Table:
    """Return the table that lines of text hold; those that start with #, %, // or ! are comments.

    Columns that are chosen by number need no names: those that do not fit are passed over.
    Raises `MdfconvError` if there are no numbers, or a line has others than numbers or too many or
    few of them.
    """
    rows, comments = [], []
    for place, line in enumerate(lines, start=1):
        if mark := _COMMENT.match(line):
            comments.append(line[mark.end() :].strip())
        elif line.strip():
            rows.append((place, line.strip()))
    form = _form_of([line for _, line in rows[: _LOOKED_AT + 2]])
    headers, numbers = _numbers(path, rows, form)
    width = numbers.shape[1]
    notes: tuple[str, ...] = ()
    if form.decimal_comma:
        notes = ("commas are read as decimal points",)
        comments = [_DECIMAL_COMMA.sub(".", comment) for comment in comments]
    names, units = _headings(path, headers, width, form, by_number=by_number)
    if headers and not names:
        notes += (f"the names in line {headers[0][0]} are not those of {width} columns: not used",)
    is_named = bool(names)
    names = names or [str(index + 1) for index in range(width)]
    table = Table(path, names, units or [""] * width, numbers, is_named, comments, notes)
    table = _without_empty_column(table)
    return table if is_named else _named_in_comments(table, form)


def _form_of(lines: Sequence[str]) -> TableForm:
    """Return the form under which the most lines are numbers, more than one a line if any is."""
    wide = [sum(len(form.numbers(line) or ()) > 1 for line in lines) for form in _FORMS]
    if max(wide):
        return _FORMS[wide.index(max(wide))]
    first = lines[0] if lines else ""
    return next((form for form in _FORMS if form.separator and form.separator in first), _BLANKS)


def _numbers(
    path: Path, rows: Sequence[tuple[int, str]], form: TableForm
) -> tuple[list[tuple[int, str]], Array]:
    """Return the lines before the first row of numbers, and the numbers."""
    headers: list[tuple[int, str]] = []
    numbers: list[tuple[int, list[float]]] = []
    for place, line in rows:
        row = form.numbers(line)
        if row is not None:
            numbers.append((place, row))
        elif numbers or len(headers) > 1:
            raise _no_numbers(path, place, line)
        else:
            headers.append((place, line))
    if not numbers:
        raise MdfconvError(f"{path}: no numeric rows")
    width = len(numbers[0][1])
    for place, row in numbers:
        if len(row) != width:
            raise MdfconvError(f"{path}, line {place}: {len(row)} columns where {width} go")
    return headers, np.array([row for _, row in numbers])


def _headings(
    path: Path, headers: Sequence[tuple[int, str]], width: int, form: TableForm, *, by_number: bool
) -> tuple[list[str], list[str]]:
    """Return the names and the units that the lines above the numbers give."""
    cells = [form.names(line, width) for _, line in headers]
    names, units = (*cells, [], [])[:2]
    if headers and len(names) != width:
        if by_number:
            return [], []
        reason = f"{path}, line {headers[0][0]}: names {len(names)} columns where {width} are"
        raise MdfconvError(reason, f"choose them by number; {_COMMENT_HINT}")
    is_of_units = len(units) == width and all(_UNIT.fullmatch(unit) for unit in units)
    if len(headers) > 1 and not is_of_units:
        raise _no_numbers(path, *headers[1])
    return names, units


def _no_numbers(path: Path, place: int, line: str) -> MdfconvError:
    return MdfconvError(f"{path}, line {place}: not numbers: {line[:60]}", _COMMENT_HINT)


def _without_empty_column(table: Table) -> Table:
    """Leave out a last column that only a separator at the end of every line makes."""
    numbers = table.numbers
    is_empty = numbers.shape[1] > 1 and np.isnan(numbers[:, -1]).all()
    if not is_empty or (table.is_named and table.names[-1]):
        return table
    return replace(table, names=table.names[:-1], units=table.units[:-1], numbers=numbers[:, :-1])


def _named_in_comments(table: Table, form: TableForm) -> Table:
    """Take the names from the last comment that can be one: as many, and some known ones."""
    width = table.numbers.shape[1]
    for comment in reversed(table.comments):
        names = form.names(comment, width)
        if len(names) != width:
            continue
        angles = sum(role_of(name) is not None for name in names)
        if angles > 1 or (angles and any(map(is_value, names))):
            note = f"the names of the columns are taken from the comment '{comment[:60]}'"
            return replace(table, names=names, is_named=True, notes=(*table.notes, note))
    return table
