"""Where lobes pass the levels at which a screen's curve bends, and that curve with its slope."""

import mpmath as mp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import brentq

import mdfconv
from mdfconv.distributions.angles import Angles
from mdfconv.distributions.base import Distribution
from mdfconv.fitting.metrics.base import Display, Environment, srgb
from mdfconv.fitting.problem import bounded_tangent, level_crossings
from mdfconv.fitting.solve import fit
from tests.distributions.cases import INSTANCES, parameters

LEVELS = np.array([0.97, 0.5, 0.0031308, 1e-3])
# Of ln tan β: all of a lobe down to mirrors, and the horizon.
LOW, HIGH = np.log(1e-22), np.log(1e16)


def excess(entry: Distribution, parameter, level):
    """D̄ less a level, as a function of ln tan β."""
    one = np.array([[parameter]])
    return lambda s: float(entry.shape(Angles(tangent=np.exp([[s]])), one)[0, 0]) - level


@pytest.mark.parametrize("label", INSTANCES)
@pytest.mark.parametrize("off", [0.3, 1, 3])
def test_crossings_are_where_the_lobe_has_the_level(label, off):
    entry = INSTANCES[label]
    # Of narrower lobes the bisection's own steps have no digits.
    values = np.array([p for p in parameters(entry) if 1e-6 <= p <= 1e12])
    levels = np.tile(LEVELS, (values.size, 1))
    tangent = off * bounded_tangent(entry, values)
    with np.errstate(all="ignore"):
        found = level_crossings(entry, values[:, None], levels, tangent[:, None])
        for row, value in enumerate(values):
            top = np.tan(entry.mode(np.array([value]))[0])
            middle = np.log(top) if top > 0 else LOW
            for column, angle in enumerate(found[row]):
                function = excess(entry, value, LEVELS[column % LEVELS.size])
                ends = (middle, HIGH) if column < LEVELS.size else (LOW, middle)
                if function(ends[0]) * function(ends[1]) >= 0:
                    assert angle == 0, (value, column)
                    continue
                wanted = np.arctan(np.exp(brentq(function, *ends, xtol=1e-13)))
                # Nearer to the horizon nothing is sampled.
                if wanted < 0.5 * np.pi - 1e-7:
                    assert angle == pytest.approx(wanted, rel=2e-5), (value, column)


@given(st.floats(0, 2), st.sampled_from([0.25, 1.0, 3.0]))
def test_the_curve_of_a_screen_and_its_slope(value, exposure):
    metric = Display(exposure)
    x = mp.mpf(exposure) * mp.mpf(value)
    bend = abs(x - mp.mpf("0.0031308")) < 1e-12 or abs(x - 1) < 1e-12
    if x <= mp.mpf("0.0031308"):
        encoded, slope = mp.mpf("12.92") * x, mp.mpf("12.92") * exposure
    elif x < 1:
        power = x ** (mp.mpf(5) / 12)
        encoded = mp.mpf("1.055") * power - mp.mpf("0.055")
        slope = mp.mpf("1.055") * mp.mpf(5) / 12 * power / x * exposure
    else:
        encoded, slope = mp.mpf(1), mp.mpf(0)
    got, got_slope = metric.encode_with_slope(np.array([[value]]))
    assert got[0, 0] == pytest.approx(float(encoded), rel=1e-13, abs=1e-300)
    assert got[0, 0] == metric.encode(np.array([[value]]))[0, 0]
    if not bend:
        assert got_slope[0, 0] == pytest.approx(float(slope), rel=1e-13, abs=1e-300)
        assert got_slope[0, 0] == metric.encode_slope(np.array([[value]]))[0, 0]


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_the_curve_keeps_type_and_shape(dtype):
    light = np.array([[0, 0.001, 0.5], [1, 2, 1e-30]], dtype=dtype)
    assert srgb(light).dtype == dtype
    assert srgb(light).shape == light.shape
    assert srgb(np.asarray(0.5)).shape == ()
    assert srgb(np.asarray(0.5)) == pytest.approx(0.7353569830524495, rel=1e-14)


def test_similar_lobes_have_one_distance_but_for_those_at_the_limit():
    class Searched(Environment):
        def ratio(self, source, target):
            return None

    ends = mdfconv.distribution("beckmann"), mdfconv.distribution("ggx")
    values = np.array([1e-5, 0.2, 1.1, 1.5, 2.5])
    found, wanted = (
        fit(ends[0], values, ends[1], metric) for metric in (Environment(), Searched())
    )
    np.testing.assert_allclose(found.distance, wanted.distance, rtol=1e-7)
    assert found.at_limit.tolist() == [False, False, False, True, True]
    few = fit(ends[0], values[3:], ends[1], Environment())
    np.testing.assert_allclose(few.distance, wanted.distance[3:], rtol=1e-7)
