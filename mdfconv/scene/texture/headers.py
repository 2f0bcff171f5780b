"""What files say of themselves and OpenImageIO does not: bits, palettes, gamma, rows that lack."""

from __future__ import annotations

import struct
import zlib
from math import ceil
from pathlib import Path

# Why a file is no texture, and what helps.
Reason = tuple[str, str]
PALETTE = ("has a palette: its texels are indices, not values", "save it as grey or RGB")
SEVERAL_PICTURES = ("holds several pictures, of which only one would be kept", "split it")
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
_PLANES, _TILE_WIDTH, _TILE_HEIGHT, _EXTRA = 284, 322, 323, 338
_PLACES = ((273, 279), (324, 325))  # of strips and of tiles: offsets, and bytes
_WHOLE_NUMBERS = {1: "B", 3: "H", 4: "I", 16: "Q"}  # by the number of their type
# Values of the tags of compression, planes and further channels.
_UNCOMPRESSED, _SEPARATE, _ASSOCIATED = 1, 2, 1
# By the kind of a TGA: colour and grey, plain and RLE.
_TGA_BITS = {2: (24, 32), 3: (8,), 10: (24, 32), 11: (8,)}


class PngHeader:
    """The chunks of a PNG file before its texels; ValueError if one is damaged."""

    def __init__(self, path: Path) -> None:
        self._chunks: dict[bytes, bytes] = {}
        size = path.stat().st_size
        with path.open("rb") as file:
            file.seek(8)
            while len(head := file.read(8)) == 8 and head[4:] not in (b"IDAT", b"IEND"):
                length = int.from_bytes(head[:4])
                data = file.read(min(length, size))
                if file.read(4) != zlib.crc32(head[4:] + data).to_bytes(4):
                    raise ValueError(f"the sum of the chunk {head[4:].decode('latin-1')} is wrong")
                self._chunks[head[4:]] = data

    def reason(self) -> Reason | None:
        """Return why it is no texture, and what helps; None if it is one."""
        *_, bits, kind = struct.unpack(">IIBB", self._chunks.get(b"IHDR", bytes(10))[:10])
        if kind == _PALETTE:
            return PALETTE
        if bits not in (8, 16):
            return f"has {bits} bits a sample, not 8 or 16", ""
        if b"tRNS" in self._chunks:
            return "makes one value transparent, which would be another", "save it with alpha"
        if b"acTL" in self._chunks:
            return SEVERAL_PICTURES
        return None

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
        names = (name for name in _TEXEL_CHUNKS if name in self._chunks)
        return b"".join(png_chunk(name, self._chunks[name]) for name in names)


def png_chunk(name: bytes, data: bytes) -> bytes:
    """Return a chunk of a PNG file."""
    return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))


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
        tags = _tiff_tags(path)
    except struct.error:
        raise ValueError("its directory does not add up") from None
    bits: tuple[int, ...] = tags.get(_BITS, (1,))
    if set(bits) not in ({8}, {16}, {32}, {64}):
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


def _tiff_tags(path: Path) -> dict[int, tuple[int, ...]]:
    """Return the tags of whole numbers of a TIFF's or a BigTIFF's first picture."""
    size = path.stat().st_size
    with path.open("rb") as file:
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
    if len(start) == 18 and start[16] in _TGA_BITS.get(start[2], ()):
        return None
    return "is not of 8 bits a channel, grey, RGB or RGBA", "save it so, without a palette"
