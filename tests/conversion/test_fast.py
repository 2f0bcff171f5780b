"""The stored polynomials: against the fit, at the ends of their range, with gaps and lazily."""

import itertools
import warnings

import dask.array
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import mdfconv
from mdfconv.fitting import maps
from mdfconv.fitting.metrics import list_metrics, metric_named
from mdfconv.fitting.metrics.base import Display
from mdfconv.fitting.problem import ConversionTask
from mdfconv.fitting.solve import cold_fit
from tests import generate_fast
from tests.cli.runner import run

NAMES = ("beckmann", "gauss", "ggx", "blinn-phong", "sawicki", "schlick", "smoothie")
LIMIT = {"unit": 1e-6, "energy": 1e-6, "display": 1e-5, "environment": 1e-6}
# Both ends of the usual range, Beckmann's turn at 1/√2, and seeded points between.
RANDOM = np.random.default_rng(5)
ALPHA = np.concatenate([[1e-8, 1e-3, 0.70710678, 0.7072, 0.999], 10 ** RANDOM.uniform(-3, 0, 5)])
EXPONENT = np.concatenate([[1e16, 1.0, 0.1000001], 10 ** RANDOM.uniform(-1, 6, 5)])
VALUES = dict.fromkeys(NAMES, ALPHA) | {"blinn-phong": EXPONENT, "sawicki": EXPONENT}


@pytest.mark.parametrize("kept", list_metrics())
@pytest.mark.parametrize(("source", "target"), list(itertools.permutations(NAMES, 2)))
def test_fast_is_the_fit(source, target, kept):
    values = VALUES[source]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", mdfconv.MdfconvWarning)
        got = mdfconv.convert(values, source, target, "fast", metric=kept)
    sides = mdfconv.distribution(source), mdfconv.distribution(target)
    exact = cold_fit(ConversionTask(sides[0], values, sides[1], metric_named(kept))).parameter
    answered = np.isfinite(got)
    assert got[answered] == pytest.approx(exact[answered], rel=LIMIT[kept])
    # What is left out are sources rougher than any Sawicki lobe that anyone would use.
    assert answered.all() or target == "sawicki"
    assert answered[:2].all()


@given(st.floats(1e-6, 0.999), st.sampled_from(list(itertools.permutations(NAMES[:3], 2))))
def test_smooth_neighbours_stay_neighbours(alpha, pair):
    low, high = mdfconv.convert(np.array([alpha * (1 - 1e-9), alpha]), *pair, "fast")
    assert low == pytest.approx(high, rel=1e-6)


def test_gaps_in_an_array_are_nan_with_one_warning():
    given_ = np.array([[0.2, np.nan, -1], [0.95, 1.0, 2]], dtype=np.float32)
    with pytest.warns(mdfconv.MdfconvWarning, match=r"5 of 6 .* the first is nan") as record:
        got = mdfconv.convert(given_, "ggx", "sawicki", method="fast")
    assert len(record) == 1
    assert got.dtype == np.float32
    assert np.isfinite(got).tolist() == [[True, False, False], [False, False, False]]


def test_a_gap_in_a_single_value_is_an_error():
    with pytest.raises(mdfconv.MdfconvError, match="fast has no answer in sawicki"):
        mdfconv.convert(0.95, "ggx", "sawicki", method="fast")
    status, out, err = run(
        "convert", "--from", "ggx", "--to", "sawicki", "--method", "fast", 0.2, 0.95
    )
    assert (status, out) == (2, "")
    assert "value 2 of 2" in err


def test_exact_pairs_and_other_names():
    assert mdfconv.convert(0.3, "smoothie", "ggx", method="fast") == pytest.approx(
        0.3 / np.sqrt(4.09), rel=1e-14
    )
    assert mdfconv.convert(
        (20.0, 50.0), "ashikhmin-shirley", "ggx", method="fast"
    ) == pytest.approx(tuple(mdfconv.convert([20.0, 50.0], "blinn-phong", "ggx", method="fast")))
    assert mdfconv.convert(np.array([1.0, 1e-200]), "ggx", "gtr", "fast").tolist() == [1, 1e-200]
    direct = mdfconv.convert(0.3, "gtr", "beckmann", method="fast")
    assert direct == mdfconv.convert(0.3, "ggx", "beckmann", method="fast")
    with pytest.raises(mdfconv.MdfconvError, match=r"fast has no conversion from gtr \(γ = 3\)"):
        mdfconv.convert(0.3, "gtr", "beckmann", method="fast", gamma=3)


def test_what_is_covered_is_said():
    message = "fast has no answer in ggx: it covers N ≥ 0.1; closed-form answers .*, fit 0"
    with pytest.raises(mdfconv.MdfconvError, match=message):
        mdfconv.convert(0.01, "blinn-phong", "ggx", "fast")
    assert mdfconv.convert(1.0, "schlick", "ggx", "fast") == 1
    *_, err = run("convert", "--from", "ggx", "--to", "all", "--method", "fast", "1e-300")
    assert "Warning" not in err


def test_pairs_of_arrays():
    with pytest.raises(mdfconv.MdfconvError, match=r"shapes \(3,\) and \(2,\) are not a pair"):
        mdfconv.convert((np.ones(3), np.ones(2)), "beckmann", "ggx", "fast")
    with pytest.warns(mdfconv.MdfconvWarning) as record:
        mdfconv.convert((np.array([0.1, -1]), np.array([0.2, 0.3])), "beckmann", "ggx", "fast")
    assert record[0].filename == __file__


def test_encodings():
    values = np.array([0.2, 0.5, 0.8])
    rough = mdfconv.convert(values, "ggx:roughness", "beckmann:glossiness", "fast")
    plain = mdfconv.convert(values**2, "ggx", "beckmann", "fast")
    assert (1 - rough) ** 2 == pytest.approx(plain, rel=1e-12)


def test_dask_arrays_stay_lazy():
    values = np.linspace(0.05, 0.9, 1000)
    chunks = dask.array.from_array(values, chunks=300)
    lazy = dask.array.map_blocks(
        mdfconv.convert, chunks, "beckmann", "ggx", method="fast", dtype=float
    )
    assert isinstance(lazy, dask.array.Array)
    assert lazy.dtype == np.float64
    assert (lazy.compute() == mdfconv.convert(values, "beckmann", "ggx", method="fast")).all()
    ggx = mdfconv.distribution("ggx")
    assert (
        dask.array.map_blocks(ggx.unit, chunks, 0.3, dtype=float).compute() == ggx.unit(values, 0.3)
    ).all()


@pytest.mark.parametrize("key", ["unit blinn-phong ggx", "energy ggx beckmann"])
def test_the_data_are_what_the_script_makes(key):
    stored = maps.load()[key]
    _, made, _ = generate_fast.make(key)
    assert made.edges == pytest.approx(stored.edges, rel=1e-9)
    x = np.linspace(1e-6, stored.edges[-1], 500)
    assert made(x) == pytest.approx(stored(x), rel=2e-7)


@pytest.mark.parametrize("method", ["fast", None])
def test_threads_change_nothing(method):
    values = np.random.default_rng(7).uniform(0.01, 0.99, (1100, 1000)).astype(np.float32)
    pair = "beckmann", "ggx", method
    alone = mdfconv.convert(values, *pair, metric="energy")
    shared = mdfconv.convert(values, *pair, metric="energy", threads=3)
    assert shared.dtype == np.float32
    np.testing.assert_array_equal(shared, alone)
    values[700, 3] = -1
    if method:
        with pytest.warns(mdfconv.MdfconvWarning, match="1 of 1100000 values .* the first is -1"):
            mdfconv.convert(values, *pair, metric="energy", threads=2)
    else:
        with pytest.raises(mdfconv.MdfconvError, match="value 700004 of 1100000"):
            mdfconv.convert(values, *pair, metric="energy", threads=2)
    with pytest.raises(mdfconv.MdfconvError, match="0 threads: at least 1"):
        mdfconv.convert(values, *pair, metric="energy", threads=0)


def test_the_data_are_small():
    assert maps.FILE.stat().st_size < 200_000


@pytest.mark.parametrize("exposure", [0.3, 2.5])
@pytest.mark.parametrize(("source", "target"), [("beckmann", "ggx"), ("gauss", "sawicki")])
def test_many_values_at_another_exposure(source, target, exposure):
    """A map is made for them; a few are fitted, and so is what the map leaves out."""
    kept = Display(exposure)
    many = np.random.default_rng(5).uniform(0.01, 0.999, 10_000)
    got = mdfconv.convert(many, source, target, "fast", metric=kept)
    few = many[:50]
    ends = mdfconv.distribution(source), mdfconv.distribution(target)
    exact = cold_fit(ConversionTask(ends[0], few, ends[1], kept)).parameter
    assert got[:50] == pytest.approx(exact, rel=1e-4)
    assert mdfconv.convert(few, source, target, "fast", metric=kept) == pytest.approx(exact, 1e-5)
