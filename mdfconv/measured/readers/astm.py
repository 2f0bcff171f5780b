"""ASTM E1392 text: lines ``KEY value``, one of them ``VARS`` with the names, then the rows.

The angles are those towards the light and the detector; files give them in radians (those of
Cornell's Program of Computer Graphics) or degrees. Light Tec's Mini-Diff names three of the four
angles that its files hold.
"""

from __future__ import annotations

import re
from dataclasses import replace

from mdfconv.measured.readers.base import Reader, ReadOptions, Source, known_by
from mdfconv.measured.readers.tables import parse_table, role_of
from mdfconv.measured.readers.text import DIRECTIONS, read_table
from mdfconv.measured.samples import Measurements

_VARIABLES = re.compile(r"^\s*VARS[ \t]*:?[ \t]+(?P<names>\S.*?)\s*$", re.M | re.I)
_COUNT = re.compile(r"^\s*NUM_POINTS[ \t]*:?[ \t]+(?P<count>\S+)", re.M | re.I)
_SEPARATOR = re.compile(r"\s*[,;\s]\s*")


def _read(source: Source, options: ReadOptions) -> Measurements:
    lines = source.lines()
    at, names = next(
        (index, match["names"])
        for index, line in enumerate(lines)
        if (match := _VARIABLES.match(line))
    )
    rows = lines[at + 1 :]
    names, notes = _completed(names, next(filter(str.strip, rows), ""))
    # Blank lines keep the numbers of the lines for messages; the names become the header.
    table = parse_table(source.path, [*[""] * at, names, *rows], by_number=options.by_number)
    count, counted = len(table.numbers), _COUNT.search("\n".join(lines[:at]))
    if counted and counted["count"] != str(count):
        raise table.error(f"{count} rows where NUM_POINTS says {counted['count'][:20]}")
    facts = [line for line in lines[:at] if not _COUNT.match(line)]
    # The rows may have comments of their own.
    comments = [*facts, *table.comments]
    return read_table(replace(table, notes=(*table.notes, *notes), comments=comments), options)


def _completed(names: str, row: str) -> tuple[str, tuple[str, ...]]:
    """Return the names, with that of the one angle that a row has beside them, and a note on it."""
    cells = _SEPARATOR.split(names)
    count, width = len(cells), len(_SEPARATOR.split(row.strip()))
    known = [role_of(name) for name in cells[:3]]
    missing = [role for role in DIRECTIONS if role not in known]
    if width != count + 1 or known != [role for role in DIRECTIONS if role not in missing]:
        return names, ()
    at = DIRECTIONS.index(missing[0])
    cells.insert(at, missing[0].name)
    note = f"VARS names {count} of {width} columns: column {at + 1} is taken for the {missing[0]}"
    return ",".join(cells), (note,)


READER = Reader("ASTM E1392", known_by(_VARIABLES), _read)
