"""What a report says of a fit, as text and tables, whatever form they are written in."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from itertools import zip_longest
from typing import Any

import numpy as np

from mdfconv.fitting.metrics.base import srgb
from mdfconv.measured.analysis import Analysis, ChannelFits
from mdfconv.measured.brdf_fit import MeasuredFit
from mdfconv.measured.materials import Snippet, snippets
from mdfconv.measured.panels import AnyPanel, panels, runner_up
from mdfconv.measured.samples import DirectionalSamples, wavelengths_of
from mdfconv.output.records import percent, with_error

# Candidates that a reader compares.
_MOST_CANDIDATES = 5
# Channels that a cell has numbers of; of more it has their range.
_MOST_CHANNELS = 3
# Names of channels that are colours.
_COLORS = (["r", "g", "b"], ["red", "green", "blue"])
# The stored form whose number renderers call roughness.
_ROUGHNESS = "roughness"
# Of its slope, relative.
_STEP = 1e-6
GRADE_MARKS = {"good": "✓", "usable": "⚠", "poor": "✗"}

_FORMULAS = {
    "brdf": (
        "<i>f</i><sub>r</sub> = <i>k</i><sub>d</sub>/π + <i>k</i><sub>s</sub> "
        "<i>D</i>(θ<sub>h</sub>) <i>G</i>(θ<sub>i</sub>, θ<sub>o</sub>) <i>F</i>(θ<sub>d</sub>) "
        "/ (4 cos θ<sub>i</sub> cos θ<sub>o</sub>)"
    ),
    "slice": "<i>f</i><sub>r</sub> = offset + scale · <i>D</i>(β) / (<i>D</i>(0) cos²β)",
    "ndf": "offset + scale · <i>D</i>(β) / <i>D</i>(0)",
}
_LOSSES = {
    "log": "differences of logarithms",
    "linear": "differences of values",
    "cosine": "differences of f_r cos θ_i cos θ_o (Löw et al. 2012)",
    "cube-root": "differences of the cube root of f_r cos θ_o (Bieron & Peers 2020)",
}
# Of the error of a loss; that of others is in the unit of what they compare.
_ERROR_UNITS = {"log": "%", "sigma": "σ"}
_MASKINGS = {
    "smith": "Smith, height-correlated (Heitz 2014), for every distribution",
    "v-cavity": "V-cavity (Torrance & Sparrow 1967)",
    "none": "none, G = 1",
}
_FRESNELS = {
    "dielectric": "exact, of a dielectric whose index n is fitted",
    "metal": "Schlick 1994, with F₀ fitted in each channel",
    "none": "none, F = 1, and k_s is fitted",
}
_SOLVER = (
    "are solved for, none below 0 (variable projection, Golub & Pereyra 1973); other parameters "
    "are searched from several starts (Levenberg & Marquardt)"
)


@dataclass(frozen=True)
class Quantity:
    """A number that a renderer needs: what it is, itself with its error, and more in brackets."""

    label: str
    text: str
    detail: str = ""
    swatch: str = ""


@dataclass(frozen=True)
class ReportTable:
    """A table of text; one of its rows may be bold."""

    columns: Sequence[str]
    rows: Sequence[Sequence[str]]
    bold: int | None = None


@dataclass(frozen=True)
class Contents:
    """What a report says of one result."""

    result: ChannelFits
    title: str
    about: Sequence[str]
    numbers: Sequence[Quantity]
    precision: str
    legend: str
    plots: Sequence[AnyPanel]
    candidates: ReportTable
    why: str
    choices: ReportTable
    spectrum: ReportTable | None
    snippets: Sequence[Snippet]
    formula: str
    method: Sequence[tuple[str, str]]
    command: str
    correlation: ReportTable | None


def contents_of(analysis: Analysis, result: ChannelFits, command: str, digest: str) -> Contents:
    """Return what the report says of one result of an analysis."""
    channels = result.samples.channels
    alone = len(analysis.results) == 1
    fit = result.recommended
    return Contents(
        result=result,
        title=analysis.name if alone else f"{analysis.name}, channel {channels[0]}",
        about=(*analysis.samples.about, _size(result)),
        numbers=list(_numbers(fit, channels)),
        precision=_precision(result),
        legend=_legend(result),
        plots=list(panels(result)),
        candidates=_candidates(result),
        why=_why(result),
        choices=_choices(result),
        spectrum=_spectrum(fit, channels),
        snippets=snippets(fit, channels),
        formula=_FORMULAS[_kind(result)],
        method=list(_method(analysis, result, digest)),
        command=command,
        correlation=_correlation(fit),
    )


def overview(articles: Sequence[Contents]) -> ReportTable:
    """Return a table with a row for each result."""
    rows = []
    for article in articles:
        result = article.result
        fit, grade = result.recommended, result.verdict.grade
        roughness = _roughness(fit)
        own, *rest = _main(fit, result.samples.channels)
        rows.append(
            [
                article.title,
                f"{GRADE_MARKS[grade]} {grade}",
                fit.label,
                roughness,
                "" if roughness else own,
                *rest,
                percent(result.error, is_aligned=True),
            ]
        )
    columns = ["file", "verdict", "shape", "roughness", *_MAIN, "error"]
    return _without_empty(ReportTable(columns, rows))


def record(analysis: Analysis, digest: str) -> dict[str, Any]:
    """Return an analysis as a record for machines."""
    return {
        "file": analysis.name,
        "sha256": digest,
        "about": list(analysis.samples.about),
        "notes": list(analysis.notes),
        "settings": asdict(analysis.settings),
        "results": [_result_record(result) for result in analysis.results],
    }


def _result_record(result: ChannelFits) -> dict[str, Any]:
    fit = result.recommended
    return {
        "channels": list(result.samples.channels),
        "samples": len(result.samples.values),
        "noise": result.noise,
        "verdict": asdict(result.verdict),
        "checks": [asdict(check) for check in result.checks],
        "fits": result.records(),
        "by_incidence": [asdict(one) for one in result.by_incidence],
        "choices": [{"what": choice.what} | choice.fit.record() for choice in result.choices],
        "unknowns": list(fit.unknowns),
        "correlation": np.asarray(fit.correlation).tolist(),
    }


def _kind(result: ChannelFits) -> str:
    samples = result.samples
    if isinstance(samples, DirectionalSamples):
        return "brdf"
    return "slice" if samples.quantity == "brdf" else "ndf"


def _size(result: ChannelFits) -> str:
    channels = result.samples.channels
    count = f"{len(result.samples.values)} samples"
    if len(channels) > _MOST_CHANNELS:
        return f"{count}, {len(channels)} channels, {channels[0]} to {channels[-1]}"
    return f"{count}, {'channel' if len(channels) == 1 else 'channels'} {', '.join(channels)}"


def _numbers(fit: MeasuredFit, channels: Sequence[str]) -> Iterator[Quantity]:
    """Yield what a renderer needs."""
    roughness = _roughness(fit)
    if roughness:
        yield Quantity(_ROUGHNESS, roughness, _own(fit))
    else:
        yield Quantity(fit.label, _own(fit).replace("\n", ", "))
    if fit.gamma is not None and fit.distribution.second_parameter:
        symbol = fit.distribution.second_parameter.symbol
        yield Quantity("", f"{symbol} = {with_error(fit.gamma, fit.gamma_error)}")
    if fit.f0 is not None:
        text = f"F₀ = {_line(fit.f0, fit.f0_error, channels)}"
        swatch = "" if fit.n is not None else _swatch(fit.f0, channels)
        yield Quantity("", text, _index(fit), swatch)
    for label, values, errors in (
        ("diffuse albedo", fit.diffuse, fit.diffuse_error),
        (
            "specular factor k_s",
            None if _is_one(fit.specular) else fit.specular,
            fit.specular_error,
        ),
        *((name, *_linear(fit, name)) for name in ("offset", "scale")),
    ):
        if values is not None:
            swatch = _swatch(values, channels) if label == "diffuse albedo" else ""
            yield Quantity(label, _line(values, errors, channels), "", swatch)


def _roughness(fit: MeasuredFit) -> str:
    """Return the number that renderers store; nothing if they have none for this shape."""
    encodings = () if fit.second is not None else fit.distribution.encodings
    encoding = next((one for one in encodings if one.name == _ROUGHNESS), None)
    if encoding is None:
        return ""
    own = np.array([1, 1 + _STEP]) * fit.parameter
    stored = encoding.encode(own)
    slope = abs(np.diff(stored) / np.diff(own))
    text = with_error(float(stored[0]), float(slope[0]) * fit.parameter_error)
    return f"{encoding.stored.symbol} = {text}"


def _own(fit: MeasuredFit) -> str:
    """Return the distribution's own parameter with its symbol; of two lobes a line each."""
    symbol = fit.distribution.parameter.symbol
    first = f"{symbol} = {_positive(fit.parameter, fit.parameter_error)}"
    if fit.second is None or fit.share is None:
        return first
    second = f"{symbol} = {_positive(fit.second, fit.errors.get('second'))}"
    return f"{first} ({100 * fit.share:.3g} %)\n{second} ({100 * (1 - fit.share):.3g} %)"


def _positive(value: float, error: float | None) -> str:
    """Return a number that is not 0, of which an error as large says nothing."""
    if error is not None and error >= value:
        return f"{value:.2g}, not determined"
    return with_error(value, error)


def _index(fit: MeasuredFit) -> str:
    """Return the index of refraction; nothing if there is none."""
    return "" if fit.n is None else f"n = {with_error(fit.n, fit.n_error)}"


def _linear(
    fit: MeasuredFit, name: str
) -> tuple[tuple[float, ...] | None, tuple[float, ...] | None]:
    """Return a number of each channel, and the errors; None if the model has none such."""
    return fit.linear.get(name), fit.linear_errors.get(name)


def _is_one(values: Sequence[float] | None) -> bool:
    return values is None or all(value == 1 for value in values)


def _texts(values: Sequence[float] | None, errors: Sequence[float] | None) -> list[str]:
    """Return numbers with their errors, if there are any."""
    if values is None:
        return []
    return [with_error(*pair) for pair in zip_longest(values, errors or ())]


def _by_channel(
    values: Sequence[float] | None, errors: Sequence[float] | None, channels: Sequence[str]
) -> list[str]:
    """Return numbers of channels, once if they are all the same, as a range if they are many."""
    if values is None:
        return []
    texts = _texts(values, errors)
    if len(set(texts)) == 1:
        return texts[:1]
    if len(texts) > _MOST_CHANNELS:
        return [f"{min(values):.3g} to {max(values):.3g}"]
    return [f"{channel}: {text}" for channel, text in zip(channels, texts, strict=True)]


def _line(values: Sequence[float], errors: Sequence[float] | None, channels: Sequence[str]) -> str:
    return ", ".join(_by_channel(values, errors, channels))


def _cell(
    values: Sequence[float] | None, errors: Sequence[float] | None, channels: Sequence[str]
) -> str:
    return "\n".join(_by_channel(values, errors, channels))


def _swatch(values: Sequence[float], channels: Sequence[str]) -> str:
    """Return the colour of reflectances on a screen, if the channels are those of Rec. 709."""
    if [name.casefold() for name in channels] not in _COLORS:
        return ""
    levels = np.rint(255 * srgb(np.array(values))).astype(int)
    return f"#{''.join(f'{level:02x}' for level in levels)}"


def _precision(result: ChannelFits) -> str:
    """Return what ± is, and how far choices move the parameter."""
    count = len(result.by_incidence)
    residuals = "from the residuals, widened because neighbouring samples err alike"
    texts = [f"± is one standard error, {residuals}."]
    if count > 1:
        texts = [
            f"± is one standard error: that of the jackknife over {count} angles of incidence, or "
            "that of the residuals where it is larger."
        ]
    fit = result.recommended
    same = [
        choice.fit.parameter
        for choice in result.choices
        if choice.fit.name == fit.name and choice.fit.log_rmse < _MUCH_WORSE * fit.log_rmse
    ]
    if len(same) > 1:
        symbol = fit.distribution.parameter.symbol
        low, high = (with_error(value, fit.parameter_error) for value in (min(same), max(same)))
        ends = (text.partition(" ± ")[0] for text in (low, high))
        texts.append(f"The choices below move {symbol} from {' to '.join(ends)}.")
    return " ".join(texts)


def _legend(result: ChannelFits) -> str:
    texts = ["Dots: data.", f"Solid lines: {result.recommended.label}, recommended."]
    second = runner_up(result)
    if second:
        texts.append(f"Dotted lines: {second.label}, the next best shape.")
    if np.isfinite(result.noise):
        texts.append(f"Grey: ± 2 standard deviations of the noise, {percent(result.noise)}.")
    return " ".join(texts)


# A choice whose error is so many times as large says nothing of the parameter.
_MUCH_WORSE = 1.5
_MAIN = ("parameter", "γ", "F₀", "k_d", "k_s", "offset", "scale")


def _main(fit: MeasuredFit, channels: Sequence[str]) -> list[str]:
    """Return the numbers of a fit as cells under `_MAIN`."""
    return [
        _own(fit),
        "" if fit.gamma is None else with_error(fit.gamma, fit.gamma_error),
        "\n".join(filter(None, [_cell(fit.f0, fit.f0_error, channels), _index(fit)])),
        _cell(fit.diffuse, fit.diffuse_error, channels),
        "" if _is_one(fit.specular) else _cell(fit.specular, fit.specular_error, channels),
        *(_cell(*_linear(fit, name), channels) for name in ("offset", "scale")),
    ]


def _candidates(result: ChannelFits) -> ReportTable:
    """Return the candidates that come nearest, the recommended one among them."""
    fits = list(result.fits[:_MOST_CANDIDATES])
    if result.recommended not in fits:
        fits[-1] = result.recommended
    least = min(fit.bic for fit in fits)
    columns = ["shape", *_MAIN, "error", "validated error", "ΔBIC"]
    channels = result.samples.channels
    unit = _ERROR_UNITS.get(result.recommended.loss, "")
    rows = [
        [
            fit.label,
            *_main(fit, channels),
            _error(fit.error, unit),
            _error(fit.validated_error, unit, fit.validated_spread),
            f"{fit.bic - least:.0f}",
        ]
        for fit in fits
    ]
    return _without_empty(ReportTable(columns, rows, fits.index(result.recommended)))


def _error(value: float, unit: str, spread: float | None = None) -> str:
    """Return an error of the loss: relative, in standard deviations of the values, or in theirs."""
    if unit == "%" and np.isfinite(value):
        if spread is None:
            return percent(value, is_aligned=True)
        value, spread = 100 * value, 100 * spread
    return f"{with_error(value, spread)} {unit}".rstrip()


def _without_empty(table: ReportTable) -> ReportTable:
    """Return a table without the columns in which there is nothing."""
    used = [place for place in range(len(table.columns)) if any(row[place] for row in table.rows)]
    columns = [table.columns[place] for place in used]
    return ReportTable(columns, [[row[place] for place in used] for row in table.rows], table.bold)


def _why(result: ChannelFits) -> str:
    fit, best = result.recommended, result.fits[0]
    if len(result.fits) == 1:
        reason = "the only candidate."
    elif fit is best:
        reason = "the smallest validated error, and nothing simpler within a standard error of it."
    else:
        reason = (
            "the simplest shape whose validated error is within one standard error of the "
            f"smallest, that of {best.label}."
        )
    return (
        f"Recommended is {fit.label}: {reason} The error is the root mean square of the residuals; "
        "the validated error is that of samples left out of the fit, with its standard error. ΔBIC "
        "is the Bayesian information criterion above the least."
    )


def _choices(result: ChannelFits) -> ReportTable:
    """Return what other choices lead to; the first row is the one that is used."""
    channels = result.samples.channels
    fits = [choice.fit for choice in result.choices]
    several = len({fit.name for fit in fits}) > 1
    names = ("parameter", "F₀", "k_d", "k_s", "offset", "scale")
    shown = [_MAIN.index(name) for name in names]
    rows = []
    for choice in result.choices:
        cells = _main(choice.fit, channels)
        shape = choice.fit.label if several else ""
        size = percent(choice.fit.log_rmse, is_aligned=True)
        rows.append([choice.what, shape, *(cells[place] for place in shown), size])
    columns = ["choice", "shape", *(_MAIN[place] for place in shown), "error of logarithms"]
    return _without_empty(ReportTable(columns, rows, 0 if rows else None))


def _spectrum(fit: MeasuredFit, channels: Sequence[str]) -> ReportTable | None:
    """Return the numbers of each of many channels."""
    if len(channels) <= _MOST_CHANNELS:
        return None
    columns = ["channel" if wavelengths_of(channels) is None else "λ", "k_d", "F₀", "k_s"]
    factor = None if _is_one(fit.specular) else fit.specular
    lists = [
        _texts(fit.diffuse, fit.diffuse_error),
        _texts(fit.f0, fit.f0_error),
        _texts(factor, fit.specular_error),
    ]
    rows = [
        [name, *(texts[place] if texts else "" for texts in lists)]
        for place, name in enumerate(channels)
    ]
    return _without_empty(ReportTable(columns, rows))


def _correlation(fit: MeasuredFit) -> ReportTable | None:
    if len(fit.unknowns) < 2:
        return None
    rows = [
        [name, *(f"{value:.2f}".replace("-", "−") for value in row)]
        for name, row in zip(fit.unknowns, np.asarray(fit.correlation).tolist(), strict=True)
    ]
    return ReportTable(["", *fit.unknowns], rows)


def _method(analysis: Analysis, result: ChannelFits, digest: str) -> Iterator[tuple[str, str]]:
    """Yield how the numbers come about, by headings."""
    settings, fit = analysis.settings, result.recommended
    solved = "offset and scale"
    if isinstance(result.samples, DirectionalSamples):
        yield "Masking G", _MASKINGS[settings.masking]
        solved = "k_d, and F₀ of a metal or k_s where they are fitted,"
        fresnel = fit.fresnel or "none"
        index = fresnel.partition(":")[2]
        yield "Fresnel factor F", _FRESNELS.get(fresnel, f"exact, of a dielectric with n = {index}")
        yield (
            "k_s",
            "fitted in each channel" if settings.free_specular else "1: F carries the strength",
        )
    weighted = settings.deviations(result.samples) is not None
    loss = "differences of values in their standard deviations" if weighted else ""
    weights = ", with Huber's weights (1964)" if settings.robust else ""
    yield "Loss", f"{loss or _LOSSES[settings.loss]}{weights}"
    if settings.aperture:
        yield "Aperture", f"the model is averaged over {settings.aperture:g}°"
    yield "Solver", f"{solved} {_SOLVER}"
    used = len(result.samples.values)
    yield "Samples", "; ".join([f"{used} used", *analysis.notes])
    if digest:
        yield "SHA-256 of the file", digest
