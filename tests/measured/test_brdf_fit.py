"""Fits to samples of two directions, of BRDFs that are computed here."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import mdfconv
from mdfconv.brdf.microfacet import Microsurface
from mdfconv.distributions import one_parameter_distributions
from mdfconv.errors import MdfconvError
from mdfconv.measured.analysis import rank
from mdfconv.measured.brdf_fit import BrdfModel, fit_distribution
from mdfconv.measured.samples import directional_samples

INCIDENCES = np.radians([5, 15, 25, 35, 45, 55, 62, 68])
NAMES = [mdf.name for mdf in one_parameter_distributions()]
TRUTH = {"blinn-phong": 50.0, "sawicki": 60.0, "smoothie": 0.4} | {
    name: 0.2 for name in NAMES if name not in ("blinn-phong", "sawicki", "smoothie")
}
SMITH = {"beckmann", "ggx", "smoothie"}


def directions(rng, count=12, incidences=INCIDENCES):
    """Return samples around the mirror direction and over the plane of incidence."""
    theta = np.repeat(incidences, count)
    near = theta + 0.25 * rng.standard_normal(theta.size)
    wide = rng.uniform(-1.4, 1.4, theta.size)
    outgoing = np.where(np.arange(theta.size) % 2 == 0, np.clip(near, -1.45, 1.45), wide)
    azimuth = np.pi + rng.choice([0, 0.1, -0.3], theta.size)
    ones = np.ones((theta.size, 1))
    return directional_samples(Path("made"), theta, 0 * theta, outgoing, azimuth, ones, ("v",))


def v_cavity(data, half):
    least = np.minimum(data.incident[:, 2], data.outgoing[:, 2])
    return np.minimum(1, 2 * half[:, 2] * least / (data.incident * half).sum(axis=1))


def brdf(data, name, parameter, gamma=None, reflectance=None, masking="smith", index=None):
    """Return D G F / (4 cos cos), from the definitions."""
    entry = mdfconv.distribution(name)
    half = data.incident + data.outgoing
    half = half / np.sqrt((half**2).sum(axis=1))[:, None]
    cosine = (data.incident * half).sum(axis=1)
    d = entry.normalized(np.arccos(np.minimum(half[:, 2], 1)), parameter, gamma=gamma)
    g = 1.0
    if masking == "smith" and name in SMITH:
        g = Microsurface(entry, parameter).correlated(data.incident, data.outgoing, half)
    elif masking != "none":
        g = v_cavity(data, half)
    f = 1.0 if reflectance is None else reflectance + (1 - reflectance) * (1 - cosine) ** 5
    if index is not None:
        f = dielectric(cosine, index)
    return d * g * f / (4 * data.incident[:, 2] * data.outgoing[:, 2])


def dielectric(cosine, index):
    """Return Fresnel's reflectance for unpolarized light, by Snell's law."""
    theta = np.arccos(cosine)
    refracted = np.arcsin(np.sin(theta) / index)
    s = np.sin(theta - refracted) / np.sin(theta + refracted)
    p = np.tan(theta - refracted) / np.tan(theta + refracted)
    return (s**2 + p**2) / 2


def measured(rng, name, *, noise=0.01, diffuse=(0.3,), specular=(0.8,), count=12, **rest):
    data = directions(rng, count)
    lobe = brdf(data, name, TRUTH[name], **rest)
    values = np.array(diffuse) / np.pi + lobe[:, None] * np.array(specular)
    values = values * (1 + noise * rng.standard_normal(values.shape))
    return replace(data, values=values, channels=tuple("RGB"[: len(diffuse)]))


def gamma_of(name):
    return {"gamma": 3.0} if mdfconv.distribution(name).second_parameter else {}


@pytest.mark.parametrize("loss", ["linear", "log", "cosine"])
@pytest.mark.parametrize("name", NAMES)
def test_exact_data_come_back(name, loss):
    data = measured(np.random.default_rng(1), name, noise=0, **gamma_of(name))
    found = fit_distribution(data, mdfconv.distribution(name), BrdfModel(loss=loss))
    assert found.parameters[mdfconv.distribution(name).parameter.name] == pytest.approx(
        TRUTH[name], rel=1e-4
    )
    if gamma_of(name):
        assert found.parameters["gamma"] == pytest.approx(3, rel=1e-3)
    assert found.linear["diffuse"][0] == pytest.approx(0.3, rel=1e-4)
    assert found.linear["specular"][0] == pytest.approx(0.8, rel=1e-3)
    assert found.error < 1e-4
    np.testing.assert_allclose(found.model(data), data.values, rtol=1e-3)
    assert found.masking == ("smith" if name in SMITH else "v-cavity")


@pytest.mark.parametrize("name", NAMES)
def test_truth_within_three_standard_errors(name):
    deviations = []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        data = measured(rng, name, diffuse=(0.3, 0.1), specular=(0.8, 0.5), **gamma_of(name))
        found = fit_distribution(data, mdfconv.distribution(name), BrdfModel(loss="log"))
        wanted = {mdfconv.distribution(name).parameter.name: TRUTH[name], **gamma_of(name)}
        deviations += [
            abs(found.parameters[key] - truth) / found.errors[key] for key, truth in wanted.items()
        ]
        for values, errors, truth in (
            (found.linear["diffuse"], found.linear_errors["diffuse"], (0.3, 0.1)),
            (found.linear["specular"], found.linear_errors["specular"], (0.8, 0.5)),
        ):
            deviations += (np.abs(np.subtract(values, truth)) / errors).tolist()
    deviations = np.array(deviations)
    # 99.7 % of a normal distribution; not too few beyond one either.
    assert (deviations < 3).mean() > 0.97
    assert 0.15 < (deviations > 1).mean() < 0.5


def test_reflectance_comes_back_with_its_error():
    deviations = []
    for seed in range(20):
        data = measured(np.random.default_rng(seed), "ggx", reflectance=0.3)
        found = fit_distribution(
            data, mdfconv.distribution("ggx"), BrdfModel(loss="log", fresnel="fit")
        )
        deviations.append(abs(found.parameters["reflectance"] - 0.3) / found.errors["reflectance"])
        assert not found.notes
    assert max(deviations) < 4


def test_one_angle_of_incidence_does_not_tell_the_reflectance():
    rng = np.random.default_rng(4)
    data = directions(rng, 60, INCIDENCES[2:3])
    values = 0.1 + brdf(data, "ggx", 0.2, reflectance=0.3)
    data = replace(data, values=(values * (1 + 0.01 * rng.standard_normal(values.size)))[:, None])
    found = fit_distribution(
        data, mdfconv.distribution("ggx"), BrdfModel(loss="log", fresnel="fit")
    )
    assert found.notes == ("the data do not tell reflectance and specular apart",)


@pytest.mark.parametrize("masking", ["v-cavity", "none"])
def test_masking(masking):
    data = measured(np.random.default_rng(5), "ggx", noise=0, masking=masking)
    found = fit_distribution(data, mdfconv.distribution("ggx"), BrdfModel(masking=masking))
    assert found.parameters["alpha"] == pytest.approx(0.2, rel=1e-5)
    assert found.masking == masking


@pytest.mark.parametrize(
    ("fresnel", "made"), [("schlick", {"reflectance": 0.04}), ("ior:1.7", {"index": 1.7})]
)
def test_fresnel(fresnel, made):
    data = measured(np.random.default_rng(5), "ggx", noise=0, **made)
    found = fit_distribution(data, mdfconv.distribution("ggx"), BrdfModel(fresnel=fresnel))
    assert found.parameters["alpha"] == pytest.approx(0.2, rel=1e-4)
    assert found.linear["specular"][0] == pytest.approx(0.8, rel=1e-3)


def test_outliers():
    data = measured(np.random.default_rng(6), "beckmann", count=30)
    values = data.values.copy()
    values[::15] *= 3
    data = replace(data, values=values)
    beckmann = mdfconv.distribution("beckmann")
    plain, robust = (
        fit_distribution(data, beckmann, BrdfModel(loss="log", robust=robust))
        for robust in (False, True)
    )
    assert abs(robust.parameters["alpha"] - 0.2) < 0.5 * abs(plain.parameters["alpha"] - 0.2)
    assert robust.parameters["alpha"] == pytest.approx(0.2, rel=2e-3)


def test_the_model_of_the_data_ranks_first():
    data = measured(np.random.default_rng(7), "sawicki", count=30)
    fits = [
        fit_distribution(data, mdf, BrdfModel(loss="log")) for mdf in one_parameter_distributions()
    ]
    ranked = rank(fits)
    assert ranked[0].distribution.name == "sawicki"
    assert ranked[0].aic == min(fit.aic for fit in fits)


def test_many_samples_are_fitted_as_all_of_them():
    """More than those from which a fit starts."""
    data = measured(np.random.default_rng(8), "ggx", count=4000)
    found = fit_distribution(data, mdfconv.distribution("beckmann"), BrdfModel(loss="log"))
    half = np.random.default_rng(1).random(len(data.values)) < 0.5
    part = fit_distribution(
        replace(
            data,
            incident=data.incident[half],
            outgoing=data.outgoing[half],
            values=data.values[half],
        ),
        mdfconv.distribution("beckmann"),
        BrdfModel(loss="log"),
    )
    assert found.parameters["alpha"] == pytest.approx(part.parameters["alpha"], rel=0.05)
    for other in (0.999, 1.001):
        moved = mdfconv.distribution("beckmann")
        assert log_error(data, moved, found.parameters["alpha"] * other) >= found.error * (1 - 1e-9)


def log_error(data, mdf, alpha):
    """Return the least log RMSE over k_d and k_s, by a search of its own."""
    from scipy.optimize import minimize

    lobe = brdf(data, mdf.name, alpha)
    values = data.values[:, 0]

    def cost(x):
        return np.mean((np.log(np.exp(x[0]) + np.exp(x[1]) * lobe) - np.log(values)) ** 2)

    return np.sqrt(minimize(cost, [-2.0, 0.0], method="Nelder-Mead", tol=1e-12).fun)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda values: 0 * values + 1, "all values are equal"),
        (lambda values: -values, "no value is positive"),
        (lambda values: 1 / values, "do not rise towards the mirror direction"),
    ],
)
def test_nothing_to_fit(change, message):
    data = measured(np.random.default_rng(9), "ggx", diffuse=(0.01,), noise=0)
    with pytest.raises(MdfconvError, match=message):
        fit_distribution(replace(data, values=change(data.values)), mdfconv.distribution("ggx"))


def test_too_few_samples():
    data = directions(np.random.default_rng(1), 1, INCIDENCES[:3])
    with pytest.raises(MdfconvError, match="3 values are too few to fit 3 unknowns of ggx"):
        fit_distribution(data, mdfconv.distribution("ggx"))


@pytest.mark.parametrize(
    "options",
    [{"loss": "cubic"}, {"masking": "some"}, {"fresnel": "much"}, {"fresnel": "ior:0"}],
)
def test_unknown_options(options):
    with pytest.raises(MdfconvError, match="unknown"):
        BrdfModel(**options)
