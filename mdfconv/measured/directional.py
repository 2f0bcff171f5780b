"""Measured values of a BRDF against two directions, whatever file they come from."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from mdfconv.brdf.directions import direction, half_vector
from mdfconv.distributions.evaluation import Array
from mdfconv.errors import MdfconvError

# Files hold rounded angles: a direction is on the horizon within this, radians.
_HORIZON = 1e-6


@dataclass(frozen=True)
class DirectionalSamples:
    """Values of a BRDF, f_r, for pairs of directions.

    Parameters
    ----------
    incident, outgoing : numpy.ndarray, shape (n, 3)
        Unit vectors away from the surface, z along its normal, above the horizon.
    values : numpy.ndarray, shape (n, channels)
        Finite values, 1/sr.
    channels : tuple of str
        The names of the channels.
    notes : tuple of str
        What was left out, and what the reader assumed.
    """

    incident: Array
    outgoing: Array
    values: Array
    channels: tuple[str, ...]
    notes: tuple[str, ...] = field(default=())

    @property
    def half(self) -> Array:
        """The half vectors, shape (n, 3)."""
        return half_vector(self.incident, self.outgoing)


def directional_samples(
    path: Path,
    theta_incident: Array,
    phi_incident: Array,
    theta_outgoing: Array,
    phi_outgoing: Array,
    values: Array,
    channels: tuple[str, ...],
    notes: tuple[str, ...] = (),
) -> DirectionalSamples:
    """Return samples from angles, without what no BRDF has.

    Parameters
    ----------
    path : Path
        The file, for messages.
    theta_incident, phi_incident, theta_outgoing, phi_outgoing : numpy.ndarray, shape (n,)
        Zenith and azimuth of the two directions, radians. A negative zenith is that of the
        other side of the scan: it turns the azimuth by π. The mirror direction of an incident
        one is that of the same zenith, at its azimuth plus π.
    values : numpy.ndarray, shape (n, channels)
        Values of f_r, 1/sr.
    channels, notes
        As in `DirectionalSamples`.

    Raises
    ------
    MdfconvError
        If no sample is left that is finite and above the horizon.
    """
    angles = (theta_incident, phi_incident, theta_outgoing, phi_outgoing)
    finite = np.isfinite(values).all(axis=1) & np.isfinite(np.stack(angles)).all(axis=0)
    largest = 0.5 * np.pi - _HORIZON
    above = (np.abs(theta_incident) < largest) & (np.abs(theta_outgoing) < largest)
    keep = finite & above
    for what, dropped in (("not finite", ~finite), ("at or below the horizon", finite & ~above)):
        count = int(np.count_nonzero(dropped))
        if count:
            notes = (*notes, f"{count} of {keep.size} samples are {what} and left out")
    if not keep.any():
        raise MdfconvError(f"{path}: no finite sample above the horizon")
    return DirectionalSamples(
        direction(theta_incident[keep], phi_incident[keep]),
        direction(theta_outgoing[keep], phi_outgoing[keep]),
        values[keep],
        channels,
        notes,
    )
