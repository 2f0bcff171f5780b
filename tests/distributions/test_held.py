"""Lobes that floats cannot hold are refused, and all others have an answer."""

import numpy as np
import pytest

import mdfconv
from mdfconv.errors import MdfconvError

ANGLES = [0, 5e-324, 1e-160, 1e-30, 1e-8, 0.1, 0.8, 1.5, np.pi / 2 - 1e-9, np.pi / 2]
HARD = [5e-324, 1e-320, 2.3e-308, 1e-200, 1e-160, 1e-150, 1e-60, 1e-45, 1e-38, 1e-20, 1e-8, 0.2]
HARD += [1 - 2**-53, 1.0, 2.0, 1e4, 1e8, 1e16, 1e38, 1e77, 1e100, 1e154, 1e200, 1e300, 1e308]
GAMMAS = [1e-6, 0.25, 0.5, 1.0, 1 + 2**-52, 1.5, 2.0, 64.0, 1e6]
FORMS = {"unit": (0, 1 + 1e-6), "normalized": (0, np.inf), "cumulative": (0, 1)}


def legal(parameter, values):
    return [value for value in values if parameter.accepts(np.asarray(value))]


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("mdf", mdfconv.list_distributions(), ids=lambda mdf: mdf.name)
def test_every_lobe_is_answered_or_refused(mdf, dtype):
    beta = np.array(ANGLES, dtype)
    gammas = legal(mdf.second_parameter, GAMMAS) if mdf.second_parameter else [None]
    with np.errstate(over="ignore", under="ignore"):
        values = legal(mdf.parameter, np.array(HARD).astype(dtype))
    answers = 0
    for value in values:
        for gamma in gammas:
            options = {} if gamma is None else {"gamma": dtype(gamma)}
            for form, (low, high) in FORMS.items():
                try:
                    answer = getattr(mdf, form)(beta, value, **options)
                except MdfconvError:
                    continue
                assert answer.dtype == dtype
                assert ((answer >= low) & (answer <= high) & np.isfinite(answer)).all()
                answers += 1
    assert answers > 8


@pytest.mark.parametrize("mdf", mdfconv.list_distributions(), ids=lambda mdf: mdf.name)
def test_a_mirror_is_refused_with_the_limit_of_the_type(mdf):
    values = {np.float32: 1e-30, np.float64: 1e-200}
    if mdf.parameter.larger_is_smoother:
        values = {np.float32: 3e38, np.float64: 1e308}
    for dtype, value in values.items():
        with pytest.raises(MdfconvError, match=f"is a mirror in {dtype.__name__}; its lobes are"):
            mdf.unit(np.array([0.1], dtype), dtype(value))


@pytest.mark.parametrize("exponent", [8, 12, 16, 17, 20, 29, 40, 100, 140])
@pytest.mark.parametrize("mdf", mdfconv.list_distributions(), ids=lambda mdf: mdf.name)
def test_half_widths_of_smooth_lobes_are_similar(mdf, exponent):
    alpha = 10.0**-exponent

    def over_width(alpha):
        larger = mdf.parameter.larger_is_smoother
        return mdf.half_tangent(alpha**-2 if larger else alpha) / alpha

    # NaN is an answer: it is not found.
    ratio = over_width(alpha)
    assert np.isnan(ratio) or ratio == pytest.approx(over_width(1e-7), rel=1e-6)


@pytest.mark.parametrize("mdf", mdfconv.list_distributions(), ids=lambda mdf: mdf.name)
def test_limits_beyond_a_short_type_limit_nothing_in_it(mdf):
    for parameter in mdf.parameters:
        assert parameter.accepts(np.float16(parameter.typical[0]))
        assert not parameter.accepts(np.float16(np.inf))
