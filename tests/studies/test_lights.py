"""The page on lights: the costs as published, the constants of power laws, the laws of pairs."""

import mpmath as mp
import numpy as np
import pytest
from scipy.special import k1
from scipy.stats import spearmanr

import mdfconv
from mdfconv.studies.lights_page import (
    RULES,
    _rank_correlation,
    best_ratio,
    cost_table,
    equivalent_exponent,
    prediction_error,
    read_renders,
    smooth_constants,
)

# Mean (worst) costs at α/m_B = 0.647, 0.781, 0.925, 1 and 1.2, m_B = 0.1, 0.2 and 0.4.
COSTS = {
    "linear RMSE": (
        "1.62 (2.50) | **1.15** (1.45) | 1.24 (1.91) | 1.45 (2.29) | 2.16 (3.32)",
        "1.56 (2.34) | **1.13** (1.35) | 1.23 (1.82) | 1.43 (2.19) | 2.09 (3.16)",
        "1.31 (1.74) | **1.08** (1.39) | 1.28 (2.03) | 1.48 (2.38) | 2.07 (3.27)",
    ),
    "sRGB RMSE": (
        "**1.10** (1.42) | 1.33 (1.92) | 1.72 (2.45) | 1.94 (2.72) | 2.48 (3.36)",
        "**1.08** (1.28) | 1.17 (1.52) | 1.47 (1.91) | 1.65 (2.10) | 2.13 (2.58)",
        "1.06 (1.32) | **1.04** (1.15) | 1.24 (1.59) | 1.38 (1.86) | 1.81 (2.63)",
    ),
    "HDR-FLIP": (
        "**1.06** (1.23) | 1.26 (1.49) | 1.54 (1.79) | 1.68 (2.00) | 2.02 (2.51)",
        "**1.03** (1.10) | 1.12 (1.27) | 1.31 (1.48) | 1.42 (1.64) | 1.69 (2.03)",
        "**1.02** (1.13) | 1.05 (1.10) | 1.18 (1.30) | 1.26 (1.42) | 1.49 (1.75)",
    ),
}
# Over all of them.
OVERALL = "1.19 (2.50) | **1.15** (1.92) | 1.35 (2.45) | 1.51 (2.72) | 1.97 (3.36)"


def test_costs():
    lines = [
        f"| {measure}, m_B {m_b} | {costs} |"
        for measure, rows in COSTS.items()
        for m_b, costs in zip((0.1, 0.2, 0.4), rows, strict=True)
    ]
    assert cost_table(read_renders()).splitlines()[2:] == [*lines, f"| all | {OVERALL} |"]


def test_prediction():
    renders = read_renders()
    assert (len(set(renders.environment)), len(renders.environment)) == (18, 54)
    median, most, largest = prediction_error(renders)
    assert round(100 * median, 1) == 2.6
    assert round(100 * most) == 11
    assert round(100 * largest) == 18


@pytest.mark.parametrize(("ratio", "rule"), RULES.items())
def test_costs_are_at_the_ratios_of_the_rules(ratio, rule):
    how = {"peak": {"method": "peak"}, "shape": {"method": "fit", "metric": "unit"}}
    options = how.get(rule, {"method": "fit", "metric": rule})
    alpha = mdfconv.convert(1e-6, "beckmann", "ggx", **options)
    assert 1e6 * alpha == pytest.approx(float(ratio), abs=1.1e-3)


def test_white_light_and_natural_light_are_the_metrics():
    energy = 1e6 * mdfconv.convert(1e-6, "beckmann", "ggx", "fit", metric="energy")
    assert best_ratio(0) == pytest.approx(energy, rel=1e-8)
    assert best_ratio(0) == pytest.approx(0.9248, abs=5e-5)
    # Beckmann → GGX under 1/f² is √a with 2a e^a E₁(a) = 1.
    root = mp.findroot(lambda a: 2 * a * mp.exp(a) * mp.e1(a) - 1, 0.6)
    assert best_ratio(2) == pytest.approx(float(mp.sqrt(root)), rel=1e-11)
    assert best_ratio(2) == pytest.approx(0.7810619641, rel=1e-10)


@pytest.mark.parametrize("exponent", [-0.5, 0.5, 1, 3, 3.5])
def test_a_power_law_has_its_least_error_there(exponent):
    # The sum itself for m = 0.01, over every degree that it lets pass.
    degree = np.arange(1, 2001)
    source = np.exp(-((0.01 * degree) ** 2))
    ratios = best_ratio(exponent) + np.array([-0.02, 0, 0.02])
    x = 2 * 0.01 * ratios[:, None] * degree
    errors = np.sum(
        (2 * degree + 1) * degree ** -float(exponent) * (x * k1(x) - source) ** 2, axis=1
    )
    below, there, above = errors
    vertex = ratios[1] + 0.01 * (below - above) / (below - 2 * there + above)
    assert vertex == pytest.approx(ratios[1], abs=2e-3)
    assert equivalent_exponent(best_ratio(exponent)) == pytest.approx(exponent, abs=1e-9)


def test_laws_of_smooth_surfaces():
    laws = {(one.source.name, one.target.name): one for one in smooth_constants()}
    assert laws["beckmann", "blinn-phong"].law == "2.00000 / m_B²"
    assert laws["blinn-phong", "beckmann"].law == "1.41421 / √N"
    assert laws["ggx", "smoothie"].law == "2.00000 α"
    # N = 11.49618 at m_B = 0.4, α = 0.1098842 at N = 100.
    assert laws["beckmann", "blinn-phong"].deviation == pytest.approx(11.49618 / 12.5 - 1, rel=1e-5)
    assert laws["blinn-phong", "ggx"].constant == pytest.approx(1.0988 * np.sqrt(1.01), rel=1e-3)
    for (source, target), law in laws.items():
        assert law.exact == ({source, target} == {"beckmann", "ggx"})
        assert law.exact == (abs(law.deviation) < 1e-12)
        back = laws[target, source]
        assert law.constant * back.constant**law.power == pytest.approx(1, rel=2e-6)


def test_rank_correlation_is_that_of_scipy():
    random = np.random.default_rng(5)
    for spread in (2, 5, 1000):
        one = random.integers(0, spread, 40)
        other = one + random.integers(0, spread, 40)
        expected = spearmanr(one, other).statistic
        assert _rank_correlation(one, other) == pytest.approx(expected, rel=1e-12)
