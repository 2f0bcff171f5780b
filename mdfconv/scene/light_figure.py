"""The picture of a light: its spectrum."""

from __future__ import annotations

import numpy as np

from mdfconv.light.spectrum import FIRST_OF_LAW, Spectrum
from mdfconv.output.figures import PAGE, encoded, new_figure

_GUIDES = ((0.0, "a sun: l⁰", ":"), (2.0, "nature: l⁻²", "--"))


def draw_spectrum(spectrum: Spectrum, title: str, dpi: int = 150) -> bytes:
    """Return a PNG of C_l over l, the power law through it, and those of a sun and of nature.

    Parameters
    ----------
    spectrum : Spectrum
        The light.
    title : str
        What it is.
    dpi : int
        Resolution.
    """
    figure = new_figure(*PAGE)
    panel = figure.subplots()
    degree = np.arange(1, spectrum.highest + 1)
    power = spectrum.power[1:]
    panel.plot(degree, power, color="#0072B2", linewidth=0.9, label="the light")
    beyond = np.geomspace(FIRST_OF_LAW, 8 * spectrum.highest, 100) + 0.5
    law = f"power law: $l^{{{-spectrum.exponent:.2f}}}$"
    panel.plot(beyond - 0.5, spectrum.law(beyond), color="#D55E00", label=law)
    start = spectrum.law(np.array([FIRST_OF_LAW + 0.5]))[0]
    for exponent, label, dashes in _GUIDES:
        guide = start * (degree / FIRST_OF_LAW) ** -exponent
        panel.plot(degree, guide, color="0.5", linestyle=dashes, linewidth=1, label=label)
    measured = f"measured to l = {spectrum.highest}"
    panel.axvline(spectrum.highest, color="0.7", linewidth=0.8, label=measured)
    panel.set(xscale="log", yscale="log", xlabel="degree l", title=title)
    panel.set_ylabel("C_l (4π at l = 0)")
    panel.legend()
    return encoded(figure, dpi=dpi)
