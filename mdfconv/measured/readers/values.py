"""The columns of values of a table: which they are, their uncertainties, their wavelengths."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mdfconv.distributions.evaluation import Array
from mdfconv.measured.readers import tables
from mdfconv.measured.readers.base import ReadOptions
from mdfconv.measured.readers.tables import Table
from mdfconv.measured.samples import note_of

# In nanometres: by so much a wavelength is that of a row, and below it a column has micrometres.
_SAME_WAVELENGTH = 0.01
_SHORTEST = 50.0
# Of expanded uncertainties, which are k times the standard ones.
_COVERAGE = re.compile(r"\bk\s*=\s*(\d*[1-9]\d*(?:\.\d+)?)")
_RELATIVE = re.compile(r"(?<![a-z])rel(?:ative)?(?![a-z])")


@dataclass(frozen=True)
class ReadColumns:
    """What columns hold: angles by their columns, and values of channels, a row each."""

    angles: dict[int, Array]
    values: Array
    channels: tuple[str, ...]
    uncertainty: Array | None
    notes: tuple[str, ...]


class ValueColumns:
    """What the columns of values are: as the user says, then their names, then all that are left.

    Those that are redundant are no values.
    """

    def __init__(self, table: Table, options: ReadOptions, redundant: set[int]) -> None:
        self._table, self._options, self._redundant = table, options, redundant
        self._notes: list[str] = []

    def read(self, angles: set[int]) -> ReadColumns:
        """Return the columns of angles and of values, those of each wavelength a channel."""
        table = self._table
        wavelength = self._wavelength_column(angles)
        taken = angles if wavelength is None else {*angles, wavelength}
        values, uncertainties, notes = self._value_columns(taken)
        numbers = table.numbers
        data = ReadColumns(
            {index: numbers[:, index] for index in angles},
            numbers[:, values],
            tuple(table.names[index] for index in values),
            self._uncertainty(values, uncertainties),
            (*notes, *self._notes),
        )
        return data if wavelength is None else self._by_wavelength(data, wavelength)

    def _value_columns(self, taken: set[int]) -> tuple[list[int], list[int], list[str]]:
        """Return the columns of values and of their uncertainties, and notes on the others."""
        table, options = self._table, self._options
        asked = [table.column(name) for name in options.uncertainty]
        if options.values:
            chosen = [table.column(name) for name in options.values]
            return chosen, self._uncertainty_columns(chosen, taken, asked), []
        counting = sorted(table.counting - taken)
        known = {*taken, *counting, *asked}
        rest = [index for index in range(len(table.names)) if index not in known]
        name = {index: table.named.get(index, "") for index in rest}
        free = [index for index in rest if not tables.is_uncertainty(name[index])]
        free = [index for index in free if index not in self._redundant]
        chosen = [index for index in free if tables.is_value(name[index])] or free
        if not chosen:
            which = "one column is" if len(table.names) == 1 else "the columns are"
            raise table.error(f"{which} not enough", "it takes an angle and a value")
        uncertainties = self._uncertainty_columns(chosen, taken, asked)
        remark = "counts the rows and is passed over"
        notes = [f"column '{table.names[index]}' {remark}" for index in counting]
        read = {*chosen, *uncertainties}
        others = [index for index in rest if index not in read]
        if others:
            notes.append(
                f"{table.listed(chosen)} taken for values; not read: {table.listed(others)}"
            )
        return chosen, uncertainties, notes

    def _uncertainty_columns(
        self, values: Sequence[int], taken: set[int], asked: Sequence[int]
    ) -> list[int]:
        """Return the columns of uncertainties: none, one, or one for each column of values."""
        table = self._table
        if asked:
            if len(asked) not in (1, len(values)):
                reason = f"{len(asked)} columns of uncertainties for {len(values)} of values"
                raise table.error(reason, "one for all, or one for each")
            return list(asked)
        others = {*taken, *values}
        free = [
            index
            for index, name in self._table.named.items()
            if index not in others and tables.is_uncertainty(name)
        ]
        if not free:
            return []
        found = {tables.uncertain_channel(table.names[index]): index for index in free}
        channels = [tables.uncertain_channel(table.names[index]) for index in values]
        if all(channel in found for channel in channels):
            return [found[channel] for channel in channels]
        is_for_any = found.keys() <= {""} and len(free) in (1, len(values))
        return free if is_for_any else []

    def _uncertainty(self, values: Sequence[int], columns: Sequence[int]) -> Array | None:
        """Return the standard uncertainties of columns of values, with a note."""
        table = self._table
        if not columns:
            return None
        each = columns if len(columns) > 1 else [*columns] * len(values)
        scales = [self._scale(column) for column in each]
        of_values = np.abs(table.numbers[:, values])
        with np.errstate(over="ignore", invalid="ignore"):
            scaled = [
                np.where(relative, of_values[:, at], 1.0) * factor
                for at, (relative, factor) in enumerate(scales)
            ]
            result = table.numbers[:, each] * np.stack(scaled, axis=-1)
        relative, factor = scales[0]
        kind = "relative standard" if relative else "standard"
        times = "" if factor == 1 else f", times {factor:g}"
        self._notes.append(f"{table.listed(columns)} read as the {kind} uncertainty{times}")
        return result

    def _scale(self, column: int) -> tuple[bool, float]:
        """Return whether a column has relative uncertainties, and the factor to standard ones."""
        heading = f"{self._table.names[column]} {self._table.units[column]}".lower()
        coverage = _COVERAGE.search(heading)
        factor = 1 / float(coverage[1]) if coverage else 1.0
        if "%" in heading or "percent" in heading:
            return True, factor / 100
        return bool(_RELATIVE.search(heading)), factor

    def _wavelength_column(self, angles: set[int]) -> int | None:
        """Return the column of the wavelengths of the rows, if there is one."""
        table, options = self._table, self._options
        others = {table.column(name) for name in (*options.values, *options.uncertainty)} | angles
        found = [
            index
            for index, name in self._table.named.items()
            if tables.is_wavelength(name) and index not in others
        ]
        if len(found) == 1:
            return found[0]
        if options.wavelength is not None or found:
            reason = (
                f"{table.listed(found)} are wavelengths" if found else "no column of wavelengths"
            )
            raise table.error(reason, "choose the columns of values", argument="values")
        return None

    def _by_wavelength(self, data: ReadColumns, column: int) -> ReadColumns:
        """Return a row for the rows of all wavelengths that have the same directions."""
        table, wanted = self._table, self._options.wavelength
        wavelength = table.numbers[:, column]
        heading = f"{table.names[column]} {table.units[column]}".lower()
        finite = wavelength[np.isfinite(wavelength)]
        is_small = "nm" not in heading and finite.max(initial=0.0) < _SHORTEST
        if is_small or re.search("[uµμ]m|micro", heading):
            wavelength = wavelength * 1e3
        angles = list(data.angles.values())
        whole = np.logical_and.reduce([np.isfinite(each) for each in (wavelength, *angles)])
        notes = note_of(~whole, "rows have no angle or wavelength and are left out")
        if wanted is not None:
            known = ", ".join(f"{each:g}" for each in np.unique(wavelength[whole])[:8])
            whole &= np.abs(wavelength - wanted) <= _SAME_WAVELENGTH
            if not whole.any():
                raise table.error(f"no row of {wanted:g} nm", f"there are {known}")
        if not whole.any():
            raise table.error("no row has an angle and a wavelength")
        rows = np.flatnonzero(whole)
        each, groups = self._rows_of_wavelengths(wavelength[rows], [a[rows] for a in angles])
        rows = rows[groups]
        if len(each) > 1:
            notes += (f"{len(each)} wavelengths, {each[0]:g} to {each[-1]:g} nm, a channel each",)

        def spread(columns: Array) -> Array:
            return np.moveaxis(columns[rows], 0, 1).reshape(len(rows[0]), -1)

        names = data.channels if len(data.channels) > 1 else ("",)
        return ReadColumns(
            {index: column[rows[0]] for index, column in data.angles.items()},
            spread(data.values),
            tuple(f"{name} {number:g} nm".strip() for number in each for name in names),
            None if data.uncertainty is None else spread(data.uncertainty),
            (*data.notes, *notes),
        )

    def _rows_of_wavelengths(
        self, wavelength: Array, angles: Sequence[Array]
    ) -> tuple[Array, NDArray[np.intp]]:
        """Return the wavelengths, and the rows of each, shape (wavelengths, directions)."""
        each, counts = np.unique(wavelength, return_counts=True)
        other = int(np.argmax(counts != counts[0]))
        if counts[other] == counts[0]:
            order = np.lexsort((*angles[::-1], wavelength)).reshape(each.size, -1)
            sorted_ = np.stack([angle[order] for angle in angles])
            differs = (sorted_ != sorted_[:, :1]).any(axis=(0, 2))
            if not differs.any():
                # As they stand in the file.
                return each, order[:, np.argsort(order[0], kind="stable")]
            other = int(np.argmax(differs))
        reason = (
            f"the {each.size} wavelengths do not have the same directions: {each[0]:g} nm has "
            f"{counts[0]} rows, {each[other]:g} nm {counts[other]}"
        )
        raise self._table.error(reason, "keep the rows of one", argument="wavelength")
