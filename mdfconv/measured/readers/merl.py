"""The MERL BRDF database's isotropic binary format (Matusik et al. 2003)."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mdfconv.brdf.microfacet import azimuth as azimuths
from mdfconv.brdf.microfacet import polar_angle
from mdfconv.distributions.evaluation import Array
from mdfconv.errors import MdfconvError
from mdfconv.measured.readers.base import (
    Reader,
    ReadOptions,
    Source,
    from_half_and_difference,
    open_source,
)
from mdfconv.measured.samples import DirectionalSamples, Samples, directional_samples, samples

_HEADER_BYTES = 12
# Of R, G and B, by which the database's own reader multiplies.
_SCALES = np.array([1.0, 1.15, 1.66]) / 1500
# The database has 90 × 90 × 180; a file of other bytes has anything.
_LARGEST_DIMENSION = 4096
_CHANNELS = ("R", "G", "B")
# A cell counts as above the horizon from this cosine on.
_HORIZON = 1e-5


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
    return _slice(open_source(path))


def read_merl_directional(
    path: Path | str, count: int = 20000, seed: int = 0
) -> DirectionalSamples:
    """Read a random sample of the cells of a MERL file, as many of every θ_h.

    θ_h is dense where lobes are, so that equally many cells of each show the peak.

    Parameters
    ----------
    path : Path or str
        As for `read_merl`; ``"-"`` is standard input. Index j of θ_d is j/n · π/2, index k of
        φ_d is k/n · π.
    count : int
        About how many cells; fewer where a θ_h has fewer that are valid.
    seed : int
        Of the choice; the same cells come back for the same one.

    Returns
    -------
    DirectionalSamples
        Only cells that are valid and have both directions above the horizon.

    Raises
    ------
    MdfconvError
        As `read_merl`, or if no cell is valid.
    """
    source = open_source(path)
    planes = _planes(source)
    _, half, difference, azimuth = planes.shape
    generator = np.random.default_rng(seed)
    theta_d, phi_d = np.meshgrid(
        np.arange(difference) / difference * (np.pi / 2),
        np.arange(azimuth) / azimuth * np.pi,
        indexing="ij",
    )
    zero = np.zeros(1)
    wanted = max(1, -(-count // half))
    directions, values = [], []
    for index, beta in enumerate(_half_angles(half)[:, None]):
        first, second = from_half_and_difference(beta, zero, theta_d.ravel(), phi_d.ravel())
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
    return directional_samples(
        source.path,
        polar_angle(incident),
        azimuths(incident),
        polar_angle(outgoing),
        azimuths(outgoing),
        taken,
        _CHANNELS,
        (note,),
    )


def _slice(source: Source) -> Samples:
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
        raise MdfconvError(f"{source.path}: not a MERL file: its dimensions are {shown.tolist()}")
    half, difference, azimuth = header
    expected = _HEADER_BYTES + 8 * 3 * half * difference * azimuth
    if size != expected:
        what = "truncated" if size < expected else "too long"
        raise MdfconvError(
            f"{source.path}: {what}: {size} bytes where {half} × {difference} × {azimuth} samples "
            f"of three channels take {expected}"
        )
    numbers = np.frombuffer(source.content, "<f8", offset=_HEADER_BYTES)
    return numbers.reshape(3, half, difference, azimuth)


def _dimensions(head: bytes) -> tuple[int, int, int] | None:
    if len(head) < _HEADER_BYTES:
        return None
    first, second, third = (int(count) for count in np.frombuffer(head, "<i4", 3))
    if min(first, second, third) < 1 or max(first, second, third) > _LARGEST_DIMENSION:
        return None
    return first, second, third


def _recognizes(name: str, head: bytes) -> bool:
    # Text has no such small integers: its bytes are not zero.
    return name.lower().endswith(".binary") or _dimensions(head) is not None


def _read(source: Source, options: ReadOptions) -> Samples | DirectionalSamples:
    options.refuse(source.path, "a MERL file has no columns")
    if options.cells is None:
        return _slice(source)
    if options.cells < 1:
        raise MdfconvError(f"{options.cells} cells: at least 1")
    return read_merl_directional(source.path, options.cells)


READER = Reader("MERL", _recognizes, _read)
