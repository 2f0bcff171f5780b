"""Spectra of lights and of lobes, against harmonics, quadrature and closed forms."""

import numpy as np
import pytest
from scipy.special import eval_legendre, sph_harm_y

import mdfconv
from mdfconv.distributions import one_parameter_distributions
from mdfconv.fitting.metrics import metric_named
from mdfconv.fitting.metrics.light import LightMetric
from mdfconv.fitting.solve import fit
from mdfconv.light import LobeSpectrum, Spectrum, spectrum_of
from tests.light.maps import directions, room

NAMES = [mdf.name for mdf in one_parameter_distributions()]
DEGREES = np.arange(256)
WHITE = Spectrum(np.ones(256))
NATURE = Spectrum(np.append(1.0, 1 / (DEGREES[1:] * (DEGREES[1:] + 1.0))))


@pytest.mark.parametrize(("degree", "order"), [(1, 0), (4, 3), (17, 17), (30, 11)])
def test_a_harmonic_has_the_power_of_its_degree(degree, order):
    zenith, azimuth = directions(128)
    harmonic = np.sqrt(2) * sph_harm_y(degree, order, zenith, azimuth).real
    harmonic /= 1 if order else np.sqrt(2)
    spectrum = spectrum_of(1 + harmonic)
    # White 1 has a_00 = √(4π), the harmonic one coefficient of 1.
    expected = np.zeros(64)
    expected[[0, degree]] = 4 * np.pi, 1 / (2 * degree + 1)
    np.testing.assert_allclose(spectrum.power, expected, atol=2e-4)


def test_the_power_is_that_of_the_map():
    luminance = room(128)
    zenith, _ = directions(128)
    weight = np.sin(zenith) / np.sum(256 * np.sin(zenith))
    spectrum = spectrum_of(luminance)
    share = np.sum((2 * np.arange(64) + 1) * spectrum.power) / (4 * np.pi)
    mean = np.sum(weight * luminance)
    assert share == pytest.approx(np.sum(weight * luminance**2) / mean**2, rel=0.02)


@pytest.mark.parametrize("turned", [lambda m: np.roll(m, 17, axis=1), lambda m: m[::-1], np.fliplr])
def test_a_turned_light_is_the_same(turned):
    np.testing.assert_allclose(
        spectrum_of(turned(room())).power, spectrum_of(room()).power, rtol=1e-9, atol=1e-15
    )


def test_brightness_does_not_matter():
    np.testing.assert_allclose(spectrum_of(1e-3 * room()).power, spectrum_of(room()).power)


@pytest.mark.parametrize("exponent", [0.0, 0.5, 2.0, 2.8])
def test_the_exponent_is_that_of_a_power_law(exponent):
    spectrum = Spectrum((DEGREES + 0.5) ** -exponent)
    assert spectrum.exponent == pytest.approx(exponent, abs=1e-12)
    degree = np.array([3.5, 1000.5, 1e9])
    np.testing.assert_allclose(spectrum.at(degree), degree**-exponent, rtol=1e-9)


def test_a_power_of_zero_is_passed_over():
    power = (DEGREES + 0.5) ** -2.0
    power[1::2] = 0
    assert Spectrum(power).exponent == pytest.approx(2)


def by_quadrature(mdf, parameter, degree):
    """Return k_l by Gauss-Legendre rules of 20 nodes, in pieces of half a wave and of the lobe."""
    width = float(mdf.half_width(np.float64(parameter)))
    waves = np.linspace(0, np.pi / 2, degree + 1)
    edges = np.unique(np.minimum([*(width * np.geomspace(0.01, 20, 30)), *waves], np.pi / 2))
    node, weight = np.polynomial.legendre.leggauss(20)
    half = np.diff(edges)[:, None] / 2
    beta, weight = (edges[:-1, None] + half * (1 + node)).ravel(), (half * weight).ravel()
    density = np.pi * mdf.normalized(beta, parameter) * np.sin(2 * beta)
    return np.sum(weight * density * eval_legendre(degree, np.cos(2 * beta)))


@pytest.mark.parametrize("name", ["beckmann", "ggx", "blinn-phong", "sawicki"])
@pytest.mark.parametrize("degree", [1, 2, 30, 99, 101, 160])
@pytest.mark.parametrize("m_b", [0.004, 0.03, 0.5])
def test_lobe_spectrum(name, degree, m_b):
    mdf = mdfconv.distribution(name)
    parameter = mdf.from_half_tangent(mdfconv.distribution("beckmann").half_tangent(m_b))
    lobes = LobeSpectrum(100)
    ours = np.interp(degree + 0.5, lobes.degree, lobes(mdf, np.array([[parameter]]))[0])
    # Between two degrees of the smooth part there is an interpolation.
    assert ours == pytest.approx(by_quadrature(mdf, parameter, degree), abs=1e-3)


@pytest.mark.parametrize("name", NAMES)
def test_a_mirror_keeps_all_and_a_slope_is_one(name):
    mdf = mdfconv.distribution(name)
    lobes = LobeSpectrum(63)
    parameter = mdf.from_half_tangent(np.array([1e-7, 0.1]))[:, None]
    value, slope = lobes.with_slope(mdf, parameter)
    np.testing.assert_allclose(value[0, :63], 1, atol=1e-8)
    np.testing.assert_allclose(value, lobes(mdf, parameter), atol=1e-13)
    step = 1e-5
    ends = [lobes(mdf, parameter[1:] * np.exp(sign * step))[0] for sign in (1, -1)]
    np.testing.assert_allclose(slope[1], (ends[0] - ends[1]) / (2 * step), atol=1e-6)


@pytest.mark.parametrize("name", [name for name in NAMES if name != "beckmann"])
@pytest.mark.parametrize(
    ("spectrum", "metric", "tolerance"), [(WHITE, "energy", 2e-5), (NATURE, "environment", 1e-4)]
)
def test_the_sum_is_the_integral(name, spectrum, metric, tolerance):
    source, target = mdfconv.distribution("beckmann"), mdfconv.distribution(name)
    parameter = np.array([1e-8, 1e-3, 0.02, 0.1, 0.4, 0.7])
    got = fit(source, parameter, target, LightMetric(spectrum)).parameter
    wanted = fit(source, parameter, target, metric_named(metric)).parameter
    np.testing.assert_allclose(got, wanted, rtol=tolerance)


@pytest.mark.parametrize("height", [64, 128])
def test_what_is_smooth_is_soft(height):
    """The rule over the zenith is exact: no power leaks from one degree into others."""
    zenith, _ = directions(height)
    luminance = np.broadcast_to(1 + np.cos(zenith), (height, 2 * height))
    spectrum = spectrum_of(luminance)
    np.testing.assert_allclose(spectrum.power[2:], 0, atol=1e-25)
    assert spectrum.exponent == 6


def test_two_halves_of_a_sphere():
    zenith, _ = directions(128)
    spectrum = spectrum_of(np.broadcast_to(np.where(zenith < np.pi / 2, 1.0, 0.1), (128, 256)))
    # The coefficients of a step fall like l^−3/2, those of even degrees are 0.
    assert spectrum.exponent == pytest.approx(3, abs=0.3)


@pytest.mark.parametrize("name", ["ggx", "gauss", "blinn-phong", "schlick", "sawicki"])
def test_mirrors_convert_alike(name):
    source, target = mdfconv.distribution("beckmann"), mdfconv.distribution(name)
    given_ = np.array([1e-7, 1e-9, 1e-12, 1e-15])
    light = LightMetric(Spectrum((DEGREES + 0.5) ** -2.8))
    tangent = target.half_tangent(fit(source, given_, target, light).parameter)
    np.testing.assert_allclose(tangent / given_, tangent[0] / given_[0], rtol=1e-4)


def test_the_roughest_lobes_are_resolved():
    lobes = LobeSpectrum(63)
    # A ring at the horizon reflects everything to the opposite direction: k_l = P_l(−1).
    ring = lobes(mdfconv.distribution("beckmann"), np.array([[1e4]]))[0, :8]
    np.testing.assert_allclose(ring, (-1.0) ** np.arange(1, 9), atol=1e-3)
    light = LightMetric(Spectrum((DEGREES[:64] + 0.5) ** -2.8))
    ends = mdfconv.distribution("ggx"), mdfconv.distribution("beckmann")
    found = fit(ends[0], np.array([0.85, 0.9, 0.99]), ends[1], light).parameter
    assert (np.diff(found) > 0).all()
    assert 1 < found[0] < found[-1] < 2
