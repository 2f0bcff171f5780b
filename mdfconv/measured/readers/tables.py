"""Text as a table of numbers: what the names of columns say, and which marks separate cells."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from enum import StrEnum
from functools import cache, cached_property
from pathlib import Path

import numpy as np

from mdfconv.distributions.evaluation import Array
from mdfconv.errors import MdfconvError
from mdfconv.measured.samples import about_of, wavelengths_of


class Role(StrEnum):
    """What a column of angles can hold."""

    theta_i = "zenith of the incident direction"
    phi_i = "azimuth of the incident direction"
    theta_o = "zenith of the outgoing direction"
    phi_o = "azimuth of the outgoing direction"
    phi = "difference of the azimuths"
    specular = "angle from the mirror direction"
    angle = "angle"


# The words of names, by what they speak of.
_WORDS = {
    "zenith": "theta zenith polar colatitude th",
    "azimuth": "phi azimuth azimuthal azi az ph",
    "angle": "angle beta alpha",
    "incident": "i in inc incident incidence incoming ingoing input light l source src "
    "illumination lamp laser aoi",
    "outgoing": "o out outgoing output r refl reflected reflection s scat scatter scattered "
    "scattering v view viewing viewer detector det observer observation e exit emergent emission "
    "exitant measure measured measurement receiver sensor camera",
    "difference": "delta relative rel diff difference",
    "half": "h half halfway",
    "unit": "deg degree degrees rad radian radians cos cosine",
    "filler": "of the direction dir vector normal w omega",
    "mirror": "specular spec mirror aspecular offset",
    "uncertainty": "u unc uncert uncertainty uncertainties sigma σ std stdev stddev sd err error "
    "sem",
    # What may stand beside the word of an uncertainty, or be all that is called a value.
    "any value": "brdf bsdf f fr value values val standard deviation dev of the rel relative "
    "percent",
    # The others are names as a whole.
    "value": "brdf bsdf f fr value values val r g b red green blue x y z luminance ndf d "
    "reflectance",
    "wavelength": "wavelength lambda λ wl wavelengthnm lambdanm λnm wlnm wavelengthum lambdaum "
    "wavelengthµm wavelengthμm λum λµm λμm",
    "index": "index idx no nr n id row sample point num number i",
}
_VOCABULARY = {kind: frozenset(words.split()) for kind, words in _WORDS.items()}
_ANGULAR = ("zenith", "azimuth", "angle")
_SPELLED = {"θ": "theta", "ϑ": "theta", "φ": "phi", "ϕ": "phi", "Δ": " delta ", "δ": " delta "}
_JOINED = re.compile(r"(delta|d)?(theta|phi|zenith|azimuth)(\w*)")
# The difference of two angles, as in theta_s - theta_i.
_MINUS = re.compile(r"(.*?\w)\s*[-−–]\s*(\w.*)")


@cache
def role_of(name: str) -> Role | None:
    """Return what kind of angle a name speaks of; None if of none, or of another coordinate."""
    words = _words(name)
    if is_uncertainty(name):
        return None
    if sign_from_mirror(name):
        return Role.specular
    sides = words - _vocabulary(*_ANGULAR, "unit")
    is_whole = not sides - _vocabulary("filler")
    incident, outgoing = (bool(sides & _VOCABULARY[side]) for side in ("incident", "outgoing"))
    if words & _VOCABULARY["azimuth"]:
        if is_whole or sides & _VOCABULARY["difference"] or (incident and outgoing):
            return Role.phi
        one_side = (Role.phi_i, Role.phi_o)
    elif words & _vocabulary("zenith", "angle") or "aoi" in words:
        if is_whole or sides & _VOCABULARY["half"]:
            return Role.angle
        one_side = (Role.theta_i, Role.theta_o)
    else:
        return Role.angle if words and words <= _VOCABULARY["unit"] else None
    return one_side[outgoing] if incident != outgoing else None


@cache
def sign_from_mirror(name: str) -> int:
    """Return 1 for an angle from the mirror direction, −1 for one towards the normal, else 0."""
    difference = _MINUS.fullmatch(_bare(name).strip())
    if difference:
        pair = tuple(role_of(part) for part in difference.groups())
        both = Role.theta_o, Role.theta_i
        return 1 if pair == both else -1 if pair == both[::-1] else 0
    words = _words(name)
    known = _vocabulary("zenith", "angle", "unit", "filler", "mirror", "outgoing", "difference")
    is_angular = words & {*_vocabulary("zenith", "angle", "unit"), "offset", "aspecular"}
    if not (words & _VOCABULARY["mirror"] and is_angular and words <= {*known, "from", "to"}):
        return 0
    return -1 if "aspecular" in words else 1


def is_half(name: str) -> bool:
    """Return whether a name is one of the angle of half vectors."""
    return bool(_words(name) & {*_VOCABULARY["half"], "beta"})


def is_angle(name: str) -> bool:
    """Return whether a name is one of an angle, be it of coordinates that are not read."""
    return bool(_words(name) & _vocabulary(*_ANGULAR)) or role_of(name) is not None


@cache
def is_value(name: str) -> bool:
    """Return whether a name is one of values: of a BRDF, a channel or a wavelength."""
    bare = _bare(name)
    is_known = re.sub(r"[^a-z0-9]", "", bare) in _VOCABULARY["value"]
    return is_known or wavelengths_of([bare]) is not None


@cache
def is_uncertainty(name: str) -> bool:
    """Return whether a name is one of uncertainties."""
    words = _uncertain_words(name)
    # In the middle a letter may mean anything.
    found = {word for word in words if len(word) > 2} | {*words[:1], *words[-1:]}
    return bool(found & _VOCABULARY["uncertainty"]) or "standard deviation" in " ".join(words)


def uncertain_channel(name: str) -> str:
    """Return of which channel a column of uncertainties is; "" for any: r of u_R, 465 of u(465)."""
    common = _vocabulary("uncertainty", "any value")
    rest = [word for word in _uncertain_words(name) if word not in common]
    return "".join(rest).removesuffix("nm")


def _uncertain_words(name: str) -> list[str]:
    bare = re.sub(r"\bk\s*=\s*[\d.]+|\d/sr|sr\^?-?1", " ", name.lower())
    bare = re.sub(r"(?<![a-z])f_r(?![a-z])", "fr", bare)
    return re.findall(r"[a-zσ]+|\d+(?:\.\d+)?", bare)


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
_CHARACTERS_LOOKED_AT = 50_000
# Lines that are read at once, and what stands in those that a fast parser reads as this one does.
_BLOCK = 4096
_PLAIN = b"0123456789+-.eE \tnaifNAIF\n"
# Of a list of columns a message has so many.
_MOST_NAMED = 12
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

    def plain_numbers(self, lines: Sequence[str]) -> Array | None:
        """Return the numbers of lines that hold nothing else; None if they have to be looked at.

        The same numbers as `numbers` of each line, by a parser that knows no empty cells.
        """
        if self.separator == "\t":
            # At the ends it separates no cells.
            lines = [line.strip() for line in lines]
        text = "\n".join(lines)
        if self.decimal_comma:
            text = text.replace(",", ".")
            lines = text.split("\n")
        marks = _PLAIN + (self.separator or "").encode()
        if not text.isascii() or text.encode().translate(None, marks) or not text.strip():
            return None
        with suppress(ValueError):
            return np.loadtxt(lines, delimiter=self.separator, comments=None, ndmin=2)
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
    # The comment from which the names are.
    named_by: str = ""

    def column(self, name: str) -> int:
        """Return the index of a column that the user names, or numbers from 1."""
        lowered = [heading.lower() for heading in self.names]
        if name.lower() in lowered:
            return lowered.index(name.lower())
        if name.isdecimal() and 1 <= int(name) <= len(self.names):
            return int(name) - 1
        raise self.error(f"no column '{name}'", f"there are {self.known}")

    @cached_property
    def named(self) -> dict[int, str]:
        """The names of the columns by their indices; empty if the file gives none."""
        return dict(enumerate(self.names)) if self.is_named else {}

    @cached_property
    def counting(self) -> set[int]:
        """The columns that are called an index and count the rows."""
        columns = ((index, name, self.numbers[:, index]) for index, name in self.named.items())
        return {index for index, name, numbers in columns if counts_rows(name, numbers)}

    @property
    def about(self) -> tuple[str, ...]:
        """What the comments say of the file."""
        return about_of(comment for comment in self.comments if comment != self.named_by)

    @property
    def known(self) -> str:
        """The names of the columns as a message lists them."""
        return _listed(self.names)

    def listed(self, columns: Sequence[int]) -> str:
        """Return columns as a message names them."""
        names = _listed([f"'{self.names[index]}'" for index in columns])
        return f"column{'s' if len(columns) > 1 else ''} {names}"

    def error(self, reason: str, hint: str = "", *, argument: str = "") -> MdfconvError:
        """Return an error about the file."""
        return MdfconvError(f"{self.path}: {reason}", hint, argument=argument)


def _listed(names: Sequence[str]) -> str:
    more = len(names) - _MOST_NAMED
    return ", ".join(names[:_MOST_NAMED]) + (f" and {more} more" if more > 0 else "")


def parse_table(path: Path, lines: Iterable[str], *, by_number: bool = False) -> Table:
    """Return the table that lines of text hold; those that start with #, %, // or ! are comments.

    Columns that are chosen by number need no names: those that do not fit are passed over.
    Raises `MdfconvError` if there are no numbers, or a line has others than numbers or too many or
    few of them.
    """
    lines = list(lines)
    form = _form_of(lines)
    rows = _Rows(path, form)
    start = 0
    while start < len(lines):
        # Line by line up to the first numbers.
        end = start + (_BLOCK if rows.blocks else 1)
        rows.add(start, lines[start:end])
        start = end
    numbers, headers, comments = rows.numbers(), rows.headers, rows.comments
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


def _form_of(lines: Iterable[str]) -> TableForm:
    """Return the form under which the most lines are numbers, more than one a line if any is."""
    looked_at = list(_first_rows(lines))
    wide = [sum(len(form.numbers(line) or ()) > 1 for line in looked_at) for form in _FORMS]
    if max(wide):
        return _FORMS[wide.index(max(wide))]
    first = looked_at[0] if looked_at else ""
    return next((form for form in _FORMS if form.separator and form.separator in first), _BLANKS)


def _first_rows(lines: Iterable[str]) -> Iterator[str]:
    """Yield the first lines that are no comments, fewer if they are long."""
    characters = count = 0
    for line in lines:
        if line.strip() and not _COMMENT.match(line):
            yield line.strip()
            characters += len(line)
            count += 1
        # The first two may be headers.
        if count >= _LOOKED_AT + 2 or (count > 3 and characters > _CHARACTERS_LOOKED_AT):
            return


class _Rows:
    """The rows of a table as they are read, and what stands above and between them."""

    def __init__(self, path: Path, form: TableForm) -> None:
        self._path, self._form = path, form
        self.blocks: list[Array] = []
        self.headers: list[tuple[int, str]] = []
        self.comments: list[str] = []

    def add(self, start: int, lines: Sequence[str]) -> None:
        """Add the lines after so many; raise `MdfconvError` if one does not belong there."""
        block = self._form.plain_numbers(lines) if self.blocks else None
        if block is None or block.shape[1] != self.blocks[0].shape[1]:
            block = self._looked_at(start, lines)
        if block.size:
            self.blocks.append(block)

    def _looked_at(self, start: int, lines: Sequence[str]) -> Array:
        """Return the numbers of lines, each of which may be anything."""
        rows: list[Array] = []
        for place, line in enumerate(lines, start=start + 1):
            if mark := _COMMENT.match(line):
                self.comments.append(line[mark.end() :].strip())
                continue
            line = line.strip()
            row = self._form.numbers(line) if line else []
            if row is None:
                if self.blocks or len(self.headers) > 1:
                    raise _no_numbers(self._path, place, line)
                self.headers.append((place, line))
            elif row:
                width = self.blocks[0].shape[1] if self.blocks else len(row)
                if len(row) != width:
                    reason = f"{len(row)} columns where {width} go"
                    raise MdfconvError(f"{self._path}, line {place}: {reason}")
                rows.append(np.array(row))
        return np.array(rows)

    def numbers(self) -> Array:
        """Return all rows; raise `MdfconvError` if there are none."""
        if not self.blocks:
            raise MdfconvError(f"{self._path}: no numeric rows")
        return np.concatenate(self.blocks)


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
            notes = (*table.notes, note)
            return replace(table, names=names, is_named=True, notes=notes, named_by=comment)
    return table
