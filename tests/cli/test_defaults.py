"""One rule for what is answered where nothing, or only a metric, is said."""

import json
import re

import numpy as np
import pytest
from PIL import Image

import mdfconv
from mdfconv.fitting.metrics import list_metrics
from tests.cli.runner import run, run_on_terminal

PAIR = "--from", "blinn-phong", "--to", "ggx:roughness"


def record(*arguments):
    status, out, _ = run("convert", *arguments, "--format", "json")
    assert status == 0
    return json.loads(out)[0]


def test_the_same_shininess_has_one_roughness_in_every_command(tmp_path):
    wanted = mdfconv.convert(100, "blinn-phong", "ggx:roughness", "fit", metric="environment")
    assert wanted == pytest.approx(0.3314878, abs=5e-8)
    assert record(*PAIR, "--metric", "environment", 100)["result"] == pytest.approx(wanted)
    (tmp_path / "in.mtl").write_text("newmtl a\nNs 100\n")
    run("mtl", "in.mtl", "-o", "out.mtl", cwd=tmp_path)
    assert "\nPr 0.3314878" in (tmp_path / "out.mtl").read_text()
    Image.fromarray(np.full((2, 2), 6554, np.uint16)).save(tmp_path / "in.png")
    status, _, err = run(
        "texture", "in.png", "-o", "out.png", "--from", "blinn-phong:exponent", "--to",
        "ggx:roughness", cwd=tmp_path,
    )  # fmt: skip
    assert (status, err) == (
        0,
        "mdfconv: wrote out.png: blinn-phong:exponent to ggx:roughness, "
        "keeps the light of a natural environment\n",
    )
    texel = np.asarray(Image.open(tmp_path / "out.png"))[0, 0] / 65535
    assert texel == pytest.approx(wanted, abs=2e-5)
    code = run("formula", *PAIR, "--lang", "python", "--tolerance", "1e-4")[1]
    assert "environment metric" in code
    names = {}
    exec(code, names)
    (function,) = (item for name, item in names.items() if name.startswith("ggx_roughness"))
    assert function(np.float32(100)) == pytest.approx(wanted, rel=1e-4)


@pytest.mark.parametrize("kept", list_metrics())
def test_a_metric_is_never_ignored(kept):
    fitted = record(*PAIR, "--metric", kept, 100)
    assert (fitted["method"], fitted["metric"]) == ("fast", kept)
    exact = mdfconv.convert(100, "blinn-phong", "ggx:roughness", "fit", metric=kept)
    assert fitted["result"] == pytest.approx(exact, rel=1e-4 if kept == "display" else 1e-6)
    printed = record(*PAIR, "--metric", kept, "--method", "closed-form", 100)
    assert (printed["method"], printed["metric"]) == ("closed-form", kept)
    assert printed["result"] == mdfconv.convert(100, "blinn-phong", "ggx:roughness")
    assert printed["rmse"] >= fitted["rmse"]


def test_without_a_metric_it_is_the_papers_closed_form():
    assert record(*PAIR, 100)["method"] == "closed-form"
    assert mdfconv.convert(0.2, "beckmann", "ggx") == 0.23552


def test_what_is_not_stored_is_fitted():
    values = np.array([0.01, 100.0])  # fast begins at 0.1
    got = mdfconv.convert(values, "blinn-phong", "ggx", metric="environment")
    exact = mdfconv.convert(values, "blinn-phong", "ggx", "fit", metric="environment")
    assert got == pytest.approx(exact, rel=1e-6)
    entries = mdfconv.explain(values, "blinn-phong", "ggx", metric="environment")
    assert [entry.method for entry in entries] == ["fit", "fast"]
    exposed = record(*PAIR, "--metric", "display", "--exposure", 4, 100)
    assert (exposed["method"], exposed["metric"]) == ("fast", "display:4")
    assert record("--from", "ggx", "--to", "gtr", "--gamma", 3, "--metric", "energy", 0.2)[
        "method"
    ] == "fit"  # fmt: skip
    with pytest.raises(mdfconv.MdfconvError, match="fit has no answer"):
        mdfconv.convert(0.99, "ggx", "sawicki", metric="unit")


@pytest.mark.parametrize("columns", ["80", "120", "200"])
def test_tables_fit_a_terminal(columns):
    for arguments in (
        ("--from", "beckmann", "--to", "all", "0.2"),
        ("--from", "ashikhmin-shirley", "--to", "ggx", "100,20"),
        (*PAIR, "--metric", "environment", "1", "100", "12345.678"),
        ("--from", "beckmann", "--to", "student-t", "--gamma", "free", "0.2"),
    ):
        status, text = run_on_terminal("convert", *arguments, COLUMNS=columns)
        assert status == 0
        lines = re.sub(r"\x1b\[[0-9;]*m", "", text).splitlines()
        # The longest heading there is takes three columns more.
        limit = int(columns) + 3 * ("ashikhmin-shirley" in arguments)
        assert max(len(line.rstrip()) for line in lines) <= limit
