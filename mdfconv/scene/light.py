"""What an environment map is for conversions: its spectrum, and the best GGX for Beckmann."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from mdfconv.distributions import distribution
from mdfconv.errors import MdfconvError
from mdfconv.fitting.metrics import metric_named
from mdfconv.fitting.metrics.light import LightMetric
from mdfconv.fitting.solve import fit
from mdfconv.light.spectrum import FIRST_OF_LAW, Spectrum, spectrum_of_file
from mdfconv.output.figures import PAGE, encoded, new_figure

SOURCE, TARGET = "beckmann", "ggx"
# What the light's own answer is shown beside.
METRICS = ("energy", "environment", "display")
# The exponents between which lights lie: of a point, and of the softest of eighteen real
# environments, overcast skies and rooms.
SUN, OVERCAST = 0.0, 2.8


@dataclass(frozen=True)
class LightReport:
    """A light, and what it asks for.

    Parameters
    ----------
    spectrum : Spectrum
        C_l.
    conversions : list of dict
        A row for each m_B: ``m_b``, α of the best GGX under the ``light``, the ``ratio`` of
        the two, and that α under each of `METRICS`.
    """

    spectrum: Spectrum
    conversions: list[dict[str, float]] = field(default_factory=list)

    @property
    def softness(self) -> float:
        """Where its exponent lies between that of a sun, 0, and of an overcast sky, 1."""
        return float(np.clip((self.spectrum.exponent - SUN) / (OVERCAST - SUN), 0, 1))

    @property
    def sentence(self) -> str:
        """What the light is, in words."""
        return (
            f"Fine detail: C_l falls like l^−{self.spectrum.exponent:.2f} (l from {FIRST_OF_LAW} "
            f"to {self.spectrum.highest}): {100 * self.softness:.0f} % of the way from a sun "
            f"({SUN:g}) to an overcast sky ({OVERCAST:g}); nature's 1/f² is 2. "
            "It decides for mirrors; for rougher surfaces the whole spectrum does."
        )

    def spectrum_rows(self) -> list[dict[str, Any]]:
        """Return degree, measured C_l and that of the power law, from l = 1."""
        degree = np.arange(1, self.spectrum.highest + 1)
        columns = degree, self.spectrum.power[1:], self.spectrum.law(degree + 0.5)
        return [
            {"l": degree, "c_l": power, "power_law": law}
            for degree, power, law in zip(*(column.tolist() for column in columns), strict=True)
        ]


def light_report(path: str | Path, m_b: Sequence[float]) -> LightReport:
    """Return what an environment map is, and the best GGX for Beckmann under it.

    Parameters
    ----------
    path : str or Path
        The map.
    m_b : sequence of float
        Beckmann's parameters.

    Raises
    ------
    MdfconvError
        As `read_environment_map`, and if an m_B is illegal or has no best GGX.
    """
    source, target = distribution(SOURCE), distribution(TARGET)
    parameter = np.array([source.parameter.check_one(value, SOURCE) for value in m_b])
    spectrum = spectrum_of_file(path)
    metrics = {"light": LightMetric(spectrum)} | {name: metric_named(name) for name in METRICS}
    columns = {"m_b": parameter}
    for name, metric in metrics.items():
        with np.errstate(all="ignore"):
            columns[name] = fit(source, parameter, target, metric).parameter
        if np.isnan(columns[name]).any():
            lost = parameter[int(np.argmax(np.isnan(columns[name])))]
            raise MdfconvError(f"{SOURCE} m_B = {lost:g} has no best {TARGET} under {name}")
    columns["ratio"] = columns["light"] / parameter
    shown = "m_b", "light", "ratio", *METRICS
    rows = zip(*(columns[name].tolist() for name in shown), strict=True)
    return LightReport(spectrum, [dict(zip(shown, row, strict=True)) for row in rows])


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
