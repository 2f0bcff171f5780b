"""The contact sheet of Figures 3 to 5: pictures, their differences, sections through the highlight.

Where the highlight is small the pictures show it alone, and the whole sphere stands beneath.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from mdfconv.brdf.fresnel import material
from mdfconv.distributions.evaluation import Array
from mdfconv.fitting.metrics.base import srgb
from mdfconv.output.figures import encoded, line_style, new_figure
from mdfconv.render.comparison import PictureComparison, Rendering
from mdfconv.render.sphere import MARGIN, Frame

# In inches: a picture, which is larger where it has more pixels, what its caption above and the
# rule on the left take, the strip of the colour bar, a section, and a line of the title.
_PICTURE = 1.9
_CAPTION, _RULE = 0.38, 0.3
_BAR_HEIGHT = 0.6
_SECTION_WIDTH, _SECTION_HEIGHT = 2.6, 2.6
_LINE_HEIGHT = 0.19
_NARROWEST_SHEET = 6.4
# Between pictures, by their width.
_GAP = 0.04
_FONT = 7.5
# Of the reference's peak: where the section is cut off.
_LOWEST = 1e-3
# Linear light around the sphere, so that the silhouette shows.
BACKGROUND = 0.05
# What is displayed darker and brighter (Okabe and Ito 2008), and the same.
_DARKER, _BRIGHTER, _SAME = np.array([(0, 114, 178), (213, 94, 0), (255, 255, 255)])
_FRAME_COLOR, _ENLARGED_COLOR = "0.75", "#e69f00"
# A difference of less than this is none on a screen.
_LEAST_SCALE = 1 / 255

# Left, lower edge, width and height.
Bounds: TypeAlias = tuple[float, float, float, float]


def draw_comparison(comparison: PictureComparison, dpi: int = 120) -> bytes:
    """Return a PNG: for each conversion pictures and differences, and the sections beneath."""
    rules, columns = len(comparison.rows), 1 + max(map(len, comparison.rows.values()))
    side = max(_PICTURE, comparison.scene.size / dpi)
    title = _title(comparison)
    width = max(_RULE + columns * (1 + _GAP) * side, rules * _SECTION_WIDTH, _NARROWEST_SHEET)
    heights = [2 * rules * (side + _CAPTION), _BAR_HEIGHT, _SECTION_HEIGHT]
    # The legend takes a line, too.
    figure = new_figure(width, sum(heights) + _LINE_HEIGHT * (title.count("\n") + 2))
    figure.suptitle(title, fontsize=10)
    parts = figure.add_gridspec(3, 1, height_ratios=heights)
    table = _PictureTable(figure.add_subplot(parts[0]), 2 * rules, columns, side)
    _draw_pictures(table, comparison)
    scale = _draw_differences(table, comparison)
    # It ends where its axes end: the layout need not look at dozens of pictures and texts.
    for artist in table.axes.get_children():
        artist.set_in_layout(False)
    _draw_bar(figure.add_subplot(parts[1].subgridspec(1, 3)[1]), scale, comparison.reference)
    plots = parts[2].subgridspec(1, rules).subplots(sharey=True, squeeze=False)[0]
    _draw_sections(plots, comparison)
    figure.legend(
        *plots[0].get_legend_handles_labels(),
        loc="outside lower center",
        ncols=columns,
        fontsize=_FONT,
        handlelength=2.4,
    )
    return encoded(figure, dpi=dpi)


def _title(comparison: PictureComparison) -> str:
    scene, reference = comparison.scene, comparison.reference
    reflected = f"{material(scene.material).name}, " if scene.material else ""
    colored = reference.image.ndim == 3
    lines = [
        f"{reference.name} {reference.value_text} and its substitutes",
        f"{scene.brdf}, {reflected}{scene.light} light, "
        f"{'normalized' if scene.normalized else 'unit form'} D",
        f"exposure {scene.exposure:g} (1: the source's peak is "
        f"{'as bright as its colour can be' if colored else 'white'})",
    ]
    if comparison.magnification > 1:
        lines.append(f"the highlight, enlarged ×{comparison.magnification}")
    return "\n".join(lines)


class _PictureTable:
    """Square pictures in rows and columns, in axes whose unit is their side.

    Axes for each of dozens of pictures would take several times as long.
    """

    def __init__(self, axes: Any, rows: int, columns: int, side: float) -> None:
        self.axes, self._caption, self._rule = axes, _CAPTION / side, _RULE / side
        axes.set_xlim(-self._rule, columns * (1 + _GAP) - _GAP)
        axes.set_ylim(-rows * (1 + self._caption), 0)
        axes.axis("off")

    def show(self, row: int, column: int, picture: NDArray[Any], caption: str = "") -> Bounds:
        """Show an RGB picture; return the left, lower edges and the sides of its place."""
        left, lower = column * (1 + _GAP), -(row + 1) * (1 + self._caption)
        self.axes.imshow(picture, extent=(left, left + 1, lower, lower + 1))
        self.axes.text(left + 0.5, lower + 1.02, caption, ha="center", va="bottom", fontsize=_FONT)
        return left, lower, 1, 1

    def name_row(self, row: int, text: str) -> None:
        """Write upwards, left of a row, what it shows."""
        middle = 0.5 - (row + 1) * (1 + self._caption)
        self.axes.text(-0.5 * self._rule, middle, text, rotation=90, ha="center", va="center")

    def outline(self, bounds: Bounds, color: str) -> None:
        """Draw a line around a part."""
        self.axes.indicate_inset(bounds, edgecolor=color, alpha=1)


def _draw_pictures(table: _PictureTable, comparison: PictureComparison) -> None:
    """Draw a row of pictures for each rule."""
    background = _background(comparison.frame)
    for rule_number, (rule, renderings) in enumerate(comparison.rows.items()):
        table.name_row(2 * rule_number, rule)
        for column, rendering in enumerate([comparison.reference, *renderings]):
            light = comparison.scene.exposure * rendering.closeup + background
            caption = f"{rendering.name}\n{rendering.value_text}"
            table.show(2 * rule_number, column, displayed_pixels(light), caption)


def _draw_differences(table: _PictureTable, comparison: PictureComparison) -> float:
    """Draw how much brighter or darker than the reference each is; return what the colours end at.

    The place beneath the reference shows the sphere of which the pictures are a part.
    """
    differences = [[*map(comparison.difference, row)] for row in comparison.rows.values()]
    scale = _round_up(max(np.abs(one).max() for row in differences for one in row))
    light = comparison.scene.exposure * comparison.reference.image
    sphere = displayed_pixels(light + _background(Frame(comparison.scene.size)))
    for rule_number, shown in enumerate(differences):
        row = 2 * rule_number + 1
        table.name_row(row, "difference")
        for column, difference in enumerate(shown, start=1):
            table.outline(table.show(row, column, _diverging(difference / scale)), _FRAME_COLOR)
        if comparison.magnification > 1:
            left, lower, _, _ = table.show(row, 0, sphere, "the whole sphere")
            x, y = (0.5 * (1 + place / MARGIN) for place in comparison.frame.centre)
            side = comparison.frame.half / MARGIN
            enlarged = (left + x - 0.5 * side, lower + y - 0.5 * side, side, side)
            table.outline(enlarged, _ENLARGED_COLOR)
    return scale


def _background(frame: Frame) -> Array:
    """Return the light around the sphere."""
    return (1 - frame.normals()[1].reshape(frame.size, frame.size)) * BACKGROUND


def displayed_pixels(light: Array) -> NDArray[np.uint8]:
    """Return linear light, grey or in colour, as a screen takes it, the channels last."""
    encoding = np.rint(255 * srgb(light.astype(np.float32))).astype(np.uint8)
    return np.moveaxis(np.broadcast_to(encoding, (3, *light.shape[-2:])), 0, -1)


def _round_up(largest: float) -> float:
    """Return a number of one digit, at least as large as the largest difference."""
    largest = max(largest, _LEAST_SCALE)
    power = 10.0 ** np.floor(np.log10(largest))
    return float(np.ceil(largest / power) * power)


def _diverging(share: Array) -> NDArray[np.uint8]:
    """Return colours of −1, darker, to 1, brighter; 0 is white."""
    end = np.where(share[..., None] < 0, _DARKER, _BRIGHTER)
    return np.rint(_SAME + np.abs(share)[..., None] * (end - _SAME)).astype(np.uint8)


def _draw_bar(axes: Any, scale: float, reference: Rendering) -> None:
    """Draw the colour bar of all differences."""
    label = "what is displayed, minus that of the source (0 is black, 1 white)"
    if reference.image.ndim == 3:
        label += ", in the channel that differs most"
    colors = _diverging(np.linspace(-1, 1, 513)[None, :])
    axes.imshow(colors, extent=(-scale, scale, 0, 1), aspect="auto")
    axes.set(yticks=[], xticks=np.linspace(-scale, scale, 5))
    axes.grid(visible=False)
    axes.tick_params(labelsize=_FONT)
    axes.set_xlabel(label, fontsize=_FONT)


def _draw_sections(axes: Sequence[Any], comparison: PictureComparison) -> None:
    """Draw the luminance through the highlight for each rule, on one scale."""
    position, reference = comparison.position, comparison.reference
    seen = position[reference.section > _LOWEST]
    margin = 0.25 * (seen[-1] - seen[0])
    for place, (rule, renderings) in zip(axes, comparison.rows.items(), strict=True):
        for rendering in [reference, *renderings]:
            style = line_style(rendering.end.distribution.name)
            place.plot(position, rendering.section, label=rendering.name, **style)
        place.set_xlim(seen[0] - margin, min(seen[-1] + margin, 1))
        place.set_title(rule, fontsize=8)
        place.set_xlabel("towards the light [radii]", fontsize=8)
        # A label at the very end would reach into the next section.
        place.locator_params(axis="x", prune="both")
    axes[0].set_ylabel("luminance / source's peak", fontsize=8)
