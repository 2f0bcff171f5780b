"""Text files: CSV, TSV or blanks between columns, and the ALTA library's 1-D format."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mdfconv.distributions.evaluation import Array
from mdfconv.errors import MdfconvError
from mdfconv.measured.samples import UNITS, Samples, samples

# What the name of a column says of its unit.
_HINTS = {
    "cosine": re.compile(r"cos", re.I),
    "degrees": re.compile(r"deg|°", re.I),
    "radians": re.compile(r"rad", re.I),
}
_ALTA_INPUTS = {"COS_TH": "cosine", "COS_TH_H": "cosine", "TH": "radians", "TH_H": "radians"}


@dataclass(frozen=True)
class Columns:
    """Which columns to read: the user's choice, by name or by number from 1.

    Parameters
    ----------
    angle : str
        The column of angles.
    unit : str or None
        ``"degrees"``, ``"radians"`` or ``"cosine"``; None to take it from the header.
    values : tuple of str
        The columns of values; empty for all others.
    """

    angle: str = "1"
    unit: str | None = None
    values: tuple[str, ...] = ()

    def refuse(self, path: Path, reason: str) -> None:
        """Raise if columns are chosen for a file that leaves no choice."""
        if self != Columns():
            raise MdfconvError(f"{path}: {reason}", "choose no columns and no unit")


def read_text(path: Path, columns: Columns) -> Samples:
    """Read a text file of samples.

    Parameters
    ----------
    path : Path
        The file, UTF-8. Lines that start with # are comments, but for ALTA's header.
    columns : Columns
        Which columns hold what.

    Raises
    ------
    MdfconvError
        If the file is not text, has no numbers or not the columns asked for.
    """
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except UnicodeDecodeError as error:
        raise MdfconvError(
            f"{path}: not UTF-8 text (byte {error.start + 1})", "convert its encoding first"
        ) from None
    tags = dict(re.findall(r"^#\s*(DIM|PARAM_IN|PARAM_OUT)\s+(.+?)\s*$", "\n".join(lines), re.M))
    header, table = _table(path, lines)
    if "DIM" in tags:
        columns.refuse(path, "ALTA's header names its columns")
        return _alta(path, tags, table)
    angle = _column(path, columns.angle, header, table)
    chosen = [_column(path, name, header, table) for name in columns.values]
    chosen = chosen or [index for index in range(table.shape[1]) if index != angle]
    if not chosen:
        raise MdfconvError(f"{path}: one column is not enough", "it takes an angle and a value")
    unit = _unit(path, columns.unit, header[angle], table[:, angle])
    names = tuple(header[index] for index in chosen)
    return samples(path, table[:, angle], unit, table[:, chosen], names, "ndf")


def _table(path: Path, lines: list[str]) -> tuple[list[str], Array]:
    """Return the names of the columns and the numbers."""
    rows = [(number, line.strip()) for number, line in enumerate(lines, start=1)]
    rows = [(number, line) for number, line in rows if line and not line.startswith("#")]
    header: list[str] = []
    numbers: list[list[float]] = []
    for index, (number, line) in enumerate(rows):
        cells = [cell.strip().strip('"') for cell in _split(line)]
        try:
            numbers.append([float(cell) if cell else np.nan for cell in cells])
        except ValueError:
            if index:
                raise MdfconvError(f"{path}, line {number}: not numbers: {line[:60]}") from None
            header = cells
    if not numbers:
        raise MdfconvError(f"{path}: no numeric rows")
    width = len(header or numbers[0])
    for (number, _), row in zip(rows[len(rows) - len(numbers) :], numbers, strict=True):
        if len(row) != width:
            raise MdfconvError(f"{path}, line {number}: {len(row)} columns where {width} go")
    return header or [str(index + 1) for index in range(width)], np.array(numbers)


def _split(line: str) -> list[str]:
    for separator in (",", ";", "\t"):
        if separator in line:
            return line.split(separator)
    return line.split()


def _column(path: Path, name: str, header: list[str], table: Array) -> int:
    lowered = [heading.lower() for heading in header]
    if name.lower() in lowered:
        return lowered.index(name.lower())
    if name.isdecimal() and 1 <= int(name) <= table.shape[1]:
        return int(name) - 1
    raise MdfconvError(f"{path}: no column '{name}'", f"there are {', '.join(header)}")


def _unit(path: Path, wanted: str | None, name: str, angle: Array) -> str:
    if wanted:
        known = [unit for unit in UNITS if unit.rstrip("s") == wanted.lower().rstrip("s")]
        if not known:
            raise MdfconvError(f"unknown angle unit '{wanted}'", f"known: {', '.join(UNITS)}")
        return known[0]
    for unit, pattern in _HINTS.items():
        if pattern.search(name):
            return unit
    if np.nanmax(angle) > UNITS["radians"].largest * (1 + 1e-6):
        return "degrees"
    raise MdfconvError(
        f"{path}: column '{name}' does not say whether it holds degrees, radians or cosines",
        "name the unit of the angles",
        argument="angle_unit",
    )


def _alta(path: Path, tags: dict[str, str], table: Array) -> Samples:
    """Interpret ALTA's header: one input dimension, any number of outputs."""
    dimensions = tags["DIM"].split()
    parametrization = tags.get("PARAM_IN", "").strip().upper()
    if len(dimensions) < 2 or dimensions[0] != "1" or not dimensions[1].isdecimal():
        raise MdfconvError(f"{path}: ALTA data of dimension '{tags['DIM']}'", "only 1 N is read")
    outputs = int(dimensions[1])
    if parametrization not in _ALTA_INPUTS:
        raise MdfconvError(
            f"{path}: ALTA input parametrization '{parametrization}'",
            f"known: {', '.join(_ALTA_INPUTS)}",
        )
    if not 1 <= outputs < table.shape[1]:
        raise MdfconvError(f"{path}: {table.shape[1]} columns do not hold 1 + {outputs} dimensions")
    names = ("R", "G", "B") if outputs == 3 else tuple(str(n + 1) for n in range(outputs))
    unit = _ALTA_INPUTS[parametrization]
    return samples(path, table[:, 0], unit, table[:, 1 : 1 + outputs], names, "brdf")
