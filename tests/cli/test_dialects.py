"""Dialects on the command line."""

import csv
import json

import pytest

from tests.cli.runner import run, run_on_terminal


def test_convert():
    words = "--from", "blinn-phong:obj2gltf", "--to", "ggx:roughness", "0.9"
    status, out, err = run("convert", *words, "--metric", "environment")
    assert (status, err) == (0, "")
    assert float(out) == pytest.approx(0.331488, abs=1e-6)


def test_specular():
    words = "convert", "--from", "blinn-phong:vtk-gltf", "--to", "blinn-phong", "0.5"
    assert run(*words, "--specular", "0.5")[:2] == (0, "10\n")
    status, out, err = run(*words)
    assert (status, out) == (2, "")
    assert "--specular" in err
    status, out, err = run("convert", "--from", "ggx", "--to", "beckmann", "--specular", "1", "0.5")
    assert (status, out) == (2, "")
    assert "neither ggx nor beckmann depends on a specular weight" in err


def test_what_is_clamped():
    words = "--from", "blinn-phong:fbx", "--to", "ggx:roughness"
    status, out, err = run("convert", *words, "0")
    assert (status, out) == (2, "")
    assert "r = 0 is any N ≥ 100" in err
    status, out, err = run("convert", "--from", "blinn-phong", "--to", "blinn-phong:fbx", "400")
    assert (status, out) == (0, "0\n")
    assert "r = 0 is any N ≥ 100" in err


def test_list():
    status, out, _ = run("list", "--encodings", "--format", "json", "--metric", "energy")
    records = {record["encoding"]: record for record in json.loads(out)}
    assert status == 0
    record = records["blinn-phong:obj2gltf"]
    assert record["roughness_100"] == pytest.approx(0.9)
    assert record["rmse_10"] > records["blinn-phong:peak"]["rmse_10"] > 0
    assert record["clamped"] == "r = 0 is any N ≥ 1000"
    assert records["ggx:pbrt-v3"]["rmse_10"] is None
    # In a pipe, too, the rules: names alone are asked for.
    assert next(csv.DictReader(run("list", "--encodings")[1].splitlines())) == {
        **dict.fromkeys(next(iter(records.values())), ""),
        **{"encoding": "beckmann:roughness", "formula": "α = r²", "range": "0 < r ≤ 1"},
        "specular": "no",
        "texels": "same",
    }
    assert run("list", "--encodings", "--format", "plain")[1].split()[:2] == [
        "beckmann:roughness",
        "beckmann:glossiness",
    ]
    status, text = run_on_terminal("list", "--encodings", COLUMNS="100")
    assert status == 0
    assert "mirror" in text
    status, _, err = run("list", "--metric", "energy")
    assert status == 2
    assert "--encodings" in err


def test_formula():
    status, out, err = run(
        "formula", "--from", "blinn-phong:blender-obj", "--to", "ggx:roughness", "--lang", "c"
    )
    assert (status, err) == (0, "")
    assert "blinn-phong:blender-obj" in out
