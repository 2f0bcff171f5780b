"""ASTM E1392 text: lines ``KEY value``, one of them ``VARS`` with the names, then the rows.

The angles are those towards the light and the detector; files give them in radians (those of
Cornell's Program of Computer Graphics) or degrees.
"""

from __future__ import annotations

import re

from mdfconv.measured.readers.base import Reader, ReadOptions, Source, known_by
from mdfconv.measured.readers.tables import parse_table
from mdfconv.measured.readers.text import read_table
from mdfconv.measured.samples import Measurements

_VARIABLES = re.compile(r"^\s*VARS[ \t]*:?[ \t]+(?P<names>\S.*?)\s*$", re.M | re.I)
_COUNT = re.compile(r"^\s*NUM_POINTS[ \t]*:?[ \t]+(?P<count>\S+)", re.M | re.I)


def _read(source: Source, options: ReadOptions) -> Measurements:
    lines = source.lines()
    at, names = next(
        (index, match["names"])
        for index, line in enumerate(lines)
        if (match := _VARIABLES.match(line))
    )
    # Blank lines keep the numbers of the lines for messages; the names become the header.
    table = parse_table(source.path, [*[""] * at, names, *lines[at + 1 :]])
    rows, counted = len(table.numbers), _COUNT.search("\n".join(lines[:at]))
    if counted and counted["count"] != str(rows):
        raise table.error(f"{rows} rows where NUM_POINTS says {counted['count'][:20]}")
    return read_table(table, options)


READER = Reader("ASTM E1392", known_by(_VARIABLES), _read)
