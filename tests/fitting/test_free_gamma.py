"""Fits with two free parameters, and the least squares in which their rows advance together."""

import numpy as np
import pytest
from scipy import optimize

import mdfconv
from mdfconv.fitting.free_gamma import fit_free_gamma, least_squares
from mdfconv.fitting.metrics import metric_named
from mdfconv.fitting.metrics.base import Energy, Unit
from mdfconv.fitting.problem import ConversionTask

GTR = mdfconv.distribution("gtr")
TARGETS = ("gtr", "student-t")


def test_gamma_comes_back():
    found = fit_free_gamma(GTR.with_gamma(3), np.array([0.2]), GTR, Energy())
    assert found.parameter[0] == pytest.approx(0.2, rel=1e-4)
    assert found.gamma[0] == pytest.approx(3, rel=1e-4)
    assert abs(found.distance[0]) < 1e-12
    assert not found.at_limit[0]


def test_a_gaussian_is_the_limit_of_gtr():
    limited = fit_free_gamma(mdfconv.distribution("beckmann"), np.array([0.2]), GTR, Unit())
    assert (limited.gamma[0], limited.at_limit[0]) == (64, True)


def test_one_parameter_has_no_gamma():
    with pytest.raises(ValueError, match="ggx has one parameter"):
        fit_free_gamma(GTR, np.array([0.2]), mdfconv.distribution("ggx"), Unit())


def test_no_values():
    assert fit_free_gamma(GTR, np.empty(0), GTR, Unit()).gamma.shape == (0,)


@pytest.mark.parametrize("metric", ["unit", "energy", "display", "display:4", "environment"])
@pytest.mark.parametrize("target", TARGETS)
def test_no_pair_nearby_or_far_is_better(metric, target):
    """Against the distances of a scan of pairs, each on a quadrature of its own."""
    source, metric = mdfconv.distribution("schlick"), metric_named(metric)
    entry, values = mdfconv.distribution(target), np.array([0.05, 0.3])
    found = fit_free_gamma(source, values, entry, metric)
    low, high = entry.parameters[1].fit_range
    for row, value in enumerate(values):
        near = found.gamma[row] * np.array([0.98, 0.999, 1, 1.001, 1.02])
        for gamma in np.clip(np.append(near, np.geomspace(low, high, 9)), low, high):
            task = ConversionTask(source, np.array([value]), entry.with_gamma(gamma), metric)
            best = mdfconv.fitting.solve.cold_fit(task)
            if not np.isnan(best.distance[0]):
                assert best.distance[0] >= found.distance[row] * (1 - 1e-5)


@pytest.mark.parametrize("target", TARGETS)
def test_rows_together_are_rows_alone(target):
    source, metric = mdfconv.distribution("sawicki"), Energy()
    values, entry = np.geomspace(5, 1e5, 70), mdfconv.distribution(target)
    together = fit_free_gamma(source, values, entry, metric)
    for row in (0, 33, 69):
        alone = fit_free_gamma(source, values[[row]], entry, metric)
        for one, many in ((alone.parameter, together.parameter), (alone.gamma, together.gamma)):
            assert one[0] == pytest.approx(many[row], rel=1e-6)


def test_least_squares_against_scipy():
    """Decays with noise, some of which a bound holds."""
    rng = np.random.default_rng(3)
    time = np.linspace(0, 3, 40)
    truth = np.stack([rng.uniform(0.5, 2, 30), rng.uniform(0.3, 3, 30)], axis=1)
    noise = 0.05 * rng.standard_normal((30, 40))

    def model(x):
        return x[..., :1] * np.exp(-x[..., 1:] * time)

    data = model(truth) + noise
    low, high = np.array([0.0, 0.5]), np.array([1.5, np.inf])
    start = np.full((30, 2), 1.0)
    at, distance = least_squares(lambda x: model(x) - data, start, low, high)
    held = 0
    for row in range(30):
        wanted = optimize.least_squares(
            lambda x, row=row: model(x) - data[row], start[row], bounds=(low, high),
            xtol=1e-15, ftol=1e-15, gtol=1e-15,
        )  # fmt: skip
        np.testing.assert_allclose(at[row], wanted.x, rtol=1e-6)
        assert distance[row] == pytest.approx(2 * wanted.cost, rel=1e-9)
        held += at[row, 0] == 1.5 or at[row, 1] == 0.5
    assert held
