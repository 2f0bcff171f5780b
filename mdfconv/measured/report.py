"""The page on a fit to measurements that a colleague can read, in one file."""

from __future__ import annotations

import base64
import html
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mdfconv import __version__
from mdfconv.brdf.microfacet import polar_angle
from mdfconv.conversion import convert
from mdfconv.distributions import Distribution
from mdfconv.distributions.endpoint import Endpoint
from mdfconv.errors import MdfconvError
from mdfconv.measured.analysis import Analysis
from mdfconv.measured.brdf_fit import BrdfFit
from mdfconv.measured.figures import draw_directional, draw_fits, incidences
from mdfconv.measured.lobe_fit import LobeFit
from mdfconv.measured.samples import DirectionalSamples, Samples
from mdfconv.output.files import file_bytes
from mdfconv.output.records import markdown_text

_DIGITS = 6
# What a number is handed on as: to renderers with light from all around.
_METRIC = "environment"


@dataclass(frozen=True)
class FitReport:
    """What a report says.

    Parameters
    ----------
    title : str
        What was measured.
    facts : sequence of str
        What the data are, what was left out and why, and what was assumed.
    rows : sequence of mapping
        The table of fits, best first: text for each column.
    verdict : str
        The distribution that is recommended, and why.
    snippets : mapping of str to str
        The recommended number in the forms of files, by their names.
    pictures : mapping of str to bytes
        PNGs, by what they show.
    command : str
        What makes the page again.
    """

    title: str
    facts: Sequence[str]
    rows: Sequence[Mapping[str, str]]
    verdict: str
    snippets: Mapping[str, str]
    pictures: Mapping[str, bytes]
    command: str


def check_report_name(path: Path) -> None:
    """Raise `MdfconvError` if a report's name ends in neither ``.html`` nor ``.md``."""
    if path.suffix.lower() not in _FORMS:
        raise MdfconvError(f"a report is an .html or a .md file, not {path.name}")


def report_files(report: FitReport, path: Path) -> dict[Path, bytes]:
    """Return the files of a report: one of HTML, or of Markdown with pictures beside it.

    Raises
    ------
    MdfconvError
        As `check_report_name`.
    """
    check_report_name(path)
    return _FORMS[path.suffix.lower()](report, path)


def _page(report: FitReport, path: Path) -> dict[Path, bytes]:
    escape = html.escape
    columns = list(report.rows[0])
    head = "".join(f"<th>{escape(column)}</th>" for column in columns)
    body = "".join(
        f"<tr>{''.join(f'<td>{escape(row[column])}</td>' for column in columns)}</tr>\n"
        for row in report.rows
    )
    facts = "".join(f"<li>{escape(fact)}</li>\n" for fact in report.facts)
    snippets = "".join(
        f"<h3>{escape(name)}</h3>\n<pre>{escape(text)}</pre>\n"
        for name, text in report.snippets.items()
    )
    pictures = "".join(
        f'<h3>{escape(name)}</h3>\n<img alt="{escape(name)}" '
        f'src="data:image/png;base64,{base64.b64encode(data).decode()}">\n'
        for name, data in report.pictures.items()
    )
    page = (
        f'<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta name="viewport" content="width=device-width">\n'
        f"<title>{escape(report.title)}</title>\n<style>{_STYLE}</style>\n</head>\n<body>\n"
        f"<h1>{escape(report.title)}</h1>\n<p><strong>{escape(report.verdict)}</strong></p>\n"
        f"<h2>The data</h2>\n<ul>\n{facts}</ul>\n"
        f"<h2>The fits</h2>\n<div><table><thead><tr>{head}</tr></thead>\n"
        f"<tbody>\n{body}</tbody></table></div>\n"
        f"<h2>The number to use</h2>\n{snippets}<h2>Data and fit</h2>\n{pictures}"
        f"<h2>Made by</h2>\n<pre>{escape(report.command)}</pre>\n<p>mdfconv {__version__}</p>\n"
        "</body>\n</html>"
    )
    return {path: file_bytes(page)}


def snippets_of(mdf: Distribution, parameter: float) -> dict[str, str]:
    """Return a fitted parameter in the forms of files, kept in the light of an environment."""
    own = f"{mdf.label} {mdf.parameter.symbol} = {parameter:.{_DIGITS}g}"
    # A number keeps its γ: the distribution carries it.
    source = Endpoint(mdf)
    try:
        alpha = convert(parameter, source, "ggx", metric=_METRIC)
        exponent = convert(parameter, source, "blinn-phong", metric=_METRIC)
    except MdfconvError as error:
        return {"mdfconv": f"{own}\n{error}"}
    roughness = alpha**0.5
    number, shininess = f"{roughness:.{_DIGITS}g}", f"{exponent:.{_DIGITS}g}"
    return {
        "mdfconv": f"{own}, as ggx:roughness {number} (--metric {_METRIC})",
        "Wavefront MTL": f"Ns {shininess}\nPr {number}",
        "glTF": f'"pbrMetallicRoughness": {{ "roughnessFactor": {number} }}',
        "Mitsuba": '<bsdf type="roughconductor">\n'
        '    <string name="distribution" value="ggx"/>\n'
        f'    <float name="alpha" value="{alpha:.{_DIGITS}g}"/>\n</bsdf>',
    }


def _markdown(report: FitReport, path: Path) -> dict[Path, bytes]:
    files, shown = {}, []
    for name, data in report.pictures.items():
        picture = path.with_name(f"{path.stem}-{re.sub(r'[^0-9A-Za-z]+', '-', name)}.png")
        files[picture] = data
        shown.append(f"### {name}\n\n![{name}]({picture.name})")
    snippets = [f"### {name}\n\n```\n{text}\n```" for name, text in report.snippets.items()]
    parts = [
        f"# {report.title}",
        f"**{report.verdict}**",
        "## The data",
        "\n".join(f"- {fact}" for fact in report.facts),
        "## The fits",
        markdown_text(list(report.rows[0]), list(report.rows)),
        "## The number to use",
        *snippets,
        "## Data and fit",
        *shown,
        f"## Made by\n\n```\n{report.command}\n```\n\nmdfconv {__version__}",
    ]
    return {path: file_bytes("\n\n".join(parts)), **files}


_FORMS = {".html": _page, ".htm": _page, ".md": _markdown}

_STYLE = """
:root { color-scheme: light dark; }
body { font: 16px/1.5 system-ui, sans-serif; max-width: 62rem; margin: 2rem auto; padding: 0 1rem; }
table { border-collapse: collapse; font-size: 0.9rem; }
th, td { border-bottom: 1px solid #8886; padding: 0.2rem 0.6rem; text-align: left; }
div { overflow-x: auto; }
pre { background: #8882; padding: 0.6rem; white-space: pre-wrap; overflow-wrap: anywhere; }
h1 { overflow-wrap: anywhere; }
img { max-width: 100%; height: auto; background: white; }
"""


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
