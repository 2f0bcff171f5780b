"""Where a command writes: checked before any work is done, written all or none."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path

from mdfconv.cli.tables import tell
from mdfconv.errors import MdfconvError
from mdfconv.output.files import create_folder, is_stream, write_files

_DEFAULT_FOLDER = Path("reports")


def check_outputs(*outputs: Path | None, inputs: Sequence[Path] = ()) -> list[Path]:
    """Return the outputs that are named, if each can be written.

    Raises
    ------
    MdfconvError
        If two have one name, one is an input or a folder, or its folder is missing or closed.
    """
    named = [path for path in outputs if path is not None]
    for number, path in enumerate(named):
        if path.resolve() in [other.resolve() for other in named[:number]]:
            raise MdfconvError(f"{path} is named for two results", "give each its own file")
        if any(path.exists() and other.exists() and path.samefile(other) for other in inputs):
            raise MdfconvError(f"{path} is the input", "write to another file")
        if path.is_dir():
            raise MdfconvError(f"cannot write {path}: Is a directory")
        place = path if is_stream(path) else path.resolve().parent
        if place != path and not place.is_dir():
            raise MdfconvError(f"cannot write {path}: {path.parent} is not an existing directory")
        if not os.access(place, os.W_OK):
            raise MdfconvError(f"cannot write {path}: Permission denied")
    return named


def check_folder(folder: Path | None) -> Path:
    """Return the folder to write to, created if it is not there; without a choice ./reports.

    Raises
    ------
    MdfconvError
        If it is not a folder, or cannot be created or written to.
    """
    chosen = folder or _DEFAULT_FOLDER
    create_folder(chosen)
    if not os.access(chosen, os.W_OK):
        raise MdfconvError(f"cannot write to {chosen}")
    return chosen


def write_named(contents: Mapping[Path, bytes]) -> None:
    """Write files that are ready, all or none, and say so on standard error."""
    write_files(contents)
    for path in contents:
        tell(f"wrote {path}")
