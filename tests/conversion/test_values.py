"""One rule for values: what `convert` and `explain` take for a number, an array and a pair."""

import re
import warnings
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import mdfconv
from mdfconv.distributions.endpoint import endpoint

PAIRED = "ggx:openpbr", "ggx:materialx", "ggx:gltf-anisotropy"
ENDS = st.sampled_from(
    [
        *[(form, "ggx") for form in PAIRED],
        *[(form, "beckmann:roughness") for form in PAIRED],
        ("ggx", "beckmann"),
        ("beckmann:roughness", "ggx:alpha"),
        ("ashikhmin-shirley", "ggx"),
    ]
)
NUMBER = st.floats(0.05, 0.6)
PAIR = st.tuples(NUMBER, NUMBER)
COLUMN = st.lists(NUMBER, min_size=1, max_size=4)
VALUES = st.one_of(
    NUMBER,
    PAIR,
    COLUMN,
    COLUMN.map(np.array),
    COLUMN.map(lambda column: np.array([column, column, column])),
    st.lists(PAIR, max_size=4),
    st.lists(NUMBER | PAIR, max_size=5),
    COLUMN.map(lambda column: (np.array(column), 0.3)),
    COLUMN.map(lambda column: (column, column[::-1])),
)


def one_by_one(answer):
    """Return an answer of `convert` as a list of numbers and pairs."""
    if isinstance(answer, list):
        return answer
    if isinstance(answer, tuple):
        x, y = np.broadcast_arrays(*answer)
        return list(zip(x.ravel().tolist(), y.ravel().tolist(), strict=True))
    return np.ravel(answer).tolist()


@given(VALUES, ENDS, st.sampled_from(["half-angle", "peak", "fit"]))
def test_convert_and_explain_agree(values, ends, method):
    shape = np.shape(values) if isinstance(values, np.ndarray) else ()
    if ends[0] in PAIRED and shape[1:] == (2,):
        for function in (mdfconv.convert, mdfconv.explain):
            with pytest.raises(mdfconv.MdfconvError, match="give pairs as a tuple"):
                function(values, *ends, method)
        return
    try:
        explained = mdfconv.explain(values, *ends, method, errors=False)
    except mdfconv.MdfconvError as error:
        with pytest.raises(mdfconv.MdfconvError, match=re.escape(error.hint)):
            mdfconv.convert(values, *ends, method)
        return
    answer = mdfconv.convert(values, *ends, method)
    assert one_by_one(answer) == [conversion.result for conversion in explained]
    if not isinstance(values, np.ndarray):
        given_ = values if isinstance(values, list) else [values]
        if not isinstance(values, tuple) or np.ndim(values[0]) == 0:
            assert [conversion.value for conversion in explained] == given_


def test_a_pair_is_a_tuple_in_a_list_too():
    r, a = 0.5, 0.6
    alone = mdfconv.convert((r, a), "ggx:openpbr", "ggx")
    assert alone == pytest.approx((0.32826608, 0.13130643))
    assert mdfconv.convert([(r, a)], "ggx:openpbr", "ggx") == [alone]
    assert mdfconv.convert([(r, a), r], "ggx:openpbr", "ggx") == [alone, r * r]
    assert mdfconv.explain([(r, a)], "ggx:openpbr", "ggx")[0].result == alone


@pytest.mark.parametrize(
    ("source", "target", "pair"),
    [
        ("ggx:openpbr", "ggx", (0.5, 0.6)),
        ("ggx", "ggx:openpbr", (0.3, 0.1)),
        ("ggx:materialx", "beckmann:materialx", (0.5, 0.6)),
        ("ashikhmin-shirley", "ggx:roughness", (100, 20)),
    ],
)
def test_a_pair_of_numbers_gives_floats(source, target, pair):
    assert [type(number) for number in mdfconv.convert(pair, source, target)] == [float, float]
    x, y = mdfconv.convert(([pair[0]] * 3, pair[1]), source, target)
    assert np.shape(x) == (3,)
    assert np.max(x) == pytest.approx(mdfconv.convert(pair, source, target)[0])
    assert np.max(y) == pytest.approx(mdfconv.convert(pair, source, target)[1])


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (
            np.full((3, 2), 0.5),
            r"an array of shape \(3, 2\) is pairs or single numbers of ggx:open",
        ),
        ([[0.5, 0.6]], r"an array of shape \(1, 2\) .* give pairs as a tuple of both columns"),
        ([[(0.5, 0.6)]], "a list with pairs holds numbers and pairs of numbers, not arrays"),
        ([(np.array([0.5]), 0.6)], "a list with pairs holds numbers and pairs"),
        ([(0.5, 0.6), (0.5,)], "two members, not 1"),
        ((np.ones(3), np.ones(2)), r"shapes \(3,\) and \(2,\) are not a pair"),
        ([(0.5, "x")], "expected real numbers"),
    ],
)
@pytest.mark.parametrize("ends", [("ggx:openpbr", "ggx"), ("ggx", "ggx:openpbr")])
def test_what_is_no_value_is_refused_by_both(values, message, ends):
    for function in (mdfconv.convert, mdfconv.explain):
        with pytest.raises(mdfconv.MdfconvError, match=message):
            function(values, *ends)


def test_two_columns_are_numbers_where_no_form_stores_pairs():
    values = np.full((3, 2), 0.5)
    assert mdfconv.convert(values, "ggx", "ggx:roughness").shape == (3, 2)
    assert len(mdfconv.explain(values, "ggx", "ggx:roughness")) == 6


@pytest.mark.parametrize("method", [method.name for method in mdfconv.list_methods()])
@pytest.mark.parametrize("values", [0.2, [0.1, 0.2, 0.3], np.full((5, 5), 0.2, np.float32)])
def test_values_are_decoded_once_and_encoded_once(method, values):
    counts = {"decode": 0, "encode": 0}

    def counted(name, function):
        def call(array):
            counts[name] += 1
            return function(array)

        return call

    def watched(name):
        end = endpoint(name)
        coding = {key: counted(key, getattr(end.encoding, key)) for key in counts}
        return replace(end, encoding=replace(end.encoding, **coding))

    ends = watched("beckmann:roughness"), watched("blinn-phong:peak")
    if method == "ward":
        ends = watched("blinn-phong:peak"), watched("beckmann:roughness")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", mdfconv.MdfconvWarning)
        mdfconv.convert(values, *ends, method)
    assert counts == {"decode": 1, "encode": 1}


@pytest.mark.parametrize(
    ("values", "ends", "message"),
    [
        (2.0, ("beckmann", "beckmann:roughness"),
         r"^beckmann:roughness cannot store beckmann m_B = 2: outside 0 < r ≤ 1$"),
        ([0.5, 3.0], ("beckmann", "beckmann:roughness"),
         r"^beckmann:roughness cannot store beckmann m_B = 3 \(value 2 of 2\): outside 0 < r ≤ 1$"),
        (1.0, ("ggx", "smoothie"),
         "^for ggx α = 1 the exact conversion gives smoothie α_s = inf, outside α_s > 0; "
         "no method answers$"),
    ],
)  # fmt: skip
def test_what_is_exact_and_cannot_be_stored_is_not_for_a_method(values, ends, message):
    for function in (mdfconv.convert, mdfconv.explain):
        with pytest.raises(mdfconv.MdfconvError, match=message):
            function(values, *ends)


def test_one_warning_for_a_list_with_pairs():
    with pytest.warns(mdfconv.MdfconvWarning, match="outside the paper's sweep") as record:
        mdfconv.convert([(0.7, 0.2), (0.2, 0.7)], "beckmann", "ggx")
    assert [warning.filename for warning in record] == [__file__]


def test_arrays_of_pairs_are_explained_pair_by_pair():
    x, y = np.array([0.1, 0.2]), 0.3
    first, second = mdfconv.explain((x, y), "beckmann", "ggx")
    assert (first.value, second.value) == ((0.1, 0.3), (0.2, 0.3))
    worse = mdfconv.explain([0.1, 0.3], "beckmann", "ggx")
    assert first.rmse == max(conversion.rmse for conversion in worse)
