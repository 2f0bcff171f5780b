"""Measured samples, whatever file they come from."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from mdfconv.brdf.microfacet import direction, half_vector
from mdfconv.distributions.evaluation import Array, Indices
from mdfconv.errors import MdfconvError

# What a file says of itself: for a title.
MOST_ABOUT = 8
_LONGEST_ABOUT = 120
_WORD = re.compile(r"[^\W\d_]{2}")
_Kind = TypeVar("_Kind", "Samples", "DirectionalSamples")


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
    about : tuple of str
        What the file says of itself: at most `MOST_ABOUT` short lines, without control characters.
    uncertainty : numpy.ndarray or None, shape (n, channels)
        Standard uncertainties of the values, in their unit, > 0; None if the file has none.
    """

    beta: Array
    values: Array
    channels: tuple[str, ...]
    quantity: str
    notes: tuple[str, ...] = ()
    about: tuple[str, ...] = ()
    uncertainty: Array | None = None

    def select(self, rows: Any) -> Samples:
        """Return some of the samples, by a mask or by indices."""
        return _selected(self, ("beta", "values", "uncertainty"), rows)


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
    about : tuple of str
        What the file says of itself: at most `MOST_ABOUT` short lines, without control characters.
    uncertainty : numpy.ndarray or None, shape (n, channels)
        Standard uncertainties of the values, in their unit, > 0; None if the file has none.
    """

    incident: Array
    outgoing: Array
    values: Array
    channels: tuple[str, ...]
    notes: tuple[str, ...] = ()
    about: tuple[str, ...] = ()
    uncertainty: Array | None = None

    @property
    def half(self) -> Array:
        """The half vectors, shape (n, 3)."""
        return half_vector(self.incident, self.outgoing)

    def select(self, rows: Any) -> DirectionalSamples:
        """Return some of the samples, by a mask or by indices."""
        return _selected(self, ("incident", "outgoing", "values", "uncertainty"), rows)


Measurements: TypeAlias = Samples | DirectionalSamples


def _selected(samples: _Kind, names: Sequence[str], rows: Any) -> _Kind:
    """Return samples with some rows of the arrays that are named; one that is None stays so."""
    arrays = {name: getattr(samples, name) for name in names}
    return replace(samples, **{name: a[rows] for name, a in arrays.items() if a is not None})


# The wavelength in the name of a channel, without brackets.
_WAVELENGTH = re.compile(
    r"(?:lambda|λ|wl|brdf|bsdf|f_?r|r)?[\s_]*"
    r"(?:(?P<bare>\d{3,4}(?:\.\d+)?)|(?P<nm>\d+(?:\.\d+)?)\s*nm|(?P<um>\d+(?:\.\d+)?)\s*[uµμ]m)",
    re.I,
)


def wavelengths_of(channels: Iterable[str]) -> Array | None:
    """Return the wavelengths that all names of channels give, nm; None if one gives none.

    Parameters
    ----------
    channels : iterable of str
        Names such as ``"465nm"``, ``"brdf (0.55 µm)"`` or ``"R_650"``; a number of three or four
        digits alone is one of nanometres.

    Examples
    --------
    >>> from mdfconv.measured.samples import wavelengths_of
    >>> wavelengths_of(["465nm", "R_550", "0.65 µm"])
    array([465., 550., 650.])
    >>> wavelengths_of(["R", "G", "B"])
    """
    names = [re.sub(r"[\[\](){}]", " ", name).strip() for name in channels]
    matches = [match for name in names if (match := _WAVELENGTH.fullmatch(name))]
    if not names or len(matches) < len(names):
        return None
    return np.array([float(m["bare"] or m["nm"] or 0) + 1e3 * float(m["um"] or 0) for m in matches])


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
    about: tuple[str, ...] = (),
    uncertainty: Array | None = None,
) -> Samples:
    """Return samples of one angle, stored in one of `UNITS`, in order and without NaN rows.

    Raises `MdfconvError`, which names the path, if an angle is outside [0, π/2], no row is left, or
    the shapes do not go together.
    """
    _check_shapes(path, [angle], values, channels, uncertainty)
    whole = np.isfinite(angle) & np.isfinite(values).all(axis=1)
    notes += note_of(~whole, "rows hold NaN or infinity and are left out")
    known, uncertainty, remarks = _with_uncertainty(whole, uncertainty)
    notes += remarks
    if not whole.any():
        raise MdfconvError(f"{path}: no row with finite numbers")
    largest = UNITS[unit].largest
    outside = whole & ((angle < -_SLACK * largest) | (angle > (1 + _SLACK) * largest))
    if outside.any():
        bad = float(angle[outside][0])
        raise MdfconvError(
            f"{path}: {unit} {bad:g} is outside 0 to {largest:.6g}, an angle from the normal to "
            "the horizon"
        )
    beta = UNITS[unit].to_radians(np.clip(angle, 0, largest))
    rows = np.flatnonzero(known)
    rows = rows[np.argsort(beta[rows], kind="stable")]
    return Samples(beta, values, channels, quantity, notes, about, uncertainty).select(rows)


def directional_samples(
    path: Path | str,
    theta_incident: Array,
    phi_incident: Array,
    theta_outgoing: Array,
    phi_outgoing: Array,
    values: Array,
    channels: tuple[str, ...],
    notes: tuple[str, ...] = (),
    about: tuple[str, ...] = (),
    uncertainty: Array | None = None,
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
    channels, notes, about
        As in `DirectionalSamples`.
    uncertainty : numpy.ndarray or None, shape (n, channels)
        Standard uncertainties of the values, where they are known a positive number.

    Returns
    -------
    DirectionalSamples
        The samples that are finite and above the horizon, and if any has an uncertainty those
        that have one; notes say how many are left out.

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
    _check_shapes(path, angles, values, channels, uncertainty)
    finite = np.isfinite(values).all(axis=1) & np.isfinite(np.stack(angles)).all(axis=0)
    largest = 0.5 * np.pi - _HORIZON
    above = (np.abs(theta_incident) < largest) & (np.abs(theta_outgoing) < largest)
    notes += note_of(~finite, "samples are not finite and left out")
    notes += note_of(finite & ~above, "samples are at or below the horizon and left out")
    if not (finite & above).any():
        raise MdfconvError(f"{path}: no finite sample above the horizon")
    keep, uncertainty, remarks = _with_uncertainty(finite & above, uncertainty)
    return DirectionalSamples(
        direction(theta_incident[keep], phi_incident[keep]),
        direction(theta_outgoing[keep], phi_outgoing[keep]),
        values[keep],
        channels,
        notes + remarks,
        about,
        None if uncertainty is None else uncertainty[keep],
    )


def _with_uncertainty(
    whole: NDArray[np.bool_], uncertainty: Array | None
) -> tuple[NDArray[np.bool_], Array | None, tuple[str, ...]]:
    """Return which of the whole rows have an uncertainty, all if none has one; and notes."""
    if uncertainty is None:
        return whole, None, ()
    known = (np.isfinite(uncertainty) & (uncertainty > 0)).all(axis=1)
    if not (whole & known).any():
        return whole, None, ("no uncertainty is a positive number: they are not used",)
    what = "samples have no positive uncertainty and are left out"
    return whole & known, uncertainty, note_of(whole & ~known, what)


def about_of(lines: Iterable[str]) -> tuple[str, ...]:
    """Return the first lines with a word in them as `Samples.about` has them."""
    told: dict[str, None] = {}
    for line in lines:
        text = " ".join("".join(c if c.isprintable() else " " for c in line).split())
        if len(text) > _LONGEST_ABOUT:
            text = f"{text[: _LONGEST_ABOUT - 1].rstrip()}…"
        if _WORD.search(text):
            told[text] = None
        if len(told) == MOST_ABOUT:
            break
    return tuple(told)


def some_rows(random: np.random.Generator, count: int, most: int) -> Indices | None:
    """Return the indices of some of so many samples, in order; None for all."""
    return np.sort(random.choice(count, most, replace=False)) if count > most else None


def note_of(dropped: NDArray[np.bool_], what: str) -> tuple[str, ...]:
    """Return a note on how many of the samples something is said of; none if of none."""
    count = int(np.count_nonzero(dropped))
    return (f"{count} of {dropped.size} {what}",) if count else ()


def _check_shapes(
    path: Path | str,
    angles: Sequence[Array],
    values: Array,
    channels: Sequence[str],
    uncertainty: Array | None,
) -> None:
    """Raise unless there is a row for each angle and a column of values for each channel."""
    shape = len(angles[0]), len(channels)
    if uncertainty is not None and uncertainty.shape != shape:
        raise MdfconvError(
            f"{path}: uncertainties of shape {uncertainty.shape} where the values have {shape}"
        )
    if values.shape != shape or any(angle.shape != shape[:1] for angle in angles):
        raise MdfconvError(
            f"{path}: values of shape {values.shape} where {shape[0]} angles and the channels "
            f"{', '.join(channels)} make {shape}"
        )
