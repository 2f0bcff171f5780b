"""The elementary functions against 50 digits, over their whole domains."""

import mpmath as mp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import mdfconv
from mdfconv.distributions import elementary
from mdfconv.distributions.angles import Angles
from tests import generate_elementary

KINDS = [np.float32, np.float64]
SMALLEST = {kind: float(np.finfo(kind).smallest_subnormal) for kind in KINDS}
HALF_PI = {kind: kind(np.pi / 2) for kind in KINDS}
FUNCTIONS = ("tangent_square", "sine_square", "versine", "cosine", "cosine_square", "log_secant")
# An angle's digits are those of its distance to π/2, which the angle itself has not.
ANGLES = st.one_of(
    st.floats(0, np.pi / 2),
    st.floats(-320, 0).map(lambda power: 10**power),
    st.floats(-16, 0).map(lambda power: np.pi / 2 - 10**power),
)
# Products of a number and a factor, down to where float64 has only 0.
EXPONENTS = st.one_of(st.floats(-800, 0), st.floats(-320, 2.8).map(lambda power: -(10**power)))


def units(value, exact, kind):
    """Return the error in units in the last place of the exact value, subnormal ones included."""
    assert value.dtype == kind
    limits = np.finfo(kind)
    with mp.workdps(50):
        magnitude = abs(exact)
        exponent = mp.floor(mp.log(magnitude, 2)) if magnitude else -mp.inf
        unit = mp.mpf(2) ** (max(exponent, limits.minexp) - limits.nmant)
        return float(abs(mp.mpf(float(value)) - exact) / unit)


@pytest.mark.parametrize("kind", KINDS)
@given(ANGLES)
def test_functions_of_an_angle(kind, angle):
    beta = np.array([angle], kind)
    # float32's π/2 is beyond π/2, and its tangent negative.
    if not 0 <= beta[0] <= HALF_PI[kind]:
        return
    with mp.workdps(50):
        exact = mp.mpf(float(beta[0]))
        square = mp.tan(exact) ** 2
        error = units(Angles(beta).tangent_square[0], square, kind)
        assert error <= (2.5 if exact < 0.3 else 13), error
        assert units(Angles(beta).sine_square[0], mp.sin(exact) ** 2, kind) <= 5
        assert units(Angles(beta).cosine[0], abs(mp.cos(exact)), kind) <= 6
        if exact > 10 * SMALLEST[kind] ** 0.5:
            with mp.workdps(400):
                logarithm = -mp.log(abs(mp.cos(exact)))
            assert units(Angles(beta).log_secant[0], logarithm, kind) <= 6
        error = units(elementary.versine(np.square(beta))[0], 2 * mp.sin(exact / 2) ** 2, kind)
        assert error <= 2.5, error


@pytest.mark.parametrize("kind", KINDS)
def test_ends_of_the_angles(kind):
    beta = np.array([0, SMALLEST[kind], np.finfo(kind).tiny, HALF_PI[kind]], kind)
    square = Angles(beta).tangent_square
    np.testing.assert_array_equal(square[:3], 0)
    with mp.workdps(50):
        assert units(square[3], mp.tan(mp.mpf(float(beta[3]))) ** 2, kind) <= 13
    np.testing.assert_array_equal(elementary.versine(np.square(beta))[:3], 0)
    for angles in (Angles(np.array([np.nan], kind)), Angles(np.zeros((2, 0), kind))):
        for name in FUNCTIONS:
            value = getattr(angles, name)
            assert value.shape == angles.shape
            assert np.isnan(value).all()


@pytest.mark.parametrize("kind", KINDS)
@given(st.floats(-320, 308))
def test_logarithms(kind, power):
    x = np.array([min(10**power, float(np.finfo(kind).max))], kind)
    with mp.workdps(400):
        exact = mp.log1p(mp.mpf(float(x[0])))
        assert units(elementary.log1p(x)[0], exact, kind) <= 3.5


@pytest.mark.parametrize("kind", KINDS)
@given(EXPONENTS)
def test_exponentials(kind, exponent):
    x = np.array([exponent], kind)
    allowed = 3 + abs(float(x[0]))
    with mp.workdps(50):
        exact = mp.mpf(float(x[0]))
        for factor in (1.0, np.ones(1, kind)):
            value = elementary.exp_of_product(x, factor)[0]
            assert units(value, mp.exp(exact), kind) <= allowed
            value = elementary.one_minus_exp_of_product(x, factor)[0]
            assert units(value, -mp.expm1(exact), kind) <= 4.5
        # What the product rounds counts as often as it is larger than 1.
        value = elementary.exp_of_product(x / 4, kind(4))[0]
        assert value == elementary.exp_of_product(x, kind(1))[0] or 4 * (x[0] / 4) != x[0]


@pytest.mark.parametrize("kind", KINDS)
def test_ends_of_the_exponentials(kind):
    x = np.array([0, -0.0, -np.finfo(kind).max, -np.inf, np.nan], kind)
    factor = kind(1)
    with np.errstate(all="ignore"):
        values = elementary.exp_of_product(x, factor)
        rest = elementary.one_minus_exp_of_product(x, factor)
    np.testing.assert_array_equal(values, [1, 1, 0, 0, np.nan])
    np.testing.assert_array_equal(rest, [0, 0, 1, 1, np.nan])
    out = np.empty(3, kind)
    assert elementary.exp_of_product(np.zeros(3, kind), factor, out) is out
    # Beside a number whose power is subnormal all others are as they are alone.
    alone = elementary.exp_of_product(np.array([-1.5], kind), factor)[0]
    assert elementary.exp_of_product(np.array([-1.5, -1e4], kind), factor)[0] == alone
    wide = elementary.exp_of_product(np.array([[-1.0, -2.0]], kind), np.ones((3, 1), kind))
    assert wide.shape == (3, 2)


def test_the_coefficients_are_those_of_the_script():
    assert generate_elementary.FILE.read_text() == generate_elementary.text()


@pytest.mark.parametrize("name", [mdf.name for mdf in mdfconv.list_distributions()])
@pytest.mark.parametrize("kind", KINDS)
def test_lobes_from_each_variable(name, kind):
    mdf = mdfconv.distribution(name)
    beta = np.array([0, 0.02, 0.2, 0.7, 1.2, 1.5], kind)
    tolerance = 2e-11 if kind is np.float64 else 3e-3
    for parameter in (mdf.parameter.typical_value, 0.5):
        for form in (mdf.unit, mdf.normalized):
            from_angle = form(beta, parameter)
            slope = form(np.tan(beta), parameter, variable="slope")
            np.testing.assert_allclose(slope, from_angle, rtol=20 * np.finfo(kind).eps * 100)
            cosine = form(np.cos(beta), parameter, variable="cosine")
            np.testing.assert_allclose(cosine, from_angle, rtol=tolerance)
            assert slope.dtype == cosine.dtype == kind


def test_ends_of_the_variables():
    for mdf in mdfconv.list_distributions():
        cosine = mdf.unit([1 + 1e-16, 1, 0, -1e-9, -1, np.nan], 0.5, variable="cosine")
        assert cosine[0] == cosine[1] == mdf.unit(0, 0.5)
        assert 0 <= cosine[2] < 1
        np.testing.assert_array_equal(cosine[3:5], 0)
        assert np.isnan(cosine[5])
        slope = mdf.unit([0.3, -0.3, np.inf, 1e300, np.nan], 0.5, variable="slope")
        assert slope[0] == slope[1] == pytest.approx(mdf.unit(np.arctan(0.3), 0.5), rel=1e-13)
        assert 0 <= slope[2] == slope[3] < 1
        assert np.isnan(slope[4])
    with pytest.raises(mdfconv.MdfconvError, match="angle, cosine, slope, not 'sine'"):
        mdfconv.distribution("ggx").unit(0.1, 0.2, variable="sine")


def test_a_slope_has_all_the_digits_of_a_mirror():
    ggx = mdfconv.distribution("ggx")
    assert ggx.unit(1e-9, 1e-9, variable="slope") == pytest.approx(0.25, rel=1e-14)
    assert ggx.unit(np.cos(1e-9), 1e-9, variable="cosine") == 1


def test_angles_are_computed_once_and_taken_in_part():
    angles = Angles(np.linspace(0.1, 1.5, 6).reshape(2, 3))
    assert angles.shape == (2, 3)
    assert angles.tangent_square is angles.tangent_square
    np.testing.assert_allclose(angles.tangent, np.tan(angles.beta), rtol=1e-14)
    np.testing.assert_allclose(angles.sine_square, np.sin(angles.beta) ** 2, rtol=1e-14)
    np.testing.assert_allclose(angles.versine, 1 - np.cos(angles.beta), rtol=1e-13)
    np.testing.assert_allclose(angles.log_secant, -np.log(np.cos(angles.beta)), rtol=1e-12)
    part = angles[1:, :2]
    assert part.shape == (1, 2)
    np.testing.assert_array_equal(part.versine, angles.versine[1:, :2])
    from_slope = Angles(tangent=angles.tangent)
    for name in ("beta", *FUNCTIONS):
        np.testing.assert_allclose(getattr(from_slope, name), getattr(angles, name), rtol=1e-14)
