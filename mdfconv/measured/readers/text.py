"""Text tables: CSV, TSV or blanks between columns, of one angle or of two directions."""

from __future__ import annotations

import re
from collections.abc import Collection
from dataclasses import replace

import numpy as np

from mdfconv.brdf.microfacet import mirrored, polar_angle
from mdfconv.distributions.evaluation import Array
from mdfconv.measured import samples
from mdfconv.measured.readers import tables
from mdfconv.measured.readers.base import Reader, ReadOptions, Source
from mdfconv.measured.readers.tables import Role, Table, parse_table
from mdfconv.measured.samples import UNITS, DirectionalSamples, Measurements
from mdfconv.registry import unknown_name

# What an angle of a table of one angle can be.
HALF, REFLECTED, INCIDENT = "half", "reflected", "incident"
_MEANINGS = (HALF, REFLECTED, INCIDENT)
# In the order of an option each: the zeniths are the first and the third.
DIRECTIONS = (Role.theta_i, Role.phi_i, Role.theta_o, Role.phi_o)
# By what a name says its unit, the first of them that it has.
_MARKS = {"cosine": ("cos",), "degrees": ("deg", "°"), "radians": ("rad",)}
# The angle of incidence as a comment says it.
_INCIDENCE = re.compile(
    r"\b(?:theta_?(?:i|in|inc)|θ_?(?:i|in)|aoi|(?:angle of )?incidence(?: angle)?|incident angle)"
    r"\s*(?:\(\w*\)|\[\w*\])?\s*[:=]\s*(?P<number>[-+]?\d+(?:\.\d*)?)(?!,?\d)"
    r"\s*(?P<unit>deg|°|rad)?",
    re.I,
)
_INCIDENCE_UNITS = {"deg": "degrees", "°": "degrees", "rad": "radians"}
# Files hold rounded angles.
_SLACK = 1 + 1e-6
# How much sooner, in standard deviations of the angle, values fall off with one half vector than
# with the other before it is said to be the right one: those of a diffuse surface differ by less.
_CLEAR = 0.25


def read_table(table: Table, options: ReadOptions) -> Measurements:
    """Return the samples of a table, of two directions if its columns are, else of one angle.

    Raises `MdfconvError` if it stays open what the columns hold, or the angles are none.
    """
    meaning = options.angle_is
    if meaning not in (None, *_MEANINGS):
        raise unknown_name("angle", meaning, list(_MEANINGS))
    columns = _Columns(table, options)
    is_of_one = options.angle is not None or meaning is not None
    directions = None if is_of_one else columns.directions()
    return directions or columns.one_angle()


class _Columns:
    """What the columns of a table are taken for: as the user says, then their names, then numbers.

    Notes say what was assumed.
    """

    def __init__(self, table: Table, options: ReadOptions) -> None:
        self._table, self._options = table, options
        self._notes = list(table.notes)
        self._names = dict(enumerate(table.names)) if table.is_named else {}
        named = ((index, name, table.numbers[:, index]) for index, name in self._names.items())
        self._counting = [index for index, name, rows in named if tables.counts_rows(name, rows)]

    def directions(self) -> DirectionalSamples | None:
        """Return samples of two directions; None if the table has no zenith of both."""
        table = self._table
        columns = self._by_role()
        incidence = None if Role.theta_i in columns else self._incidence()
        if Role.theta_o not in columns or not (Role.theta_i in columns or incidence):
            if any(getattr(self._options, role.name) for role in DIRECTIONS):
                hint = f"name both; there are {', '.join(table.names)}"
                raise table.error("no column of the zenith of both directions", hint)
            return None
        channels, values, value_notes = self._values(columns.values())
        unit = self._unit_of_directions(columns)
        columns = self._exchanged(columns, 90.0 if unit == "degrees" else np.pi / 2)
        to_radians = np.pi / 180 if unit == "degrees" else 1.0
        angles = {role: table.numbers[:, index] * to_radians for role, index in columns.items()}
        if incidence:
            number, mark = float(incidence["number"]), incidence["unit"]
            stored = _INCIDENCE_UNITS[mark.lower()] if mark else unit
            angle = np.radians(number) if stored == "degrees" else number
            angles[Role.theta_i] = np.full(len(table.numbers), angle)
            self._notes.append(
                f"the angle of incidence, {number:g} {stored}, is from the comment "
                f"'{incidence.string[:60]}'"
            )
        self._complete_azimuths(angles)
        light = angles[Role.theta_i], angles[Role.phi_i]
        view = angles[Role.theta_o], angles[Role.phi_o]
        notes = (*self._notes, *value_notes)
        return _oriented(
            samples.directional_samples(table.path, *light, *view, values, channels, notes)
        )

    def one_angle(self) -> Measurements:
        """Return samples of one angle, or of two directions of which one is the normal."""
        table, meaning = self._table, self._options.angle_is
        column = self._angle_column()
        channels, values, value_notes = self._values([column])
        angle, unit = table.numbers[:, column], self._unit_of_angle(column)
        notes = (*self._notes, *value_notes)
        if meaning in (REFLECTED, INCIDENT):
            if unit == "cosine":
                # NaN outside the range, which is left out with a note.
                angle = np.where(np.abs(angle) <= 1, angle, np.nan)
            theta = UNITS[unit].to_radians(angle)
            zero = np.zeros_like(theta)
            still = INCIDENT if meaning == REFLECTED else REFLECTED
            taken = f"the {still} one is taken to be the normal"
            notes += (f"the angle is that of the {meaning} direction; {taken}",)
            zeniths = (theta, zero) if meaning == INCIDENT else (zero, theta)
            angles = zeniths[0], zero, zeniths[1], zero
            return samples.directional_samples(table.path, *angles, values, channels, notes)
        if not (table.is_named and tables.is_half(table.names[column])):
            other = "" if meaning else ", not of a direction"
            read = f"{table.listed([column])} is read as the angle between normal and half vector"
            notes += (read + other,)
        return samples.samples(table.path, angle, unit, values, channels, "ndf", notes)

    def _by_role(self) -> dict[Role, int]:
        """Return the columns of angles by what they hold."""
        table, options = self._table, self._options
        named = {role: getattr(options, role.name) for role in DIRECTIONS}
        chosen = {role: table.column(name) for role, name in named.items() if name}
        columns, bare = dict(chosen), []
        for index, name in self._names.items():
            role = tables.role_of(name)
            if index in chosen.values() or name in options.values or role is None or role in chosen:
                continue
            if role is Role.angle:
                bare.append(index)
            elif role in columns:
                both = table.listed([columns[role], index])
                argument = role.name if role in DIRECTIONS else ""
                raise table.error(f"{both} are both the {role}", "choose one", argument=argument)
            else:
                columns[role] = index
        if Role.theta_i in columns and Role.theta_o not in columns and len(bare) == 1:
            columns[Role.theta_o] = bare[0]
            self._notes.append(f"{table.listed(bare)} is taken for the {Role.theta_o}")
        return columns

    def _angle_column(self) -> int:
        """Return the column of angles of a table of one angle."""
        table = self._table
        if self._options.angle is not None:
            return table.column(self._options.angle)
        several = len(table.names) > 2
        if not table.is_named:
            if several and tables.is_counting(table.numbers[:, 0]):
                reason = "column 1 counts 0, 1, 2 … or 1, 2, 3 …: an index, or degrees"
                hint = f"choose the column of angles, from 1 to {len(table.names)}"
                raise table.error(reason, hint, argument="angle")
            self._notes += ["no names of columns: the first is taken for the angle"] * several
            return 0
        angles = [index for index, name in self._names.items() if tables.is_angle(name)]
        if len(angles) == 1:
            return angles[0]
        rest = [index for index in self._names if index not in self._counting]
        others = [index for index in rest[1:] if not tables.is_value(table.names[index])]
        if angles or not rest or (len(rest) > 2 and others):
            which = "several columns are" if angles else "no column is"
            reason = f"{which} called an angle; there are {', '.join(table.names)}"
            raise table.error(reason, "choose the column of angles", argument="angle")
        self._notes.append(f"{table.listed(rest[:1])} is taken for the angle")
        return rest[0]

    def _values(self, angles: Collection[int]) -> tuple[tuple[str, ...], Array, list[str]]:
        """Return the names and columns of values, and notes on what is passed over."""
        columns, notes = self._value_columns(angles)
        names = tuple(self._table.names[index] for index in columns)
        return names, self._table.numbers[:, columns], notes

    def _value_columns(self, angles: Collection[int]) -> tuple[list[int], list[str]]:
        table = self._table
        for index, name in self._names.items():
            different = np.unique(table.numbers[:, index]).size
            if tables.is_wavelength(name) and different > 1:
                reason = f"column '{name}' has {different} wavelengths, whose values would be mixed"
                raise table.error(reason, "keep the rows of one")
        if self._options.values:
            return [table.column(name) for name in self._options.values], []
        counting = [index for index in self._counting if index not in angles]
        rest = [index for index in range(len(table.names)) if index not in (*angles, *counting)]
        chosen = [index for index in rest if tables.is_value(self._names.get(index, ""))] or rest
        if not chosen:
            which = "one column is" if len(table.names) == 1 else "the columns are"
            raise table.error(f"{which} not enough", "it takes an angle and a value")
        remark = "counts the rows and is passed over"
        notes = [f"column '{table.names[index]}' {remark}" for index in counting]
        others = [index for index in rest if index not in chosen]
        if others:
            notes.append(
                f"{table.listed(chosen)} taken for values; not read: {table.listed(others)}"
            )
        return chosen, notes

    def _unit(self, columns: Collection[int]) -> str | None:
        """Return the unit of columns of angles that the user or the names say, if they do."""
        asked = self._options.unit
        if asked:
            known = [unit for unit in UNITS if unit.rstrip("s") == asked.lower().rstrip("s")]
            if not known:
                raise unknown_name("angle unit", asked, list(UNITS))
            return known[0]
        headings = [f"{self._table.names[i]} {self._table.units[i]}".lower() for i in columns]
        text = " ".join(headings)
        marked = (unit for unit, marks in _MARKS.items() if any(mark in text for mark in marks))
        return next(marked, None)

    def _unit_of_angle(self, column: int) -> str:
        unit = self._unit([column])
        if unit or self._largest(column) > UNITS["radians"].largest * _SLACK:
            return unit or "degrees"
        raise self._table.error(
            f"column '{self._table.names[column]}' does not say whether it holds degrees, radians "
            "or cosines",
            "name the unit of the angles",
            argument="angle_unit",
        )

    def _unit_of_directions(self, columns: dict[Role, int]) -> str:
        unit = self._unit(columns.values())
        if unit == "cosine":
            raise self._table.error(
                "directions in cosines", "angles in degrees or radians are read"
            )
        if unit is None:
            largest = {role: self._largest(index) for role, index in columns.items()}
            # Zeniths, unless they are called azimuths.
            zenith = max(
                min(largest[zenith], largest.get(azimuth, np.inf))
                for zenith, azimuth in (DIRECTIONS[:2], DIRECTIONS[2:])
                if zenith in largest
            )
            top = max(largest.values())
            is_small = top <= 2 * np.pi * _SLACK and zenith <= np.pi / 2 * _SLACK
            unit = "radians" if is_small else "degrees"
            self._notes.append(f"angles are read in {unit}: the largest is {top:g}")
        return unit

    def _exchanged(self, columns: dict[Role, int], horizon: float) -> dict[Role, int]:
        """Return the columns, zeniths and azimuths exchanged if the ranges allow nothing else."""
        if not all(role in columns for role in DIRECTIONS):
            return columns
        zeniths, azimuths = ([columns[role] for role in DIRECTIONS[n::2]] for n in (0, 1))
        zenith, azimuth = (max(map(self._largest, pair)) for pair in (zeniths, azimuths))
        # All light along the normal, seen along the normal, from many sides: a scan across azimuths
        # that are called zeniths, all of which are 0.
        is_scan = zenith == 0 and azimuth > 0
        if azimuth > horizon * _SLACK or not (zenith > horizon * _SLACK or is_scan):
            return columns
        self._notes.append(
            f"{self._table.listed(azimuths)} are read as zeniths and {self._table.listed(zeniths)} "
            "as azimuths, against their names: the ranges allow nothing else"
        )
        exchanged = (azimuths[0], zeniths[0], azimuths[1], zeniths[1])
        return dict(zip(DIRECTIONS, exchanged, strict=True))

    def _largest(self, column: int) -> float:
        numbers = self._table.numbers[:, column]
        return float(np.abs(numbers[np.isfinite(numbers)]).max(initial=0.0))

    def _incidence(self) -> re.Match[str] | None:
        """Return the angle of incidence that the comments give; None if none or several."""
        matches = [m for comment in self._table.comments for m in _INCIDENCE.finditer(comment)]
        return matches[0] if len({float(match["number"]) for match in matches}) == 1 else None

    def _complete_azimuths(self, angles: dict[Role, Array]) -> None:
        """Add the azimuths that the table does not have."""
        zero = np.zeros_like(angles[Role.theta_o])
        missing = [role for role in (Role.phi_i, Role.phi_o) if role not in angles]
        if not missing:
            return
        if Role.phi in angles:
            note = "one azimuth: it is taken for the difference of the two"
            angles |= {Role.phi_i: zero, Role.phi_o: angles[Role.phi]}
        elif len(missing) == 2:
            note = "no azimuths: all directions are taken to lie in the plane of incidence"
            angles |= {Role.phi_i: zero, Role.phi_o: zero + np.pi}
        else:
            which = "outgoing" if missing == [Role.phi_o] else "incident"
            note = f"no azimuth of the {which} direction: it is taken to be 0"
            angles[missing[0]] = zero
        self._notes.append(note)


def _oriented(data: DirectionalSamples) -> DirectionalSamples:
    """Return samples with the incident directions turned by 180° if the lobe lies there.

    Azimuths of incidence are taken to be those towards the light; a note says if the file turned
    out otherwise, or left it open.
    """
    turned = replace(data, incident=mirrored(data.incident))
    advantage = _fall(turned) - _fall(data)
    if advantage < -_CLEAR:
        note = (
            "the lobe lies where incident and outgoing azimuth are the same: the azimuth of "
            "incidence is that of the light's travel and is turned by 180°"
        )
        return replace(turned, notes=(*data.notes, note))
    is_oblique = np.hypot(*data.incident[:, :2].T).max() > 1e-6
    if advantage > _CLEAR or not is_oblique:
        return data
    note = (
        "the values do not tell on which side the mirror direction lies: it is taken to be "
        "opposite to the azimuth of incidence"
    )
    return replace(data, notes=(*data.notes, note))


def _fall(data: DirectionalSamples) -> float:
    """Return how far the values gather at a small angle of the half vector: negative if so.

    It is the mean angle with the values as weights, every channel as much, less the one without,
    in standard deviations.
    """
    beta = polar_angle(data.half)
    positive = np.maximum(data.values, 0)
    largest = positive.max(axis=0)
    weight = np.sum(positive / np.where(largest > 0, largest, 1), axis=1)
    spread = float(np.std(beta))
    if spread < 1e-9 or not weight.any():
        return 0.0
    return (float(np.average(beta, weights=weight)) - float(np.mean(beta))) / spread


def _read(source: Source, options: ReadOptions) -> Measurements:
    table = parse_table(source.path, source.lines(), by_number=options.by_number)
    return read_table(table, options)


READER = Reader("text", lambda name, head: True, _read)
