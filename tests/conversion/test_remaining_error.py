"""The error beside a conversion: by another quadrature, and never below that of the fit."""

import itertools

import numpy as np
import pytest

import mdfconv
from mdfconv.conversion.explanation import remaining_error
from mdfconv.distributions import one_parameter_distributions
from mdfconv.distributions.endpoint import exact_route
from mdfconv.fitting.metrics import list_metrics, metric_named
from mdfconv.recommend import answers, covering
from tests.fitting.brute_force import Problem

MAPPED = [mdf.name for mdf in one_parameter_distributions() if mdf.map_variables]
PAIRS = list(itertools.permutations(MAPPED, 2))
# tan β_half of the sources, from a mirror to the roughest that have one.
TANGENTS = np.append(np.geomspace(1e-6, 0.3, 8), [0.5, 0.7, 0.9, 1.2])
# How much more than that of `fit` the error of `fast` may be.
NEAR = 1e-6


@pytest.mark.parametrize("kept", list_metrics())
@pytest.mark.parametrize(("source", "target"), PAIRS)
def test_errors_by_another_quadrature(source, target, kept):
    pair = [mdfconv.distribution(name) for name in (source, target)]
    tangents = np.array([0.02, 0.3])
    given, ours = (mdf.from_half_tangent(tangents) for mdf in pair)
    rmse, largest = remaining_error(pair[0], given, pair[1], ours, metric_named(kept))
    for row, tangent in enumerate(tangents):
        problem = Problem(kept, source, given[row], target, np.arctan(tangent))
        expected = problem.errors(ours[row])
        assert rmse[row] == pytest.approx(expected[0], rel=1e-3, abs=1e-9)
        assert largest[row] == pytest.approx(expected[1], rel=1e-2, abs=1e-9)


def errors_by(method, values, source, target, metric):
    result = answers(method, values, source, target, metric)
    rmse = np.full_like(values, np.nan)
    there = ~np.isnan(result)
    rmse[there], _ = remaining_error(source, values[there], target, result[there], metric)
    return rmse


@pytest.mark.parametrize("kept", list_metrics())
@pytest.mark.parametrize(("source", "target"), PAIRS)
def test_nothing_is_better_than_the_fit(source, target, kept):
    ends = [mdfconv.distribution(name) for name in (source, target)]
    values = ends[0].from_half_tangent(TANGENTS)
    values = values[~np.isnan(values)]
    metric = metric_named(kept)
    if exact_route(*ends) is not None:
        return
    errors = {
        method.name: errors_by(method, values, *ends, metric) for method in covering(*ends, metric)
    }
    fitted = ~np.isnan(errors["fit"])
    assert np.count_nonzero(fitted) >= 10
    for name, rmse in errors.items():
        worse = rmse[fitted] - errors["fit"][fitted]
        assert np.nanmin(worse) >= -1e-9, name
        if name == "fast":
            assert np.nanmax(worse) < NEAR


def test_errors_of_what_is_exact_and_of_nothing():
    assert mdfconv.explain(0.3, "ggx", "smoothie")[0].rmse == 0
    empty = np.empty(0)
    ends = mdfconv.distribution("ggx"), mdfconv.distribution("gauss")
    rmse, largest = remaining_error(ends[0], empty, ends[1], empty, metric_named("unit"))
    assert (rmse.size, largest.size) == (0, 0)


def test_a_uniform_lobe_has_no_contrast_to_keep():
    (entry,) = mdfconv.explain(1.0, "ggx", "beckmann", "peak", metric="environment")
    assert entry.rmse > 1e6


# The contrast of 1/f² light has a part of every octave that a lobe resolves.
@pytest.mark.parametrize("kept", [name for name in list_metrics() if name != "environment"])
def test_the_error_does_not_depend_on_the_width_of_smooth_lobes(kept):
    ends = mdfconv.distribution("beckmann"), mdfconv.distribution("ggx")
    given = np.array([1e-8, 1e-5, 1e-3])
    rmse, largest = remaining_error(ends[0], given, ends[1], 0.9 * given, metric_named(kept))
    for errors in (rmse, largest):
        assert errors == pytest.approx(errors[0], rel=2e-3)
