"""The paper's error curves, and the command that draws them."""

import csv
import json

import numpy as np
import pytest
from PIL import Image

from mdfconv.fitting.metrics import metric_named
from mdfconv.render.comparison import PAPER_SETS
from mdfconv.studies.error_curves import curves
from tests.cli.runner import run

# Largest |error| in per cent, computed independently for the formula sheet.
MAXIMA = {
    "fig1": {"blinn-phong": 3.52, "gauss": 4.23, "ggx": 11.5, "sawicki": 6.89, "schlick": 12.4},
    "fig2": {"blinn-phong": 0.045, "gauss": 0.051, "ggx": 5.82, "sawicki": 3.07, "schlick": 15.3},
}


@pytest.mark.parametrize("figure", MAXIMA)
def test_maxima_of_the_papers_figures(figure):
    found = curves(PAPER_SETS[figure], metric_named("unit"), 1001)
    for row in found.maxima():
        printed = MAXIMA[figure][row["distribution"]]
        digits = 3 if printed > 0.1 else 2
        assert float(f"{row['max_error_percent']:.{digits}g}") == printed


def test_curves_follow_the_lobe():
    smooth = curves({"beckmann": 1e-4, "ggx": 1.2e-4}, metric_named("energy"), 101)
    assert 3e-4 < smooth.beta[-1] < 5e-4
    rough = curves({"ggx": 1.0, "beckmann": 1.0}, metric_named("unit"), 101)
    assert rough.beta[-1] == np.pi / 2
    assert rough.values["ggx"].max() == 1


def test_plot_error(tmp_path):
    status, out, err = run("plot-error", cwd=tmp_path, HOME="/nonexistent")
    assert status == 0
    names = sorted(path.name for path in (tmp_path / "reports").iterdir())
    assert names == ["fig1.png", "fig1b.csv", "fig2.png", "fig2b.csv"]
    assert err.count("wrote") == 4
    rows = list(csv.DictReader((tmp_path / "reports" / "fig1b.csv").read_text().splitlines()))
    assert list(rows[0]) == ["beta_rad", "blinn-phong", "gauss", "ggx", "sawicki", "schlick"]
    largest = max(abs(float(row["ggx"])) for row in rows)
    assert largest == pytest.approx(0.115, abs=5e-4)
    with Image.open(tmp_path / "reports" / "fig1.png") as picture:
        assert picture.size[0] > 900
    table = list(csv.DictReader(out.splitlines()))
    assert len(table) == 10


def test_plot_error_options(tmp_path):
    status, out, _ = run(
        "plot-error", "--m-b", 0.1, "--m-b", 0.9, "--method", "fit", "--metric", "energy",
        "--reference", "ggx", "--mdf", "beckmann", "--mdf", "smoothie", "--no-png", "--svg",
        "--log", "--points", 51, "--output", tmp_path, "--format", "json",
    )  # fmt: skip
    assert status == 0
    assert len(json.loads(out)) == 4
    names = sorted(path.name for path in tmp_path.iterdir())
    assert names == [
        "error-m_b-0.1.svg", "error-m_b-0.1b.csv", "error-m_b-0.9.svg", "error-m_b-0.9b.csv",
    ]  # fmt: skip
    assert len((tmp_path / "error-m_b-0.1b.csv").read_text().splitlines()) == 52
