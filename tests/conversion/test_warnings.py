"""What a terminal is told of a conversion reaches Python as a warning, once."""

import warnings

import numpy as np
import pytest

import mdfconv

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
