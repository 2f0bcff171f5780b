"""What a terminal is told of a conversion reaches Python as a warning, once."""

import warnings

import numpy as np
import pytest

import mdfconv
from mdfconv.fitting.metrics import metric_named
from mdfconv.studies.table2 import angle_limit, fit_table

TURNED = r"outside the paper's sweep: .* m_B from 0.0044 to 0.4473; beyond 0.845 .* turns around"


def told(*arguments, **options):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        answer = mdfconv.convert(*arguments, **options)
    assert all(warning.filename == __file__ for warning in caught)
    return answer, [str(warning.message) for warning in caught]


@pytest.mark.parametrize(
    ("value", "source", "target", "method", "text"),
    [
        (0.7, "beckmann", "ggx", None, "outside the paper's sweep"),
        (100.0, "phong", "ggx", "half-angle", "phong is taken for Blinn's exponent"),
        (0.003, "ggx", "blinn-phong:obj2gltf", "peak", "clamps: r = 0"),
        (0.2, "ggx", "beckmann", None, ""),
        (0.9, "beckmann", "ggx", "fit", ""),
        (0.9, "ggx:roughness", "ggx", None, ""),
    ],
)
def test_a_caution_is_one_warning_for_numbers_and_arrays(value, source, target, method, text):
    for values in (value, np.array(value), [value], np.full((30, 2), value), (value, value)):
        if isinstance(values, tuple) and "phong" in source + target:
            continue
        _, texts = told(values, source, target, method)
        assert len(texts) == bool(text)
        assert text in "".join(texts)
    cautions = mdfconv.explain(value, source, target, method)[0].cautions
    assert all(caution in "".join(texts) for caution in cautions) or not text


@pytest.mark.parametrize("place", [0, 17, 999])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_one_value_of_many_is_enough(place, dtype):
    values = np.full(1000, 0.2, dtype)
    assert told(values, "beckmann", "ggx")[1] == []
    values[place] = 0.9
    with pytest.warns(mdfconv.MdfconvWarning, match=TURNED):
        mdfconv.convert(values, "beckmann", "ggx")


def test_gaps_are_told_beside_it():
    values = np.array([0.2, np.nan, 0.3] * 10)
    texts = told(values, "beckmann", "ggx", "fast")[1]
    assert len(texts) == 1
    assert "10 of 30 values" in texts[0]


@pytest.mark.parametrize(
    ("source", "target"), [("smoothie", "ggx"), ("ggx", "ggx:glossiness"), ("ggx", "blinn-phong")]
)
def test_a_result_that_float16_rounds_to_none_is_refused(source, target):
    least = np.array([0.5, 2.0**-24], np.float16)
    assert mdfconv.convert(least.astype(float), source, target, "peak").shape == (2,)
    with pytest.raises(mdfconv.MdfconvError, match="is none in float16; convert in float64"):
        mdfconv.convert(least, source, target, "peak")


@pytest.mark.parametrize(
    "case",
    [
        lambda: mdfconv.explain(1e-320, "smoothie", "student-t", "fit", gamma="free"),
        lambda: mdfconv.explain(1e100, "beckmann", "student-t", "fit", gamma="free"),
        lambda: mdfconv.explain(0.001, "phong:assimp-gltf:1e-320", "ggx"),
        lambda: mdfconv.convert(5e-324, "blinn-phong:peak", "ggx", "closed-form"),
        lambda: mdfconv.convert(1e300, "smoothie", "blinn-phong:ifcopenshell-gltf", "fast"),
        lambda: mdfconv.convert((1e200, 0.1), "beckmann", "beckmann:pbrt-v4", metric="energy"),
        lambda: fit_table(
            np.array([1e100]), angle_limit(np.array([1e100])), metric_named("display")
        ),
        lambda: fit_table(np.array([1e308]), angle_limit(np.array([1e308])), metric_named("unit")),
        lambda: fit_table(np.array([1e-200]), np.array([1e-200]), metric_named("environment")),
        lambda: fit_table(
            np.array([1e-155]), np.array([1e-155]), metric_named("display"), extended=True
        ),
    ],
)
def test_ends_of_floats_are_refused_without_a_warning_of_numpy(case):
    with pytest.raises(mdfconv.MdfconvError):
        case()


def test_the_thinnest_shares_are_drawn():
    shares = mdfconv.distribution("gauss").sample(5e-324, np.array([0.01, 0.4]))
    assert shares.tolist() == [0, 0]


def test_angles_beyond_a_short_type_are_beyond_the_horizon():
    assert mdfconv.distribution("ggx").unit(1e308, np.array([0.4], np.float32)).tolist() == [0]
