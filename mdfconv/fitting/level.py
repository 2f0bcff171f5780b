"""Where a distribution crosses a level: the kinks of what a screen shows."""

from __future__ import annotations

import numpy as np

from mdfconv.distributions import Distribution
from mdfconv.distributions.evaluation import Array

# From a mirror's lobe to π/2 there are 30 octaves; 60 halvings leave the rounding.
_BISECTIONS = 60


def level_crossing(
    distribution: Distribution, parameter: Array, level: Array, high: Array, low: Array
) -> Array:
    """Return by bisection the angle at which D̄ crosses a level.

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
    for _ in range(_BISECTIONS):
        # Geometric steps resolve a mirror's lobe; arithmetic ones reach an end at 0.
        middle = np.where(np.minimum(low, high) > 1e-12, np.sqrt(low * high), 0.5 * (low + high))
        above = distribution.shape(middle, parameter) >= level
        high, low = np.where(above, middle, high), np.where(above, low, middle)
    return np.where(crosses, 0.5 * (low + high), 0)
