"""``mdfconv recommend``: the choice, and the command as a process."""

import csv
import io
import json

import pytest

import mdfconv
from mdfconv.distributions import one_parameter_distributions
from mdfconv.recommend import Candidate, choose
from tests.cli.runner import run, run_on_terminal

NAMES = [entry.name for entry in one_parameter_distributions()]


def candidate(name, ns, operations, error):
    return Candidate(name, 0.1, "fit", ns, operations, error / 2, error)


SOURCE = Candidate("beckmann", 0.2, "none", 2.0, 17, 0.0, 0.0)


@pytest.mark.parametrize(
    ("tolerance", "use", "chosen"),
    [
        (0.1, "numpy", "sharp"),
        (0.05, "numpy", "sharp"),
        (0.02, "numpy", "near"),
        (0.005, "numpy", "beckmann"),
        (1e-9, "numpy", "beckmann"),
        (0.1, "shader", "slow"),
        (0.01, "shader", "slow"),
        (0.009, "shader", "beckmann"),
    ],
)
def test_cheapest_within_the_tolerance(tolerance, use, chosen):
    candidates = [
        SOURCE,
        candidate("quick", 1.0, 20, 0.04),
        candidate("few", 1.09, 5, 0.08),
        candidate("sharp", 1.05, 26, 0.03),
        candidate("slow", 4.0, 1, 0.01),
        candidate("near", 1.5, 20, 0.01),
        candidate("also", 1.5, 20, 0.02),
    ]
    assert choose(candidates, tolerance, use).distribution == chosen
    assert choose(candidates[::-1], tolerance, use).distribution == chosen


def answer(*arguments):
    status, out, err = run("recommend", *arguments, "--format", "json")
    assert (status, err) == (0, "")
    return json.loads(out)


def test_answer_is_within_the_tolerance_and_explained():
    answered = answer("--from", "beckmann", 0.2, "--tolerance", 0.05, "--metric", "unit")
    first = answered["candidates"][0]
    chosen = {row["chosen"]: row for row in answered["candidates"] if row["chosen"]}
    assert sorted(chosen) in (["both"], ["numpy", "shader"])
    for use in ("shader", "numpy"):
        row = chosen.get(use) or chosen["both"]
        assert answered[use].items() <= row.items()
        assert row["distribution"] in answered["reason"]
    assert not any(row["chosen"] for row in answered["candidates"][len(chosen) :])
    # Operations do not depend on the machine: of those within, Sawicki has the fewest.
    assert answered["shader"]["distribution"] == "sawicki"
    within = [row for row in answered["candidates"] if row["within"]]
    # The shape of Beckmann is not GGX's, whatever the machine.
    assert {row["distribution"] for row in within} == {
        "beckmann", "gauss", "blinn-phong", "sawicki",
    }  # fmt: skip
    assert all((row["max_error"] <= 0.05) == row["within"] for row in answered["candidates"])
    assert answered["candidates"][: len(within)] == within
    assert first["distribution"] in answered["reason"]
    for row in answered["candidates"]:
        if row["method"] != "none":
            name, method = row["distribution"], row["method"]
            same = mdfconv.explain(0.2, "beckmann", name, method)[0]
            assert row["parameter"] == pytest.approx(same.result, rel=1e-12)
            assert row["max_error"] == pytest.approx(same.max_error, rel=1e-9)
            assert row["rmse"] == pytest.approx(same.rmse, rel=1e-9)


def test_nothing_else_is_near_enough():
    answered = answer("--from", "beckmann", 0.2, "--tolerance", 1e-4)
    assert answered["shader"] == answered["numpy"]
    assert answered["shader"]["distribution"] == "beckmann"
    assert answered["candidates"][0]["method"] == "none"
    assert answered["reason"].startswith("keep beckmann: nothing else")


def test_metric_and_encoding():
    answered = answer("--from", "ggx:roughness", 0.5, "--metric", "display", "--exposure", 2)
    assert answered["from"] == "ggx:roughness"
    row = next(row for row in answered["candidates"] if row["distribution"] == "ggx")
    assert row["parameter"] == 0.25
    # Smoothie, and GTR and Student-t at γ = 2, are GGX: as near, though not as few operations.
    assert {row["distribution"] for row in answered["candidates"] if row["within"]} == {
        "ggx", "gtr", "smoothie", "student-t",
    }  # fmt: skip
    other = next(row for row in answered["candidates"] if row["distribution"] == "beckmann")
    same = mdfconv.explain(0.25, "ggx", "beckmann", "fit", metric="display:2")[0]
    assert other["max_error"] == pytest.approx(same.max_error, rel=1e-6)


def test_plain_in_a_pipe():
    status, out, err = run("recommend", "--from", "blinn-phong", 100, "--tolerance", 1e-6)
    assert (status, out) == (
        0, "shader blinn-phong 100 none\nnumpy blinn-phong 100 none\n",
    )  # fmt: skip
    assert err == "mdfconv: keep blinn-phong: nothing else stays within 1e-06 of it.\n"


def test_csv_and_markdown():
    arguments = ("recommend", "--from", "beckmann", 0.2, "--tolerance", 1e-6, "--format")
    status, out, _ = run(*arguments, "csv")
    assert status == 0
    rows = list(csv.DictReader(io.StringIO(out)))
    assert [row["chosen"] for row in rows] == ["both"] + [""] * (len(NAMES) - 1)
    assert rows[0]["distribution"] == "beckmann"
    status, out, err = run(*arguments, "markdown")
    assert (status, err) == (0, "")
    assert out.splitlines()[2].startswith("| beckmann | 0.2 | none |")
    assert out.endswith("Keep beckmann: nothing else stays within 1e-06 of it.\n")


def test_table_on_a_terminal():
    status, out = run_on_terminal("recommend", "--from", "beckmann", "0.2", "--tolerance", "1e-6")
    assert status == 0
    row = next(line for line in out.splitlines() if "none" in line)
    assert "\x1b[1m" in row
    assert "beckmann" in row
    assert "Keep beckmann" in out
    assert "Examples:" in run("recommend", "--help")[1]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--from", "beckmann", 0.2, "--tolerance", 0), "a number above 0, not 0"),
        (("--from", "beckmann", 0.2, "--tolerance", -1), "a number above 0, not -1"),
        (("--from", "beckmann", 0.2, "--tolerance", "nan"), "a number above 0, not nan"),
        (("--from", "beckmann", 0.2, "--tolerance", "inf"), "a number above 0, not inf"),
        (("--from", "beckmann", -0.2), "m_B > 0"),
        (("--from", "beckmann", "nan"), "not a finite number"),
        (("--from", "bekmann", 0.2), "did you mean beckmann"),
        (("--from", "gauss:roughness", 0.2), "gauss has no encoding"),
        (("--from", "ashikhmin-shirley", 100), "name that"),
        (("--from", "beckmann", "100,20"), "not a valid float"),
        (("--from", "beckmann", 0.2, "--metric", "shape"), "unknown metric"),
        ((0.2,), "Missing option '--from'"),
    ],
)
def test_mistakes(arguments, words):
    status, out, err = run("recommend", *arguments)
    assert (status, out) == (2, "")
    assert err.count("\n") == 1
    assert words in err
