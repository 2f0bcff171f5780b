"""Where a command writes: checked before any work is done, written all or none."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager, suppress
from pathlib import Path

import typer

from mdfconv.cli.process import tell
from mdfconv.errors import MdfconvError
from mdfconv.output.files import StagedFiles, create_folder, exists_refusal, is_stream, staged_files

_DEFAULT_FOLDER = Path("reports")


class Outputs:
    """The files that a command writes: checked when they are named, written all or none.

    `files` are those that are known before the work, None for one that is not wanted; `table` is
    where `write_table` writes, if not to standard output; `inputs` must not be written over.
    """

    def __init__(
        self,
        *files: Path | None,
        force: bool,
        table: Path | None = None,
        inputs: Sequence[Path] = (),
    ) -> None:
        self.table = table
        self._force, self._inputs = force, inputs
        self._checked: set[Path] = set()
        self.check(*files, table)

    def check(self, *files: Path | None) -> None:
        """Refuse files that cannot be written: names given twice, what exists, inputs, folders."""
        for path in (path for path in files if path is not None):
            try:
                self._check(path)
            except (OSError, RuntimeError) as error:
                reason = getattr(error, "strerror", None) or error
                raise MdfconvError(f"cannot write {path}: {reason}") from None

    def _check(self, path: Path) -> None:
        if path.resolve() in self._checked:
            raise MdfconvError(f"{path} is named for two results", "give each its own file")
        self._checked.add(path.resolve())
        if any(path.exists() and other.exists() and path.samefile(other) for other in self._inputs):
            raise MdfconvError(f"{path} is the input", "write to another file")
        if path.is_dir():
            raise MdfconvError(f"cannot write {path}: Is a directory")
        if path.exists() and not is_stream(path) and not self._force:
            raise exists_refusal(path)
        place = path if is_stream(path) else path.resolve().parent
        if place != path and not place.is_dir():
            raise MdfconvError(f"cannot write {path}: {path.parent} is not an existing directory")
        if not os.access(place, os.W_OK):
            raise MdfconvError(f"cannot write {path}: Permission denied")

    def staged(self) -> AbstractContextManager[StagedFiles]:
        """Return what takes the files and places all or none, without --force over no other."""
        return staged_files(lambda path: not self._force)

    def write(self, contents: Mapping[Path, bytes]) -> None:
        """Write files that are ready, all or none, and say so on standard error."""
        self.check(*(path for path in contents if path.resolve() not in self._checked))
        with self.staged() as files:
            for path, content in contents.items():
                files.add(path, content)
        for path in contents:
            tell(f"wrote {path}")


def new_folder(context: typer.Context, folder: Path) -> None:
    """Create a folder that is not there; at the end of a command that left it empty it goes."""
    if not folder.is_dir():
        create_folder(folder)
        context.call_on_close(lambda: _remove_if_empty(folder))


def _remove_if_empty(folder: Path) -> None:
    with suppress(OSError):
        folder.rmdir()


def check_folder(context: typer.Context, folder: Path | None) -> Path:
    """Return the folder to write to, created if it is not there; without a choice ./reports."""
    chosen = folder or _DEFAULT_FOLDER
    new_folder(context, chosen)
    if not os.access(chosen, os.W_OK):
        raise MdfconvError(f"cannot write to {chosen}")
    return chosen


def value_name(value: float) -> str:
    """Return a number for the name of a file, which it shares with no other number."""
    return repr(float(value)).removesuffix(".0")
