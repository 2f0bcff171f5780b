"""The MERL BRDF database's isotropic binary format (Matusik et al. 2003).

Three int32 dimensions (θ_h, θ_d, φ_d), then float64 planes R, G and B, whose negative values are
invalid. Of n angles, θ_h of index i is (i/n)² π/2, θ_d is i/n · π/2 and φ_d is i/n · π.
"""

from __future__ import annotations

import numpy as np

from mdfconv.distributions.evaluation import Array
from mdfconv.errors import MdfconvError
from mdfconv.measured.readers import base
from mdfconv.measured.readers.base import Reader, ReadOptions, Source
from mdfconv.measured.samples import DirectionalSamples, Measurements, Samples, samples

_HEADER_BYTES = 12
# Of R, G and B, by which the database's own reader multiplies.
_SCALES = np.array([1.0, 1.15, 1.66]) / 1500
# The database has 90 × 90 × 180; a file of other bytes has anything.
_LARGEST_DIMENSION = 4096
_CHANNELS = ("R", "G", "B")
# A cell counts as above the horizon from this cosine on.
_HORIZON = 1e-5
# Of the choice of cells: the same each time.
_SEED = 0


def _cells(source: Source, count: int) -> DirectionalSamples:
    """Return about so many valid cells, by chance, as many of every θ_h.

    θ_h is dense where lobes are, so that equally many cells of each show the peak.
    """
    planes = _planes(source)
    _, half, difference, azimuth = planes.shape
    generator = np.random.default_rng(_SEED)
    axes = np.arange(difference) / difference * (np.pi / 2), np.arange(azimuth) / azimuth * np.pi
    theta_d, phi_d = np.meshgrid(*axes, indexing="ij")
    zero = np.zeros(1)
    wanted = max(1, -(-count // half))
    directions, values = [], []
    for index, beta in enumerate(_half_angles(half)[:, None]):
        first, second = base.from_half_and_difference(beta, zero, theta_d.ravel(), phi_d.ravel())
        cells = planes[:, index].reshape(3, -1)
        valid = (np.isfinite(cells) & (cells >= 0)).all(axis=0)
        above = (first[:, 2] > _HORIZON) & (second[:, 2] > _HORIZON)
        places = np.flatnonzero(valid & above)
        chosen = generator.choice(places, min(wanted, places.size), replace=False)
        directions.append(np.stack([first[chosen], second[chosen]]))
        values.append(cells[:, chosen].T * _SCALES)
    incident, outgoing = np.concatenate(directions, axis=1)
    taken = np.concatenate(values)
    note = f"{len(taken)} of {planes[0].size} cells are taken, by chance and as many of every θ_h"
    return base.samples_of_vectors(source.path, incident, outgoing, taken, _CHANNELS, (note,))


def _slice(source: Source) -> Samples:
    """Return the slice θ_d ≈ 0, averaged over φ_d."""
    planes = _planes(source)
    half = planes.shape[1]
    mirror = np.array(planes[:, :, 0, :])
    valid = np.isfinite(mirror) & (mirror >= 0)
    counts = valid.sum(axis=2)
    with np.errstate(over="ignore"):
        total = np.where(valid, mirror, 0).sum(axis=2)
    mean = np.where(counts > 0, total / np.maximum(counts, 1), np.nan)
    values = (mean * _SCALES[:, None]).T
    return samples(source.path, _half_angles(half), "radians", values, _CHANNELS, "brdf")


def _half_angles(count: int) -> Array:
    return (np.arange(count) / count) ** 2 * (np.pi / 2)


def _planes(source: Source) -> Array:
    """Return R, G and B, shape (3, θ_h, θ_d, φ_d), as they are stored."""
    size = len(source.content)
    header = _dimensions(source.head)
    if header is None:
        shown = np.frombuffer(source.head[: min(_HEADER_BYTES, size // 4 * 4)], "<i4")
        raise source.error(f"not a MERL file: its dimensions are {shown.tolist()}")
    half, difference, azimuth = header
    expected = _HEADER_BYTES + 8 * 3 * half * difference * azimuth
    if size != expected:
        what = "truncated" if size < expected else "too long"
        raise source.error(
            f"{what}: {size} bytes where {half} × {difference} × {azimuth} samples of three "
            f"channels take {expected}"
        )
    numbers = np.frombuffer(source.content, "<f8", offset=_HEADER_BYTES)
    return numbers.reshape(3, half, difference, azimuth)


def _dimensions(head: bytes) -> list[int] | None:
    """Return how many θ_h, θ_d and φ_d a header says there are; None if it is none."""
    counts = np.frombuffer(head, "<i4", 3).tolist() if len(head) >= _HEADER_BYTES else [0]
    return counts if min(counts) >= 1 and max(counts) <= _LARGEST_DIMENSION else None


def _recognizes(name: str, head: bytes) -> bool:
    # Text has no such small integers: its bytes are not zero.
    return name.lower().endswith(".binary") or _dimensions(head) is not None


def _read(source: Source, options: ReadOptions) -> Measurements:
    options.refuse(source.path, "a MERL file has no columns")
    if options.cells is None:
        return _slice(source)
    if options.cells < 1:
        raise MdfconvError(f"{options.cells} cells: at least 1")
    return _cells(source, options.cells)


READER = Reader("MERL", _recognizes, _read)
