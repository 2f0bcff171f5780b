"""GGX in Beckmann's place under light: what was rendered, and the theory of smooth surfaces.

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

import csv
from dataclasses import dataclass
from importlib.resources import files
from itertools import permutations
from typing import Any

import numpy as np

from mdfconv.distributions import Distribution, one_parameter_distributions
from mdfconv.distributions.evaluation import Array
from mdfconv.fitting.metrics import metric_named
from mdfconv.fitting.solve import fit
from mdfconv.studies.bench import as_wide

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
    text = files("mdfconv.studies").joinpath("data", "renders.csv").read_text(encoding="utf-8")
    rows = list(csv.DictReader(text.splitlines()))

    def numbers(column: str) -> Array:
        return np.array([float(row[column]) for row in rows])

    return Renders(
        tuple(row["environment"] for row in rows),
        numbers("m_b"),
        numbers("predicted_linear"),
        {name: numbers(f"best_{column}") for name, column in _COLUMNS.items()},
        {
            name: np.stack([numbers(f"cost_{column}_{ratio}") for ratio in RULES], axis=1)
            for name, column in _COLUMNS.items()
        },
    )


def best_ratio(exponent: float) -> float:
    """Return the α/m_B of least error under light of angular power l^−p, p from −1 to 4."""
    from scipy.optimize import brentq

    return float(brentq(_slope, *_RATIOS, args=(exponent,), xtol=_TOLERANCE))


def equivalent_exponent(ratio: float) -> float:
    """Return the exponent p, from −1 to 4, whose power law has a given α/m_B as its best."""
    from scipy.optimize import brentq

    return float(brentq(lambda exponent: _slope(ratio, exponent), *_EXPONENTS, xtol=_TOLERANCE))


def _slope(ratio: float, exponent: float) -> float:
    """Return the slope of the squared error over the ratio, but for a negative factor."""
    from scipy.integrate import quad
    from scipy.special import k0, k1

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
