"""Cumulative distributions and samplers: 50 digits, the kernels' own integral, chi-squared."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import chisquare

import mdfconv
from tests import oracles
from tests.distributions.cases import ENTRIES, HALF_PI, INSTANCES, angles, parameters
from tests.distributions.cumulative_oracle import cumulative

# A power of e multiplies the rounding of its exponent, and a tail is compared down to here.
LEAST = 1e-150


@pytest.mark.parametrize("label", INSTANCES)
def test_both_shares_at_fifty_digits(label):
    entry = INSTANCES[label]
    for parameter in parameters(entry):
        beta = angles(entry, parameter)
        shares = entry.cumulative(beta, parameter)
        tails = entry.cumulative(beta, parameter, complement=True)
        for angle, share, tail in zip(beta, shares, tails, strict=True):
            exact = cumulative(entry.name, angle, parameter, entry.gamma)
            for value, wanted in zip((share, tail), exact, strict=True):
                if wanted > LEAST:
                    error = oracles.relative_error(value, wanted)
                    assert error <= 1e-12, (parameter, angle)


@pytest.mark.parametrize("label", INSTANCES)
def test_it_is_the_integral_of_the_normalized_form(label):
    entry = INSTANCES[label]
    nodes, weights = np.polynomial.legendre.leggauss(40)
    for parameter in (entry.parameter.typical[0], *entry.parameter.typical):
        end = entry.sample([0.05, 0.3, 0.6, 0.9], parameter)
        for low, high in itertools.pairwise(end):
            beta = low + (high - low) * (nodes + 1) / 2
            density = entry.normalized(beta, parameter) * np.sin(2 * beta)
            slab = np.pi * (high - low) / 2 * weights @ density
            low_share, high_share = entry.cumulative([low, high], parameter)
            assert slab == pytest.approx(high_share - low_share, rel=1e-9)


@pytest.mark.parametrize("label", INSTANCES)
def test_samples_come_back(label):
    entry = INSTANCES[label]
    shares = np.concatenate([np.logspace(-12, -1, 12), np.linspace(0.1, 0.9, 9)])
    for parameter in parameters(entry):
        for complement in (False, True):
            beta = entry.sample(shares, parameter, complement=complement)
            assert np.all((beta >= 0) & (beta <= HALF_PI))
            back = entry.cumulative(beta, parameter, complement=complement)
            # An angle resolves what is beyond it only as far as its own rounding does.
            step = np.abs(
                entry.cumulative(beta * (1 + 4e-16), parameter, complement=complement) - back
            )
            edge = entry.edge(np.array([parameter]))
            slack = 0 if edge is None else 1e-8
            assert np.all(np.abs(back - shares) <= 1e-11 * shares + 2 * step + slack), parameter
        assert entry.sample(0.0, parameter) == 0
        assert entry.sample(0.0, parameter, complement=True) == pytest.approx(
            HALF_PI if entry.edge(np.array([parameter])) is None else
            entry.edge(np.array([parameter]))[0]
        )  # fmt: skip


@pytest.mark.parametrize("step", [1e-15, 1e-14, 1e-12, -1e-12, 1e-10, 1e-8, 1e-6])
@pytest.mark.parametrize("alpha", [1e-8, 0.3, 0.99])
def test_samples_come_back_near_gamma_one(alpha, step):
    gtr = mdfconv.distribution("gtr").with_gamma(1 + step)
    shares = np.array([1e-9, 0.1, 0.5, 0.9, 1 - 1e-9])
    back = gtr.cumulative(gtr.sample(shares, alpha), alpha)
    np.testing.assert_allclose(back, shares, rtol=1e-14)


@pytest.mark.parametrize("name", ENTRIES)
def test_the_smallest_shares_are_drawn(name):
    entry = ENTRIES[name]
    parameter = 10.0 if entry.parameter.larger_is_smoother else 0.5
    shares = np.array([1e-60, 1e-100, 1e-200])
    # At the normal F is π D(0) β².
    exact = np.sqrt(shares / (np.pi * entry.normalized(0.0, parameter)))
    np.testing.assert_allclose(entry.sample(shares, parameter), exact, rtol=1e-12)
    tail = entry.sample(shares, parameter, complement=True)
    edge = entry.edge(np.array([parameter]))
    end = HALF_PI if edge is None else edge[0]
    assert np.all((tail > 0.8 * end) & (tail <= end * (1 + 1e-12)))


@pytest.mark.parametrize("name", ENTRIES)
def test_samples_are_distributed_as_the_density_says(name):
    entry = ENTRIES[name]
    parameter = entry.parameter.typical_value
    draws = np.sort(entry.sample(np.random.default_rng(4).random(20_000), parameter))
    edges = np.append(entry.half_width(parameter) * np.linspace(0, 3, 25), HALF_PI)
    counts = np.histogram(draws, edges)[0]
    nodes, weights = np.polynomial.legendre.leggauss(400)
    masses = []
    for low, high in itertools.pairwise(edges):
        beta = low + (high - low) * (nodes + 1) / 2
        density = entry.normalized(beta, parameter) * np.sin(2 * beta)
        masses.append(np.pi * (high - low) / 2 * weights @ density)
    expected = draws.size * np.array(masses) / np.sum(masses)
    keep = expected > 5
    rest = [counts[~keep].sum(), expected[~keep].sum()]
    observed, wanted = np.append(counts[keep], rest[0]), np.append(expected[keep], rest[1] + 1e-9)
    assert chisquare(observed, wanted * observed.sum() / wanted.sum()).pvalue > 1e-4


@given(st.sampled_from(sorted(INSTANCES)), st.floats(0, HALF_PI), st.floats(0, HALF_PI))
def test_shares_rise_and_add_up(label, one, other):
    entry = INSTANCES[label]
    parameter = entry.parameter.typical_value
    low, high = entry.cumulative(sorted((one, other)), parameter)
    tail = entry.cumulative(max(one, other), parameter, complement=True)
    assert 0 <= low <= high * (1 + 1e-12) <= 1 + 1e-12
    assert high + tail == pytest.approx(1, abs=1e-12)


def test_shapes_types_and_mistakes():
    ggx = mdfconv.distribution("ggx")
    assert ggx.cumulative(np.zeros((2, 3), np.float32), np.float32(0.2)).dtype == np.float32
    assert ggx.cumulative([0.1, 4.0], 0.2)[1] == 1
    assert ggx.cumulative(np.zeros((0, 2)), 0.2).shape == (0, 2)
    assert ggx.sample(np.zeros((0, 2)), 0.2).shape == (0, 2)
    assert ggx.sample(0.5, [0.1, 0.2]).shape == (2,)
    gtr = mdfconv.distribution("gtr")
    both = gtr.cumulative(0.3, 0.2, gamma=[1.5, 3])
    assert both.tolist() == [
        gtr.with_gamma(1.5).cumulative(0.3, 0.2),
        gtr.with_gamma(3).cumulative(0.3, 0.2),
    ]
    for share in (-0.1, 1.5, np.nan):
        with pytest.raises(mdfconv.MdfconvError, match="from 0 to 1"):
            ggx.sample(share, 0.2)
    with pytest.raises(mdfconv.MdfconvError, match="0 < α ≤ 1"):
        ggx.cumulative(0.1, 2)
    with pytest.raises(mdfconv.MdfconvError, match="isotropic"):
        ggx.cumulative(0.1, (0.1, 0.2))
    with pytest.raises(mdfconv.MdfconvError, match="no γ"):
        ggx.cumulative(0.1, 0.2, gamma=3)
