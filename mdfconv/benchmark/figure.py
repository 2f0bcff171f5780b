"""The picture of speed against error: what is left and below is better."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mdfconv.benchmark.labels import place_labels
from mdfconv.benchmark.measure import Measurements
from mdfconv.benchmark.pareto import front
from mdfconv.benchmark.timing import NOISE, Spread
from mdfconv.reports.figures import encoded, line_style, pyplot

_SIZE = (10.0, 5.6)  # inches
_MARKERS = "osD^vPX*<>hp"
# Tell apart variants of one name: parameters of the reference, metrics of a method.
_FILLS = ("full", "none", "left", "top", "right", "bottom")
_FRONTS = ("-", "--", ":", "-.")
_COLORS = ("#000000", "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
_ROUNDING = 1e-12  # smaller errors are none
_BELOW = 0.1  # of the smallest error: where none is drawn
_FEW_DECADES = 200
_MARGIN = 0.06


@dataclass(frozen=True)
class _Point:
    name: str
    variant: str
    nanoseconds: Spread
    error: float


def draw(found: Measurements, dpi: int = 120) -> bytes:
    """Return a PNG: error against time of distributions, and of conversion methods.

    Parameters
    ----------
    found : Measurements
        What was measured; a row without an error is left out.
    dpi : int
        Resolution.
    """
    plt = pyplot()
    figure, (left, right) = plt.subplots(1, 2, figsize=_SIZE)
    distributions = [
        _Point(
            row.distribution,
            f"for {row.reference} {row.reference_parameter:.4g}",
            row.ns["float32"],
            row.rmse,
        )
        for row in found.substitutes
    ]
    colors = {point.name: line_style(point.name)["color"] for point in distributions}
    _panel(left, distributions, colors)
    left.set_title("Distributions as substitutes")
    left.set_xlabel("time of an evaluation, float32 [ns]")
    left.set_ylabel("RMSE of the best fit, unit form")
    methods = [
        _Point(
            row.method, f"metric {row.metric}", _nanoseconds(row.per_second), row.parameter_error
        )
        for row in found.methods
    ]
    names = dict.fromkeys(point.name for point in methods)
    _panel(right, methods, dict(zip(names, _cycled(_COLORS, len(names)), strict=True)))
    pair = found.methods[0]
    right.set_title(f"Conversion methods, {pair.source} → {pair.target}")
    right.set_xlabel("time of a conversion [ns]")
    right.set_ylabel("median relative error of the parameter against fit")
    # The layout decides how far apart the points are.
    figure.canvas.draw()
    for axes, points in ((left, distributions), (right, methods)):
        _label(axes, points)
    return encoded(figure, dpi=dpi)


def _nanoseconds(per_second: Spread) -> Spread:
    median, low, high = (1e9 / value for value in per_second)
    return Spread(median, high, low)


def _panel(axes: Any, points: Sequence[_Point], colors: dict[str, str]) -> None:
    """Draw points with their quartiles and fronts, and a legend beneath."""
    there = [point for point in points if np.isfinite(point.error)]
    nothing = _where_nothing_is(there)
    names, variants = list(colors), list(dict.fromkeys(point.variant for point in there))
    for number, variant in enumerate(variants):
        own = [point for point in there if point.variant == variant]
        _draw_front(axes, own, nothing, _FRONTS[number % len(_FRONTS)])
        for point in own:
            axes.errorbar(
                point.nanoseconds.median,
                max(point.error, nothing),
                xerr=_bars(point.nanoseconds),
                elinewidth=0.8,
                **_style(names.index(point.name), number, colors[point.name]),
            )
    _scale(axes, nothing)
    fills = [axes.plot([], [], **_style(0, number, "0.4"))[0] for number in range(len(variants))]
    line = axes.plot([], [], color="0.55", linewidth=1.2)
    axes.legend(
        [*fills, *line],
        [*variants, "Pareto front"],
        loc="upper center",
        bbox_to_anchor=(0.5, -0.12),
        ncols=4,
        fontsize=8,
        columnspacing=1.2,
        handletextpad=0.4,
    )


def _label(axes: Any, points: Sequence[_Point]) -> None:
    there = [point for point in points if np.isfinite(point.error)]
    nothing = _where_nothing_is(there)
    place_labels(
        axes,
        [point.nanoseconds.median for point in there],
        [max(point.error, nothing) for point in there],
        [point.name for point in there],
    )


def _where_nothing_is(points: Sequence[_Point]) -> float:
    """Return the height at which an error of 0 is drawn."""
    errors = [point.error for point in points if point.error > _ROUNDING]
    return _BELOW * min(errors, default=1.0)


def _scale(axes: Any, nothing: float) -> None:
    """Set logarithmic axes with a 0 at the lower end, and ticks that can be read."""
    # Not before `pyplot` has prepared Matplotlib.
    from matplotlib.ticker import LogLocator, NullFormatter, NullLocator

    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.axhline(nothing, color="0.6", linewidth=0.8, linestyle=":")
    axes.annotate(
        "0", (0, nothing), xycoords=("axes fraction", "data"), xytext=(-6, 0),
        textcoords="offset points", ha="right", va="center",
    )  # fmt: skip
    low, high = axes.get_xlim()
    # Room for the labels.
    margin = (high / low) ** _MARGIN
    low, high = low / margin, high * margin
    axes.set_xlim(low, high)
    if high < _FEW_DECADES * low:
        axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 3, 5)))
        axes.xaxis.set_major_formatter("{x:g}")
        axes.xaxis.set_minor_formatter(NullFormatter())
    top = axes.get_ylim()[1]
    axes.set_ylim(nothing / 3, 2 * top)
    axes.set_yticks([tick for tick in axes.get_yticks() if 2 * nothing < tick < 2 * top])
    axes.yaxis.set_minor_locator(NullLocator())


def _draw_front(axes: Any, points: Sequence[_Point], nothing: float, dashes: str) -> None:
    pairs = [(point.nanoseconds.median, max(point.error, nothing)) for point in points]
    best = [pairs[place] for place in front(pairs, NOISE)]
    x, y = zip(*best, strict=True)
    axes.step(x, y, where="post", color="0.55", linewidth=1.2, linestyle=dashes, zorder=1)


def _bars(times: Spread) -> list[list[float]]:
    return [[times.median - times.low], [times.high - times.median]]


def _style(shape: int, fill: int, color: str) -> dict[str, Any]:
    return {
        "marker": _MARKERS[shape % len(_MARKERS)],
        "fillstyle": _FILLS[fill % len(_FILLS)],
        "color": color,
        "markerfacecoloralt": "white",
        "markersize": 7,
        "linestyle": "",
    }


def _cycled(values: Sequence[str], count: int) -> list[str]:
    return [values[number % len(values)] for number in range(count)]
