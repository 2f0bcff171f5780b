"""Where a distribution crosses a level: the kinks of what a screen shows."""

from __future__ import annotations

import numpy as np

from mdfconv.distributions import Distribution
from mdfconv.distributions.evaluation import Array

# Lobes down to 1e-19 are resolved. From there to π/2 there are 67 octaves: so many halvings of the
# logarithm leave 1e-5, on which D̄ is a straight line even beside an edge, and so many steps of the
# Illinois rule then 1e-14.
_LEAST, _BISECTIONS, _SECANTS = 1e-20, 22, 4


def level_crossing(
    distribution: Distribution, parameter: Array, level: Array, high: Array, low: Array
) -> Array:
    """Return the angle at which D̄ crosses a level.

    Parameters
    ----------
    distribution : Distribution
        The distribution.
    parameter, level : numpy.ndarray, shape (n, 1)
        Its parameters, and levels of D̄.
    high, low : numpy.ndarray, shape (n, 1)
        Angles, radians, between which D̄ falls from above the level to below it.

    Returns
    -------
    numpy.ndarray, shape (n, 1)
        The angle; 0 where D̄ does not cross the level between the two.
    """
    crosses = (level < 1) & (distribution.shape(low, parameter) < level)
    high, low = np.maximum(high, _LEAST), np.maximum(low, _LEAST)
    for _ in range(_BISECTIONS):
        middle = np.sqrt(low * high)
        above = distribution.shape(middle, parameter) >= level
        high, low = np.where(above, middle, high), np.where(above, low, middle)
    at_high, at_low = (distribution.shape(end, parameter) - level for end in (high, low))
    for _ in range(_SECANTS):
        with np.errstate(divide="ignore", invalid="ignore"):
            middle = high + (low - high) * at_high / (at_high - at_low)
        # Where D̄ is the level all along, any angle is.
        middle = np.where(np.isfinite(middle), middle, high)
        value = distribution.shape(middle, parameter) - level
        above = value >= 0
        # The end that stays pulls half as hard, so that both come near (Dowell & Jarratt 1971).
        at_high, at_low = (
            np.where(above, value, 0.5 * at_high),
            np.where(above, 0.5 * at_low, value),
        )
        high, low = np.where(above, middle, high), np.where(above, low, middle)
    return np.where(crosses, middle, 0)
