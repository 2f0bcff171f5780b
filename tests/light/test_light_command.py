"""`mdfconv light` and `--metric light:FILE`, as users run them."""

import csv
import io
import json

import numpy as np
import OpenImageIO
import pytest

import mdfconv
from mdfconv.fitting.metrics import metric_named
from tests.cli.runner import run, run_on_terminal
from tests.light.maps import room, write_map


@pytest.fixture(scope="module")
def lamp(tmp_path_factory):
    return write_map(tmp_path_factory.mktemp("lights") / "lamp.exr", room())


def test_the_answer_is_that_of_the_metric(lamp):
    status, out, err = run("light", lamp, "--m-b", "0.1", "--m-b", "0.3", "--format", "json")
    assert (status, err) == (0, "")
    report = json.loads(out)
    assert report["map"] == str(lamp)
    assert 0 <= report["softness"] <= 1
    assert [row["l"] for row in report["spectrum"]] == list(range(1, 32))
    for row in report["conversions"]:
        for name, metric in [
            ("light", f"light:{lamp}"), ("energy", "energy"), ("environment", "environment"),
            ("display", "display"),
        ]:  # fmt: skip
            best = mdfconv.convert(row["m_b"], "beckmann", "ggx", "fit", metric=metric)
            assert row[name] == pytest.approx(best, rel=1e-9)
        assert row["ratio"] == pytest.approx(row["light"] / row["m_b"])


def test_spectrum_and_picture(lamp, tmp_path):
    names = tmp_path / "spectrum.csv", tmp_path / "spectrum.png"
    status, out, err = run("light", lamp, "--csv", names[0], "--png", names[1])
    assert status == 0
    assert out.startswith("m_b,light,ratio,energy,environment,display\n0.05,")
    assert "of the way from a sun" in err
    rows = list(csv.DictReader(io.StringIO(names[0].read_text())))
    assert list(rows[0]) == ["l", "c_l", "power_law"]
    assert names[1].read_bytes().startswith(b"\x89PNG")


def test_on_a_terminal(lamp):
    status, text = run_on_terminal("light", lamp, COLUMNS="80", NO_COLOR="1")
    assert status == 0
    assert "Fine detail: C_l falls like" in text


@pytest.mark.parametrize("ending", ["hdr", "tif"])
def test_other_formats(ending, lamp, tmp_path):
    path = write_map(tmp_path / f"lamp.{ending}", room())
    ours, theirs = (
        mdfconv.convert(0.2, "beckmann", "ggx", metric=f"light:{name}") for name in (path, lamp)
    )
    assert ours == pytest.approx(theirs, rel=1e-2)


def bad(change):
    luminance = room()
    change(luminance)
    return luminance


BAD_MAPS = {
    "shape of 2:1, not 64×64": np.ones((64, 64)),
    "takes 64 rows, not 32": room(32),
    "1 of 8192 texels are NaN or infinite": bad(lambda m: m.__setitem__((3, 4), np.nan)),
    "2 of 8192 texels are NaN or infinite": bad(lambda m: m.__setitem__((3, slice(2)), np.inf)),
    "1 of 8192 texels are negative": bad(lambda m: m.__setitem__((30, 100), -1.0)),
    "the map is black": np.zeros((64, 128)),
    "the map is of one colour": np.ones((64, 128)),
}


@pytest.mark.parametrize("reason", BAD_MAPS)
def test_maps_that_are_none(reason, tmp_path):
    path = write_map(tmp_path / "bad.exr", BAD_MAPS[reason])
    status, out, err = run("light", path, "--csv", tmp_path / "spectrum.csv")
    assert (status, out) == (2, "")
    assert err.count("\n") == 1
    assert reason in err
    assert not (tmp_path / "spectrum.csv").exists()


@pytest.mark.parametrize("kept", [0, 7, 300, 0.5, 0.99])
def test_truncated(kept, lamp, tmp_path):
    content = lamp.read_bytes()
    size = kept if isinstance(kept, int) else int(kept * len(content))
    path = tmp_path / "cut.exr"
    path.write_bytes(content[:size])
    status, out, err = run("light", path)
    assert (status, out) == (2, "")
    assert err.count("\n") == 1
    assert f"cannot read {path}" in err


def test_files_that_are_no_pictures(tmp_path):
    (tmp_path / "notes.exr").write_text("not a picture\n")
    for path in ("missing.exr", ".", "notes.exr"):
        status, out, err = run("light", tmp_path / path)
        assert (status, out) == (2, "")
        assert err.count("\n") == 1
        assert "cannot read" in err


def test_overshoot_of_a_filter_is_taken_as_it_is(tmp_path):
    luminance = room()
    luminance[18, 40:44] = -2.0  # beside the lamp of 20
    assert run("light", write_map(tmp_path / "rings.exr", luminance))[0] == 0


def test_the_metric_in_other_commands(lamp, tmp_path):
    metric = ("--metric", f"light:{lamp}")
    pair = ("--from", "blinn-phong", "--to", "ggx:roughness")
    wanted = mdfconv.convert(100, *pair[1::2], metric=metric[1])
    _, plain, _ = run("convert", *pair, *metric, "--format", "plain", "100")
    assert float(plain) == pytest.approx(wanted, rel=1e-9)
    (tmp_path / "one.mtl").write_text("newmtl one\nNs 100\n")
    made = run("mtl", tmp_path / "one.mtl", "-o", tmp_path / "out.mtl", *metric)
    assert made[0] == 0
    assert f"Pr {wanted:.8g}" in (tmp_path / "out.mtl").read_text()
    code = run("formula", *pair, *metric, "--range", "50:200", "--lang", "python")[1]
    assert f"light:{lamp}" in code
    assert run("recommend", "--from", "beckmann", "0.2", *metric)[0] == 0
    status, _, err = run("plot-error", "--m-b", "0.2", *metric, "--output", tmp_path)
    assert status == 2
    assert "has no curves over β" in err


def test_a_light_has_a_file():
    status, _, err = run("convert", "--from", "beckmann", "--to", "ggx", "--metric", "light", "0.2")
    assert status == 2
    assert "needs an environment map; light:FILE" in err


def test_nothing_is_better_than_the_fit_under_a_light(lamp):
    metric = f"light:{lamp}"
    for target in ("ggx", "gauss", "schlick", "sawicki"):
        errors = {
            method.name: mdfconv.explain(0.2, "beckmann", target, method.name, metric=metric)[0]
            for method in mdfconv.list_methods()
            if method.covers(*map(mdfconv.distribution, ("beckmann", target)), metric_named(metric))
        }
        assert all(errors["fit"].rmse <= other.rmse * (1 + 1e-9) for other in errors.values())


def test_a_part_of_a_picture_is_none(tmp_path):
    path = tmp_path / "crop.exr"
    shape = OpenImageIO.ImageSpec(128, 64, 3, "float")
    shape.full_width, shape.full_height = 512, 256
    output = OpenImageIO.ImageOutput.create(str(path))
    output.open(str(path), shape)
    output.write_image(np.ones((64, 128, 3), np.float32))
    output.close()
    status, out, err = run("light", path)
    assert (status, out) == (2, "")
    assert "a part of a larger picture" in err


def test_what_has_no_best_fit(lamp):
    for m_b, reason in (("1e-300", "has no best ggx under"), ("0", "m_B > 0")):
        status, out, err = run("light", lamp, "--m-b", m_b)
        assert (status, out) == (2, "")
        assert err.count("\n") == 1
        assert reason in err


def test_names_of_maps(tmp_path):
    odd = write_map(tmp_path / "a:b\nc # %d.exr", room())
    assert run("light", odd)[0] == 0
    code = run(
        "formula", "--from", "beckmann", "--to", "ggx", "--metric", f"light:{odd}", "--range",
        "0.1:0.4",
    )[1]  # fmt: skip
    assert all(line.startswith(("//", "float", "    ", "}")) for line in code.splitlines())
    status, _, err = run("light", "x" * 300 + ".exr")
    assert (status, err.count("\n")) == (2, 1)
    assert "cannot read" in err
    assert run("convert", "--from", "ggx", "--to", "gauss", "--metric", "", "0.2")[0] == 2
