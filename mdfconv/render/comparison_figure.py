"""The contact sheet of Figures 3 to 5: pictures, their differences, sections through the highlight.

Where the highlight is small the pictures show it alone, and the whole sphere stands beneath.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mdfconv.brdf.fresnel import material
from mdfconv.distributions.evaluation import Array
from mdfconv.fitting.metrics.base import srgb
from mdfconv.output.figures import encoded, line_style, new_figure, place_pixels
from mdfconv.render.comparison import Comparison, Rendering
from mdfconv.render.sphere import MARGIN, Frame

# In inches. From the top of the sheet to its bottom: the heading, for each rule the caption, the
# pictures, a gap, the differences and a gap, then the colour bar and the plot with the sections.
_LINE, _CAPTION, _GAP, _BAR, _PLOT = 0.175, 0.36, 0.08, 0.55, 2.85
_PAD = 0.05  # above the heading, and between a caption and its picture
_WHOLE = 0.22  # between a picture and the whole sphere: that one's caption
_CELL = 1.9  # a picture, or as near as whole pixels allow
_RULE = 0.3  # left of a row of pictures: its rule
_NARROWEST, _SECTION = 6.4, 2.6  # a sheet, and each of the plots in it
# From the edges of the plot to its axes.
_LEFT, _RIGHT, _ABOVE, _BENEATH = 0.6, 0.14, 0.65, 0.45
_BAR_WIDTH, _BAR_HEIGHT = 3.2, 0.13
_LOWEST = 1e-3  # of the reference's peak: where the section is cut off
BACKGROUND = 0.05  # linear light, so that the silhouette shows
# Of what is displayed darker and brighter (Okabe and Ito 2008), of white, of the frame around a
# picture that may be white, and of the one around what is enlarged.
_DARKER, _BRIGHTER, _WHITE = (np.array(c) for c in ((0, 114, 178), (213, 94, 0), (255, 255, 255)))
_FRAME, _ENLARGED = (190, 190, 190), (230, 159, 0)
# A difference of less than this is none on a screen.
_LEAST_SCALE = 1 / 255


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
    heading: float
    between: float

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
        return int(np.ceil(max(pictures, self.dpi * max(_SECTION * self.rows, _NARROWEST))))

    @property
    def height(self) -> int:
        """The height of the sheet."""
        return self.bar + int((_BAR + _PLOT) * self.dpi)

    @property
    def bar(self) -> int:
        """Where the strip of the colour bar begins."""
        return self.top(self.rows) - int(_CAPTION * self.dpi)

    def top(self, row: int) -> int:
        """Return where the pictures of a rule begin."""
        captions = self.heading + _CAPTION + row * (_CAPTION + self.between + _GAP)
        return int(captions * self.dpi) + 2 * row * self.cell

    def beneath(self, row: int) -> int:
        """Return where the differences of a rule begin."""
        return self.top(row) + self.cell + int(self.between * self.dpi)

    def left(self, column: int) -> int:
        """Return where the pictures of a column begin, each in the middle of its share."""
        share = (self.width - _RULE * self.dpi) / self.columns
        return int(_RULE * self.dpi + (column + 0.5) * share - 0.5 * self.cell)


def draw_comparison(comparison: Comparison, dpi: int = 120) -> bytes:
    """Return a PNG: for each conversion pictures and differences, and the sections beneath.

    Parameters
    ----------
    comparison : Comparison
        The pictures.
    dpi : int
        Resolution.
    """
    columns = 1 + max(len(renderings) for renderings in comparison.rows.values())
    title = _title(comparison)
    layout = _Layout(
        len(comparison.rows),
        columns,
        comparison.scene.size,
        dpi,
        heading=_LINE * (1 + title.count("\n")) + 2 * _PAD,
        between=_WHOLE if comparison.magnification > 1 else _GAP,
    )
    # Half a pixel more: the size is rounded down.
    figure = new_figure((layout.width + 0.5) / dpi, (layout.height + 0.5) / dpi, layout=None)
    figure.set_dpi(dpi)
    sheet = _Sheet(figure, layout)
    _draw_pictures(sheet, comparison)
    _draw_differences(sheet, comparison)
    place_pixels(figure, sheet.pixels)
    _draw_sections(figure, comparison, layout)
    figure.suptitle(title, fontsize=10, y=1 - _PAD * dpi / layout.height)
    return encoded(figure, dpi=dpi)


def _title(comparison: Comparison) -> str:
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


class _Sheet:
    """The pixels of the sheet, and texts beside them."""

    def __init__(self, figure: Any, layout: _Layout) -> None:
        self.figure, self.layout = figure, layout
        self.pixels = np.full((layout.height, layout.width, 4), 255, np.uint8)

    def write(self, x: float, y: float, text: str, **style: Any) -> None:
        """Write a text around a pixel."""
        place = x / self.layout.width, 1 - y / self.layout.height
        self.figure.text(*place, text, ha="center", **style)

    def write_rule(self, top: int, text: str) -> None:
        """Write a text upwards, left of a row of pictures."""
        middle = 0.5 * _RULE * self.layout.dpi, top + 0.5 * self.layout.cell
        self.write(*middle, text, rotation=90, va="center")

    def write_caption(self, column: int, top: int, text: str) -> None:
        """Write a text above a picture."""
        middle = self.layout.left(column) + 0.5 * self.layout.cell
        self.write(middle, top - _PAD * self.layout.dpi, text, va="bottom", fontsize=7.5)

    def place(self, column: int, top: int, picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Put a picture into a column; return its pixels on the sheet."""
        left, side, zoom = self.layout.left(column), self.layout.cell, self.layout.zoom
        cell = self.pixels[top : top + side, left : left + side, :3]
        cell[...] = picture.repeat(zoom, 0).repeat(zoom, 1)
        return cell


def _draw_pictures(sheet: _Sheet, comparison: Comparison) -> None:
    """Draw the pictures, with their captions and rules, and the sphere of which they are a part."""
    layout, scene = sheet.layout, comparison.scene
    closeup, whole = (_background(frame) for frame in (comparison.frame, Frame(layout.size)))
    for row, (rule, renderings) in enumerate(comparison.rows.items()):
        top = layout.top(row)
        sheet.write_rule(top, rule)
        for column, rendering in enumerate([comparison.reference, *renderings]):
            sheet.write_caption(column, top, f"{rendering.name}\n{rendering.value_text}")
            sheet.place(column, top, _bytes(scene.exposure * rendering.closeup + closeup))
        if comparison.magnification > 1:
            top = layout.beneath(row)
            sheet.write_caption(0, top, "the whole sphere")
            picture = _bytes(scene.exposure * comparison.reference.image + whole)
            _outline(sheet.place(0, top, picture), _ENLARGED, *_square(comparison.frame, layout))


def _background(frame: Frame) -> Array:
    """Return the light around the sphere."""
    return (1 - frame.normals()[1].reshape(frame.size, frame.size)) * BACKGROUND


def _square(frame: Frame, layout: _Layout) -> tuple[slice, slice]:
    """Return where on a picture of the whole sphere another frame is."""
    x, y = frame.centre
    pixels = layout.cell / (2 * MARGIN)
    least, count = np.array([MARGIN - y, MARGIN + x]) - frame.half, 2 * frame.half * pixels
    rows, columns = (
        slice(max(0, int(start)), int(np.ceil(start + count)) + 1) for start in pixels * least
    )
    return rows, columns


def _outline(
    cell: NDArray[np.uint8],
    color: tuple[int, int, int],
    rows: slice = slice(None),
    columns: slice = slice(None),
) -> None:
    """Draw a line, a pixel wide, around a part of a picture."""
    part = cell[rows, columns]
    for edge in (part[0], part[-1], part[:, 0], part[:, -1]):
        edge[...] = color


def _draw_differences(sheet: _Sheet, comparison: Comparison) -> None:
    """Draw how much brighter or darker than the reference each substitute is, and the scale."""
    differences = {
        rule: [comparison.difference(rendering) for rendering in renderings]
        for rule, renderings in comparison.rows.items()
    }
    scale = _scale(max(np.abs(one).max() for ones in differences.values() for one in ones))
    for row, ones in enumerate(differences.values()):
        top = sheet.layout.beneath(row)
        sheet.write_rule(top, "difference")
        for column, difference in enumerate(ones, start=1):
            _outline(sheet.place(column, top, _diverging(difference / scale)), _FRAME)
    _draw_bar(sheet, scale, comparison.reference)


def _scale(largest: float) -> float:
    """Return a number of one digit, at least as large as the largest difference."""
    largest = max(largest, _LEAST_SCALE)
    power = 10.0 ** np.floor(np.log10(largest))
    return float(np.ceil(largest / power) * power)


def _diverging(share: Array) -> NDArray[np.uint8]:
    """Return colours of −1, darker, to 1, brighter; 0 is white."""
    end = np.where(share[..., None] < 0, _DARKER, _BRIGHTER)
    return np.rint(_WHITE + np.abs(share)[..., None] * (end - _WHITE)).astype(np.uint8)


def _draw_bar(sheet: _Sheet, scale: float, reference: Rendering) -> None:
    """Draw the colour bar of all differences, in the middle of its strip."""
    layout = sheet.layout
    half, height = int(0.5 * _BAR_WIDTH * layout.dpi), int(_BAR_HEIGHT * layout.dpi)
    middle, top = layout.width // 2, layout.bar + int(0.06 * layout.dpi)
    shares = np.linspace(-1, 1, 2 * half)[None, :].repeat(height, 0)
    cell = sheet.pixels[top : top + height, middle - half : middle + half, :3]
    cell[...] = _diverging(shares)
    _outline(cell, _FRAME)
    beneath = top + height + 0.03 * layout.dpi
    for share in (-1.0, -0.5, 0.0, 0.5, 1.0):
        text = f"{share * scale:+g}".replace("-", "−") if share else "0"
        sheet.write(middle + share * half, beneath, text, va="top", fontsize=7.5)
    what = "what is displayed, minus that of the source (0 is black, 1 white)"
    if reference.image.ndim == 3:
        what = f"{what}, in the channel that differs most"
    sheet.write(middle, beneath + 0.14 * layout.dpi, what, va="top", fontsize=7.5)


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
    sections[0].set_ylabel("luminance / source's peak", fontsize=8)
    handles, names = sections[0].get_legend_handles_labels()
    style = {"fontsize": 7.5, "ncols": layout.columns, "handlelength": 2.4, "borderaxespad": 0}
    place = (0.5, _PLOT / height)
    figure.legend(handles, names, loc="upper center", bbox_to_anchor=place, **style)


def _section(axes: Any, comparison: Comparison, renderings: Sequence[Rendering]) -> None:
    position, reference = comparison.position, comparison.reference
    seen = position[reference.section > _LOWEST]
    margin = 0.25 * (seen[-1] - seen[0])
    axes.set_xlim(seen[0] - margin, min(seen[-1] + margin, 1))
    for rendering in [reference, *renderings]:
        style = line_style(rendering.end.distribution.name)
        axes.plot(position, rendering.section, label=rendering.name, **style)
    axes.set_xlabel("towards the light [radii]", fontsize=8)
    # A label at the very end would reach into the next section.
    axes.locator_params(axis="x", prune="both")
