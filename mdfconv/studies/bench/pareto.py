"""The choices that nothing else beats on both counts."""

from __future__ import annotations

from collections.abc import Sequence


def front(points: Sequence[tuple[float, float]], tie: float = 0.0) -> list[int]:
    """Return which points are the Pareto front of two costs, the first cost rising.

    Parameters
    ----------
    points : sequence of (float, float)
        Two costs, such as time and error; a point with NaN is never on the front.
    tie : float
        First costs count as equal if one exceeds the other by at most this share.

    Returns
    -------
    list of int
        Indices of the points than which no other is better in one cost and at least as good in
        the other; of equal points the first.

    Examples
    --------
    >>> front([(3.0, 0.0), (1.0, 0.2), (2.0, 0.3), (1.0, 0.2)])
    [1, 0]
    """
    kept: list[int] = []
    lowest = float("inf")
    comparable = [index for index, point in enumerate(points) if point[0] == point[0]]
    for index in sorted(comparable, key=lambda index: points[index]):
        if points[index][1] < lowest:
            lowest = points[index][1]
            while kept and points[index][0] <= (1 + tie) * points[kept[-1]][0]:
                kept.pop()
            kept.append(index)
    return kept
