"""The plots of a fit as PNG."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np

from mdfconv.measured.analysis import Analysis
from mdfconv.measured.panels import COLORS, SUBSCRIPT, AnyPanel, Curve, DiscPanel, Panel, panels
from mdfconv.measured.plots import plain
from mdfconv.output.figures import PAGE, encoded, new_figure

# Results of one channel each that one picture can hold.
_MOST_RESULTS = 6
# Beside each other.
_ACROSS = 2
# Of labels, points.
_LINE = 9
_STYLES = {"line": "-", "dotted": ":", "dots": "."}


def draw_analysis(analysis: Analysis) -> bytes:
    """Return a PNG of the recommended fit: data and curves, residuals, each incidence alone."""
    shown = [panel for result in analysis.results[:_MOST_RESULTS] for panel in panels(result)]
    return draw_panels(shown, analysis.name)


def draw_panels(shown: Sequence[AnyPanel], title: str = "") -> bytes:
    """Return a PNG of plots, for screens of two pixels a point."""
    down = -(-len(shown) // _ACROSS)
    figure = new_figure(PAGE[0] * 1.5, PAGE[1] * 0.65 * down)
    # Names are no formulas.
    figure.suptitle(plain(title), parse_math=False)
    for place, panel in enumerate(shown):
        if isinstance(panel, DiscPanel):
            _draw_discs(figure, panel, (down, _ACROSS, place + 1))
        else:
            _draw(figure.add_subplot(down, _ACROSS, place + 1), panel)
    with warnings.catch_warnings():
        # A letter that the font has not is a box.
        warnings.filterwarnings("ignore", "Glyph")
        return encoded(figure, dpi=192)


def _draw(axes: Any, panel: Panel) -> None:
    # Labels of neighbours are one line apart.
    lines = [curve for curve in panel.curves if curve.label]
    raised = {id(curve): _LINE * (number % 2) for number, curve in enumerate(lines)}
    for curve in panel.curves:
        _draw_curve(axes, curve, panel.y_range, raised.get(id(curve), 0))
    if panel.band:
        axes.axhspan(*panel.band, color="0.88", zorder=0)
    if panel.logarithmic:
        axes.set_yscale("log", nonpositive="mask")
    axes.set(xlim=panel.x_range, ylim=panel.y_range)
    axes.set_title(_caption(panel), parse_math=False)
    axes.set_xlabel(_symbols(panel.x_label))
    axes.set_ylabel(_symbols(panel.y_label))


def _draw_curve(axes: Any, curve: Curve, y_range: tuple[float, float], raised: int) -> None:
    color = _color(curve.color)
    if curve.error is not None:
        axes.errorbar(curve.x, curve.y, curve.error, fmt="o", color=color, markersize=4)
        return
    style = _STYLES[curve.kind]
    axes.plot(curve.x, curve.y, style, color=color, markersize=3, linewidth=1.2)
    if curve.label:
        top = int(np.argmax(np.where(curve.y <= y_range[1], curve.y, -np.inf)))
        place = curve.x[top], curve.y[top]
        near = {"xytext": (0, 3 + raised), "textcoords": "offset points", "ha": "center"}
        axes.annotate(curve.label, place, color=color, **near)


def _draw_discs(figure: Any, panel: DiscPanel, place: tuple[int, int, int]) -> None:
    """Draw discs side by side in the place of one plot."""
    whole = figure.add_subplot(*place)
    whole.set_axis_off()
    whole.set_title(_caption(panel), parse_math=False)
    across = min(len(panel.discs), 3)
    down = -(-len(panel.discs) // across)
    for number, disc in enumerate(panel.discs):
        row, column = divmod(number, across)
        size = 1 / across, 0.8 / down
        axes = whole.inset_axes((column * size[0], 1 - (row + 1) / down, *size))
        axes.set(xlim=(-1, 1), ylim=(-1, 1), aspect="equal", title=_symbols(disc.label))
        axes.set_axis_off()
        ends = {"vmin": -panel.limit, "vmax": panel.limit}
        shown = axes.scatter(disc.x, disc.y, 4, disc.value, cmap="RdBu_r", **ends)
        turn = np.linspace(0, 2 * np.pi, 100)
        for radius in (1 / 3, 2 / 3, 1):
            axes.plot(radius * np.cos(turn), radius * np.sin(turn), color="0.8", linewidth=0.6)
        axes.plot(disc.mirror, 0, "k+")
    figure.colorbar(shown, ax=whole, label="ln(fit/data)", shrink=0.7)


def _caption(panel: AnyPanel) -> str:
    return plain(f"{panel.title} ({panel.remark})" if panel.remark else panel.title)


def _symbols(text: str) -> str:
    return SUBSCRIPT.sub(r"$\1_\2$\3", text)


def _color(color: int | None) -> Any:
    from matplotlib import colormaps

    return "0.2" if color is None else colormaps["viridis"](0.85 * color / (COLORS - 1))
