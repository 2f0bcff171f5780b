"""Textures in files that are refused: in one line, with everything as it was."""

import os
import struct
import zlib

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
    grey, rgb = samples(8, 8, 1, np.uint8), samples(8, 8, 3, np.uint8)
    write_png(folder / "ok.png", grey)
    write_png(folder / "rgb.png", rgb)
    write_exr(folder / "ok.exr", Y=np.ones((4, 4), np.float32))
    numbers = np.full((4, 4), 1 << 24, np.uint32)
    write_exr(folder / "rgb.exr", R=np.ones((4, 4), np.float32), N=numbers)
    write_exr(folder / "two.exr", R=np.ones((4, 4), np.float32), G=np.ones((4, 4), np.float16))
    (folder / "text.png").write_text("no picture")
    (folder / "empty.png").write_bytes(b"")
    (folder / "empty.tga").write_bytes(b"")
    (folder / "directory.png").mkdir()
    (folder / "named.tif").write_bytes((folder / "ok.png").read_bytes())
    Image.fromarray(rgb).save(folder / "ok.tga")
    for name in ("ok.png", "ok.exr", "ok.tga"):
        whole = (folder / name).read_bytes()
        (folder / f"half-{name}").write_bytes(whole[: len(whole) // 2])
    deep = write_png(folder / "deep.png", samples(40, 40, 3, np.uint16)).read_bytes()
    (folder / "half-deep.png").write_bytes(deep[: len(deep) // 2])
    flat = write_tiff(folder / "flat.tif", samples(64, 64, 1, np.uint8), deflate=True).read_bytes()
    (folder / "hole.tif").write_bytes(flat[:2000] + bytes(40) + flat[2040:])
    picture(folder / "palette.tif", "P")
    picture(folder / "palette.tga", "P")
    palette = bytearray((folder / "palette.tga").read_bytes())
    palette[7] = 16  # bits of a colour
    (folder / "palette.tga").write_bytes(palette)
    picture(folder / "cmyk.tif", "CMYK")
    picture(folder / "float.tif", "F")
    picture(folder / "key.png", "L", transparency=3)
    picture(folder / "photo.jpg", "L")
    picture(folder / "photo.tif", "RGB", compression="jpeg")
    pages = [Image.new("L", (8, 8))]
    pages[0].save(folder / "pages.tif", save_all=True, append_images=pages)
    pages[0].save(folder / "pages.png", save_all=True, append_images=[Image.new("L", (8, 8), 9)])
    # 60 rows of which 7 are not there; 12 bits; with a sign; of 32 bits; white as zero
    write_tiff(folder / "strip.tif", samples(9, 60, 1, np.uint8), tags={279: [53 * 9]})
    write_tiff(folder / "strips.tif", samples(9, 4, 1, np.uint8), rows=2, tags={279: [18, 0]})
    write_tiff(folder / "far.tif", grey, tags={273: [4000]})
    write_tiff(folder / "few.tif", grey, tags={257: [16]}, deflate=True)
    write_tiff(folder / "12.tif", grey, tags={258: [12], 256: [5]})
    write_tiff(folder / "sign.tif", grey.astype(np.int16))
    write_tiff(folder / "32.tif", grey.astype(np.uint32))
    write_tiff(folder / "white.tif", grey.astype(np.uint16), tags={262: [0]})
    write_tiff(folder / "times.tif", samples(8, 8, 4, np.uint8), tags={338: [1]})
    os.link(folder / "ok.png", folder / "hard.png")
    (folder / "soft.png").symlink_to("ok.png")
    out = "out.png"
    yield "nothing.png", out, {}, "No such file"
    yield "text.png", out, {}, "no PNG, TIFF, TGA or OpenEXR"
    yield "empty.png", out, {}, "no PNG, TIFF, TGA or OpenEXR"
    yield "empty.tga", out, {}, "no PNG, TIFF, TGA or OpenEXR"
    yield "directory.png", out, {}, "Is a directory"
    yield "named.tif", out, {}, "holds PNG, not what its name says"
    yield "half-ok.png", out, {}, "half-ok.png is damaged"
    yield "half-ok.exr", "out.exr", {}, "half-ok.exr is damaged"
    yield "half-ok.tga", out, {"channel": "r"}, "half-ok.tga is damaged"
    yield "half-deep.png", out, {"channel": "r"}, "half-deep.png is damaged"
    yield "hole.tif", out, {}, "hole.tif is damaged"
    for name in ("strip.tif", "strips.tif", "far.tif", "few.tif"):
        yield name, "out.tif", {}, f"{name} is damaged, incomplete or unusual: rows are missing"
    yield "12.tif", out, {}, "12 bits a sample"
    yield "sign.tif", out, {}, "type int16"
    yield "32.tif", out, {}, "type uint"
    yield "white.tif", out, {}, "from white"
    yield "times.tif", out, {"channel": "r"}, "multiplied by alpha"
    yield "palette.tif", out, {}, "palette"
    yield "palette.tga", out, {}, "palette"
    yield "cmyk.tif", out, {}, "CMYK"
    yield "float.tif", out, {}, "holds floats"
    yield "key.png", out, {}, "transparent"
    yield "photo.jpg", out, {}, "or accept the losses"
    yield "photo.tif", out, {"channel": "r"}, "or accept the losses"
    yield "pages.tif", out, {}, "several pictures"
    yield "pages.png", out, {}, "several pictures"
    yield "rgb.png", out, {}, "r, g, b; choose one channel"
    for name in ("a", "rga", "l", "", "r,", "rr", "r,r", "red"):
        yield "rgb.png", out, {"channel": name}, f"no channel '{name}'; its channels are r, g, b"
    yield "rgb.exr", "out.exr", {"channel": "N"}, "integers"
    yield "rgb.exr", "out.exr", {"channel": "R"}, "would lose digits"
    yield "two.exr", "out.exr", {"channel": "R,G"}, "one after the other"
    yield "ok.png", out, {"max_pixels": 63}, "allow 64 pixels"
    yield "ok.exr", "out.exr", {"max_pixels": 15}, "allow 16 pixels"
    yield "ok.png", "out.jpg", {}, "alter the values"
    yield "ok.png", "out.bmp", {}, "does not end in"
    yield "ok.png", "out.exr", {}, "holds integers"
    yield "ok.png", "out.tga", {"depth": 16}, "TGA holds 8 bits"
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


def test_a_limit_is_the_default(tmp_path):
    claim = struct.pack(">II", 1 << 14, (1 << 13) + 1)
    whole = write_png(tmp_path / "a.png", samples(8, 8, 1, np.uint8)).read_bytes()
    header = b"IHDR" + claim + whole[24:29]
    content = whole[:12] + header + zlib.crc32(header).to_bytes(4) + whole[33:]
    (tmp_path / "a.png").write_bytes(content)
    with pytest.raises(MdfconvError, match="more than the 134217728"):
        convert_texture_file(tmp_path / "a.png", tmp_path / "b.png", RULE)


def test_an_old_output_survives_a_failure_and_gets_the_usual_permissions(tmp_path):
    source = write_png(tmp_path / "a.png", samples(8, 8, 1, np.uint8))
    output = tmp_path / "b.png"
    output.write_bytes(b"old")
    with pytest.raises(MdfconvError):
        convert_texture_file(source, output, RULE, channel="a")
    assert output.read_bytes() == b"old"
    convert_texture_file(source, output, RULE)
    mask = os.umask(0)
    os.umask(mask)
    assert output.stat().st_mode & 0o777 == 0o666 & ~mask
