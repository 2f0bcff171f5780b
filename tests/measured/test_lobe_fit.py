"""Fits to samples: true parameters come back, with errors that mean what they say."""

import itertools

import numpy as np
import pytest
from scipy import stats
from scipy.optimize import curve_fit, least_squares

import mdfconv
from mdfconv.measured import brdf_fit
from mdfconv.measured.analysis import fit
from mdfconv.measured.model import BrdfModel, foreshortening
from mdfconv.measured.samples import Samples
from mdfconv.measured.validation import validated

BETA = np.radians(np.arange(0, 88, 1.5))
TRUTH = {
    "beckmann": 0.2, "gauss": 0.25, "ggx": 0.3, "blinn-phong": 60.0, "schlick": 0.3,
    "sawicki": 40.0, "smoothie": 0.5,
}  # fmt: skip


# Additive noise: every difference counts as much.
LEAST_SQUARES = BrdfModel(loss="linear", robust=False)


def fit_distribution(data, target, model=LEAST_SQUARES, **options):
    return brdf_fit.fit_distribution(data, target, model, **options)


def values(record):
    return tuple(record.values())


def first(record):
    return values(record)[0]


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
    fit = fit_distribution(data, mdfconv.distribution(name), BrdfModel(loss, robust=False))
    assert fit.parameter == pytest.approx(TRUTH[name], rel=1e-6)
    np.testing.assert_allclose(fit.linear["offset"], (0.05, 0.1, 0.2), rtol=1e-5)
    np.testing.assert_allclose(fit.linear["scale"], (2.0, 1.0, 0.5), rtol=1e-5)
    model = fit.model(data)
    np.testing.assert_allclose(model, data.values, rtol=1e-4)


def of_two_parameters(name, alpha, gamma, quantity="ndf"):
    lobe = mdfconv.distribution(name).unit(BETA, alpha, gamma=gamma)
    lobe = lobe / foreshortening(BETA, quantity)
    return Samples(BETA, 0.1 + 3 * lobe[:, None], ("1",), quantity)


TWO_PARAMETERS = [
    ("gtr", 0.25, 2.8),
    ("gtr", 0.4, 0.6),
    ("student-t", 0.25, 2.8),
    ("student-t", 0.05, 5.0),
    ("student-t", 0.6, 2.3),
    # Beyond α² = γ/(2(γ−1)) the maximum is off the normal.
    ("student-t", 1.5, 20.0),
]


@pytest.mark.parametrize("loss", ["linear", "log"])
@pytest.mark.parametrize("quantity", ["ndf", "brdf"])
@pytest.mark.parametrize(("name", "alpha", "gamma"), TWO_PARAMETERS)
def test_gamma_comes_back(name, alpha, gamma, quantity, loss):
    data = of_two_parameters(name, alpha, gamma, quantity)
    fit = fit_distribution(data, mdfconv.distribution(name), BrdfModel(loss, robust=False))
    assert values(fit.parameters) == pytest.approx((alpha, gamma), rel=1e-5)
    assert fit.distribution.gamma == fit.parameters["gamma"]
    assert not fit.at_limit
    np.testing.assert_allclose(fit.model(data), data.values, rtol=1e-4)


@pytest.mark.parametrize("name", ["gtr", "student-t"])
def test_a_gamma_that_is_given_is_kept(name):
    data = of_two_parameters(name, 0.25, 2.8)
    fixed = fit_distribution(data, mdfconv.distribution(name), gamma=2)
    assert len(fixed.parameters) == 1
    assert not fixed.at_limit
    # Both are GGX at 2; a distribution without γ does not ask for it.
    ggx = fit_distribution(data, mdfconv.distribution("ggx"), gamma=2)
    assert fixed.parameters == pytest.approx(ggx.parameters, rel=1e-6)
    with pytest.raises(ValueError, match="outside the legal range"):
        fit_distribution(data, mdfconv.distribution(name), gamma=-1)


def test_a_gamma_at_the_end_of_its_range_is_told():
    # γ = 2 is GGX, below it there is nothing; Beckmann is γ → ∞.
    student = mdfconv.distribution("student-t")
    ends = student.second_parameter.fit_range
    for name, gamma in (("ggx", ends[0]), ("beckmann", ends[1])):
        fit = fit_distribution(synthetic(name), student)
        assert fit.at_limit
        assert values(fit.parameters) == pytest.approx((TRUTH[name], gamma), rel=2e-3)
    assert not fit_distribution(synthetic("ggx"), mdfconv.distribution("gtr")).at_limit


def test_standard_errors_of_gamma_cover_the_truth():
    rng = np.random.default_rng(17)
    cases = list(itertools.islice(itertools.cycle(TWO_PARAMETERS[:5]), 40))
    within = 0
    for name, alpha, gamma in cases:
        exact = of_two_parameters(name, alpha, gamma)
        noisy = exact.values + 0.01 * rng.normal(size=exact.values.shape)
        fit = fit_distribution(Samples(BETA, noisy, ("1",), "ndf"), mdfconv.distribution(name))
        off = np.abs(np.subtract(values(fit.parameters), (alpha, gamma)))
        within += bool((off <= 3 * np.array(values(fit.errors))).all())
    assert within >= 37


def test_standard_errors_cover_the_truth():
    rng = np.random.default_rng(20211)
    names = list(TRUTH)
    within = 0
    for trial in range(200):
        name = names[trial % len(names)]
        fit = fit_distribution(synthetic(name, rng), mdfconv.distribution(name))
        within += abs(fit.parameter - TRUTH[name]) <= 3 * first(fit.errors)
    assert within >= 190


def test_parameter_and_error_against_curve_fit():
    data = synthetic("ggx", np.random.default_rng(3))
    fit = fit_distribution(data, mdfconv.distribution("ggx"))

    def model(beta, a, offset, scale):
        return offset + scale * (a**2 / (a**2 + (1 - a**2) * np.sin(beta) ** 2)) ** 2

    best, covariance = curve_fit(
        model, BETA, data.values[:, 0], p0=(0.2, 0, 1), xtol=1e-14, ftol=1e-14
    )
    assert fit.parameter == pytest.approx(best[0], rel=1e-7)
    assert (fit.linear["offset"][0], fit.linear["scale"][0]) == pytest.approx(
        tuple(best[1:]), rel=1e-6
    )
    # Of few samples the spread of the residuals is uncertain, too: Student's t, of one σ.
    factor = stats.t.ppf(stats.norm.cdf(1), BETA.size - 3)
    assert first(fit.errors) == pytest.approx(factor * np.sqrt(covariance[0, 0]), rel=1e-3)
    residual = data.values[:, 0] - model(BETA, *best)
    assert fit.rmse == pytest.approx(np.sqrt(np.mean(residual**2)), rel=1e-9)
    n, cost = BETA.size, np.sum(residual**2)
    assert fit.bic == pytest.approx(n * np.log(cost / n) + 3 * np.log(n))


def test_logarithmic_loss_against_curve_fit():
    rng = np.random.default_rng(5)
    data = synthetic("gauss")
    noisy = data.values * np.exp(0.02 * rng.normal(size=data.values.shape))
    fit = fit_distribution(
        Samples(BETA, noisy, ("1",), "ndf"),
        mdfconv.distribution("gauss"),
        BrdfModel("log", robust=False),
    )

    def model(beta, m, offset, scale):
        return np.log(np.maximum(offset + scale * np.exp(-((beta / m) ** 2)), 1e-9))

    best, covariance = curve_fit(
        model, BETA, np.log(noisy[:, 0]), p0=(0.25, 0.05, 2), xtol=1e-14, ftol=1e-14
    )
    assert fit.parameter == pytest.approx(best[0], rel=1e-6)
    assert first(fit.errors) == pytest.approx(np.sqrt(covariance[0, 0]), rel=1e-2)


@pytest.mark.parametrize("loss", ["linear", "log"])
@pytest.mark.parametrize("name", ["beckmann", "blinn-phong", "sawicki"])
def test_a_shape_that_does_not_fit_has_its_least_squares_too(name, loss):
    """Where the residuals are no noise, JᵀJ is not the Hessian."""
    truth = of_two_parameters("gtr", 0.2, 1.2)
    found = fit_distribution(truth, name, BrdfModel(loss, robust=False))
    wanted, mdf = truth.values[:, 0], mdfconv.distribution(name)
    shown = np.log if loss == "log" else np.asarray

    def residual(x):
        near = np.exp(x[1]) + np.exp(x[2]) * mdf.unit(BETA, float(np.exp(x[0])))
        return shown(near) - shown(wanted)

    start = np.log([found.parameter, found.linear["offset"][0], found.linear["scale"][0]])
    least = least_squares(residual, start + 0.1, xtol=1e-14, ftol=1e-14, gtol=1e-14)
    assert found.error > 0.02 * (1 if loss == "log" else wanted.max())
    assert found.parameter == pytest.approx(np.exp(least.x[0]), rel=1e-5)
    assert found.error == pytest.approx(np.sqrt(np.mean(least.fun**2)), rel=1e-9)


@pytest.mark.parametrize("loss", ["linear", "log"])
def test_the_validated_error_is_that_of_samples_left_out(loss):
    """Every fifth block of a scan, of 25, is left out of a fit of its own."""
    data = synthetic("ggx", np.random.default_rng(4), noise=0.003)
    model = BrdfModel(loss, robust=False)
    shown = np.log if loss == "log" else np.asarray
    block = np.arange(len(BETA)) * 25 // len(BETA) % 5
    errors = []
    for fold in range(5):
        out = block == fold
        alone = fit_distribution(data.select(~out), "beckmann", model)
        near = alone.model(data.select(out))
        errors.append(np.mean((shown(near) - shown(data.values[out])) ** 2))
    found = validated(data, fit_distribution(data, "beckmann", model))
    assert found.validated_error == pytest.approx(np.sqrt(np.mean(errors)), rel=1e-4)


def test_ranking_and_the_simplest():
    data = synthetic("ggx", np.random.default_rng(8), offsets=(0.1, 0.1), scales=(2.0, 1.0))
    (result,) = fit(data, loss="linear").results
    assert result.recommended.name == "ggx"
    errors = [one.validated_error for one in result.fits]
    assert errors == sorted(errors)


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
        fit_distribution(Samples(beta, values, ("1",), "ndf"), mdfconv.distribution("ggx"))


@pytest.mark.parametrize("unit", [1e-200, 1e-7, 1e8, 1e200])
def test_units_do_not_matter(unit):
    data = synthetic("ggx", np.random.default_rng(3))
    one = fit_distribution(data, mdfconv.distribution("ggx"))
    scaled = Samples(BETA, data.values * unit, data.channels, data.quantity)
    other = fit_distribution(scaled, mdfconv.distribution("ggx"))
    assert other.parameters == pytest.approx(one.parameters, rel=1e-7)
    assert other.errors == pytest.approx(one.errors, rel=1e-5)
    assert other.linear["scale"][0] == pytest.approx(one.linear["scale"][0] * unit, rel=1e-7)
    assert other.rmse == pytest.approx(one.rmse * unit, rel=1e-7)
    difference = 2 * data.values.size * np.log(unit)
    assert other.bic - one.bic == pytest.approx(difference, rel=1e-7)


def test_unknown_loss():
    with pytest.raises(ValueError, match="unknown loss"):
        fit_distribution(synthetic("ggx"), mdfconv.distribution("ggx"), BrdfModel("cubic"))
