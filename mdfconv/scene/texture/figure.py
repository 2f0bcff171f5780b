"""The picture of a converted texture: how its values were spread, and are."""

from __future__ import annotations

import numpy as np

from mdfconv.output.figures import PAGE, encoded, line_style, new_figure
from mdfconv.scene.texture.texel_map import BINS, TextureReport


def draw_histograms(report: TextureReport, title: str, dpi: int = 150) -> bytes:
    """Return a PNG of the stored values before and after, as shares of the texels.

    Parameters
    ----------
    report : TextureReport
        What the conversion did.
    title : str
        What was converted.
    dpi : int
        Resolution.
    """
    figure = new_figure(*PAGE)
    panels = figure.subplots(2, 1, sharex=True, sharey=True)
    edges = np.linspace(0, 1, BINS + 1)
    histograms = (report.source, report.before), (report.target, report.after)
    for panel, (name, counts) in zip(panels, histograms, strict=True):
        color = line_style(name.partition(":")[0])["color"]
        shares = 100 * counts / max(1, counts.sum())
        panel.stairs(shares, edges, fill=True, color=color, alpha=0.35)
        panel.stairs(shares, edges, color=color, linewidth=1)
        panel.set_ylabel("texels [%]")
        panel.set_xlabel(f"stored value, {name}")
        panel.tick_params(labelbottom=True)
    # A texture of few values has spikes; a root shows what is between them.
    panels[0].set_yscale("function", functions=(np.sqrt, np.square))
    panels[0].set_xlim(0, 1)
    panels[0].set_title(title)
    return encoded(figure, dpi=dpi)
