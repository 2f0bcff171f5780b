"""Half widths and peaks, against bisection at 50 digits and against the distributions."""

import mpmath as mp
import numpy as np
import pytest

import mdfconv
from tests import oracles

PARAMETERS = {
    "beckmann": [1e-8, 1e-4, 0.02, 0.4, 0.7072, 1.0, 3.0, 1e4],
    "gauss": [1e-8, 1e-4, 0.02, 0.4, 1.0, 1.88],
    "ggx": [1e-8, 1e-4, 0.02, 0.4, 0.84],
    "blinn-phong": [0.01, 1, 2.5, 50, 1e5, 1e16],
    "schlick": [1e-8, 1e-4, 0.02, 0.4, 0.99],
    "sawicki": [0.01, 0.5, 1, 2.5, 50, 1e5, 1e16],
    "smoothie": [1e-8, 1e-4, 0.02, 0.4, 1.0, 3.1],
}
CASES = [(name, p) for name, values in PARAMETERS.items() for p in values]


@pytest.mark.parametrize(("name", "parameter"), CASES)
def test_half_width(name, parameter):
    exact = oracles.half_width(name, parameter)
    entry = mdfconv.distribution(name)
    assert oracles.relative_error(entry.half_width(parameter), exact) < 1e-13
    back = entry.from_half_tangent(float(mp.tan(exact)))
    assert back == pytest.approx(parameter, rel=1e-12)


@pytest.mark.parametrize("gamma", [0.7, 1, 3])
def test_half_width_of_gtr(gamma):
    exact = oracles.half_width("gtr", 0.2, gamma)
    entry = type(mdfconv.distribution("gtr"))(gamma)
    assert oracles.relative_error(entry.half_width(0.2), exact) < 1e-14
    assert entry.from_half_tangent(float(mp.tan(exact))) == pytest.approx(0.2, rel=1e-13)


def test_widths_that_do_not_exist_are_nan():
    assert np.isnan(mdfconv.distribution("ggx").half_width([0.8409, 1.0])).all()
    assert np.isnan(mdfconv.distribution("gauss").half_width(1.9))
    assert np.isnan(mdfconv.distribution("smoothie").half_width(3.2))
    assert np.isnan(mdfconv.distribution("schlick").half_width(1.0))


@pytest.mark.parametrize(
    ("name", "alpha_of"),
    [
        ("beckmann", lambda p: p),
        ("ggx", lambda p: p),
        ("schlick", lambda p: p),
        ("blinn-phong", lambda n: mp.sqrt(2 / (n + 2))),
        ("sawicki", lambda n: mp.sqrt(256 / (96 * (n + 3)))),
        ("smoothie", lambda a: mp.sqrt(a**2 / (a**2 + 4))),
    ],
)
def test_peak_alpha(name, alpha_of):
    entry = mdfconv.distribution(name)
    for parameter in PARAMETERS[name]:
        exact = alpha_of(mp.mpf(parameter))
        assert oracles.relative_error(entry.peak_alpha(parameter), exact) < 1e-15 * 4
        if parameter < 1e15 and exact < 0.9999999:
            back = entry.from_peak_alpha(float(exact))
            assert back == pytest.approx(parameter, rel=1e-12 / float(1 - exact) ** 2)


@pytest.mark.parametrize("m", [1e-8, 1e-3, 0.3, 1.0])
def test_peak_alpha_of_gauss(m):
    # The normalized form's own value at the normal, tested by quadrature elsewhere.
    gauss = mdfconv.distribution("gauss")
    assert gauss.peak_alpha(m) == pytest.approx(1 / np.sqrt(np.pi * gauss.normalized(0, m)))
    assert gauss.from_peak_alpha(gauss.peak_alpha(m)) == pytest.approx(m, rel=1e-12)


def test_peaks_that_do_not_exist_are_nan():
    assert np.isnan(mdfconv.distribution("ggx").from_peak_alpha(1.1))
    assert np.isnan(mdfconv.distribution("gauss").from_peak_alpha(1.1))
    assert np.isnan(mdfconv.distribution("smoothie").from_peak_alpha(1.0))
    assert np.isnan(mdfconv.distribution("blinn-phong").from_peak_alpha(1.5))
