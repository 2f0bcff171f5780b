"""Roughness textures: every texel converted, as arrays and as files."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mdfconv.errors import MdfconvError, MdfconvWarning
from mdfconv.scene.image_files import blank, check_files, open_picture, staged
from mdfconv.scene.image_picture import Picture
from mdfconv.scene.texture_map import BLOCK, TexelMap, TextureReport
from mdfconv.scene.texture_rule import TextureRule
from mdfconv.scene.texture_values import ValueConverter

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
        `mdfconv.scene.texture_values.ValueConverter` says; NaN stays NaN.

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
    step = _rows_a_block(rows.shape[1])
    for start in range(0, len(rows), step):
        results[start : start + step] = convert(rows[start : start + step])
    for note in convert.report().notes(ends=False)[:1]:
        warnings.warn(note, MdfconvWarning, stacklevel=2)
    return converted


def convert_texture_file(
    source: str | Path,
    output: str | Path,
    rule: TextureRule,
    *,
    channel: str | None = None,
    depth: int | None = None,
    dither: bool = False,
    lossy: bool = False,
    max_pixels: int | None = None,
    progress: Progress | None = None,
) -> TextureReport:
    """Convert a texture in a PNG, TIFF or OpenEXR file, and write it to another.

    The other channels, the ICC profile and the resolution are kept, bit by bit unless the depth
    changes. Values are taken as they are stored: a profile is not applied.

    Parameters
    ----------
    source, output : str or Path
        The files; their names end in what they hold: .png, .tif, .tiff or .exr. EXR becomes
        EXR, PNG and TIFF become either. An existing output is replaced, whole or not at all.
    rule : TextureRule
        What to convert, and how.
    channel : str, optional
        r, g, b, a or l (grey), in EXR the channel's name; needed if there is more than one.
    depth : int, optional
        8 or 16 bits for the result; kept if not given.
    dither : bool
        Whether a result of 8 bits hands its rounding errors to the neighbours.
    lossy : bool
        Whether to accept a source whose compression has altered its values, such as JPEG.
    max_pixels : int, optional
        The largest picture that is decoded; Pillow's limit if not given.
    progress : callable, optional
        ``progress(description, total)``, a context that yields what advances by so many rows.

    Returns
    -------
    TextureReport
        How many texels were clamped and why, and histograms before and after.

    Raises
    ------
    MdfconvError
        If the rule, the source or the output cannot be; nothing is then written.
    """
    source, output = Path(source), Path(output)
    ValueConverter(rule)  # names are wrong more often than files
    source_form, form = check_files(source, output, lossy=lossy)
    with staged(output) as beside:
        picture = open_picture(source, source_form, channel, lossy=lossy, max_pixels=max_pixels)
        convert = TexelMap(rule, picture.dtype, depth, picture.width if dither else None)
        same_depth = convert.dtype == picture.dtype
        converted = picture if same_depth else blank(picture, convert.dtype)
        with progress("rows", picture.height) if progress else nullcontext(_ignore) as advance:
            _convert(picture, converted, convert, advance)
        converted.save(beside, form)
    return convert.report()


def _convert(
    picture: Picture, converted: Picture, convert: TexelMap, advance: Callable[[int], None]
) -> None:
    """Convert row by row, into the same picture or into one of another depth."""
    step = _rows_a_block(picture.width)
    for top in range(0, picture.height, step):
        block = picture.read(top, min(top + step, picture.height))
        channel = convert(block[..., picture.channel])
        block = _rescaled(block, convert.dtype)
        block[..., picture.channel] = channel
        converted.write(top, block)
        advance(len(block))


def _rescaled(block: NDArray[Any], dtype: np.dtype[Any]) -> NDArray[Any]:
    """Return the channels that are not converted in the depth of the result."""
    if block.dtype == dtype:
        return block
    if dtype == np.uint16:
        return block * np.uint16(257)
    return np.rint(block / np.float32(257)).astype(np.uint8)


def _rows_a_block(width: int) -> int:
    return max(1, BLOCK // max(1, width))


def _ignore(rows: int) -> None:
    pass
