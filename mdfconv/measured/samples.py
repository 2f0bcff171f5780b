"""Measured samples, whatever file they come from."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

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


# From an angle as stored to radians.
UNITS: dict[str, Callable[[Array], Array]] = {
    "degrees": np.radians,
    "radians": np.asarray,
    "cosine": np.arccos,
}


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
        ``"degrees"``, ``"radians"`` or ``"cosine"``.
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
    limits = {"degrees": (0.0, 90.0), "radians": (0.0, np.pi / 2), "cosine": (0.0, 1.0)}[unit]
    slack = 1e-6 * limits[1]
    outside = (angle < limits[0] - slack) | (angle > limits[1] + slack)
    if outside.any():
        bad = float(angle[outside][0])
        raise MdfconvError(
            f"{path}: {unit} {bad:g} is outside {limits[0]:g} to {limits[1]:.6g}, an angle from "
            "the normal to the horizon"
        )
    beta = UNITS[unit](np.clip(angle, *limits))
    order = np.argsort(beta, kind="stable")
    return Samples(beta[order], values[order], channels, quantity, notes)
