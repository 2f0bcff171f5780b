"""Fits to samples: true parameters come back, with errors that mean what they say."""

import numpy as np
import pytest
from scipy.optimize import curve_fit

import mdfconv
from mdfconv.distributions.gtr import GTR
from mdfconv.measured.lobe_fit import fit_lobe, foreshortening, rank, simplest
from mdfconv.measured.samples import Samples

BETA = np.radians(np.arange(0, 88, 1.5))
TRUTH = {
    "beckmann": 0.2, "gauss": 0.25, "ggx": 0.3, "blinn-phong": 60.0, "schlick": 0.3,
    "sawicki": 40.0, "smoothie": 0.5,
}  # fmt: skip


def synthetic(name, rng=None, noise=0.01, quantity="ndf", offsets=(0.05,), scales=(2.0,)):
    lobe = mdfconv.distribution(name).unit(BETA, TRUTH[name]) / foreshortening(BETA, quantity)
    values = np.array(offsets) + lobe[:, None] * np.array(scales)
    if rng is not None:
        values = values + noise * max(scales) * rng.normal(size=values.shape)
    channels = ("R", "G", "B")[: len(scales)]
    return Samples(BETA, values, channels, quantity)


@pytest.mark.parametrize("loss", ["linear", "log"])
@pytest.mark.parametrize("quantity", ["ndf", "brdf"])
@pytest.mark.parametrize("name", TRUTH)
def test_exact_data_comes_back(name, quantity, loss):
    data = synthetic(name, quantity=quantity, offsets=(0.05, 0.1, 0.2), scales=(2.0, 1.0, 0.5))
    found = fit_lobe(data, mdfconv.distribution(name), loss)
    assert found.parameters[0] == pytest.approx(TRUTH[name], rel=1e-6)
    np.testing.assert_allclose(found.offset, (0.05, 0.1, 0.2), rtol=1e-5)
    np.testing.assert_allclose(found.scale, (2.0, 1.0, 0.5), rtol=1e-5)
    model = found.model(BETA, quantity)
    np.testing.assert_allclose(model, data.values, rtol=1e-4)


def test_gtr_finds_gamma():
    lobe = GTR(2.8).unit(BETA, 0.25)
    data = Samples(BETA, 0.1 + 3 * lobe[:, None], ("1",), "ndf")
    found = fit_lobe(data, GTR())
    assert found.parameters == pytest.approx((0.25, 2.8), rel=1e-5)
    fixed = fit_lobe(data, GTR(), gamma=2)
    assert len(fixed.parameters) == 1
    assert fixed.parameters[0] == pytest.approx(
        fit_lobe(data, mdfconv.distribution("ggx")).parameters[0], rel=1e-6
    )


def test_standard_errors_cover_the_truth():
    rng = np.random.default_rng(20211)
    names = list(TRUTH)
    within = 0
    for trial in range(200):
        name = names[trial % len(names)]
        found = fit_lobe(synthetic(name, rng), mdfconv.distribution(name))
        within += abs(found.parameters[0] - TRUTH[name]) <= 3 * found.errors[0]
    assert within >= 190


def test_parameter_and_error_against_curve_fit():
    data = synthetic("ggx", np.random.default_rng(3))
    found = fit_lobe(data, mdfconv.distribution("ggx"))

    def model(beta, a, offset, scale):
        return offset + scale * (a**2 / (a**2 + (1 - a**2) * np.sin(beta) ** 2)) ** 2

    best, covariance = curve_fit(
        model, BETA, data.values[:, 0], p0=(0.2, 0, 1), xtol=1e-14, ftol=1e-14
    )
    assert found.parameters[0] == pytest.approx(best[0], rel=1e-7)
    assert (found.offset[0], found.scale[0]) == pytest.approx(tuple(best[1:]), rel=1e-6)
    assert found.errors[0] == pytest.approx(np.sqrt(covariance[0, 0]), rel=1e-3)
    residual = data.values[:, 0] - model(BETA, *best)
    assert found.rmse == pytest.approx(np.sqrt(np.mean(residual**2)), rel=1e-9)
    n, cost = BETA.size, np.sum(residual**2)
    assert found.aic == pytest.approx(n * np.log(cost / n) + 6)
    assert found.bic == pytest.approx(n * np.log(cost / n) + 3 * np.log(n))


def test_logarithmic_loss_against_curve_fit():
    rng = np.random.default_rng(5)
    data = synthetic("gauss")
    noisy = data.values * np.exp(0.02 * rng.normal(size=data.values.shape))
    found = fit_lobe(Samples(BETA, noisy, ("1",), "ndf"), mdfconv.distribution("gauss"), "log")

    def model(beta, m, offset, scale):
        return np.log(np.maximum(offset + scale * np.exp(-((beta / m) ** 2)), 1e-9))

    best, covariance = curve_fit(
        model, BETA, np.log(noisy[:, 0]), p0=(0.25, 0.05, 2), xtol=1e-14, ftol=1e-14
    )
    assert found.parameters[0] == pytest.approx(best[0], rel=1e-6)
    assert found.errors[0] == pytest.approx(np.sqrt(covariance[0, 0]), rel=1e-2)


def test_ranking_and_the_simplest():
    data = synthetic("ggx", np.random.default_rng(8), offsets=(0.1, 0.1), scales=(2.0, 1.0))
    fits = [fit_lobe(data, entry) for entry in mdfconv.list_distributions()]
    ranked = rank(fits, "linear")
    assert [entry.rmse for entry in ranked] == sorted(entry.rmse for entry in fits)
    assert simplest(fits, 0.05, "linear").distribution.name == "ggx"
    assert simplest(fits, 1e9, "linear").distribution.name == "ggx"
    assert simplest(fits, 0, "linear") in ranked[:3]


@pytest.mark.parametrize(
    ("values", "words"),
    [
        (np.ones((10, 1)), "all values are equal"),
        (np.arange(3.0)[:, None], "too few"),
    ],
)
def test_nothing_to_fit(values, words):
    beta = np.linspace(0, 1, len(values))
    with pytest.raises(ValueError, match=words):
        fit_lobe(Samples(beta, values, ("1",), "ndf"), mdfconv.distribution("ggx"))


@pytest.mark.parametrize("unit", [1e-200, 1e-7, 1e8, 1e200])
def test_units_do_not_matter(unit):
    data = synthetic("ggx", np.random.default_rng(3))
    one = fit_lobe(data, mdfconv.distribution("ggx"))
    scaled = Samples(BETA, data.values * unit, data.channels, data.quantity)
    other = fit_lobe(scaled, mdfconv.distribution("ggx"))
    assert other.parameters == pytest.approx(one.parameters, rel=1e-7)
    assert other.errors == pytest.approx(one.errors, rel=1e-5)
    assert other.scale[0] == pytest.approx(one.scale[0] * unit, rel=1e-7)
    assert other.rmse == pytest.approx(one.rmse * unit, rel=1e-7)
    difference = 2 * data.values.size * np.log(unit)
    assert other.aic - one.aic == pytest.approx(difference, rel=1e-7)


def test_unknown_loss():
    with pytest.raises(ValueError, match="unknown loss"):
        fit_lobe(synthetic("ggx"), mdfconv.distribution("ggx"), "cubic")
