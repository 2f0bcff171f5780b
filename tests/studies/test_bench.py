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
from PIL import Image
from scipy.optimize import minimize_scalar

import mdfconv
from mdfconv.conversion import method_named
from mdfconv.distributions import one_parameter_distributions
from mdfconv.fitting.metrics import list_metrics, metric_named
from mdfconv.recommend import answers
from mdfconv.studies.bench import (
    Sizes,
    Task,
    compiled_ggx,
    curve_fit_loop,
    kernel_speeds,
    measure,
    method_speeds,
    substitutes,
    sweep,
)
from mdfconv.studies.bench_page import front
from mdfconv.timing import interleave, spread
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
    assert covering <= {row["method"] for row in report["methods"]}
    for table, times in (
        ("substitutes", ("ns_float64", "ns_float32")),
        ("methods", ("per_second",)),
        ("kernels", ("kernel_ns", "textbook_ns")),
    ):
        for row in report[table]:
            for name in times:
                assert 0 < row[f"{name}_low"] <= row[name] <= row[f"{name}_high"]


def test_page_is_complete(quick):
    out = quick[1]
    assert out.startswith("# Speed against error\n")
    assert "![Error against time, distributions and methods](out.png)" in out
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
    entry, beta = mdfconv.distribution(name), np.linspace(0, np.pi / 2, 1_000_000)
    tracemalloc.start()
    entry.unit(beta, entry.parameter.typical_value)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert 1 <= peak / beta.nbytes < 1.2


@pytest.mark.parametrize(("precision", "tolerance"), [("float64", 1e-12), ("float32", 1e-5)])
def test_compiled_kernel_is_that_of_the_distribution(precision, tolerance):
    pytest.importorskip("drjit")
    beta = np.linspace(0, np.pi / 2, 999, dtype=precision)
    wanted = mdfconv.distribution("ggx").unit(beta, 0.2)
    np.testing.assert_allclose(compiled_ggx(beta, 0.2)().numpy(), wanted, rtol=tolerance)
    rows = kernel_speeds(tiny(candidates=["ggx"]), ignore)
    assert [row["precision"] for row in rows] == ["float64", "float32"]
    assert all(
        0 < row["drjit_ns"].low <= row["drjit_ns"].median <= row["drjit_ns"].high for row in rows
    )


def test_without_drjit_nothing_is_compiled(monkeypatch):
    monkeypatch.setitem(sys.modules, "drjit", None)
    rows = kernel_speeds(tiny(candidates=["ggx"]), ignore)
    assert len(rows) == 2
    assert not any("drjit_ns" in row for row in rows)


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
