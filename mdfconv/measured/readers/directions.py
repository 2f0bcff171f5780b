"""Tables of values against two directions: which columns hold them, and how."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mdfconv.distributions.evaluation import Array
from mdfconv.errors import MdfconvError
from mdfconv.measured.directional import DirectionalSamples, directional_samples
from mdfconv.measured.readers.base import ReadOptions
from mdfconv.measured.readers.choice import column_of, listed, told_unit, value_columns
from mdfconv.measured.readers.columns import Role, role_of
from mdfconv.measured.readers.orientation import oriented
from mdfconv.measured.readers.tables import Table

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
