"""The picture of a fit to measurements: data, fits, and what they leave."""

from __future__ import annotations

import numpy as np

from mdfconv.measured.lobe_fit import LobeFit
from mdfconv.measured.samples import Samples
from mdfconv.output.figures import PAGE, encoded, line_style, new_figure

_POINTS = 600  # of a curve, one a pixel


def draw_fits(data: Samples, fits: list[LobeFit], title: str) -> bytes:
    """Return a PNG of samples and fits, with the residuals beneath.

    Parameters
    ----------
    data : Samples
        The measurements; of several channels the first is drawn.
    fits : list of LobeFit
        The fits, best first.
    title : str
        What was measured.
    """
    figure = new_figure(*PAGE)
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
    degrees = np.degrees(data.beta)
    beta = np.linspace(data.beta[0], data.beta[-1], _POINTS)
    upper.plot(degrees, data.values[:, 0], "o", color="0.6", markersize=3, label="data")
    for fit in fits:
        style = line_style(fit.distribution.name)
        fitted = fit.distribution.parameters[: len(fit.parameters)]
        values = ", ".join(
            f"{parameter.symbol} = {value:.4g}"
            for parameter, value in zip(fitted, fit.parameters, strict=True)
        )
        label = f"{fit.distribution.name}, {values}"
        upper.plot(np.degrees(beta), fit.model(beta, data.quantity)[:, 0], label=label, **style)
        residuals = fit.model(data.beta, data.quantity)[:, 0] - data.values[:, 0]
        lower.plot(degrees, residuals, **style)
    upper.set_title(title)
    upper.set_ylabel("BRDF [1/sr]" if data.quantity == "brdf" else "distribution")
    upper.legend(fontsize=8)
    lower.set_ylabel("fit − data")
    lower.set_xlabel("β between normal and half vector [degrees]")
    return encoded(figure)
