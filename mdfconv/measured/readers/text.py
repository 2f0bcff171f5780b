"""Text tables: CSV, TSV or blanks between columns, of one angle or of two directions."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from mdfconv.brdf.microfacet import polar_angle
from mdfconv.distributions.evaluation import Array
from mdfconv.errors import MdfconvError
from mdfconv.measured.readers.base import Reader, ReadOptions, Source, decode
from mdfconv.measured.readers.tables import (
    Role,
    Table,
    counts_rows,
    is_angle,
    is_counting,
    is_half,
    is_value,
    is_wavelength,
    parse_table,
    role_of,
)
from mdfconv.measured.samples import (
    UNITS,
    DirectionalSamples,
    Samples,
    directional_samples,
    samples,
)
from mdfconv.registry import unknown_name

# What the name of a column says of its unit.
_HINTS = {
    "cosine": re.compile(r"cos", re.I),
    "degrees": re.compile(r"deg|°", re.I),
    "radians": re.compile(r"rad", re.I),
}


def column_of(path: Path, name: str, table: Table) -> int:
    """Return the index of a column that the user names, or numbers from 1.

    Raises
    ------
    MdfconvError
        If there is none.
    """
    lowered = [heading.lower() for heading in table.names]
    if name.lower() in lowered:
        return lowered.index(name.lower())
    if name.isdecimal() and 1 <= int(name) <= len(table.names):
        return int(name) - 1
    raise MdfconvError(f"{path}: no column '{name}'", f"there are {', '.join(table.names)}")


def index_columns(table: Table) -> list[int]:
    """Return the columns that are called an index and count the rows."""
    if not table.is_named:
        return []
    return [
        index
        for index, name in enumerate(table.names)
        if counts_rows(name, table.numbers[:, index])
    ]


def value_columns(
    path: Path, table: Table, options: ReadOptions, angles: Collection[int]
) -> tuple[list[int], tuple[str, ...]]:
    """Return the columns of values, and notes on what is passed over.

    Parameters
    ----------
    path : Path
        The file, for messages.
    table : Table
        Its numbers.
    options : ReadOptions
        The choice of the user goes before what the names say.
    angles : collection of int
        The columns that are taken for angles.

    Raises
    ------
    MdfconvError
        If none is left, a chosen one does not exist, or rows are of different wavelengths.
    """
    _check_wavelength(path, table)
    if options.values:
        return [column_of(path, name, table) for name in options.values], ()
    counting = [index for index in index_columns(table) if index not in angles]
    rest = [index for index in range(len(table.names)) if index not in (*angles, *counting)]
    called = [index for index in rest if table.is_named and is_value(table.names[index])]
    chosen = called or rest
    if not chosen:
        raise MdfconvError(
            f"{path}: {'one column is' if len(table.names) == 1 else 'the columns are'} not enough",
            "it takes an angle and a value",
        )
    notes = [
        f"column '{table.names[index]}' counts the rows and is passed over" for index in counting
    ]
    others = [index for index in rest if index not in chosen]
    if others:
        notes.append(f"{listed(table, chosen)} taken for values; not read: {listed(table, others)}")
    return chosen, tuple(notes)


def listed(table: Table, columns: Sequence[int]) -> str:
    """Return columns as a message names them."""
    names = ", ".join(f"'{table.names[index]}'" for index in columns)
    return f"column{'s' if len(columns) > 1 else ''} {names}"


def told_unit(options: ReadOptions, table: Table, columns: Collection[int]) -> str | None:
    """Return the unit of columns of angles that the user or the names say; None if they do not.

    Raises
    ------
    MdfconvError
        If the user asks for one that is not known.
    """
    if options.unit:
        wanted = options.unit.lower().rstrip("s")
        known = [unit for unit in UNITS if unit.rstrip("s") == wanted]
        if not known:
            raise unknown_name("angle unit", options.unit, list(UNITS))
        return known[0]
    for unit, pattern in _HINTS.items():
        if any(pattern.search(f"{table.names[i]} {table.units[i]}") for i in columns):
            return unit
    return None


def _check_wavelength(path: Path, table: Table) -> None:
    for index, name in enumerate(table.names):
        different = np.unique(table.numbers[:, index]).size
        if table.is_named and is_wavelength(name) and different > 1:
            raise MdfconvError(
                f"{path}: column '{name}' has {different} wavelengths, whose values would be mixed",
                "keep the rows of one",
            )


# How much sooner, in standard deviations of the angle, values fall off with one half vector than
# with the other before it is said to be the right one: those of a diffuse surface differ by less.
_CLEAR = 0.25
_TURN = np.array([-1.0, -1.0, 1.0])


def oriented(samples: DirectionalSamples) -> DirectionalSamples:
    """Return samples with the incident directions turned by 180° if the lobe lies there.

    Parameters
    ----------
    samples : DirectionalSamples
        Samples whose azimuths of incidence are taken to be those towards the light.

    Returns
    -------
    DirectionalSamples
        The same, or turned; a note says which if the file left it open.
    """
    turned = replace(samples, incident=samples.incident * _TURN)
    literal_fall, turned_fall = _fall(samples), _fall(turned)
    if turned_fall < literal_fall - _CLEAR:
        note = (
            "the lobe lies where incident and outgoing azimuth are the same: the azimuth of "
            "incidence is that of the light's travel and is turned by 180°"
        )
        return replace(turned, notes=(*samples.notes, note))
    if literal_fall < turned_fall - _CLEAR or not _is_oblique(samples):
        return samples
    note = (
        "the values do not tell on which side the mirror direction lies: it is taken to be "
        "opposite to the azimuth of incidence"
    )
    return replace(samples, notes=(*samples.notes, note))


def _is_oblique(samples: DirectionalSamples) -> bool:
    return bool(np.hypot(*samples.incident[:, :2].T).max() > 1e-6)


def _fall(samples: DirectionalSamples) -> float:
    """Return how far the values gather at a small angle of the half vector: negative if so.

    It is the mean angle with the values as weights, less the one without, in standard
    deviations.
    """
    beta = polar_angle(samples.half)
    weight = _brightness(samples.values)
    spread = float(np.std(beta))
    if spread < 1e-9 or not weight.any():
        return 0.0
    return (float(np.average(beta, weights=weight)) - float(np.mean(beta))) / spread


def _brightness(values: Array) -> Array:
    """Return one weight for each row, in which every channel counts as much."""
    positive = np.maximum(values, 0)
    largest = positive.max(axis=0)
    return np.sum(positive / np.where(largest > 0, largest, 1), axis=1)


# The angle of incidence as a comment says it.
_INCIDENCE = re.compile(
    r"\b(?:theta_?(?:i|in|inc)|θ_?(?:i|in)|aoi|(?:angle of )?incidence(?: angle)?|incident angle)"
    r"\s*(?:\(\w*\)|\[\w*\])?\s*[:=]\s*(?P<number>[-+]?\d+(?:\.\d*)?)\s*(?P<unit>deg|°|rad)?",
    re.I,
)
_OPTIONS = {
    Role.theta_i: "theta_i",
    Role.phi_i: "phi_i",
    Role.theta_o: "theta_o",
    Role.phi_o: "phi_o",
}
# Files hold rounded angles.
_SLACK = 1 + 1e-6


@dataclass(frozen=True)
class _Incidence:
    """An angle of incidence that a comment gives; its unit may be left open."""

    angle: float
    unit: str | None
    comment: str


def directions(path: Path, table: Table, options: ReadOptions) -> DirectionalSamples | None:
    """Return the samples of a table of two directions; None if it is not one.

    Parameters
    ----------
    path : Path
        The file, for messages.
    table : Table
        Its numbers.
    options : ReadOptions
        The columns that the user names go before what the names of the columns say.

    Raises
    ------
    MdfconvError
        If the user names columns of directions and one direction is missing, if two columns are
        the same angle by their names, or the angles are cosines.
    """
    columns, notes = _angle_columns(path, table, options)
    incidence = None if Role.theta_i in columns else _incidence(table)
    if Role.theta_o not in columns or not (Role.theta_i in columns or incidence):
        if any(getattr(options, name) for name in _OPTIONS.values()):
            raise MdfconvError(
                f"{path}: no column of the zenith of both directions",
                f"name both; there are {', '.join(table.names)}",
            )
        return None
    channels, about_values = value_columns(path, table, options, columns.values())
    columns, unit, about_angles = _understood(path, table, options, columns)
    to_radians = np.pi / 180 if unit == "degrees" else 1.0
    angles = {role: table.numbers[:, index] * to_radians for role, index in columns.items()}
    if incidence:
        stored = incidence.unit or unit
        angle = np.radians(incidence.angle) if stored == "degrees" else incidence.angle
        angles[Role.theta_i] = np.full(len(table.numbers), angle)
        about_angles += (
            f"the angle of incidence, {incidence.angle:g} {stored}, is from the comment "
            f"'{incidence.comment[:60]}'",
        )
    azimuths, about_azimuths = _azimuths(angles)
    return oriented(
        directional_samples(
            path,
            angles[Role.theta_i],
            azimuths[0],
            angles[Role.theta_o],
            azimuths[1],
            table.numbers[:, channels],
            tuple(table.names[index] for index in channels),
            (*table.notes, *notes, *about_angles, *about_azimuths, *about_values),
        )
    )


def _angle_columns(
    path: Path, table: Table, options: ReadOptions
) -> tuple[dict[Role, int], tuple[str, ...]]:
    """Return the columns of angles by what they hold."""
    columns: dict[Role, int] = {}
    for role, option in _OPTIONS.items():
        if name := getattr(options, option):
            columns[role] = column_of(path, name, table)
    unnamed = [
        index
        for index in range(len(table.names))
        if table.is_named
        and index not in columns.values()
        and table.names[index] not in options.values
    ]
    chosen = set(columns)
    bare = []
    for index in unnamed:
        said = role_of(table.names[index])
        if said is Role.angle:
            bare.append(index)
        elif said and said not in chosen:
            if said in columns:
                raise MdfconvError(
                    f"{path}: {listed(table, [columns[said], index])} are both the {said}",
                    "choose one",
                    argument=_OPTIONS.get(said, ""),
                )
            columns[said] = index
    if Role.theta_i in columns and Role.theta_o not in columns and len(bare) == 1:
        columns[Role.theta_o] = bare[0]
        return columns, (f"{listed(table, bare)} is taken for the {Role.theta_o}",)
    return columns, ()


def _incidence(table: Table) -> _Incidence | None:
    """Return the angle of incidence that the comments give; None if none or several."""
    found = [
        (match, comment) for comment in table.comments for match in _INCIDENCE.finditer(comment)
    ]
    if len({float(match["number"]) for match, _ in found}) != 1:
        return None
    match, comment = found[0]
    unit = match["unit"]
    name = None if unit is None else "radians" if unit.lower() == "rad" else "degrees"
    return _Incidence(float(match["number"]), name, comment)


def _understood(
    path: Path, table: Table, options: ReadOptions, columns: dict[Role, int]
) -> tuple[dict[Role, int], str, tuple[str, ...]]:
    """Return the columns, zenith and azimuth exchanged if their ranges say so, and the unit."""
    notes: tuple[str, ...] = ()
    largest = {role: _largest(table.numbers[:, index]) for role, index in columns.items()}
    unit = told_unit(options, table, columns.values())
    if unit == "cosine":
        raise MdfconvError(
            f"{path}: directions in cosines", "angles in degrees or radians are read"
        )
    if unit is None:
        top = max(largest.values())
        zenith = max(
            min(largest[zenith], largest.get(azimuth, np.inf))
            for zenith, azimuth in ((Role.theta_i, Role.phi_i), (Role.theta_o, Role.phi_o))
            if zenith in largest
        )
        small = top <= 2 * np.pi * _SLACK and zenith <= np.pi / 2 * _SLACK
        unit = "radians" if small else "degrees"
        notes = (f"angles are read in {unit}: the largest is {top:g}",)
    if all(role in columns for role in _OPTIONS) and _is_exchanged(
        largest, 90.0 if unit == "degrees" else np.pi / 2
    ):
        zeniths = [columns[Role.theta_i], columns[Role.theta_o]]
        azimuths = [columns[Role.phi_i], columns[Role.phi_o]]
        columns = dict(
            zip(_OPTIONS, (azimuths[0], zeniths[0], azimuths[1], zeniths[1]), strict=True)
        )
        notes += (
            f"{listed(table, azimuths)} are read as zeniths and {listed(table, zeniths)} as "
            "azimuths, against their names: the ranges allow nothing else",
        )
    return columns, unit, notes


def _largest(numbers: Array) -> float:
    finite = np.abs(numbers[np.isfinite(numbers)])
    return float(finite.max(initial=0.0))


def _is_exchanged(largest: dict[Role, float], horizon: float) -> bool:
    """Return whether what is called zenith cannot be one, but what is called azimuth can."""
    zenith = max(largest[Role.theta_i], largest[Role.theta_o])
    azimuth = max(largest[Role.phi_i], largest[Role.phi_o])
    if azimuth > horizon * _SLACK:
        return False
    # All light along the normal, seen along the normal, from many sides: a scan across azimuths
    # that are called zeniths, all of which are 0.
    return zenith > horizon * _SLACK or (zenith == 0 and azimuth > 0)


def _azimuths(angles: dict[Role, Array]) -> tuple[tuple[Array, Array], tuple[str, ...]]:
    """Return the azimuths of the incident and the outgoing direction, radians."""
    zero = np.zeros_like(angles[Role.theta_o])
    incident, outgoing = angles.get(Role.phi_i), angles.get(Role.phi_o)
    if incident is not None and outgoing is not None:
        return (incident, outgoing), ()
    if Role.phi in angles:
        note = "one azimuth: it is taken for the difference of the two"
        return (zero, angles[Role.phi]), (note,)
    if incident is None and outgoing is None:
        note = "no azimuths: all directions are taken to lie in the plane of incidence"
        return (zero, zero + np.pi), (note,)
    which = "outgoing" if outgoing is None else "incident"
    note = f"no azimuth of the {which} direction: it is taken to be 0"
    return (
        zero if incident is None else incident,
        zero if outgoing is None else outgoing,
    ), (note,)


# What an angle of a table of one angle can be.
HALF, REFLECTED, INCIDENT = "half", "reflected", "incident"
_MEANINGS = (HALF, REFLECTED, INCIDENT)


def _read(source: Source, options: ReadOptions) -> Samples | DirectionalSamples:
    return read_table(source.path, parse_table(source.path, decode(source).splitlines()), options)


def read_table(path: Path, table: Table, options: ReadOptions) -> Samples | DirectionalSamples:
    """Return the samples of a table, of two directions if its columns are, else of one angle.

    Parameters
    ----------
    path : Path
        The file, for messages.
    table : Table
        Its numbers.
    options : ReadOptions
        A chosen column of one angle makes it a table of one angle.

    Raises
    ------
    MdfconvError
        If it stays open what the columns hold, or the angles are none.
    """
    meaning = options.angle_is
    if meaning not in (None, *_MEANINGS):
        raise unknown_name("angle", meaning, list(_MEANINGS))
    if options.angle is None and meaning is None:
        found = directions(path, table, options)
        if found is not None:
            return found
    column, about_angle = _angle_column(path, table, options)
    channels, about_values = value_columns(path, table, options, [column])
    angle, values = table.numbers[:, column], table.numbers[:, channels]
    unit = _unit(path, table, options, column)
    names = tuple(table.names[index] for index in channels)
    notes = (*table.notes, *about_angle, *about_values)
    if meaning in (REFLECTED, INCIDENT):
        return _along_the_normal(path, angle, unit, values, names, notes, meaning == INCIDENT)
    if not (table.is_named and is_half(table.names[column])):
        other = "" if meaning else ", not of a direction (--angle-is)"
        read = f"{listed(table, [column])} is read as the angle between normal and half vector"
        notes += (read + other,)
    return samples(path, angle, unit, values, names, "ndf", notes)


def _angle_column(path: Path, table: Table, options: ReadOptions) -> tuple[int, tuple[str, ...]]:
    """Return the column of angles of a table of one angle."""
    if options.angle is not None:
        return column_of(path, options.angle, table), ()
    if not table.is_named:
        if len(table.names) > 2 and is_counting(table.numbers[:, 0]):
            raise MdfconvError(
                f"{path}: column 1 counts 0, 1, 2 … or 1, 2, 3 …: an index, or degrees",
                f"choose the column of angles, from 1 to {len(table.names)}",
                argument="angle",
            )
        several = len(table.names) > 2
        return 0, ("no names of columns: the first is taken for the angle",) * several
    called = [index for index, name in enumerate(table.names) if is_angle(name)]
    if len(called) == 1:
        return called[0], ()
    counting = index_columns(table)
    rest = [index for index in range(len(table.names)) if index not in counting]
    others = [index for index in rest[1:] if not is_value(table.names[index])]
    if called or not rest or (len(rest) > 2 and others):
        raise MdfconvError(
            f"{path}: {'several columns are' if called else 'no column is'} called an angle; "
            f"there are {', '.join(table.names)}",
            "choose the column of angles",
            argument="angle",
        )
    return rest[0], (f"{listed(table, rest[:1])} is taken for the angle",)


def _unit(path: Path, table: Table, options: ReadOptions, column: int) -> str:
    told = told_unit(options, table, [column])
    if told:
        return told
    angle = table.numbers[:, column]
    if np.max(np.abs(angle[np.isfinite(angle)]), initial=0) > UNITS["radians"].largest * (1 + 1e-6):
        return "degrees"
    raise MdfconvError(
        f"{path}: column '{table.names[column]}' does not say whether it holds degrees, radians "
        "or cosines",
        "name the unit of the angles",
        argument="angle_unit",
    )


def _along_the_normal(
    path: Path,
    angle: Array,
    unit: str,
    values: Array,
    names: tuple[str, ...],
    notes: tuple[str, ...],
    is_incident: bool,
) -> DirectionalSamples:
    """Return samples of which one direction is the normal and the other at the angle."""
    if unit == "cosine":
        # NaN outside the range, which is left out with a note.
        angle = np.where(np.abs(angle) <= 1, angle, np.nan)
    theta = UNITS[unit].to_radians(angle)
    zero = np.zeros_like(theta)
    moving, still = (INCIDENT, REFLECTED) if is_incident else (REFLECTED, INCIDENT)
    note = f"the angle is that of the {moving} direction; the {still} one is taken to be the normal"
    first, second = (theta, zero) if is_incident else (zero, theta)
    return directional_samples(path, first, zero, second, zero, values, names, (*notes, note))


READER = Reader("text", lambda name, head: True, _read)
