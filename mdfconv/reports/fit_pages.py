"""Pictures and reports of what was fitted to a file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from mdfconv.brdf.directions import polar_angle
from mdfconv.measured.analysis import Analysis
from mdfconv.measured.brdf_fit import BrdfFit
from mdfconv.measured.directional import DirectionalSamples
from mdfconv.measured.lobe_fit import LobeFit
from mdfconv.measured.samples import Samples
from mdfconv.reports.directional_figure import draw_directional, incidences
from mdfconv.reports.fit_figure import draw_fits
from mdfconv.reports.fit_report import FitReport, snippets_of

# Angles of incidence that a sentence can name.
_NAMED = 12


def draw_analysis(analysis: Analysis, *, logarithms: bool) -> bytes:
    """Return a PNG of every channel and the fits to it; residuals as the loss has them."""
    directional, lobes = _panels(analysis)
    if directional:
        return draw_directional(directional, analysis.name, logarithms=logarithms)
    return draw_fits(lobes, analysis.name, logarithms=logarithms)


def _panels(
    analysis: Analysis,
) -> tuple[list[tuple[DirectionalSamples, BrdfFit, int]], list[tuple[Samples, list[LobeFit], int]]]:
    """Return what is drawn: each channel with its fits, of two directions with the best."""
    directional, lobes = [], []
    for result in analysis.results:
        best = result.fits[0]
        for channel in range(len(result.samples.channels)):
            if isinstance(result.samples, DirectionalSamples):
                assert isinstance(best, BrdfFit)
                directional.append((result.samples, best, channel))
            else:
                fits = [fit for fit in result.fits if isinstance(fit, LobeFit)]
                lobes.append((result.samples, fits, channel))
    return directional, lobes


def report_of(
    analysis: Analysis, rows: Sequence[Mapping[str, str]], command: str, *, logarithms: bool
) -> FitReport:
    """Return the report on the fits to a file.

    Parameters
    ----------
    analysis : Analysis
        The fits.
    rows : sequence of mapping
        The table of fits as text.
    command : str
        The line that makes the report.
    logarithms : bool
        Whether the loss is that of logarithms.
    """
    result = analysis.results[0]
    best, cheap = result.fits[0], result.simplest
    first = cheap.distribution.parameter
    value = cheap.parameters[first.name] if isinstance(cheap, BrdfFit) else cheap.parameters[0]
    verdict = f"{cheap.distribution.name}, {first.symbol} = {value:.4g}"
    if cheap.distribution.second_parameter:
        verdict += (
            f", {cheap.distribution.second_parameter.symbol} = {cheap.distribution.gamma:.4g}"
        )
    if cheap is best:
        verdict += f": the best fit, error {best.error:.3g}"
    else:
        verdict += (
            f": error {cheap.error:.3g}, simpler than {best.distribution.name} with "
            f"{best.error:.3g}"
        )
    return FitReport(
        title=f"Fits to {analysis.name}",
        facts=[*_facts(analysis), *analysis.notes],
        rows=rows,
        verdict=verdict,
        snippets=snippets_of(cheap.distribution, value),
        pictures=dict(_pictures(analysis, logarithms=logarithms)),
        command=command,
    )


def _facts(analysis: Analysis) -> Iterator[str]:
    samples = analysis.samples
    channels = ", ".join(samples.channels)
    kind = "channel" if len(samples.channels) == 1 else "channels"
    yield f"{len(samples.values)} samples, {kind} {channels}"
    if isinstance(samples, DirectionalSamples):
        angles = incidences(samples)
        if angles.size <= _NAMED:
            yield f"angles of incidence {', '.join(f'{angle:.3g}°' for angle in angles)}"
        else:
            yield f"{angles.size} angles of incidence, {angles[0]:.3g}° to {angles[-1]:.3g}°"
        reflected = np.degrees(polar_angle(samples.outgoing))
        yield f"angles of reflection up to {reflected.max():.3g}°"
    else:
        low, high = np.degrees(samples.beta[[0, -1]])
        yield f"half vectors {low:.3g}° to {high:.3g}° from the normal"
    yield f"values from {samples.values.min():.3g} to {samples.values.max():.3g}"


def _pictures(analysis: Analysis, *, logarithms: bool) -> Iterator[tuple[str, bytes]]:
    directional, lobes = _panels(analysis)
    for panel in directional:
        name = f"channel {panel[0].channels[panel[2]]}"
        yield name, draw_directional([panel], analysis.name, logarithms=logarithms)
    for kind in (False, True) if lobes else ():
        title = "logarithmic" if kind else "linear"
        yield title, draw_fits(lobes, analysis.name, logarithms=kind)
