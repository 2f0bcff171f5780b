"""Files written whole or not at all."""

from __future__ import annotations

import errno
import glob
import os
import shutil
import signal
import threading
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import NamedTemporaryFile
from typing import Any

from mdfconv.errors import MdfconvError

# What commands call standard input.
STANDARD_INPUT = "-"
# What ends a process politely: it still puts its things away.
_ENDS = ("SIGTERM", "SIGHUP")


def file_bytes(text: str) -> bytes:
    """Return text as the content of a file."""
    return f"{text}\n".encode()


def is_stream(path: Path) -> bool:
    """Return whether a path is there and neither a file nor a folder: a device or a pipe."""
    return path.exists() and not path.is_file() and not path.is_dir()


def find_files(patterns: Sequence[str]) -> list[Path]:
    """Return the files that names and glob patterns stand for, each once; - for itself.

    Raises
    ------
    MdfconvError
        If one stands for nothing.
    """
    files: dict[Path, None] = {}
    for pattern in patterns:
        there = pattern == STANDARD_INPUT or Path(pattern).exists()
        names = [pattern] if there else sorted(glob.glob(pattern, recursive=True))
        if not names:
            raise MdfconvError(f"cannot read {pattern}: No such file or directory")
        files |= dict.fromkeys(map(Path, names))
    return list(files)


def create_folder(folder: Path) -> None:
    """Create a folder if it is not there, in one that is; raise `MdfconvError` if it cannot be."""
    try:
        folder.mkdir(exist_ok=True)
    except OSError as error:
        raise MdfconvError(f"cannot create {folder}: {error.strerror}") from None


def write_files(
    contents: Mapping[Path, bytes],
    *,
    new: Collection[Path] = (),
    like: Mapping[Path, Path] | None = None,
) -> None:
    """Write files whole or not at all: all beside their places first, then renamed.

    A link stays one, and what is there and no file (a device, a pipe) is written to as it is.
    Data are on the disk before a name points to them. If a name cannot be changed, those that
    were are changed back.

    Parameters
    ----------
    contents : mapping of Path to bytes
        The files.
    new : collection of Path
        Those that must not exist: one that does, at the last moment, is not written over.
    like : mapping of Path to Path, optional
        Files whose permissions and owner others get; without one they are those of a new file,
        or of the file that is written over.

    Raises
    ------
    MdfconvError
        If a place cannot be written; nothing is then changed.
    """
    path = Path()
    with _ends_raised(), _Staging() as staging:
        try:
            for path, content in contents.items():
                if path.is_dir():
                    raise IsADirectoryError(errno.EISDIR, "is a directory")
                if not is_stream(path):
                    staging.stage(path, content, (like or {}).get(path, path))
            for path in filter(is_stream, contents):
                path.write_bytes(contents[path])
            for path in staging.paths:
                staging.place(path, new=path in new)
            staging.keep()
        except FileExistsError:
            raise MdfconvError(f"will not write {path}: it exists") from None
        except OSError as error:
            raise MdfconvError(f"cannot write {path}: {error.strerror}") from None


class _Staging:
    """Files beside their places; on leaving, all is as before unless it is to be kept."""

    def __init__(self) -> None:
        self._staged: dict[Path, Path] = {}
        # Of each place that was changed the file that was there, under another name; None for none.
        self._before: list[tuple[Path, Path | None]] = []

    def __enter__(self) -> _Staging:
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

    @property
    def paths(self) -> list[Path]:
        """The paths that are staged."""
        return list(self._staged)

    def stage(self, path: Path, content: bytes, like: Path) -> None:
        """Write a file beside its place, on the disk."""
        place = path.resolve()
        with NamedTemporaryFile(dir=place.parent, prefix=f".{place.name}.", delete=False) as file:
            self._staged[path] = Path(file.name)
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        _give_permissions(Path(file.name), like)

    def place(self, path: Path, *, new: bool) -> None:
        """Let the name point to the staged file."""
        place, staged = path.resolve(), self._staged[path]
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

    def keep(self) -> None:
        """Forget what was there before."""
        for _, old in self._before:
            if old is not None:
                old.unlink(missing_ok=True)
        self._before.clear()


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
        there = like.stat()
        os.chmod(path, there.st_mode & 0o7777)
        # Only a superuser may give a file away; others own what they write.
        with suppress(OSError, AttributeError):
            os.chown(path, there.st_uid, there.st_gid)
        return
    # A temporary file is private.
    mask = os.umask(0)
    os.umask(mask)
    os.chmod(path, 0o666 & ~mask)


@contextmanager
def _ends_raised() -> Iterator[None]:
    """Turn the signals that end a process into exceptions, so that temporary files go away."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    names = [name for name in _ENDS if hasattr(signal, name)]
    before = {name: signal.signal(getattr(signal, name), _leave) for name in names}
    try:
        yield
    finally:
        for name, handler in before.items():
            signal.signal(getattr(signal, name), handler)


def _leave(number: int, frame: object) -> None:
    # As a shell reports a process that a signal ended.
    raise SystemExit(128 + number)
