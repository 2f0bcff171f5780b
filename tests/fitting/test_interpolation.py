"""Many fits from some, against each by itself."""

import numpy as np
import pytest

import mdfconv
from mdfconv.fitting.metrics import metric_named
from mdfconv.fitting.solve import WORTH_IT, fit, interpolated

RANDOM = np.random.default_rng(9)


def pieces(x):
    """Smooth, a bend at 2, a jump at 3, nothing from 4 on, smooth again."""
    value = np.where(x < 2, np.sin(3 * x), np.sin(6) + (x - 2) ** 2)
    value = np.where(x > 3, value + 1e-5, value)
    return np.stack([np.where((x > 4) & (x < 4.5), np.nan, value), x])


def test_smooth_parts_are_interpolated_and_others_are_not():
    x = np.append(RANDOM.uniform(0, 5, 20000), [0, 5])
    (value, column), nowhere = interpolated(pieces, x)
    wanted, there = pieces(x)[0], ~np.isnan(value)
    np.testing.assert_allclose(value[there], wanted[there], atol=1e-8)
    np.testing.assert_allclose(column[there], x[there], atol=1e-12)
    rough = np.abs(x[:, None] - [2, 3, 4, 4.5]).min(axis=1) < 0.01
    assert (there | nowhere | rough).all()
    assert np.isnan(wanted[nowhere]).all()
    assert nowhere.sum() > 1000


@pytest.mark.parametrize("metric", ["unit", "energy", "display", "display:2", "environment"])
@pytest.mark.parametrize(
    ("source", "target"), [("beckmann", "ggx"), ("schlick", "gauss"), ("ggx", "sawicki")]
)
def test_many_fits_are_the_same_as_few(source, target, metric):
    source, target = mdfconv.distribution(source), mdfconv.distribution(target)
    metric = metric_named(metric)
    # The largest have no fit in sawicki.
    values = np.exp(RANDOM.uniform(np.log(0.01), np.log(0.97), 2 * WORTH_IT))
    many = fit(source, values, target, metric)
    some = np.append(RANDOM.integers(0, values.size, 60), [values.argmin(), values.argmax()])
    few = fit(source, values[some], target, metric)
    np.testing.assert_allclose(many.parameter[some], few.parameter, rtol=1e-7)
    there = ~np.isnan(few.parameter)
    np.testing.assert_allclose(many.distance[some][there], few.distance[there], rtol=1e-4)
    np.testing.assert_array_equal(many.at_limit[some], few.at_limit)


def test_many_of_one_value():
    found = fit(*arguments(np.full(WORTH_IT + 1, 0.2)))
    alone = fit(*arguments(np.array([0.2])))
    np.testing.assert_allclose(found.parameter, alone.parameter[0], rtol=1e-9)


def test_ends_of_the_legal_range():
    values = np.append(np.exp(RANDOM.uniform(-25, 0.5, 2 * WORTH_IT)), [1e-12, 20.0])
    many = fit(*arguments(values))
    some = np.append(np.arange(0, 2 * WORTH_IT, 500), [values.size - 2, values.size - 1])
    few = fit(*arguments(values[some]))
    np.testing.assert_allclose(many.parameter[some], few.parameter, rtol=1e-7)


def arguments(values):
    return (
        mdfconv.distribution("beckmann"),
        values,
        mdfconv.distribution("ggx"),
        metric_named("unit"),
    )
