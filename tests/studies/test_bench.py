"""``mdfconv bench``: what is measured, and the command as a process."""

import csv
import io
import json
import os
import stat
import sys
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image
from scipy.optimize import minimize_scalar

import mdfconv
from mdfconv.conversion import method_named
from mdfconv.distributions import one_parameter_distributions
from mdfconv.fitting.metrics import list_metrics, metric_named
from mdfconv.output.figures import PAGE, new_figure
from mdfconv.output.labels import place_labels
from mdfconv.recommend import substitutes
from mdfconv.studies.bench import compiled
from mdfconv.studies.bench.limits import limits
from mdfconv.studies.bench.loop import curve_fit_loop
from mdfconv.studies.bench.methods import answers, method_speeds, sweep
from mdfconv.studies.bench.pareto import front
from mdfconv.studies.bench.scaling import conversion_times, count_steps
from mdfconv.timing import Sizes, interleave, spread
from tests.cli.runner import run, run_on_terminal

TINY = Sizes(angles=512, conversions=64, fits=4, loop=2, rounds=1, largest=100, patience=0.05)
NAMES = [entry.name for entry in one_parameter_distributions()]


def ignore(steps):
    pass


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
    for name in ("substitutes", "methods", "scaling", "limits", "kernels", "compiled"):
        own = [row for row in rows if row["table"] == name]
        assert len(own) == len(report[name])
        for row, record in zip(own, report[name], strict=True):
            for column, value in record.items():
                assert row[column] == ("nan" if value is None else str(value))
    assert report["machine"]["numpy"] == np.__version__
    assert report["machine"]["cpu"]
    assert all(report["verdicts"].values())


def test_quick_run_holds_every_row_and_times_with_their_spread(quick):
    report = json.loads(quick[0]["json"].read_text())
    assert [row["distribution"] for row in report["substitutes"]] == 2 * NAMES
    assert [row["distribution"] for row in report["kernels"]] == 2 * NAMES
    covering = {"closed-form", "half-angle", "peak", "fit", "fast", "cold fit", "curve_fit"}
    for table in ("methods", "scaling", "limits"):
        assert covering <= {row["method"] for row in report[table]}
    for table, times in (
        ("substitutes", ("ns_float64", "ns_float32")),
        ("methods", ("per_second",)),
        ("scaling", ("seconds",)),
        ("limits", ("conversion_ns", "unavoidable_ns")),
        ("compiled", ("kernel_ns", "drjit_ns")),
        ("kernels", ("kernel_ns", "textbook_ns", "floor_ns", "copy_ns")),
    ):
        for row in report[table]:
            for name in times:
                assert 0 < row[f"{name}_low"] <= row[name] <= row[f"{name}_high"]
    for row in report["kernels"]:
        assert 1 <= row["memory"] < 1.2


def test_page_is_complete(quick):
    out = quick[1]
    assert out.startswith("# Speed against error\n")
    assert "![Error against time, distributions and methods; time against count](out.png)" in out
    headings = ("Distributions as substitutes", "Conversion methods", "Time against count")
    for heading in (*headings, "Where the limit lies", "Kernels", "Choosing"):
        assert f"## {heading}" in out
    assert "being rational buys" in out
    tables = [line for line in out.splitlines() if line.startswith("| ---")]
    assert len(tables) == 5 + ("## A compiled kernel" in out)


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
    measured = substitutes(
        entry, np.array([parameter]), one_parameter_distributions(), TINY, ignore
    )
    beta = (np.arange(200_000) + 0.5) * np.pi / 400_000
    wanted = entry.normalized(beta, parameter)

    def share(log_parameter, name):
        got = mdfconv.distribution(name).normalized(beta, np.exp(log_parameter))
        weight = np.sin(2 * beta)
        return np.sqrt(np.sum(weight * (got - wanted) ** 2) / np.sum(weight * wanted**2))

    rows = {row.distribution: row for row in measured}
    assert rows[source].rmse == rows[source].energy_error == 0
    for name, near in (("ggx", 0.18), ("blinn-phong", 50.0), ("sawicki", 60.0)):
        if source == "beckmann":
            bounds = np.log([near / 2, near * 2])
            least = minimize_scalar(share, bounds=bounds, args=(name,), method="bounded").fun
            assert rows[name].energy_error == pytest.approx(least, rel=1e-4)
            answer = mdfconv.explain(parameter, source, name, "fit")[0]
            assert rows[name].parameter == answer.result
            assert (rows[name].rmse, rows[name].max_error) == (answer.rmse, answer.max_error)
    # A uniform GGX has no Gaussian; its time is measured all the same.
    if source == "ggx":
        assert np.isnan(rows["gauss"].parameter)
        assert np.isnan([rows["gauss"].rmse, rows["gauss"].energy_error]).all()
        assert rows["gauss"].ns["float32"].median > 0


@pytest.mark.parametrize("name", list_metrics())
def test_loop_of_curve_fit_finds_the_same_minimum(name):
    source, target = map(mdfconv.distribution, ("beckmann", "ggx"))
    values = sweep(source, 3)
    assert values[[0, -1]] == pytest.approx([0.0044721, 0.44721], rel=1e-4)
    looped = curve_fit_loop(source, values, target, metric_named(name))
    fitted = answers(method_named("fit"), values, source, target, metric_named(name))
    # Its samples do not end where a screen clips to white.
    tolerance = 1e-3 if name == "display" else 1e-5
    np.testing.assert_allclose(looped, fitted, rtol=tolerance)


@pytest.mark.parametrize(
    ("source", "target"),
    [("beckmann", "blinn-phong"), ("ggx", "smoothie"), ("sawicki", "schlick"), ("gauss", "gtr")],
)
def test_methods_of_any_pair(source, target):
    measured = method_speeds(*map(mdfconv.distribution, (source, target)), TINY, ignore)
    methods = {row.method for row in measured}
    assert ("ward" in methods) == (source in ("beckmann", "ggx"))
    fits = [row for row in measured if row.method == "fit"]
    assert [row.metric for row in fits] == list_metrics()
    assert all(row.parameter_error_max == 0 and row.answered == 1 for row in fits)
    colds = [row for row in measured if row.method == "cold fit"]
    assert [row.metric for row in colds] == list_metrics()
    assert all(row.parameter_error_max < 1e-6 for row in colds)
    closed = next(row for row in measured if row.method == "closed-form")
    assert closed.metric == "unit"
    assert closed.rmse_max >= closed.rmse
    assert closed.values in (TINY.conversions, TINY.fits)


@pytest.mark.parametrize(("source", "target"), [("beckmann", "ggx"), ("gauss", "gtr")])
def test_limits_of_any_pair(source, target):
    pair = [mdfconv.distribution(name) for name in (source, target)]
    speeds = method_speeds(*pair, TINY, ignore)
    rows = limits(*pair, speeds, TINY, ignore)
    assert [(row.method, row.metric) for row in rows] == [
        (row.method, row.metric) for row in speeds
    ]
    for row, speed in zip(rows, speeds, strict=True):
        assert row.conversion == speed.nanoseconds
        assert row.ratio == row.conversion.median / row.unavoidable.median > 0
        assert ("angles" in row.work) == ("fit" in row.method)
        if row.method == "fast":
            constant = target == "ggx" and row.metric == "environment"
            assert ("polynomial" in row.work) != constant


def test_scaling_begins_with_one_value_and_ends_when_patience_does():
    pair = [mdfconv.distribution(name) for name in ("beckmann", "ggx")]
    steps = []
    rows = conversion_times(*pair, TINY, steps.append)
    assert len(steps) == count_steps(TINY)
    counts = {row.method: [] for row in rows}
    for row in rows:
        counts[row.method].append(row.values)
    assert counts["closed-form"] == [1, 10, 100]
    assert {row.metric for row in rows} == {"unit"}
    impatient = conversion_times(*pair, replace(TINY, patience=0.0), ignore)
    assert {row.values for row in impatient} == {1}
    assert {row.method for row in impatient} == set(counts)


@pytest.mark.parametrize(("precision", "tolerance"), [("float64", 1e-12), ("float32", 1e-5)])
def test_compiled_kernel_is_that_of_the_distribution(precision, tolerance):
    pytest.importorskip("drjit")
    beta = np.linspace(0, np.pi / 2, 999, dtype=precision)
    wanted = mdfconv.distribution("ggx").unit(beta, 0.2)
    np.testing.assert_allclose(compiled.evaluation(beta, 0.2)().numpy(), wanted, rtol=tolerance)
    rows = compiled.compiled_speeds(TINY, ignore)
    assert [row.precision for row in rows] == ["float64", "float32"]


def test_without_drjit_nothing_is_compiled(monkeypatch):
    monkeypatch.setitem(sys.modules, "drjit", None)
    assert compiled.compiled_speeds(TINY, ignore) == []
    assert compiled.count_steps(TINY) == 0


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


def test_labels_keep_out_of_each_others_way():
    figure = new_figure(*PAGE)
    axes = figure.subplots()
    x, y = [1.0, 1.05, 1.001, 3.0], [1.0, 1.0, 1.0, 2.0]
    axes.plot(x, y, "o")
    figure.canvas.draw()
    place_labels(axes, x, y, ["one", "two", "three", "four"])
    figure.canvas.draw()
    assert [text.get_text() for text in axes.texts] == ["one, three", "two", "four"]
    boxes = [text.get_window_extent() for text in axes.texts]
    assert not any(a.overlaps(b) for k, a in enumerate(boxes) for b in boxes[:k])


def test_labels_keep_off_lines():
    figure = new_figure(*PAGE)
    axes = figure.subplots()
    axes.plot([0, 4], [0, 4], "o")
    figure.canvas.draw()

    def extent(lines):
        place_labels(axes, [2.0], [2.0], ["name"], lines)
        figure.canvas.draw()
        return axes.texts[-1].get_window_extent()

    first = extent([])
    middle = axes.transData.inverted().transform(first.get_points().mean(axis=0))
    moved = extent([np.array([[0.0, middle[1]], [4.0, middle[1]]])])
    height = first.get_points().mean(axis=0)[1]
    assert height < moved.y0 or height > moved.y1
