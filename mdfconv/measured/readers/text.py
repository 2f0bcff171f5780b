"""Text tables: CSV, TSV or blanks between columns, of one angle or of two directions."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mdfconv.distributions.evaluation import Array
from mdfconv.errors import MdfconvError
from mdfconv.measured.directional import DirectionalSamples, directional_samples
from mdfconv.measured.readers.base import Reader, ReadOptions, Source, decode
from mdfconv.measured.readers.choice import (
    column_of,
    index_columns,
    listed,
    told_unit,
    value_columns,
)
from mdfconv.measured.readers.columns import is_angle, is_counting, is_half, is_value
from mdfconv.measured.readers.directions import directions
from mdfconv.measured.readers.tables import Table, parse_table
from mdfconv.measured.samples import UNITS, Samples, samples
from mdfconv.registry import unknown_name

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
