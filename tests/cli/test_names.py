"""Names of distributions and of stored forms, in every option of every command that takes one."""

import csv
import json
import re

import numpy as np
import pytest
import typer
from PIL import Image

import mdfconv
from mdfconv.cli import app
from tests.cli.runner import run

GROUP = typer.main.get_command(app)
# What a command needs besides the option.
FIT = ("lobe.csv", "--format", "csv")
ERRORS = ("--m-b", "0.2", "--no-png", "--output", "out")
SMALL = ("--size", "32", "--dpi", "40", "--output", "out")
OPTIONS = {
    ("convert", "--from"): ("--to", "beckmann", "0.2"),
    ("convert", "--to"): ("--from", "beckmann", "0.2"),
    ("texture", "--from"): ("in.png", "-o", "out.png", "--to", "beckmann"),
    ("texture", "--to"): ("in.png", "-o", "out.png", "--from", "beckmann"),
    ("gltf", "--from"): ("in.gltf", "-o", "out.gltf"),
    ("gltf", "--to"): ("in.gltf", "-o", "out.gltf", "--from", "beckmann"),
    ("formula", "--from"): ("--to", "beckmann", "--tolerance", "0.1"),
    ("formula", "--to"): ("--from", "beckmann", "--tolerance", "0.1"),
    ("compare", "--from"): ("0.5", "--to", "beckmann", *SMALL),
    ("compare", "--to"): ("0.2", *SMALL),
    ("fit", "--to"): FIT,
    ("plot-error", "--mdf"): ERRORS,
    ("plot-error", "--reference"): ERRORS,
    ("recommend", "--from"): ("0.2",),
    ("stability", "--mdf"): ("--part", "kernels"),
    ("bench", "--reference"): ("--quick", "--parameter", "0.2"),
    ("bench", "--from"): ("--quick", "--to", "beckmann"),
    ("bench", "--to"): ("--quick",),
    ("mitsuba", "--from"): ("in.xml", "-o", "out.xml"),
    ("mitsuba", "--to"): ("in.xml", "-o", "out.xml"),
    ("furnace", "--brdf"): ("0.2", "--points", "3"),
}
# Options of these names whose words are not distributions, or only some of them.
OTHERS = {("mtl", "--to"), ("mtl", "--from")}
# What takes a distribution as such: its parameter is not asked for there, and not printed.
WITHOUT_FORMS = {
    ("plot-error", "--reference"), ("stability", "--mdf"), ("bench", "--from"), ("bench", "--to"),
    ("mitsuba", "--to"),
}  # fmt: skip
# Their runs take seconds, whatever the name.
SLOW = {("bench", "--reference"), ("bench", "--from"), ("bench", "--to")}
MEANT = {
    "roughness": "ggx:roughness",
    "glTF": "ggx:roughness",
    "Perceptual_Roughness": "ggx:roughness",
    "glossiness": "ggx:glossiness",
    "shininess": "phong",  # blinn-phong, or the furnace's phong
    "ns": "phong",
    "bekmann": "beckmann",
    "ggxx": "ggx",
    "ggx:rougness": "roughness",
    "ggxx:roughness": "ggx",
}


@pytest.fixture
def files(tmp_path):
    beta = np.linspace(0, 1.4, 40)
    lobe = mdfconv.distribution("ggx").unit(beta, 0.2)
    rows = "\n".join(f"{b},{value}" for b, value in zip(beta, lobe, strict=True))
    (tmp_path / "lobe.csv").write_text(f"angle_radians,value\n{rows}\n")
    Image.fromarray(np.full((2, 2), 128, np.uint8)).save(tmp_path / "in.png")
    material = {"pbrMetallicRoughness": {"roughnessFactor": 0.5}}
    (tmp_path / "in.gltf").write_text(
        json.dumps({"asset": {"version": "2.0"}, "materials": [material]})
    )
    (tmp_path / "in.xml").write_text(
        '<scene version="3.0.0"><bsdf type="roughconductor">'
        '<float name="alpha" value="0.2"/></bsdf></scene>\n'
    )
    return tmp_path


def asked(option, name, folder):
    command, flag = option
    return run(command, flag, name, *OPTIONS[option], cwd=folder)


def test_no_option_is_left_out():
    context = typer.Context(GROUP)
    taking = {
        (command, flag)
        for command in GROUP.list_commands(None)
        for option in GROUP.get_command(context, command).get_params(context)
        for flag in option.opts
        if flag in ("--from", "--to", "--mdf", "--reference", "--brdf")
        and type(option.type).__name__ == "StringParamType"
    }
    assert taking - OTHERS == set(OPTIONS)


@pytest.mark.parametrize("option", OPTIONS, ids=" ".join)
@pytest.mark.parametrize(("word", "meant"), MEANT.items(), ids=MEANT)
def test_an_unknown_name_says_what_was_meant(option, word, meant, files):
    before = {path: path.read_bytes() for path in files.iterdir()}
    status, out, err = asked(option, word, files)
    assert (status, out) == (2, "")
    if option in WITHOUT_FORMS and ":" in word:
        meant = "ggx"
    assert re.search(f"did you mean .*{meant}", err), err
    assert err.count("\n") == 1
    assert before == {path: path.read_bytes() for path in files.iterdir()}


@pytest.mark.parametrize("option", sorted(WITHOUT_FORMS), ids=" ".join)
def test_where_a_form_means_nothing(option, files):
    status, out, err = asked(option, "ggx:roughness", files)
    assert (status, out) == (2, "")
    assert err == (
        "mdfconv: 'ggx:roughness' is a stored form of a parameter, and here a distribution is "
        "meant; did you mean ggx?\n"
    )


@pytest.mark.parametrize("option", sorted(OPTIONS.keys() - WITHOUT_FORMS - SLOW), ids=" ".join)
def test_a_form_is_taken(option, files):
    status, _, err = asked(option, "ggx:roughness", files)
    assert status == 0, err


@pytest.mark.parametrize(
    "option", sorted(OPTIONS.keys() - SLOW - {("furnace", "--brdf")}), ids=" ".join
)
def test_an_alias_is_taken(option, files):
    status, _, err = asked(option, "Trowbridge_Reitz", files)
    assert status == 0, err


@pytest.mark.parametrize(
    "option",
    [
        ("convert", "--to"), ("formula", "--to"), ("compare", "--to"), ("fit", "--to"),
        ("plot-error", "--mdf"), ("recommend", "--from"),
    ],
    ids=" ".join,
)  # fmt: skip
def test_what_phong_is_taken_for_is_said(option, files):
    status, _, err = asked(option, "phong", files)
    assert status == 0
    assert err.count("note: phong is taken for Blinn's exponent") == 1


@pytest.mark.parametrize(
    ("word", "meant"),
    [("sun", "energy"), ("Sky", "environment"), ("sRGB", "display"), ("shape", "unit")],
)
def test_a_metric_is_known_by_what_it_keeps(word, meant):
    status, out, err = run("convert", "--from", "ggx", "--to", "gauss", "--metric", word, "0.2")
    assert (status, out) == (2, "")
    assert err == f"mdfconv: unknown metric '{word}'; did you mean {meant}?\n"


def records(*words, cwd):
    status, out, _ = run(*words, "--format", "csv", cwd=cwd)
    assert status == 0
    return list(csv.DictReader(out.splitlines()))


def test_fit_prints_the_stored_number(files):
    noisy = (files / "lobe.csv").read_text().replace(",1.0\n", ",1.01\n")
    (files / "lobe.csv").write_text(noisy)
    names = "ggx:roughness", "ggx", "ggx:glossiness", "beckmann"
    words = [word for name in names for word in ("--to", name)]
    rows = {row["distribution"]: row for row in records("fit", "lobe.csv", *words, cwd=files)}
    assert rows.keys() == set(names)
    alpha, roughness, gloss = (
        float(rows[name]["parameter"]) for name in ("ggx", "ggx:roughness", "ggx:glossiness")
    )
    assert roughness**2 == pytest.approx(alpha)
    assert (1 - gloss) ** 2 == pytest.approx(alpha)
    # α = r² and σ_α = 2 r σ_r.
    errors = (rows[name]["parameter_stderr"] for name in ("ggx", "ggx:roughness"))
    error, of_roughness = map(float, errors)
    assert error > 0
    assert 2 * roughness * of_roughness == pytest.approx(error, rel=1e-6)


def test_plot_error_prints_the_stored_number(files):
    words = "plot-error", *ERRORS, "--mdf", "ggx:roughness", "--mdf", "ggx", "--mdf", "sawicki"
    rows = {row["distribution"]: row for row in records(*words, cwd=files)}
    assert list(rows) == ["ggx:roughness", "ggx", "sawicki"]
    roughness, alpha = (float(rows[name]["parameter"]) for name in ("ggx:roughness", "ggx"))
    assert roughness**2 == pytest.approx(alpha)


def test_the_furnace_takes_a_stored_form():
    stored, plain = (
        run("furnace", "--brdf", brdf, number, "--points", 3)
        for brdf, number in (("ggx:roughness", "0.5"), ("ggx", "0.25"))
    )
    assert stored == plain
    assert stored[0] == 0
    status, out, err = run("furnace", "--brdf", "modified-phong:roughness", "0.5")
    assert (status, out) == (2, "")
    assert "has no stored form" in err


@pytest.mark.parametrize(
    ("words", "meant"),
    [
        (("convert", "--from", "ggx", "--to", "gauss", "0,25"), "0.25"),
        (("convert", "--from", "blinn-phong:exponent", "--to", "ggx", "20"), "blinn-phong"),
        (("convert", "--from", "ggx", "--to", "gtr", "--gamma", "200%", "0.2"), "2"),
        (("convert", "--from", "blinn-phong:vtk-gltf:50%", "--to", "ggx", "0.2"), "0.5"),
        (("convert", "--from", "ggx", "--to", "gauss", "--metric", "display:400%", "0.2"), "4"),
        (("convert", "--from", "ggx", "--to", "gauss", "20%"), "0.2"),
        (("formula", "--from", "ggx", "--to", "gauss", "--range", "1%:80%"), "0.01:0.8"),
        (("formula", "--from", "ggx", "--to", "gauss", "--tolerance", "1%"), "0.01"),
        (("fit-table", "--sweep", "1%:80%:3"), "0.01:0.8:3"),
        (("fit-table", "--m-b", "20%"), "0.2"),
        (("fit", "lobe.csv", "--fresnel", "ior:150%"), "1.5"),
        (("light", "in.png", "--m-b", "20%"), "0.2"),
        (("compare", "20%"), "0.2"),
        (("recommend", "--from", "ggx", "20%"), "0.2"),
        (("furnace", "20%"), "0.2"),
        (("bench", "--parameter", "20%"), "0.2"),
    ],
)
def test_a_number_says_which_was_meant(words, meant, files):
    status, out, err = run(*words, cwd=files)
    assert (status, out) == (2, "")
    assert f"did you mean {meant}?" in err.lower(), err
    assert err.count("\n") == 1
