"""Every ordered pair and metric against a brute-force minimizer; limits; boundaries."""

import itertools

import mpmath as mp
import numpy as np
import pytest

import mdfconv
from mdfconv.distributions import one_parameter_distributions
from mdfconv.distributions.angles import Angles
from mdfconv.fitting import maps
from mdfconv.fitting.metrics import list_metrics, metric_named
from mdfconv.fitting.metrics.base import Display, Energy, Unit
from mdfconv.fitting.problem import ConversionTask
from mdfconv.fitting.quadrature import UniformSamples
from mdfconv.fitting.solve import cold_fit, fit
from tests import oracles
from tests.fitting import brute_force

NAMES = list(brute_force.FORMS)
WIDTHS = np.geomspace(2e-3, 0.95, 12)
EXPONENTS = np.geomspace(1.2, 5e5, 12)
PARAMETERS = {name: EXPONENTS if oracles.is_exponent(name) else WIDTHS for name in NAMES}
SCAN = np.geomspace(1 / 400, 12, 260)
GTR = type(mdfconv.distribution("gtr"))


def candidates(target, guess):
    """A dense scan around equal half angle, inside the legal range."""
    values = guess * SCAN
    limits = mdfconv.distribution(target).parameter
    if limits.larger_is_smoother:
        return np.concatenate([guess * np.geomspace(1e-7, 1 / 401, 60), values])
    if not limits.upper_closed:
        return values
    near_end = limits.upper * (1 - np.append(np.geomspace(0.3, 1e-6, 40), 0))
    return np.unique(np.concatenate([values[values < near_end[0]], near_end]))


def test_every_distribution_of_one_parameter_has_a_textbook_form():
    names = [entry.name for entry in one_parameter_distributions() if not entry.second_parameter]
    missing = set(names) - set(NAMES)
    assert not missing, f"add {missing} to FORMS in tests/fitting/brute_force.py"


@pytest.mark.parametrize("kept", list_metrics())
@pytest.mark.parametrize(("source", "target"), list(itertools.permutations(NAMES, 2)))
def test_pair_against_brute_force(source, target, kept):
    entry = mdfconv.distribution(source)
    found = fit(entry, PARAMETERS[source], mdfconv.distribution(target), metric_named(kept))
    assert not found.at_limit.any()
    tolerance = 1e-5 if kept == "display" else 1e-7
    for parameter, got in zip(PARAMETERS[source], found.parameter, strict=True):
        width = entry.half_width(parameter)
        width = 1.0 if np.isnan(width) else width
        guess = mdfconv.distribution(target).from_half_tangent(np.tan(min(width, 0.9)))
        exact = brute_force.minimum(
            kept, source, parameter, target, width, candidates(target, guess)
        )
        assert got == pytest.approx(exact, rel=tolerance, nan_ok=True), parameter


@pytest.mark.parametrize(
    ("measure", "ratio"),
    [
        (Unit(), 1.199),
        (Energy(), 0.925),
        (Display(), 0.647),
        (Display(0.5), 0.750),
        (Display(4), 0.556),
    ],
)
def test_limits_for_smooth_surfaces(measure, ratio):
    smooth = np.array([1e-8, 1e-6, 1e-4])
    found = fit(mdfconv.distribution("beckmann"), smooth, mdfconv.distribution("ggx"), measure)
    np.testing.assert_allclose(found.parameter / smooth, ratio, atol=5e-4)


@pytest.mark.parametrize("kept", [*list_metrics(), "display:0.25", "display:3"])
@pytest.mark.parametrize(("source", "target"), list(itertools.permutations(NAMES, 2)))
def test_a_warm_start_finds_what_a_cold_one_finds(source, target, kept):
    ends = [mdfconv.distribution(name) for name in (source, target)]
    values = ends[0].from_half_tangent(np.append(np.geomspace(1e-6, 0.3, 4), [0.7, 1.2]))
    problem = ends[0], values[~np.isnan(values)], ends[1], metric_named(kept)
    warm, cold = fit(*problem), cold_fit(ConversionTask(*problem))
    tolerance = 1e-6 if kept.startswith("display") else 3e-7
    np.testing.assert_array_equal(warm.at_limit, cold.at_limit)
    # Where both are clipped as a whole, any lobe will do.
    told_apart = ~(cold.distance < 1e-13)
    assert warm.parameter[told_apart] == pytest.approx(
        cold.parameter[told_apart], rel=tolerance, nan_ok=True
    )
    there = ~np.isnan(cold.parameter)
    assert warm.distance[there] == pytest.approx(cold.distance[there], rel=1e-4, abs=1e-13)


@pytest.mark.parametrize(
    ("source", "target", "kept"),
    [
        ("beckmann", "ggx", "display:4"),
        ("ggx", "gauss", "display:0.5"),
        ("ggx", "student-t", "energy"),
        ("ggx", "gtr", "unit"),
    ],
)
def test_many_values_are_what_each_is_alone(source, target, kept):
    """Without a stored fit many values start from a few; some have none, some are equal."""
    target = mdfconv.distribution(target)
    target = target.with_gamma(3.3) if target.second_parameter else target
    values = np.random.default_rng(3).permutation(np.geomspace(1e-3, 0.999, 150))
    values = np.append(values, [values[0], 0.9999])
    problem = mdfconv.distribution(source), values, target, metric_named(kept)
    many, cold = fit(*problem).parameter, cold_fit(ConversionTask(*problem)).parameter
    assert many == pytest.approx(cold, rel=1e-6, nan_ok=True)


def test_a_start_that_is_far_off_is_not_believed(monkeypatch):
    ends = mdfconv.distribution("beckmann"), mdfconv.distribution("ggx")
    values = np.array([0.05, 0.3])
    wanted = cold_fit(ConversionTask(ends[0], values, ends[1], Energy())).parameter
    astray = maps.StoredFit.__call__
    monkeypatch.setattr(maps.StoredFit, "__call__", lambda self, p: 1.3 * astray(self, p))
    np.testing.assert_allclose(fit(ends[0], values, ends[1], Energy()).parameter, wanted, rtol=1e-9)


def test_best_fits_at_the_end_of_the_range():
    ggx, schlick, gauss = map(mdfconv.distribution, ("ggx", "schlick", "gauss"))
    uniform = np.array([0.5, 1.0])
    closed = fit(ggx, uniform, schlick, Unit())
    assert closed.at_limit.tolist() == [False, True]
    assert closed.parameter[1] == 1
    assert np.isnan(fit(ggx, uniform, gauss, Unit()).parameter).tolist() == [False, True]
    nearly = fit(ggx, np.array([0.99]), gauss, Unit()).parameter[0]
    assert 5 < nearly < 10


def test_nearly_uniform_lobes_have_small_exponents():
    gauss, ggx, phong, sawicki = map(
        mdfconv.distribution, ("gauss", "ggx", "blinn-phong", "sawicki")
    )
    wide = fit(gauss, np.array([10.0]), phong, Unit())
    assert wide.parameter[0] == pytest.approx(0.00915, rel=2e-2)
    assert fit(ggx, np.array([0.999]), phong, Energy()).parameter[0] == pytest.approx(
        0.0020, rel=2e-2
    )
    # Rougher than any Sawicki with a positive exponent.
    assert np.isnan(fit(ggx, np.array([0.95]), sawicki, Unit()).parameter[0])


def test_a_minimum_must_beat_the_open_ends():
    beckmann = mdfconv.distribution("beckmann")
    for target in ("sawicki", "gauss"):
        entry = mdfconv.distribution(target)
        assert np.isnan(fit(beckmann, np.array([10.0]), entry, Energy()).parameter[0])


def test_gauss_slope_for_nearly_uniform_lobes():
    gauss = mdfconv.distribution("gauss")
    for m in (0.1, 1.0, 30.0, 1e3, 1e6):
        exact = -2 / m**2 * mean_square(m)
        got = gauss._log_slope_at_normal(np.array([[m]]))[0, 0]
        assert got == pytest.approx(exact, rel=1e-10)


def mean_square(m):
    with mp.workdps(30):
        edges = [0, *(e for e in (m / 4, m / 2, m, 2 * m, 4 * m, 8 * m) if e < 1.57), mp.pi / 2]
        weight = lambda b: mp.exp(-((b / m) ** 2)) * mp.sin(2 * b)  # noqa: E731
        return float(mp.quad(lambda b: b**2 * weight(b), edges) / mp.quad(weight, edges))


def test_display_at_high_exposure():
    source = mdfconv.distribution("sawicki")
    found = fit(source, np.array([1.0573976]), GTR(2.971177), Display(13.311275))
    assert found.parameter[0] == pytest.approx(0.49954, rel=1e-4)


@pytest.mark.parametrize(
    ("source", "parameter", "target", "exposure", "best"),
    [
        ("gauss", 0.836, "ggx", 24.7, 0.29303),
        ("gauss", 0.836, "student-t", 24.7, 0.29303),
        ("blinn-phong", 0.577, "ggx", 6.17, 0.44817),
        ("blinn-phong", 0.8, "smoothie", 23.6, 0.49644),
    ],
)
def test_the_minimum_may_lie_beside_a_plateau_of_clipped_lobes(
    source, parameter, target, exposure, best
):
    """Values of a dense scan over 4·10⁵ angles."""
    metric = Display(exposure)
    found = fit(
        mdfconv.distribution(source), np.array([parameter]), mdfconv.distribution(target), metric
    )
    assert found.parameter[0] == pytest.approx(best, rel=1e-4)


def test_lobes_that_are_clipped_as_a_whole_are_the_widest():
    phong, ggx = mdfconv.distribution("blinn-phong"), mdfconv.distribution("ggx")
    found = fit(phong, np.array([1e-6, 0.01, 0.1]), ggx, Display(4))
    assert found.parameter.tolist() == [1, 1, 1]


def test_fit_of_itself_is_itself():
    for name in NAMES:
        entry = mdfconv.distribution(name)
        for kept in list_metrics():
            found = fit(entry, PARAMETERS[name], entry, metric_named(kept)).parameter
            np.testing.assert_allclose(found, PARAMETERS[name], rtol=1e-8)


def test_batches_agree_with_single_fits():
    values = np.geomspace(0.01, 0.9, 40)
    source, target = mdfconv.distribution("gauss"), mdfconv.distribution("schlick")
    together = fit(source, values, target, Energy()).parameter
    alone = [fit(source, values[k : k + 1], target, Energy()).parameter[0] for k in range(0, 40, 3)]
    np.testing.assert_allclose(together[::3], alone, rtol=1e-9)
    assert fit(source, np.zeros(0), target, Energy()).parameter.shape == (0,)


def test_gtr_with_fixed_gamma():
    values = np.array([0.05, 0.3])
    source = mdfconv.distribution("beckmann")
    as_ggx = fit(source, values, mdfconv.distribution("ggx"), Energy()).parameter
    np.testing.assert_allclose(fit(source, values, GTR(2), Energy()).parameter, as_ggx, rtol=1e-9)
    np.testing.assert_allclose(
        fit(source, values, GTR(2 + 1e-9), Energy()).parameter, as_ggx, rtol=1e-7
    )
    back = fit(GTR(3.5), values, GTR(3.5), Display()).parameter
    np.testing.assert_allclose(back, values, rtol=1e-8)


def test_samples_are_used_as_they_are():
    reach = np.array([0.8])
    beta = np.linspace(0, 0.8, 301)
    found = fit(
        mdfconv.distribution("beckmann"),
        np.array([0.2]),
        mdfconv.distribution("blinn-phong"),
        Unit(),
        UniformSamples(reach, 301),
    )
    wanted = mdfconv.distribution("beckmann").unit(beta, 0.2)

    def cost(n):
        return np.sum((mdfconv.distribution("blinn-phong").unit(beta, n) - wanted) ** 2)

    n = found.parameter[0]
    assert found.distance[0] == pytest.approx(cost(n), rel=1e-9)
    assert cost(n) < min(cost(n * (1 + 1e-4)), cost(n * (1 - 1e-4)))


@pytest.mark.parametrize("normalized", [False, True])
@pytest.mark.parametrize("entry", one_parameter_distributions(), ids=lambda entry: entry.name)
def test_slopes(entry, normalized):
    """The analytic slope against a difference quotient at 50 digits of precision."""
    name = entry.name
    if entry.second_parameter:
        entry = entry.with_gamma(1.17 * entry.second_parameter.typical[0])
    gamma = 2 if entry.gamma is None else mp.mpf(entry.gamma)
    falls = entry.parameter.larger_is_smoother
    values = [1.2, 30.0, 4e4] if falls else [1e-3, 0.3, 0.69, 0.97]
    for parameter in values:
        width = entry.half_width(parameter)
        beta = np.array([[0, 0.3, 1, 2.2]]) * (0.4 if np.isnan(width) else width)
        beta = np.minimum(beta, 1.5)
        value, slope = entry.with_slope(
            Angles(beta), np.array([[parameter]]), normalized=normalized
        )
        at_normal = slope_at_normal(entry, name, parameter, gamma) if normalized else 0
        step = mp.mpf(10) ** -20
        for place, angle in enumerate(beta[0]):
            if value[0, place] == 0:
                assert slope[0, place] == 0
                continue
            above, below = (
                oracles.ratio_mp(
                    name, mp.mpf(angle), mp.mpf(parameter) * mp.exp(sign * step), gamma
                )
                for sign in (1, -1)
            )
            exact = (mp.log(above) - mp.log(below)) / (2 * step)
            if not normalized:
                above, below = (
                    oracles.maximum(name, mp.mpf(parameter) * mp.exp(sign * step), gamma)
                    for sign in (1, -1)
                )
                exact -= (mp.log(above) - mp.log(below)) / (2 * step)
            exact += at_normal
            got = slope[0, place] / value[0, place]
            assert got == pytest.approx(float(exact), rel=1e-9, abs=1e-9), (
                f"∂ ln D/∂ ln p of {name} at β = {angle} for {parameter} is not the printed "
                "form's: see _lobe_and_log_slope, _log_slope_at_normal and _log_slope_off_axis"
            )


def slope_at_normal(entry, name, parameter, gamma):
    """∂ ln D(0)/∂ ln p from a difference quotient of the hemisphere's integral."""
    step = mp.mpf(10) ** -12

    def integral(p):
        edges = [0, *(mp.mpf(entry_width(entry, parameter)) * 2**k for k in range(-2, 14))]
        if name == "schlick":
            edge = mp.acos(1 - p)
            edges = [e for e in edges if e < edge] + [edge]
        else:
            edges = [e for e in edges if e < mp.pi / 2] + [mp.pi / 2]
        with mp.workdps(30):
            return mp.quad(lambda b: oracles.ratio_mp(name, b, p, gamma) * mp.sin(2 * b), edges)

    above, below = (integral(mp.mpf(parameter) * mp.exp(sign * step)) for sign in (1, -1))
    return -(mp.log(above) - mp.log(below)) / (2 * step)


def entry_width(entry, parameter):
    width = float(entry.half_width(parameter))
    return 0.4 if np.isnan(width) else width


def test_metrics_are_named():
    assert metric_named("Energy").name == "energy"
    with pytest.raises(ValueError, match="did you mean display"):
        metric_named("displai")
    for exposure in (0, -1, np.nan, np.inf, "bright"):
        with pytest.raises(ValueError, match="exposure"):
            metric_named(f"display:{exposure}")
    with pytest.raises(ValueError, match="the energy metric has no setting '4'"):
        metric_named("energy:4")
    with pytest.raises(ValueError, match="named by a string"):
        metric_named(4)
    assert str(metric_named("display:4")) == "display:4"
    assert str(metric_named("display:1")) == str(Display()) == "display"
    assert metric_named(metric_named("display:0.5")).exposure == 0.5


def test_convert_by_fit():
    convert = mdfconv.convert
    assert convert(0.2, "beckmann", "ggx", method="fit") == pytest.approx(0.23554, abs=1e-5)
    energy = convert(100, "blinn-phong", "ggx:roughness", method="fit", metric="energy")
    assert energy == pytest.approx(0.36, abs=1e-4)
    values = np.array([[0.1, 0.2], [0.3, 0.4]])
    got = convert(values, "beckmann", "ggx", method="fit", metric="display:4")
    assert got.shape == (2, 2)
    assert np.all(np.diff(got.ravel()) > 0)
    with pytest.raises(ValueError, match="no answer in gauss"):
        convert(1.0, "ggx", "gauss", method="fit")
    answer = mdfconv.explain(1.0, "schlick", "ggx", "fit", metric="energy")[0]
    assert answer.result == 1
    assert answer.metric == "energy"
    assert "end of the legal range" in answer.cautions[0]


def test_errors_follow_the_metric():
    rows = {
        kept: mdfconv.explain(0.2, "beckmann", "ggx", "fit", metric=kept)[0]
        for kept in ("unit", "energy", "display")
    }
    for kept, row in rows.items():
        others = [
            mdfconv.explain(0.2, "beckmann", "ggx", other, metric=kept)[0].rmse
            for other in ("closed-form", "half-angle", "peak")
        ]
        # The metric's weight differs from the uniform one of the error, so not by much.
        assert row.rmse <= min(others) * 1.1


@pytest.mark.parametrize(("source", "target"), [("ggx", "gauss"), ("schlick", "blinn-phong")])
def test_a_value_is_fitted_alike_in_every_batch(source, target):
    values = np.array([0.95, 0.2, 0.01, 0.6])
    ends = mdfconv.distribution(source), mdfconv.distribution(target)
    alone = [fit(ends[0], values[i : i + 1], ends[1], Unit()).parameter[0] for i in range(4)]
    for order in (slice(None), slice(None, None, -1)):
        together = fit(ends[0], values[order], ends[1], Unit()).parameter
        assert together == pytest.approx(np.array(alone)[order], rel=1e-9)


@pytest.mark.parametrize(
    ("source", "target", "x"),
    [
        # The start lies so near the minimum that the first step looks like the last.
        ("ggx", "schlick", 0.9598171117924416),
        # The scan does not see Schlick's edge: the minimum is outside its bracket.
        ("schlick", "gauss", 0.9384743),
    ],
)
def test_the_fit_is_smooth_where_its_search_is_hard(source, target, x):
    around = x + 1e-4 * np.arange(-2, 3)
    ends = mdfconv.distribution(source), mdfconv.distribution(target)
    got = fit(ends[0], around, ends[1], Unit()).parameter
    assert abs(np.diff(got, 4)[0]) < 5e-8


@pytest.mark.parametrize(
    ("value", "metric", "result"),
    [(0.1234, "display:4", 0.143807649), (0.1234, "display", 0.1301773675)],
)
def test_a_clipped_lobe_and_one_with_an_edge(value, metric, result):
    # By a quadrature of 1.5 million angles and a parabola through the least distances.
    converted = mdfconv.convert(value, "ggx", "schlick", "fit", metric=metric)
    assert converted == pytest.approx(result, rel=5e-8)


def test_a_free_gamma_at_the_end_of_the_range():
    assert mdfconv.convert(1.0, "ggx", "gtr", gamma="free") == (1.0, 0.25)


def test_a_constant_that_leads_to_infinity_is_refused_in_terms_of_the_source():
    with pytest.raises(mdfconv.MdfconvError, match="fit gives smoothie"):
        mdfconv.convert(1.5, "beckmann", "smoothie", "fit", metric="environment")
