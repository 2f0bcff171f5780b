"""``mdfconv bench``: what is measured, and the command as a process."""

import csv
import io
import json
import os
import stat
import sys
import tracemalloc

import numpy as np
import pytest
from matplotlib.text import Annotation, Text
from PIL import Image
from scipy.optimize import minimize_scalar

import mdfconv
from mdfconv.conversion import method_named
from mdfconv.distributions import one_parameter_distributions
from mdfconv.distributions.base import Printed
from mdfconv.distributions.ggx import GGX
from mdfconv.fitting.metrics import list_metrics, metric_named
from mdfconv.recommend import answers, front, unbeaten
from mdfconv.studies.bench import (
    Measurements,
    Sizes,
    Task,
    curve_fit_loop,
    kernel_speeds,
    measure,
    method_speeds,
    plain_loop,
    substitutes,
    sweep,
)
from mdfconv.studies.bench_page import CAPTION, figure_of, markdown_page, tables
from mdfconv.studies.compiled import drjit_evaluation
from mdfconv.timing import Spread, interleave, spread
from tests.cli.runner import run, run_on_terminal

TINY = Sizes(angles=512, conversions=64, fits=4, loop=2, rounds=1)
NAMES = [entry.name for entry in one_parameter_distributions()]


def ignore(steps):
    pass


def tiny(source="beckmann", target="ggx", parameters=(0.2,), candidates=NAMES):
    """A task that takes a moment; the reference is the source."""
    ends = map(mdfconv.distribution, (source, target))
    reference, shapes = mdfconv.distribution(source), tuple(map(mdfconv.distribution, candidates))
    return Task(reference, np.array(parameters), shapes, *ends, TINY)


@pytest.fixture(scope="module")
def quick(tmp_path_factory):
    """One run of the command, with all its files."""
    folder = tmp_path_factory.mktemp("bench")
    files = {ending: folder / f"out.{ending}" for ending in ("csv", "json", "png")}
    options = [word for ending, path in files.items() for word in (f"--{ending}", path)]
    status, out, err = run("bench", "--quick", "--format", "markdown", *options)
    assert status == 0, err
    return files, out, err


def test_tables_are_the_same_in_csv_and_json(quick):
    files, _, err = quick
    assert [line.split()[:2] for line in err.splitlines()] == [["mdfconv:", "wrote"]] * 3
    report = json.loads(files["json"].read_text())
    rows = list(csv.DictReader(io.StringIO(files["csv"].read_text())))
    for name in ("substitutes", "methods", "kernels"):
        own = [row for row in rows if row["table"] == name]
        assert len(own) == len(report[name])
        for row, record in zip(own, report[name], strict=True):
            for column, value in record.items():
                assert row[column] == ("nan" if value is None else str(value))
    assert f"NumPy {np.__version__}" in report["machine"]
    assert "CPUs" in report["machine"]


def test_quick_run_holds_every_row_and_times_with_their_spread(quick):
    report = json.loads(quick[0]["json"].read_text())
    assert [row["distribution"] for row in report["substitutes"]] == 2 * NAMES
    assert [row["distribution"] for row in report["kernels"]] == 2 * NAMES
    covering = {"closed-form", "half-angle", "peak", "fit", "fast", "curve_fit"}
    covering |= {"curve_fit, 200 samples"}
    assert covering <= {row["method"] for row in report["methods"]}
    for table, times in (
        ("substitutes", ("ns_float64", "ns_float32")),
        ("methods", ("per_second",)),
        ("kernels", ("kernel_ns", "textbook_ns", "copy_ns")),
    ):
        for row in report[table]:
            for name in times:
                assert 0 < row[f"{name}_low"] <= row[name] <= row[f"{name}_high"]


def test_page_is_complete(quick):
    out = quick[1]
    assert out.startswith("# Speed against error\n")
    assert f"![Error against cost, distributions and methods](out.png)\n\n{CAPTION}\n" in out
    for heading in ("Distributions as substitutes", "Conversion methods", "Kernels"):
        assert f"## {heading}" in out
    assert "times as quickly as a loop of SciPy's `curve_fit`" in out
    tables = [line for line in out.splitlines() if line.startswith("| ---")]
    assert len(tables) == 3


def test_picture_and_permissions(quick):
    with Image.open(quick[0]["png"]) as image:
        assert image.width > 1000
    mask = os.umask(0)
    os.umask(mask)
    assert stat.S_IMODE(quick[0]["csv"].stat().st_mode) == 0o666 & ~mask


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--csv", "no/such/place.csv"), "not an existing directory"),
        (("--png", "."), "Is a directory"),
        (("--csv", "a", "--json", "./a"), "each its own file"),
        (("--reference", "bekmann"), "did you mean beckmann"),
        (("--reference", "ashikhmin-shirley"), "name that"),
        (("--parameter", "-1"), "m_B > 0"),
        (("--reference", "ggx", "--parameter", "2"), "0 < α ≤ 1"),
        (("--from", "ggx"), "nothing to convert"),
        (("--to", "ggx:roughness"), "here a distribution is meant"),
    ],
)
def test_mistakes_are_told_before_anything_is_measured(options, words, tmp_path):
    status, out, err = run("bench", *options, cwd=tmp_path)
    assert (status, out) == (2, "")
    assert err.count("\n") == 1
    assert words in err
    assert not list(tmp_path.iterdir())


def test_terminal():
    assert "Examples:" in run("bench", "--help")[1]
    status, out = run_on_terminal("bench", "--nonsense")
    assert status == 2
    assert "no such option" in out


@pytest.mark.parametrize(("source", "parameter"), [("beckmann", 0.2), ("ggx", 1.0)])
def test_energy_error_is_the_least_share_of_the_light(source, parameter):
    entry = mdfconv.distribution(source)
    measured = substitutes(tiny(source, parameters=[parameter]), ignore)
    beta = (np.arange(200_000) + 0.5) * np.pi / 400_000
    wanted = entry.normalized(beta, parameter)

    def share(log_parameter, name):
        got = mdfconv.distribution(name).normalized(beta, np.exp(log_parameter))
        weight = np.sin(2 * beta)
        return np.sqrt(np.sum(weight * (got - wanted) ** 2) / np.sum(weight * wanted**2))

    rows = {row["distribution"]: row for row in measured}
    assert rows[source]["rmse"] == rows[source]["energy_error"] == 0
    for name, near in (("ggx", 0.18), ("blinn-phong", 50.0), ("sawicki", 60.0)):
        if source == "beckmann":
            bounds = np.log([near / 2, near * 2])
            least = minimize_scalar(share, bounds=bounds, args=(name,), method="bounded").fun
            assert rows[name]["energy_error"] == pytest.approx(least, rel=1e-4)
            answer = mdfconv.explain(parameter, source, name, "fit")[0]
            assert rows[name]["parameter"] == answer.result
            assert (rows[name]["rmse"], rows[name]["max_error"]) == (answer.rmse, answer.max_error)
    # A uniform GGX has no Gaussian; its time is measured all the same.
    if source == "ggx":
        assert np.isnan(rows["gauss"]["parameter"])
        assert np.isnan([rows["gauss"]["rmse"], rows["gauss"]["energy_error"]]).all()
        assert rows["gauss"]["ns_float32"].median > 0


@pytest.mark.parametrize("name", list_metrics())
def test_loop_of_curve_fit_finds_the_same_minimum(name):
    source, target = map(mdfconv.distribution, ("beckmann", "ggx"))
    values = sweep(source, 3)
    assert values[[0, -1]] == pytest.approx([0.0044721, 0.44721], rel=1e-4)
    looped = curve_fit_loop(values, source, target, metric_named(name))
    fitted = answers(method_named("fit"), values, source, target, metric_named(name))
    # Its samples do not end where a screen clips to white.
    tolerance = 1e-3 if name == "display" else 1e-5
    np.testing.assert_allclose(looped, fitted, rtol=tolerance)


def test_plain_loop_finds_the_minimum_on_its_samples():
    values = np.array([0.05, 0.2, 0.5])
    looped = plain_loop(values, *map(mdfconv.distribution, ("beckmann", "ggx")), None)
    beta = np.linspace(0, 0.8, 200)
    for m, found in zip(values, looped, strict=True):
        wanted = np.exp(-((np.tan(beta) / m) ** 2)) / np.cos(beta) ** 4

        def distance(alpha, wanted=wanted):
            got = alpha**4 / (1 + (alpha**2 - 1) * np.cos(beta) ** 2) ** 2
            return np.sum((got - wanted) ** 2)

        least = minimize_scalar(distance, bounds=(0.5 * m, 2 * m), method="bounded")
        assert found == pytest.approx(least.x, rel=1e-4)


def test_plain_loop_of_two_parameters_and_of_what_has_no_start():
    ends = mdfconv.distribution("gtr").with_gamma(1.5), mdfconv.distribution("student-t")
    looped = plain_loop(np.array([0.1]), *ends, None)
    fitted = answers(method_named("fit"), np.array([0.1]), *ends, metric_named("unit"))
    assert looped == pytest.approx(fitted, rel=0.02)
    uniform = plain_loop(np.array([1.0]), *map(mdfconv.distribution, ("ggx", "beckmann")), None)
    assert np.isnan(uniform).all()


@pytest.mark.parametrize(
    ("source", "target"),
    [("beckmann", "blinn-phong"), ("ggx", "smoothie"), ("sawicki", "schlick"), ("gauss", "gtr")],
)
def test_methods_of_any_pair(source, target):
    measured = method_speeds(tiny(source, target), ignore)
    methods = {row["method"] for row in measured}
    assert ("ward" in methods) == (source in ("beckmann", "ggx"))
    fits = [row for row in measured if row["method"] == "fit"]
    assert [row["metric"] for row in fits] == list_metrics()
    assert all(row["parameter_error_max"] == 0 and row["answered"] == 1 for row in fits)
    loops = [row for row in measured if row["method"] == "curve_fit"]
    assert [row["metric"] for row in loops] == list_metrics()
    assert all(row["over_loop"] == 1 for row in loops)
    (plain,) = [row for row in measured if row["method"] == "curve_fit, 200 samples"]
    assert (plain["metric"], plain["over_plain_loop"]) == ("unit", 1)
    for row in fits:
        (loop,) = [loop for loop in loops if loop["metric"] == row["metric"]]
        # Of one round the median of the ratios is the ratio of the medians.
        for name, other in (("over_loop", loop), ("over_plain_loop", plain)):
            ratio = row["per_second"].median / other["per_second"].median
            assert row[name] == pytest.approx(ratio)
    closed = next(row for row in measured if row["method"] == "closed-form")
    assert closed["metric"] == "unit"
    assert closed["rmse_max"] >= closed["rmse"]
    assert closed["values"] == TINY.conversions


def test_progress_ends_with_the_measurements():
    steps = []
    task = tiny(parameters=[0.2, 0.05], candidates=["beckmann"])
    measure(task, steps.append)
    assert sum(steps) == task.steps


@pytest.mark.parametrize("name", NAMES)
def test_kernels_allocate_little_more_than_their_result(name):
    entry, beta = mdfconv.distribution(name), np.linspace(0, np.pi / 2, 4_000_000)
    tracemalloc.start()
    entry.unit(beta, entry.parameter.typical_value)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert 1 <= peak / beta.nbytes < 1.2


def wide(entry):
    """A parameter of a wide lobe: of narrow ones the printed expressions lose digits in float32."""
    return 8.3 if entry.parameter.larger_is_smoother else 0.5


@pytest.mark.parametrize(("precision", "tolerance"), [("float64", 1e-12), ("float32", 1e-5)])
@pytest.mark.parametrize("name", NAMES)
def test_compiled_form_is_that_of_the_distribution(name, precision, tolerance):
    drjit = pytest.importorskip("drjit")
    entry, beta = mdfconv.distribution(name), np.linspace(0, 1.55, 999, dtype=precision)
    evaluate = drjit_evaluation(entry, beta, wide(entry))
    first, again = evaluate(), evaluate()
    assert first.state == again.state == drjit.VarState.Evaluated
    assert first.index != again.index
    for compiled in (first, again):
        values = compiled.numpy()
        assert values.dtype == beta.dtype
        np.testing.assert_allclose(values, entry.unit(beta, wide(entry)), atol=tolerance)
    # The code is compiled once for all parameters, which it reads.
    other = entry.parameter.typical_value
    with drjit.scoped_set_flag(drjit.JitFlag.KernelHistory):
        values = drjit_evaluation(entry, beta, other)().numpy()
        kernels = [kernel for kernel in drjit.kernel_history() if kernel["size"] == beta.size]
    assert [bool(kernel["cache_hit"]) for kernel in kernels] == [True, True]
    allowed = tolerance if precision == "float64" else 1e-4
    np.testing.assert_allclose(values, entry.unit(beta, other), atol=allowed)


def test_compiled_form_of_another_gamma():
    pytest.importorskip("drjit")
    beta = np.linspace(0, 1.5, 99)
    entry = mdfconv.distribution("gtr").with_gamma(1.7)
    values = drjit_evaluation(entry, beta, 0.3)().numpy()
    np.testing.assert_allclose(values, entry.unit(beta, 0.3), rtol=1e-12)


def test_a_form_that_drjit_cannot_compute_is_not_timed():
    class Odd(GGX):
        name = "odd-form"
        printed = Printed.of_alpha(lambda beta, alpha: np.arctan2(alpha, beta))

    assert drjit_evaluation(Odd(), np.linspace(0, 1, 9), 0.2) is None


def test_kernels_are_held_to_what_there_is():
    rows = kernel_speeds(tiny(candidates=["ggx", "schlick"]), ignore)
    assert [row["precision"] for row in rows] == ["float64"] * 2 + ["float32"] * 2
    compiled = drjit_evaluation(GGX(), np.linspace(0, 1, 9), 0.2) is not None
    for row in rows:
        assert ("drjit_ns" in row) == ("per_drjit" in row) == compiled
        # Of one round the median of the ratios is the ratio of the medians.
        for rival in ("textbook", "copy", *["drjit"] * compiled):
            ratio = row["kernel_ns"].median / row[f"{rival}_ns"].median
            assert row[f"per_{rival}"] == pytest.approx(ratio)


def test_without_drjit_nothing_is_compiled(monkeypatch):
    monkeypatch.setitem(sys.modules, "drjit", None)
    rows = kernel_speeds(tiny(candidates=["ggx"]), ignore)
    assert len(rows) == 2
    assert not any("drjit_ns" in row for row in rows)


@pytest.mark.parametrize("compiled", [False, True])
def test_one_table_has_all_kernels_with_their_ratios(compiled):
    measured = measurements(compiled=compiled)
    rows = tables(measured)["kernels"]
    assert [row["kernel / copy"] for row in rows] == [8.0, 4.0, 5.0]
    assert [row["kernel / textbook"] for row in rows] == [0.5, 2.0, 3.0]
    # Dr.Jit may lack a function of a form.
    shares = [row.get("kernel / Dr.Jit") for row in rows]
    assert shares == ([4.0, 3.0, ""] if compiled else [None] * 3)
    page = markdown_page(measured)
    assert "0.5 to 3 times as long as the printed expressions in float32" in page
    assert ("4 to 4 times as long in float32 and 3 to 3 times in float64" in page) == compiled


def measurements(substitutes=(), methods=(), *, compiled=False):
    """Measurements made up for what is shown of them; without any of a kind some are there."""
    ns = Spread(4.0, 3.0, 5.0)
    kernels = [
        {"distribution": name, "precision": precision, "parameter": 0.1, "kernel_ns": ns}
        | ({"drjit_ns": ns, "per_drjit": per_drjit} if compiled and per_drjit else {})
        | {"textbook_ns": ns, "copy_ns": ns, "per_textbook": per_textbook, "per_copy": per_copy}
        for name, precision, per_drjit, per_textbook, per_copy in (
            ("ggx", "float32", 4.0, 0.5, 8.0),
            ("ggx", "float64", 3.0, 2.0, 4.0),
            ("gauss", "float32", None, 3.0, 5.0),
        )
    ]
    substitutes = substitutes or [("ggx", 4.0, 0.1)]
    kinds = ("closed-form", "fit", "curve_fit", "curve_fit, 200 samples")
    methods = methods or [(name, "unit", 1e6, 0.01) for name in kinds]
    everything = {
        "substitutes": [
            {
                "reference": "beckmann", "reference_parameter": 0.2, "distribution": name,
                "operations": 9, "parameter": 0.1, "rmse": error, "max_error": error,
                "energy_error": error, "ns_float32": Spread(time, 0.9 * time, 1.2 * time),
                "ns_float64": ns,
            }
            for name, time, error in substitutes
        ],
        "methods": [
            {
                "from": "beckmann", "to": "ggx", "method": name, "metric": metric, "values": 9,
                "per_second": Spread(speed, 0.9 * speed, 1.2 * speed), "over_loop": 1.0,
                "over_plain_loop": 1.0, "parameter_error": error, "parameter_error_max": error,
                "rmse": error, "rmse_max": error, "answered": 1.0,
            }
            for name, metric, speed, error in methods
        ],
        "kernels": kernels,
    }  # fmt: skip
    return Measurements("a machine", TINY, everything)


CROWDED = [
    ("beckmann", 15.0, 0.0), ("gauss", 3.0, 0.008), ("ggx", 15.1, 0.07), ("gtr", 15.2, 0.07),
    ("smoothie", 15.15, 0.07), ("student-t", 15.3, 0.07), ("schlick", 15.0, 0.065),
    ("sawicki", 14.0, 0.06), ("blinn-phong", 30.0, np.nan),
]  # fmt: skip
METHODS = [
    *[("fit", metric, 1e5, 0.0) for metric in list_metrics()],
    *[("curve_fit", metric, 1e3, 1e-6) for metric in list_metrics()],
    *[("fast", metric, 1.1e8, 1e-8) for metric in list_metrics()],
    ("closed-form", "unit", 1e8, 1e-3), ("peak", "unit", 1e8, np.nan),
    ("curve_fit, 200 samples", "unit", 1.2e3, 1e-6),
]  # fmt: skip


def test_picture_labels_each_point_once_and_none_covers_another():
    figure = figure_of(measurements(CROWDED, METHODS))
    assert figure.get_suptitle() == CAPTION
    shown = [[name for name, *_, error in CROWDED if not np.isnan(error)]] * 2
    shown.append([name for name, *_, error in METHODS if not np.isnan(error)])
    figure.draw_without_rendering()
    for axes, names in zip(figure.axes, shown, strict=True):
        labels = [text for text in axes.texts if isinstance(text, Annotation)]
        assert sorted(label.get_text() for label in labels) == sorted(names)
        boxes = [Text.get_window_extent(label) for label in labels]
        for number, box in enumerate(boxes):
            assert box.count_overlaps(boxes[:number]) == 0
            assert axes.bbox.fully_contains(*box.min)
            assert axes.bbox.fully_contains(*box.max)
        for label in labels:
            place = axes.transData.transform(label.xy)
            assert not any(box.contains(*place) for box in boxes)


def test_picture_of_what_has_no_error():
    nothing = [("fit", "unit", 1e5, np.nan)]
    figure = figure_of(measurements([("ggx", 4.0, np.nan)], nothing))
    assert not any(axes.texts for axes in figure.axes)


def test_front_of_the_picture_is_what_recommend_takes():
    costs = [(15.0, 17, 0.0), (3.0, 23, 0.008), (3.2, 24, 0.007), (15.2, 5, 0.07), (2.0, 6, np.nan)]
    assert unbeaten(costs, "numpy") == [2, 0]
    assert unbeaten(costs, "shader") == [3, 0]
    # The same lobe in another parameter, quicker by noise and nearer by rounding.
    costs = [(10.0, 5, 1e-9), (9.9, 24, 1e-16), (10.5, 6, 0.0)]
    assert unbeaten(costs, "numpy") == unbeaten(costs, "shader") == [0]


def test_front():
    points = [(3.0, 0.0), (1.0, 0.2), (2.0, 0.3), (np.nan, 0.0), (1.05, 0.1), (9.0, np.nan)]
    assert front(points) == [1, 4, 0]
    assert front(points, tie=0.1) == [4, 0]
    assert front([]) == []


def test_interleaving_counts_rounds_but_the_first():
    calls, steps = [], []
    functions = {name: lambda name=name: calls.append(name) for name in "abc"}
    times = interleave(functions, 4, steps.append)
    assert sorted(calls) == sorted("abc" * 5)
    assert steps == [1] * 5
    assert [samples.size for samples in times.values()] == [4] * 3
    assert spread(np.array([1.0, 2.0, 3.0, 4.0, 5.0])) == (3, 2, 4)
