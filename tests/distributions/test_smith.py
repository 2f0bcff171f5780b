"""Smith's Λ against the visible area that defines it, at 18 digits, and against closed forms."""

import mpmath as mp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mdfconv.distributions import distribution, list_distributions
from mdfconv.distributions.base import Distribution
from tests import oracles
from tests.distributions.cases import INSTANCES, parameters

# Narrow lobes, wide ones, maxima off the normal, two scales, ends of the support.
CASES = [
    *(("blinn-phong", n, None) for n in (1e-3, 1.0, 20.0, 1e5)),
    *(("sawicki", n, None) for n in (0.5, 30.0, 1e5)),
    *(("gauss", m, None) for m in (0.01, 0.3, 3.0)),
    *(("schlick", m, None) for m in (0.01, 0.3, 0.9, 0.9999, 1.0)),
    *(("gtr", a, g) for a, g in [(0.01, 0.6), (0.1, 1.0), (1e-4, 1.4), (0.3, 64.0), (1.0, 3.0)]),
    *(("student-t", a, g) for a, g in [(0.01, 2.05), (0.4, 4.0), (3.0, 20.0), (100.0, 1e3)]),
]
# tan θ over the width of the lobe, and from the normal to grazing.
SLOPES = np.array([0.7, 1500.0])
TANGENTS = np.array([0.577, 5.67])


def general(mdf, tangent, parameter):
    """Return Λ as for a distribution without a closed form."""
    return Distribution.smith_lambda(mdf, np.asarray(tangent, dtype=float), parameter)


def of(name, gamma=None):
    return distribution(name) if gamma is None else distribution(name, gamma)


def visible_area(mdf, parameter, tangent):
    """Return 1 + Λ = ∫ max(ω·m, 0) D dm / cos θ, the integral over the azimuth done by hand."""
    name, gamma = mdf.name, mdf.gamma or 2.0
    width, t = mp.mpf(float(mdf.peak_alpha(parameter))), mp.mpf(float(tangent))
    sine, cosine = t / mp.sqrt(1 + t * t), 1 / mp.sqrt(1 + t * t)

    def facing(beta):
        s, c = mp.sin(beta), mp.cos(beta)
        if s * sine <= c * cosine:
            return 2 * mp.pi * c * cosine
        end = mp.acos(-c * cosine / (s * sine))
        return 2 * (mp.sin(end) * s * sine + end * c * cosine)

    def integrand(beta):
        return oracles.ratio_mp(name, beta, parameter, gamma) * mp.sin(beta) * facing(beta)

    scales = [k * s for s in (width, mp.mpf(parameter), 1) for k in (0.1, 1, 5)]
    ends = {mp.atan(1 / t), *map(mp.atan, scales)}
    edge = mdf.edge(np.array([parameter]))
    if edge is not None and parameter < 1:
        ends.add(mp.acos(1 - mp.mpf(parameter)))
    horizon = mp.pi / 2 - mp.mpf("1e-22")
    value = mp.quad(integrand, sorted({mp.mpf(0), horizon, *ends}))
    return value * oracles.at_normal(name, parameter, gamma) / cosine


@pytest.mark.parametrize(("name", "parameter", "gamma"), CASES)
def test_visible_area(name, parameter, gamma):
    mdf = of(name, gamma)
    tangent = np.concatenate([SLOPES / mdf.peak_alpha(parameter), TANGENTS])
    got = 1 + mdf.smith_lambda(tangent, parameter)
    with mp.workdps(18):
        for value, t in zip(got, tangent, strict=True):
            wanted = visible_area(mdf, parameter, t)
            assert value == pytest.approx(float(wanted), rel=1e-9 if name == "schlick" else 1e-10)


def test_phong_of_twenty():
    """G₁ at 30, 60 and 80°, by quadrature over the sphere."""
    g1 = 1 / (1 + distribution("blinn-phong").smith_lambda(np.tan(np.radians([30, 60, 80])), 20.0))
    assert g1 == pytest.approx([1.0000000, 0.9989820, 0.8667592], abs=1e-7)


@pytest.mark.parametrize("name", [entry.name for entry in list_distributions() if entry.smith])
def test_tables_agree_with_closed_forms(name):
    mdf = distribution(name)
    tangent = np.concatenate([[0], np.geomspace(1e-9, 1e9, 5001), [np.inf]])
    for parameter in (1e-8, 0.01, 0.3, 1.0):
        wanted = 1 + mdf.smith_lambda(tangent, parameter)
        assert 1 + general(mdf, tangent, parameter) == pytest.approx(wanted, rel=1e-10)


def test_another_name_for_ggx():
    """To the last digits: Smoothie with α/√(4+α²), GTR and Student-t at their γ of 2."""
    tangent = np.geomspace(1e-6, 1e9, 300)
    for name in ("smoothie", "gtr", "student-t"):
        for alpha in (1e-8, 0.1, 1.0):
            slope = tangent * (alpha / np.sqrt(4 + alpha**2) if name == "smoothie" else alpha)
            wanted = slope**2 / (2 * (1 + np.sqrt(1 + slope**2)))
            got = distribution(name).smith_lambda(tangent, alpha)
            assert got == pytest.approx(wanted, rel=1e-14)


def test_limits_of_gamma():
    """Student-t tends to Beckmann and GTR to a Gaussian in sin β, of which one is Blinn/Phong."""
    tangent = np.geomspace(0.1, 1e3, 50)
    student = 1 + distribution("student-t", 1e6).smith_lambda(tangent, 0.3)
    beckmann = 1 + distribution("beckmann").smith_lambda(tangent, 0.3)
    assert student == pytest.approx(beckmann, rel=1e-5)
    near = distribution("gtr", 2 + 1e-9).smith_lambda(tangent, 0.3)
    assert near == pytest.approx(distribution("ggx").smith_lambda(tangent, 0.3), rel=1e-8)


@pytest.mark.parametrize("name", [entry.name for entry in list_distributions()])
def test_ends_of_the_directions(name):
    mdf = distribution(name)
    for parameter in mdf.parameter.typical:
        ends = mdf.smith_lambda(np.array([0, 1e-300, 1e300, np.inf]), parameter)
        assert ends[0] == 0
        assert ends[1] < 1e-15
        assert 1e280 < ends[2] < ends[3] == np.inf
        # Λ grows without end: its share of tan θ is the mean slope along a line, over π.
        many = mdf.smith_lambda(np.geomspace(1e-3, 1e8, 20_001), parameter)
        assert (many >= 0).all()
        assert (np.diff(many) >= -1e-10 * (1 + many[1:])).all()


@pytest.mark.parametrize("label", INSTANCES)
def test_hard_parameters(label):
    tangent = np.array([0, 1e-8, 0.5, 5, 1e8, np.inf])
    for parameter in parameters(INSTANCES[label]):
        value = INSTANCES[label].smith_lambda(tangent, parameter)
        assert (value >= 0).all()
        assert (np.diff(value[:-1]) >= -1e-10 * (1 + value[1:-1])).all()
        assert value[-1] == np.inf


@pytest.mark.parametrize("shape", [(), (0,), (3, 0), (1, 1), (2, 3, 4)])
def test_any_shape(shape):
    tangent = np.random.default_rng(3).uniform(0, 20, shape)
    for name in ("ggx", "gauss"):
        value = distribution(name).smith_lambda(tangent, 0.3)
        assert np.shape(value) == shape
        for t, one in zip(tangent.ravel(), np.ravel(value), strict=True):
            assert distribution(name).smith_lambda(np.array([t]), 0.3)[0] == one


def test_more_directions_than_a_block():
    tangent = np.random.default_rng(5).uniform(0, 20, 30_001)
    whole = distribution("gauss").smith_lambda(tangent, 0.3)
    parts = [distribution("gauss").smith_lambda(part, 0.3) for part in np.split(tangent, [7, 9000])]
    assert (whole == np.concatenate(parts)).all()


@settings(max_examples=60, deadline=None)
@given(
    st.sampled_from([entry.name for entry in list_distributions()]),
    st.floats(0.003, 0.97),
    st.floats(2.01, 64),
)
def test_smooth_in_the_parameter(name, alpha, gamma):
    """Differences over ln p of 1e-5 agree with those of twice the step: no noise of a table."""
    mdf = distribution(name)
    if mdf.second_parameter:
        mdf = mdf.with_gamma(gamma)
    parameter = 2 / alpha**2 if mdf.parameter.larger_is_smoother else alpha
    tangent = np.tan(np.linspace(0.02, 1.55, 200))

    def masked(step):
        value = mdf.smith_lambda(tangent, parameter * np.exp(step))
        return value / (1 + value)

    one, two = ((masked(step) - masked(-step)) / (2 * step) for step in (1e-5, 2e-5))
    assert np.abs(one - two).max() < 1e-7
