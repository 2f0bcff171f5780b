"""Files written whole or not at all."""

from __future__ import annotations

import errno
import glob
import os
import shutil
import signal
import threading
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import NamedTemporaryFile
from typing import Any

from mdfconv.errors import MdfconvError

# What commands call standard input.
STANDARD_INPUT = "-"
# Where open files have names, which may lead to a file, such as that of standard output.
_OPEN_FILES = tuple(map(Path, ("/dev", "/dev/fd", "/proc/self/fd")))
# Signals that ask a process to end, which still puts its things away.
_ENDING_SIGNALS = ("SIGTERM", "SIGHUP")


def file_bytes(text: str) -> bytes:
    """Return text as the content of a file."""
    return f"{text}\n".encode()


def is_stream(path: Path) -> bool:
    """Return whether a path is there and no file of its own: a device, a pipe, an open file."""
    if not path.exists() or path.is_dir():
        return False
    return path.parent in _OPEN_FILES or not path.is_file()


def find_files(patterns: Sequence[str]) -> list[Path]:
    """Return the files that names and glob patterns stand for, each once; - for itself.

    Raises
    ------
    MdfconvError
        If one stands for nothing, or for a folder.
    """
    files: dict[Path, None] = {}
    for pattern in patterns:
        is_name = pattern == STANDARD_INPUT or Path(pattern).exists()
        names = [pattern] if is_name else sorted(glob.glob(pattern, recursive=True))
        if not names:
            raise MdfconvError(f"cannot read {pattern}: No such file or directory")
        for folder in filter(os.path.isdir, names):
            raise MdfconvError(f"{folder} is a folder", f"name its files, as in '{folder}/*'")
        files |= dict.fromkeys(map(Path, names))
    return list(files)


def create_folder(folder: Path) -> None:
    """Create a folder if it is not there, in one that is; raise `MdfconvError` if it cannot be."""
    try:
        folder.mkdir(exist_ok=True)
    except OSError as error:
        reason = "it is a file" if folder.is_file() else error.strerror
        raise MdfconvError(f"cannot create {folder}: {reason}") from None


def exists_refusal(path: Path) -> MdfconvError:
    """Return the refusal to write over a file that nobody said to replace."""
    return MdfconvError(f"{path} exists", "it can be replaced", argument="force")


def write_files(
    contents: Mapping[Path, bytes],
    *,
    new: Collection[Path] = (),
    like: Mapping[Path, Path] | None = None,
) -> None:
    """Write files whole or not at all, as `staged_files`; those that are `new` must not exist.

    `like` has files whose permissions and owner others get; without one they are those of a new
    file, or of the file that is written over.
    """
    with staged_files(new.__contains__) as files:
        for path, content in contents.items():
            files.add(path, content, (like or {}).get(path))


@contextmanager
def staged_files(is_new: Callable[[Path], bool]) -> Iterator[StagedFiles]:
    """Take files beside their places, and give them their names when all are there.

    A link stays one, and what is there and no file (a device, a pipe) is written to as it is.
    Data are on the disk before a name points to them. If a name cannot be changed, those that
    were are changed back. A file that is new and exists, at the last moment, is not written over.

    Raises
    ------
    MdfconvError
        If a place cannot be written; nothing is then changed.
    """
    with _signals_raised(), StagedFiles() as files:
        try:
            yield files
            files.place(is_new)
        except FileExistsError:
            raise exists_refusal(files.current) from None
        except OSError as error:
            reason = error.strerror or (str(error).strip().splitlines() or ["unknown fault"])[0]
            raise MdfconvError(f"cannot write {files.current}: {reason}") from None


class StagedFiles:
    """Files beside their places; on leaving, all is as before unless they were placed."""

    def __init__(self) -> None:
        # The one that is at work, for messages.
        self.current = Path()
        self._staged: dict[Path, Path] = {}
        self._like: dict[Path, Path] = {}
        # Of each place that was changed the former file, under another name; None if it had none.
        self._before: list[tuple[Path, Path | None]] = []

    def __enter__(self) -> StagedFiles:
        return self

    def __exit__(self, *problem: Any) -> None:
        for place, old in reversed(self._before):
            with suppress(OSError):
                if old is None:
                    place.unlink()
                else:
                    os.replace(old, place)
                    # Renaming one name of a file to another of its names leaves both.
                    old.unlink(missing_ok=True)
        for staged in self._staged.values():
            staged.unlink(missing_ok=True)

    def add(self, path: Path, content: bytes, like: Path | None = None) -> None:
        """Add a file, with the permissions and the owner of another one."""
        self._like[path] = like or path
        self.fill(path).write_bytes(content)

    def fill(self, path: Path) -> Path:
        """Add a file that is empty; return where it is, for others to write to."""
        self.current = path
        if path.is_dir():
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
        folder = None if is_stream(path) else path.resolve().parent
        with NamedTemporaryFile(dir=folder, prefix=".mdfconv-", delete=False) as file:
            self._staged[path] = Path(file.name)
        return self._staged[path]

    def place(self, is_new: Callable[[Path], bool]) -> None:
        """Let the names point to the files."""
        files = {path: staged for path, staged in self._staged.items() if not is_stream(path)}
        for self.current, staged in files.items():
            with staged.open("rb+") as file:
                os.fsync(file.fileno())
            _give_permissions(staged, self._like.get(self.current, self.current))
        for path in filter(is_stream, self._staged):
            self.current = path
            # What a shell appends standard output to is not cut off.
            with path.open("ab") as stream:
                stream.write(self._staged[path].read_bytes())
        for self.current, staged in files.items():
            self._name(self.current.resolve(), staged, new=is_new(self.current))
        for _, old in self._before:
            if old is not None:
                old.unlink(missing_ok=True)
        self._before.clear()

    def _name(self, place: Path, staged: Path, *, new: bool) -> None:
        if new:
            _link(staged, place)
            self._before.append((place, None))
            return
        old = None
        if place.exists():
            old = staged.with_name(f"{staged.name}.old")
            _link(place, old)
        self._before.append((place, old))
        os.replace(staged, place)


def _link(source: Path, target: Path) -> None:
    """Give a file a second name that no other has."""
    try:
        os.link(source, target)
    except FileExistsError:
        raise
    except OSError:
        # Where files have one name each: a copy that takes the name at once.
        with target.open("xb") as file:
            file.write(source.read_bytes())
        shutil.copymode(source, target)


def _give_permissions(path: Path, like: Path) -> None:
    """Give a file the permissions and the owner of another, or those of any new file."""
    if like.is_file():
        status = like.stat()
        os.chmod(path, status.st_mode & 0o7777)
        # Only a superuser may give a file away; others own what they write.
        with suppress(OSError, AttributeError):
            os.chown(path, status.st_uid, status.st_gid)
        return
    # A temporary file is private.
    mask = os.umask(0)
    os.umask(mask)
    os.chmod(path, 0o666 & ~mask)


@contextmanager
def _signals_raised() -> Iterator[None]:
    """Turn the signals that end a process into exceptions, so that temporary files go away."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    names = [name for name in _ENDING_SIGNALS if hasattr(signal, name)]
    before = {name: signal.signal(getattr(signal, name), _leave) for name in names}
    try:
        yield
    finally:
        for name, handler in before.items():
            signal.signal(getattr(signal, name), handler)


def _leave(number: int, frame: object) -> None:
    # As a shell reports a process that a signal ended.
    raise SystemExit(128 + number)
