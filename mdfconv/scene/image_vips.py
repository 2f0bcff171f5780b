"""PNG and TIFF through libvips: 16 bits of several channels, which Pillow cuts to 8."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mdfconv.errors import MdfconvError
from mdfconv.scene.image_picture import Attributes, Form, Picture, reading

_MM_PER_INCH = 25.4
# libvips always writes a resolution; this one is the usual stand-in for none.
_NO_DPI = (72.0, 72.0)


class DeepPicture(Picture):
    """A picture of several channels of 16 bits, in an array that is changed in place."""

    def __init__(
        self, samples: NDArray[Any], bands: str, channel: int, attributes: Attributes
    ) -> None:
        size = samples.shape[1], samples.shape[0]
        super().__init__(size, samples.dtype, bands, channel, attributes)
        self._samples = samples

    def read(self, top: int, bottom: int) -> NDArray[Any]:
        """Return a copy of some rows."""
        return self._samples[top:bottom].copy()

    def write(self, top: int, block: NDArray[Any]) -> None:
        """Replace rows."""
        self._samples[top : top + len(block)] = block

    def save(self, path: Path, form: Form) -> None:
        """Write the picture with its profile and resolution, losslessly compressed."""
        vips = _vips()
        profile, dpi = self.attributes.icc_profile, self.attributes.dpi or _NO_DPI
        kind = "rgb16" if len(self.bands) > 2 else "grey16"
        try:
            image = vips.Image.new_from_memory(
                self._samples, self.width, self.height, len(self.bands), "ushort"
            ).copy(interpretation=kind, xres=dpi[0] / _MM_PER_INCH, yres=dpi[1] / _MM_PER_INCH)
            image.set_type(vips.GValue.gstr_type, "resolution-unit", "in")
            if profile:
                image.set_type(vips.GValue.blob_type, "icc-profile-data", profile)
            if form is Form.png:
                image.pngsave(str(path), keep="icc", bitdepth=16)
            else:
                image.tiffsave(str(path), keep="icc", compression="deflate", predictor="horizontal")
        except vips.Error as error:
            raise OSError(_first_line(error)) from None


def read_deep(path: Path, bands: str, channel: int, attributes: Attributes) -> Picture:
    """Decode a PNG or TIFF file of several channels of 16 bits.

    Raises
    ------
    MdfconvError
        If libvips is not installed, or the file is damaged.
    """
    vips = _vips()
    with reading(path):
        try:
            image = vips.Image.new_from_file(
                str(path), access="sequential", fail_on="error", revalidate=True
            )
            if image.bands != len(bands):
                raise MdfconvError(f"{path} is grey with alpha of 16 bits", "save it as RGBA")
            samples = np.frombuffer(image.write_to_memory(), np.uint16)
        except vips.Error as error:
            raise OSError(_first_line(error)) from None
        shaped = samples.reshape(image.height, image.width, image.bands)
    return DeepPicture(shaped, bands, channel, attributes)


def blank_deep(picture: Picture) -> Picture:
    """Return an empty picture like another one, of 16 bits."""
    samples = np.empty((picture.height, picture.width, len(picture.bands)), np.uint16)
    return DeepPicture(samples, picture.bands, picture.channel, picture.attributes)


def _first_line(error: Any) -> str:
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    return lines[min(1, len(lines) - 1)]


def _vips() -> Any:
    try:
        import pyvips
    except (ImportError, OSError):
        raise MdfconvError(
            "16-bit RGB(A) needs libvips, as Pillow holds 8 bits of it",
            "pip install 'mdfconv[rgb16]'",
        ) from None
    # Python writes to standard error what a library logs and nobody takes.
    logging.getLogger("pyvips").addHandler(logging.NullHandler())
    return pyvips
