"""Material libraries as files: where the results go, and that nothing is lost on the way."""

from __future__ import annotations

import glob
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from mdfconv.errors import MdfconvError
from mdfconv.output.files import write_files
from mdfconv.scene.mtl import MtlConversion


@dataclass(frozen=True)
class Destination:
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
    libraries: dict[Path, None] = {}
    for pattern in patterns:
        names = [pattern] if Path(pattern).exists() else sorted(glob.glob(pattern, recursive=True))
        if not names:
            raise MdfconvError(f"cannot read {pattern}: No such file or directory")
        libraries |= dict.fromkeys(map(Path, names))
    return list(libraries)


def choose_outputs(
    libraries: Sequence[Path], output: str | None, *, in_place: bool
) -> list[Destination]:
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
        If the results are to go nowhere or to two places, several libraries to one file, or one
        over a file that would be lost.
    """
    if in_place == (output is not None):
        raise MdfconvError(
            "a library is converted in place, or into another file or folder",
            "choose one of them",
            argument="in_place",
        )
    if output is None:
        real = dict.fromkeys(library.resolve() for library in libraries)
        return [Destination(library, library, _free_backup(library)) for library in real]
    path = Path(output)
    if path.is_dir():
        destinations = [Destination(library, path / library.name) for library in libraries]
    elif len(libraries) > 1:
        raise MdfconvError(f"{len(libraries)} libraries need a folder: {output} is not one")
    elif output.endswith(("/", os.sep)) or output == "-":
        raise MdfconvError(f"cannot write {output}: it is not a file or an existing folder")
    else:
        destinations = [Destination(libraries[0], path)]
    outputs = [destination.output for destination in destinations]
    for destination in destinations:
        _check_new(destination)
        if outputs.count(destination.output) > 1:
            raise MdfconvError(f"two libraries would both be written to {destination.output}")
    return destinations


def _check_new(destination: Destination) -> None:
    """Refuse an output that exists."""
    output = destination.output
    if not output.exists():
        return
    if os.path.samefile(output, destination.source):
        raise MdfconvError(
            f"will not write {output}: it is the input", "convert it in place", argument="in_place"
        )
    raise MdfconvError(f"will not write {output}: it exists")


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


def write_libraries(
    converted: Sequence[tuple[Destination, bytes, MtlConversion]],
) -> list[Destination]:
    """Write all conversions, and backups first, or nothing.

    What a conversion in place does not change is not written.

    Parameters
    ----------
    converted : sequence of (Destination, bytes, MtlConversion)
        For each library where it goes, its original and its conversion.

    Returns
    -------
    list of Destination
        What was written.

    Raises
    ------
    MdfconvError
        If a file cannot be written; nothing is then changed.
    """
    changed = [
        (destination, original, conversion.data)
        for destination, original, conversion in converted
        if not (destination.backup and conversion.data == original)
    ]
    contents: dict[Path, bytes] = {}
    modes = {}
    for destination, original, _ in changed:
        if destination.backup:
            contents[destination.backup] = original
            modes[destination.output] = destination.output.stat().st_mode
    write_files(contents | {destination.output: data for destination, _, data in changed})
    for path, mode in modes.items():
        path.chmod(mode)
    return [destination for destination, *_ in changed]
