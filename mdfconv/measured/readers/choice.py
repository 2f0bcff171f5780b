"""Which columns of a table are read, and in which unit: as the user says, or as their names do."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from pathlib import Path

import numpy as np

from mdfconv.errors import MdfconvError
from mdfconv.measured.readers.base import ReadOptions
from mdfconv.measured.readers.columns import counts_rows, is_value, is_wavelength
from mdfconv.measured.readers.tables import Table
from mdfconv.measured.samples import UNITS
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
