"""ASTM E1392 text: lines ``KEY value``, one of them ``VARS`` with the names, then the rows.

The angles are those towards the light and the detector; files give them in radians (those of
Cornell's Program of Computer Graphics) or degrees.
"""

from __future__ import annotations

import re
from pathlib import Path

from mdfconv.errors import MdfconvError
from mdfconv.measured.readers.base import Reader, ReadOptions, Source, decode, decode_head
from mdfconv.measured.readers.tables import parse_table
from mdfconv.measured.readers.text import read_table
from mdfconv.measured.samples import Measurements

_VARIABLES = re.compile(r"^\s*VARS[ \t]*:?[ \t]+(?P<names>\S.*?)\s*$", re.M | re.I)
_COUNT = re.compile(r"^\s*NUM_POINTS[ \t]*:?[ \t]+(?P<count>\S+)", re.M | re.I)


def _recognizes(name: str, head: bytes) -> bool:
    return bool(_VARIABLES.search(decode_head(head)))


def _read(source: Source, options: ReadOptions) -> Measurements:
    lines = decode(source).splitlines()
    at = next(index for index, line in enumerate(lines) if _VARIABLES.match(line))
    head, names = "\n".join(lines[:at]), _VARIABLES.match(lines[at])
    # Blank lines keep the numbers of the lines for messages; the names become the header.
    blank = [""] * at
    table = parse_table(source.path, [*blank, names["names"] if names else "", *lines[at + 1 :]])
    _check_count(source.path, head, len(table.numbers))
    return read_table(table, options)


def _check_count(path: Path, head: str, rows: int) -> None:
    counted = _COUNT.search(head)
    if counted and counted["count"] != str(rows):
        raise MdfconvError(f"{path}: {rows} rows where NUM_POINTS says {counted['count'][:20]}")


READER = Reader("ASTM E1392", _recognizes, _read)
