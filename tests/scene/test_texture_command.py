"""``mdfconv texture`` as a process."""

import os
import signal
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from mdfconv.scene import TextureRule, convert_texture
from tests.cli.runner import COMMAND, run, run_on_terminal
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
    kept = ": blinn-phong:exponent to ggx:roughness, keeps the light"
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
        ({}, ("--channel", "a"), "no channel 'a'"),
        ({}, ("--to-channel", "x"), "no channel 'x'"),
        ({}, ("--factor", "0"), "above 0"),
        ({}, ("--exponent-min", "1000"), "below the largest"),
        ({}, ("--log2-offset", "1"), "--log2-offset goes with blinn-phong:log2"),
        ({"source": "ggx"}, ("--exponent-min", "1"), "--exponent-min goes with blinn-phong:exp"),
        ({"source": "blinn-phong:obj2gltf"}, (), "texels of blinn-phong:obj2gltf are is not known"),
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


GLOSS = "--from", "ggx:glossiness", "--to", "ggx:roughness"


def names_in(folder):
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*"))


@pytest.fixture
def unity(tmp_path):
    """A picture with a ramp in alpha, and others beside it."""
    ramp = np.tile(np.arange(256, dtype=np.uint8), (8, 1))
    texels = np.dstack([np.full_like(ramp, 200), ramp // 3, ramp // 2, ramp])
    (tmp_path / "maps").mkdir()
    Image.fromarray(texels).save(tmp_path / "maps" / "unity.png")
    Image.fromarray(texels[::-1]).save(tmp_path / "maps" / "b.tga")
    Image.fromarray(ramp).save(tmp_path / "maps" / "c.png")
    (tmp_path / "maps" / "notes.txt").write_text("no picture")
    return tmp_path / "maps" / "unity.png"


def test_a_channel_moves_and_the_line_says_which(unity):
    output = unity.with_name("orm.png")
    status, out, err = run(
        *("texture", unity, "-o", output, "--channel", "a", "--to-channel", "g", *GLOSS)
    )
    assert (status, out) == (0, "")
    assert err.splitlines()[-1] == (
        f"mdfconv: wrote {output}: green from alpha (which stays as it is), ggx:glossiness to "
        "ggx:roughness, the same lobes"
    )
    with Image.open(unity) as given, Image.open(output) as found:
        given, found = np.asarray(given), np.asarray(found)
    assert np.array_equal(found[..., 1], 255 - given[..., 3])
    assert np.array_equal(found[..., [0, 2, 3]], given[..., [0, 2, 3]])


def test_into_another_picture_that_is_not_written_over(unity):
    base, output = unity.with_name("c.png"), unity.with_name("new.png")
    line = "texture", unity, "--channel", "a", "--to-channel", "l", "--into", base, *GLOSS, "-o"
    before = base.read_bytes()
    status, _, err = run(*line, base, "--force")
    assert (status, err) == (2, f"mdfconv: {base} is the input; write to another file\n")
    assert run(*line, output)[0] == 0
    assert base.read_bytes() == before
    with Image.open(output) as found:
        assert np.array_equal(np.asarray(found)[0], 255 - np.arange(256))
    status, _, err = run("texture", unity.parent, "--into", base, *GLOSS, "-o", "out/")
    assert (status, err) == (2, "mdfconv: --into goes with one texture, not 4\n")


def test_a_factor_is_that_of_the_program(texture):
    status, _, err = run(*arguments(texture, source="ggx"), "--factor", "0.5")
    assert status == 0
    assert "ggx: 0.5 v to ggx:roughness" in err
    with Image.open(texture.parent / "rough.png") as found:
        expected = np.rint(255 * np.sqrt(0.5 * np.arange(256) / 255))
        assert np.array_equal(np.asarray(found)[0], expected)


@pytest.mark.parametrize("folder", [True, False])
def test_several_files_in_processes(unity, folder):
    maps, out = unity.parent, unity.parents[1] / "out"
    named = [maps] if folder else [maps / "*.png", maps / "b.tga"]
    status, text, err = run("texture", *named, "-o", f"{out}/", "--channel", "g", *GLOSS)
    assert (status, text) == (0, "")
    order = ["b.tga", "c.png", "unity.png"] if folder else ["c.png", "unity.png", "b.tga"]
    wrote = [line.split(": ")[1] for line in err.splitlines() if "wrote" in line]
    assert wrote == [f"wrote {out / name}" for name in order]
    assert f"note: {maps / 'c.png'}: 8 of 2048 texels are perfect mirrors" in err
    assert names_in(out) == sorted(order)
    for name in order:
        with Image.open(maps / name) as given, Image.open(out / name) as found:
            given, found = (np.asarray(each) for each in (given.convert("RGB"), found))
        assert np.array_equal(found[..., 1], 255 - given[..., 1])
        assert np.array_equal(found[..., 0], given[..., 0])


def test_all_are_written_or_none(unity):
    maps, out = unity.parent, unity.parents[1] / "out"
    (maps / "d.png").write_bytes(unity.read_bytes()[:100])
    line = "texture", maps, "-o", f"{out}/", "--channel", "g", *GLOSS
    status, text, err = run(*line)
    assert (status, text, err.count("\n")) == (2, "", 1)
    assert f"{maps / 'd.png'} is damaged" in err
    assert not out.exists()
    (maps / "d.png").unlink()
    out.mkdir()
    (out / "unity.png").write_bytes(b"old")
    status, _, err = run(*line)
    assert (status, err.count("\n")) == (2, 1)
    assert "exists; it can be replaced (--force)" in err
    assert [(path.name, path.read_bytes()) for path in out.iterdir()] == [("unity.png", b"old")]
    assert run(*line, "--force")[0] == 0
    assert names_in(out) == ["b.tga", "c.png", "unity.png"]


def test_a_dry_run_writes_nothing(unity):
    maps, root = unity.parent, unity.parents[1]
    before = names_in(root)
    line = "texture", maps, "-o", f"{root}/out/", "--channel", "g", *GLOSS, "--dry-run"
    status, out, err = run(*line)
    assert (status, out) == (0, "")
    assert f"would write {root}/out/unity.png: green, ggx:glossiness to ggx:roughness" in err
    assert "perfect mirrors" in err
    one = "texture", unity, "-o", root / "x.png", "--channel", "g", *GLOSS, "--png", root / "h.png"
    assert run(*one, "--dry-run")[0] == 0
    assert run("texture", maps, "-o", f"{root}/out/", *GLOSS, "--dry-run")[0] == 2
    assert names_in(root) == before


def test_what_is_refused_of_several(unity):
    maps, root = unity.parent, unity.parents[1]
    Image.new("L", (8, 8), 128).save(maps / "c.jpg")
    for line, words in [
        ((maps, "-o", root / "x.png", "--channel", "g"), "4 files need a folder"),
        ((maps / "c.jpg", "-o", f"{root}/out/", "--channel", "g"), "c.jpg is a JPEG"),
        ((maps, "-o", f"{root}/out/", "--channel", "g", "--lossy"), "named for two results"),
        ((maps / "*.gif", "-o", f"{root}/out/"), "No such file"),
        ((root, "-o", f"{root}/out/"), "has no file that is a PNG, TIFF, TGA or OpenEXR"),
        ((maps, "-o", f"{root}/out/", "--png", root / "h.png"), "--png goes with one texture"),
    ]:
        status, out, err = run("texture", *line, *GLOSS)
        assert (status, out, err.count("\n")) == (2, "", 1), line
        assert words in err
    assert not (root / "out").exists()
    line = "texture", maps / "c.jpg", unity, "-o", f"{root}/out/", "--channel", "g", "--lossy"
    assert run(*line, *GLOSS)[0] == 0
    assert names_in(root / "out") == ["c.png", "unity.png"]


def test_lost_levels_are_told_with_what_keeps_them(texture):
    rough = texture.with_name("a.png")
    Image.fromarray(np.tile(np.arange(11, 256, dtype=np.uint8), (8, 1))).save(rough)
    line = "texture", rough, "-o", texture.with_name("n.png"), "--from", "ggx:roughness", "--to"
    target = "blinn-phong:exponent", "--exponent-max", "10000000"
    kept = "levels remain; --depth 16 or --dither keep the gradient"
    status, _, err = run(*line, *target, "--force")
    assert status == 0
    with Image.open(texture.with_name("n.png")) as found:
        left = len(np.unique(np.asarray(found)))
    assert kept in err
    count, _, total = err.split(kept)[0].split()[-3:]
    assert int(count) == left
    assert left < int(total) / 2
    for more in (("--depth", "16"), ("--dither",)):
        assert "levels remain" not in run(*line, *target, *more, "--force")[2]
    assert "levels remain" not in run(*line, "ggx:alpha", "--force")[2]


def test_ending_it_leaves_nothing(unity):
    maps, out = unity.parent, unity.parents[1] / "out"
    out.mkdir()
    texels = np.random.default_rng(0).integers(0, 65536, (2000, 1000), np.uint16)
    for name in ("d.png", "e.png", "f.png"):
        Image.fromarray(texels).save(maps / name)
    line = "texture", maps, "-o", out, "--channel", "g", "--to-channel", "g", *GLOSS
    child = subprocess.Popen([*COMMAND, *map(str, line)], stderr=subprocess.PIPE)
    while not list(out.iterdir()) and child.poll() is None:
        time.sleep(0.01)
    child.send_signal(signal.SIGTERM)
    assert child.wait(60) == 128 + signal.SIGTERM
    assert child.stderr.read() == b""
    assert not list(out.iterdir())
    child.stderr.close()


CHILDREN = "/proc/{0}/task/{0}/children"


@pytest.mark.skipif(not Path(CHILDREN.format(os.getpid())).exists(), reason="asks for children")
def test_workers_end_with_what_was_killed(unity):
    """What is killed tells its workers nothing."""
    for number in range(4):
        Image.fromarray(np.zeros((3000, 3000), np.uint8)).save(unity.with_name(f"g{number}.png"))
    files = [str(unity.with_name(f"g{number}.png")) for number in range(4)]
    out = f"{unity.parent / 'out'}/"
    child = subprocess.Popen([*COMMAND, "texture", *files, "-o", out, *GLOSS])
    children = Path(CHILDREN.format(child.pid))
    deadline = time.monotonic() + 60
    while not (workers := children.read_text().split()) and time.monotonic() < deadline:
        time.sleep(0.01)
    child.kill()
    child.wait(60)
    assert workers
    while any(map(_runs, workers)) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not any(map(_runs, workers))


def _runs(worker):
    """Return whether a process is there and has not ended."""
    try:
        return " Z " not in Path(f"/proc/{worker}/stat").read_text()
    except OSError:
        return False
