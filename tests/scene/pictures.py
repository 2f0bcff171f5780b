"""Pictures for the tests: written and read by the book, or by another library than is tested."""

import struct
import zlib

import numpy as np
import OpenEXR
from PIL import Image, ImageCms

PROFILE = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
COLOR_TYPES = {1: 0, 2: 4, 3: 2, 4: 6}
SIGNATURE = b"\x89PNG\r\n\x1a\n"


def write_png(path, samples, *, icc=None, per_metre=None, bits=None, kind=None, more=()):
    """Write a PNG of 8 or 16 bits."""
    height, width, channels = samples.shape
    big = samples.astype(samples.dtype.newbyteorder(">"))
    lines = b"".join(b"\0" + line.tobytes() for line in big)
    depth = bits or 8 * samples.itemsize
    kind = COLOR_TYPES[channels] if kind is None else kind
    chunks = [(b"IHDR", struct.pack(">IIBBBBB", width, height, depth, kind, 0, 0, 0)), *more]
    if icc:
        chunks.append((b"iCCP", b"icc\0\0" + zlib.compress(icc)))
    if per_metre:
        chunks.append((b"pHYs", struct.pack(">IIB", *per_metre, 1)))
    chunks += [(b"IDAT", zlib.compress(lines, 1)), (b"IEND", b"")]
    content = SIGNATURE
    for name, data in chunks:
        content += struct.pack(">I", len(data)) + name + data
        content += struct.pack(">I", zlib.crc32(name + data))
    path.write_bytes(content)
    return path


def png_chunks(path):
    """Return the names and contents of a PNG's chunks, after checking their sums."""
    content = path.read_bytes()
    assert content.startswith(SIGNATURE)
    place, chunks = 8, []
    while place < len(content):
        (length,) = struct.unpack(">I", content[place : place + 4])
        name, data = content[place + 4 : place + 8], content[place + 8 : place + 8 + length]
        assert struct.unpack(">I", content[place + 8 + length :][:4]) == (zlib.crc32(name + data),)
        chunks.append((name, data))
        place += 12 + length
    return chunks


def read_png(path):
    chunks = png_chunks(path)
    width, height, depth, kind = struct.unpack(">IIBB", chunks[0][1][:10])
    channels = {number: count for count, number in COLOR_TYPES.items()}[kind]
    packed = b"".join(data for name, data in chunks if name == b"IDAT")
    lines = np.frombuffer(zlib.decompress(packed), np.uint8).reshape(height, -1)
    rows = lines[:, 1:].reshape(height, width, channels * depth // 8).copy()
    for y, method in enumerate(lines[:, 0]):
        assert method in (0, 1, 2)  # none, from the left, from above
        if method == 1:
            rows[y] = np.cumsum(rows[y], axis=0, dtype=np.uint8)
        elif method == 2 and y:
            rows[y] += rows[y - 1]
    return rows.view(f">u{depth // 8}").astype(f"u{depth // 8}").reshape(height, width, channels)


def write_tiff(path, samples, *, deflate=False, tags=(), order="<", rows=None, planes=False):
    """Write a TIFF in strips; `tags` are numbers or pairs for rationals, by the tag's number."""
    height, width, channels = samples.shape
    bits = [8 * samples.itemsize] * channels
    rows = rows or height
    layers = [samples[..., c : c + 1] for c in range(channels)] if planes else [samples]
    strips = [
        layer[top : top + rows].astype(samples.dtype.newbyteorder(order)).tobytes()
        for layer in layers
        for top in range(0, height, rows)
    ]
    strips = [zlib.compress(strip) if deflate else strip for strip in strips]
    offsets = 8 + np.cumsum([0, *(len(strip) for strip in strips)])
    formats = {"u": 1, "i": 2, "f": 3}[samples.dtype.kind]
    entries = {256: [width], 257: [height], 258: bits, 259: [8 if deflate else 1]}
    entries |= {262: [2 if channels > 2 else 1], 273: offsets[:-1], 277: [channels], 278: [rows]}
    entries |= {279: [len(strip) for strip in strips], 284: [1 + planes]}
    entries |= {282: (4 * 254, 10), 283: (8 * 254, 10), 296: [2], 339: [formats] * channels}
    if channels in (2, 4):
        entries[338] = [2]
    directory, beyond = b"", b""
    entries |= dict(tags)
    place = int(offsets[-1]) + 2 + 12 * len(entries) + 4
    for tag, values in sorted(entries.items()):
        rational, blob = isinstance(values, tuple), isinstance(values, bytes)
        kind, letter = (5, "I") if rational else (7, "B") if blob else (4, "I")
        count = 1 if rational else len(values)
        value = struct.pack(f"{order}{len(values)}{letter}", *values)
        if len(value) > 4:
            beyond, value = beyond + value, struct.pack(f"{order}I", place + len(beyond))
        directory += struct.pack(f"{order}HHI", tag, kind, count) + value.ljust(4, b"\0")
    start = b"II*\0" if order == "<" else b"MM\0*"
    path.write_bytes(
        start
        + struct.pack(f"{order}I", int(offsets[-1]))
        + b"".join(strips)
        + struct.pack(f"{order}H", len(entries))
        + directory
        + bytes(4)
        + beyond
    )
    return path


def read_tiff(path):
    """Return the samples of a little-endian TIFF of strips, and its tags."""
    content = path.read_bytes()
    assert content.startswith(b"II*\0")
    (place,) = struct.unpack("<I", content[4:8])
    (count,) = struct.unpack("<H", content[place : place + 2])
    tags = {}
    for entry in range(place + 2, place + 2 + 12 * count, 12):
        tag, kind, number = struct.unpack("<HHI", content[entry : entry + 8])
        letter = {1: "B", 2: "B", 3: "H", 4: "I", 5: "II", 7: "B"}[kind]
        length = number * {1: 1, 2: 1, 3: 2, 4: 4, 5: 8, 7: 1}[kind]
        (beyond,) = struct.unpack("<I", content[entry + 8 : entry + 12])
        value = content[beyond : beyond + length] if length > 4 else content[entry + 8 :][:length]
        tags[tag] = struct.unpack("<" + letter * number, value)
    (width,), (height,), channels = tags[256], tags[257], tags[277][0]
    dtype = np.dtype({1: "u", 3: "f"}[tags.get(339, (1,))[0]] + str(tags[258][0] // 8))
    parts = []
    for start, length in zip(tags[273], tags[279], strict=True):
        strip = content[start : start + length]
        strip = zlib.decompress(strip) if tags[259] == (8,) else strip
        parts.append(_unpredicted(strip, tags.get(317, (1,))[0], width, channels, dtype))
    return np.concatenate(parts)[:height], tags


def _unpredicted(strip, predictor, width, channels, dtype):
    if predictor == 3:  # bytes of all samples, most significant first, as differences
        lines = np.frombuffer(strip, np.uint8).reshape(-1, width * dtype.itemsize, channels)
        lines = np.cumsum(lines, axis=1, dtype=np.uint8).reshape(
            -1, dtype.itemsize, width * channels
        )
        bytes_of_samples = np.ascontiguousarray(lines.swapaxes(1, 2))
        samples = bytes_of_samples.view(dtype.newbyteorder(">")).astype(dtype)
        return samples.reshape(-1, width, channels)
    samples = np.frombuffer(strip, dtype).reshape(-1, width, channels)
    return np.cumsum(samples, axis=1, dtype=dtype) if predictor == 2 else samples


def read(path):
    """Return the samples of a PNG or TIFF file."""
    return read_png(path) if path.suffix == ".png" else read_tiff(path)[0]


def write_exr(path, compression=OpenEXR.ZIP_COMPRESSION, header=(), **channels):
    given = {"compression": compression, "type": OpenEXR.scanlineimage, "by": "hand"}
    OpenEXR.File(given | dict(header), channels).write(str(path))
    return path


def read_exr(path):
    with OpenEXR.File(str(path), separate_channels=True) as file:
        return {name: entry.pixels.copy() for name, entry in file.channels().items()}


def exr_header(path):
    """Return what an OpenEXR file says of itself, as text by name."""
    with OpenEXR.File(str(path)) as file:
        header = file.header()
        channels = sorted(channel.name for channel in header.pop("channels"))
        return {"channels": channels} | {name: str(value) for name, value in header.items()}


def samples(width, height, channels, dtype, seed=0):
    top = np.iinfo(dtype).max
    return np.random.default_rng(seed).integers(
        0, top, (height, width, channels), dtype, endpoint=True
    )


def picture(path, mode, **options):
    Image.new(mode, (8, 8)).save(path, **options)
