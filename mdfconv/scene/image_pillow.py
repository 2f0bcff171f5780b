"""PNG and TIFF through Pillow: 8 bits, and 16 bits of grey."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from PIL.ImageFile import ImageFile
from PIL.JpegImagePlugin import JpegImageFile
from PIL.PngImagePlugin import PngImageFile
from PIL.TiffImagePlugin import TiffImageFile

from mdfconv.errors import MdfconvError
from mdfconv.scene.image_picture import (
    ACCEPT_LOSSES,
    Attributes,
    Form,
    Picture,
    check_size,
    find_channel,
    quiet_streams,
)

_DECODERS: dict[Form, type[ImageFile]] = {
    Form.png: PngImageFile,
    Form.tiff: TiffImageFile,
    Form.jpeg: JpegImageFile,
}
_BANDS = {
    "L": "L",
    "LA": "LA",
    "RGB": "RGB",
    "RGBA": "RGBA",
    "I;16": "L",
    "I;16B": "L",
}
# Pillow's names of compressions with losses.
_LOSSY = ("jpeg", "tiff_jpeg", "webp")
# Of the PNG header: bits a sample, after the signature, the chunk's head and the size.
_PNG_DEPTH = 24
# Numbers of TIFF's tags, and of two of their values.
_BITS_PER_SAMPLE, _PHOTOMETRIC, _SAMPLES_PER_PIXEL, _EXTRA_SAMPLES = 258, 262, 277, 338
_WHITE_IS_ZERO, _ASSOCIATED_ALPHA = 0, 1
# Deflate, of the differences between neighbours (tag 317).
_COMPRESSION, _PREDICTOR = "tiff_adobe_deflate", {317: 2}


class PillowPicture(Picture):
    """A picture in Pillow's memory, which is changed in place: the only decoded copy."""

    def __init__(self, image: Image.Image, channel: int, attributes: Attributes) -> None:
        deep = image.mode.startswith("I;16")
        dtype = np.dtype(np.uint16 if deep else np.uint8)
        super().__init__(image.size, dtype, _BANDS[image.mode], channel, attributes)
        self._image = image

    def read(self, top: int, bottom: int) -> NDArray[Any]:
        """Return a copy of some rows."""
        rows = np.array(self._image.crop((0, top, self.width, bottom)))
        return rows.astype(self.dtype, copy=False).reshape(bottom - top, self.width, -1)

    def write(self, top: int, block: NDArray[Any]) -> None:
        """Replace rows."""
        rows = block[..., 0] if block.shape[-1] == 1 else block
        if self._image.mode == "I;16B":
            rows = rows.astype(">u2")
        self._image.paste(Image.fromarray(np.ascontiguousarray(rows)), (0, top))

    def save(self, path: Path, form: Form) -> None:
        """Write the picture with its profile and resolution, losslessly compressed."""
        options: dict[str, Any] = {"icc_profile": self.attributes.icc_profile}
        if form is Form.tiff:
            options |= {"compression": _COMPRESSION, "tiffinfo": _PREDICTOR}
        # From TIFF to TIFF Pillow keeps the resolution as the file has it, in its unit.
        if form is not Form.tiff or not isinstance(self._image, TiffImageFile):
            options["dpi"] = self.attributes.dpi
        with quiet_streams():
            self._image.save(path, format=form.value, **options)


def blank_pillow(picture: Picture, dtype: np.dtype[Any]) -> Picture:
    """Return an empty picture like another one, of a depth that Pillow holds."""
    mode = "I;16" if dtype == np.uint16 else picture.bands
    image = Image.new(mode, (picture.width, picture.height))
    return PillowPicture(image, picture.channel, picture.attributes)


def decode(
    file: IO[bytes],
    path: Path,
    form: Form,
    channel: str | None,
    *,
    lossy: bool,
    max_pixels: int | None,
) -> Picture:
    """Decode a PNG, TIFF or JPEG file.

    Raises
    ------
    MdfconvError
        If the picture is too large, of a kind whose values are no roughness, or has no such
        channel; other exceptions if the file is damaged.
    """
    with warnings.catch_warnings():
        # What matters of Pillow's warnings comes back as an error when the texels are decoded.
        warnings.simplefilter("ignore")
        # Not Image.open: it would try other forms, and has the limit of size in a global.
        image = _DECODERS[form](file)
        check_size(path, image.size, max_pixels)
        _check_kind(image, path, lossy=lossy)
        attributes = Attributes(image.info.get("icc_profile"), _dpi(image))
        bands = _BANDS[image.mode]
        index = find_channel(path, bands.lower(), channel)
        if len(bands) > 1 and _depth(image, file) == 16:
            from mdfconv.scene.image_vips import read_deep

            return read_deep(path, bands, index, attributes)
        with quiet_streams():
            image.load()
    return PillowPicture(image, index, attributes)


def _check_kind(image: ImageFile, path: Path, *, lossy: bool) -> None:
    """Refuse pictures whose values are not those of a roughness, or would not be kept."""
    reason, hint = "", ""
    if image.mode in ("P", "PA"):
        reason = "has a palette: its texels are indices, not values"
        hint = "save it as grey or RGB"
    elif image.mode not in _BANDS:
        reason = f"is of Pillow's mode {image.mode}, not grey or RGB(A) of 8 or 16 bits"
    elif getattr(image, "n_frames", 1) > 1:
        reason, hint = "holds several pictures, of which only one would be kept", "split it"
    elif "transparency" in image.info:
        reason = "makes one value transparent, which would be another"
        hint = "save it with alpha"
    elif isinstance(image, TiffImageFile):
        reason, hint = _tiff_reason(image, lossy=lossy)
    if reason:
        raise MdfconvError(f"{path} {reason}", hint)


def _tiff_reason(image: TiffImageFile, *, lossy: bool) -> tuple[str, str]:
    """Return why a TIFF cannot be taken, and what helps; empty if it can."""
    tags = image.tag_v2
    if tags.get(_SAMPLES_PER_PIXEL, 1) != len(image.getbands()):
        count = tags[_SAMPLES_PER_PIXEL]
        return f"has {count} channels, of which only {image.mode} would be kept", ""
    if _ASSOCIATED_ALPHA in tags.get(_EXTRA_SAMPLES, ()):
        return "has channels that are multiplied by alpha", "save it with unassociated alpha"
    if tags.get(_PHOTOMETRIC) == _WHITE_IS_ZERO and image.mode.startswith("I;16"):
        return "counts from white (0) to black", "save it with black as zero"
    if image.info.get("compression") in _LOSSY and not lossy:
        return "is compressed with losses, which has altered the values", ACCEPT_LOSSES
    return "", ""


def _depth(image: ImageFile, file: IO[bytes]) -> int:
    """Return the bits a sample in the file, which Pillow cuts to 8 for several channels."""
    if isinstance(image, TiffImageFile):
        return int(max(image.tag_v2.get(_BITS_PER_SAMPLE, (1,))))
    if isinstance(image, PngImageFile):
        position = file.tell()
        file.seek(_PNG_DEPTH)
        depth = file.read(1)[0]
        file.seek(position)
        return depth
    return 8


def _dpi(image: ImageFile) -> tuple[float, float] | None:
    dpi = image.info.get("dpi")
    return (float(dpi[0]), float(dpi[1])) if dpi else None
