"""Which metric is right under which light: the theory, and spheres rendered under real lights."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from mdfconv.distributions import distribution
from mdfconv.distributions.evaluation import Array
from mdfconv.fitting.metrics import metric_named
from mdfconv.fitting.solve import fit
from mdfconv.output.figures import PAGE, encoded, new_figure
from mdfconv.output.records import csv_text, rounded_rows
from mdfconv.studies.lights import (
    FLIP,
    LINEAR,
    ROUGH,
    RULES,
    SMOOTH,
    Renders,
    SmoothConstant,
    best_ratio,
    equivalent_exponent,
    read_renders,
    smooth_constants,
)
from mdfconv.studies.pages import Contents, fill, pivot

# Where N = 2/m_B² − 1 is compared with the fit.
_M_B = np.geomspace(0.01, ROUGH, 17)
# A best ratio that may be the end of what was rendered.
_LOWEST = 0.5
# The pairs whose constants the page has.
_SHOWN = ("beckmann", "ggx")

_DRAWN_EXPONENTS = np.linspace(0, 3.3, 34)
_METRIC_STYLES = {
    "energy": ("#D55E00", (0, (6, 2))),
    "environment": ("#0072B2", (0, (6, 2, 1, 2))),
    "display": ("#009E73", (0, (2, 2))),
}
_MARKERS = ("o", "s", "^")
_MARK: dict[str, Any] = {"linestyle": "", "markersize": 5}
_LINEAR_STYLE = _MARK | {"color": "#56B4E9", "markeredgecolor": "#000000", "markeredgewidth": 0.6}
_FLIP_STYLE = _MARK | {"color": "none", "markeredgecolor": "#CC79A7", "markeredgewidth": 0.9}
_DIAGONAL = (0.58, 0.96)


def lights() -> Contents:
    """Return the evidence for the metrics: theory, rendered spheres, constants."""
    from scipy.stats import spearmanr

    renders, constants = read_renders(), smooth_constants()
    exponents = np.array([equivalent_exponent(ratio) for ratio in renders.predicted])
    smooth = np.array([SMOOTH])
    metrics = {name: _fitted("ggx", smooth, name)[0] / SMOOTH for name in _METRIC_STYLES}
    off = renders.predicted / renders.best[LINEAR] - 1
    deviations = [abs(one.deviation) for one in constants if not one.exact]
    figures = {"cases": len(off), "prediction": prediction_error(renders)}
    page = fill(
        "lights",
        environments=len(set(renders.environment)),
        ratio=metrics,
        power_law={exponent: best_ratio(exponent) for exponent in range(4)},
        costs=cost_table(renders),
        lowest=_LOWEST,
        ends={name: int(np.sum(best == _LOWEST)) for name, best in renders.best.items()},
        signed={f"{m_b:g}": np.median(off[renders.m_b == m_b]) for m_b in np.unique(renders.m_b)},
        rank={
            name: spearmanr(renders.predicted, best).statistic
            for name, best in renders.best.items()
        },
        exponent={"least": exponents.min(), "largest": exponents.max()},
        constants=_constant_table(constants),
        student={gamma: _student_ratio(gamma) for gamma in (3, 5, 20)},
        rough=ROUGH,
        deviation=[min(deviations), max(deviations)],
        shifted=np.abs(_fitted("blinn-phong", _M_B, "environment") / (2 / _M_B**2 - 1) - 1).max(),
        **figures,
    )
    columns = {"m_b": renders.m_b, "predicted": renders.predicted, "exponent": exponents}
    columns |= {f"best {name}": ratio for name, ratio in renders.best.items()}
    cases = [
        {"environment": name} | row
        for name, row in zip(renders.environment, rounded_rows(columns), strict=True)
    ]
    rows = [one.record() for one in constants]
    tables = [csv_text(list(table[0]), table) for table in (cases, rows)]
    return Contents([page, *tables, draw_lights(renders, exponents, metrics)], figures)


def _fitted(target: str, m_b: Array, metric: str) -> Array:
    return fit(distribution("beckmann"), m_b, distribution(target), metric_named(metric)).parameter


def _student_ratio(gamma: float) -> float | None:
    """Return the α of a Student-t lobe over Beckmann's m_B, at every roughness."""
    target = distribution("student-t").with_gamma(gamma)
    return metric_named("environment").ratio(distribution("beckmann"), target)


def cost_table(renders: Renders) -> str:
    """Return the mean and the worst costs of the rules by measure and m_B, as Markdown."""
    groups = {
        f"{measure}, m_B {m_b:g}": costs[renders.m_b == m_b]
        for measure, costs in renders.costs.items()
        for m_b in np.unique(renders.m_b)
    }
    groups["all"] = np.concatenate(list(renders.costs.values()))
    cells = []
    for label, cost in groups.items():
        means = np.exp(np.mean(np.log(cost), axis=0))  # geometric: costs are ratios
        for (ratio, rule), mean, worst in zip(RULES.items(), means, cost.max(axis=0), strict=True):
            text = f"**{mean:.2f}**" if mean == means.min() else f"{mean:.2f}"
            cells.append((label, f"{ratio} {rule}", f"{text} ({worst:.2f})"))
    return pivot("mean over lights (worst)", cells)


def prediction_error(renders: Renders) -> list[float]:
    """Return median, 90th percentile and maximum of |predicted / best − 1|, linear light."""
    error = np.abs(renders.predicted / renders.best[LINEAR] - 1)
    return [float(np.percentile(error, share)) for share in (50, 90, 100)]


def _constant_table(constants: Sequence[SmoothConstant]) -> str:
    """Return the laws from and to the distributions shown, with a row for each other one."""
    cells = []
    for one in constants:
        source, target = (f"{mdf.name} {mdf.parameter.symbol}" for mdf in (one.source, one.target))
        text = f"{one.law} ({'exact' if one.exact else f'{one.deviation:+.1%}'})"
        if one.source.name in _SHOWN:
            cells.append((target, f"from {source}", text))
        if one.target.name in _SHOWN:
            cells.append((source, f"to {target}", text))
    return pivot("distribution", cells)


def draw_lights(
    renders: Renders, exponents: Array, metrics: Mapping[str, float], dpi: int = 110
) -> bytes:
    """Return a PNG: best ratios over the exponent of the light, and predicted against rendered."""
    figure = new_figure(PAGE[0] * 1.5, PAGE[1] * 0.95)
    left, right = figure.subplots(1, 2)
    curve = [best_ratio(exponent) for exponent in _DRAWN_EXPONENTS]
    handles = left.plot(
        _DRAWN_EXPONENTS, curve, color="#000000", label="pure power law, smooth surface"
    )
    for name, ratio in metrics.items():
        color, dashes = _METRIC_STYLES[name]
        left.axhline(ratio, color=color, linestyle=dashes, linewidth=1.3)
    names = [f"{name}\n{ratio:.3f}" for name, ratio in metrics.items()]
    left.secondary_yaxis("right").set_yticks(list(metrics.values()), names)
    handles += right.plot(_DIAGONAL, _DIAGONAL, color="#999999", label="rendered as predicted")
    linear, flip = renders.best[LINEAR], renders.best[FLIP]
    for m_b, marker in zip(np.unique(renders.m_b), _MARKERS, strict=True):
        case = renders.m_b == m_b
        styles = [style | {"marker": marker} for style in (_LINEAR_STYLE, _FLIP_STYLE)]
        for (name, best), style in zip(((LINEAR, linear), (FLIP, flip)), styles, strict=True):
            label = f"least {name}, m_B = {m_b:g}"
            handles += left.plot(exponents[case], best[case], label=label, **style)
        right.plot(renders.predicted[case], linear[case], **styles[0])
    left.set(
        xlabel="exponent p of the power law that has the predicted ratio",
        ylabel="best α / m_B",
        title="GGX in Beckmann's place, over the light",
    )
    right.set(
        xlabel="α / m_B predicted from the light's own spectrum",
        ylabel=f"α / m_B of least {LINEAR}, rendered",
        title="Predicted and rendered",
        xlim=_DIAGONAL,
        ylim=_DIAGONAL,
        aspect="equal",
    )
    figure.legend(handles=handles, loc="outside lower center", ncols=4)
    return encoded(figure, dpi=dpi)
