"""The contact sheet of Figures 3 to 5."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mdfconv.brdf.materials import material
from mdfconv.distributions import distribution
from mdfconv.distributions.evaluation import Array
from mdfconv.fitting.metrics.display import srgb
from mdfconv.output.figures import encoded, line_style, new_figure, place_pixels
from mdfconv.render.comparison import Comparison, Rendering
from mdfconv.render.sphere import Frame

# In inches. From the top of the sheet to its bottom: the heading, for each row of pictures the
# caption, the picture and the gap, and the plot with the sections.
_HEADING, _CAPTION, _GAP, _PLOT = 0.6, 0.36, 0.08, 2.6
_PAD = 0.05  # above the heading, and between a caption and its picture
_CELL = 1.9  # a picture, or as near as whole pixels allow
_RULE = 0.3  # left of a row of pictures: its rule
_NARROWEST = 6.4
# From the edges of the plot to its axes.
_LEFT, _RIGHT, _ABOVE, _BENEATH = 0.6, 0.14, 0.4, 0.45
_LOWEST = 1e-3  # of the reference's peak: where the section is cut off
BACKGROUND = 0.05  # linear light, so that the silhouette shows


@dataclass(frozen=True)
class _Layout:
    """Where the pictures are on the sheet, in pixels from its upper left corner.

    All of it is known beforehand. Matplotlib's layout engine would measure every text of dozens
    of axes, which takes several times as long as to draw them.
    """

    rows: int
    columns: int
    size: int
    dpi: int

    @property
    def zoom(self) -> int:
        """How many pixels of the sheet, a side, show a pixel of a picture."""
        return max(1, round(_CELL * self.dpi / self.size))

    @property
    def cell(self) -> int:
        """The side of a picture."""
        return self.zoom * self.size

    @property
    def width(self) -> int:
        """The width of the sheet."""
        pictures = _RULE * self.dpi + self.columns * (self.cell + _GAP * self.dpi)
        return int(np.ceil(max(pictures, self.dpi * max(_PLOT * self.rows, _NARROWEST))))

    @property
    def height(self) -> int:
        """The height of the sheet."""
        return self.top(self.rows) + int((_PLOT - _CAPTION) * self.dpi)

    def top(self, row: int) -> int:
        """Return where the pictures of a row begin."""
        captions = _HEADING + _CAPTION + row * (_CAPTION + _GAP)
        return int(captions * self.dpi) + row * self.cell

    def left(self, column: int) -> int:
        """Return where the pictures of a column begin, each in the middle of its share."""
        share = (self.width - _RULE * self.dpi) / self.columns
        return int(_RULE * self.dpi + (column + 0.5) * share - 0.5 * self.cell)


def draw_comparison(comparison: Comparison, dpi: int = 120) -> bytes:
    """Return a PNG: a row of pictures for each conversion, and the sections beneath.

    Parameters
    ----------
    comparison : Comparison
        The pictures.
    dpi : int
        Resolution.
    """
    columns = 1 + max(len(renderings) for renderings in comparison.rows.values())
    layout = _Layout(len(comparison.rows), columns, comparison.scene.size, dpi)
    # Half a pixel more: the size is rounded down.
    figure = new_figure((layout.width + 0.5) / dpi, (layout.height + 0.5) / dpi, layout=None)
    figure.set_dpi(dpi)
    _draw_pictures(figure, comparison, layout)
    _draw_sections(figure, comparison, layout)
    figure.suptitle(_title(comparison), fontsize=10, y=1 - _PAD * dpi / layout.height)
    return encoded(figure, dpi=dpi)


def _title(comparison: Comparison) -> str:
    scene, reference = comparison.scene, comparison.reference
    reflected = f"{material(scene.material).name}, " if scene.material else ""
    colored = reference.image.ndim == 3
    return (
        f"{reference.name} {_parameter(reference)} and its substitutes\n"
        f"{scene.brdf}, {reflected}{scene.light} light, "
        f"{'normalized' if scene.normalized else 'unit form'} D\n"
        f"exposure {scene.exposure:g} (1: the peak of {reference.name} is "
        f"{'as bright as its colour can be' if colored else 'white'})"
    )


def _parameter(rendering: Rendering) -> str:
    symbol = distribution(rendering.name).parameter.symbol
    return f"{symbol} = {rendering.parameter:.4g}"


def _draw_pictures(figure: Any, comparison: Comparison, layout: _Layout) -> None:
    """Draw the pictures as one image, pixel for pixel, with their captions and rules."""
    sheet = np.full((layout.height, layout.width, 4), 255, np.uint8)
    coverage = Frame(layout.size).normals()[1].reshape(layout.size, layout.size)
    background = (1 - coverage) * BACKGROUND

    def write(x: float, y: float, text: str, **style: Any) -> None:
        figure.text(x / layout.width, 1 - y / layout.height, text, ha="center", **style)

    for row, (rule, renderings) in enumerate(comparison.rows.items()):
        top, bottom = layout.top(row), layout.top(row) + layout.cell
        write(0.5 * _RULE * layout.dpi, 0.5 * (top + bottom), rule, rotation=90, va="center")
        for column, rendering in enumerate([comparison.reference, *renderings]):
            left, right = layout.left(column), layout.left(column) + layout.cell
            caption = f"{rendering.name}\n{_parameter(rendering)}"
            write(0.5 * (left + right), top - _PAD * layout.dpi, caption, va="bottom", fontsize=7.5)
            shown = _bytes(comparison.scene.exposure * rendering.image + background)
            sheet[top:bottom, left:right, :3] = shown.repeat(layout.zoom, 0).repeat(layout.zoom, 1)
    place_pixels(figure, sheet)


def _bytes(light: Array) -> NDArray[np.uint8]:
    """Return linear light as a screen takes it, the channels last; a grey picture has one."""
    encoding = np.rint(255 * srgb(light.astype(np.float32))).astype(np.uint8)
    return np.moveaxis(encoding, 0, -1) if light.ndim == 3 else encoding[..., None]


def _draw_sections(figure: Any, comparison: Comparison, layout: _Layout) -> None:
    """Draw the sections side by side, on one scale."""
    width, height = layout.width / layout.dpi, layout.height / layout.dpi
    sections = figure.subplots(
        1,
        layout.rows,
        sharey=True,
        squeeze=False,
        gridspec_kw={
            "left": _LEFT / width,
            "right": 1 - _RIGHT / width,
            "top": (_PLOT - _ABOVE) / height,
            "bottom": _BENEATH / height,
            "wspace": 0.06,
        },
    )[0]
    for axes, (rule, renderings) in zip(sections, comparison.rows.items(), strict=True):
        _section(axes, comparison, renderings)
        axes.set_title(rule, fontsize=8)
    sections[0].set_ylabel(f"luminance / peak of {comparison.reference.name}", fontsize=8)
    sections[0].legend(fontsize=6.5, loc="upper left", handlelength=2.4)


def _section(axes: Any, comparison: Comparison, renderings: Sequence[Rendering]) -> None:
    position, reference = comparison.position, comparison.reference
    seen = position[reference.section > _LOWEST]
    margin = 0.25 * (seen[-1] - seen[0])
    axes.set_xlim(seen[0] - margin, min(seen[-1] + margin, 1))
    for rendering in [reference, *renderings]:
        axes.plot(position, rendering.section, label=rendering.name, **line_style(rendering.name))
    axes.set_xlabel("towards the light [radii]", fontsize=8)
    # A label at the very end would reach into the next section.
    axes.locator_params(axis="x", prune="both")
