"""Values of a smooth function at many places from those at some."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from mdfconv.distributions.evaluation import Array, Mask

# Even, so that every other knot is checked by its neighbours.
_INTERVALS = 4096
# Four knots foretell the one in their middle to this; between it and them the error is a
# sixteenth of that.
_TOLERANCE = 1e-7

WORTH_IT = 2 * _INTERVALS
# Errors are shown with three digits.
_COARSE, _COARSE_TOLERANCE = 512, 1e-4


def errors_of_many(function: Callable[[Array], Array], parameter: Array) -> Array:
    """Return an error for each of many parameters, from those of some where it is smooth.

    Parameters
    ----------
    function : callable
        Returns errors, shape (n,), of parameters, shape (n,); NaN where there are none.
    parameter : numpy.ndarray, shape (m,)
        Numbers above 0.

    Returns
    -------
    numpy.ndarray, shape (m,)
        Of fewer than a thousand the function itself, of more to 1e-4.
    """
    if parameter.size < 2 * _COARSE or not np.ptp(parameter) > 0:
        return function(parameter)
    low, high = parameter.min(), parameter.max()
    (found,), _ = interpolated(
        lambda x: function(np.clip(np.exp(x), low, high))[None],
        np.log(parameter),
        _COARSE,
        _COARSE_TOLERANCE,
    )
    rest = np.isnan(found)
    found[rest] = function(parameter[rest])
    return found


def interpolated(
    function: Callable[[Array], Array],
    x: Array,
    intervals: int = _INTERVALS,
    tolerance: float = _TOLERANCE,
) -> tuple[Array, Mask]:
    """Return a function of one variable by cubics through its values at even knots.

    Parameters
    ----------
    function : callable
        Returns values, shape (c, n), at places, shape (n,); NaN where there are none.
    x : numpy.ndarray, shape (m,)
        Places, not all the same. With fewer than `WORTH_IT` the function itself is as quick.
    intervals : int
        Even: so many lie between the knots.
    tolerance : float
        By how much four knots may miss the one in their middle; between them the error is a
        sixteenth of that.

    Returns
    -------
    values : numpy.ndarray, shape (c, m)
        NaN where the first value jumps or bends, by more than the tolerance from the knots
        around.
    nowhere : numpy.ndarray of bool, shape (m,)
        Where none of the knots around has one.
    """
    start, step = x.min(), np.ptp(x) / intervals
    values = function(np.linspace(start, x.max(), intervals + 1))
    place = (x - start) / step
    left = np.clip(place.astype(int), 1, intervals - 2)
    t = place - left
    weights = (
        t * (t - 1) * (2 - t) / 6,
        (t + 1) * (t - 1) * (t - 2) / 2,
        (t + 1) * t * (2 - t) / 2,
        (t + 1) * t * (t - 1) / 6,
    )
    with np.errstate(invalid="ignore"):
        result = sum(weight * values[:, left + at - 1] for at, weight in enumerate(weights))
    nowhere = _all_four(np.isnan(values[0]))[left - 1]
    return np.where(_all_four(_smooth(values[0], tolerance))[left - 1], result, np.nan), nowhere


def _smooth(value: Array, tolerance: float) -> Mask:
    """Return whether knots lie on cubics through others, as far as that is known."""
    foretold = (9 * (value[2:-4:2] + value[4:-2:2]) - value[:-6:2] - value[6::2]) / 16
    good = np.abs(foretold - value[3:-3:2]) <= tolerance
    checked = np.ones(value.size, bool)
    checked[3:-3:2] = good
    checked[1], checked[-2] = good[0], good[-1]
    return checked


def _all_four(holds: Mask) -> Mask:
    """Return where what holds for knots holds for four in a row."""
    every: Mask = holds[:-3] & holds[1:-2] & holds[2:-1] & holds[3:]
    return every
