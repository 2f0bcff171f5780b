"""Stored numbers: what each becomes, which have a result, and what the others are."""

import numpy as np
import pytest

import mdfconv
from mdfconv import scene
from mdfconv.distributions.endpoint import endpoints
from mdfconv.fitting.metrics import metric_named
from mdfconv.scene.stored import Outcome, StoredConverter

METRIC = metric_named("environment")


def converter(source, target="ggx:roughness", **options):
    return StoredConverter(*endpoints(source, target), METRIC, **options)


@pytest.mark.parametrize(
    ("source", "target", "stored", "outcome", "result"),
    [
        ("beckmann:roughness", "ggx:roughness", 0.0, Outcome.MIRROR, 0.0),
        ("beckmann:roughness", "ggx:glossiness", 0.0, Outcome.MIRROR, 1.0),
        ("blinn-phong:peak", "ggx:roughness", 0.0, Outcome.MIRROR, 0.0),
        ("ggx:gltf-glossiness", "beckmann:roughness", 1.0, Outcome.MIRROR, 0.0),
        ("blinn-phong", "ggx:roughness", 0.0, Outcome.UNIFORM, 1.0),
        ("blinn-phong", "ggx:roughness", 1e-7, Outcome.UNIFORM, 1.0),
        ("blinn-phong:obj2gltf", "ggx:glossiness", 1.0, Outcome.UNIFORM, 0.0),
        # The same number for all exponents from 1000 on.
        ("blinn-phong:obj2gltf", "ggx:roughness", 0.0, Outcome.ILLEGAL, np.nan),
        ("blinn-phong:mmd-tools", "ggx:roughness", 1.0, Outcome.ILLEGAL, np.nan),
        ("blinn-phong:babylon", "ggx:roughness", 0.05, Outcome.ILLEGAL, np.nan),
        ("ggx:roughness", "beckmann:roughness", -0.1, Outcome.ILLEGAL, np.nan),
        ("ggx:roughness", "beckmann:roughness", np.nan, Outcome.NAN, np.nan),
        # IfcOpenShell stores 1/N, which is above 1 for these.
        ("ggx:alpha", "blinn-phong:ifcopenshell-gltf", 0.99, Outcome.BEYOND, None),
    ],
)
def test_what_is_no_ordinary_lobe(source, target, stored, outcome, result):
    found = converter(source, target)(np.array([stored, 0.5]))
    assert found.outcome.tolist() == [outcome, Outcome.CONVERTED]
    if result is not None:
        assert np.array_equal(found.result[:1], [result], equal_nan=True)
    assert found.result[1] == mdfconv.convert(0.5, source, target, metric=METRIC)


def test_a_table_has_each_number_once_with_the_error_of_explain():
    numbers = [0.5, 0.0, 0.5, 0.05, 1.0]
    table = converter("blinn-phong:babylon").table(numbers)
    assert list(table) == [0.0, 0.05, 0.5, 1.0]
    (exact,) = mdfconv.explain(0.5, "blinn-phong:babylon", "ggx:roughness", metric=METRIC)
    assert table[0.5].rmse == pytest.approx(exact.rmse, rel=1e-12)
    assert table[0.5].result == exact.result
    assert table[0.5].parameter == pytest.approx(1300 * (1 - np.cbrt(4 / 9)) ** 3)
    assert (table[1.0].parameter, table[1.0].result) == (0, 1)
    assert np.isnan([table[1.0].rmse, table[0.05].rmse, table[0.05].result]).all()
    assert converter("ggx:alpha").table([0.0])[0.0].rmse == 0


@pytest.mark.parametrize(
    ("source", "target", "stored", "text"),
    [
        ("blinn-phong:obj2gltf", "ggx:roughness", 0.0, "has no inverse here: r = 0 is any N"),
        ("blinn-phong:babylon", "ggx:roughness", 0.05, "r = 0.05 is outside the legal range"),
        ("ggx:alpha", "blinn-phong:ifcopenshell-gltf", 0.99, "cannot store"),
    ],
)
def test_a_refusal_is_that_of_a_single_conversion(source, target, stored, text):
    convert = converter(source, target)
    refusal = convert.refusal(convert.table([stored])[stored])
    assert text in refusal
    with pytest.raises(mdfconv.MdfconvError) as caught:
        mdfconv.convert(stored, source, target, metric=METRIC)
    assert refusal in str(caught.value)


def test_a_method_that_does_not_cover_a_pair_is_refused():
    with pytest.raises(mdfconv.MdfconvError, match="ward has no conversion"):
        converter("gauss", "ggx", method="ward")


def test_the_face_has_what_it_lists():
    for name in scene.__all__:
        assert getattr(scene, name).__module__.startswith("mdfconv.scene.")
    assert set(scene.__all__) <= set(dir(scene))
    with pytest.raises(AttributeError, match="convert_obj"):
        _ = scene.convert_obj
