"""What the image libraries' wrappers share: a picture in rows, and errors in one line."""

from __future__ import annotations

import os
import struct
import sys
import zlib
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mdfconv.errors import MdfconvError

# What decoders raise for a file that is damaged; they have no family of errors.
_DAMAGE = (
    *(OSError, SyntaxError, ValueError, TypeError, LookupError, EOFError, RuntimeError),
    *(ArithmeticError, AttributeError, struct.error, zlib.error),
)
_GREY = ("l", "y", "grey", "gray")
# What helps where compression has altered the values.
ACCEPT_LOSSES = "take the original, or accept the losses"


class Form(StrEnum):
    """The forms of image files."""

    png = "PNG"
    tiff = "TIFF"
    exr = "OpenEXR"
    jpeg = "JPEG"


@dataclass(frozen=True)
class Attributes:
    """What a file says about its texels.

    Parameters
    ----------
    icc_profile : bytes or None
        The colour profile.
    dpi : tuple of two floats or None
        Texels an inch, horizontally and vertically.
    """

    icc_profile: bytes | None = None
    dpi: tuple[float, float] | None = None


class Picture(ABC):
    """A decoded picture that is read and written some rows at a time.

    Parameters
    ----------
    size : tuple of int
        Width and height in texels.
    dtype : numpy.dtype
        Type of the texels, of integers uint8 or uint16.
    bands : str
        The channels of an integer picture, such as ``"RGBA"``.
    channel : int
        The channel to convert, an index into the last axis of a block.
    attributes : Attributes
        What the file says about its texels.
    """

    def __init__(
        self,
        size: tuple[int, int],
        dtype: np.dtype[Any],
        bands: str,
        channel: int,
        attributes: Attributes,
    ) -> None:
        self.width, self.height = size
        self.dtype = dtype
        self.bands = bands
        self.channel = channel
        self.attributes = attributes

    @abstractmethod
    def read(self, top: int, bottom: int) -> NDArray[Any]:
        """Return a copy of some rows, shape (rows, width, channels)."""

    @abstractmethod
    def write(self, top: int, block: NDArray[Any]) -> None:
        """Replace the rows from `top` on, shape (rows, width, channels)."""

    @abstractmethod
    def save(self, path: Path, form: Form) -> None:
        """Write the picture in a form, to a file of any name."""


def find_channel(path: Path, names: Sequence[str], wanted: str | None) -> int:
    """Return which channel is to be converted.

    Raises
    ------
    MdfconvError
        If the picture has no such channel, or several and none was chosen.
    """
    known = ", ".join(names)
    if wanted is None:
        if len(names) != 1:
            raise MdfconvError(
                f"{path} has the channels {known}", "choose one channel", argument="channel"
            )
        return 0
    if wanted in names:
        return names.index(wanted)
    keys = [_key(name) for name in names]
    if keys.count(_key(wanted)) != 1:
        raise MdfconvError(f"{path} has no channel '{wanted}'", f"its channels are {known}")
    return keys.index(_key(wanted))


def _key(name: str) -> str:
    key = name.strip().lower()
    return "grey" if key in _GREY else key


def check_size(path: Path, size: tuple[int, int], max_pixels: int | None) -> None:
    """Refuse a picture that would fill the memory: a small file can claim any size.

    Raises
    ------
    MdfconvError
        If it has more pixels than `max_pixels`, or than Pillow's limit if that is None.
    """
    from PIL import Image

    limit = Image.MAX_IMAGE_PIXELS if max_pixels is None else max_pixels
    pixels = size[0] * size[1]
    if limit is not None and pixels > limit:
        raise MdfconvError(
            f"{path} has {size[0]}×{size[1]} = {pixels} pixels, more than the {limit} that are "
            "safe to decode unasked",
            f"allow {pixels} pixels",
            argument="max_pixels",
        )


@contextmanager
def reading(path: Path) -> Iterator[None]:
    """Turn what a decoder raises into one line about the file."""
    try:
        yield
    except MdfconvError:
        raise
    except MemoryError:
        raise MdfconvError(f"{path} does not fit into the memory") from None
    except _DAMAGE as error:
        if isinstance(error, OSError) and error.errno is not None:
            raise MdfconvError(f"cannot read {path}: {error.strerror}") from None
        reason = str(error).strip().splitlines() or [type(error).__name__]
        raise MdfconvError(f"{path} is damaged, incomplete or unusual: {reason[0]}") from None


@contextmanager
def quiet_streams() -> Iterator[None]:
    """Keep a C library from writing to the process's streams of what comes back as an error.

    OpenEXR and libtiff do so. It holds for the whole process.
    """
    streams = {1: sys.stdout, 2: sys.stderr}
    for stream in streams.values():
        if stream is not None:
            stream.flush()
    kept = [(number, os.dup(number)) for number, stream in streams.items() if stream is not None]
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        for number, _ in kept:
            os.dup2(nowhere, number)
        yield
    finally:
        for number, copy in kept:
            os.dup2(copy, number)
            os.close(copy)
        os.close(nowhere)
