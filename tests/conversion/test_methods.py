"""Every method and pair against independent evaluations."""

import itertools

import mpmath as mp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import mdfconv
from tests import oracles

NAMES = ["beckmann", "gauss", "ggx", "blinn-phong", "schlick", "sawicki", "smoothie"]
PAIRS = list(itertools.permutations(NAMES, 2))
VALUES = {
    **{name: [1e-6, 0.0044, 0.05, 0.2, 0.4473] for name in NAMES},
    "blinn-phong": [10, 47.3, 1000, 1e5, 1e12],
    "sawicki": [12.04, 55.92, 1174.3, 1e5, 1e12],
}


@pytest.mark.parametrize(("source", "target"), PAIRS)
def test_closed_form(source, target):
    for value in VALUES[source]:
        got = mdfconv.convert(value, source, target)
        exact = oracles.closed_form(source, target, value)
        assert oracles.relative_error(got, exact) < 1e-12, value


@pytest.mark.parametrize(("source", "target"), PAIRS)
def test_half_angle(source, target):
    for value in VALUES[source]:
        got = mdfconv.convert(value, source, target, method="half-angle")
        exact = oracles.from_half_width(target, oracles.half_width(source, value))
        assert oracles.relative_error(got, exact) < 1e-12, value


@pytest.mark.parametrize(("source", "target"), PAIRS)
def test_peak(source, target):
    for value in VALUES[source]:
        got = mdfconv.convert(value, source, target, method="peak")
        at_normal = [
            mdfconv.distribution(name).normalized(0, parameter)
            for name, parameter in ((source, value), (target, got))
        ]
        assert at_normal[0] == pytest.approx(at_normal[1], rel=1e-12)


def test_peak_rules_of_the_sheet():
    for m in (1e-6, 0.01, 0.3, 0.99):
        exact = 2 / mp.mpf(m) ** 2 - 2
        got = mdfconv.convert(m, "beckmann", "blinn-phong", method="peak")
        assert oracles.relative_error(got, exact) < 1e-12
        back = mdfconv.convert(got, "blinn-phong", "beckmann", method="peak")
        assert back == pytest.approx(m, rel=1e-13)
        assert mdfconv.convert(m, "beckmann", "ggx", method="peak") == m


def test_ward():
    assert mdfconv.convert(0.2, "beckmann", "blinn-phong", method="ward") == pytest.approx(50)
    assert mdfconv.convert(50, "blinn-phong", "beckmann", method="ward") == pytest.approx(0.2)


def test_the_papers_figures():
    # Figs 1 and 2 of Sawicki 2021; the text rounds N to 10 and 1000.
    for m, n, m_g, c in ((0.4, 10, 0.4364, 0.4456), (0.04464, 1000, 0.04471, 0.05354)):
        assert mdfconv.convert(m, "beckmann", "blinn-phong") == pytest.approx(n, rel=2e-3)
        assert mdfconv.convert(n, "blinn-phong", "gauss") == pytest.approx(m_g, abs=6e-5)
        assert mdfconv.convert(n, "blinn-phong", "ggx") == pytest.approx(c, abs=6e-5)
    assert mdfconv.convert(10, "blinn-phong", "sawicki") == pytest.approx(12.04)
    assert mdfconv.convert(1000, "blinn-phong", "sawicki") == pytest.approx(1174.3)


@pytest.mark.parametrize(
    ("gamma", "message"),
    [
        (np.array([2.0, 3.0]), "one number, not an array"),
        (np.array([]), "one number, not an array"),
        ("FREE", "a number or 'free', not 'FREE'"),
        ("frei", "a number or 'free', not 'frei'"),
    ],
)
def test_gamma_is_a_number_or_free(gamma, message):
    with pytest.raises(mdfconv.MdfconvError, match=message):
        mdfconv.convert(0.2, "beckmann", "gtr", gamma=gamma)
    with pytest.raises(mdfconv.MdfconvError, match=message):
        mdfconv.explain(0.2, "beckmann", "gtr", gamma=gamma)


def test_gtr_with_gamma_two_is_ggx_and_others_have_no_closed_form():
    assert mdfconv.convert(0.2, "beckmann", "gtr") == mdfconv.convert(0.2, "beckmann", "ggx")
    with pytest.raises(ValueError, match=r"gtr \(γ = 3\); use half-angle or peak"):
        mdfconv.convert(0.2, "beckmann", "gtr", "closed-form", gamma=3)
    alpha = mdfconv.convert(0.2, "beckmann", "gtr", method="half-angle", gamma=3)
    beta = mdfconv.distribution("beckmann").half_width(0.2)
    assert mdfconv.distribution("gtr").unit(beta, alpha, gamma=3) == pytest.approx(0.5)
    assert mdfconv.convert(0.2, "gtr", "gtr", gamma=3) == 0.2


@given(st.sampled_from(PAIRS), st.floats(1e-6, 0.45))
def test_half_angle_comes_back(pair, width):
    source, target = pair
    value = mdfconv.convert(width, "beckmann", source, method="half-angle")
    there = mdfconv.convert(value, source, target, method="half-angle")
    back = mdfconv.convert(there, target, source, method="half-angle")
    assert back == pytest.approx(value, rel=1e-11)


def test_encodings():
    convert = mdfconv.convert
    assert convert(0.25, "ggx", "ggx:roughness") == 0.5
    assert convert(0.25, "ggx", "GGX:Glossiness") == 0.5
    assert convert(0.5, "ggx:glossiness", "ggx:roughness") == pytest.approx(0.5)
    assert convert(0.25, "ggx:alpha", "ggx") == 0.25
    assert convert(2, "beckmann", "beckmann") == 2
    expected = np.sqrt(1.697 / np.sqrt(104.5))
    assert convert(100, "blinn-phong", "ggx:roughness") == pytest.approx(expected)
    assert convert(expected, "ggx:roughness", "blinn-phong") == pytest.approx(100, rel=2e-3)


@pytest.mark.parametrize(
    ("exponent", "limit"), [(1, 0.08), (2, 0.05), (10, 0.0065), (100, 5e-4), (1000, 5e-5)]
)
def test_phongs_own_exponent(exponent, limit):
    """The cumulative distribution of Phong's lobe at normal incidence is 1 − cos^(n+1) 2β."""
    given_ = mdfconv.convert(exponent, "blinn-phong:reflected", "blinn-phong")
    beta = np.geomspace(1e-5, 1, 20001) * np.pi / 2
    phong = 1 - np.maximum(np.cos(2 * beta), 0) ** (exponent + 1)
    blinn = mdfconv.distribution("blinn-phong").cumulative(beta, given_)
    # Under the environment metric: dβ / sin 2β = ½ d ln tan β.
    logarithm = np.log(np.tan(np.minimum(beta, np.pi / 2 - 1e-9)))
    squares = [
        np.trapezoid(np.square(part), logarithm)
        for part in (blinn - phong, phong - np.sin(beta) ** 2)
    ]
    assert np.sqrt(squares[0] / squares[1]) < limit
    back = mdfconv.convert(given_, "blinn-phong", "blinn-phong:reflected")
    assert back == pytest.approx(exponent, rel=1e-14)


def test_phong_says_which_exponent_it_takes():
    (asked,) = mdfconv.explain(100, "phong", "ggx", metric="environment")
    assert "blinn-phong:reflected" in asked.notes[0]
    assert mdfconv.explain(100, "blinn-phong", "ggx")[0].cautions == ()
    assert mdfconv.explain(100, "blinn", "ggx")[0].cautions == ()
    with pytest.raises(mdfconv.MdfconvError, match="unknown encoding of blinn-phong 'alpha'"):
        mdfconv.convert(100, "blinn-phong:alpha", "ggx")


def test_shapes_and_types():
    convert = mdfconv.convert
    assert type(convert(0.2, "beckmann", "ggx")) is float
    assert type(convert(100, "blinn-phong", "ggx")) is float
    assert type(convert(np.float32(0.2), "beckmann", "ggx")) is np.float32
    values = np.array([[0.1, 0.2, 0.3]], dtype=np.float32)
    result = convert(values, "beckmann", "ggx")
    assert result.shape == (1, 3)
    assert result.dtype == np.float32
    assert convert(np.array([10, 100]), "blinn-phong", "ggx").dtype == np.float64
    assert convert([], "beckmann", "ggx").shape == (0,)
    for method in ("half-angle", "peak"):
        assert convert(np.zeros((0, 2)), "schlick", "gauss", method=method).shape == (0, 2)
    x, y = convert((np.array([100.0, 200.0]), 20), "ashikhmin-shirley", "ggx")
    assert x.shape == (2,)
    assert y == convert(20, "blinn-phong", "ggx")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((0.9, "beckmann", "blinn-phong"), "N = -0.03.*half-angle answers 1.067"),
        ((0.9, "beckmann", "sawicki"), "no answer in sawicki.*half-angle answers"),
        ((0.9, "ggx", "beckmann", "half-angle"), "no answer.*closed-form answers 1.2.*peak"),
        ((2.0, "beckmann", "ggx", "peak"), "outside 0 < α ≤ 1; half-angle answers 0.83"),
        ((1.0, "ggx", "smoothie"), "no method answers"),
        ((0.2, "gauss", "ggx", "ward"), "ward has no conversion.*closed-form or half-angle"),
        ((1.2, "ggx:roughness", "ggx"), "0 < r ≤ 1"),
        ((1.0, "ggx:glossiness", "ggx"), "0 ≤ g < 1"),
        ((2.0, "beckmann", "beckmann:roughness"), "cannot store"),
        ((0.2, "gauss:roughness", "ggx"), "gauss has no encoding 'roughness'"),
        ((0.2, "ggx:rough", "ggx"), "did you mean roughness"),
        ((0.2, "ggx", "bekman"), "did you mean beckmann"),
        ((0.2, "ggx", "gauss", "half"), "did you mean half-angle"),
        (([0.1, 1.5, 0.2], "ggx", "gauss"), "value 2 of 3"),
        (([0.1, 0.9], "beckmann", "blinn-phong"), "value 2 of 2"),
        ((np.nan, "ggx", "gauss"), "not a finite number"),
        ((-np.inf, "ggx", "gauss"), "not a finite number"),
        ((0, "blinn-phong", "gauss"), "N > 0"),
        ((True, "ggx", "gauss"), "real numbers"),
        (("0.2", "ggx", "gauss"), "real numbers"),
        (((100, 20), "blinn-phong", "ggx"), "use ashikhmin-shirley"),
        (((100, 20), "ashikhmin-shirley", "gauss"), "gauss is isotropic"),
        (((100, 20, 3), "ashikhmin-shirley", "ggx"), "two members"),
    ],
)
def test_mistakes_are_named(arguments, words):
    with pytest.raises(mdfconv.MdfconvError, match=words):
        mdfconv.convert(*arguments)


def test_awkward_numbers_are_refused_in_words():
    with pytest.raises(mdfconv.MdfconvError, match="no answer in gauss"):
        mdfconv.convert(1.0, "ggx", "gauss", method="peak")
    with pytest.raises(mdfconv.MdfconvError, match="none in float32; convert in float64"):
        mdfconv.convert(np.float32(1e-30), "ggx", "blinn-phong")
    with pytest.raises(mdfconv.MdfconvError, match="masked"):
        mdfconv.convert(np.ma.array([0.2, 0.3], mask=[0, 1]), "ggx", "blinn-phong")
    with pytest.raises(mdfconv.MdfconvError, match="too large"):
        mdfconv.convert(10**400, "blinn-phong", "ggx")
    with pytest.raises(mdfconv.MdfconvError, match="real numbers"):
        mdfconv.explain("x", "ggx", "gauss")


def test_an_encoding_that_underflows_is_refused():
    with pytest.raises(ValueError, match="0 < α ≤ 1"):
        mdfconv.convert(1e-200, "ggx:roughness", "ggx")
