"""The contact sheet of Figures 3 to 5."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from mdfconv.brdf.materials import material
from mdfconv.distributions import distribution
from mdfconv.fitting.metrics.display import srgb
from mdfconv.output.figures import encoded, line_style, pyplot
from mdfconv.render.comparison import Comparison, Rendering, Scene
from mdfconv.render.sphere import Frame

_CELL = 1.62  # inches a picture
_PLOT = 2.6
_NARROWEST = 6.4
_LOWEST = 1e-3  # of the reference's peak: where the section is cut off
_BACKGROUND = 0.05  # linear light, so that the silhouette shows


def draw_comparison(comparison: Comparison, dpi: int = 120) -> bytes:
    """Return a PNG: a row of pictures for each conversion, and the sections beneath.

    Parameters
    ----------
    comparison : Comparison
        The pictures.
    dpi : int
        Resolution.
    """
    plt = pyplot()
    rows = list(comparison.rows.items())
    columns = 1 + max(len(renderings) for _, renderings in rows)
    # A pixel of the sheet shows at most a pixel of the picture.
    cell = max(_CELL, comparison.scene.size / dpi)
    width = max(cell * columns + 0.4, _PLOT * len(rows), _NARROWEST)
    height = (cell + 0.42) * len(rows)
    figure = plt.figure(figsize=(width, height + _PLOT + 0.6))
    top, bottom = figure.subfigures(2, 1, height_ratios=(height, _PLOT))
    figure.suptitle(_title(comparison), fontsize=10)
    panels = top.subplots(len(rows), columns, squeeze=False)
    for line, (rule, renderings) in zip(panels, rows, strict=True):
        for axes in line:
            axes.axis("off")
        line[0].text(
            -0.04, 0.5, rule, rotation=90, ha="right", va="center", transform=line[0].transAxes
        )
        for axes, rendering in zip(line, [comparison.reference, *renderings], strict=False):
            _picture(axes, comparison.scene, rendering)
    sections = bottom.subplots(1, len(rows), sharey=True, squeeze=False)[0]
    for axes, (rule, renderings) in zip(sections, rows, strict=True):
        _section(axes, comparison, renderings)
        axes.set_title(rule, fontsize=8)
    sections[0].set_ylabel(f"luminance / peak of {comparison.reference.name}", fontsize=8)
    sections[0].legend(fontsize=6.5, loc="upper left", handlelength=2.4)
    return encoded(figure, dpi=dpi)


def _title(comparison: Comparison) -> str:
    scene, reference = comparison.scene, comparison.reference
    surface = f"{scene.brdf}, {material(scene.material).name}" if scene.material else scene.brdf
    colored = reference.image.ndim == 3
    return (
        f"{reference.name} {_parameter(reference)} and its substitutes: {surface},\n"
        f"{scene.light} light, {'normalized' if scene.normalized else 'unit form'} D, exposure "
        f"{scene.exposure:g} (1: the peak of {reference.name} is "
        f"{'as bright as its colour can be' if colored else 'white'})"
    )


def _parameter(rendering: Rendering) -> str:
    symbol = distribution(rendering.name).parameter.symbol
    return f"{symbol} = {rendering.parameter:.4g}"


def _picture(axes: Any, scene: Scene, rendering: Rendering) -> None:
    coverage = Frame(scene.size).normals()[1].reshape(scene.size, scene.size)
    shown = srgb(scene.exposure * rendering.image + (1 - coverage) * _BACKGROUND)
    # Matplotlib has the channels last; a grey picture has none.
    shown = np.moveaxis(shown, 0, -1) if shown.ndim == 3 else shown
    axes.imshow(shown, cmap="gray", vmin=0, vmax=1, interpolation="antialiased")
    axes.set_title(f"{rendering.name}\n{_parameter(rendering)}", fontsize=7.5, pad=3)


def _section(axes: Any, comparison: Comparison, renderings: Sequence[Rendering]) -> None:
    position, reference = comparison.position, comparison.reference
    seen = position[reference.section > _LOWEST]
    margin = 0.25 * (seen[-1] - seen[0])
    axes.set_xlim(seen[0] - margin, min(seen[-1] + margin, 1))
    for rendering in [reference, *renderings]:
        axes.plot(position, rendering.section, label=rendering.name, **line_style(rendering.name))
    axes.set_xlabel("towards the light [radii]", fontsize=8)
