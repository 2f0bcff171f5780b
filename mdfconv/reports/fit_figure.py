"""The picture of fits to measurements of one angle: data, fits, and what they leave."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from mdfconv.measured.lobe_fit import LobeFit
from mdfconv.measured.samples import Samples
from mdfconv.output.figures import PAGE, encoded, line_style, new_figure

_POINTS = 600  # of a curve, one a pixel
# Side by side; pictures of more would be unreadable.
_MOST_CHANNELS = 6


def draw_fits(
    panels: Sequence[tuple[Samples, Sequence[LobeFit], int]],
    title: str,
    *,
    logarithms: bool = False,
) -> bytes:
    """Return a PNG of samples and fits, with the residuals beneath, a column for each panel.

    Parameters
    ----------
    panels : sequence of (Samples, sequence of LobeFit, int)
        The measurements, the fits to them, and which channel is drawn; of many the first six.
    title : str
        What was measured.
    logarithms : bool
        Whether the axis of values is logarithmic and the residuals are those of logarithms, as
        those that the fit minimized.
    """
    panels = panels[:_MOST_CHANNELS]
    figure = new_figure(PAGE[0] * (1 + 0.6 * (len(panels) - 1)), PAGE[1])
    axes = figure.subplots(2, len(panels), sharex=True, height_ratios=(3, 2), squeeze=False)
    for column, (data, fits, channel) in enumerate(panels):
        upper, lower = axes[:, column]
        _draw_channel(upper, lower, data, fits, channel, logarithms=logarithms)
        named = f"{title}, {data.channels[channel]}"
        upper.set_title(title if len(panels) == 1 else named)
        upper.legend(fontsize=8 if len(panels) == 1 else 7)
        lower.set_xlabel("β between normal and half vector [degrees]")
    brdf = panels[0][0].quantity == "brdf"
    axes[0, 0].set_ylabel("BRDF [1/sr]" if brdf else "distribution")
    axes[1, 0].set_ylabel("ln(fit/data)" if logarithms else "fit − data")
    return encoded(figure)


def _draw_channel(
    upper: Any,
    lower: Any,
    data: Samples,
    fits: Sequence[LobeFit],
    channel: int,
    *,
    logarithms: bool,
) -> None:
    degrees, values = np.degrees(data.beta), data.values[:, channel]
    beta = np.linspace(data.beta[0], data.beta[-1], _POINTS)
    upper.plot(degrees, values, "o", color="0.6", markersize=3, label="data")
    for fit in fits:
        style = line_style(fit.distribution.name)
        fitted = fit.distribution.parameters[: len(fit.parameters)]
        numbers = ", ".join(
            f"{parameter.symbol} = {value:.4g}"
            for parameter, value in zip(fitted, fit.parameters, strict=True)
        )
        curve, near = (fit.model(at, data.quantity)[:, channel] for at in (beta, data.beta))
        label = f"{fit.distribution.name}, {numbers}"
        upper.plot(np.degrees(beta), curve, label=label, **style)
        with np.errstate(divide="ignore", invalid="ignore"):
            residual = np.log(near / values) if logarithms else near - values
        lower.plot(degrees, residual, **style)
    if logarithms:
        upper.set_yscale("log", nonpositive="mask")
