"""Fits of what is hardly a measurement, and what no fit may depend on."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mdfconv.errors import MdfconvError
from mdfconv.measured.analysis import fit
from mdfconv.measured.brdf_fit import fit_distribution
from mdfconv.measured.model import TWO_LOBES, BrdfModel, candidate
from mdfconv.measured.samples import DirectionalSamples, Samples
from tests.measured.scans import ggx, measured, vector
from tests.measured.test_brdf_fit import dielectric


def scan(incidences=(15, 45, 60), zeniths=range(-70, 75, 10), channels=1, noise=0.01):
    """Return scans in the plane of incidence of a glossy surface, brighter in later channels."""
    rows = [(i, 0, abs(o), 180 if o >= 0 else 0) for i in incidences for o in zeniths]
    incident, outgoing, lobe = measured(np.array(rows, float))
    values = 0.5 * lobe[:, None] + 0.1 * np.arange(1, channels + 1) / channels
    values *= 1 + noise * np.random.default_rng(3).standard_normal(values.shape)
    return DirectionalSamples(incident, outgoing, values, tuple("RGB"[:channels]))


def slice_of(count=30):
    beta = np.linspace(0, 1.3, count)
    return Samples(beta, ggx(*[vector(beta, 0 * beta)] * 2)[:, None], ("v",), "brdf")


SCAN = scan()


@pytest.mark.parametrize("options", [{"noise": 0.0}, {"floor": 0.0}, {"noise": 0.0, "floor": 0.0}])
def test_a_standard_deviation_of_zero_is_refused(options):
    with pytest.raises(MdfconvError, match="standard deviation of 0"):
        BrdfModel(**options)
    assert BrdfModel(noise=0.0, floor=0.1).floor == 0.1
    assert BrdfModel(noise=0.1, floor=0.0).noise == 0.1


@pytest.mark.parametrize("size", [1e-300, 1e-120, 1e120, 1e300])
@pytest.mark.parametrize("is_floor", [True, False])
def test_standard_deviations_without_a_weight_are_refused(size, is_floor):
    data = SCAN if is_floor else replace(SCAN, uncertainty=np.full(SCAN.values.shape, size))
    with pytest.raises(MdfconvError, match="are outside 1e-100 to 1e"):
        fit(data, ["ggx"], **({"floor": size} if is_floor else {}))


@pytest.mark.parametrize("size", [1e-90, 1e90])
def test_standard_deviations_have_no_unit(size):
    found = fit_distribution(SCAN, "ggx", BrdfModel(floor=size))
    assert found.parameter == pytest.approx(
        fit_distribution(SCAN, "ggx", BrdfModel(floor=1.0)).parameter, rel=1e-4
    )


@pytest.mark.parametrize(
    ("data", "count"), [(SCAN, 6), (scan((45,)), 4), (slice_of(), 4), (slice_of(), 6)]
)
def test_few_samples(data, count):
    """What cannot be validated has no error that compares with those that are."""
    some = data.select(np.linspace(0, len(data.values) - 1, count).astype(int))
    (result,) = fit(some).results
    assert [row["recommended"] for row in result.records()].count(True) == 1
    known = [not np.isnan(one.validated_error) for one in result.fits]
    assert known == sorted(known, reverse=True)
    assert not np.isnan(result.recommended.validated_error) or not any(known)
    assert result.verdict.sentence


@pytest.mark.parametrize("unit", [1e-200, 1e160, 1e250])
@pytest.mark.parametrize("loss", ["log", "linear"])
def test_a_unit_whose_square_is_no_number(unit, loss):
    data = replace(SCAN, values=unit * SCAN.values)
    (result,) = fit(data, ["ggx"], fresnel="none", loss=loss).results
    (usual,) = fit(SCAN, ["ggx"], fresnel="none", loss=loss).results
    scale = unit if loss == "linear" else 1.0
    for name in ("parameter", "parameter_error"):
        expected = getattr(usual.recommended, name)
        assert getattr(result.recommended, name) == pytest.approx(expected, rel=1e-3)
    for name in ("error", "validated_error", "validated_spread"):
        expected = scale * getattr(usual.recommended, name)
        assert getattr(result.recommended, name) == pytest.approx(expected, rel=1e-3)


def test_what_the_data_do_not_bound_has_no_standard_error():
    one_lobe = fit_distribution(SCAN, TWO_LOBES, BrdfModel())
    # Both lobes are the one that there is, in any shares.
    assert np.isnan(one_lobe.errors["share"])
    flat = replace(SCAN, values=1 + 0.01 * (SCAN.values % 1))
    (result,) = fit(flat, ["beckmann", "ggx"]).results
    for found in result.fits:
        for name, error in found.errors.items():
            assert np.isnan(error) or error < 10 * found.parameters[name]
    nothing = fit_distribution(SCAN, "ggx", BrdfModel(fresnel="ior:1.0000001"))
    assert np.isnan(nothing.parameter_error)
    assert 0 < fit_distribution(SCAN, "ggx").parameter_error < 0.1


@pytest.mark.parametrize("values", ["rising", "spike", "cosine"])
@pytest.mark.parametrize("loss", ["log", "linear"])
@pytest.mark.parametrize("target", ["ggx", TWO_LOBES])
def test_slices_that_are_no_lobe(values, loss, target):
    data = slice_of()
    made = {
        "rising": data.beta + 0.1,
        "spike": np.where(data.beta > 0, 1.0, 1e6),
        "cosine": np.cos(data.beta),
    }
    found = fit_distribution(replace(data, values=made[values][:, None]), target, BrdfModel(loss))
    assert np.isfinite(found.correlation).all()
    assert np.isfinite(found.model(data)).all()


def test_a_metal_of_free_strength_reflects_no_more_towards_the_normal():
    """Data that fall towards grazing have F₀ = 1, not more; a channel without a lobe 0."""
    falling = SCAN.values * SCAN.outgoing[:, 2:] * SCAN.incident[:, 2:]
    flat = 0.1 * (1 + 0.01 * np.cos(7 * np.arange(len(falling))))[:, None]
    data = replace(SCAN, values=np.hstack([falling, flat]), channels=("falling", "flat"))
    found = fit_distribution(data, "ggx", BrdfModel(fresnel="metal", free_specular=True))
    assert found.f0[0] == pytest.approx(1)
    assert all(0 <= value <= 1 for value in found.f0)
    assert np.isfinite(found.model(data)).all()
    np.testing.assert_allclose(found.model(data)[:, 1], 0.1, rtol=0.05)


def test_errors_of_a_free_strength_are_those_of_repetitions():
    """F₀ and k_s stand before nearly the same function: their ± are correlated."""
    exact = scan((20, 40, 60, 70), noise=0)
    cosine = (exact.incident * exact.half).sum(axis=1, keepdims=True)
    lobe = 2 * (exact.values - 0.1) * (0.3 + 0.7 * (1 - cosine) ** 5)
    options = BrdfModel(fresnel="metal", free_specular=True, robust=False)
    rng, found = np.random.default_rng(1), []
    for _ in range(40):
        noise = 1 + 0.02 * rng.standard_normal(lobe.shape)
        found.append(fit_distribution(replace(exact, values=(0.05 + lobe) * noise), "ggx", options))
    for name in ("f0", "specular"):
        scatter = np.std([getattr(one, name)[0] for one in found])
        told = np.median([getattr(one, f"{name}_error")[0] for one in found])
        assert 0.6 < told / scatter < 1.6


THREE = scan(channels=3)
WHOLE = fit_distribution(THREE, "ggx", BrdfModel(fresnel="metal"))


@settings(max_examples=10, deadline=None)
@given(st.randoms(use_true_random=False), st.floats(-10, 10), st.booleans())
def test_neither_order_nor_azimuth_nor_the_way_of_light_matters(random, turn, is_reversed):
    order = random.sample(range(len(THREE.values)), len(THREE.values))
    cosine, sine = np.cos(turn), np.sin(turn)
    turned = np.array([[cosine, sine, 0], [-sine, cosine, 0], [0, 0, 1]])
    data = replace(THREE, incident=THREE.incident @ turned, outgoing=THREE.outgoing @ turned)
    if is_reversed:
        data = replace(data, incident=data.outgoing, outgoing=data.incident)
    found = fit_distribution(data.select(order), "ggx", BrdfModel(fresnel="metal"))
    assert found.parameter == pytest.approx(WHOLE.parameter, rel=1e-5)
    assert found.f0 == pytest.approx(WHOLE.f0, rel=1e-5)
    assert found.diffuse == pytest.approx(WHOLE.diffuse, rel=1e-5)
    assert found.error == pytest.approx(WHOLE.error, rel=1e-6)


@pytest.mark.parametrize("columns", [(2, 0, 1), (0, 1, 2, 0, 1, 2)])
def test_channels_that_are_turned_or_doubled(columns):
    names = tuple(map(str, range(len(columns))))
    data = replace(THREE, values=THREE.values[:, columns], channels=names)
    found = fit_distribution(data, "ggx", BrdfModel(fresnel="metal"))
    assert found.parameter == pytest.approx(WHOLE.parameter, rel=1e-5)
    assert found.f0 == pytest.approx([WHOLE.f0[column] for column in columns], rel=1e-5)
    assert found.diffuse == pytest.approx([WHOLE.diffuse[column] for column in columns], rel=1e-5)


def expected(data, found):
    """Return k_d/π + k_s D G F / (4 cos cos) of GGX with the numbers of a fit."""
    cosine = (data.incident * data.half).sum(axis=1, keepdims=True)
    lobe = ggx(data.incident, data.outgoing, found.parameter)
    if found.share is not None:
        wide = ggx(data.incident, data.outgoing, found.second)
        lobe = found.share * lobe + (1 - found.share) * wide
    if found.fresnel == "none":
        factor = 1.0
    elif found.n is not None:
        # The oracle is 0/0 along the normal.
        factor = dielectric(np.minimum(cosine, 1 - 1e-12), found.n)
    else:
        factor = np.array(found.f0) + (1 - np.array(found.f0)) * (1 - cosine) ** 5
    return np.array(found.diffuse) / np.pi + np.array(found.specular) * factor * lobe[:, None]


@pytest.mark.parametrize(
    ("fresnel", "is_free"),
    [("none", False), *itertools.product(["metal", "dielectric", "ior:1.5"], [False, True])],
)
@pytest.mark.parametrize("target", ["ggx", TWO_LOBES])
def test_the_model_is_the_formula(target, fresnel, is_free):
    options = BrdfModel(fresnel=fresnel, free_specular=is_free)
    found = fit_distribution(THREE, target, options)
    np.testing.assert_allclose(found.model(THREE), expected(THREE, found), rtol=1e-9)
    assert candidate(target).name == found.name


@pytest.mark.parametrize("fresnel", ["none", "metal", "dielectric"])
@pytest.mark.parametrize("theta", [0.0, 0.8, 1.3])
def test_the_albedo_is_the_integral(fresnel, theta):
    found = fit_distribution(THREE, "ggx", BrdfModel(fresnel=fresnel))
    # The midpoint rule in cos θ_o and φ_o.
    cosine, phi = np.meshgrid((np.arange(600) + 0.5) / 600, (np.arange(400) + 0.5) * np.pi / 400)
    outgoing = vector(np.arccos(cosine).ravel(), phi.ravel())
    incident = np.broadcast_to(vector(np.array(theta), np.array(0.0)), outgoing.shape)
    data = DirectionalSamples(incident, outgoing, np.ones((len(outgoing), 3)), THREE.channels)
    whole = 2 * np.pi * (expected(data, found) * outgoing[:, 2:]).mean(axis=0)
    np.testing.assert_allclose(found.albedo(theta), whole, rtol=2e-3)


def test_a_reflectance_of_one_is_judged():
    """No index of refraction has F₀ = 1."""
    falling = SCAN.values * SCAN.outgoing[:, 2:] * SCAN.incident[:, 2:]
    options = {"fresnel": "metal", "free_specular": True}
    (result,) = fit(replace(SCAN, values=falling), ["ggx"], **options).results
    assert result.recommended.f0 == (1.0,)
    assert "F₀ = 1 is usual for a metal." in [check.text for check in result.checks]
