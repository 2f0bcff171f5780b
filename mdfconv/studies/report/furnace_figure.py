"""The white furnace as curves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from mdfconv.output.figures import PAGE, encoded, new_figure

Curves = Mapping[str, Sequence[float]]


def draw_albedo(cosine: Sequence[float], panels: Mapping[str, Curves], dpi: int = 110) -> bytes:
    """Return a figure of albedo over the viewer's cosine.

    Parameters
    ----------
    cosine : sequence of float
        Of the viewer with the normal.
    panels : dict
        From titles to curves, which are from labels to albedos.
    dpi : int
        Resolution.
    """
    rows = (len(panels) + 1) // 2
    columns = min(2, len(panels))
    width = PAGE[0] * (1.45 if columns > 1 else 1)
    figure = new_figure(width, PAGE[1] * 0.72 * rows + 0.6)
    axes = figure.subplots(rows, columns, squeeze=False)
    dashes = ["-", (0, (5, 2)), (0, (5, 2, 1, 2)), (0, (1, 1.5)), (0, (8, 2)), (0, (3, 3))]
    for axis in axes.flat[len(panels) :]:
        axis.set_visible(False)
    for axis, (title, curves) in zip(axes.flat, panels.items(), strict=False):
        for number, (label, albedo) in enumerate(curves.items()):
            axis.plot(
                cosine,
                albedo,
                label=label,
                color=f"C{number}",
                linestyle=dashes[number % len(dashes)],
                linewidth=1.5,
            )
        highest = max(max(albedo) for albedo in curves.values())
        axis.set(xlabel="cos θ of the viewer", ylabel="directional albedo", title=title)
        axis.set(xlim=(0, 1), ylim=(0, min(max(1.05, 1.05 * highest), 1.6)))
        axis.legend(loc="best")
    return encoded(figure, dpi=dpi)
