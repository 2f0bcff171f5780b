"""``mdfconv texture`` as a process."""

import numpy as np
import pytest
from PIL import Image

from mdfconv.scene import TextureRule, convert_texture
from tests.cli.runner import run, run_on_terminal
from tests.scene.pictures import PROFILE


@pytest.fixture
def texture(tmp_path):
    texels = np.tile(np.arange(256, dtype=np.uint8), (8, 1))
    Image.fromarray(texels).save(tmp_path / "gloss.png")
    return tmp_path / "gloss.png"


def arguments(texture, output="rough.png", source="blinn-phong:exponent", target="ggx:roughness"):
    return "texture", texture, "-o", texture.parent / output, "--from", source, "--to", target


def test_converts_and_counts(texture):
    histogram = texture.parent / "h.png"
    options = "--metric", "energy", "--depth", "16", "--png", histogram
    status, out, err = run(*arguments(texture), *options)
    assert (status, out) == (0, "")
    lines = err.splitlines()
    assert lines[0].startswith("mdfconv: note: 8 of 2048 texels are as rough as can be")
    places = texture.parent / "rough.png", histogram
    kept = ": ggx:roughness, keeps the light"
    assert lines[1:] == [f"mdfconv: wrote {places[0]}{kept}", f"mdfconv: wrote {places[1]}"]
    rule = TextureRule("blinn-phong:exponent", "ggx:roughness", metric="energy")
    with Image.open(texture) as given, Image.open(texture.parent / "rough.png") as found:
        expected = convert_texture(np.asarray(given), rule, depth=16)
        assert np.array_equal(np.asarray(found), expected)
    with Image.open(histogram) as drawn:
        assert drawn.size == (1080, 810)


def test_options_reach_the_rule(texture):
    status, _, err = run(
        *arguments(texture, target="blinn-phong:log2"),
        *("--exponent-max", 256, "--log2-scale", 8, "--dither", "--channel", "grey"),
    )
    assert status == 0
    assert "8 of 2048 texels are clamped" not in err
    with Image.open(texture.parent / "rough.png") as found:
        # N = 256 v, v' = log2(N) / 8
        expected = 255 * np.log2(256 * np.arange(1, 256) / 255) / 8
        assert np.abs(np.asarray(found)[:, 1:] - expected.clip(0)).max() <= 1


def test_grey_stored_as_colour(texture):
    with Image.open(texture) as image:
        image.convert("RGB").save(texture, icc_profile=PROFILE)
    status, _, err = run(*arguments(texture), "--channel", "rgb")
    assert status == 0
    assert "note: " in err
    assert "a colour profile (sRGB built-in), which is not for data" in err
    with Image.open(texture.parent / "rough.png") as found:
        red, green, blue = (np.asarray(band) for band in found.split())
        assert found.info["icc_profile"] == PROFILE
    assert np.array_equal(red, green)
    assert np.array_equal(red, blue)
    assert len(np.unique(red)) > 50
    status, out, err = run(*arguments(texture, output="new.png"), "--channel", "rg,")
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert not (texture.parent / "new.png").exists()


@pytest.mark.parametrize(
    ("changed", "options", "words"),
    [
        ({}, ("--depth", "12"), "12"),
        ({}, ("--channel", "r"), "no channel 'r'"),
        ({}, ("--max-pixels", "100"), "more than the 100"),
        ({}, ("--png", "nowhere/h.png"), "nowhere"),
        ({"source": "blinn-phong"}, (), "blinn-phong:exponent or blinn-phong:log2"),
        ({"target": "ggx:rough"}, (), "roughness"),
        ({"output": "gloss.png"}, (), "is the input"),
        ({"output": "rough.jpg"}, (), "JPEG"),
    ],
)
def test_refusals(texture, changed, options, words):
    before = texture.read_bytes()
    status, out, err = run(*arguments(texture, **changed), *options)
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert words in err
    assert texture.read_bytes() == before
    assert [entry.name for entry in texture.parent.iterdir()] == ["gloss.png"]


def test_histogram_is_not_drawn_over_a_texture(texture):
    for name, words in (("gloss.png", "is the input"), ("rough.png", "is named for two results")):
        status, _, err = run(*arguments(texture), "--png", texture.parent / name)
        assert (status, err.count("\n")) == (2, 1)
        assert words in err


def test_on_a_terminal(texture):
    status, text = run_on_terminal(*arguments(texture))
    assert status == 0
    assert "wrote" in text
