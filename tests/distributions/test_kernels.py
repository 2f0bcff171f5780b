"""Kernels against 50 digits, on hard cases first."""

import mpmath as mp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import mdfconv
from tests import oracles
from tests.distributions.cases import ENTRIES, HALF_PI, INSTANCES, angles, parameters

LIMITS = {np.float64: (5e-12, 1e-280), np.float32: (1e-4, 1e-30)}


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize("label", INSTANCES)
def test_unit_form_at_fifty_digits(label, dtype):
    tolerance, floor = LIMITS[dtype]
    entry = INSTANCES[label]
    options = {} if entry.gamma is None else {"gamma": dtype(entry.gamma)}
    for parameter in parameters(entry, dtype):
        beta = angles(entry, float(parameter)).astype(dtype)
        values = entry.unit(beta, parameter, **options)
        assert values.dtype == dtype
        assert np.all(values >= 0)
        assert np.all(values <= 1 + 4 * np.finfo(dtype).eps)
        for angle, value in zip(beta, values, strict=True):
            if float(angle) > HALF_PI:
                # float32's π/2 lies beyond π/2, where the power of a cosine has no meaning.
                continue
            exact = oracles.unit(entry.name, angle, parameter, options.get("gamma", 2))
            if exact > floor:
                error = oracles.relative_error(value, exact)
                assert error <= tolerance, (
                    f"D̄ of {label} at β = {angle} for {parameter} is off by {error:.1e} from its "
                    f"printed form, {float(exact)}: see _lobe"
                )


@pytest.mark.parametrize("label", INSTANCES)
def test_single_precision_half_pi_is_the_limit(label):
    entry = INSTANCES[label]
    beta = np.float32(HALF_PI)
    for parameter in parameters(entry):
        value = entry.unit(beta, parameter)
        # As far beyond the horizon as the mirrored angle lies before it.
        limit = entry.unit(np.pi - float(beta), parameter)
        if parameter >= 1 or not entry.parameter.larger_is_smoother:
            np.testing.assert_allclose(value, limit, rtol=1e-3, atol=1e-7)
        assert np.isfinite(value)


@pytest.mark.parametrize("label", INSTANCES)
def test_parameters_broadcast_against_angles(label):
    entry = INSTANCES[label]
    parameter = np.asarray(parameters(entry))
    beta = np.linspace(0, HALF_PI, 100)
    grid = entry.unit(beta[:, None], parameter)
    assert grid.shape == (100, parameter.size)
    for column, value in zip(grid.T, parameter, strict=True):
        np.testing.assert_allclose(column, entry.unit(beta, value), rtol=1e-13)
    # One angle for many parameters.
    np.testing.assert_allclose(entry.unit(0.1, parameter), entry.unit(beta[:1] + 0.1, parameter))


@pytest.mark.parametrize("name", [n for n, entry in ENTRIES.items() if entry.second_parameter])
def test_a_second_parameter_broadcasts_too(name):
    entry = ENTRIES[name]
    gamma = np.array([2.0, 2.5, 7.0])
    beta = np.linspace(0, HALF_PI, 100)[:, None]
    for form in ("unit", "normalized"):
        together = getattr(entry, form)(beta, 0.3, gamma=gamma)
        for column, value in zip(together.T, gamma, strict=True):
            alone = getattr(entry.with_gamma(value), form)(beta[:, 0], 0.3)
            np.testing.assert_allclose(column, alone, rtol=1e-13)
    assert entry.unit(np.float32(0.1), 0.3, gamma=np.float32(3)).dtype == np.float32


def test_shapes_and_types():
    ggx = mdfconv.distribution("ggx")
    assert isinstance(ggx.unit(0.1, 0.2), np.float64)
    assert ggx.unit(np.array(0.1, dtype=np.float32), 0.2).dtype == np.float32
    assert ggx.unit(np.float32(0.1), np.float64(0.2)).dtype == np.float64
    assert ggx.unit(np.array([0.1], dtype=np.float16), 0.2).dtype == np.float16
    assert ggx.unit([0, 1], 1).dtype == np.float64
    assert ggx.unit(np.zeros((0, 3)), 0.2).shape == (0, 3)
    assert ggx.unit(0.1, np.zeros((2, 0))).shape == (2, 0)
    beta = np.linspace(0, 1, 60).reshape(3, 4, 5)
    expected = ggx.unit(beta.ravel(), 0.2).reshape(3, 4, 5)
    np.testing.assert_array_equal(ggx.unit(beta, 0.2), expected)
    np.testing.assert_array_equal(ggx.unit(beta.T, 0.2), expected.T)
    np.testing.assert_array_equal(ggx.unit(beta[:, ::-2], 0.2), expected[:, ::-2])


def test_inputs_are_left_alone():
    for entry in mdfconv.list_distributions():
        beta = np.linspace(0, 1.5, 1000)
        parameter = np.full(1000, 0.5)
        entry.normalized(beta, parameter)
        np.testing.assert_array_equal(beta, np.linspace(0, 1.5, 1000))
        np.testing.assert_array_equal(parameter, 0.5)


def test_facets_below_the_horizon_do_not_count():
    for entry in mdfconv.list_distributions():
        value = entry.unit([-0.1, 0.1, 1.6, 3.1, -2, np.inf, np.nan], 0.5)
        assert value[0] == value[1] > 0
        np.testing.assert_array_equal(value[2:6], 0)
        assert np.isnan(value[6])


@given(
    st.sampled_from(sorted(INSTANCES)),
    st.floats(0, HALF_PI),
    st.floats(1e-12, 1),
)
def test_unit_form_stays_in_the_unit_interval(label, beta, parameter):
    entry = INSTANCES[label]
    value = entry.unit(beta, 1 / parameter if entry.parameter.larger_is_smoother else parameter)
    assert 0 <= value <= 1 + 1e-15


def test_large_arrays_agree_with_small_ones():
    beta = np.linspace(0, HALF_PI, 300_001)
    for entry in mdfconv.list_distributions():
        whole = entry.unit(beta, 0.3)
        np.testing.assert_array_equal(whole[::1000], entry.unit(beta[::1000], 0.3))


@pytest.mark.parametrize("name", ["ggx", "beckmann", "ashikhmin-shirley"])
def test_anisotropic_forms(name):
    entry = mdfconv.distribution(name)
    x, y = (30.0, 5.0) if name == "ashikhmin-shirley" else (0.1, 0.9)
    rng = np.random.default_rng(7)
    for beta, phi in zip(rng.uniform(0, 1.5, 30), rng.uniform(0, 2 * np.pi, 30), strict=True):
        exact = anisotropic_oracle(name, beta, phi, x, y)
        if exact > 1e-280:
            assert oracles.relative_error(entry.normalized(beta, (x, y), phi=phi), exact) < 5e-12
    beta = np.linspace(0, HALF_PI, 50)
    # Along an axis the section is the one-parameter distribution's; equal parameters are it.
    np.testing.assert_allclose(
        entry.unit(beta, (x, x), phi=0.7), entry.unit(beta, x), rtol=1e-12, atol=1e-300
    )
    phi = np.linspace(0, 2 * np.pi, 181)
    surface = entry.unit(beta[:, None], (x, y), phi=phi)
    assert 0.99 < surface.max() <= 1 + 1e-14
    assert surface.min() >= 0


def anisotropic_oracle(name, beta, phi, x, y):
    beta, phi, x, y = map(mp.mpf, (beta, phi, x, y))
    c, t = mp.cos(beta), mp.tan(beta)
    slope = t**2 * (mp.cos(phi) ** 2 / x**2 + mp.sin(phi) ** 2 / y**2)
    if name == "ggx":
        return 1 / (mp.pi * x * y * c**4 * (1 + slope) ** 2)
    if name == "beckmann":
        return mp.exp(-slope) / (mp.pi * x * y * c**4)
    power = x * mp.cos(phi) ** 2 + y * mp.sin(phi) ** 2
    return mp.sqrt((x + 2) * (y + 2)) / (2 * mp.pi) * c**power


@pytest.mark.parametrize(
    ("name", "parameter", "options", "words"),
    [
        ("ggx", 1.5, {}, "0 < α ≤ 1"),
        ("ggx", 0, {}, "0 < α ≤ 1"),
        ("ggx", np.nan, {}, "not a finite number"),
        ("beckmann", np.inf, {}, "not a finite number"),
        ("beckmann", [0.1, -0.2, 0.3], {}, "value 2 of 3"),
        ("gauss", (0.1, 0.2), {}, "isotropic"),
        ("gauss", 0.1, {"phi": 0.1}, "isotropic"),
        ("ggx", (0.1, 0.2), {}, "needs an azimuth"),
        ("ggx", (0.1, 0.2, 0.3), {"phi": 0}, "two members"),
        ("ggx", 0.1, {"phi": 0}, "needs a pair"),
        ("gtr", 0.1, {"gamma": 0}, "1e-06 ≤ γ ≤ 1000000"),
        ("gtr", (0.1, 0.2), {}, "isotropic"),
        ("ggx", "rough", {}, "real numbers"),
        ("ggx", [[0.1], [0.2, 0.3]], {}, "regular shape"),
        ("ggx", np.full(3, 0.1), {}, "do not broadcast"),
    ],
)
def test_mistakes_are_named(name, parameter, options, words):
    with pytest.raises(ValueError, match=words):
        mdfconv.distribution(name).unit(np.zeros(2), parameter, **options)


def test_names():
    for name in ("trowbridge-reitz", "Trowbridge_Reitz", " TR ", "GGX"):
        assert mdfconv.distribution(name).name == "ggx"
    assert mdfconv.distribution("Blinn/Phong").name == "blinn-phong"
    assert mdfconv.distribution("anisotropic blinn-phong").name == "ashikhmin-shirley"
    with pytest.raises(ValueError, match="did you mean beckmann"):
        mdfconv.distribution("bekmann")
    with pytest.raises(ValueError, match="known: "):
        mdfconv.distribution("zzz")
