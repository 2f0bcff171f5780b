"""`mdfconv fit` on files of two directions: tables, several files."""

import json

import numpy as np
import pytest

from tests.cli.runner import run
from tests.measured.test_brdf_fit import measured

HEADER = "theta_i,phi_i,theta_o,phi_o,R,G\n"


def degrees(vectors):
    theta = np.degrees(np.arctan2(np.hypot(vectors[:, 0], vectors[:, 1]), vectors[:, 2]))
    return theta, np.degrees(np.arctan2(vectors[:, 1], vectors[:, 0]))


def write(path, name="ggx", seed=1, **rest):
    data = measured(
        np.random.default_rng(seed), name, diffuse=(0.3, 0.1), specular=(0.8, 0.5), **rest
    )
    columns = (*degrees(data.incident), *degrees(data.outgoing), *data.values.T)
    lines = [",".join(f"{cell:.9g}" for cell in row) for row in zip(*columns, strict=True)]
    path.write_text(HEADER + "\n".join(lines) + "\n")
    return path


def test_table(tmp_path):
    path = write(tmp_path / "paint.csv")
    status, out, err = run("fit", path, "--fresnel", "none", "--format", "json")
    assert status == 0
    records = {record["distribution"]: record for record in json.loads(out)}
    ggx = records["ggx"]
    assert abs(ggx["parameter"] - 0.2) < 4 * ggx["parameter_stderr"]
    assert ggx["diffuse"] == pytest.approx([0.3, 0.1], rel=0.02)
    assert ggx["specular"] == pytest.approx([0.8, 0.5], rel=0.02)
    assert ggx["f0"] is None
    assert ggx["recommended"]
    # k_d + k_s is above 1.
    assert ggx["verdict"] == "usable"
    assert {check["name"] for check in ggx["checks"] if check["passed"] is False} == {"energy"}
    assert {check["name"] for check in ggx["checks"]} >= {"energy", "resolution", "left out"}
    assert records["beckmann"]["error"] > 3 * ggx["error"]
    assert "usable: " in err
    assert "warning: energy: " in err
    assert "degrees" in err


def test_reflectance_and_masking(tmp_path):
    path = write(tmp_path / "paint.csv", reflectance=0.3)
    words = "--to", "ggx", "--fresnel", "metal", "--free-specular", "--format", "json"
    (record,) = json.loads(run("fit", path, *words)[1])
    assert abs(record["f0"][0] - 0.3) < 4 * record["f0_stderr"][0]
    assert abs(record["specular"][1] - 0.5) < 4 * record["specular_stderr"][1]
    (other,) = json.loads(run("fit", path, *words, "--masking", "none")[1])
    assert other["error"] > record["error"]


def test_several_files_make_one_table(tmp_path):
    write(tmp_path / "a.csv", "ggx")
    write(tmp_path / "b.csv", "beckmann")
    status, out, err = run(
        "fit", "*.csv", "--to", "ggx", "--to", "beckmann", "--fresnel", "none", "--format", "json",
        cwd=tmp_path,
    )  # fmt: skip
    assert status == 0
    best = {}
    for record in json.loads(out):
        best.setdefault(record["file"], record["distribution"])
    assert best == {"a.csv": "ggx", "b.csv": "beckmann"}
    assert "a.csv: usable: " in err


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["a.csv", "b.csv", "--png", "x.png"], "--png is of one file"),
        (["a.csv", "--report", "x.pdf"], "a report is an .html or a .md file"),
        (["a.csv", "--fresnel", "much"], "unknown Fresnel factor 'much'"),
        (["a.csv", "--max-angle", "4"], "no samples up to 4°"),
        (["a.csv", "--cells", "100"], "cells are those of a MERL file"),
        (["a.csv", "--theta-i", "nowhere"], "nowhere"),
        (["one.csv", "--fresnel", "metal"], "--fresnel needs two directions"),
        (["one.csv", "--loss", "cosine"], "--loss cosine needs two directions"),
        (["one.csv", "--aperture", "1", "--noise", "2%"], "--aperture and --noise need two"),
        (["none.csv"], "cannot read none.csv"),
    ],
)
def test_mistakes(tmp_path, words, message):
    write(tmp_path / "a.csv")
    write(tmp_path / "b.csv")
    (tmp_path / "one.csv").write_text("angle deg,value\n0,1\n5,0.9\n10,0.6\n20,0.2\n30,0.1\n")
    before = sorted(tmp_path.iterdir())
    status, out, err = run("fit", *words, cwd=tmp_path)
    assert (status, out) == (2, "")
    assert message in err
    assert len(err.splitlines()) == 1
    assert sorted(tmp_path.iterdir()) == before


def test_standard_input(tmp_path):
    content = write(tmp_path / "a.csv").read_bytes()
    status, out, _ = run("fit", "-", "--to", "ggx", "--format", "plain", stdin=content)
    assert status == 0
    assert "ggx" in out


def test_two_lobes_by_name(tmp_path):
    """Among all they are one of many; their name has no case, as others'."""
    path = write(tmp_path / "paint.csv", count=5)
    line = ("fit", str(path), "--fresnel", "none", "--format", "json")
    records = json.loads(run(*line, "--to", "GGX+ggx")[1])
    assert [record["distribution"] for record in records] == ["ggx+ggx"]
    everything = json.loads(run(*line)[1])
    assert json.loads(run(*line, "--to", "ggx+ggx", "--to", "all")[1]) == everything


@pytest.mark.parametrize(
    ("words", "end"),
    [
        (["--aperture", "31"], "the aperture 31 is outside 0 to 30 (--aperture)"),
        (["--floor", "0"], "give noise or floor above 0, or neither (--floor)"),
    ],
)
def test_a_number_that_an_option_does_not_take(tmp_path, words, end):
    status, out, err = run("fit", str(write(tmp_path / "paint.csv")), *words)
    assert (status, out) == (2, "")
    assert err.strip().endswith(end)
