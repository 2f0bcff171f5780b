"""Half widths and peaks, against bisection at 50 digits and against the distributions."""

import mpmath as mp
import numpy as np
import pytest

import mdfconv
from tests import oracles
from tests.distributions.cases import INSTANCES, oracle_name, parameters

# A lobe wider than this at one half is nearly uniform: tan β_half says little of the parameter.
WIDEST_TANGENT = 1e3


@pytest.mark.parametrize("label", INSTANCES)
def test_half_width(label):
    entry = INSTANCES[label]
    gamma = 2 if entry.gamma is None else entry.gamma
    for parameter in parameters(entry):
        exact = oracles.half_width(oracle_name(entry), parameter, gamma)
        width = entry.half_width(parameter)
        if exact is None or mp.tan(exact) > WIDEST_TANGENT:
            assert np.isnan(width) or width > np.arctan(WIDEST_TANGENT)
            continue
        assert oracles.relative_error(width, exact) < 1e-13, parameter
        back = entry.from_half_tangent(float(mp.tan(exact)))
        assert back == pytest.approx(parameter, rel=1e-11), parameter


def test_widths_that_do_not_exist_are_nan():
    assert np.isnan(mdfconv.distribution("ggx").half_width([0.8409, 1.0])).all()
    assert np.isnan(mdfconv.distribution("gauss").half_width(1.9))
    assert np.isnan(mdfconv.distribution("smoothie").half_width(3.2))
    assert np.isnan(mdfconv.distribution("schlick").half_width(1.0))


@pytest.mark.parametrize("label", INSTANCES)
def test_peak_alpha(label):
    entry = INSTANCES[label]
    gamma = 2 if entry.gamma is None else entry.gamma
    for parameter in parameters(entry):
        exact = 1 / mp.sqrt(mp.pi * oracles.at_normal(oracle_name(entry), parameter, gamma))
        assert oracles.relative_error(entry.peak_alpha(parameter), exact) < 1e-13, parameter
        if parameter < 1e15 and exact < 0.999:
            back = entry.from_peak_alpha(float(exact))
            assert back == pytest.approx(parameter, rel=1e-12 / float(1 - exact) ** 2), parameter


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
