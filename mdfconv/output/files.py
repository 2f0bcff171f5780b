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


def write_files(contents: Mapping[Path, bytes]) -> None:
    """Write files whole or not at all: all beside their places first, then renamed.

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
            with NamedTemporaryFile(dir=path.parent, prefix=f".{path.name}.", delete=False) as file:
                staged[file.name] = path
                file.write(content)
            os.chmod(file.name, 0o666 & ~mask)
            if path.is_dir():
                raise IsADirectoryError(errno.EISDIR, "is a directory")
        for beside, path in list(staged.items()):
            os.replace(beside, path)
            del staged[beside]
    except OSError as error:
        raise MdfconvError(f"cannot write {path}: {error.strerror}") from None
    finally:
        for beside in staged:
            Path(beside).unlink(missing_ok=True)
