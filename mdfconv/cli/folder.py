"""The folder that a command writes its figures to."""

from __future__ import annotations

import os
from pathlib import Path

from mdfconv.errors import MdfconvError
from mdfconv.reports.text import write_files

DEFAULT = Path("reports")


def check_folder(folder: Path | None) -> Path:
    """Return the folder to write to, checked before any work is done.

    Without a choice it is ``./reports``, created if it is not there; a chosen one must exist.

    Raises
    ------
    MdfconvError
        If it is not a folder or cannot be written to.
    """
    chosen = folder or DEFAULT
    if folder is None:
        try:
            chosen.mkdir(exist_ok=True)
        except OSError as error:
            raise MdfconvError(f"cannot create {chosen}: {error.strerror}") from None
    if not chosen.is_dir():
        raise MdfconvError(f"{chosen} is not an existing directory")
    if not os.access(chosen, os.W_OK):
        raise MdfconvError(f"cannot write to {chosen}")
    return chosen


def write_all(folder: Path, contents: dict[str, bytes]) -> list[Path]:
    """Write files that are ready, all or none, and return their paths."""
    write_files({folder / name: content for name, content in contents.items()})
    return [folder / name for name in contents]
