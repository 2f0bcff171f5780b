"""Measured samples, whatever file they come from."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from mdfconv.brdf.microfacet import direction, half_vector
from mdfconv.distributions.evaluation import Array
from mdfconv.errors import MdfconvError


@dataclass(frozen=True)
class Samples:
    """Values against the angle between normal and half vector.

    Parameters
    ----------
    beta : numpy.ndarray, shape (n,)
        Angles, radians, [0, π/2], ascending.
    values : numpy.ndarray, shape (n, channels)
        Finite values of the distribution or of the BRDF.
    channels : tuple of str
        The names of the channels.
    quantity : str
        ``"ndf"``, or ``"brdf"`` for a slice at θ_d ≈ 0.
    notes : tuple of str
        What was left out, and what the reader assumed.
    """

    beta: Array
    values: Array
    channels: tuple[str, ...]
    quantity: str
    notes: tuple[str, ...] = field(default=())


@dataclass(frozen=True)
class AngleUnit:
    """How a file stores an angle.

    Parameters
    ----------
    to_radians : callable
        From the number stored.
    largest : float
        The largest such number; the smallest is 0.
    """

    to_radians: Callable[[Array], Array]
    largest: float


UNITS = {
    "degrees": AngleUnit(np.radians, 90.0),
    "radians": AngleUnit(np.asarray, np.pi / 2),
    "cosine": AngleUnit(np.arccos, 1.0),
}
# Of the largest number of a unit: files hold rounded angles.
_SLACK = 1e-6


def samples(
    path: Path,
    angle: Array,
    unit: str,
    values: Array,
    channels: tuple[str, ...],
    quantity: str,
    notes: tuple[str, ...] = (),
) -> Samples:
    """Return samples in order, without their NaN rows, or say what is wrong with them.

    Parameters
    ----------
    path : Path
        The file, for messages.
    angle : numpy.ndarray, shape (n,)
        Angles as stored.
    unit : str
        One of `UNITS`.
    values, channels, quantity, notes
        As in `Samples`.

    Raises
    ------
    MdfconvError
        If an angle is outside [0, π/2] or no row is left.
    """
    whole = np.isfinite(angle) & np.isfinite(values).all(axis=1)
    dropped = int(np.count_nonzero(~whole))
    if dropped:
        notes = (*notes, f"{dropped} of {whole.size} rows hold NaN or infinity and are left out")
    if not whole.any():
        raise MdfconvError(f"{path}: no row with finite numbers")
    angle, values = angle[whole], values[whole]
    largest = UNITS[unit].largest
    outside = (angle < -_SLACK * largest) | (angle > (1 + _SLACK) * largest)
    if outside.any():
        bad = float(angle[outside][0])
        raise MdfconvError(
            f"{path}: {unit} {bad:g} is outside 0 to {largest:.6g}, an angle from the normal to "
            "the horizon"
        )
    beta = UNITS[unit].to_radians(np.clip(angle, 0, largest))
    order = np.argsort(beta, kind="stable")
    return Samples(beta[order], values[order], channels, quantity, notes)


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
