"""The picture of speed against error, and of time against count: low and left is better."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import cycle, pairwise, zip_longest
from typing import Any

import numpy as np

from mdfconv.distributions.evaluation import Array
from mdfconv.output.figures import encoded, line_style, new_figure
from mdfconv.output.labels import place_labels
from mdfconv.studies.bench.measure import Measurements
from mdfconv.studies.bench.pareto import front
from mdfconv.timing import NOISE, Spread

_SIZE = (10.0, 10.0)  # inches
_PANELS = [["substitutes", "methods"], ["scaling", "scaling"]]
_MARKERS = "osD^vPX*<>hp"
# Tell apart variants of one name: parameters of the reference, metrics of a method.
_FILLS = ("full", "none", "left", "top", "right", "bottom")
_FRONTS = ("-", "--", ":", "-.")
_COLORS = ("#000000", "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
_ROUNDING = 1e-12  # smaller errors are none
# A decade below the smallest error is where none is drawn: apart from it, and still near.
_BELOW = 0.1
# An axis over a little more than two decades has too few powers of ten to be read between.
_FEW_DECADES = 200
# Leading digits of the ticks on it, and on one that may hold no power of ten or only one.
_TICKS, _CLOSE_TICKS, _FEW_TIMES = (1, 2, 3, 5), (1, 1.2, 1.5, 2, 3, 4, 5, 6, 7, 8, 9), 8
# The labels beside the outermost points need as much more of the range at either end.
_MARGIN = 0.06


@dataclass(frozen=True)
class _Point:
    name: str
    variant: str
    nanoseconds: Spread
    error: float


def draw(measurements: Measurements, dpi: int = 120) -> bytes:
    """Return a PNG: error against time of distributions and conversion methods, and their scaling.

    Parameters
    ----------
    measurements : Measurements
        What was measured; a row without an error is left out.
    dpi : int
        Resolution.
    """
    figure = new_figure(*_SIZE)
    axes = figure.subplot_mosaic(_PANELS, height_ratios=(5, 4))
    distributions = [
        _Point(
            row.distribution,
            f"for {row.reference} {row.reference_parameter:.4g}",
            row.ns["float32"],
            row.rmse,
        )
        for row in measurements.substitutes
    ]
    methods = [
        _Point(row.method, f"metric {row.metric}", row.nanoseconds, row.parameter_error)
        for row in measurements.methods
    ]
    colors = {point.name: line_style(point.name)["color"] for point in distributions}
    names = dict.fromkeys(point.name for point in methods)
    method_colors = dict(zip(names, cycle(_COLORS), strict=False))
    panels = (
        _Panel(axes["substitutes"], distributions, colors),
        _Panel(axes["methods"], methods, method_colors),
    )
    _draw_scaling(axes["scaling"], measurements, method_colors)
    pair = measurements.methods[0]
    axes["substitutes"].set(
        title="Distributions as substitutes",
        xlabel="time of an evaluation, float32 [ns]",
        ylabel="RMSE of the best fit, unit form",
    )
    axes["methods"].set(
        title=f"Conversion methods, {pair.source} → {pair.target}",
        xlabel="time of a conversion [ns]",
        ylabel="median relative error of the parameter against fit",
    )
    # The layout decides how far apart the points are.
    figure.canvas.draw()
    for panel in panels:
        panel.label()
    return encoded(figure, dpi=dpi)


def _draw_scaling(axes: Any, measurements: Measurements, colors: dict[str, str]) -> None:
    """Draw seconds against count, a line a method."""
    for shape, (method, color) in enumerate(colors.items()):
        rows = [row for row in measurements.scaling if row.method == method]
        style = _style(shape, 0, color) | {"linestyle": "-", "markersize": 5}
        seconds = [row.seconds.median for row in rows]
        axes.plot([row.values for row in rows], seconds, label=method, linewidth=1, **style)
    axes.set(
        title=f"Time against count, metric {measurements.scaling[0].metric}",
        xlabel="values converted by one call",
        ylabel="time of the call [s]",
        xscale="log",
        yscale="log",
    )
    axes.legend(loc="center left", bbox_to_anchor=(1, 0.5))


class _Panel:
    """Points with their quartiles and fronts, and a legend beneath."""

    def __init__(self, axes: Any, points: Sequence[_Point], colors: dict[str, str]) -> None:
        self._axes = axes
        self._points = [point for point in points if np.isfinite(point.error)]
        errors = [point.error for point in self._points if point.error > _ROUNDING]
        # The height at which an error of 0 is drawn.
        self._zero = _BELOW * min(errors, default=1.0)
        shapes = list(colors)
        variants = list(dict.fromkeys(point.variant for point in self._points))
        self._fronts = [self._front(variant) for variant in variants]
        for fill, variant in enumerate(variants):
            self._axes.plot(*self._fronts[fill].T, zorder=1, **_front_style(fill))
            for point in self._points:
                if point.variant == variant:
                    style = _style(shapes.index(point.name), fill, colors[point.name])
                    self._draw_point(point, style)
        self._scale()
        self._draw_legend(variants)

    def label(self) -> None:
        """Write the names beside the points of a figure whose layout is final."""
        x, y = zip(*map(self._position, self._points), strict=True)
        place_labels(self._axes, x, y, [point.name for point in self._points], self._fronts)

    def _position(self, point: _Point) -> tuple[float, float]:
        return point.nanoseconds.median, max(point.error, self._zero)

    def _draw_point(self, point: _Point, style: dict[str, Any]) -> None:
        times = point.nanoseconds
        bars = [[times.median - times.low], [times.high - times.median]]
        self._axes.errorbar(*self._position(point), xerr=bars, elinewidth=0.8, **style)

    def _front(self, variant: str) -> Array:
        """Return the corners of the front of a variant: what is at least as quick has its error."""
        positions = [self._position(point) for point in self._points if point.variant == variant]
        best = [positions[number] for number in front(positions, NOISE)]
        corners = [(later[0], earlier[1]) for earlier, later in pairwise(best)]
        steps = [point for pair in zip_longest(best, corners) for point in pair if point]
        return np.array(steps)

    def _draw_legend(self, variants: Sequence[str]) -> None:
        plot = self._axes.plot
        handles = [
            plot([], [], **_style(0, fill, "0.4") | _front_style(fill))[0]
            for fill in range(len(variants))
        ]
        self._axes.legend(
            handles,
            variants,
            title="lines: Pareto fronts",
            title_fontsize=8,
            loc="upper center",
            bbox_to_anchor=(0.5, -0.12),
            ncols=2,
            fontsize=8,
            columnspacing=1.5,
            handlelength=4,
        )

    def _scale(self) -> None:
        """Set logarithmic axes with a 0 at the lower end, and ticks that can be read."""
        # Not before `new_figure` has prepared Matplotlib.
        from matplotlib.ticker import LogLocator, NullFormatter, NullLocator

        axes, zero = self._axes, self._zero
        axes.set(xscale="log", yscale="log")
        axes.axhline(zero, color="0.6", linewidth=0.8, linestyle=":")
        axes.annotate(
            "0", (0, zero), xycoords=("axes fraction", "data"), xytext=(-6, 0),
            textcoords="offset points", ha="right", va="center",
        )  # fmt: skip
        low, high = axes.get_xlim()
        margin = (high / low) ** _MARGIN
        axes.set_xlim(low / margin, high * margin)
        span = margin**2 * high / low
        if span < _FEW_DECADES:
            ticks = _CLOSE_TICKS if span < _FEW_TIMES else _TICKS
            axes.xaxis.set_major_locator(LogLocator(subs=ticks))
            axes.xaxis.set_major_formatter("{x:g}")
            axes.xaxis.set_minor_formatter(NullFormatter())
        top = 2 * axes.get_ylim()[1]
        axes.set_ylim(zero / 3, top)
        axes.set_yticks([tick for tick in axes.get_yticks() if 2 * zero < tick < top])
        axes.yaxis.set_minor_locator(NullLocator())


def _front_style(fill: int) -> dict[str, Any]:
    return {"linestyle": _FRONTS[fill % len(_FRONTS)], "linewidth": 1.2, "color": "0.55"}


def _style(shape: int, fill: int, color: str) -> dict[str, Any]:
    return {
        "marker": _MARKERS[shape % len(_MARKERS)],
        "fillstyle": _FILLS[fill % len(_FILLS)],
        "color": color,
        "markerfacecoloralt": "white",
        "markersize": 7,
        "linestyle": "",
    }
