"""Measured samples, whatever file they come from."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

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
    notes: tuple[str, ...] = ()

    def select(self, rows: Any) -> Samples:
        """Return some of the samples, by a mask or by indices."""
        return replace(self, beta=self.beta[rows], values=self.values[rows])


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
    notes: tuple[str, ...] = ()

    @property
    def half(self) -> Array:
        """The half vectors, shape (n, 3)."""
        return half_vector(self.incident, self.outgoing)

    def select(self, rows: Any) -> DirectionalSamples:
        """Return some of the samples, by a mask or by indices."""
        names = "incident", "outgoing", "values"
        return replace(self, **{name: getattr(self, name)[rows] for name in names})


Measurements: TypeAlias = Samples | DirectionalSamples


@dataclass(frozen=True)
class AngleUnit:
    """How a file stores an angle: the rule to radians, and the largest number; the least is 0."""

    to_radians: Callable[[Array], Array]
    largest: float


UNITS = {
    "degrees": AngleUnit(np.radians, 90.0),
    "radians": AngleUnit(np.asarray, np.pi / 2),
    "cosine": AngleUnit(np.arccos, 1.0),
}
# Files hold rounded angles: of the largest number of a unit, and radians from the horizon.
_SLACK = 1e-6
_HORIZON = 1e-6


def samples(
    path: Path,
    angle: Array,
    unit: str,
    values: Array,
    channels: tuple[str, ...],
    quantity: str,
    notes: tuple[str, ...] = (),
) -> Samples:
    """Return samples of one angle, stored in one of `UNITS`, in order and without NaN rows.

    Raises `MdfconvError`, which names the path, if an angle is outside [0, π/2], no row is left, or
    the shapes do not go together.
    """
    _check_shapes(path, [angle], values, channels)
    whole = np.isfinite(angle) & np.isfinite(values).all(axis=1)
    notes += note_of(~whole, "rows hold NaN or infinity and are left out")
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


def directional_samples(
    path: Path | str,
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
    path : Path or str
        The file, for messages.
    theta_incident, phi_incident, theta_outgoing, phi_outgoing : numpy.ndarray, shape (n,)
        Zenith and azimuth of the two directions, radians. A negative zenith is that of the
        other side of the scan: it turns the azimuth by π. The mirror direction of an incident
        one is that of the same zenith, at its azimuth plus π.
    values : numpy.ndarray, shape (n, channels)
        Values of f_r, 1/sr.
    channels, notes
        As in `DirectionalSamples`.

    Returns
    -------
    DirectionalSamples
        The samples that are finite and above the horizon; a note says how many are not.

    Raises
    ------
    MdfconvError
        If no sample is left, or the shapes do not go together.

    Examples
    --------
    >>> import numpy as np
    >>> theta = np.radians([0.0, 15.0, 30.0])
    >>> samples = directional_samples(
    ...     "scan", theta, 0 * theta, theta, 0 * theta + np.pi, np.ones((3, 1)), ("green",)
    ... )
    >>> samples.half[:, 2].round(12)
    array([1., 1., 1.])
    """
    angles = (theta_incident, phi_incident, theta_outgoing, phi_outgoing)
    _check_shapes(path, angles, values, channels)
    finite = np.isfinite(values).all(axis=1) & np.isfinite(np.stack(angles)).all(axis=0)
    largest = 0.5 * np.pi - _HORIZON
    above = (np.abs(theta_incident) < largest) & (np.abs(theta_outgoing) < largest)
    keep = finite & above
    notes += note_of(~finite, "samples are not finite and left out")
    notes += note_of(finite & ~above, "samples are at or below the horizon and left out")
    if not keep.any():
        raise MdfconvError(f"{path}: no finite sample above the horizon")
    return DirectionalSamples(
        direction(theta_incident[keep], phi_incident[keep]),
        direction(theta_outgoing[keep], phi_outgoing[keep]),
        values[keep],
        channels,
        notes,
    )


def note_of(dropped: NDArray[np.bool_], what: str) -> tuple[str, ...]:
    """Return a note on how many of the samples something is said of; none if of none."""
    count = int(np.count_nonzero(dropped))
    return (f"{count} of {dropped.size} {what}",) if count else ()


def _check_shapes(
    path: Path | str, angles: Sequence[Array], values: Array, channels: Sequence[str]
) -> None:
    """Raise unless there is a row for each angle and a column of values for each channel."""
    shape = len(angles[0]), len(channels)
    if values.shape != shape or any(angle.shape != shape[:1] for angle in angles):
        raise MdfconvError(
            f"{path}: values of shape {values.shape} where {shape[0]} angles and the channels "
            f"{', '.join(channels)} make {shape}"
        )
