"""Table 2 and what hangs on it."""

import csv
import json

import numpy as np
import pytest

from mdfconv.fitting.metrics import metric_named
from mdfconv.studies.table2 import (
    COLUMNS,
    angle_limit,
    fit_table,
    paper_sweep,
    printed_cells,
    refit,
)
from tests.cli.runner import run

# The cells that do not come back: row N, column.
KNOWN = {
    ("0.4473", "m_g"), ("0.4473", "rmse_m_g"), ("0.1415", "rmse_m_g"), ("0.01415", "n_ds"),
    ("0.01415", "rmse_n"), ("0.005164", "rmse_n"), ("0.1634", "rmse_n_eq11"),
    ("0.05164", "rmse_n_eq11"), ("0.01634", "rmse_n_eq11"), ("0.005164", "rmse_n_eq11"),
}  # fmt: skip


def test_all_cells_but_the_known_ones_come_back():
    cells = list(printed_cells())
    assert len(cells) == 153
    missed = {(cell["m_b"], cell["column"]) for cell in cells if not cell["agrees"]}
    assert missed == KNOWN
    reasons = [cell["reason"] for cell in cells if not cell["agrees"]]
    assert all(reason and reason != "unexplained" for reason in reasons)
    # Most agree to the printed digit.
    assert sum(abs(cell["units"]) <= 0.5 for cell in cells) > 120


def test_csv_has_the_papers_columns():
    status, out, err = run("fit-table")
    assert (status, err) == (0, "")
    rows = list(csv.DictReader(out.splitlines()))
    assert tuple(rows[0]) == COLUMNS
    assert len(rows) == 17
    assert float(rows[2]["c_tr"]) == pytest.approx(0.2357, abs=5e-5)


def test_other_sweeps_and_metrics():
    status, out, _ = run(
        "fit-table", "--sweep", "0.001:1:5", "--metric", "energy", "--format", "json"
    )
    assert status == 0
    rows = json.loads(out)
    np.testing.assert_allclose([row["m_b"] for row in rows], np.geomspace(0.001, 1, 5))
    assert rows[0]["c_tr"] / rows[0]["m_b"] == pytest.approx(0.925, abs=5e-4)
    # A row of a sweep is the conversion by fit.
    _, single, _ = run(
        "convert", "--from", "beckmann", "--to", "ggx", "--method", "fit", "--metric", "energy",
        rows[3]["m_b"],
    )  # fmt: skip
    assert float(single) == pytest.approx(rows[3]["c_tr"], rel=1e-9)


def test_extended_table():
    m_b = np.array([0.2, 0.3])
    rows = fit_table(m_b, angle_limit(m_b), metric_named("unit"), extended=True)
    assert tuple(rows[0])[: len(COLUMNS)] == COLUMNS
    further = list(rows[0])[len(COLUMNS) :]
    assert further[:4] == ["gtr", "gamma_gtr", "rmse_gtr", "schlick"]
    assert {"smoothie", "student_t", "gamma_student_t", "rmse_student_t"} <= set(further)
    # Two parameters fit no worse than one, and Smoothie is GGX.
    assert rows[0]["rmse_student_t"] < rows[0]["rmse_gtr"] < rows[0]["rmse_c_tr"]
    assert rows[0]["rmse_smoothie"] == pytest.approx(rows[0]["rmse_c_tr"], rel=1e-6)


def test_refitted_coefficients():
    found = {(entry.form.source, entry.form.target): entry for entry in refit(metric_named("unit"))}
    assert len(found) == 14
    to_ggx = found["beckmann", "ggx"]
    assert to_ggx.coefficients == pytest.approx((1.2, -0.56), rel=0.02)
    for entry in found.values():
        assert entry.printed_error < 0.025
        assert entry.error < 0.012
    display = {entry.form.target: entry for entry in refit(metric_named("display")) if
               entry.form.source == "beckmann"}  # fmt: skip
    assert display["ggx"].printed_error > 0.8


def test_output_files(tmp_path):
    path = tmp_path / "table.md"
    assert run("fit-table", "--output", path) == (0, "", f"mdfconv: wrote {path}\n")
    assert path.read_text().startswith("| m_b |")
    assert [entry.name for entry in tmp_path.iterdir()] == ["table.md"]
    status, out, err = run("fit-table", "--output", tmp_path / "no" / "table.csv")
    assert (status, out) == (2, "")
    assert "cannot write" in err
    assert err.count("\n") == 1


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--sweep", "1:2"), "LO:HI:COUNT"),
        (("--sweep", "0:2:3"), "m_B > 0"),
        (("--sweep", "0.1:2:0"), "COUNT"),
        (("--sweep", "0.1:2:x"), "LO:HI:COUNT"),
        (("--m-b", "-1"), "m_B > 0"),
        (("--m-b", "x"), "--m-b"),
        (("--m-b", "0.1", "--sweep", "0.1:1:2"), "either"),
        (("--compare", "--m-b", "0.1"), "paper's rows"),
        (("--compare", "--metric", "energy"), "unit metric only"),
        (("--compare", "--closed-forms"), "one of them"),
        (("--metric", "shape"), "unknown metric"),
        (("--metric", "display", "--exposure", "0"), "exposure"),
    ],
)
def test_bad_requests(arguments, words):
    status, out, err = run("fit-table", *arguments)
    assert (status, out) == (2, "")
    assert words in err
    assert err.count("\n") == 1


def test_paper_sweep():
    m_b, reach = paper_sweep()
    assert m_b[0] == np.sqrt(0.2)
    assert reach[-1] == 0.017


def test_surfaces_without_a_fit_are_refused():
    status, out, err = run("fit-table", "--m-b", 5, "--format", "json")
    assert (status, out) == (2, "")
    assert "has no best fit in" in err
