"""Which metric is right under which light: renders, the theory of smooth surfaces, the page.

``data/renders.csv`` was made outside of mdfconv. An independent production renderer drew a sphere
(Smith masking, F = 1, 1024 samples a pixel) under 18 real environments of high dynamic range (CC0),
with Beckmann at three m_B, and with GGX in its place at 13 ratios α/m_B. A row is an environment
and an m_B, and has

- ``predicted_linear``, the ratio that minimizes Σ (2l+1) C_l (Δk_l)² over the angular power
  spectrum C_l of that environment;
- for each measure of the difference between the pictures ``best_``, the ratio of least error, and
  ``cost_``, the error at five ratios as a multiple of the least. Measures: root mean square of
  linear light, of sRGB values, and of sRGB values after the ACES tone curve; FLIP of low and of
  high dynamic range (Andersson et al. 2020 and 2021).

How far down the 13 ratios went is not recorded. A best ratio of just 0.5, which never occurs in
linear light, may be their end.

The theory: a lobe D blurs an environment. Seen along the normal, it is a kernel D(θ/2)/4 over the
incident directions θ = 2β, which multiplies degree l of the environment's spherical harmonics by a
factor k_l (Ramamoorthi & Hanrahan 2001). Of a smooth surface that is a Hankel transform::

    k_l = 2π ∫ D(β) J₀(2lβ) β dβ

With D = exp(−β²/m²)/(π m²), Beckmann's, it is exp(−(ml)²); with D = 1/(π α² (1 + β²/α²)²), that of
GGX, it is x K₁(x) for x = 2αl. Under light of angular power l^−p the squared error
Σ (2l+1) l^−p (Δk_l)² becomes an integral over l, and its minimum over the ratio α/m, as
d(x K₁)/dα = −x² K₀/α, the zero of::

    ∫ l^(1−p) (x K₁(x) − exp(−l²)) x² K₀(x) dl,   m = 1

At p = 0 that is the energy metric and at p = 2 the environment metric.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import permutations
from typing import Any

import numpy as np
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.special import k0, k1

from mdfconv.distributions import Distribution, distribution, one_parameter_distributions
from mdfconv.distributions.evaluation import Array
from mdfconv.fitting.metrics import metric_named
from mdfconv.fitting.solve import fit
from mdfconv.output.figures import PAGE, encoded, new_figure
from mdfconv.output.records import csv_text, rounded_rows
from mdfconv.studies.bench import as_wide
from mdfconv.studies.pages import PageFiles, fill, pivot, read_rows

LINEAR, FLIP = "linear RMSE", "HDR-FLIP"
_COLUMNS = {LINEAR: "linear_rmse", "sRGB RMSE": "srgb_rmse", FLIP: "hdr_flip"}
# The ratios α/m_B of the costs, as the columns spell them, and the metric or rule that has that
# ratio on a smooth surface.
RULES = {
    "0.647": "display",
    "0.781": "environment",
    "0.925": "energy",
    "1.0": "peak",
    "1.2": "shape",
}
# Every exponent p, and around the ratios of all of them. Beyond 4 rounding errors of Δk at l → 0
# count.
_EXPONENTS, _RATIOS = (-1.0, 4.0), (0.3, 1.2)
_TOLERANCE = 1e-12
# Beckmann's m_B for lobes of the same half width. Schlick's form nears its limit in proportion
# to m_B, the others to its square.
SMOOTH = 1e-6
ROUGH = 0.4
# p_source^k, by k.
_TERMS = {1.0: "{} {}", -2.0: "{} / {}²", -0.5: "{} / √{}"}
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
_STYLES = {
    LINEAR: _MARK | {"color": "#56B4E9", "markeredgecolor": "#000000", "markeredgewidth": 0.6},
    FLIP: _MARK | {"color": "none", "markeredgecolor": "#CC79A7", "markeredgewidth": 0.9},
}
_DIAGONAL = (0.58, 0.96)


@dataclass(frozen=True)
class Renders:
    """The n rendered cases: light, Beckmann's m_B, and ratios α/m_B.

    `predicted` is what the light's power spectrum predicts, `best` by measure the ratio of least
    error; `costs`, shape (n, 5), are the errors at the ratios of `RULES` over the least one.
    """

    environment: tuple[str, ...]
    m_b: Array
    predicted: Array
    best: dict[str, Array]
    costs: dict[str, Array]


def read_renders() -> Renders:
    """Return the rendered cases that come with the package."""
    rows = read_rows("renders.csv")

    def numbers(column: str) -> Array:
        return np.array([float(row[column]) for row in rows])

    environments = tuple(row["environment"] for row in rows)
    best = {name: numbers(f"best_{column}") for name, column in _COLUMNS.items()}
    costs = {
        name: np.stack([numbers(f"cost_{column}_{ratio}") for ratio in RULES], axis=1)
        for name, column in _COLUMNS.items()
    }
    return Renders(environments, numbers("m_b"), numbers("predicted_linear"), best, costs)


def best_ratio(exponent: float) -> float:
    """Return the α/m_B of least error under light of angular power l^−p, p from −1 to 4."""
    return float(brentq(_slope, *_RATIOS, args=(exponent,), xtol=_TOLERANCE))


def equivalent_exponent(ratio: float) -> float:
    """Return the exponent p, from −1 to 4, whose power law has a given α/m_B as its best."""
    return float(brentq(lambda exponent: _slope(ratio, exponent), *_EXPONENTS, xtol=_TOLERANCE))


def _slope(ratio: float, exponent: float) -> float:
    """Return the slope of the squared error over the ratio, but for a negative factor."""

    def integrand(degree: float) -> float:
        x = 2 * ratio * degree
        difference = x * k1(x) - np.exp(-(degree**2))
        return float(degree ** (1 - exponent) * difference * x * x * k0(x))

    return float(quad(integrand, 0, np.inf, epsabs=_TOLERANCE, epsrel=0)[0])


@dataclass(frozen=True)
class SmoothConstant:
    """The law p_target = constant · p_source^power of smooth surfaces under the environment metric.

    There the lobe of every distribution is a function of tan β over a width, and widths convert by
    one constant. A width is the parameter itself, or the inverse root of one that is an exponent.
    `exact` says whether the law holds for every roughness; `deviation` is the best fit over the
    law, less 1, for a source as wide as Beckmann's lobe of m_B = `ROUGH`.
    """

    source: Distribution
    target: Distribution
    constant: float
    power: float
    exact: bool
    deviation: float

    @property
    def law(self) -> str:
        """The right-hand side in the source's symbol, such as ``"2.00000 / m_B²"``."""
        return _TERMS[self.power].format(f"{self.constant:.5f}", self.source.parameter.symbol)

    def record(self) -> dict[str, Any]:
        """Return a row of a table."""
        return {
            "from": self.source.name,
            "to": self.target.name,
            "constant": float(f"{self.constant:.6g}"),
            "power": self.power,
            "exact": self.exact,
            f"deviation at m_B {ROUGH:g}": float(f"{self.deviation:.4g}"),
        }


def smooth_constants() -> list[SmoothConstant]:
    """Return the constants of every ordered pair of the one-parameter distributions."""
    compared = [one for one in one_parameter_distributions() if one.map_variables is not None]
    return [_constant(source, target) for source, target in permutations(compared, 2)]


def _constant(source: Distribution, target: Distribution) -> SmoothConstant:
    metric = metric_named("environment")
    parameter = as_wide([SMOOTH, ROUGH], source)
    power = _width_power(target) / _width_power(source)
    smooth, rough = fit(source, parameter, target, metric).parameter / parameter**power
    exact = metric.ratio(source, target) is not None
    return SmoothConstant(source, target, float(smooth), power, exact, float(rough / smooth - 1))


def _width_power(mdf: Distribution) -> float:
    """Return k for a parameter that grows like the k-th power of a small width."""
    return -2 if mdf.parameter.larger_is_smoother else 1


def lights() -> PageFiles:
    """Return the evidence for the metrics: theory, rendered spheres, constants."""
    renders, constants = read_renders(), smooth_constants()
    best = renders.best.items()
    exponents = np.array([equivalent_exponent(ratio) for ratio in renders.predicted])
    # The α of a Student-t lobe over Beckmann's m_B is the same at every roughness.
    beckmann, lobe = distribution("beckmann"), distribution("student-t")
    ratio = metric_named("environment").ratio
    student = {gamma: ratio(beckmann, lobe.with_gamma(gamma)) for gamma in (3, 5, 20)}
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
        ends={name: int(np.sum(each == _LOWEST)) for name, each in best},
        signed={f"{m_b:g}": np.median(off[renders.m_b == m_b]) for m_b in np.unique(renders.m_b)},
        rank={name: _rank_correlation(renders.predicted, each) for name, each in best},
        exponent={"least": exponents.min(), "largest": exponents.max()},
        constants=_constant_table(constants),
        student=student,
        rough=ROUGH,
        deviation=[min(deviations), max(deviations)],
        shifted=np.abs(_fitted("blinn-phong", _M_B, "environment") / (2 / _M_B**2 - 1) - 1).max(),
        **figures,
    )
    columns = {"m_b": renders.m_b, "predicted": renders.predicted, "exponent": exponents}
    columns |= {f"best {name}": ratio for name, ratio in renders.best.items()}
    named = zip(renders.environment, rounded_rows(columns), strict=True)
    cases = [{"environment": name} | row for name, row in named]
    rows = [one.record() for one in constants]
    tables = [csv_text(list(table[0]), table) for table in (cases, rows)]
    return PageFiles([page, *tables, draw_lights(renders, exponents, metrics)], figures)


def _rank_correlation(one: Array, other: Array) -> float:
    """Return Spearman's correlation of ranks, the mean of them where values are equal."""
    ranks = []
    for values in (one, other):
        _, place, count = np.unique(values, return_inverse=True, return_counts=True)
        ranks.append((np.cumsum(count) - 0.5 * count)[place])
    return float(np.corrcoef(ranks)[0, 1])


def _fitted(target: str, m_b: Array, metric: str) -> Array:
    return fit(distribution("beckmann"), m_b, distribution(target), metric_named(metric)).parameter


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
            mark = "**" if mean == means.min() else ""
            cells.append((label, f"{ratio} {rule}", f"{mark}{mean:.2f}{mark} ({worst:.2f})"))
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


def draw_lights(renders: Renders, exponents: Array, metrics: Mapping[str, float]) -> bytes:
    """Return a PNG: best ratios over the exponent of the light, and predicted against rendered."""
    figure = new_figure(PAGE[0] * 1.5, PAGE[1] * 0.95)
    left, right = figure.subplots(1, 2)
    curve = [best_ratio(exponent) for exponent in _DRAWN_EXPONENTS]
    theory = {"color": "#000000", "label": "pure power law, smooth surface"}
    handles = left.plot(_DRAWN_EXPONENTS, curve, **theory)
    for name, ratio in metrics.items():
        color, dashes = _METRIC_STYLES[name]
        left.axhline(ratio, color=color, linestyle=dashes, linewidth=1.3)
    names = [f"{name}\n{ratio:.3f}" for name, ratio in metrics.items()]
    left.secondary_yaxis("right").set_yticks(list(metrics.values()), names)
    handles += right.plot(_DIAGONAL, _DIAGONAL, color="#999999", label="rendered as predicted")
    for m_b, marker in zip(np.unique(renders.m_b), _MARKERS, strict=True):
        case = renders.m_b == m_b
        for name, style in _STYLES.items():
            best, marked = renders.best[name][case], style | {"marker": marker}
            label = f"least {name}, m_B = {m_b:g}"
            handles += left.plot(exponents[case], best, label=label, **marked)
            if name == LINEAR:
                right.plot(renders.predicted[case], best, **marked)
    left.set(ylabel="best α / m_B", title="GGX in Beckmann's place, over the light")
    left.set_xlabel("exponent p of the power law that has the predicted ratio")
    right.set(title="Predicted and rendered", xlim=_DIAGONAL, ylim=_DIAGONAL, aspect="equal")
    right.set_xlabel("α / m_B predicted from the light's own spectrum")
    right.set_ylabel(f"α / m_B of least {LINEAR}, rendered")
    figure.legend(handles=handles, loc="outside lower center", ncols=4)
    return encoded(figure, dpi=110)
