"""Text tables: CSV, TSV or blanks between columns, of one angle or of two directions."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from mdfconv.brdf.microfacet import mirrored, polar_angle
from mdfconv.distributions.evaluation import Array
from mdfconv.errors import MdfconvError
from mdfconv.measured import samples
from mdfconv.measured.readers import tables
from mdfconv.measured.readers.base import Reader, ReadOptions, Source
from mdfconv.measured.readers.tables import Role, Table, parse_table
from mdfconv.measured.readers.values import ReadColumns, ValueColumns
from mdfconv.measured.samples import UNITS, DirectionalSamples, Measurements, Samples
from mdfconv.registry import unknown_name

# What an angle of a table of one angle can be.
HALF, REFLECTED, INCIDENT, SPECULAR = "half", "reflected", "incident", "specular"
# In the order of an option each: the zeniths are the first and the third.
DIRECTIONS = (Role.theta_i, Role.phi_i, Role.theta_o, Role.phi_o)
_MEANINGS = {
    HALF: Role.angle,
    REFLECTED: Role.theta_o,
    INCIDENT: Role.theta_i,
    SPECULAR: Role.specular,
}
# Those that say where the outgoing direction is.
_OUTGOING = {Role.theta_o, Role.specular}
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
# What is to be done about an angle whose meaning is open.
_GIVE_INCIDENCE = "if these are detector angles give the angle of incidence"
# Files hold rounded angles.
_SLACK = 1 + 1e-6
# How much sooner, in standard deviations of the angle, values fall off with one half vector than
# with the other before it is said to be the right one: those of a diffuse surface differ by less.
_CLEAR = 0.25
# Values of a lobe about β = 0 are not less there than so much of the largest, if that is this far.
_LEAST_AT_NORMAL = 0.5
_FAR_FROM_NORMAL = np.radians(5)
_WINDOW = 5


def read_table(table: Table, options: ReadOptions) -> Measurements:
    """Return the samples of a table, of two directions if its columns are, else of one angle.

    Raises `MdfconvError` if it stays open what the columns hold, or the angles are none.
    """
    meaning = options.angle_is
    if meaning is not None and meaning not in _MEANINGS:
        raise unknown_name("angle", meaning, list(_MEANINGS))
    incidence = options.incidence
    if incidence is not None and not 0 <= incidence < 90:
        raise MdfconvError(f"{table.path}: an angle of incidence of {incidence:g}°", "0 to 90")
    columns = _Columns(table, options)
    return columns.directions() or columns.one_angle()


class _Columns:
    """What the columns of a table are taken for: as the user says, then their names, then numbers.

    Notes say what was assumed.
    """

    def __init__(self, table: Table, options: ReadOptions) -> None:
        self._table, self._options = table, options
        self._notes = list(table.notes)
        # Columns of directions that others say, too.
        self._redundant: set[int] = set()

    def directions(self) -> DirectionalSamples | None:
        """Return samples of two directions; None if the table has no zenith of any."""
        table = self._table
        columns = self._by_role()
        if not columns:
            return None
        unit = self._unit_of_directions(columns)
        fixed = self._fixed_zenith(columns, unit)
        data = self._values(columns.values())
        columns = self._exchanged(columns, 90.0 if unit == "degrees" else np.pi / 2)
        angles = {role: _radians(data.angles[index], unit) for role, index in columns.items()}
        if fixed:
            role, degrees = fixed
            angles[role] = np.full(len(data.values), np.radians(degrees))
        is_specular = Role.specular in angles
        if is_specular:
            angles[Role.theta_o] = self._from_mirror(columns, angles)
        self._complete_azimuths(angles, moves_out=Role.theta_i not in columns)
        light = angles[Role.theta_i], angles[Role.phi_i]
        view = angles[Role.theta_o], angles[Role.phi_o]
        found = samples.directional_samples(
            table.path,
            *(*light, *view, data.values),
            channels=data.channels,
            notes=(*self._notes, *data.notes),
            about=table.about,
            uncertainty=data.uncertainty,
        )
        return found if is_specular else oriented(found)

    def one_angle(self) -> Samples:
        """Return samples against the angle of the half vector."""
        table, options = self._table, self._options
        column = self._angle_column()
        is_half = self._is_half(column)
        if options.incidence is not None:
            reason = f"{table.listed([column])} holds the angle of the half vector"
            raise table.error(reason, "it has no angle of incidence")
        data, unit = self._values([column]), self._unit_of_angles([column])
        # The column may have been looked for twice.
        notes = (*dict.fromkeys(self._notes), *data.notes)
        if not is_half:
            other = "" if options.angle_is else ", not of a direction"
            read = f"{table.listed([column])} is read as the angle between normal and half vector"
            notes += (read + other,)
        angle = data.angles[column]
        is_assumed = not (is_half or options.angle_is)
        what = data.values, data.channels, "ndf", notes, table.about, data.uncertainty
        try:
            result = samples.samples(table.path, angle, unit, *what)
        except MdfconvError as error:
            negative = np.isfinite(angle) & (angle < 0)
            if not (is_assumed and negative.any()):
                raise
            raise MdfconvError(error.reason, _GIVE_INCIDENCE, argument="incidence") from None
        peak = _peak_off_normal(result) if is_assumed else None
        if peak is not None:
            reason = f"{table.listed([column])} is no angle of half vectors: there is no lobe to "
            reason += f"fit about 0, the values peak at {np.degrees(peak):.3g} degrees"
            raise table.error(reason, _GIVE_INCIDENCE, argument="incidence")
        return result

    def _by_role(self) -> dict[Role, int]:
        """Return the columns of directions by what they hold; none if the angle is of one."""
        table, options = self._table, self._options
        named = {role: getattr(options, role.name) for role in DIRECTIONS}
        chosen = {role: self._chosen(role, name) for role, name in named.items() if name}
        if options.angle is not None or options.angle_is is not None:
            if chosen:
                reason = "columns are chosen of one angle and of two directions"
                raise table.error(reason, "choose either")
            index = self._angle_column()
            role = self._role_of_one(index)
            if role is Role.angle:
                return {}
            chosen = {role: index}
        columns, bare = self._with_names(chosen)
        if not columns.keys() & _OUTGOING:
            if Role.theta_i in columns:
                outgoing = bare
            elif options.incidence is not None:
                outgoing = bare if len(bare) == 1 else [self._angle_column()]
                outgoing = [index for index in outgoing if not self._is_half(index)]
            else:
                outgoing = []
            if len(outgoing) == 1:
                columns[Role.theta_o] = outgoing[0]
                self._notes.append(f"{table.listed(outgoing)} is taken for the {Role.theta_o}")
        if columns.keys() & {Role.theta_i, *_OUTGOING}:
            return columns
        if chosen:
            hint = f"name both; there are {table.known}"
            raise table.error("no column of the zenith of both directions", hint)
        return {}

    def _chosen(self, role: Role, name: str) -> int:
        """Return the column that the user chooses for a direction."""
        table = self._table
        try:
            return table.column(name)
        except MdfconvError as error:
            if role is not Role.theta_i or not re.fullmatch(r"\d+(\.\d*)?", name):
                raise
            hint = f"{error.hint}; an angle of incidence is given by itself"
            raise MdfconvError(error.reason, hint, argument="incidence") from None

    def _with_names(self, chosen: dict[Role, int]) -> tuple[dict[Role, int], list[int]]:
        """Return the columns of directions with those that names say, and those of any angle."""
        table, options = self._table, self._options
        others = {table.column(name) for name in (*options.values, *options.uncertainty)}
        columns, bare = dict(chosen), []
        for index, name in self._table.named.items():
            role = tables.role_of(name)
            if role is None or role in chosen or index in others or index in chosen.values():
                continue
            if role is Role.angle:
                bare.append(index)
            elif role in columns:
                both = table.listed([columns[role], index])
                argument = role.name if role in DIRECTIONS else ""
                raise table.error(f"{both} are both the {role}", "choose one", argument=argument)
            else:
                columns[role] = index
        if columns.keys() >= _OUTGOING:
            # One of them says it all.
            other = Role.theta_o if Role.specular in chosen else Role.specular
            self._redundant.add(columns.pop(other))
        return columns, bare

    def _role_of_one(self, index: int) -> Role:
        """Return what the column of a table of one angle holds."""
        options = self._options
        if options.angle_is:
            return _MEANINGS[options.angle_is]
        role = tables.role_of(self._table.named.get(index, ""))
        if role in (Role.theta_i, *_OUTGOING):
            return role
        is_scan = options.incidence is not None and not self._is_half(index)
        return Role.theta_o if is_scan else Role.angle

    def _is_half(self, index: int) -> bool:
        return tables.is_half(self._table.named.get(index, ""))

    def _fixed_zenith(self, columns: dict[Role, int], unit: str) -> tuple[Role, float] | None:
        """Return the direction whose zenith no column has, and that in degrees."""
        table, options = self._table, self._options
        has_outgoing = columns.keys() & _OUTGOING
        moves_in = Role.theta_i in columns
        if moves_in and options.incidence is not None:
            if has_outgoing or options.angle_is != INCIDENT:
                reason = f"{table.listed([columns[Role.theta_i]])} has the angle of incidence"
                raise table.error(reason, "leave out the one for all rows")
        elif moves_in and has_outgoing:
            return None
        fixed = Role.theta_i if has_outgoing else Role.theta_o
        if options.incidence is not None:
            return fixed, options.incidence
        comment = self._incidence() if has_outgoing else None
        if comment:
            number, mark = float(comment["number"]), comment["unit"]
            stored = _INCIDENCE_UNITS[mark.lower()] if mark else unit
            self._notes.append(
                f"the angle of incidence, {number:g} {stored}, is from the comment "
                f"'{comment.string[:60]}'"
            )
            return fixed, float(np.degrees(number)) if stored == "radians" else number
        meaning = options.angle_is
        if meaning in (REFLECTED, INCIDENT):
            still = INCIDENT if meaning == REFLECTED else REFLECTED
            taken = f"the {still} one is taken to be the normal"
            self._notes.append(f"the angle is that of the {meaning} direction; {taken}")
            return fixed, 0.0
        if not has_outgoing:
            hint = f"name both; there are {table.known}"
            raise table.error("no column of the zenith of both directions", hint)
        role = next(iter(has_outgoing))
        reason = f"{table.listed([columns[role]])} is the {role}, and the incident one is missing"
        raise table.error(reason, "give the angle of incidence", argument="incidence")

    def _from_mirror(self, columns: dict[Role, int], angles: dict[Role, Array]) -> Array:
        """Return the outgoing zeniths of a scan about the mirror direction."""
        table, index = self._table, columns[Role.specular]
        if columns.keys() & {Role.phi_i, Role.phi_o, Role.phi}:
            reason = f"{table.listed([index])} is the {Role.specular}, and there are azimuths"
            raise table.error(reason, "it is read in the plane of incidence")
        sign = tables.sign_from_mirror(self._table.named.get(index, "")) or 1
        where = "horizon" if sign > 0 else "normal"
        self._notes.append(
            f"{table.listed([index])} is the {Role.specular}, positive towards the {where}"
        )
        return angles[Role.theta_i] + sign * angles[Role.specular]

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
        named, wanted = table.named, _MEANINGS.get(self._options.angle_is or "")
        angles = [index for index, name in named.items() if tables.is_angle(name)]
        meant = [index for index in angles if wanted and tables.role_of(named[index]) is wanted]
        if len(angles) == 1 or len(meant) == 1:
            return (*meant, *angles)[0]
        passed = {index for index, name in named.items() if _is_beside(name)} | table.counting
        rest = [index for index in named if index not in passed]
        others = [index for index in rest[1:] if not tables.is_value(named[index])]
        if angles or not rest or (len(rest) > 2 and others):
            which = "several columns are" if angles else "no column is"
            reason = f"{which} called an angle; there are {table.known}"
            raise table.error(reason, "choose the column of angles", argument="angle")
        self._notes.append(f"{table.listed(rest[:1])} is taken for the angle")
        return rest[0]

    def _values(self, angles: Collection[int]) -> ReadColumns:
        return ValueColumns(self._table, self._options, self._redundant).read(set(angles))

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

    def _unit_of_angles(self, columns: Sequence[int]) -> str:
        unit = self._unit(columns)
        if unit or max(map(self._largest, columns)) > UNITS["radians"].largest * _SLACK:
            return unit or "degrees"
        raise self._table.error(
            f"column '{self._table.names[columns[0]]}' does not say whether it holds degrees, "
            "radians or cosines",
            "name the unit of the angles",
            argument="angle_unit",
        )

    def _unit_of_directions(self, columns: dict[Role, int]) -> str:
        is_specular = Role.specular in columns
        is_scan = len(columns) == 1 and not is_specular
        # A narrow range of degrees looks like one of radians.
        is_open = is_specular or (is_scan and self._options.angle_is is not None)
        indices = list(columns.values())
        unit = self._unit_of_angles(indices) if is_open else self._unit(indices)
        if unit == "cosine" and not is_scan:
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
        """Return the columns, zeniths and azimuths exchanged if the ranges allow nothing else.

        Those that the user chooses are not.
        """
        is_chosen = any(getattr(self._options, role.name) for role in DIRECTIONS)
        if is_chosen or not all(role in columns for role in DIRECTIONS):
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

    def _complete_azimuths(self, angles: dict[Role, Array], *, moves_out: bool) -> None:
        """Add the azimuths that the table does not have; 0 is that of the direction that moves."""
        zero = np.zeros_like(angles[Role.theta_o])
        missing = [role for role in (Role.phi_i, Role.phi_o) if role not in angles]
        if not missing:
            return
        if Role.phi in angles:
            note = "one azimuth: it is taken for the difference of the two"
            angles |= {Role.phi_i: zero, Role.phi_o: angles[Role.phi]}
        elif len(missing) == 2:
            note = "no azimuths: all directions are taken to lie in the plane of incidence"
            still, moving = (Role.phi_i, Role.phi_o) if moves_out else (Role.phi_o, Role.phi_i)
            angles |= {moving: zero, still: zero + np.pi}
        else:
            which = "outgoing" if missing == [Role.phi_o] else "incident"
            note = f"no azimuth of the {which} direction: it is taken to be 0"
            angles[missing[0]] = zero
        self._notes.append(note)


def _is_beside(name: str) -> bool:
    """Return whether a name is that of a column beside angles and values."""
    return tables.is_uncertainty(name) or tables.is_wavelength(name)


def oriented(data: DirectionalSamples) -> DirectionalSamples:
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
    sines = np.hypot(*data.incident[:, :2].T) * np.hypot(*data.outgoing[:, :2].T)
    is_oblique = sines.max() > 1e-6
    if advantage > _CLEAR or not is_oblique:
        return data
    note = (
        "the values do not tell on which side the mirror direction lies: it is taken to be "
        "opposite to the azimuth of incidence"
    )
    return replace(data, notes=(*data.notes, note))


def _radians(angle: Array, unit: str) -> Array:
    """Return zeniths or azimuths in radians; NaN, which is left out, for what is no cosine."""
    if unit == "cosine":
        angle = np.where(np.abs(angle) <= 1, angle, np.nan)
    return UNITS[unit].to_radians(angle)


def _peak_off_normal(data: Samples) -> float | None:
    """Return where values are largest, radians, if they do not fall off from β = 0."""
    largest = np.abs(data.values).max(axis=0)
    curve = np.sum(data.values / np.where(largest > 0, largest, 1), axis=1)
    if curve.size < _WINDOW:
        return None
    # A single row may be an outlier.
    smooth = np.median(sliding_window_view(curve, _WINDOW), axis=-1)
    at = int(np.argmax(smooth))
    peak = float(data.beta[at + _WINDOW // 2])
    is_far = peak - data.beta[0] > _FAR_FROM_NORMAL
    is_low = curve[: _WINDOW // 2 + 1].max() < _LEAST_AT_NORMAL * smooth[at]
    return peak if is_far and is_low else None


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
