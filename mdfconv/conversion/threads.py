"""Large arrays in parts, by several threads: NumPy lets others run while it computes."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np

from mdfconv.distributions.evaluation import (
    PARTS_A_THREAD,
    WORTH_THREADS,
    Array,
    check_threads,
)
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
    check_threads(threads)
    size = np.size(values)
    if threads == 1 or size < WORTH_THREADS:
        return function(values)
    flat, result = values.reshape(-1), np.empty(size)
    ends = np.linspace(0, size, threads * PARTS_A_THREAD + 1).astype(int).tolist()

    def compute(low: int, high: int) -> None:
        result[low:high] = function(flat[low:high])

    try:
        with ThreadPoolExecutor(threads) as pool:
            list(pool.map(compute, ends[:-1], ends[1:]))
    except MdfconvError:
        # What is wrong is said of all the values, not of a part.
        return function(values)
    return result.reshape(values.shape)
