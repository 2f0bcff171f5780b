"""Textures in files: what is converted, and what is kept."""

import numpy as np
import OpenEXR
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from mdfconv.scene import TextureRule, convert_texture, convert_texture_file
from mdfconv.scene import texture as texture_module
from tests.scene.pictures import (
    PROFILE,
    read,
    read_exr,
    samples,
    write_exr,
    write_png,
    write_tiff,
)

RULE = TextureRule("ggx:roughness", "ggx:alpha")


@given(
    width=st.integers(1, 40),
    height=st.integers(1, 40),
    channels=st.sampled_from([1, 3, 4]),
    dtype=st.sampled_from([np.uint8, np.uint16]),
    per_metre=st.tuples(st.integers(40, 100000), st.integers(40, 100000)),
    seed=st.integers(0, 1000),
    place=st.integers(0, 3),
)
@settings(max_examples=25, deadline=None)
def test_png_keeps_all_but_the_channel(
    tmp_path_factory, width, height, channels, dtype, per_metre, seed, place
):
    folder = tmp_path_factory.mktemp("png")
    texels = samples(width, height, channels, dtype, seed)
    source = write_png(folder / "a.png", texels, icc=PROFILE, per_metre=per_metre)
    before = source.read_bytes()
    place = 0 if channels == 1 else place % channels
    name = None if channels == 1 else "rgba"[place]
    report = convert_texture_file(source, folder / "b.png", RULE, channel=name)
    found = read(folder / "b.png")
    expected = texels.copy()
    expected[..., place] = convert_texture(texels[..., place], RULE)
    assert found.dtype == dtype
    assert np.array_equal(found, expected)
    assert report.texels == width * height == report.before.sum() == report.after.sum()
    with Image.open(folder / "b.png") as image:
        assert image.info["icc_profile"] == PROFILE
        assert image.info["dpi"] == tuple(0.0254 * side for side in per_metre)
    assert source.read_bytes() == before
    assert sorted(entry.name for entry in folder.iterdir()) == ["a.png", "b.png"]


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
@pytest.mark.parametrize("channels", [1, 3, 4])
@pytest.mark.parametrize("compression", ["none", "lzw", "deflate"])
def test_tiff_to_tiff_and_png(tmp_path, dtype, channels, compression):
    texels = samples(31, 17, channels, dtype)
    source = write_tiff(tmp_path / "a.tif", texels, compression=compression)
    expected = texels.copy()
    expected[..., -1] = convert_texture(texels[..., -1], RULE)
    name = {1: "l", 3: "b", 4: "a"}[channels]
    for output in (tmp_path / "b.tiff", tmp_path / "b.png"):
        convert_texture_file(source, output, RULE, channel=name)
        assert np.array_equal(read(output), expected)
        with Image.open(output) as image:
            assert image.info["dpi"] == pytest.approx((101.6, 203.2), rel=1e-3)


def test_big_endian_and_rotated_tiff(tmp_path):
    texels = samples(9, 5, 1, np.uint16)
    Image.fromarray(texels[..., 0].astype(">u2")).save(tmp_path / "a.tif", tiffinfo={274: 6})
    convert_texture_file(tmp_path / "a.tif", tmp_path / "b.tif", RULE)
    expected = convert_texture(np.rot90(texels[..., 0], -1), RULE)
    assert np.array_equal(read(tmp_path / "b.tif")[..., 0], expected)


@pytest.mark.parametrize("channels", [1, 3, 4])
def test_other_depths(tmp_path, channels):
    channel = "l" if channels == 1 else "g"
    place = min(1, channels - 1)
    for dtype, depth in ((np.uint8, 16), (np.uint16, 8)):
        texels = samples(20, 10, channels, dtype)
        source = write_png(tmp_path / "a.png", texels, icc=PROFILE, per_metre=(3000, 4000))
        convert_texture_file(source, tmp_path / "b.png", RULE, channel=channel, depth=depth)
        # 65535 = 257 · 255
        expected = texels * np.uint16(257) if depth == 16 else np.rint(texels / 257)
        expected[..., place] = convert_texture(texels[..., place], RULE, depth=depth)
        found = read(tmp_path / "b.png")
        assert found.itemsize == depth // 8
        assert np.array_equal(found, expected)
        with Image.open(tmp_path / "b.png") as image:
            assert image.info["icc_profile"] == PROFILE
            assert image.info["dpi"] == pytest.approx((76.2, 101.6))


def test_blocks_and_progress(tmp_path, monkeypatch):
    monkeypatch.setattr(texture_module, "BLOCK", 100)
    texels = samples(33, 40, 1, np.uint16)
    source = write_png(tmp_path / "a.png", texels)
    advanced = []

    class Bar:
        def __enter__(self):
            return advanced.append

        def __exit__(self, *reason):
            return None

    convert_texture_file(
        source, tmp_path / "b.png", RULE, depth=8, dither=True, progress=lambda words, total: Bar()
    )
    whole = convert_texture(texels[..., 0], RULE, depth=8, dither=True)
    assert np.array_equal(read(tmp_path / "b.png")[..., 0], whole)
    assert sum(advanced) == 40
    assert len(advanced) > 10


@pytest.mark.parametrize("dtype", [np.float16, np.float32])
def test_exr(tmp_path, dtype):
    rough = np.linspace(-0.2, 1.2, 600).reshape(20, 30).astype(dtype)
    rough[0, :3] = np.nan, np.inf, -np.inf
    others = {"G": np.arange(600, dtype=np.float16).reshape(20, 30)}
    others["id"] = np.arange(600, dtype=np.uint32).reshape(20, 30)
    source = write_exr(tmp_path / "a.exr", **{"mask.R": rough}, **others)
    report = convert_texture_file(source, tmp_path / "b.exr", RULE, channel="mask.R")
    found = read_exr(tmp_path / "b.exr")
    assert {name: entry.dtype for name, entry in found.items()}["mask.R"] == dtype
    expected = np.square(np.clip(rough.astype(np.float64), 0, 1)).astype(dtype)
    assert np.array_equal(found["mask.R"], expected, equal_nan=True)
    assert all(np.array_equal(found[name], entry) for name, entry in others.items())
    assert any("1 of 600 texels are NaN" in note for note in report.notes())
    outside = np.count_nonzero((rough < 0) | (rough > 1))
    assert any(f"{outside} of 600 texels are clamped" in note for note in report.notes())
    with OpenEXR.File(str(tmp_path / "b.exr")) as file:
        assert file.header()["by"] == "hand"


def test_exr_with_losses_is_written_without(tmp_path):
    channels = {name: np.random.default_rng(1).random((40, 40), np.float32) for name in "RG"}
    with OpenEXR.File({"compression": OpenEXR.DWAA_COMPRESSION}, channels) as file:
        file.write(str(tmp_path / "a.exr"))
    convert_texture_file(tmp_path / "a.exr", tmp_path / "b.exr", RULE, channel="r")
    before, after = (read_exr(tmp_path / name) for name in ("a.exr", "b.exr"))
    assert np.array_equal(after["G"], before["G"])
    assert np.array_equal(after["R"], convert_texture(before["R"].clip(0, 1), RULE))
