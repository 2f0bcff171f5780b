"""Files written whole or not at all."""

from __future__ import annotations

import errno
import os
from collections.abc import Mapping
from pathlib import Path
from tempfile import NamedTemporaryFile

from mdfconv.errors import MdfconvError


def file_bytes(text: str) -> bytes:
    """Return text as the content of a file."""
    return f"{text}\n".encode()


def is_stream(path: Path) -> bool:
    """Return whether a path is there and neither a file nor a folder: a device or a pipe."""
    return path.exists() and not path.is_file() and not path.is_dir()


def write_files(contents: Mapping[Path, bytes]) -> None:
    """Write files whole or not at all: all beside their places first, then renamed.

    A link stays one, and what is there and no file (a device, a pipe) is written to as it is.

    Raises
    ------
    MdfconvError
        If a place cannot be written; nothing is then changed.
    """
    staged: dict[str, Path] = {}
    path = Path()
    # A temporary file is private; give it the permissions of any other new file.
    mask = os.umask(0)
    os.umask(mask)
    try:
        for path, content in contents.items():
            if path.is_dir():
                raise IsADirectoryError(errno.EISDIR, "is a directory")
            if is_stream(path):
                continue
            place = path.resolve()
            with NamedTemporaryFile(
                dir=place.parent, prefix=f".{place.name}.", delete=False
            ) as file:
                staged[file.name] = place
                file.write(content)
            os.chmod(file.name, 0o666 & ~mask)
        for path in filter(is_stream, contents):
            path.write_bytes(contents[path])
        for beside, path in list(staged.items()):
            os.replace(beside, path)
            del staged[beside]
    except OSError as error:
        raise MdfconvError(f"cannot write {path}: {error.strerror}") from None
    finally:
        for beside in staged:
            Path(beside).unlink(missing_ok=True)
