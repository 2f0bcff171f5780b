"""The RGL material database's tensor files (Dupuy & Jakob 2018): the distribution of normals.

Such a file holds, next to the reflectance, D as it was measured from retroreflection, on a grid
of u_θ, u_φ ∈ [0, 1] with θ = u_θ² π/2 and φ = (2 u_φ - 1) π (functions ``u2theta`` and ``u2phi``
of the authors' loader), φ along the first axis.
"""

from __future__ import annotations

import math
import struct

import numpy as np

from mdfconv.distributions.evaluation import Array
from mdfconv.measured.readers.base import Reader, ReadOptions, Source
from mdfconv.measured.samples import Samples, about_of, samples

_SIGNATURE = b"tensor_file\0"
_VERSION = (1, 0)
# By the number that stands for a type in the file.
_TYPES = (None, "u1", "i1", "<u2", "<i2", "<u4", "<i4", "<u8", "<i8", "<f2", "<f4", "<f8")
_MOST_DIMENSIONS = 8


def _read(source: Source, options: ReadOptions) -> Samples:
    options.refuse(source.path, "a tensor file has no columns")
    if options.values_are is not None:
        reason = "its values are a distribution of normals, not reflectance"
        raise source.error(reason, "do not say what they are")
    wanted = _fields(source)
    density = wanted.get("ndf")
    if density is None or density.ndim != 2 or min(density.shape) < 1 or density.shape[1] < 2:
        reason = "no table 'ndf', the distribution of normals, with two axes"
        raise source.error(reason, f"there are {', '.join(wanted) or 'none'}")
    theta = (np.arange(density.shape[1]) / (density.shape[1] - 1)) ** 2 * (np.pi / 2)
    values = _around(density)
    notes = ["the measured distribution of normals is read, not the reflectance"]
    azimuths = wanted.get("phi_i")
    if azimuths is not None and azimuths.size > 2:
        notes.append("the surface is anisotropic: averaged over azimuth")
    description = wanted.get("description", np.zeros(0))
    is_text = description.dtype == np.uint8
    about = about_of(description.tobytes().decode(errors="replace").splitlines() if is_text else ())
    what = values[:, None], ("ndf",), "ndf", tuple(notes), about
    return samples(source.path, theta, "radians", *what)


def _around(density: Array) -> Array:
    """Return the mean over azimuth, whose first and last row are one direction."""
    # A damaged number can be a NaN that warns when it is cast.
    with np.errstate(all="ignore"):
        density = density.astype(float)
        if len(density) == 1:
            return density[0]
        weight = np.ones(len(density))
        weight[[0, -1]] = 0.5
        return weight @ density / weight.sum()


def _fields(source: Source) -> dict[str, Array]:
    """Return the tables of a tensor file by name.

    Raises
    ------
    MdfconvError
        If the file is truncated or of another version.
    """
    content, position = source.content, len(_SIGNATURE)
    (*version, count), position = _unpack(source, "<BBI", position)
    if tuple(version) != _VERSION:
        raise source.error(f"tensor file of version {version[0]}.{version[1]}", "only 1.0 is read")
    fields = {}
    for _ in range(count):
        (length,), position = _unpack(source, "<H", position)
        name = content[position : position + length].decode("ascii", errors="backslashreplace")
        name = name if name.isprintable() else repr(name)
        (dimensions, kind, offset), position = _unpack(source, "<HBQ", position + length)
        if dimensions > _MOST_DIMENSIONS:
            raise source.error(f"damaged: table '{name}' has {dimensions} axes")
        shape, position = _unpack(source, f"<{dimensions}Q", position)
        fields[name] = _table(source, name, shape, kind, offset)
    return fields


def _table(source: Source, name: str, shape: tuple[int, ...], kind: int, offset: int) -> Array:
    form = _TYPES[kind] if kind < len(_TYPES) else None
    if form is None:
        raise source.error(f"damaged: table '{name}' is of unknown type {kind}")
    count = math.prod(shape)
    if offset + count * np.dtype(form).itemsize > len(source.content):
        raise source.error(f"truncated: table '{name}' goes beyond its end")
    if not count:
        return np.zeros(0)
    return np.frombuffer(source.content, form, count, offset).reshape(shape)


def _unpack(source: Source, form: str, position: int) -> tuple[tuple[int, ...], int]:
    size = struct.calcsize(form)
    part = source.content[position : position + size]
    if len(part) < size:
        raise source.error("truncated within its table of contents")
    return struct.unpack(form, part), position + size


READER = Reader("RGL", lambda name, head: head.startswith(_SIGNATURE), _read)
