"""Material libraries as files: where the results go, and that nothing is lost on the way."""

from __future__ import annotations

import glob
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from mdfconv.errors import MdfconvError
from mdfconv.reports.text import write_files
from mdfconv.scene.mtl import MtlConversion


@dataclass(frozen=True)
class Place:
    """A library and where its conversion goes.

    Parameters
    ----------
    source, output : Path
        The two files; the same for a conversion in place.
    backup : Path or None
        Where the original is kept; None unless in place.
    """

    source: Path
    output: Path
    backup: Path | None = None


def find_libraries(patterns: Sequence[str]) -> list[Path]:
    """Return the files that names and glob patterns stand for, each once.

    Raises
    ------
    MdfconvError
        If one stands for nothing.
    """
    found: dict[Path, None] = {}
    for pattern in patterns:
        names = [pattern] if Path(pattern).exists() else sorted(glob.glob(pattern, recursive=True))
        if not names:
            raise MdfconvError(f"cannot read {pattern}: No such file or directory")
        found |= dict.fromkeys(map(Path, names))
    return list(found)


def place_outputs(libraries: Sequence[Path], output: str | None, *, in_place: bool) -> list[Place]:
    """Return where each library's conversion goes.

    Parameters
    ----------
    libraries : sequence of Path
        The libraries.
    output : str or None
        A file for one of them, or a folder, which exists.
    in_place : bool
        Write over the library itself and keep the original beside it.

    Raises
    ------
    MdfconvError
        If there is no place, more than one library for it, or a file that would be lost.
    """
    if in_place == (output is not None):
        raise MdfconvError("give either -o OUTPUT or --in-place")
    if output is None:
        real = [library.resolve() for library in libraries]
        return [Place(library, library, _free_backup(library)) for library in dict.fromkeys(real)]
    folder = Path(output)
    if folder.is_dir():
        places = [Place(library, folder / library.name) for library in libraries]
    elif len(libraries) > 1:
        raise MdfconvError(f"{len(libraries)} libraries need a folder: {output} is not one")
    elif output.endswith(("/", os.sep)) or output == "-":
        raise MdfconvError(f"cannot write {output}: it is not a file or an existing folder")
    else:
        places = [Place(libraries[0], folder)]
    outputs = [place.output for place in places]
    for place in places:
        if place.output.exists():
            same = os.path.samefile(place.output, place.source)
            hint = "it is the input: use --in-place" if same else "it exists"
            raise MdfconvError(f"will not write {place.output}: {hint}")
        if outputs.count(place.output) > 1:
            raise MdfconvError(f"two libraries would both be written to {place.output}")
    return places


def _free_backup(library: Path) -> Path:
    """Return a name for the backup that no file has."""
    backup, count = library.with_name(f"{library.name}.bak"), 1
    while backup.exists():
        count += 1
        backup = library.with_name(f"{library.name}.bak{count}")
    return backup


def read_library(path: Path) -> bytes:
    """Return the bytes of a library.

    Raises
    ------
    MdfconvError
        If it cannot be read.
    """
    try:
        return path.read_bytes()
    except OSError as error:
        raise MdfconvError(f"cannot read {path}: {error.strerror}") from None


def write_libraries(converted: Sequence[tuple[Place, bytes, MtlConversion]]) -> list[Place]:
    """Write all conversions, and backups first, or nothing.

    What a conversion in place does not change is not written.

    Parameters
    ----------
    converted : sequence of (Place, bytes, MtlConversion)
        For each library its place, its original and its conversion.

    Returns
    -------
    list of Place
        What was written.

    Raises
    ------
    MdfconvError
        If a place cannot be written; nothing is then changed.
    """
    changed = [
        (place, original, conversion.data)
        for place, original, conversion in converted
        if not (place.backup and conversion.data == original)
    ]
    contents = {place.backup: original for place, original, _ in changed if place.backup}
    contents |= {place.output: data for place, _, data in changed}
    modes = {place.output: place.output.stat().st_mode for place, *_ in changed if place.backup}
    write_files(contents)
    for path, mode in modes.items():
        path.chmod(mode)
    return [place for place, *_ in changed]
