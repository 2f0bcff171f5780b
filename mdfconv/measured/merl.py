"""The MERL BRDF database's isotropic binary format (Matusik et al. 2003)."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mdfconv.errors import MdfconvError
from mdfconv.measured.samples import Samples, samples

_HEADER_BYTES = 12
# Of R, G and B, by which the database's own reader multiplies.
_SCALES = np.array([1.0, 1.15, 1.66]) / 1500
# The database has 90 × 90 × 180; a file of other bytes has anything.
_LARGEST_DIMENSION = 4096


def read_merl(path: Path) -> Samples:
    """Read the slice θ_d ≈ 0 of a MERL file, averaged over φ_d.

    Parameters
    ----------
    path : Path
        Three int32 dimensions (θ_h, θ_d, φ_d), then float64 planes R, G, B; negative values
        are invalid. θ_h of index i is (i/n)² π/2.

    Raises
    ------
    MdfconvError
        If the dimensions make no sense or the file is shorter or longer than they say.
    """
    size = path.stat().st_size
    header = np.fromfile(path, dtype="<i4", count=3) if size >= _HEADER_BYTES else np.zeros(3)
    if header.size < 3 or header.min() < 1 or header.max() > _LARGEST_DIMENSION:
        raise MdfconvError(f"{path}: not a MERL file: its dimensions are {header.tolist()}")
    half, difference, azimuth = (int(count) for count in header)
    expected = _HEADER_BYTES + 8 * 3 * half * difference * azimuth
    if size != expected:
        what = "truncated" if size < expected else "too long"
        raise MdfconvError(
            f"{path}: {what}: {size} bytes where {half} × {difference} × {azimuth} samples of "
            f"three channels take {expected}"
        )
    planes = np.memmap(path, "<f8", "r", _HEADER_BYTES, (3, half, difference, azimuth))
    mirror = np.array(planes[:, :, 0, :])
    valid = np.isfinite(mirror) & (mirror >= 0)
    counts = valid.sum(axis=2)
    total = np.where(valid, mirror, 0).sum(axis=2)
    mean = np.where(counts > 0, total / np.maximum(counts, 1), np.nan)
    beta = (np.arange(half) / half) ** 2 * (np.pi / 2)
    return samples(path, beta, "radians", (mean * _SCALES[:, None]).T, ("R", "G", "B"), "brdf")
