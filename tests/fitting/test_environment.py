"""The environment metric: its identity in harmonics, its constants, printed values, limits."""

import mpmath as mp
import numpy as np
import pytest
from scipy.special import eval_legendre, roots_legendre

import mdfconv
from mdfconv.distributions.angles import Angles
from mdfconv.fitting.metrics.base import Energy, Environment
from mdfconv.fitting.solve import fit

# Beckmann → GGX is the root of 2 a e^a E₁(a) = 1, as α = √a m.
CONSTANT = 0.7810619641455308


class Searched(Environment):
    """The metric without its constants."""

    def ratio(self, source, target):
        """Leave every pair to the search."""
        return


def fitted(source, parameter, target, metric=None):
    source, target = (
        mdfconv.distribution(name) if isinstance(name, str) else name for name in (source, target)
    )
    return fit(source, np.atleast_1d(np.float64(parameter)), target, metric or Environment())


@pytest.mark.parametrize(
    ("source", "parameter", "target", "result"),
    [("beckmann", 0.4, "ggx", 0.3), ("gauss", 0.5, "beckmann", 0.6), ("sawicki", 9, "gauss", 0.5)],
)
@pytest.mark.parametrize(
    ("metric", "power"),
    [(Energy(), lambda n: 1 + 0 * n), (Environment(), lambda n: 1 / n / (n + 1))],
)
def test_the_distance_is_the_sum_over_the_power_spectrum(
    source, parameter, target, result, metric, power
):
    lobes = [(mdfconv.distribution(source), parameter), (mdfconv.distribution(target), result)]
    x, weight = roots_legendre(4000)
    beta, weight = 0.25 * np.pi * (1 + x), 0.25 * np.pi * weight
    difference = lobes[1][0].normalized(beta, result) - lobes[0][0].normalized(beta, parameter)
    mass = weight * np.pi * np.sin(2 * beta) * difference
    degree = np.arange(1, 600)
    factor = np.array([mass @ eval_legendre(n, np.cos(2 * beta)) for n in degree])
    total = np.sum((2 * degree + 1) * power(degree) * factor**2)
    angles = Angles(beta)
    signals = [metric.signal(lobe, angles, np.full(1, p), np.ones(1)) for lobe, p in lobes]
    integral = weight @ (metric.weight(angles) * (signals[1] - signals[0]) ** 2)
    # With C = 1 the identity has π² sin 2β, the energy metric's weight is π sin 2β.
    integral *= np.pi if isinstance(metric, Energy) else 1
    assert integral == pytest.approx(total, rel=1e-8)


def test_the_constant_of_beckmann_and_ggx():
    with mp.workdps(40):
        root = mp.findroot(lambda a: 2 * a * mp.exp(a) * mp.e1(a) - 1, 0.6)
        exact = float(mp.sqrt(root))
    assert exact == CONSTANT
    assert fitted("beckmann", 1.0, "ggx").parameter[0] == pytest.approx(exact, rel=1e-15)


@pytest.mark.parametrize("method", ["fit", "fast"])
def test_there_and_back_is_the_identity(method):
    # Beyond, Beckmann's m_B leaves the usual range, and what is stored ends.
    given = np.geomspace(1e-8, 1 if method == "fit" else 0.78, 200)
    there = mdfconv.convert(given, "ggx", "beckmann", method, metric="environment")
    back = mdfconv.convert(there, "beckmann", "ggx", method, metric="environment")
    np.testing.assert_allclose(back, given, rtol=1e-14)


@pytest.mark.parametrize(("gamma", "ratio"), [(3, 0.8830661), (5, 0.9395189), (20, 0.9869297)])
def test_the_constants_of_student_t(gamma, ratio):
    student = mdfconv.distribution("student-t").with_gamma(gamma)
    found = fitted("beckmann", [1e-6, 0.2], student).parameter
    np.testing.assert_allclose(found, [1e-6 * ratio, 0.2 * ratio], rtol=1e-7)


@pytest.mark.parametrize("parameter", [1e-3, 0.2, 0.9])
@pytest.mark.parametrize(("source", "target"), [("beckmann", "ggx"), ("ggx", "beckmann")])
def test_a_constant_is_what_the_search_finds(source, target, parameter):
    found, searched = (
        fitted(source, parameter, target, metric) for metric in (Environment(), Searched())
    )
    assert found.parameter[0] == pytest.approx(searched.parameter[0], rel=1e-8)
    assert found.distance[0] == pytest.approx(searched.distance[0], rel=1e-9)


def test_a_constant_ends_at_the_legal_range():
    found = fitted("beckmann", [1.2, 2.0], "ggx")
    assert found.at_limit.tolist() == [False, True]
    np.testing.assert_allclose(found.parameter, [1.2 * CONSTANT, 1], rtol=1e-15)
    assert fitted("beckmann", 2.0, "ggx", Searched()).parameter[0] == 1


@pytest.mark.parametrize("m", [0.01, 0.3, 1.0, 3.9, 4.1, 50.0, 1e4])
def test_slopes_of_the_cumulative_form_of_gauss(m):
    beta = np.array([[0.3 * min(m, 1), 0.7 * min(m, 1), 1.2]])
    _, slopes = mdfconv.distribution("gauss").cumulative_with_slope(
        Angles(beta), np.full((1, 1), m)
    )
    weight = lambda b: mp.exp(-((b / m) ** 2)) * mp.sin(2 * b)  # noqa: E731
    second = lambda b: 2 * (b / m) ** 2 * weight(b)  # noqa: E731
    with mp.workdps(40):
        edges = [0, *(e for e in (m / 2, m, 2 * m, 4 * m, 8 * m) if e < 1.57), mp.pi / 2]
        for angle, slope in zip(beta[0], slopes[0], strict=True):
            inner = [e for e in edges if e < angle] + [mp.mpf(angle)]
            whole = mp.quad(weight, edges)
            share = mp.quad(weight, inner) / whole
            exact = (mp.quad(second, inner) - share * mp.quad(second, edges)) / whole
            assert slope == pytest.approx(float(exact), rel=1e-9, abs=1e-14)


@pytest.mark.parametrize(
    ("source", "parameter", "target", "printed", "digit"),
    [
        ("beckmann", 0.05, "blinn-phong", 798.999999, 1e-6),
        ("beckmann", 0.2, "blinn-phong", 48.99972, 1e-5),
        ("beckmann", 0.4, "blinn-phong", 11.49618, 1e-5),
        ("beckmann", 0.7, "blinn-phong", 3.05790, 1e-5),
        ("beckmann", 1.0, "blinn-phong", 0.939952, 1e-6),
        ("beckmann", 0.2, "gauss", 0.20002491, 1e-8),
        ("beckmann", 0.4, "gauss", 0.40097217, 1e-8),
        ("beckmann", 0.7, "gauss", 0.7247334, 1e-7),
        ("beckmann", 1.0, "gauss", 1.23047, 1e-5),
        ("beckmann", 0.05, "sawicki", 1257.381, 1e-3),
        ("beckmann", 0.2, "sawicki", 76.57048, 1e-5),
        ("beckmann", 0.4, "sawicki", 17.49653, 1e-5),
        ("beckmann", 0.05, "schlick", 0.0400835, 1e-7),
        ("beckmann", 0.2, "schlick", 0.1693624, 1e-7),
        ("beckmann", 0.4, "schlick", 0.3508256, 1e-7),
        ("blinn-phong", 10, "ggx", 0.3319454, 1e-7),
        ("blinn-phong", 100, "ggx", 0.1098842, 1e-7),
        ("blinn-phong", 1000, "ggx", 0.03491190, 1e-8),
    ],
)
def test_known_answers(source, parameter, target, printed, digit):
    found = fitted(source, parameter, target).parameter[0]
    assert abs(found - printed) <= 0.5001 * digit
