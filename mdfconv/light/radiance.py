"""Radiance pictures: RGBE or XYZE, flat or in either of its run-length encodings (Ward 1991).

Written after the description of the format in Radiance's documentation ("Radiance File Formats").
"""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from mdfconv.distributions.evaluation import Array

SIGNATURE = b"#?"
_SIZE = re.compile(rb"([-+])Y +(\d{1,9}) +([-+])X +(\d{1,9})\s*")
_FORMAT = re.compile(rb"^FORMAT=[ \t]*(\S*)", re.MULTILINE)
_RGBE, _XYZE = b"32-bit_rle_rgbe", b"32-bit_rle_xyze"
# The widths that the newer encoding is made for.
_NEW_WIDTHS = range(8, 1 << 15)
# A run of the newer encoding has a count above this; of the older a mantissa of three ones.
_RUN, _OLD_RUN = 128, 1
# So many continuations of a run of the older encoding, by 8 bits each, a picture can take.
_MOST_SHIFTS = 3
# A small file can claim any size.
_MOST_TEXELS = 1 << 27
# What a mantissa is multiplied by, by the exponent; without one a texel is black.
_SCALES: Array = np.ldexp(np.float32(1), np.arange(256) - (128 + 8))
_SCALES[0] = 0


def read_radiance(data: bytes) -> Array:
    """Return the texels of a Radiance picture, the top first.

    Parameters
    ----------
    data : bytes
        The file.

    Returns
    -------
    numpy.ndarray, shape (h, w, 3) or (h, w, 1)
        Linear RGB; of an XYZE picture Y, the luminance. float32.

    Raises
    ------
    ValueError
        If it is damaged, or stores columns or other numbers.
    """
    head, _, rest = data.partition(b"\n\n")
    line, _, content = rest.partition(b"\n")
    size = _SIZE.fullmatch(line)
    if not size:
        raise ValueError(f"its size, '{_shown(line)}', is not as in -Y 512 +X 1024")
    formats = _FORMAT.findall(head) or [_RGBE]
    if formats[-1] not in (_RGBE, _XYZE):
        known = f"{_shown(_RGBE)} or {_shown(_XYZE)}"
        raise ValueError(f"its format, '{_shown(formats[-1])}', is not {known}")
    height, width = int(size[2]), int(size[4])
    if not 0 < height * width <= _MOST_TEXELS:
        raise ValueError(f"it has {width}×{height} texels, not 1 to {_MOST_TEXELS}")
    try:
        stored = _stored(content, height, width)
    except IndexError:
        raise ValueError("it is truncated or damaged") from None
    stored = stored[:: 1 if size[1] == b"-" else -1, :: 1 if size[3] == b"+" else -1]
    mantissa = stored[..., 1:2] if formats[-1] == _XYZE else stored[..., :3]
    values: Array = mantissa * _SCALES[stored[..., 3:]]
    return values


def _shown(text: bytes) -> str:
    """Return the beginning of a line for a message."""
    return repr(text[:40])[2:-1]


def _stored(data: bytes, height: int, width: int) -> NDArray[np.uint8]:
    """Return the bytes of the texels, shape (h, w, 4); IndexError if they lack or are too many."""
    rows: list[bytes] = []
    at = 0
    is_new = width in _NEW_WIDTHS
    while is_new and len(rows) < height and data.startswith(b"\2\2" + width.to_bytes(2), at):
        row, at = _row(data, at + 4, 4 * width)
        rows.append(row)
    planes = np.frombuffer(b"".join(rows), np.uint8).reshape(-1, 4, width)
    others = _texels(data[at:], (height - len(rows)) * width).reshape(-1, width, 4)
    return np.concatenate([planes.swapaxes(1, 2), others])


def _row(data: bytes, at: int, count: int) -> tuple[bytes, int]:
    """Return so many bytes that the newer encoding holds, and the place behind them."""
    parts, size = [], 0
    while size < count:
        length = data[at]
        if length > _RUN:
            length -= _RUN
            parts.append(data[at + 1 : at + 2] * length)
            at += 2
        else:
            parts.append(data[at + 1 : at + 1 + length])
            at += 1 + length
        size += length
    row = b"".join(parts)
    if len(row) != count:
        raise IndexError
    return row, at


def _texels(data: bytes, count: int) -> NDArray[np.uint8]:
    """Return so many texels of the older encoding, of which flat ones are a case: shape (n, 4)."""
    texels = np.frombuffer(data[: len(data) // 4 * 4], np.uint8).reshape(-1, 4)
    if not count:
        return texels[:0]
    place = np.arange(len(texels))
    is_run = (texels[:, :3] == _OLD_RUN).all(axis=1)
    # What a run repeats; the runs that go on from one another have ever higher bits.
    source = np.maximum.accumulate(np.where(is_run, -1, place))
    shift = 8 * np.clip(place - source - 1, 0, _MOST_SHIFTS)
    repeats = np.where(is_run, texels[:, 3].astype(np.int64) << shift, 1)
    total = np.cumsum(repeats)
    end = int(np.searchsorted(total, count)) + 1
    if total[end - 1] != count or source[0] < 0:
        raise IndexError
    return np.repeat(texels[source[:end]], repeats[:end], axis=0)
