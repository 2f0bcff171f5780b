"""Labels beside the points of a picture, moved out of each other's way."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any, TypeAlias

import numpy as np

from mdfconv.distributions.evaluation import Array

# In points, 1/72 inch.
_FONT = 7.5
_LETTER = 0.66 * _FONT
_MARKER = 5.0
_TOGETHER = 8.0
# A line is seen at so many places of its own, each as bad as so much of another label.
_LINE_STEP, _LINE_COST = 2.0, 20.0
# Where a label may stand: from the marker to the middle of its nearer end, in order of choice.
_PLACES = [
    (side * (_MARKER + 2) if side else 0.0, height, side)
    for distance in (0.0, 11.0, 22.0, 33.0)
    for side, height in (
        (0, 10 + distance), (0, -10 - distance), (1, distance), (-1, distance), (1, -distance),
        (-1, -distance),
    )
]  # fmt: skip

_Box: TypeAlias = tuple[float, float, float, float]


def place_labels(
    axes: Any,
    x: Sequence[float],
    y: Sequence[float],
    names: Sequence[str],
    lines: Sequence[Array] = (),
) -> None:
    """Write names beside points, off the lines; points that coincide share a label.

    The limits of the axes must be final, and the figure drawn once, so that its layout is.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Where the points are.
    x, y : sequence of float
        The points, in data coordinates.
    names : sequence of str
        Their names.
    lines : sequence of numpy.ndarray, shape (n, 2)
        Corners of lines that are drawn, in data coordinates.
    """
    from matplotlib.patheffects import withStroke

    scale = 72 / axes.figure.dpi

    def placed(corners: Array) -> Array:
        return np.asarray(scale * axes.transData.transform(corners))

    points = placed(np.column_stack([x, y]))
    drawn = np.concatenate([np.empty((0, 2)), *(_along(placed(line)) for line in lines)])
    frame = scale * axes.bbox.extents
    taken = [_box(point[0], point[1], 2 * _MARKER, 2 * _MARKER) for point in points]
    for group in _groups(points):
        text = ", ".join(dict.fromkeys(names[member] for member in group))
        first = group[0]
        boxes = [_label_box(points[first], place, text) for place in _PLACES]
        costs = [_cost(box, taken, frame) + _LINE_COST * _crossed(box, drawn) for box in boxes]
        dx, dy, side = _PLACES[int(np.argmin(costs))]
        taken.append(_label_box(points[first], (dx, dy, side), text))
        axes.annotate(
            text,
            (x[first], y[first]),
            xytext=(dx, dy),
            textcoords="offset points",
            ha=("right", "center", "left")[side + 1],
            va="center",
            fontsize=_FONT,
            path_effects=[withStroke(linewidth=2, foreground="white")],
        )


def _groups(points: Array) -> list[list[int]]:
    """Return the places of points, those together that lie upon each other."""
    groups: list[list[int]] = []
    for place, point in enumerate(points):
        for group in groups:
            if np.max(np.abs(points[group[0]] - point)) < _TOGETHER:
                group.append(place)
                break
        else:
            groups.append([place])
    return groups


def _along(corners: Array) -> Array:
    """Return points along a line, shape (n, 2)."""
    parts = [corners[:1]]
    for start, end in pairwise(corners):
        steps = int(np.ceil(np.hypot(*(end - start)) / _LINE_STEP)) + 1
        parts.append(np.linspace(start, end, steps))
    return np.concatenate(parts)


def _crossed(box: _Box, drawn: Array) -> int:
    """Return how many points of the lines lie under a label."""
    return int(np.count_nonzero(((drawn >= box[:2]) & (drawn <= box[2:])).all(axis=1)))


def _label_box(point: Array, place: tuple[float, float, int], text: str) -> _Box:
    width = _LETTER * len(text)
    dx, dy, side = place
    return _box(point[0] + dx + side * width / 2, point[1] + dy, width, _FONT + 1)


def _box(x: float, y: float, width: float, height: float) -> _Box:
    return x - width / 2, y - height / 2, x + width / 2, y + height / 2


def _cost(box: _Box, taken: Sequence[_Box], frame: Array) -> float:
    """Return how much of a label covers others or leaves the frame."""
    outside = max(frame[0] - box[0], 0) + max(box[2] - frame[2], 0)
    outside += max(frame[1] - box[1], 0) + max(box[3] - frame[3], 0)
    return outside * _FONT + sum(_overlap(box, other) for other in taken)


def _overlap(one: _Box, two: _Box) -> float:
    width = min(one[2], two[2]) - max(one[0], two[0])
    height = min(one[3], two[3]) - max(one[1], two[1])
    return max(width, 0) * max(height, 0)
