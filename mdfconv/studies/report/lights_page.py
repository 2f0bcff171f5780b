"""Which metric is right under which light: the theory, and spheres rendered under real lights."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mdfconv.distributions import Distribution, distribution, list_distributions
from mdfconv.distributions.evaluation import Array
from mdfconv.fitting.metrics import metric_named
from mdfconv.fitting.solve import fit
from mdfconv.output.files import file_bytes
from mdfconv.output.records import csv_text, markdown_text, rounded_rows
from mdfconv.studies.report.artefact import Artefact
from mdfconv.studies.report.lights_figure import draw_lights
from mdfconv.studies.report.power_law import best_ratio, equivalent_exponent
from mdfconv.studies.report.prose import enumeration, percent, wrapped
from mdfconv.studies.report.renders import FLIP, LINEAR, RULES, Renders, read_renders
from mdfconv.studies.report.smooth_constants import ROUGH, SMOOTH, SmoothConstant, smooth_constants

_SOURCE, _TARGET = "beckmann", "ggx"
_DRAWN_METRICS = "energy", "environment", "display"
_EXPONENTS = (0, 1, 2, 3)
_GAMMAS = (3, 5, 20)
# Where N = 2/m_B² − 1 is compared with the fit.
_M_B = np.geomspace(0.01, ROUGH, 17)
# A best ratio that may be the end of what was rendered.
_LOWEST = 0.5


def lights_page() -> Artefact:
    """Return the evidence for the metrics: theory, rendered spheres, constants."""
    renders = read_renders()
    exponents = np.array([equivalent_exponent(ratio) for ratio in renders.predicted])
    metrics = {name: _smooth_ratio(name) for name in _DRAWN_METRICS}
    constants = smooth_constants()
    median, most = prediction_error(renders)
    sections = [
        wrapped(_THEORY.format(**_theory_figures(metrics))),
        wrapped(_EVIDENCE.format(lights=len(set(renders.environment)))),
        cost_table(renders),
        wrapped(_FINDINGS.format(**_findings(renders))),
        wrapped(_PREDICTION.format(**_prediction_figures(renders, exponents))),
        wrapped(_CONSTANTS.format(**_constant_figures(constants))),
        _constant_table(constants),
    ]
    files = {
        "lights.md": file_bytes("\n\n".join(sections)),
        "lights.csv": file_bytes(_cases_text(renders, exponents)),
        "lights-constants.csv": file_bytes(_constants_text(constants)),
        "lights.png": draw_lights(renders, exponents, metrics),
    }
    return Artefact(
        files,
        "which metric is right under which light",
        f"the theory predicts the best ratio of {len(exponents)} rendered cases within "
        f"{percent(median)} in the median and {percent(most)} in nine of ten",
        "mdfconv report",
    )


def _smooth_ratio(metric: str) -> float:
    """Return α/m_B of the fit for a smooth surface."""
    return _fitted(distribution(_TARGET), np.array([SMOOTH]), metric)[0] / SMOOTH


def _fitted(target: Distribution, m_b: Array, metric: str) -> Array:
    return fit(distribution(_SOURCE), m_b, target, metric_named(metric)).parameter


def cost_table(renders: Renders) -> str:
    """Return the mean and the worst costs of the rules by measure and m_B, as Markdown."""
    names = "mean over lights (worst)", *(f"{ratio} {rule}" for ratio, rule in RULES.items())
    rows = []
    for measure, m_b, cost in _groups(renders):
        mean = _mean(cost)
        cells = [f"{one:.2f}" for one in mean]
        cells[np.argmin(mean)] = f"**{cells[np.argmin(mean)]}**"
        shown = [
            f"{cell} ({worst:.2f})" for cell, worst in zip(cells, cost.max(axis=0), strict=True)
        ]
        rows.append(dict(zip(names, [f"{measure}, m_B {m_b:g}", *shown], strict=True)))
    return markdown_text(names, rows)


def _groups(renders: Renders) -> list[tuple[str, float, Array]]:
    """Return measure, m_B and the costs of its lights, shape (lights, rules), of each row."""
    return [
        (measure, float(m_b), costs[renders.m_b == m_b])
        for measure, costs in renders.costs.items()
        for m_b in np.unique(renders.m_b)
    ]


def _mean(cost: Array) -> Array:
    """Return the geometric mean: costs are ratios."""
    return np.exp(np.mean(np.log(cost), axis=0))


def _theory_figures(metrics: dict[str, float]) -> dict[str, str]:
    figures = {name: f"{ratio:.4f}" for name, ratio in metrics.items()}
    figures["exponents"] = enumeration([f"{exponent:g}" for exponent in _EXPONENTS])
    figures["ratios"] = enumeration([f"{best_ratio(exponent):.4f}" for exponent in _EXPONENTS])
    return figures


def _findings(renders: Renders) -> dict[str, str]:
    """Return which rule is best where, and what each costs over all."""
    rules = list(RULES.values())
    best: dict[str, dict[str, list[str]]] = {}
    for measure, m_b, cost in _groups(renders):
        rule = rules[int(np.argmin(_mean(cost)))]
        best.setdefault(measure, {}).setdefault(rule, []).append(f"{m_b:g}")
    texts = []
    for measure, winners in best.items():
        single = len(winners) == 1
        by_m_b = [
            f"`{rule}`" + ("" if single else f" at m_B {enumeration(values)}")
            for rule, values in winners.items()
        ]
        texts.append(f"{enumeration(by_m_b)} in {measure}")
    everything = np.concatenate(list(renders.costs.values()))
    overall = [
        f"`{rule}` {mean:.2f} ({worst:.2f})"
        for rule, mean, worst in zip(rules, _mean(everything), everything.max(axis=0), strict=True)
    ]
    ends = {name: int(np.sum(ratio == _LOWEST)) for name, ratio in renders.best.items()}
    return {
        "best": "; ".join(texts),
        "overall": ", ".join(overall),
        "compromise": rules[int(np.argmin(_mean(everything)))],
        "safest": rules[int(np.argmin(everything.max(axis=0)))],
        "lowest": f"{_LOWEST:g}",
        "ends": enumeration([f"{count} cases of {name}" for name, count in ends.items() if count]),
    }


def prediction_error(renders: Renders) -> tuple[float, float]:
    """Return the median and the 90th percentile of |predicted / best − 1|, linear light."""
    error = np.abs(renders.predicted / renders.best[LINEAR] - 1)
    return float(np.median(error)), float(np.percentile(error, 90))


def rank_correlation(one: Array, other: Array) -> float:
    """Return Spearman's coefficient; to import scipy.stats would take longer than the page."""
    return float(np.corrcoef(_ranks(one), _ranks(other))[0, 1])


def _ranks(values: Array) -> Array:
    """Return the ranks, equal ones the mean of theirs."""
    _, place, counts = np.unique(values, return_inverse=True, return_counts=True)
    return (np.cumsum(counts) - 0.5 * (counts - 1))[place]


def _prediction_figures(renders: Renders, exponents: Array) -> dict[str, str]:
    median, most = prediction_error(renders)
    off = renders.predicted / renders.best[LINEAR] - 1
    values = np.unique(renders.m_b)
    signed = [f"{100 * np.median(off[renders.m_b == m_b]):+.1f} %" for m_b in values]
    linear, flip = (
        f"{rank_correlation(renders.predicted, renders.best[name]):.2f}" for name in (LINEAR, FLIP)
    )
    return {
        "cases": f"{len(off)}",
        "median": percent(median),
        "most": percent(most),
        "worst": percent(np.max(np.abs(off))),
        "signed": enumeration(signed),
        "m_b": enumeration([f"{m_b:g}" for m_b in values]),
        "low": f"{exponents.min():.2f}",
        "high": f"{exponents.max():.2f}",
        "linear": linear,
        "flip": flip,
    }


def _constant_figures(constants: Sequence[SmoothConstant]) -> dict[str, str]:
    off = [one for one in constants if not one.exact]
    nearest, farthest = (choose(off, key=lambda one: abs(one.deviation)) for choose in (min, max))
    metric, source = metric_named("environment"), distribution(_SOURCE)
    student = [distribution("student-t").with_gamma(gamma) for gamma in _GAMMAS]
    exponent = _fitted(distribution("blinn-phong"), _M_B, "environment")
    families = [f"`{one.name}`" for one in list_distributions() if one.scales_with_slope]
    return {
        "families": enumeration(families),
        "gammas": enumeration([f"{gamma}" for gamma in _GAMMAS]),
        "students": enumeration([f"{metric.ratio(source, one):.5f}" for one in student]),
        "rough": f"{ROUGH:g}",
        "nearest": f"{percent(abs(nearest.deviation))} ({_pair(nearest)})",
        "farthest": f"{percent(abs(farthest.deviation))} ({_pair(farthest)})",
        "shifted": percent(np.max(np.abs(exponent / (2 / _M_B**2 - 1) - 1))),
    }


def _pair(one: SmoothConstant) -> str:
    return f"{one.source.name} to {one.target.name}"


def _constant_table(constants: Sequence[SmoothConstant]) -> str:
    """Return the laws with a row for each source and a column for each target, as Markdown."""
    corner = "from, to"
    rows: dict[str, dict[str, str]] = {}
    for one in constants:
        note = "exact" if one.exact else f"{100 * one.deviation:+.2g} %"
        row = rows.setdefault(one.source.name, {corner: _header(one.source)})
        row[_header(one.target)] = f"{one.law} ({note})"
    columns = [corner, *(row[corner] for row in rows.values())]
    return markdown_text(columns, [dict.fromkeys(columns, "") | row for row in rows.values()])


def _header(mdf: Distribution) -> str:
    return f"{mdf.name} {mdf.parameter.symbol}"


def _cases_text(renders: Renders, exponents: Array) -> str:
    """Return what the figure shows of each case, as CSV."""
    columns = {"m_b": renders.m_b, "predicted": renders.predicted, "exponent": exponents}
    columns |= {f"best {name}": ratio for name, ratio in renders.best.items()}
    rows = [
        {"environment": name} | row
        for name, row in zip(renders.environment, rounded_rows(columns), strict=True)
    ]
    return csv_text(list(rows[0]), rows)


def _constants_text(constants: Sequence[SmoothConstant]) -> str:
    """Return constant, power and deviation of each pair, as CSV."""
    rows = [
        {
            "from": one.source.name,
            "to": one.target.name,
            "constant": float(f"{one.constant:.6g}"),
            "power": one.power,
            "exact": one.exact,
            f"deviation at m_B {ROUGH:g}": float(f"{one.deviation:.4g}"),
        }
        for one in constants
    ]
    return csv_text(list(rows[0]), rows)


# In these texts a paragraph, or an item of a list, is a line.
_THEORY = """\
# Which metric is right under which light

![Best ratio over the light, and predicted against rendered ratios](lights.png)

A lobe blurs the environment: seen along the normal, it is a kernel D(θ/2)/4 over the incident \
directions θ = 2β, whose integral is 1 for every normalized D. In spherical harmonics that \
multiplies degree l by k_l = 2π ∫ D sin β cos β P_l(cos 2β) dβ (Ramamoorthi & Hanrahan 2001). \
Under light of angular power C_l the squared error of a picture is Σ (2l+1) C_l (Δk_l)², Δ for \
target less source. So the light decides which conversion is right:

- White light, C_l = 1, of a lamp or the sun somewhere: π² ∫ ΔD² sin 2β dβ, the metric `energy`.
- C_l = 1/(l(l+1)), the 1/f² law of natural images, near to which surroundings lie (Dror et al. \
2004): 4 ∫ ΔF² dβ/sin 2β, F the share of the facets within β, the metric `environment`. As \
dβ/sin 2β = ½ d ln tan β, whatever scales with the slope converts by one constant.
- `display` is no such sum: a screen encodes light and clips it at white, so that the tails of a \
lobe count for more and light no longer adds up.

For a smooth surface Beckmann becomes GGX at α/m_B = {energy} under `energy`, {environment} under \
`environment` and {display} under `display`. Under a power law C_l = l^−p with p = {exponents} the \
best ratio is {ratios}: the black curve of the figure."""

_EVIDENCE = """\
## Spheres under real light

An independent production renderer drew a sphere (Smith masking, F = 1, 1024 samples a pixel) \
under {lights} real environments of high dynamic range (CC0), with Beckmann at each m_B, and with \
GGX in its place at 13 ratios α/m_B. The cost of a ratio is its error as a multiple of the least \
error in that case. Means are geometric; the best of a row is bold. The data come with the \
package, in `mdfconv/reports/data/renders.csv`, with ACES and FLIP of low dynamic range as well."""

_FINDINGS = """\
The best in the mean is {best}. Over all rows the mean (worst) costs are {overall}. The least mean \
is that of `{compromise}`, the least worst case that of `{safest}`.

A best ratio of just {lowest} ({ends}) may be the end of what was rendered: the least error may \
then be lower, and the costs of those cases higher."""

_PREDICTION = """\
## Predicted and rendered

With the measured spectrum of each environment for C_l, the sum predicts the ratio of least linear \
error within {median} in the median of the {cases} cases, within {most} in nine of ten, and within \
{worst} in all. For m_B = {m_b} the median of predicted over rendered, less 1, is {signed}. The \
rank correlation of the predicted ratio with that of least linear error is {linear}, with that of \
least HDR-FLIP {flip}.

The left panel of the figure has each case at the exponent p of the pure power law that, on a \
smooth surface, has the ratio predicted for that case; they go from {low} to {high}. This p is \
another scale for the prediction and no fit to the spectrum, which need not be a power law: a blue \
mark is as far above or below the curve as it is above or below the diagonal of the right panel."""

_CONSTANTS = """\
## Constants of the environment metric

Smooth surfaces convert by one constant a pair under `environment`, and back by its inverse. It is \
exact for every roughness between {families}, whose F is a function of tan β over the parameter; \
from Beckmann to `student-t` with γ = {gammas} α/m_B is {students}. For other pairs it is the \
limit of smooth surfaces. In parentheses is how far the best fit is above or below it for a source \
as wide as Beckmann's lobe of m_B = {rough}: from {nearest} to {farthest} either way. From \
Beckmann to Blinn/Phong N = 2/m_B² − 1 holds within {shifted} up to there."""
