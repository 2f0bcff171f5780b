"""Texture files through OpenImageIO: read some rows at a time, and written whole or not at all."""

from __future__ import annotations

import os
import struct
import sys
import zlib
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass
from math import lcm
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mdfconv.errors import MdfconvError
from mdfconv.output.kinds import HEAD_BYTES, refuse_foreign
from mdfconv.scene.texture import headers
from mdfconv.scene.texture.channels import ALPHA, GREY, Layout
from mdfconv.scene.texture.headers import PngHeader, Reason


@contextmanager
def quiet_streams() -> Iterator[None]:
    """Keep libpng and OpenEXR from the process's streams; it holds for the whole process."""
    with open(os.devnull, "wb") as null, ExitStack() as restore:
        for number, stream in ((1, sys.stdout), (2, sys.stderr)):
            if stream is not None:
                stream.flush()
                copy = os.dup(number)
                restore.callback(os.close, copy)
                restore.callback(os.dup2, copy, number)
                os.dup2(null.fileno(), number)
        yield


# A small file can claim any size, and what is interlaced is held as a whole.
MAX_PIXELS = 1 << 27
_ACCEPT_LOSSES = "take the original, or accept the losses"
_LOSSLESS = ("", "none", "rle", "lzw", "zip", "zips", "piz", "packbits", "lzma", "zstd", "htj2k")
# Integers up to here are exact where OpenImageIO takes them for floats.
_LARGEST_MIXED = 1 << 24
# A prediction from the left: nearly as small as trying all of them, in a fourth of the time.
_PNG_SETTINGS = {"png:filter": 16, "png:compressionLevel": 4}
# Beyond it a PNG cannot say how many texels a metre has.
_PNG_LIMIT = 1 << 31
# Compressions of OpenEXR that alter the texels of some types.
_LOSSY_TYPES = {
    "pxr24": ("float", "double"),
    **dict.fromkeys(("b44", "b44a"), ("half",)),
    **dict.fromkeys(("dwaa", "dwab"), ("half", "float", "double")),
}
# OpenImageIO's names of types.
_FLOATS = {"half": "float16", "float": "float32", "double": "float64"}
_DTYPES = {"uint8": "uint8", "uint16": "uint16"} | _FLOATS
_NAMES = {dtype: name for name, dtype in _DTYPES.items()}
# Of the attributes of a picture those that are about its texels; the writer of TIFF makes the
# vertical resolution from the horizontal one and the aspect.
_ATTRIBUTES = ("XResolution", "YResolution", "ResolutionUnit", "PixelAspectRatio")


@dataclass(frozen=True)
class PictureForm:
    """A form of image files."""

    name: str
    # Its name in OpenImageIO.
    library: str
    endings: tuple[str, ...]
    # What files of it start with; none if there is nothing to tell them by.
    signatures: tuple[bytes, ...] = ()
    # The channels that it holds; none if it holds any.
    bands: tuple[str, ...] = ()
    # Why a file of it is no texture, if it is none.
    reason: Callable[[Path], Reason | None] = lambda _: None

    def __str__(self) -> str:
        return self.name


PNG = PictureForm(
    *("PNG", "png", (".png",), (b"\x89PNG\r\n\x1a\n",), ("Y", "YA", "RGB", "RGBA")),
    lambda path: PngHeader(path).reason(),
)
TIFF = PictureForm(
    *("TIFF", "tiff", (".tif", ".tiff"), (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")),
    reason=headers.tiff_reason,
)
TGA = PictureForm("TGA", "targa", (".tga",), (), ("Y", "RGB", "RGBA"), headers.tga_reason)
EXR = PictureForm("OpenEXR", "openexr", (".exr",), (b"\x76\x2f\x31\x01",))
JPEG = PictureForm("JPEG", "jpeg", (".jpg", ".jpeg"), (b"\xff\xd8\xff",))
FORMS = (PNG, TIFF, TGA, EXR, JPEG)


def _form_named(path: Path) -> PictureForm | None:
    """Return the form that a file's name says."""
    return next((form for form in FORMS if path.suffix.lower() in form.endings), None)


def pictures_in(folder: Path) -> list[Path]:
    """Return the files of a folder that are pictures by their names, in alphabetical order."""
    pictures = [path for path in sorted(folder.iterdir()) if _form_named(path) and path.is_file()]
    if not pictures:
        raise MdfconvError(f"{folder} has no file that is a PNG, TIFF, TGA or OpenEXR by its name")
    return pictures


def result_name(path: Path) -> Path:
    """Return a name of the same stem whose form a texture may have: for a JPEG that of a PNG."""
    return path.with_suffix(PNG.endings[0]) if _form_named(path) is JPEG else path


@dataclass(frozen=True)
class PictureFile:
    """A file, and what messages call it."""

    path: Path
    name: str = ""

    def __str__(self) -> str:
        return self.name or str(self.path)


def check_files(
    source: PictureFile, output: PictureFile, *, lossy: bool = False
) -> tuple[PictureForm, PictureForm]:
    """Return the forms of two files; refuse those between which no texture can go."""
    form = form_of(source)
    new_form = _form_named(output.path)
    if form is JPEG and not lossy:
        raise MdfconvError(
            f"{source} is a JPEG, which has altered the values (8-bit blocks with losses, made "
            "for gamma-encoded pictures)",
            _ACCEPT_LOSSES,
            argument="lossy",
        )
    if new_form is JPEG:
        raise MdfconvError(f"{output}: a JPEG would alter the values", "write .png or .tif")
    if new_form is None:
        raise MdfconvError(f"{output} does not end in .png, .tif, .tiff, .tga or .exr")
    if (form is EXR) != (new_form is EXR):
        kind, endings = ("floats", ".exr") if form is EXR else ("integers", ".png or .tif")
        raise MdfconvError(f"{source} holds {kind}, which {new_form} does not", f"write {endings}")
    place = output.path
    if place == source.path or (place.exists() and place.samefile(source.path)):
        raise MdfconvError(f"{output} is the same file as {source}", "write to another one")
    return form, new_form


def form_of(source: PictureFile) -> PictureForm:
    """Return the form of a file's content, if its name does not say another."""
    with reading(source), source.path.open("rb") as file:
        start = file.read(HEAD_BYTES)
    form = next((form for form in FORMS if start.startswith(form.signatures)), None)
    if form is None:
        refuse_foreign(source, start)
    named = _form_named(source.path)
    if form is None and named is TGA and start:
        return TGA  # which has no signature
    if form is None:
        raise MdfconvError(f"{source} is no PNG, TIFF, TGA or OpenEXR file")
    if named not in (None, form):
        raise MdfconvError(f"{source} holds {form}, not what its name says")
    return form


class Picture:
    """An open picture that is read some rows at a time, in the order in which it is stored."""

    def __init__(
        self, source: PictureFile, form: PictureForm, file: Any, output: PictureForm
    ) -> None:
        self.source, self.form, self._file = source, form, file
        self.spec = file.spec()
        names: tuple[str, ...] = self.spec.channelnames
        self.kinds = [str(self.spec.channelformat(at)) for at in range(self.spec.nchannels)]
        # Halves are exact as singles.
        self._kind = self.kinds[0] if len(set(self.kinds)) == 1 else "float"
        self.width, self.height = self.spec.width, self.spec.height
        # All channels, and those that the picture has if nobody asks for others.
        self.whole = self.layout = Layout(names, tuple(range(len(names))))
        self.unused_alpha = form is TGA and headers.has_unused_alpha(source.path)
        if self.unused_alpha and output is not TGA:
            self.layout = Layout(names[:3], (0, 1, 2))
        if form is PNG and PngHeader(source.path).has_grey_palette():
            alpha = (ALPHA,) if ALPHA in names else ()
            self.whole = self.layout = Layout((GREY, *alpha), (0, *(3 for _ in alpha)))

    @property
    def orientation(self) -> int:
        """By which of EXIF's numbers it is to be turned for the eye: 1 for not at all."""
        tag = int(self.spec.get_int_attribute("Orientation", 1))
        return PngHeader(self.source.path).orientation if self.form is PNG and tag == 1 else tag

    def dtype_of(self, channels: Sequence[int]) -> np.dtype[Any]:
        """Return the type of the texels of some channels of the file, which must have the same."""
        for channel in channels:
            if self.kinds[channel] not in _DTYPES:
                name = self.spec.channelnames[channel]
                raise MdfconvError(f"{self.source}: channel {name} holds integers, not floats")
        kinds = {self.kinds[channel] for channel in channels}
        if len(kinds) > 1:
            raise MdfconvError(
                f"{self.source}: the channels are of the types {' and '.join(sorted(kinds))}",
                "convert one after the other",
            )
        return np.dtype(_DTYPES[kinds.pop()])

    @property
    def block_dtype(self) -> np.dtype[Any]:
        """The type in which rows of all channels are read."""
        return np.dtype(_DTYPES.get(self._kind, "float32"))

    def rows_together(self, most: int) -> int:
        """Return how many rows, of at most so many where it is a choice, are decoded together."""
        # Compressed rows may be as well; a strip may be the whole picture.
        chunk: int = self.spec.get_int_attribute("oiio:RowsPerChunk", 1)
        return self.spec.tile_height or (chunk if 0 < chunk <= most else 1)

    def read(self, top: int, bottom: int) -> NDArray[Any]:
        """Return the rows before `bottom`, shape (rows, width, channels of the file)."""
        for channel, kind in enumerate(self.kinds):
            if self._kind == "float" and kind == "uint":
                integers = self._decode(top, bottom, channel, channel + 1, kind)
                if integers.max() >= _LARGEST_MIXED:
                    raise MdfconvError(
                        f"{self.source} has floats and, in channel "
                        f"{self.spec.channelnames[channel]}, integers above {_LARGEST_MIXED}, "
                        "which would lose digits",
                        "split it",
                    )
        return self._decode(top, bottom, 0, self.spec.nchannels, self._kind)

    def _decode(self, top: int, bottom: int, first: int, last: int, kind: str) -> NDArray[Any]:
        """Return some rows of the channels from `first` on and before `last`."""
        spec = self.spec
        columns, depth = _beyond_rows(spec)
        read = self._file.read_tiles if spec.tile_width else self._file.read_scanlines
        with reading(self.source):
            texels = read(*columns, spec.y + top, spec.y + bottom, *depth, first, last, kind)
            fault = self._file.geterror()
            if texels is None or fault:
                raise ValueError(fault)
        return np.asarray(texels).reshape(bottom - top, spec.width, last - first)

    def profile(self) -> bytes:
        """Return the colour profile; empty if there is none."""
        if self.form is PNG:
            return PngHeader(self.source.path).profile()
        profile = self.spec.getattribute("ICCProfile")
        return b"" if profile is None else np.asarray(profile).tobytes()

    def remarks(self, output: PictureForm) -> Iterator[str]:
        """Yield what the user must know of how the texels were taken, and what is left out."""
        with reading(self.source):
            what = PngHeader(self.source.path).gamma() if self.form is PNG else ""
            if self.profile():
                name = self.spec.get_string_attribute("ICCProfile:profile_description")
                what = f"a colour profile ({name})" if name else "a colour profile"
        if what:
            yield (
                f"{self.source} has {what}, which is not for data: its texels were taken as they "
                "are"
            )
        if self.layout != self.whole:
            yield (
                f"{self.source} has four bytes a texel and no alpha: the fourth is left out unless "
                "it is chosen"
            )
        if self.orientation != 1 and output is TGA:
            yield (
                f"{self.source} has a tag of the orientation {self.orientation}, which {output} "
                "does not hold: its texels stay where they are"
            )


def row_blocks(pictures: Sequence[Picture], texels: int) -> Iterator[tuple[int, int]]:
    """Yield between which rows to read pictures of one size, about so many texels at a time."""
    height = pictures[0].height
    step = max(1, texels // pictures[0].width)
    together = lcm(*(picture.rows_together(step) for picture in pictures))
    step = max(together, step - step % together)
    for top in range(0, height, step):
        yield top, min(top + step, height)


@contextmanager
def open_picture(
    source: PictureFile,
    form: PictureForm,
    output: PictureForm,
    *,
    lossy: bool,
    max_pixels: int | None,
) -> Iterator[Picture]:
    """Open a picture, for an output of some form.

    What is damaged, too large, or of a kind that is no roughness is refused.
    """
    import OpenImageIO

    config = OpenImageIO.ImageSpec()
    config.attribute("oiio:UnassociatedAlpha", 1)  # or it would multiply by alpha
    with reading(source):
        _refuse(source, form.reason(source.path))
        file = OpenImageIO.ImageInput.open(str(source.path), config)
        fault = OpenImageIO.geterror()
        if file is None or file.format_name() != form.library:
            raise ValueError(fault)
    with closing(file):
        with reading(source):
            picture = Picture(source, form, file, output)
            _check_size(picture, MAX_PIXELS if max_pixels is None else max_pixels)
            _refuse(source, _reason(picture))
            if not lossy:
                _refuse_losses(picture)
            if file.seek_subimage(1, 0) or file.seek_subimage(0, 1):
                _refuse(source, headers.SEVERAL_PICTURES)
            file.seek_subimage(0, 0)
            file.geterror()
        yield picture


def _refuse(source: PictureFile, reason: Reason | None) -> None:
    if reason:
        raise MdfconvError(f"{source} {reason[0]}", reason[1])


def _reason(picture: Picture) -> Reason | None:
    """Return why an open picture cannot be taken, and what helps; None if it can."""
    spec = picture.spec
    if spec.deep:
        return "holds deep texels, which are no texture", ""
    space = spec.get_string_attribute("tiff:ColorSpace")
    if space == "palette":  # which OpenImageIO makes a level darker
        return headers.PALETTE
    if space:
        return f"holds {space} colours, not grey or RGB(A)", ""
    if picture.form is not EXR and picture.kinds[0] not in _DTYPES:
        return f"holds texels of the type {picture.kinds[0]}", "save it with 16 bits or as floats"
    # OpenImageIO turns this round for 8 bits.
    white_is_zero = spec.get_int_attribute("tiff:PhotometricInterpretation", 1) == 0
    if white_is_zero and picture.kinds[0] != "uint8":
        return "counts from white (0) to black", "save it with black as zero"
    return None


def _refuse_losses(picture: Picture) -> None:
    """Refuse a compression that has altered the values."""
    name = picture.spec.get_string_attribute("compression").partition(":")[0]
    if picture.form is EXR:
        lossy = not set(_LOSSY_TYPES.get(name, ())).isdisjoint(picture.kinds)
    else:
        lossy = picture.form is TIFF and name not in _LOSSLESS
    if lossy:
        raise MdfconvError(
            f"{picture.source} is compressed with losses ({name}), which has altered the values",
            _ACCEPT_LOSSES,
            argument="lossy",
        )


def _check_size(picture: Picture, limit: int) -> None:
    width, height = picture.width, picture.height
    if (pixels := width * height) > limit:
        raise MdfconvError(
            f"{picture.source} has {width}×{height} = {pixels} pixels, more than the {limit} that "
            "are safe to decode unasked",
            f"allow {pixels} pixels",
            argument="max_pixels",
        )


def _beyond_rows(spec: Any) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Return what OpenImageIO takes before and behind the rows, of tiles and of scanlines."""
    return ((spec.x, spec.x + spec.width), (0, 1)) if spec.tile_width else ((), (0,))


@contextmanager
def reading(source: PictureFile) -> Iterator[None]:
    """Turn what damaged files raise into one line."""
    try:
        with quiet_streams():
            yield
    except MdfconvError:
        raise
    except MemoryError:
        raise MdfconvError(f"{source} does not fit into the memory") from None
    except OSError as error:
        raise MdfconvError(f"cannot read {source}: {error.strerror}") from None
    except UnicodeDecodeError:  # a fault with a name that is none
        raise MdfconvError(f"{source} is damaged") from None
    except (ValueError, LookupError, ArithmeticError, RuntimeError, struct.error) as error:
        reason = (str(error).strip().splitlines() or ["its header does not add up"])[0]
        raise MdfconvError(f"{source} is damaged, incomplete or unusual: {reason}") from None


def check_output(picture: Picture, layout: Layout, form: PictureForm, dtype: np.dtype[Any]) -> None:
    """Refuse a form that cannot hold what a picture becomes."""
    if not form.bands:
        return
    if dtype.kind == "f":
        raise MdfconvError(f"{picture.source} holds floats, which {form} does not", "write .tif")
    if form is TGA and dtype != np.uint8:
        raise MdfconvError("TGA holds 8 bits, not 16", "write .png or .tif")
    if "".join(layout.names) not in form.bands:
        known = ", ".join(layout.names)
        raise MdfconvError(
            f"{picture.source} has the channels {known}, which {form} does not hold", "write .tif"
        )


@contextmanager
def written(
    path: Path,
    form: PictureForm,
    picture: Picture,
    layout: Layout,
    dtype: np.dtype[Any],
    *,
    new_alpha: bool,
) -> Iterator[Callable[[NDArray[Any]], None]]:
    """Give what takes the rows of a converted picture, for a file that is there and empty."""
    import OpenImageIO

    with reading(picture.source):  # whose texts may be none
        spec = _output_spec(picture, layout, form, dtype)
    file: Any = OpenImageIO.ImageOutput.create(form.library)
    if not file.open(str(path), spec):
        raise OSError(file.geterror())
    columns, depth = _beyond_rows(spec)
    put = file.write_tiles if spec.tile_width else file.write_scanlines
    top = spec.y

    def write(rows: NDArray[Any]) -> None:
        nonlocal top
        if not put(*columns, top, top + len(rows), *depth, rows):
            raise OSError(file.geterror())
        top += len(rows)

    try:
        yield write
    finally:
        with quiet_streams():  # libpng misses what has not been written
            closed = file.close()
    if not closed:
        raise OSError(file.geterror())
    if form is PNG:
        headers.replace_chunks(path, _png_chunks(picture))
    if form is TGA:
        headers.check_tga(path, spec.image_bytes())
        if picture.unused_alpha and not new_alpha:
            headers.say_alpha_is_unused(path)


def _output_spec(picture: Picture, layout: Layout, form: PictureForm, dtype: np.dtype[Any]) -> Any:
    """Return what a converted file says of itself."""
    import OpenImageIO

    original = picture.spec
    if form is EXR:
        spec = _exr_spec(picture, layout)
    else:
        size = picture.width, picture.height
        spec = OpenImageIO.ImageSpec(*size, len(layout.names), _NAMES[dtype.name])
        spec.attribute("oiio:UnassociatedAlpha", 1)
        spec.attribute("compression", "none" if form is TGA else "zip")
    spec.channelnames, spec.alpha_channel = layout.names, original.alpha_channel
    if layout.names != original.channelnames:
        spec.alpha_channel = layout.names.index(ALPHA) if ALPHA in layout.names else -1
    if not original.get_string_attribute("DateTime"):
        spec.attribute("DateTime", "")  # or it would be now
    if form is PNG:
        for name, value in _PNG_SETTINGS.items():
            spec.attribute(name, value)
    if form is TIFF:
        spec.attribute("tiff:half", 1)
        spec.attribute("Orientation", picture.orientation)
        if profile := picture.profile():
            kind = OpenImageIO.TypeDesc(f"uint8[{len(profile)}]")
            spec.attribute("ICCProfile", kind, np.frombuffer(profile, np.uint8))
        for attribute in original.extra_attribs:
            if attribute.name in _ATTRIBUTES:
                spec.attribute(attribute.name, attribute.type, attribute.value)
    return spec


def _exr_spec(picture: Picture, layout: Layout) -> Any:
    """Return what an OpenEXR file says of itself, with the channels of a layout."""
    import OpenImageIO

    spec = picture.spec.copy()
    # The rows come from the top.
    spec.attribute("openexr:lineOrder", "increasingY")
    if spec.get_string_attribute("compression") not in _LOSSLESS:
        spec.attribute("compression", "zip")
    if layout.names != spec.channelnames:
        kinds = [picture.kinds[place] for place in layout.places]
        spec.nchannels = len(kinds)
        spec.channelformats = tuple(map(OpenImageIO.TypeDesc, kinds))
    return spec


def _png_chunks(picture: Picture) -> bytes:
    """Return what a PNG says of its texels.

    OpenImageIO calls all texels sRGB there, and ends the process over a faulty profile.
    """
    spec, chunks = picture.spec, b""
    header = PngHeader(picture.source.path) if picture.form is PNG else None
    if picture.orientation != 1 and not (header and header.has_exif):
        chunks += headers.exif_chunk(picture.orientation)
    if header:
        return header.texel_chunks() + chunks
    if profile := picture.profile():
        chunks += headers.png_chunk(b"iCCP", b"ICC profile\0\0" + zlib.compress(profile))
    x, y = (spec.get_float_attribute(f"{axis}Resolution") for axis in "XY")
    per_unit = {"cm": 100.0, "none": 1.0}
    unit = spec.get_string_attribute("ResolutionUnit")
    factor = per_unit.get(unit, 1 / 0.0254)
    if 0 < x * factor < _PNG_LIMIT and 0 < y * factor < _PNG_LIMIT:
        sides = round(x * factor), round(y * factor)
        chunks += headers.png_chunk(b"pHYs", struct.pack(">IIB", *sides, unit != "none"))
    return chunks
