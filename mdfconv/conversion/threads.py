"""Large arrays in parts, by several threads: NumPy lets others run while it computes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from mdfconv.distributions.evaluation import Array, in_parts, worth_threads
from mdfconv.errors import MdfconvError


def in_threads(function: Callable[[Any], Array], values: Any, threads: int) -> Array:
    """Return an elementwise function of a large array, computed in parts by threads.

    Parameters
    ----------
    function : callable
        From an array to one of floats in its shape.
    values : float or numpy.ndarray
        A small array, and a number, is computed at once.
    threads : int
        How many run at a time, from 1.

    Raises
    ------
    MdfconvError
        If the number of threads makes no sense, or as the function does for all of the values.
    """
    size = np.size(values)
    if not worth_threads(size, threads):
        return function(values)
    flat, result = values.reshape(-1), np.empty(size)

    def compute(low: int, high: int) -> None:
        result[low:high] = function(flat[low:high])

    try:
        in_parts(compute, size, threads)
    except MdfconvError:
        # What is wrong is said of all the values, not of a part.
        return function(values)
    return result.reshape(values.shape)
