"""Error diffusion."""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import as_strided
from numpy.typing import NDArray

# Rows that are rounded together, of a narrow picture: the memory grows with their square.
_ROWS = 256
_RIGHT, _BELOW_LEFT, _BELOW, _BELOW_RIGHT = (np.float32(part / 16) for part in (7, 3, 5, 1))


class ErrorDiffusion:
    """Rounding to 8 bits that hands each texel's error to its neighbours (Floyd & Steinberg 1976).

    The error of a texel goes by 7/16 to the right, 3/16, 5/16 and 1/16 to the left, middle and
    right below. It is at most half a level, and only what leaves the picture is lost: the sums
    before and after differ by at most half a level for each texel of the last row and the two
    edges.

    Parameters
    ----------
    width : int
        Texels a row.
    """

    def __init__(self, width: int) -> None:
        self._width = width
        # Of the row above, from x = −1.
        self._above = np.zeros(width + 2, np.float32)

    def __call__(self, levels: NDArray[np.float32]) -> NDArray[np.uint8]:
        """Round the next rows of a picture.

        Parameters
        ----------
        levels : numpy.ndarray of float32, shape (rows, width)
            Values in units of the level, from 0 to 255.

        Returns
        -------
        numpy.ndarray of uint8, shape (rows, width)
        """
        if levels.size == 0:
            return levels.astype(np.uint8)
        step = max(_ROWS, self._width)
        parts = [self._round(levels[top : top + step]) for top in range(0, len(levels), step)]
        return np.concatenate(parts)

    def _round(self, levels: NDArray[np.float32]) -> NDArray[np.uint8]:
        rows, width = levels.shape
        # Texels with the same x + 2y wait for none of each other: they are one row of the
        # sheared picture, and one step.
        steps = width + 2 * (rows - 1)
        sheared = np.zeros((steps, rows), np.float32)
        shear = (sheared.strides[0] * 2 + sheared.strides[1], sheared.strides[0])
        picture = as_strided(sheared, levels.shape, shear)
        picture[...] = levels
        # Three steps before the first, and in front of every step the row above.
        error = np.zeros((steps + 3, rows + 1), np.float32)
        error[: width + 2, 0] = self._above
        self._diffuse(sheared, error)
        self._above[1:-1] = error[3 + 2 * (rows - 1) :, rows]
        return picture.astype(np.uint8)

    def _diffuse(self, sheared: NDArray[np.float32], error: NDArray[np.float32]) -> None:
        """Round the sheared picture in place, step by step."""
        rows = sheared.shape[1]
        part = np.empty(rows, np.float32)
        for step in range(sheared.shape[0]):
            first = max(0, (step - self._width) // 2 + 1)
            last = min(rows, step // 2 + 1)
            one, two, three = error[step + 2], error[step + 1], error[step]
            value, share = sheared[step, first:last], part[first:last]
            for source, weight in (
                (one[first + 1 : last + 1], _RIGHT),
                (one[first:last], _BELOW_LEFT),
                (two[first:last], _BELOW),
                (three[first:last], _BELOW_RIGHT),
            ):
                np.multiply(source, weight, out=share)
                value += share
            np.rint(value, out=share)
            np.clip(share, 0, 255, out=share)
            np.subtract(value, share, out=error[step + 3, first + 1 : last + 1])
            value[...] = share
