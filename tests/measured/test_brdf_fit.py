"""Fits to samples of two directions, of BRDFs that are computed here."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import mdfconv
from mdfconv.distributions import one_parameter_distributions
from mdfconv.errors import MdfconvError
from mdfconv.measured.analysis import fit, ranked
from mdfconv.measured.brdf_fit import fit_distribution
from mdfconv.measured.model import TWO_LOBES, BrdfModel, all_candidates
from mdfconv.measured.samples import directional_samples

INCIDENCES = np.radians([5, 15, 25, 35, 45, 55, 62, 68])
NAMES = [mdf.name for mdf in one_parameter_distributions()]
TRUTH = {"blinn-phong": 50.0, "sawicki": 60.0, "smoothie": 0.4} | {
    name: 0.2 for name in NAMES if name not in ("blinn-phong", "sawicki", "smoothie")
}


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


def smith(entry, parameter, omega):
    """Return Λ from the projected area of the facets: over their azimuth in closed form."""
    x, weight = np.polynomial.legendre.leggauss(400)
    theta = np.arctan2(np.hypot(omega[:, 0], omega[:, 1]), omega[:, 2])[:, None]
    # Of facets that are seen from behind at some azimuth: cos θ cos β + sin θ sin β cos φ < 0.
    beta = np.pi / 2 - 0.5 * theta * (1 - x)
    edge = np.arccos(np.clip(-1 / (np.tan(theta) * np.tan(beta)), -1, 1))
    behind = np.sin(edge) * np.sin(theta) * np.sin(beta)
    behind -= (np.pi - edge) * np.cos(theta) * np.cos(beta)
    density = entry.normalized(beta, parameter) * np.sin(beta)
    return (density * behind * theta * weight).sum(axis=1) / omega[:, 2]


def brdf(data, name, parameter, gamma=None, reflectance=None, masking="smith", index=None):
    """Return D G F / (4 cos cos), from the definitions."""
    entry = mdfconv.distribution(name)
    half = data.incident + data.outgoing
    half = half / np.sqrt((half**2).sum(axis=1))[:, None]
    cosine = (data.incident * half).sum(axis=1)
    d = entry.normalized(np.arccos(np.minimum(half[:, 2], 1)), parameter, gamma=gamma)
    g = 1.0
    if masking == "smith":
        shape = entry if gamma is None else entry.with_gamma(gamma)
        g = 1 / (
            1 + smith(shape, parameter, data.incident) + smith(shape, parameter, data.outgoing)
        )
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


def measured(
    rng, name, *, noise=0.01, diffuse=(0.3,), specular=(0.8,), count=12, around=INCIDENCES, **rest
):
    data = directions(rng, count, around)
    lobe = brdf(data, name, TRUTH[name], **rest)
    values = np.array(diffuse) / np.pi + lobe[:, None] * np.array(specular)
    values = values * (1 + noise * rng.standard_normal(values.shape))
    return replace(data, values=values, channels=tuple("RGB"[: len(diffuse)]))


def gamma_of(name):
    return {"gamma": 3.0} if mdfconv.distribution(name).second_parameter else {}


# F = 1 and k_s free: what the oracle computes unless it is told more.
LOSSLESS = {"fresnel": "none", "robust": False}
WHOLE = BrdfModel(robust=False)


@pytest.mark.parametrize("loss", ["linear", "log", "cosine", "cube-root"])
@pytest.mark.parametrize("name", NAMES)
def test_exact_data_come_back(name, loss):
    data = measured(np.random.default_rng(1), name, noise=0, **gamma_of(name))
    found = fit_distribution(data, name, BrdfModel(loss=loss, **LOSSLESS))
    assert found.parameter == pytest.approx(TRUTH[name], rel=1e-4)
    if gamma_of(name):
        assert found.parameters["gamma"] == pytest.approx(3, rel=1e-3)
    assert found.diffuse[0] == pytest.approx(0.3, rel=1e-4)
    assert found.specular[0] == pytest.approx(0.8, rel=1e-3)
    assert found.error < 1e-4
    np.testing.assert_allclose(found.model(data), data.values, rtol=1e-3)


@pytest.mark.parametrize("name", NAMES)
def test_truth_within_three_standard_errors(name):
    deviations = []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        data = measured(rng, name, diffuse=(0.3, 0.1), specular=(0.8, 0.5), **gamma_of(name))
        found = fit_distribution(data, name, BrdfModel(**LOSSLESS))
        wanted = {mdfconv.distribution(name).parameter.name: TRUTH[name], **gamma_of(name)}
        deviations += [
            abs(found.parameters[key] - truth) / found.errors[key] for key, truth in wanted.items()
        ]
        for values, errors, truth in (
            (found.diffuse, found.diffuse_error, (0.3, 0.1)),
            (found.specular, found.specular_error, (0.8, 0.5)),
        ):
            deviations += (np.abs(np.subtract(values, truth)) / errors).tolist()
    deviations = np.array(deviations)
    # 99.7 % of a normal distribution; not too few beyond one either.
    assert (deviations < 3).mean() > 0.97
    assert 0.15 < (deviations > 1).mean() < 0.5


def test_a_dielectric_has_its_index():
    """The strength of the lobe is that of Fresnel's factor: k_s is 1."""
    deviations = []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        data = measured(rng, "ggx", index=1.5, specular=(1.0, 1.0), diffuse=(0.3, 0.1))
        found = fit_distribution(data, "ggx", WHOLE)
        assert found.fresnel == "dielectric"
        assert found.f0 == pytest.approx([((found.n - 1) / (found.n + 1)) ** 2] * 2)
        assert found.specular == (1, 1)
        deviations += [abs(found.n - 1.5) / found.n_error]
        deviations += [abs(found.parameter - 0.2) / found.parameter_error]
    assert max(deviations) < 4
    assert np.median(deviations) < 1.2


def test_a_metal_has_its_reflectances():
    deviations = []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        data = metal(rng, (0.9, 0.6, 0.3), alpha=0.2)
        found = fit_distribution(data, "ggx", WHOLE)
        assert found.fresnel == "metal"
        deviations += (np.abs(np.subtract(found.f0, (0.9, 0.6, 0.3))) / found.f0_error).tolist()
        deviations += [abs(found.parameter - 0.2) / found.parameter_error]
    assert max(deviations) < 4
    assert 0.3 < np.median(deviations) < 1.2


def metal(rng, reflectances, alpha, noise=0.01):
    data = directions(rng)
    columns = [brdf(data, "ggx", alpha, reflectance=f0) for f0 in reflectances]
    values = np.stack(columns, axis=1) + 0.02 / np.pi
    values *= 1 + noise * rng.standard_normal(values.shape)
    return replace(data, values=values, channels=tuple("RGB"[: len(reflectances)]))


@pytest.mark.parametrize(("fresnel", "made"), [("dielectric", "index"), ("metal", "reflectance")])
def test_a_free_strength_comes_back(fresnel, made):
    truth = {"index": 1.7} if made == "index" else {"reflectance": 0.4}
    data = measured(np.random.default_rng(5), "ggx", noise=0, **truth)
    options = BrdfModel(fresnel=fresnel, free_specular=True, robust=False)
    found = fit_distribution(data, "ggx", options)
    assert found.specular[0] == pytest.approx(0.8, rel=1e-3)
    assert found.f0[0] == pytest.approx(truth.get("reflectance", (0.7 / 2.7) ** 2), rel=1e-2)
    assert found.specular_error[0] > 0
    assert found.f0_error[0] > 0


def test_a_free_strength_is_not_told_from_the_reflectance():
    """At one angle of incidence Fresnel's factor hardly varies."""
    rng = np.random.default_rng(4)
    data = directions(rng, 60, INCIDENCES[2:3])
    values = 0.1 + brdf(data, "ggx", 0.2, reflectance=0.3)
    data = replace(data, values=(values * (1 + 0.01 * rng.standard_normal(values.size)))[:, None])
    found = fit_distribution(data, "ggx", BrdfModel(fresnel="dielectric", free_specular=True))
    pair = [found.unknowns.index(name) for name in ("n", "k_s")]
    assert abs(found.correlation[pair[0], pair[1]]) > 0.99
    alone = fit_distribution(data, "ggx", BrdfModel(fresnel="metal"))
    assert alone.f0[0] == pytest.approx(0.3, rel=0.02)


@pytest.mark.parametrize("masking", ["v-cavity", "none"])
def test_masking(masking):
    data = measured(np.random.default_rng(5), "ggx", noise=0, masking=masking)
    found = fit_distribution(data, "ggx", BrdfModel(masking=masking, **LOSSLESS))
    assert found.parameter == pytest.approx(0.2, rel=1e-5)


def test_a_given_index():
    data = measured(np.random.default_rng(5), "ggx", noise=0, index=1.7, specular=(1.0,))
    found = fit_distribution(data, "ggx", BrdfModel(fresnel="ior:1.7", robust=False))
    assert found.parameter == pytest.approx(0.2, rel=1e-4)
    assert found.linear == {"diffuse": (pytest.approx(0.3, rel=1e-4),)}
    assert found.n == 1.7
    assert found.n_error is None


def test_two_lobes_come_back():
    data = directions(np.random.default_rng(3), 40)
    lobe = 0.7 * brdf(data, "ggx", 0.04, index=1.5) + 0.3 * brdf(data, "ggx", 0.3, index=1.5)
    data = replace(data, values=(0.1 / np.pi + lobe)[:, None])
    found = fit_distribution(data, TWO_LOBES, WHOLE)
    assert found.parameter == pytest.approx(0.04, rel=1e-3)
    assert found.second == pytest.approx(0.3, rel=1e-3)
    assert found.share == pytest.approx(0.7, rel=1e-3)
    assert found.n == pytest.approx(1.5, rel=1e-3)
    np.testing.assert_allclose(found.model(data), data.values, rtol=1e-3)


def test_an_aperture_widens_the_model():
    """Of a detector as wide as the lobe; the truth is a mean over its disc."""
    rng = np.random.default_rng(2)
    data = directions(rng, 40)
    radius = np.radians(1.5) * np.sqrt(rng.random(400))
    turn = 2 * np.pi * rng.random(400)
    values = 0
    across = np.cross(data.outgoing, [0.3, 0.5, 0.8])
    across /= np.linalg.norm(across, axis=1)[:, None]
    along = np.cross(data.outgoing, across)
    for r, t in zip(radius, turn, strict=True):
        seen = data.outgoing + np.tan(r) * (np.cos(t) * across + np.sin(t) * along)
        seen /= np.linalg.norm(seen, axis=1)[:, None]
        values = values + brdf(replace(data, outgoing=seen), "ggx", 0.02, index=1.5, masking="none")
    data = replace(data, values=(0.1 / np.pi + values / 400)[:, None])
    sharp, wide = (
        fit_distribution(data, "ggx", BrdfModel(masking="none", aperture=aperture))
        for aperture in (None, 3.0)
    )
    assert wide.error < 0.4 * sharp.error
    assert wide.parameter == pytest.approx(0.02, rel=0.02)


def test_uncertainties_are_weights():
    """A tenth of the samples is wrong, and says so."""
    rng = np.random.default_rng(2)
    data = measured(rng, "ggx", noise=0, index=1.5, specular=(1.0,), count=30)
    bad = rng.random(len(data.values)) < 0.1
    values = data.values * np.where(bad, 1.5, 1)[:, None]
    data = replace(data, values=values, uncertainty=values * np.where(bad, 100, 0.01)[:, None])
    found = fit_distribution(data, "ggx", WHOLE)
    assert found.parameter == pytest.approx(0.2, rel=1e-3)
    plain = fit_distribution(data, "ggx", BrdfModel(robust=False, noise=0.01))
    assert abs(plain.parameter - 0.2) > 5 * abs(found.parameter - 0.2)


def test_outliers():
    data = measured(np.random.default_rng(6), "beckmann", count=30)
    values = data.values.copy()
    values[::15] *= 3
    data = replace(data, values=values)
    plain, robust = (
        fit_distribution(data, "beckmann", BrdfModel(fresnel="none", robust=robust))
        for robust in (False, True)
    )
    assert abs(robust.parameters["alpha"] - 0.2) < 0.5 * abs(plain.parameters["alpha"] - 0.2)
    assert robust.parameters["alpha"] == pytest.approx(0.2, rel=2e-3)


@pytest.mark.parametrize("name", ["beckmann", "ggx", "sawicki", "student-t"])
def test_the_model_of_the_data_is_recommended(name):
    data = measured(
        np.random.default_rng(7), name, count=30, index=1.5, specular=(1.0,), **gamma_of(name)
    )
    (result,) = fit(data).results
    assert result.recommended.name == name
    assert result.fits == ranked(result.fits)
    assert result.recommended.bic < 10 + min(fitted.bic for fitted in result.fits)


def test_each_shape_is_a_candidate_once():
    names = [what.name for what in all_candidates()]
    assert len(set(names)) == len(names)
    assert "smoothie" not in names
    assert set(NAMES) - set(names) == {"smoothie"}
    assert TWO_LOBES in names


def test_a_family_that_is_a_simpler_shape_again_is_left_out():
    data = measured(np.random.default_rng(7), "ggx", index=1.5, specular=(1.0,), count=30)
    names = [fitted.name for fitted in fit(data).results[0].fits]
    assert names[0] == "ggx"
    assert not {"gtr", "student-t", TWO_LOBES} & set(names)
    asked = fit(data, ["ggx", "gtr"]).results[0]
    assert {fitted.name for fitted in asked.fits} == {"ggx", "gtr"}
    assert asked.recommended.name == "ggx"


def test_many_samples_are_fitted_as_all_of_them():
    """More than those from which a fit starts."""
    data = measured(np.random.default_rng(8), "ggx", count=700)
    found = fit_distribution(data, "beckmann", BrdfModel(**LOSSLESS))
    half = np.random.default_rng(1).random(len(data.values)) < 0.5
    part = fit_distribution(
        replace(
            data,
            incident=data.incident[half],
            outgoing=data.outgoing[half],
            values=data.values[half],
        ),
        "beckmann",
        BrdfModel(**LOSSLESS),
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


def test_a_surface_that_reflects_nothing_and_a_strength_that_is_free_already():
    with pytest.raises(MdfconvError, match="reflects nothing from outside"):
        BrdfModel(fresnel="ior:0.5")
    with pytest.raises(MdfconvError, match="k_s is free already"):
        BrdfModel(fresnel="none", free_specular=True)


@pytest.mark.parametrize("options", [{"aperture": -1}, {"noise": 2.0}, {"floor": float("nan")}])
def test_options_out_of_range(options):
    with pytest.raises(MdfconvError, match="is outside 0 to"):
        BrdfModel(**options)
