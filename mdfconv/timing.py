"""Times that can be compared on a machine that does other things as well.

What is to be compared runs in turns, in an order shuffled anew each round, so that a machine
that slows down for a while slows down all of it. The first round warms up and is not counted.
Processor time of the thread is counted, which does not run while others have the processor.
"""

from __future__ import annotations

import os
import random
import time
from collections.abc import Callable, Mapping
from typing import NamedTuple, TypeVar

import numpy as np

from mdfconv.distributions.evaluation import Array

Advance = Callable[[int], None]
Key = TypeVar("Key")

# Medians that differ by a smaller share are the same on a machine that is not idle.
NOISE = 0.1
# On Windows processor time advances in steps of 16 ms.
clock = time.perf_counter if os.name == "nt" else time.thread_time


class Spread(NamedTuple):
    """A median with the quartiles around it."""

    median: float
    low: float
    high: float

    def columns(self, name: str) -> dict[str, float]:
        """Return the three as columns of a table."""
        return {name: self.median, f"{name}_low": self.low, f"{name}_high": self.high}


def spread(samples: Array) -> Spread:
    """Return the median and the quartiles of samples."""
    low, median, high = np.percentile(samples, [25, 50, 75])
    return Spread(float(median), float(low), float(high))


def interleave(
    functions: Mapping[Key, Callable[[], object]], rounds: int, advance: Advance
) -> dict[Key, Array]:
    """Time functions in turns, and return the seconds of each by its name.

    `rounds` are counted after one that is not; the same place in two arrays is the same round.
    `advance` is called with 1 after each round, the first one included.
    """
    times = {name: np.empty(rounds + 1) for name in functions}
    order = list(functions)
    shuffle = random.Random(0).shuffle
    for count in range(rounds + 1):
        shuffle(order)
        for name in order:
            start = clock()
            functions[name]()
            times[name][count] = clock() - start
        advance(1)
    return {name: seconds[1:] for name, seconds in times.items()}
