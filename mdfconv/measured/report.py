"""The page on a fit to measurements that a colleague can read, in one file."""

from __future__ import annotations

import base64
import html
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from mdfconv import __version__
from mdfconv.brdf.microfacet import polar_angle
from mdfconv.conversion import convert
from mdfconv.distributions import Distribution
from mdfconv.distributions.endpoint import Endpoint
from mdfconv.errors import MdfconvError
from mdfconv.measured.analysis import Analysis, ChannelFits
from mdfconv.measured.figures import draw_parts, incidences
from mdfconv.measured.samples import DirectionalSamples
from mdfconv.output.files import file_bytes
from mdfconv.output.records import markdown_text

_DIGITS = 6
# What a number is handed on as: to renderers with light from all around.
_METRIC = "environment"
# Angles of incidence that a sentence can name.
_NAMED = 12


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


@dataclass(frozen=True)
class _Contents:
    """What a report says: the table as text, snippets and PNGs by their names."""

    title: str
    verdict: str
    facts: Sequence[str]
    rows: Sequence[Mapping[str, str]]
    snippets: Mapping[str, str]
    pictures: Mapping[str, bytes]
    command: str


def report_files(
    analysis: Analysis,
    rows: Sequence[Mapping[str, Any]],
    command: str,
    path: Path,
    *,
    chief: Sequence[str],
    logarithms: bool,
) -> dict[Path, bytes]:
    """Return the files of the report on fits: one of HTML, or of Markdown with pictures beside it.

    The rows are the table of fits, lists in it as text, of which those to two directions show the
    `chief` columns; the command is the line that makes the report, and `logarithms` says whether
    the loss is that of logarithms. Raises as `check_report_name`.
    """
    check_report_name(path)
    result = analysis.results[0]
    contents = _Contents(
        title=f"Fits to {analysis.name}",
        verdict=_verdict(result),
        facts=[*_facts(analysis), *analysis.notes],
        rows=_table(rows, chief),
        snippets=_snippets(result.simplest.distribution, result.simplest.parameter),
        pictures=dict(draw_parts(analysis, logarithms=logarithms)),
        command=command,
    )
    return _FORMS[path.suffix.lower()](contents, path)


def check_report_name(path: Path) -> None:
    """Raise `MdfconvError` if a report's name ends in neither ``.html`` nor ``.md``."""
    if path.suffix.lower() not in _FORMS:
        raise MdfconvError(f"a report is an .html or a .md file, not {path.name}")


def _table(rows: Sequence[Mapping[str, Any]], chief: Sequence[str]) -> list[dict[str, str]]:
    """Return the table as text; of fits to two directions the chief columns that say something."""
    names = list(rows[0])
    if "specular" in names:
        names = [name for name in names if name in chief and any(row[name] != "" for row in rows)]
    return [{name: _cell(row[name]) for name in names} for row in rows]


def _cell(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else ""
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _verdict(result: ChannelFits) -> str:
    """Return which distribution is recommended, and why."""
    best, cheap = result.fits[0], result.simplest
    mdf = cheap.distribution
    numbers = f"{mdf.name}, {mdf.parameter.symbol} = {cheap.parameter:.4g}"
    if mdf.second_parameter:
        numbers += f", {mdf.second_parameter.symbol} = {mdf.gamma:.4g}"
    if cheap is best:
        return f"{numbers}: the best fit, error {best.error:.3g}"
    than = f"{best.distribution.name} with {best.error:.3g}"
    return f"{numbers}: error {cheap.error:.3g}, simpler than {than}"


def _facts(analysis: Analysis) -> Iterator[str]:
    samples = analysis.samples
    kind = "channel" if len(samples.channels) == 1 else "channels"
    yield f"{len(samples.values)} samples, {kind} {', '.join(samples.channels)}"
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


def _snippets(mdf: Distribution, parameter: float) -> dict[str, str]:
    """Return a fitted parameter in the forms of files, kept in the light of an environment."""
    own = f"{mdf.label} {mdf.parameter.symbol} = {parameter:.{_DIGITS}g}"
    # A number keeps its γ: the distribution carries it.
    source = Endpoint(mdf)
    try:
        alpha = convert(parameter, source, "ggx", metric=_METRIC)
        exponent = convert(parameter, source, "blinn-phong", metric=_METRIC)
    except MdfconvError as error:
        return {"mdfconv": f"{own}\n{error}"}
    roughness = f"{alpha**0.5:.{_DIGITS}g}"
    return {
        "mdfconv": f"{own}, as ggx:roughness {roughness} (--metric {_METRIC})",
        "Wavefront MTL": f"Ns {exponent:.{_DIGITS}g}\nPr {roughness}",
        "glTF": f'"pbrMetallicRoughness": {{ "roughnessFactor": {roughness} }}',
        "Mitsuba": '<bsdf type="roughconductor">\n'
        '    <string name="distribution" value="ggx"/>\n'
        f'    <float name="alpha" value="{alpha:.{_DIGITS}g}"/>\n</bsdf>',
    }


def _html(report: _Contents, path: Path) -> dict[Path, bytes]:
    escape = html.escape
    head = "".join(f"<th>{escape(column)}</th>" for column in report.rows[0])
    cells = ("".join(f"<td>{escape(cell)}</td>" for cell in row.values()) for row in report.rows)
    body = "".join(f"<tr>{row}</tr>\n" for row in cells)
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


def _markdown(report: _Contents, path: Path) -> dict[Path, bytes]:
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


_FORMS = {".html": _html, ".htm": _html, ".md": _markdown}
