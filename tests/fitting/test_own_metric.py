"""A metric that somebody registers, with a root that is steep where a distribution leaves 0."""

import copy

import numpy as np
import pytest

import mdfconv
from mdfconv.fitting import metrics
from mdfconv.fitting.metrics import metric_named, register_metric
from mdfconv.fitting.metrics.base import Display, Energy, Environment, Unit
from mdfconv.fitting.problem import ConversionTask
from mdfconv.fitting.solve import cold_fit, fit
from tests.fitting import brute_force
from tests.fitting.test_fit import NAMES, candidates


class CubeRoot(Energy):
    """The light under a cube root, as lightness is of luminance."""

    name = "cube-root"

    def encode(self, value):
        return np.cbrt(value)

    def encode_slope(self, value):
        return np.maximum(value, 1e-300) ** (-2 / 3) / 3


@pytest.fixture
def metric(monkeypatch):
    monkeypatch.setattr(metrics, "_REGISTRY", copy.deepcopy(metrics._REGISTRY))
    register_metric(CubeRoot)
    return metric_named("cube-root")


def minimum(source, value, target):
    """Return the fit by a dense rule and a search that share no code with the fit's."""
    width = mdfconv.distribution(source).half_width(value)
    half_tangent = np.tan(width)
    scanned = candidates(target, mdfconv.distribution(target).from_half_tangent(half_tangent))
    return brute_force.minimum("cube-root", source, value, target, width, scanned)


@pytest.mark.parametrize(
    ("source", "target"),
    [*(("beckmann", name) for name in NAMES if name != "beckmann"), ("schlick", "gauss")],
)
def test_every_target_is_fitted_at_the_minimum(metric, source, target):
    values = np.array([0.01, 0.2, 0.4])
    ends = mdfconv.distribution(source), mdfconv.distribution(target)
    exact = [minimum(source, value, target) for value in values]
    assert fit(ends[0], values, ends[1], metric).parameter == pytest.approx(exact, rel=3e-8)


def test_many_values_are_fitted_at_the_minimum(metric):
    """More than the knots of a curve, each then by a few angles."""
    ends = mdfconv.distribution("beckmann"), mdfconv.distribution("schlick")
    values = np.geomspace(0.01, 0.5, 70)
    many = fit(ends[0], values, ends[1], metric).parameter
    cold = cold_fit(ConversionTask(ends[0], values, ends[1], metric)).parameter
    assert many == pytest.approx(cold, rel=1e-8)


def test_only_roots_are_steep(metric):
    assert metric.root == pytest.approx(3)
    for usual in (Unit(), Energy(), Display(), Display(0.25), Display(4), Environment()):
        assert usual.root == 1


def test_a_metric_without_an_oracle_says_so():
    with pytest.raises(LookupError, match="no oracle for the metric lightness: add it to"):
        brute_force.minimum("lightness", "ggx", 0.2, "gauss", 0.2, np.array([0.1, 0.2]))
