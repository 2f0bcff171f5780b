"""Pictures for the tests: written by the book or by another library than is tested."""

import struct
import zlib

import numpy as np
import OpenEXR
import pyvips
from PIL import Image, ImageCms

PROFILE = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
COLOR_TYPES = {1: 0, 2: 4, 3: 2, 4: 6}


def write_png(path, samples, *, icc=None, per_metre=None):
    """Write a PNG of 8 or 16 bits, by the book."""
    height, width, channels = samples.shape
    big = samples.astype(samples.dtype.newbyteorder(">"))
    lines = b"".join(b"\0" + line.tobytes() for line in big)
    chunks = [
        (
            b"IHDR",
            struct.pack(
                ">IIBBBBB", width, height, 8 * samples.itemsize, COLOR_TYPES[channels], 0, 0, 0
            ),
        )
    ]
    if icc:
        chunks.append((b"iCCP", b"icc\0\0" + zlib.compress(icc)))
    if per_metre:
        chunks.append((b"pHYs", struct.pack(">IIB", *per_metre, 1)))
    chunks += [(b"IDAT", zlib.compress(lines, 1)), (b"IEND", b"")]
    content = b"\x89PNG\r\n\x1a\n"
    for name, data in chunks:
        content += struct.pack(">I", len(data)) + name + data
        content += struct.pack(">I", zlib.crc32(name + data))
    path.write_bytes(content)
    return path


def write_tiff(path, samples, **options):
    """Write a TIFF of 8 or 16 bits through libvips."""
    height, width, channels = samples.shape
    kind = "ushort" if samples.itemsize == 2 else "uchar"
    image = pyvips.Image.new_from_memory(samples.copy(), width, height, channels, kind)
    spaces = ("b-w", "srgb") if samples.itemsize == 1 else ("grey16", "rgb16")
    image = image.copy(interpretation=spaces[channels > 2], xres=4, yres=8)
    image.tiffsave(str(path), **options)
    return path


def read(path):
    """Return the samples of a PNG or TIFF file."""
    image = pyvips.Image.new_from_file(str(path), revalidate=True)
    return image.numpy().reshape(image.height, image.width, image.bands)


def write_exr(path, **channels):
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage, "by": "hand"}
    OpenEXR.File(header, channels).write(str(path))
    return path


def read_exr(path):
    with OpenEXR.File(str(path), separate_channels=True) as file:
        return {name: entry.pixels.copy() for name, entry in file.channels().items()}


def samples(width, height, channels, dtype, seed=0):
    top = np.iinfo(dtype).max
    return np.random.default_rng(seed).integers(
        0, top, (height, width, channels), dtype, endpoint=True
    )


def picture(path, mode, **options):
    Image.new(mode, (8, 8)).save(path, **options)
