"""The contact sheet of Figures 3 to 5."""

from __future__ import annotations

from typing import Any

import numpy as np

from mdfconv.distributions import distribution
from mdfconv.distributions.evaluation import Array
from mdfconv.fitting.metrics import srgb
from mdfconv.reports.comparison import Comparison, Rendering
from mdfconv.reports.figures import encoded, line_style, pyplot
from mdfconv.reports.sphere import Frame

_CELL = 1.62  # inches a picture
_PLOT = 2.6
_NARROWEST = 6.4
_LOWEST = 1e-3  # of the reference's peak: where the section is cut off
_BACKGROUND = 0.05  # linear light, so that the silhouette shows


def draw_comparison(found: Comparison, dpi: int = 120) -> bytes:
    """Return a PNG: a row of pictures for each conversion, and the sections beneath.

    Parameters
    ----------
    found : Comparison
        The pictures.
    dpi : int
        Resolution.
    """
    plt = pyplot()
    rows = list(found.rows.items())
    columns = 1 + max(len(renderings) for _, renderings in rows)
    # A pixel of the sheet shows at most a pixel of the picture.
    cell = max(_CELL, found.scene.size / dpi)
    width = max(cell * columns + 0.4, _PLOT * len(rows), _NARROWEST)
    height = (cell + 0.42) * len(rows)
    figure = plt.figure(figsize=(width, height + _PLOT + 0.6))
    top, bottom = figure.subfigures(2, 1, height_ratios=(height, _PLOT))
    scene = found.scene
    surface = f"{scene.brdf}, {scene.material}" if scene.material else scene.brdf
    colored = found.reference.image.ndim == 3
    white = f"1: the peak of Beckmann is {'as bright as its colour can be' if colored else 'white'}"
    figure.suptitle(
        f"Beckmann m_B = {found.reference.parameter:.4g} and its substitutes: {surface},\n"
        f"{scene.light} light, {'normalized' if scene.normalized else 'unit form'} D, exposure "
        f"{scene.exposure:g} ({white})",
        fontsize=10,
    )
    coverage = Frame(scene.size).normals()[1].reshape(scene.size, scene.size)
    panels = top.subplots(len(rows), columns, squeeze=False)
    for line, (rule, renderings) in zip(panels, rows, strict=True):
        for axes in line:
            axes.axis("off")
        _picture(
            line[0], found, coverage, found.reference, f"beckmann\n{found.reference.parameter:.4g}"
        )
        line[0].text(
            -0.04, 0.5, rule, rotation=90, ha="right", va="center", transform=line[0].transAxes
        )
        for axes, entry in zip(line[1:], renderings, strict=False):
            symbol = distribution(entry.name).parameter.symbol
            _picture(
                axes, found, coverage, entry, f"{entry.name}\n{symbol} = {entry.parameter:.4g}"
            )
    sections = bottom.subplots(1, len(rows), sharey=True, squeeze=False)[0]
    for axes, (rule, renderings) in zip(sections, rows, strict=True):
        _section(axes, found, rule, renderings)
    sections[0].set_ylabel("luminance / peak of beckmann", fontsize=8)
    sections[0].legend(fontsize=6.5, loc="upper left", handlelength=2.4)
    return encoded(figure, dpi=dpi)


def _picture(axes: Any, found: Comparison, coverage: Array, entry: Rendering, label: str) -> None:
    shown = srgb(found.scene.exposure * entry.image + (1 - coverage) * _BACKGROUND)
    # Matplotlib has the channels last; a grey picture has none.
    shown = np.moveaxis(shown, 0, -1) if shown.ndim == 3 else shown
    axes.imshow(shown, cmap="gray", vmin=0, vmax=1, interpolation="antialiased")
    axes.set_title(label, fontsize=7.5, pad=3)


def _section(axes: Any, found: Comparison, rule: str, renderings: Any) -> None:
    seen = np.flatnonzero(found.reference.section > _LOWEST)
    margin = 0.25 * (found.position[seen[-1]] - found.position[seen[0]])
    axes.set_xlim(found.position[seen[0]] - margin, min(found.position[seen[-1]] + margin, 1))
    for entry in [found.reference, *renderings]:
        axes.plot(found.position, entry.section, label=entry.name, **line_style(entry.name))
    axes.set_title(rule, fontsize=8)
    axes.set_xlabel("towards the light [radii]", fontsize=8)
