"""Textures in files that are refused: in one line, with everything as it was."""

import os
import sys

import numpy as np
import pytest
from PIL import Image

from mdfconv import MdfconvError
from mdfconv.scene import TextureRule, convert_texture_file
from tests.scene.pictures import (
    picture,
    read,
    samples,
    write_exr,
    write_png,
    write_tiff,
)

RULE = TextureRule("ggx:roughness", "ggx:alpha")


def refused(folder):
    """Make files that are refused; yield source, output, options and words of the reason."""
    write_png(folder / "ok.png", samples(8, 8, 1, np.uint8))
    write_png(folder / "rgb.png", samples(8, 8, 3, np.uint8))
    write_exr(folder / "ok.exr", Y=np.ones((4, 4), np.float32))
    write_exr(folder / "rgb.exr", R=np.ones((4, 4), np.float32), N=np.ones((4, 4), np.uint32))
    (folder / "text.png").write_text("no picture")
    (folder / "empty.png").write_bytes(b"")
    (folder / "directory.png").mkdir()
    (folder / "named.tif").write_bytes((folder / "ok.png").read_bytes())
    for name in ("ok.png", "ok.exr"):
        whole = (folder / name).read_bytes()
        (folder / f"half-{name}").write_bytes(whole[: len(whole) // 2])
    deep = write_png(folder / "deep.png", samples(40, 40, 3, np.uint16)).read_bytes()
    (folder / "half-deep.png").write_bytes(deep[: len(deep) // 2])
    deep = write_tiff(folder / "deep.tif", samples(40, 40, 3, np.uint16)).read_bytes()
    (folder / "half-deep.tif").write_bytes(deep[:4000])
    write_png(folder / "grey-alpha.png", samples(8, 8, 2, np.uint16))
    noise = samples(64, 64, 1, np.uint8)
    deflated = write_tiff(folder / "flat.tif", noise, compression="deflate").read_bytes()
    (folder / "hole.tif").write_bytes(deflated[:2000] + bytes(40) + deflated[2040:])
    picture(folder / "palette.png", "P")
    picture(folder / "bits.png", "1")
    picture(folder / "cmyk.tif", "CMYK")
    picture(folder / "float.tif", "F")
    picture(folder / "key.png", "L", transparency=3)
    picture(folder / "photo.jpg", "L")
    picture(folder / "photo.tif", "RGB", compression="jpeg")
    Image.new("L", (8, 8)).save(
        folder / "pages.tif", save_all=True, append_images=[Image.new("L", (8, 8))]
    )
    os.link(folder / "ok.png", folder / "hard.png")
    (folder / "soft.png").symlink_to("ok.png")
    out = "out.png"
    yield "nothing.png", out, {}, "No such file"
    yield "text.png", out, {}, "no PNG, TIFF or OpenEXR"
    yield "empty.png", out, {}, "no PNG, TIFF or OpenEXR"
    yield "directory.png", out, {}, "Is a directory"
    yield "named.tif", out, {}, "holds PNG, not what its name says"
    yield "half-ok.png", out, {}, "half-ok.png is damaged"
    yield "half-ok.exr", "out.exr", {}, "half-ok.exr is damaged"
    yield "half-deep.png", out, {"channel": "r"}, "half-deep.png is damaged"
    yield "half-deep.tif", out, {"channel": "r"}, "half-deep.tif is damaged"
    yield "hole.tif", out, {}, "hole.tif is damaged"
    yield "palette.png", out, {}, "palette"
    yield "grey-alpha.png", out, {"channel": "r"}, "save it as RGBA"
    yield "bits.png", out, {}, "mode 1"
    yield "cmyk.tif", out, {}, "CMYK"
    yield "float.tif", out, {}, "mode F"
    yield "key.png", out, {}, "transparent"
    yield "photo.jpg", out, {}, "or accept the losses"
    yield "photo.tif", out, {"channel": "r"}, "or accept the losses"
    yield "pages.tif", out, {}, "several pictures"
    yield "rgb.png", out, {}, "r, g, b; choose one channel"
    yield "rgb.png", out, {"channel": "a"}, "no channel 'a'"
    yield "rgb.exr", "out.exr", {"channel": "N"}, "integers"
    yield "ok.png", out, {"max_pixels": 63}, "allow 64 pixels"
    yield "ok.exr", "out.exr", {"max_pixels": 15}, "allow 16 pixels"
    yield "ok.png", "out.jpg", {}, "alter the values"
    yield "ok.png", "out.bmp", {}, "does not end in"
    yield "ok.png", "out.exr", {}, "holds integers"
    yield "ok.exr", "out.png", {}, "holds floats"
    yield "ok.exr", "out.exr", {"depth": 16}, "floats"
    yield "ok.png", "ok.png", {}, "same file"
    yield "ok.png", "hard.png", {}, "same file"
    yield "ok.png", "soft.png", {}, "same file"
    yield "ok.png", "directory.png", {}, "Is a directory"
    yield "ok.png", "nowhere/out.png", {}, "No such file or directory"
    yield "ok.png", "ok.png/out.png", {}, "Not a directory"


def test_refusals_are_one_line_and_leave_all_as_it_was(tmp_path, capfd):
    cases = list(refused(tmp_path))

    def everything():
        return {
            path.name: path.read_bytes() if path.is_file() else None for path in tmp_path.iterdir()
        }

    before = everything()
    for source, output, options, words in cases:
        with pytest.raises(MdfconvError) as caught:
            convert_texture_file(tmp_path / source, tmp_path / output, RULE, **options)
        message = str(caught.value)
        assert words in message, (source, message)
        assert "\n" not in message
        assert everything() == before, source
    assert capfd.readouterr() == ("", "")


def test_jpeg_and_large_pictures_when_asked_for(tmp_path):
    picture(tmp_path / "a.jpg", "L")
    convert_texture_file(tmp_path / "a.jpg", tmp_path / "b.png", RULE, lossy=True)
    assert read(tmp_path / "b.png").shape == (8, 8, 1)
    convert_texture_file(tmp_path / "b.png", tmp_path / "c.png", RULE, max_pixels=64)


def test_pillows_limit_is_the_default(tmp_path, monkeypatch):
    source = write_png(tmp_path / "a.png", samples(8, 8, 1, np.uint8))
    monkeypatch.setattr(Image, "MAX_IMAGE_PIXELS", 60)
    with pytest.raises(MdfconvError, match="more than the 60"):
        convert_texture_file(source, tmp_path / "b.png", RULE)


@pytest.mark.parametrize(
    ("package", "extra", "name"),
    [("OpenEXR", "exr", "a.exr"), ("pyvips", "rgb16", "a.png")],
)
def test_a_missing_package_is_named(tmp_path, monkeypatch, package, extra, name):
    write_png(tmp_path / "a.png", samples(8, 8, 3, np.uint16))
    write_exr(tmp_path / "a.exr", R=np.ones((4, 4), np.float32))
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(MdfconvError, match=rf"pip install 'mdfconv\[{extra}\]'"):
        convert_texture_file(tmp_path / name, tmp_path / f"b{name[1:]}", RULE, channel="r")


def test_an_old_output_survives_a_failure_and_gets_the_usual_permissions(tmp_path):
    source = write_png(tmp_path / "a.png", samples(8, 8, 1, np.uint8))
    output = tmp_path / "b.png"
    output.write_bytes(b"old")
    with pytest.raises(MdfconvError):
        convert_texture_file(source, output, RULE, channel="r")
    assert output.read_bytes() == b"old"
    convert_texture_file(source, output, RULE)
    mask = os.umask(0)
    os.umask(mask)
    assert output.stat().st_mode & 0o777 == 0o666 & ~mask
