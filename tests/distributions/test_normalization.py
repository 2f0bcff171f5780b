"""Normalized forms: ∫ D cos β dω = 1, by quadrature that knows nothing of the constants."""

import itertools

import numpy as np
import pytest
from scipy.integrate import quad

import mdfconv
from tests.distributions.cases import INSTANCES, parameters

RANGE = [1e-8, 1e-4, 0.01, 0.1, 0.3, 0.7, 0.9, 1.0]


def hemisphere_integral(density, scale):
    """Integrate 2π D sin β cos β over [0, π/2], over the logarithm of tan β around the lobe."""
    octaves = np.arange(np.floor(np.log2(min(np.tan(scale), 1.0))) - 30, 42)
    nodes, weights = np.polynomial.legendre.leggauss(30)
    log_tangent = np.log(2) * (octaves[:, None] + 0.5 * (nodes + 1))
    tangent = np.exp(log_tangent).ravel()
    share = np.square(tangent) / np.square(1 + np.square(tangent))
    values = density(np.arctan(tangent)) * share * np.tile(weights, octaves.size)
    return np.pi * np.log(2) * np.sum(values)


@pytest.mark.parametrize("label", INSTANCES)
def test_integral_is_one(label):
    entry = INSTANCES[label]
    for parameter in parameters(entry):
        width = entry.half_width(parameter)
        scale = 0.3 if np.isnan(width) else width
        edge = entry.edge(np.array([parameter]))
        if edge is None:
            total = hemisphere_integral(lambda b: entry.normalized(b, parameter), scale)  # noqa: B023
        else:
            total = integral_up_to(float(edge[0]), entry, parameter)
        assert total == pytest.approx(1, abs=1e-9), parameter


def integral_up_to(edge, entry, parameter):
    """Integrate a lobe whose support ends at a kink."""
    pieces = edge * np.concatenate([[0], 2.0 ** np.arange(-60, 1)])
    density = lambda b: float(entry.normalized(b, parameter)) * np.sin(2 * b)  # noqa: E731
    return np.pi * sum(
        quad(density, *ends, epsabs=0, epsrel=1e-11)[0] for ends in itertools.pairwise(pieces)
    )


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
    ratio = gauss.printed.at_normal(np.float64(m)) / gauss.normalized(0, m)
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
