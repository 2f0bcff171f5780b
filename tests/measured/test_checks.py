"""What is said of fits: noise, albedo, verdict and checks, against scans that are made to order."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mdfconv.brdf.fresnel import dielectric, lossless
from mdfconv.brdf.microfacet import MASKINGS, Microsurface, dot, reflect
from mdfconv.brdf.reflection import microfacet
from mdfconv.distributions import distribution
from mdfconv.measured import DirectionalSamples, Samples
from mdfconv.measured.checks import albedo, estimate_noise, incidence_groups
from tests.measured.scans import grid, measured, vector

INCIDENCES = (20.0, 45.0, 70.0)


def directional(angles, values=None):
    """Return samples at angles in degrees, shape (n, 4)."""
    incident, outgoing, ggx = measured(np.asarray(angles, float))
    values = ggx if values is None else values
    return DirectionalSamples(incident, outgoing, values.reshape(len(incident), -1), ("one",))


def in_plane(step=1.0, incidences=INCIDENCES, largest=80.0):
    """Return scans in the plane of incidence as angles in degrees; signed θ_o goes along."""
    theta = np.arange(-largest, largest + 1e-9, step)
    incidence, signed = (a.ravel() for a in np.meshgrid(incidences, theta, indexing="ij"))
    zero = np.zeros_like(signed)
    return np.column_stack([incidence, zero, np.abs(signed), np.where(signed < 0, 0.0, 180.0)])


def residuals(angles, noise, misfit=0.2, seed=0):
    """Return ln(fit/data): noise, a smooth misfit, and outliers of 0.5 %."""
    random = np.random.default_rng(seed)
    incidence, _, zenith, azimuth = np.radians(angles).T
    smooth = misfit * np.sin(3 * zenith + 2 * incidence) * np.cos(azimuth)
    residual = smooth + noise * random.standard_normal(len(angles))
    outlying = random.random(len(angles)) < 0.005
    residual[outlying] += np.log(3) * random.choice([-1, 1], outlying.sum())
    return residual[:, None]


GEOMETRIES = {
    "fine scans": in_plane(0.25),
    "scans": in_plane(1.0),
    "coarse scans": in_plane(3.0, np.arange(0.0, 80.0, 10.0)),
    "hemispheres": grid((10, 30, 50, 70), range(0, 81, 5), range(0, 360, 10)),
    "scattered": np.column_stack(
        [
            np.repeat([15.0, 55.0], 1500),
            np.zeros(3000),
            np.degrees(np.arccos(np.random.default_rng(1).uniform(0.2, 1, 3000))),
            np.random.default_rng(2).uniform(0, 360, 3000),
        ]
    ),
    "repeated": np.repeat(in_plane(2.0), 3, axis=0),
}


@pytest.mark.parametrize("angles", GEOMETRIES.values(), ids=GEOMETRIES)
def test_noise_is_told_from_a_smooth_misfit_and_from_outliers(angles):
    samples = directional(angles)
    estimates = [estimate_noise(samples, residuals(angles, 0.02, seed=seed)) for seed in range(9)]
    assert 0.017 < np.median(estimates) < 0.0235


@pytest.mark.parametrize("noise", [0.001, 0.3])
def test_noise_is_in_proportion(noise):
    angles = in_plane(1.0)
    estimate = estimate_noise(directional(angles), residuals(angles, noise, misfit=0.0))
    assert estimate == pytest.approx(noise, rel=0.15)


def test_noise_is_that_of_all_channels():
    angles = in_plane(0.5)
    both = np.hstack([residuals(angles, 0.03, seed=seed) for seed in range(2)])
    assert estimate_noise(directional(angles), both) == pytest.approx(0.03, rel=0.15)


@pytest.mark.parametrize("name", ["scans", "hemispheres", "repeated"])
def test_the_order_of_samples_is_nothing_to_their_noise(name):
    angles, order = GEOMETRIES[name], np.random.default_rng(3).permutation(len(GEOMETRIES[name]))
    residual = residuals(angles, 0.02)
    turned = angles + np.array([0, 77.0, 0, 77.0])
    shuffled = estimate_noise(directional(turned[order]), residual[order])
    assert shuffled == pytest.approx(estimate_noise(directional(angles), residual), rel=0.05)
    same = estimate_noise(directional(angles[order]), residual[order])
    assert same == estimate_noise(directional(angles), residual)


def test_values_at_the_wrong_directions_are_all_noise():
    samples = directional(in_plane(1.0))
    logarithm = np.log(samples.values)
    shuffled = np.random.default_rng(0).permutation(logarithm)
    assert estimate_noise(samples, logarithm) < 0.05
    assert estimate_noise(samples, shuffled) > 0.5


def test_noise_of_one_angle():
    beta = np.radians(np.arange(0, 80, 0.1))
    noise = 0.05 * np.random.default_rng(0).standard_normal((beta.size, 1))
    samples = Samples(beta, np.ones((beta.size, 1)), ("one",), "ndf")
    assert estimate_noise(samples, noise + np.cos(beta)[:, None]) == pytest.approx(0.05, rel=0.2)


@pytest.mark.parametrize("count", [1, 2, 3, 5])
def test_noise_of_a_handful(count):
    angles = in_plane(10.0, (30.0,))[:count]
    estimate = estimate_noise(directional(angles), np.linspace(0, 1, count)[:, None])
    assert np.isnan(estimate) if count < 3 else estimate == pytest.approx(0, abs=0.05)


def test_noise_of_one_direction_measured_again_and_again():
    angles = np.repeat([[30.0, 0, 30.0, 180.0]], 200, axis=0)
    noise = 0.1 * np.random.default_rng(0).standard_normal((200, 1))
    assert estimate_noise(directional(angles), noise) == pytest.approx(0.1, rel=0.2)


def test_noise_of_values_that_have_no_logarithm():
    angles = in_plane(1.0)
    residual = residuals(angles, 0.02)
    residual[::7] = np.inf
    residual[::11] = np.nan
    assert estimate_noise(directional(angles), residual) == pytest.approx(0.02, rel=0.2)
    assert np.isnan(estimate_noise(directional(angles), residual + np.nan))


def test_angles_of_incidence_are_told_apart_whatever_the_azimuth():
    random = np.random.default_rng(0)
    angles = grid((10, 35, 60), range(0, 80, 5), range(0, 360, 30))
    angles[:, 0] += random.uniform(-0.12, 0.12, len(angles))  # 35 ± 0.12 is in two bins of 0.25
    angles[:, [1, 3]] += random.uniform(0, 360, (len(angles), 1))
    groups = incidence_groups(directional(random.permutation(angles)))
    assert [angle for angle, _ in groups] == pytest.approx([10, 35, 60], abs=0.02)
    assert [len(index) for _, index in groups] == [len(angles) // 3] * 3


@given(st.lists(st.floats(0, 89), min_size=1, max_size=60))
def test_every_sample_is_in_one_group_of_its_incidence(incidences):
    angles = np.column_stack([incidences, *np.zeros((3, len(incidences)))])
    groups = incidence_groups(directional(angles, np.ones(len(angles))))
    everything = np.concatenate([index for _, index in groups])
    assert sorted(everything) == list(range(len(incidences)))
    assert [angle for angle, _ in groups] == sorted(angle for angle, _ in groups)
    for angle, index in groups:
        assert np.abs(angles[index, 0] - angle).max() <= 0.5 + 1e-6


def lobe(name, parameter, fresnel=lossless):
    surface = Microsurface(distribution(name), parameter)
    brdf = microfacet(surface, fresnel, MASKINGS["correlated"](surface))
    return lambda incident, outgoing: brdf(incident, outgoing)[:, None]


@pytest.mark.parametrize("width", [1e-3, 0.05, 2.0, np.nan])
@pytest.mark.parametrize("theta", [0.0, 45.0, 75.0])
def test_the_albedo_of_a_diffuse_surface_is_its_reflectance(theta, width):
    diffuse = np.array([0.0, 0.3, 1.0])
    whole = albedo(lambda i, o: np.tile(diffuse / np.pi, (len(o), 1)), np.radians(theta), width)
    assert whole == pytest.approx(diffuse, rel=1e-4)


@pytest.mark.parametrize("alpha", [0.01, 0.1, 0.4, 1.0])
@pytest.mark.parametrize("theta", [0.0, 45.0, 75.0])
@pytest.mark.parametrize("index", [1.5, None])
def test_the_albedo_of_a_lobe_is_that_of_visible_normals(alpha, theta, index):
    """A draw of visible normals weighs F G₂/G₁, whose mean is the albedo (Heitz 2018)."""
    surface = Microsurface(distribution("ggx"), alpha)
    fresnel = lossless if index is None else lambda cosine: dielectric(cosine, index)
    view = np.broadcast_to(vector(np.radians(theta), 0.0), (100_000, 3))
    m = surface.visible_normals(view, *np.random.default_rng(5).random((2, len(view))))
    light = reflect(view, m)
    shadowed = np.where(light[:, 2] > 0, surface.correlated(light, view, m), 0)
    weight = fresnel(dot(view, m)) * shadowed / surface.smith_g1(view, m)
    error = weight.std() / np.sqrt(len(view))
    whole = albedo(lobe("ggx", alpha, fresnel), np.radians(theta), alpha)
    assert whole[0] == pytest.approx(weight.mean(), abs=4 * error + 1e-4)


@pytest.mark.parametrize("theta", [0.0, 45.0, 75.0])
def test_two_lobes_of_different_widths_are_integrated_on_the_narrow_one(theta):
    narrow, wide = lobe("ggx", 0.01), lobe("beckmann", 0.5)
    angle = np.radians(theta)
    together = albedo(lambda *d: 0.75 * narrow(*d) + 0.25 * wide(*d), angle, 0.006)
    apart = 0.75 * albedo(narrow, angle, 0.006) + 0.25 * albedo(wide, angle, 0.4)
    assert together == pytest.approx(apart, rel=1e-3)
