"""``mdfconv fit`` on files of every format, good and bad."""

import csv
import json

import numpy as np
import pytest

import mdfconv
from mdfconv.measured.model import all_candidates
from tests.cli.runner import run

BETA_DEGREES = np.arange(0, 88, 2.0)
GGX = mdfconv.distribution("ggx").unit(np.radians(BETA_DEGREES), 0.25)


def table(angle, columns, header="", separator=","):
    rows = [
        separator.join(f"{cell:.12g}" for cell in row) for row in zip(angle, *columns, strict=True)
    ]
    return "\n".join(([header] if header else []) + rows) + "\n"


def merl(path, parameter=0.15):
    theta = (np.arange(90) / 90) ** 2 * np.pi / 2
    lobe = mdfconv.distribution("beckmann").unit(theta, parameter) / np.cos(theta) ** 2
    planes = np.full((3, 90, 90, 180), -1.0)
    for plane, scale, offset, unit in zip(
        planes, (20, 15, 5), (0.1, 0.05, 0.02), (1, 1.15, 1.66), strict=True
    ):
        plane[:, 0, :] = ((offset + scale * lobe) * 1500 / unit)[:, None]
    planes[:, 5, 0, :90] = -1  # invalid on one side
    with path.open("wb") as file:
        np.array([90, 90, 180], "<i4").tofile(file)
        planes.astype("<f8").tofile(file)


def fit(path, *arguments):
    status, out, err = run("fit", path, "--format", "json", *arguments)
    assert status == 0, err
    return json.loads(out), err


@pytest.mark.parametrize(
    ("text", "arguments"),
    [
        (table(BETA_DEGREES, [0.1 + 2 * GGX], "theta_deg,value"), ()),
        (table(BETA_DEGREES, [0.1 + 2 * GGX]), ()),
        (table(np.radians(BETA_DEGREES), [0.1 + 2 * GGX], "theta [rad]\tv", "\t"), ()),
        (table(np.cos(np.radians(BETA_DEGREES)), [0.1 + 2 * GGX], "cos_theta v", " "), ()),
        (
            table(np.radians(BETA_DEGREES), [0.1 + 2 * GGX], "# a comment", " "),
            ("--angle-unit", "radians"),
        ),
        (
            table(GGX, [BETA_DEGREES, 0.1 + 2 * GGX], "noise;angle;value", ";"),
            ("--angle", "angle", "--values", "value"),
        ),
        (table(BETA_DEGREES, [0.1 + 2 * GGX], "\ufeffTheta Deg,v"), ("--values", "2")),
    ],
)
def test_text(tmp_path, text, arguments):
    path = tmp_path / "data.txt"
    path.write_text(text, encoding="utf-8")
    (record,), err = fit(path, "--to", "ggx", *arguments)
    assert record["parameter"] == pytest.approx(0.25, rel=1e-6)
    assert record["offset"] == [pytest.approx(0.1, rel=1e-5)]
    assert record["scale"] == [pytest.approx(2, rel=1e-6)]
    assert "masking" not in err


def test_channels_are_fitted_jointly_or_apart(tmp_path):
    path = tmp_path / "rgb.csv"
    path.write_text(table(BETA_DEGREES, [GGX, 0.1 + 2 * GGX, 3 * GGX], "deg,R,G,B"))
    (record,), _ = fit(path, "--to", "ggx")
    np.testing.assert_allclose(record["scale"], [1, 2, 3], rtol=1e-6)
    apart, _ = fit(path, "--to", "ggx", "--separate")
    assert [record["channel"] for record in apart] == ["R", "G", "B"]


def test_all_distributions_best_first(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text(table(BETA_DEGREES, [0.1 + 2 * GGX], "deg,v"))
    records, err = fit(path)
    # Families whose γ is that of GGX, and two equal lobes, are GGX again.
    assert records[0]["distribution"] == "ggx"
    assert {record["distribution"] for record in records} == {
        what.name for what in all_candidates() if not (what.is_gamma_free or what.is_double)
    }
    # Those whose error is many times that of the best are not validated.
    assert [record["validated_error"] is None for record in records] == [False] + [True] * 5
    errors = [record["error"] for record in records]
    assert errors == sorted(errors)
    assert [record["recommended"] for record in records] == [True] + [False] * 5
    assert "good: " in err
    assert list(records[0]) == [
        "distribution", "parameter", "gamma", "offset", "scale", "parameter_stderr", "gamma_stderr",
        "offset_stderr", "scale_stderr", "loss", "error", "validated_error", "validated_spread",
        "rmse", "log_rmse", "bic", "recommended", "verdict", "checks",
    ]  # fmt: skip


def test_alta(tmp_path):
    path = tmp_path / "slice.alta"
    beta = np.radians(BETA_DEGREES)
    brdf = 0.1 + 2 * GGX / np.cos(beta) ** 2
    rows = table(np.cos(beta), [brdf, brdf / 2, brdf / 4], separator=" ")
    path.write_text(f"#DIM 1 3\n#PARAM_IN COS_TH\n#PARAM_OUT RGB_COLOR\n{rows}")
    (record,), err = fit(path, "--to", "ggx")
    assert record["parameter"] == pytest.approx(0.25, rel=1e-5)
    assert len(record["scale"]) == 3
    assert "masking is left out" in err
    assert "beyond 80° are left out" in err


def test_merl(tmp_path):
    path = tmp_path / "metal.binary"
    merl(path)
    records, err = fit(path)
    assert records[0]["distribution"] == "beckmann"
    assert records[0]["parameter"] == pytest.approx(0.15, rel=1e-9)
    np.testing.assert_allclose(records[0]["scale"], [20, 15, 5], rtol=1e-9)
    assert "masking is left out" in err
    whole = path.read_bytes()
    for name, content, words in (
        ("short.binary", whole[:-100], "truncated"),
        ("long.binary", whole + b"0", "too long"),
        ("empty.binary", b"", "not a MERL file"),
        ("text.binary", b"this is no binary file at all", "not a MERL file"),
    ):
        (tmp_path / name).write_bytes(content)
        status, out, message = run("fit", tmp_path / name)
        assert (status, out) == (2, "")
        assert words in message
        assert message.count("\n") == 1


def test_picture(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text(table(BETA_DEGREES, [0.1 + 2 * GGX], "deg,v"))
    picture = tmp_path / "a.png"
    status, out, _ = run("fit", path, "--png", picture, "--format", "csv", HOME="/nonexistent")
    assert status == 0
    assert out.startswith("distribution,")
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_missing_numbers_are_counted(tmp_path):
    path = tmp_path / "a.csv"
    text = table(BETA_DEGREES, [0.1 + 2 * GGX], "deg,v")
    path.write_text(text + "10,nan\n20,\n")
    (record,), err = fit(path, "--to", "ggx")
    assert "2 of 46 rows hold NaN" in err
    assert record["parameter"] == pytest.approx(0.25, rel=1e-6)


GOOD = table(BETA_DEGREES, [0.1 + 2 * GGX], "deg,v")


@pytest.mark.parametrize(
    ("content", "arguments", "words"),
    [
        ("", (), "no numeric rows"),
        ("a,b\n", (), "no numeric rows"),
        ("deg,v\n1,2\nx,y\n", (), "line 3: not numbers"),
        ("deg,v\n1,2\n1,2,3\n", (), "line 3: 3 columns where 2 go"),
        ("deg\n1\n2\n", (), "one column is not enough"),
        (GOOD, ("--angle", "phi"), "no column 'phi'; there are deg, v"),
        (GOOD, ("--values", "7"), "no column '7'"),
        ("a,v\n0.1,1\n0.2,2\n0.3,4\n0.4,3\n0.5,3\n", (), "degrees, radians or cosines"),
        (GOOD, ("--angle-unit", "gradians"), "unknown angle unit"),
        ("deg,v\n1,2\n100,2\n", (), "outside 0 to 90"),
        ("cos,v\n1,2\n-0.5,2\n", (), "outside 0 to 1"),
        ("deg,v\n-3,2\n10,2\n", (), "outside 0 to 90"),
        ("deg,v\n1,2\n2,3\n3,4\n", (), "too few"),
        ("deg,v\n" + "".join(f"{k},1\n" for k in range(20)), (), "all values are equal"),
        ("deg,v\n1,nan\n", (), "no row with finite numbers"),
        (b"deg,v\n1,\xb52\n", (), "not UTF-8 text (byte 9)"),
        (b"\xff\xfe1\x002\x00", (), "one column is not enough"),
        ("#DIM 2 3\n#PARAM_IN COS_TH\n1 2 3 4 5\n", (), "2 inputs, where COS_TH has 1"),
        ("#DIM 1 3\n#PARAM_IN RUSIN_TH\n1 2 3 4\n", (), "parametrization"),
        ("#DIM 1 3\n#PARAM_IN COS_TH\n1 2\n", (), "do not hold 1 + 3"),
        (GOOD, ("--to", "gx"), "did you mean ggx"),
        (GOOD, ("--loss", "cubic"), "'cubic' is not one of"),
        (GOOD, ("--max-angle", "0"), "--max-angle"),
        (GOOD, ("--tolerance", "-1"), "--tolerance"),
        (GOOD, ("--gamma", "0"), "1e-06 ≤ γ"),
        (GOOD, ("--angle", "²"), "no column"),
        ("deg,v\n" + "".join(f"{k},{k}\n" for k in range(20)), (), "no lobe to fit"),
        ("#DIM 1 3\n#PARAM_IN COS_TH\n1 1 1 1\n", ("--angle", "2"), "choose no columns"),
        (GOOD, ("--png", "/nonexistent/a.png"), "cannot write"),
        (GOOD, ("--output", "/nonexistent/a.csv"), "cannot write"),
    ],
)
def test_bad_data(tmp_path, content, arguments, words):
    path = tmp_path / "data.csv"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    status, out, err = run("fit", path, *arguments)
    assert (status, out) == (2, "")
    assert words in err
    assert err.count("\n") == 1


def test_nothing_is_written_over_or_left_behind(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text(GOOD)
    for option in ("--output", "--png"):
        status, out, err = run("fit", path, "--to", "ggx", option, path)
        assert (status, out) == (2, "")
        assert "is the input; write to another file" in err
    assert path.read_text() == GOOD
    picture = tmp_path / "a.png"
    status, _, _ = run("fit", path, "--to", "ggx", "--png", picture, "--output", "/proc/x/y")
    assert status == 2
    assert not picture.exists()


def test_full_precision_in_csv(tmp_path):
    path, out = tmp_path / "a.csv", tmp_path / "fits.csv"
    path.write_text(GOOD)
    assert run("fit", path, "--to", "ggx", "--output", out)[0] == 0
    with out.open(newline="") as file:
        (row,) = csv.DictReader(file)
    assert len(row["scale"]) > 12
    assert float(row["scale"]) == pytest.approx(2, rel=1e-9)


def test_missing_file(tmp_path):
    status, out, err = run("fit", tmp_path / "none.csv")
    assert (status, out) == (2, "")
    assert "cannot read" in err
    assert run("fit", tmp_path)[0] == 2
