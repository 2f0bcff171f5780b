"""Roughness textures: every texel converted, as arrays and as files."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from dataclasses import replace
from itertools import chain
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mdfconv.errors import MdfconvError, MdfconvWarning
from mdfconv.output.files import staged_files
from mdfconv.scene.texture import images
from mdfconv.scene.texture.channels import ChannelMove
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
    to_channel: str | None = None,
    into: str | Path | PictureFile | None = None,
    depth: int | None = None,
    dither: bool = False,
    lossy: bool = False,
    max_pixels: int | None = None,
    progress: Progress | None = None,
    fill: Callable[[Path], Path] | None = None,
) -> TextureReport:
    """Convert a texture in a PNG, TIFF, TGA or OpenEXR file, and write it to another.

    The other channels, the ICC profile and the resolution are kept, bit by bit unless the depth
    changes. Values are taken as they are stored, and stay where they are: neither a profile nor a
    tag of the orientation is applied, and both are kept. Palettes, and 1, 2 or 4 bits, become
    8 bits.

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
        for grey that is stored as colour. Needed if there is more than one. A grey picture has r,
        g and b, which are grey, and becomes one of colours if one of them is chosen.
    to_channel : str, optional
        Where the results go, as many as `channel` names, as a smoothness in alpha becomes a
        roughness in green; into `channel` itself if not given. The channel that they come from
        stays as it is. Alpha is added if it is not there.
    into : str, Path or PictureFile, optional
        A picture of the same size, with all the other channels of the result and what it says of
        itself, instead of the source.
    depth : int, optional
        8 or 16 bits for the result; kept if not given, that of `into` if there is one.
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
    result = _picture_file(output)
    files = [_picture_file(file) for file in (source, into) if file is not None]
    ValueConverter(rule)  # names are wrong more often than files
    forms = [images.check_files(file, result, lossy=lossy) for file in files]
    with nullcontext(fill) if fill else _staged() as place, ExitStack() as opened:
        pictures = [
            opened.enter_context(
                images.open_picture(file, *both, lossy=lossy, max_pixels=max_pixels)
            )
            for file, both in zip(files, forms, strict=True)
        ]
        base, form = pictures[-1], forms[-1][1]
        move = ChannelMove(pictures[0], base, channel, to_channel)
        width = base.width if dither else None
        convert = TexelMap(rule, move.dtype, depth or move.depth, width, channels=len(move))
        dtype = move.dtype_of_result(convert)
        images.check_output(base, move.layout, form, dtype)
        written = images.written(
            place(result.path), form, base, move.layout, dtype, new_alpha=move.new_alpha
        )
        rows = progress("rows", base.height) if progress else nullcontext(lambda _: None)
        with written as write, rows as advance:
            for top, bottom in images.row_blocks(pictures, BLOCK):
                write(move.rows(top, bottom, convert))
                advance(bottom - top)
        remarks = chain(*(picture.remarks(form) for picture in pictures), move.remarks())
        return replace(convert.report(), channels=str(move), remarks=tuple(remarks))


def _picture_file(file: str | Path | PictureFile) -> PictureFile:
    return file if isinstance(file, PictureFile) else PictureFile(Path(file))


@contextmanager
def _staged() -> Iterator[Callable[[Path], Path]]:
    """Give a place beside a file's own, which it gets in the end."""
    with staged_files(lambda _: False) as files:
        yield files.fill


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
