"""Functions of one variable as polynomials on many cells: no elementary function is as quick."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from mdfconv.distributions.evaluation import Array, Indices

# Added to a number below it, the last bits of the sum are the nearest whole number.
_WHOLE = 2.0**52
_WHOLE_BITS = np.float64(_WHOLE).view(np.int64)
# Where a polynomial is compared with the function, as shares of a cell, or of what of it lies
# between breaks.
_CHECKS = np.array([0.001, 0.25, 0.75, 0.999])
# Degree, cells and tolerance for a smooth function that has all digits but the last.
TO_ROUNDING = 5, 512, 3e-15


class PolynomialTable:
    """A function on 0 to 1, within a relative error.

    Parameters
    ----------
    function : callable
        Returns values, shape (n,), at places, shape (n,), each by itself.
    degree, cells : int
        Of the polynomials, and how many there are. Up to 4000 coefficients or so stay in the cache
        nearest the processor.
    tolerance : float
        The relative error.
    breaks : array_like
        Places at which the function may jump or bend.
    """

    def __init__(
        self,
        function: Callable[[Array], Array],
        degree: int,
        cells: int,
        tolerance: float,
        breaks: ArrayLike = (),
    ) -> None:
        self._cells = cells
        cell = np.arange(cells + 1)
        low, high = np.maximum(cell - 0.5, 0), np.minimum(cell + 0.5, cells)
        # Chebyshev's points of each cell
        share = 0.5 - 0.5 * np.cos(np.pi * (np.arange(degree + 1) + 0.5) / (degree + 1))
        t = low[:, None] + (high - low)[:, None] * share - cell[:, None]
        ends = np.append(np.append(low, cells), np.clip(np.multiply(breaks, cells), 0, cells))
        ends.sort()
        checked = (ends[:-1, None] + np.diff(ends)[:, None] * _CHECKS).ravel() / cells
        with np.errstate(all="ignore"):
            value = function(((t + cell[:, None]) / cells).ravel()).reshape(t.shape)
            powers = t[:, :, None] ** np.arange(degree, -1, -1)
            coefficients = np.linalg.solve(powers, value[:, :, None])[:, :, 0].T
            # What lies beyond has a cell of its own.
            self._coefficients = [np.append(row, np.nan) for row in coefficients]
            wanted = function(checked)
            wrong = ~(np.abs(self(checked) - wanted) <= tolerance * np.abs(wanted))
        self._coefficients[-1][np.rint(checked[wrong] * cells).astype(int)] = np.nan

    def __call__(self, x: Array) -> Array:
        """Return the function at places from 0 on, shape (n,); NaN where no polynomial is near."""
        t = x * self._cells
        whole = t + _WHOLE
        cell = whole.view(np.int64) - _WHOLE_BITS
        whole -= _WHOLE
        t -= whole
        value = np.take(self._coefficients[0], cell, mode="clip")
        for row in self._coefficients[1:]:
            value *= t
            value += np.take(row, cell, out=whole, mode="clip")
        return value


def filled(values: Array, exact: Callable[[Indices], Array]) -> Array:
    """Return values, shape (n,), in which those that are NaN come from a function of their rows."""
    if np.isnan(values.sum()):
        rows = np.flatnonzero(np.isnan(values))
        values[rows] = exact(rows)
    return values
