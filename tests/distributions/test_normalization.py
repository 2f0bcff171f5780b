"""Normalized forms: ∫ D cos β dω = 1, by quadrature that knows nothing of the constants."""

import itertools

import numpy as np
import pytest
from scipy.integrate import quad

import mdfconv
from mdfconv.distributions.gauss import sawicki_constant

RANGE = [1e-8, 1e-4, 0.01, 0.1, 0.3, 0.7, 0.9, 1.0]
CASES = [
    *(("beckmann", p) for p in [*RANGE, 0.70710678, 0.8, 2.0, 10.0]),
    *(("gauss", p) for p in [*RANGE, 2.0, 10.0, 1e4]),
    *(("ggx", p) for p in RANGE),
    *(("schlick", p) for p in RANGE),
    *(("smoothie", p) for p in [*RANGE, 3.0, 100.0]),
    *(("blinn-phong", n) for n in [0.01, 1, 2, 10, 1e3, 1e8, 1e16]),
    *(("sawicki", n) for n in [0.01, 1, 2, 10, 1e3, 1e8, 1e16]),
]


def hemisphere_integral(density, scale):
    """Integrate 2π D sin β cos β over [0, π/2], in pieces that follow the lobe outwards."""
    edges = [0, *(scale * 2.0 ** np.arange(-6, 70)), np.pi / 2]
    edges = [edge for edge in edges if edge < np.pi / 2] + [np.pi / 2]
    nodes, weights = np.polynomial.legendre.leggauss(60)
    total = 0.0
    for low, high in itertools.pairwise(edges):
        beta = low + (high - low) * (nodes + 1) / 2
        total += (high - low) / 2 * np.sum(weights * density(beta) * np.sin(2 * beta))
    return np.pi * total


@pytest.mark.parametrize(("name", "parameter"), CASES)
def test_integral_is_one(name, parameter):
    entry = mdfconv.distribution(name)
    width = entry.half_width(parameter)
    scale = 0.3 if np.isnan(width) else width
    if name == "schlick":
        # Its support ends at a kink: integrate up to there.
        edge = 2 * np.arcsin(np.sqrt(parameter / 2))
        scale = min(scale, edge)
        pieces = edge * np.concatenate([[0], 2.0 ** np.arange(-60, 1)])
        total = sum(
            quad(
                lambda b: float(entry.normalized(b, parameter)) * np.sin(2 * b),
                *ends,
                epsabs=0,
                epsrel=1e-11,
            )[0]
            for ends in itertools.pairwise(pieces)
        )
        assert np.pi * total == pytest.approx(1, abs=1e-9)
    else:
        total = hemisphere_integral(lambda b: entry.normalized(b, parameter), scale)
        assert total == pytest.approx(1, abs=1e-9)


@pytest.mark.parametrize("alpha", [1e-8, 1e-3, 0.1, 0.5, 0.999999, 1.0])
@pytest.mark.parametrize(
    "gamma", [0.1, 0.9, 1 - 1e-6, 1 - 1e-12, 1, 1 + 1e-12, 1 + 1e-6, 1.5, 2, 3, 10]
)
def test_gtr_integral_is_one(alpha, gamma):
    entry = mdfconv.distribution("gtr")
    total = hemisphere_integral(lambda b: entry.normalized(b, alpha, gamma=gamma), alpha)
    assert total == pytest.approx(1, abs=1e-9)


@pytest.mark.parametrize("name", ["ggx", "beckmann", "ashikhmin-shirley"])
def test_anisotropic_integral_is_one(name):
    entry = mdfconv.distribution(name)
    pair = (40.0, 8.0) if name == "ashikhmin-shirley" else (0.2, 0.6)
    phi = np.linspace(0, 2 * np.pi, 400, endpoint=False)
    total = hemisphere_integral(
        lambda b: np.mean(entry.normalized(b[:, None], pair, phi=phi), axis=1), 0.1
    )
    assert total == pytest.approx(1, abs=1e-9)


@pytest.mark.parametrize(
    ("m", "integral"), [(0.05, 1.0005), (0.2, 1.008), (0.4, 1.027), (0.7, 1.045)]
)
def test_the_papers_gaussian_constant_is_off_by_what_is_known(m, integral):
    gauss = mdfconv.distribution("gauss")
    ratio = sawicki_constant(m) / gauss.normalized(0, m)
    assert ratio == pytest.approx(integral, abs=6e-4)


def test_gtr_is_ggx_at_gamma_two():
    beta = np.linspace(0, np.pi / 2, 100)
    for alpha in RANGE:
        np.testing.assert_allclose(
            mdfconv.distribution("gtr").normalized(beta, alpha, gamma=2.0 + 1e-13),
            mdfconv.distribution("ggx").normalized(beta, alpha),
            rtol=2e-11,
        )


def test_smoothie_is_ggx_in_another_parameter():
    beta = np.linspace(0, np.pi / 2, 100)
    for alpha in [1e-8, 0.01, 0.3, 0.99]:
        np.testing.assert_allclose(
            mdfconv.distribution("smoothie").normalized(beta, 2 * alpha / np.sqrt(1 - alpha**2)),
            mdfconv.distribution("ggx").normalized(beta, alpha),
            rtol=1e-12,
        )
