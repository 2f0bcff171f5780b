"""OpenEXR files, through the library of that name."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mdfconv.errors import MdfconvError
from mdfconv.scene.image_picture import (
    Attributes,
    Form,
    Picture,
    check_size,
    find_channel,
    quiet_streams,
    reading,
)

# Names of OpenEXR's compressions with losses.
_LOSSY = ("B44", "B44A", "DWAA", "DWAB", "LJ2K", "PXR24")


class ExrPicture(Picture):
    """One channel of an OpenEXR file, changed in place among the others."""

    def __init__(self, file: Any, texels: NDArray[Any]) -> None:
        size = texels.shape[1], texels.shape[0]
        super().__init__(size, texels.dtype, "", 0, Attributes())
        self._file, self._texels = file, texels

    def read(self, top: int, bottom: int) -> NDArray[Any]:
        """Return a copy of some rows of the channel."""
        return self._texels[top:bottom, :, np.newaxis].copy()

    def write(self, top: int, block: NDArray[Any]) -> None:
        """Replace rows of the channel."""
        self._texels[top : top + len(block)] = block[..., 0]

    def save(self, path: Path, form: Form) -> None:
        """Write all channels and attributes; without losses, whatever the file came with."""
        import OpenEXR

        header = self._file.parts[0].header
        if header["compression"].name.removesuffix("_COMPRESSION") in _LOSSY:
            header["compression"] = OpenEXR.ZIP_COMPRESSION
        try:
            with quiet_streams():
                self._file.write(str(path))
        except RuntimeError as error:
            raise OSError(str(error).splitlines()[0]) from None


def read_exr(path: Path, channel: str | None, max_pixels: int | None) -> Picture:
    """Decode an OpenEXR file of one part.

    Raises
    ------
    MdfconvError
        If the package is not installed, the file damaged or too large, or if it has several
        parts, deep texels, or no such channel of floats.
    """
    try:
        import OpenEXR
    except ImportError:
        raise MdfconvError(
            "an OpenEXR file needs the library of that name", "pip install 'mdfconv[exr]'"
        ) from None
    with reading(path), quiet_streams():
        head = OpenEXR.File(str(path), header_only=True)
        if len(head.parts) != 1:
            raise MdfconvError(f"{path} has {len(head.parts)} parts", "split it")
        header = head.parts[0].header
        if header.get("type") in (OpenEXR.deepscanline, OpenEXR.deeptile):
            raise MdfconvError(f"{path} holds deep texels, which are no texture")
        low, high = header["dataWindow"]
        width, height = (int(side) for side in high - low + 1)
        check_size(path, (width, height), max_pixels)
        names = [described.name for described in header["channels"]]
        name = names[find_channel(path, names, channel)]
        file = OpenEXR.File(str(path), separate_channels=True)
        # For a damaged file some releases raise, others return no part.
        if not file.parts or set(file.parts[0].channels) != set(names):
            raise MdfconvError(f"{path} is damaged or incomplete")
        texels = file.parts[0].channels[name].pixels
    if texels.dtype.kind != "f":
        raise MdfconvError(f"{path}: channel {name} holds integers, not floats")
    return ExrPicture(file, texels)
