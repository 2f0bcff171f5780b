"""What files say of themselves and OpenImageIO does not: palettes, gamma, tags, rows that lack."""

from __future__ import annotations

import os
import struct
import zlib
from contextlib import suppress
from io import BytesIO
from math import ceil
from pathlib import Path
from typing import BinaryIO

# Why a file is no texture, and what helps.
Reason = tuple[str, str]
PALETTE = ("has a palette: its texels are indices, not values", "save it as grey or RGB")
SEVERAL_PICTURES = ("holds several pictures, of which only one would be kept", "split it")
# Chunks and texts with EXIF, which has the orientation: PNG's own and those of ImageMagick.
_EXIF, _TEXTS = b"eXIf", (b"tEXt", b"zTXt", b"iTXt")
_EXIF_TEXTS = (b"Raw profile type exif\0", b"Raw profile type APP1\0")
# Chunks that say how a PNG's texels are meant, and stay true when some are converted.
_TEXEL_CHUNKS = (b"cHRM", b"gAMA", b"iCCP", b"sRGB", b"cICP", b"pHYs")
_PNG_HEADER = 33  # bytes, of the signature and the first chunk
_PNG_END = b"IEND\xaeB`\x82"
_TGA_END = b"TRUEVISION-XFILE.\0"
_PALETTE = 3
_LINEAR_GAMMA = 100000
_LARGEST_PROFILE = 1 << 26
# Numbers of TIFF's tags.
_WIDTH, _HEIGHT, _BITS, _COMPRESSION, _SAMPLES, _ROWS = 256, 257, 258, 259, 277, 278
_ORIENTATION, _PLANES, _TILE_WIDTH, _TILE_HEIGHT, _EXTRA = 274, 284, 322, 323, 338
_PLACES = ((273, 279), (324, 325))  # of strips and of tiles: offsets, and bytes
_WHOLE_NUMBERS = {1: "B", 3: "H", 4: "I", 16: "Q"}  # by the number of their type
# Values of the tags of compression, planes and further channels.
_UNCOMPRESSED, _SEPARATE, _ASSOCIATED = 1, 2, 1
# By the kind of a TGA: colour and grey, plain and RLE.
_TGA_BITS = {1: (8,), 2: (24, 32), 3: (8,), 9: (8,), 10: (24, 32), 11: (8,)}
_TGA_PALETTES, _TGA_PALETTE_BITS = (1, 9), 24
# In the header of a TGA the byte with its attribute bits; in its end and its extension, if it has
# one, where that is and what the attributes are.
_TGA_DESCRIPTOR, _TGA_ATTRIBUTES, _TGA_FOOTER, _TGA_KIND = 17, 0x0F, 26, 494


class PngHeader:
    """The chunks of a PNG file beside its texels; ValueError if one is damaged."""

    def __init__(self, path: Path) -> None:
        self._chunks: dict[bytes, bytes] = {}
        self._exif: list[tuple[bytes, bytes]] = []
        size = path.stat().st_size
        with path.open("rb") as file:
            file.seek(8)
            texels = False
            while len(head := file.read(8)) == 8 and (name := head[4:]) != b"IEND":
                length = int.from_bytes(head[:4])
                texels = texels or name == b"IDAT"
                # Behind the texels only the orientation is of interest.
                if texels and name not in (_EXIF, *_TEXTS):
                    file.seek(length + 4, os.SEEK_CUR)
                    continue
                data = file.read(min(length, size))
                if file.read(4) != zlib.crc32(head[4:] + data).to_bytes(4):
                    raise ValueError(f"the sum of the chunk {name.decode('latin-1')} is wrong")
                if name == _EXIF or (name in _TEXTS and data.startswith(_EXIF_TEXTS)):
                    self._exif.append((name, data))
                elif not texels:
                    self._chunks[name] = data

    def reason(self) -> Reason | None:
        """Return why it is no texture, and what helps; None if it is one."""
        *_, kind = struct.unpack(">IIBB", self._chunks.get(b"IHDR", bytes(10))[:10])
        if b"tRNS" in self._chunks and kind != _PALETTE:
            return "makes one value transparent, which would be another", "save it with alpha"
        if b"acTL" in self._chunks:
            return SEVERAL_PICTURES
        return None

    def has_grey_palette(self) -> bool:
        """Return whether it has a palette of nothing but grey."""
        colours = self._chunks.get(b"PLTE", b"")
        is_palette = self._chunks[b"IHDR"][9] == _PALETTE
        return is_palette and colours[::3] == colours[1::3] == colours[2::3]

    @property
    def has_exif(self) -> bool:
        """Whether it has EXIF, in whichever form."""
        return bool(self._exif)

    @property
    def orientation(self) -> int:
        """What the chunk of EXIF says, also behind the texels; 1 if it says nothing.

        OpenImageIO reads those before the texels, and texts.
        """
        for name, data in self._exif:
            if name == _EXIF:
                with suppress(struct.error):
                    return int(_tiff_tags(BytesIO(data), len(data)).get(_ORIENTATION, (1,))[0])
        return 1

    def gamma(self) -> str:
        """Return what the file says of a gamma, in words; empty if it says none."""
        if b"sRGB" in self._chunks:
            return "the gamma of sRGB"
        stored = int.from_bytes(self._chunks.get(b"gAMA", b""))
        return f"a gamma of {_LINEAR_GAMMA / stored:.3g}" if stored % _LINEAR_GAMMA else ""

    def profile(self) -> bytes:
        """Return the colour profile; empty if there is none.

        libpng leaves out those that it finds fault with, of colours in a grey picture for one.
        """
        packed = self._chunks.get(b"iCCP", b"").partition(b"\0")[2][1:]
        try:
            return zlib.decompressobj().decompress(packed, _LARGEST_PROFILE)
        except zlib.error:
            return b""

    def texel_chunks(self) -> bytes:
        """Return the chunks that belong into the converted file."""
        chunks = [(name, self._chunks[name]) for name in _TEXEL_CHUNKS if name in self._chunks]
        return b"".join(png_chunk(*chunk) for chunk in (*chunks, *self._exif))


def png_chunk(name: bytes, data: bytes) -> bytes:
    """Return a chunk of a PNG file."""
    return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))


def exif_chunk(orientation: int) -> bytes:
    """Return the chunk of a PNG file that says how its rows are to be turned for the eye."""
    entry = struct.pack(">HHIHH", _ORIENTATION, 3, 1, orientation, 0)
    return png_chunk(_EXIF, b"MM\0*" + struct.pack(">IH", 8, 1) + entry + bytes(4))


def replace_chunks(path: Path, chunks: bytes) -> None:
    """Give a PNG file these chunks instead of those between its header and its texels.

    OSError if it is not whole, of which OpenImageIO says nothing where the disk is full.
    """
    content = path.read_bytes()
    texels, end = 0, 8
    while len(content) >= end + 12 and not content.endswith(_PNG_END, 0, end):
        if content[end + 4 : end + 8] == b"IDAT":
            texels = texels or end
        end += 12 + int.from_bytes(content[end : end + 4])
    if not texels or not content.endswith(_PNG_END) or len(content) != end:
        raise OSError("it could not be written as a whole")
    path.write_bytes(content[:_PNG_HEADER] + chunks + content[texels:])


def check_tga(path: Path, texels: int) -> None:
    """Check that an uncompressed TGA of so many bytes is whole.

    OSError if not, of which OpenImageIO says nothing where the disk is full.
    """
    content = path.read_bytes()
    if len(content) < texels or not content.endswith(_TGA_END):
        raise OSError("it could not be written as a whole")


def tiff_reason(path: Path) -> Reason | None:
    """Return why a TIFF is no texture, and what helps; None if it is one.

    libtiff takes what follows in the file for rows that lack, so these are looked for: ValueError
    if they do, or if the directory is damaged.
    """
    try:
        with path.open("rb") as file:
            tags = _tiff_tags(file, path.stat().st_size)
    except struct.error:
        raise ValueError("its directory does not add up") from None
    bits: tuple[int, ...] = tags.get(_BITS, (1,))
    few = tags.get(_SAMPLES, (1,)) == (1,) and bits[0] in (1, 2, 4)
    if set(bits) not in ({8}, {16}, {32}, {64}) and not few:
        counts = ", ".join(str(count) for count in sorted(set(bits)))
        return f"has {counts} bits a sample, not 8 or 16", "save it with 16 bits"
    if _ASSOCIATED in tags.get(_EXTRA, ()):
        return "has channels that are multiplied by alpha", "save it with unassociated alpha"
    if _lacks(tags, bits[0], path.stat().st_size):
        raise ValueError("rows are missing")
    return None


def _lacks(tags: dict[int, tuple[int, ...]], bits: int, size: int) -> bool:
    """Return whether strips or tiles are not in the file, or have fewer bytes than texels."""
    samples, planes = tags.get(_SAMPLES, (1,))[0], 1
    if tags.get(_PLANES) == (_SEPARATE,):
        samples, planes = 1, samples
    width, height = tags[_WIDTH][0], tags[_HEIGHT][0]
    tiled = _TILE_WIDTH in tags
    across = tags[_TILE_WIDTH][0] if tiled else width
    rows = tags[_TILE_HEIGHT][0] if tiled else min(tags.get(_ROWS, (height,))[0], height)
    down = ceil(height / rows)
    starts, lengths = (tags.get(tag, ()) for tag in _PLACES[tiled])
    if not len(starts) == len(lengths) == down * ceil(width / across) * planes:
        return True
    ends = [start + length for start, length in zip(starts, lengths, strict=True)]
    if not all(lengths) or max(ends, default=0) > size:
        return True
    if tags.get(_COMPRESSION, (_UNCOMPRESSED,)) != (_UNCOMPRESSED,):
        return False  # what decodes them will say
    line = ceil(across * samples * bits / 8)
    last = rows if tiled else height - rows * (down - 1)
    least = [line * (last if index % down == down - 1 else rows) for index in range(len(lengths))]
    return any(length < fewest for length, fewest in zip(lengths, least, strict=True))


def _tiff_tags(file: BinaryIO, size: int) -> dict[int, tuple[int, ...]]:
    """Return the tags of whole numbers of a TIFF's or a BigTIFF's first picture."""
    start = file.read(16)
    order = "<" if start[:2] == b"II" else ">"
    big = struct.unpack(f"{order}H", start[2:4]) == (43,)
    place, number, entry = ("Q", "Q", "HHQ8s") if big else ("I", "H", "HHI4s")
    inline = 8 if big else 4
    (offset,) = struct.unpack_from(order + place, start, inline)
    file.seek(offset)
    (count,) = struct.unpack(order + number, file.read(struct.calcsize(order + number)))
    entries = file.read(count * struct.calcsize(order + entry))
    tags: dict[int, tuple[int, ...]] = {}
    for tag, kind, number_of, value in struct.iter_unpack(order + entry, entries):
        if kind not in _WHOLE_NUMBERS:
            continue
        numbers = f"{order}{number_of}{_WHOLE_NUMBERS[kind]}"
        length = struct.calcsize(numbers)
        if length > inline:
            file.seek(struct.unpack(order + place, value)[0])
            value = file.read(min(length, size))
        tags[tag] = struct.unpack(numbers, value[:length])
    return tags


def tga_reason(path: Path) -> Reason | None:
    """Return why a TGA is no texture, and what helps; None if it is one."""
    with path.open("rb") as file:
        start = file.read(18)
    is_whole = len(start) == 18
    # A palette of 16 bits has 5 of them a channel.
    is_exact = is_whole and (start[2] not in _TGA_PALETTES or start[7] == _TGA_PALETTE_BITS)
    if is_exact and start[16] in _TGA_BITS.get(start[2], ()):
        return None
    return "is not of 8 bits a channel, grey, RGB or RGBA", "save it so, without a palette"


def has_unused_alpha(path: Path) -> bool:
    """Return whether the fourth byte of a TGA's texels is none of its attributes."""
    with path.open("rb") as file:
        start = file.read(18)
    return start[16] == 32 and not start[_TGA_DESCRIPTOR] & _TGA_ATTRIBUTES


def say_alpha_is_unused(path: Path) -> None:
    """Take the attribute bits from a TGA that OpenImageIO has written."""
    content = bytearray(path.read_bytes())
    content[_TGA_DESCRIPTOR] &= ~_TGA_ATTRIBUTES
    extension = int.from_bytes(content[-_TGA_FOOTER:][:4], "little")
    content[extension + _TGA_KIND] = 0
    path.write_bytes(content)
