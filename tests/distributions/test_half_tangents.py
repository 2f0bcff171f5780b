"""tan β_half and back over the whole legal range, and the tables that give the start."""

import mpmath as mp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import mdfconv
from mdfconv.distributions.table import PolynomialTable, filled
from tests import oracles

LIMIT = 1e-14


def error(name, tangent, parameter, gamma=2):
    """Return by which share a tangent misses D = ½ D(0), to first order, at many digits."""
    digits = 60 + 3 * int(abs(mp.log10(tangent))) + int(abs(mp.log10(parameter)))
    with mp.workdps(digits):
        step = mp.mpf(10) ** -25

        def ratio(share):
            return oracles.ratio_mp(name, mp.atan(mp.mpf(tangent) * share), parameter, gamma)

        fall = (ratio(1 + step) - ratio(1 - step)) / (2 * step)
        return float((ratio(mp.mpf(1)) - mp.mpf("0.5")) / fall), float(fall)


@given(st.sampled_from(["beckmann", "schlick", "sawicki"]), st.floats(-100, 100))
def test_half_tangents_of_all_parameters(name, exponent):
    entry = mdfconv.distribution(name)
    parameter = 10.0 ** (exponent if name == "sawicki" else -abs(exponent))
    tangent = entry.half_tangent(parameter)
    if np.isnan(tangent):
        assert (name, parameter) == ("schlick", 1)
        return
    miss, _ = error(name, tangent, parameter)
    # 1 − m w has the digits of 1 − m.
    rounding = 3e-16 * tangent if name == "schlick" else 0
    assert abs(miss) < LIMIT + rounding


@given(st.floats(-2, 2))
def test_half_tangents_of_rough_lobes(logarithm):
    parameter = 10.0**logarithm
    assert (
        abs(
            error("beckmann", mdfconv.distribution("beckmann").half_tangent(parameter), parameter)[
                0
            ]
        )
        < LIMIT
    )


@given(st.sampled_from([2, 2.001, 3.3, 1e3, 1e6]), st.floats(-100, 0.3))
def test_half_tangents_of_student_t(gamma, logarithm):
    parameter = 10.0**logarithm
    tangent = mdfconv.distribution("student-t").with_gamma(gamma).half_tangent(parameter)
    if np.isnan(tangent):
        assert gamma < 2.01
        assert parameter > 0.84
        return
    if tangent < 1e6:
        miss, fall = error("student-t", tangent, parameter, gamma)
        assert abs(miss) < LIMIT * max(1, 1 / abs(fall))


@given(st.floats(-100, 8))
def test_schlick_of_all_tangents(logarithm):
    tangent = 10.0**logarithm
    parameter = mdfconv.distribution("schlick").from_half_tangent(tangent)
    step = mp.mpf(10) ** -25
    with mp.workdps(60 + 3 * int(abs(logarithm))):
        beta = mp.atan(mp.mpf(tangent))

        def ratio(share):
            return oracles.ratio_mp("schlick", beta, mp.mpf(parameter) * share, 2)

        rise = (ratio(1) - ratio(1 - step)) / step
        assert abs((ratio(1) - mp.mpf("0.5")) / rise) < LIMIT


@pytest.mark.parametrize("name", ["beckmann", "schlick", "sawicki", "student-t"])
def test_many_values_are_what_each_is_alone(name):
    entry = mdfconv.distribution(name)
    values = np.random.default_rng(3).uniform(0.01, 1, 500)
    alone = [entry.half_tangent(value) for value in values.tolist()]
    np.testing.assert_allclose(entry.half_tangent(values), alone, rtol=1e-14)
    assert entry.half_tangent(values.reshape(20, 25)).shape == (20, 25)


@pytest.mark.parametrize("degree", [2, 5])
def test_a_table_leaves_out_what_is_not_smooth(degree):
    def function(x):
        return np.where(x < 0.3, np.sin(3 * x), np.where(x < 0.7, 1 + x, 1.001 + x)) + 1

    table = PolynomialTable(function, degree, 512, 1e-7, [0.3, 0.7])
    x = np.append(np.random.default_rng(1).uniform(0, 1, 20000), [0, 1])
    value = table(x)
    known = ~np.isnan(value)
    assert known.mean() > 0.99
    assert np.abs(x[~known, None] - [0.3, 0.7]).min(axis=1).max() < 1 / 512
    np.testing.assert_allclose(value[known], function(x[known]), rtol=1e-7)
    np.testing.assert_array_equal(filled(table(x), lambda rows: -x[rows])[~known], -x[~known])
    with np.errstate(invalid="ignore"):
        assert np.isnan(table(np.array([1.1, 1e300, np.inf, np.nan, -np.nan]))).all()
