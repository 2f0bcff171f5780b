"""Roughness textures: every texel converted, as arrays and as files."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mdfconv.errors import MdfconvError, MdfconvWarning
from mdfconv.output.files import staged_files
from mdfconv.scene.texture import images
from mdfconv.scene.texture.images import PictureFile
from mdfconv.scene.texture.rule import TextureRule, ValueConverter
from mdfconv.scene.texture.texel_map import BLOCK, TexelMap, TextureReport

Progress: TypeAlias = Callable[[str, int], AbstractContextManager[Callable[[int], None]]]


def convert_texture(
    array: ArrayLike, rule: TextureRule, *, depth: int | None = None, dither: bool = False
) -> NDArray[Any]:
    """Convert the texels of an array.

    Parameters
    ----------
    array : array_like of uint8, uint16, float16, float32 or float64, any shape
        The one channel that holds the roughness. Integers stand for their share of the largest
        integer.
    rule : TextureRule
        What to convert, and how.
    depth : int, optional
        8 or 16 for a result of so many bits, from integers; the type is kept if not given.
    dither : bool
        Whether a result of 8 bits hands its rounding errors to the neighbours; takes a
        two-dimensional array.

    Returns
    -------
    numpy.ndarray
        The converted texels, same shape. Texels that have no answer are treated as
        `mdfconv.scene.texture.rule.ValueConverter` says; NaN stays NaN.

    Raises
    ------
    MdfconvError
        If a name is unknown, the pair not covered by the method, or the array not a texture.

    Warns
    -----
    MdfconvWarning
        Once, if texels were clamped or are NaN.

    Examples
    --------
    >>> rule = TextureRule("blinn-phong:exponent", "ggx:roughness", metric="energy")
    >>> convert_texture(np.array([0, 26, 255], np.uint8), rule)
    array([255,  91,  52], dtype=uint8)
    """
    texels = np.asarray(array)
    if dither and texels.ndim != 2:
        raise MdfconvError(
            f"dither takes an array of rows and columns, not of shape {texels.shape}"
        )
    convert = TexelMap(rule, texels.dtype, depth, texels.shape[1] if dither else None)
    converted = np.empty(texels.shape, convert.dtype)
    rows, results = (each if dither else each.reshape(-1, 1) for each in (texels, converted))
    step = max(1, BLOCK // max(1, rows.shape[1]))
    for start in range(0, len(rows), step):
        results[start : start + step] = convert(rows[start : start + step])
    for note in convert.report().notes(limits=False)[:1]:
        warnings.warn(note, MdfconvWarning, stacklevel=2)
    return converted


def convert_texture_file(
    source: str | Path | PictureFile,
    output: str | Path | PictureFile,
    rule: TextureRule,
    *,
    channel: str | None = None,
    depth: int | None = None,
    dither: bool = False,
    lossy: bool = False,
    max_pixels: int | None = None,
    progress: Progress | None = None,
    fill: Callable[[Path], Path] | None = None,
) -> TextureReport:
    """Convert a texture in a PNG, TIFF, TGA or OpenEXR file, and write it to another.

    The other channels, the ICC profile and the resolution are kept, bit by bit unless the depth
    changes, and a TIFF's orientation. Values are taken as they are stored: a profile is not
    applied.

    Parameters
    ----------
    source, output : str, Path or PictureFile
        The files; their names end in what they hold: .png, .tif, .tiff, .tga or .exr. EXR becomes
        EXR, a TIFF of floats a TIFF, and the others become any of the others. An existing output
        is replaced, whole or not at all.
    rule : TextureRule
        What to convert, and how.
    channel : str, optional
        r, g, b, a or l (grey), in EXR the channel's name; several as ``"rgb"`` or ``"r,g"``, as
        for grey that is stored as colour. Needed if there is more than one.
    depth : int, optional
        8 or 16 bits for the result; kept if not given.
    dither : bool
        Whether a result of 8 bits hands its rounding errors to the neighbours.
    lossy : bool
        Whether to accept a source whose compression has altered its values, such as JPEG.
    max_pixels : int, optional
        The largest picture that is decoded; 2²⁷ (134217728) if not given.
    progress : callable, optional
        ``progress(description, total)``, a context that yields what advances by so many rows.
    fill : callable, optional
        Returns where the output is written for now, to be placed together with other files.

    Returns
    -------
    TextureReport
        How many texels were clamped and why, and histograms before and after, over all chosen
        channels.

    Raises
    ------
    MdfconvError
        If the rule, the source or the output cannot be; nothing is then written.
    """
    source, output = (
        each if isinstance(each, PictureFile) else PictureFile(Path(each))
        for each in (source, output)
    )
    ValueConverter(rule)  # names are wrong more often than files
    source_form, form = images.check_files(source, output, lossy=lossy)
    with (
        nullcontext(fill) if fill else _staged() as place,
        images.open_picture(
            source, source_form, lossy=lossy, max_pixels=max_pixels, upright=bool(form.bands)
        ) as picture,
    ):
        channels = images.find_channels(picture, channel)
        width, dtype = picture.width if dither else None, picture.dtype_of(channels)
        convert = TexelMap(rule, dtype, depth, width, channels=len(channels))
        images.check_output(picture, form, convert.dtype)
        rows = progress("rows", picture.height) if progress else nullcontext(lambda _: None)
        written = images.written(place(output.path), form, picture, convert.dtype)
        with written as write, rows as advance:
            for block in picture.blocks(BLOCK):
                write(_converted(block, channels, convert))
                advance(len(block))
        return replace(convert.report(), remark=picture.remark())


@contextmanager
def _staged() -> Iterator[Callable[[Path], Path]]:
    """Give a place beside a file's own, which it gets in the end."""
    with staged_files(lambda _: False) as files:
        yield files.fill


def _converted(block: NDArray[Any], channels: tuple[int, ...], convert: TexelMap) -> NDArray[Any]:
    """Return some rows with the chosen channels converted, and the others in their depth."""
    rescaled = _rescaled(block, convert.dtype)
    for place, channel in enumerate(channels):
        # Of floats of several types the block has the widest.
        texels = block[..., channel].astype(convert.source_dtype, copy=False)
        rescaled[..., channel] = convert(texels, place)
    return rescaled


def _rescaled(block: NDArray[Any], dtype: np.dtype[Any]) -> NDArray[Any]:
    """Return the channels that are not converted in the depth of the result."""
    if block.dtype == dtype or dtype.kind == "f":
        return block.copy()
    if dtype == np.uint16:
        return block * np.uint16(257)
    return np.rint(block / np.float32(257)).astype(np.uint8)


def convert_texture_bytes(
    data: bytes, suffix: str, rule: TextureRule, channel: str | None = None, *, lossy: bool = False
) -> tuple[bytes, TextureReport]:
    """Convert the content of a picture file, whose name ends in a suffix such as ``".png"``.

    With `lossy` a JPEG is taken, too, and becomes a PNG.
    """
    with TemporaryDirectory() as folder:
        source = PictureFile(Path(folder) / f"texture{suffix}", "the texture")
        target = PictureFile(Path(folder) / f"converted{'.png' if lossy else suffix}", "the result")
        source.path.write_bytes(data)
        try:
            report = convert_texture_file(
                source, target, rule, channel=channel, lossy=lossy, fill=Path
            )
        except OSError as error:
            raise MdfconvError(f"cannot write {target}: {error.strerror or error}") from None
        return target.path.read_bytes(), report
