"""Channels that are converted into others, of the same picture or of another one."""

import zlib

import numpy as np
import OpenEXR
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from mdfconv import MdfconvError
from mdfconv.scene import TextureRule, convert_texture, convert_texture_file
from mdfconv.scene.texture.convert import convert_texture_bytes
from tests.scene.pictures import (
    png_chunks,
    read,
    read_exr,
    read_tiff,
    samples,
    write_exr,
    write_png,
    write_tiff,
)

RULE = TextureRule("ggx:roughness", "ggx:alpha")
TO_ROUGHNESS = TextureRule("ggx:glossiness", "ggx:roughness")
TO_GLOSSINESS = TextureRule("ggx:roughness", "ggx:glossiness")
NAMES = {1: "l", 2: "la", 3: "rgb", 4: "rgba"}


def test_the_smoothness_of_unity_becomes_the_roughness_of_gltf_and_back(tmp_path):
    texels = np.array([[[200, 0, 7, 0], [200, 9, 0, 64], [1, 0, 0, 128], [2, 3, 4, 255]]], np.uint8)
    source = write_png(tmp_path / "unity.png", texels)
    report = convert_texture_file(
        source, tmp_path / "orm.png", TO_ROUGHNESS, channel="a", to_channel="g"
    )
    assert read(tmp_path / "orm.png").tolist() == [
        [[200, 255, 7, 0], [200, 191, 0, 64], [1, 127, 0, 128], [2, 0, 4, 255]]
    ]
    assert report.channels == "green from alpha (which stays as it is)"
    opaque = write_png(tmp_path / "rgb.png", read(tmp_path / "orm.png")[..., :3].copy())
    convert_texture_file(opaque, tmp_path / "b.png", TO_GLOSSINESS, channel="g", to_channel="a")
    assert np.array_equal(read(tmp_path / "b.png")[..., 3], texels[..., 3])
    assert np.array_equal(read(tmp_path / "b.png")[..., :3], read(opaque))


@given(
    channels=st.sampled_from([3, 4]),
    dtype=st.sampled_from([np.uint8, np.uint16]),
    suffix=st.sampled_from([".png", ".tif"]),
    pair=st.tuples(st.integers(0, 3), st.integers(0, 3)),
    size=st.tuples(st.integers(1, 20), st.integers(1, 20)),
    seed=st.integers(0, 100),
)
@settings(max_examples=30, deadline=None)
def test_other_channels_stay_and_moving_back_gives_the_original(
    tmp_path_factory, channels, dtype, suffix, pair, size, seed
):
    folder = tmp_path_factory.mktemp("move")
    texels = samples(*size, channels, dtype, seed)
    write = write_png if suffix == ".png" else write_tiff
    source = write(folder / f"a{suffix}", texels)
    first, second = (place % channels for place in pair)
    names = NAMES[channels][first], NAMES[channels][second]
    moved = folder / f"b{suffix}"
    convert_texture_file(
        source, moved, TO_ROUGHNESS, channel=names[0], to_channel=names[1], depth=16
    )
    deep = texels.astype(np.uint16) * (1 if dtype == np.uint16 else 257)
    expected = deep.copy()
    expected[..., second] = convert_texture(texels[..., first], TO_ROUGHNESS, depth=16)
    assert np.array_equal(read(moved), expected)
    back = folder / f"c{suffix}"
    convert_texture_file(moved, back, TO_GLOSSINESS, channel=names[1], to_channel=names[0], depth=8)
    levels = np.rint(texels[..., first] / (257 if dtype == np.uint16 else 1))
    found = read(back)[..., first].astype(int)
    # The mirror that a glossiness of 1 is has no glossiness but 1.
    assert np.abs(found - levels).max() <= (0 if dtype == np.uint8 else 1)


@given(
    depths=st.tuples(*2 * [st.sampled_from([np.uint8, np.uint16])]),
    channels=st.tuples(st.sampled_from([1, 3, 4]), st.sampled_from([1, 3, 4])),
    place=st.integers(0, 3),
    seed=st.integers(0, 100),
)
@settings(max_examples=30, deadline=None)
def test_into_another_picture(tmp_path_factory, depths, channels, place, seed):
    folder = tmp_path_factory.mktemp("into")
    texels = samples(9, 5, channels[0], depths[0], seed)
    others = samples(9, 5, channels[1], depths[1], seed + 1)
    source = write_png(folder / "a.png", texels, per_metre=(1000, 1000))
    base = write_tiff(folder / "orm.tif", others, tags={274: [3]})
    before = base.read_bytes()
    target = NAMES[channels[1]][place % channels[1]]
    result = folder / "b.tif"
    report = convert_texture_file(
        source, result, RULE, channel=NAMES[channels[0]][-1], to_channel=target, into=base
    )
    depth = 8 * others.itemsize
    others[..., place % channels[1]] = convert_texture(texels[..., -1], RULE, depth=depth)
    found, tags = read_tiff(result)
    assert np.array_equal(found, others)
    # What the file says of itself comes with the other channels.
    assert tags[274] == (3,)
    assert tags[282][0] / tags[282][1] == pytest.approx(101.6)
    assert base.read_bytes() == before
    assert report.texels == 45


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_grey_is_red_green_and_blue(tmp_path, dtype):
    grey = samples(9, 5, 1, dtype)
    source = write_png(tmp_path / "a.png", grey)
    converted = convert_texture(grey, RULE)
    alpha = write_png(tmp_path / "ya.png", np.dstack([grey, grey[::-1]]))
    cases = [
        (source, {"channel": "g"}, [grey, converted, grey]),
        (source, {"channel": "rgb"}, 3 * [converted]),
        (source, {"to_channel": "b"}, [grey, grey, converted]),
        (source, {"to_channel": "a"}, [grey, converted]),
        (source, {"channel": "r", "to_channel": "g"}, [grey, converted, grey]),
        (source, {"channel": "g", "to_channel": "l"}, [converted]),
        (alpha, {"channel": "a", "to_channel": "l"}, [converted[::-1], grey[::-1]]),
        (alpha, {"channel": "a", "to_channel": "r"}, [converted[::-1], grey, grey, grey[::-1]]),
    ]
    for file, options, expected in cases:
        for name in ("b.png", "b.tif"):
            convert_texture_file(file, tmp_path / name, RULE, **options)
            assert np.array_equal(read(tmp_path / name), np.dstack(expected)), options
    with pytest.raises(MdfconvError, match="TGA"):
        convert_texture_file(source, tmp_path / "b.tga", RULE, to_channel="a")


def test_several_channels_move_in_pairs(tmp_path):
    texels = samples(9, 5, 4, np.uint8)
    source = write_png(tmp_path / "a.png", texels)
    convert_texture_file(source, tmp_path / "b.png", RULE, channel="rg", to_channel="ba")
    texels[..., 2:] = convert_texture(texels[..., :2], RULE)
    assert np.array_equal(read(tmp_path / "b.png"), texels)


def test_channels_of_openexr_keep_their_types(tmp_path):
    rough = np.linspace(0, 1, 20, dtype=np.float32).reshape(4, 5)
    half = np.full((4, 5), 0.25, np.float16)
    source = write_exr(tmp_path / "a.exr", R=half, rough=rough)
    convert_texture_file(source, tmp_path / "b.exr", RULE, channel="rough", to_channel="R")
    found = read_exr(tmp_path / "b.exr")
    assert np.array_equal(found["R"], np.square(rough).astype(np.float16))
    assert found["R"].dtype == np.float16
    assert np.array_equal(found["rough"], rough)
    grey = write_exr(tmp_path / "y.exr", Y=half)
    convert_texture_file(grey, tmp_path / "g.exr", RULE, channel="g")
    found = read_exr(tmp_path / "g.exr")
    assert {name: channel.dtype for name, channel in found.items()} == dict.fromkeys(
        "RGB", half.dtype
    )
    assert [float(found[name][0, 0]) for name in "RGB"] == [0.25, 0.0625, 0.25]
    convert_texture_file(source, tmp_path / "c.exr", RULE, channel="rough", to_channel="A")
    assert np.array_equal(read_exr(tmp_path / "c.exr")["A"], np.square(rough).astype(np.float16))
    convert_texture_file(
        grey, tmp_path / "d.exr", RULE, to_channel="rough", into=tmp_path / "a.exr"
    )
    assert np.all(read_exr(tmp_path / "d.exr")["rough"] == 0.0625)


def test_tiles_and_strips_together(tmp_path, monkeypatch):
    monkeypatch.setattr("mdfconv.scene.texture.convert.BLOCK", 100)
    rough = np.random.default_rng(0).random((70, 90), np.float32)
    upside_down = np.ascontiguousarray(rough[::-1])
    tiles = {"type": OpenEXR.tiledimage, "tiles": OpenEXR.TileDescription()}
    source = write_exr(tmp_path / "a.exr", G=rough, header=tiles)
    base = write_exr(tmp_path / "b.exr", OpenEXR.PIZ_COMPRESSION, G=upside_down, B=rough)
    for one, other in ((source, base), (base, source)):
        convert_texture_file(one, tmp_path / "c.exr", RULE, channel="g", to_channel="g", into=other)
        expected = np.square((rough if one is source else upside_down).astype(float))
        assert np.array_equal(read_exr(tmp_path / "c.exr")["G"], expected.astype(np.float32))


def test_refusals(tmp_path):
    rgb = write_png(tmp_path / "rgb.png", samples(9, 5, 3, np.uint8))
    small = write_png(tmp_path / "small.png", samples(5, 9, 3, np.uint8))
    floats = write_tiff(tmp_path / "f.tif", np.zeros((5, 9, 3), np.float32))
    write_exr(tmp_path / "id.exr", R=np.ones((4, 4), np.float32), id=np.ones((4, 4), np.uint32))
    out = tmp_path / "out.tif"
    cases = [
        ({"channel": "r", "to_channel": "x"}, "no channel 'x'; its channels are r, g, b"),
        ({"channel": "a", "to_channel": "r"}, "no channel 'a'; its channels are r, g, b"),
        ({"channel": "rg", "to_channel": "b"}, "red, green do not go into blue"),
        ({"to_channel": "r"}, "choose one channel"),
        ({"channel": "r", "into": small}, "small.png has 5×9 pixels, and .*rgb.png 9×5"),
        ({"channel": "r", "into": floats}, "rgb.png holds integers, and .*f.tif floats"),
        ({"channel": "r", "into": tmp_path / "none.png"}, "cannot read .*none.png"),
        ({"channel": "r", "into": tmp_path / "id.exr"}, "id.exr holds floats"),
    ]
    for options, words in cases:
        with pytest.raises(MdfconvError, match=words):
            convert_texture_file(rgb, out, RULE, **options)
        assert not out.exists()
    with pytest.raises(MdfconvError, match=r"same file as .*small.png"):
        convert_texture_file(rgb, small, RULE, channel="r", into=small)
    with pytest.raises(MdfconvError, match="id holds integers"):
        convert_texture_file(
            tmp_path / "id.exr", tmp_path / "o.exr", RULE, channel="R", to_channel="id"
        )


@pytest.mark.parametrize(
    ("mode", "suffix"),
    [("grey", ".png"), ("colours", ".png"), ("alpha", ".png"), ("colours", ".tga")],
)
def test_palettes_are_expanded(tmp_path, mode, suffix):
    colours = np.random.default_rng(0).integers(0, 256, (256, 3), np.uint8)
    if mode == "grey":
        colours[:] = colours[:, :1]
    indices = np.arange(256, dtype=np.uint8).reshape(8, 32)
    image = Image.new("P", (32, 8))
    image.putdata(indices.ravel().tolist())
    image.putpalette(colours.ravel().tolist())
    alpha = bytes(range(256))
    more = {"transparency": alpha} if mode == "alpha" else {}
    image.save(tmp_path / f"a{suffix}", **more)
    convert_texture_file(
        tmp_path / f"a{suffix}", tmp_path / "b.png", RULE, channel="l" if mode == "grey" else "g"
    )
    expected = colours[indices]
    expected[..., 1] = convert_texture(expected[..., 1], RULE)
    layers = [expected[..., 1:2]] if mode == "grey" else [expected]
    if mode == "alpha":
        layers.append(np.arange(256, dtype=np.uint8).reshape(8, 32, 1))
    assert np.array_equal(read(tmp_path / "b.png"), np.dstack(layers))
    assert [name for name, _ in png_chunks(tmp_path / "b.png")] == [b"IHDR", b"IDAT", b"IEND"]


@pytest.mark.parametrize("bits", [1, 2, 4])
def test_few_bits_are_expanded(tmp_path, bits):
    packed = np.arange(256, dtype=np.uint8).reshape(16, 16, 1)
    each = 8 // bits
    shifts = np.arange(each)[::-1] * bits
    values = (packed >> shifts.astype(np.uint8)) & ((1 << bits) - 1)
    levels = values.reshape(16, -1) * np.uint8(255 // ((1 << bits) - 1))
    png = write_png(tmp_path / "a.png", packed, bits=bits)
    content = bytearray(png.read_bytes())
    content[16:20] = (16 * each).to_bytes(4)
    content[29:33] = zlib.crc32(bytes(content[12:29])).to_bytes(4)
    png.write_bytes(content)
    tiff = write_tiff(tmp_path / "a.tif", packed, tags={258: [bits], 256: [16 * each]})
    for source in (png, tiff):
        convert_texture_file(source, tmp_path / "b.png", RULE)
        assert np.array_equal(read(tmp_path / "b.png")[..., 0], convert_texture(levels, RULE))


def test_bytes_of_grey_and_of_a_palette_have_a_green_channel(tmp_path):
    """As the metallic-roughness texture of a glTF is taken."""
    grey = np.arange(64, dtype=np.uint8).reshape(8, 8)
    for mode in ("L", "P"):
        image = Image.fromarray(grey)
        if mode == "P":
            image = image.convert("P")
        image.save(tmp_path / "a.png")
        content, _ = convert_texture_bytes((tmp_path / "a.png").read_bytes(), ".png", RULE, "g")
        (tmp_path / "b.png").write_bytes(content)
        expected = np.dstack([grey, convert_texture(grey, RULE), grey])
        assert np.array_equal(read(tmp_path / "b.png"), expected)


class TestAlphaOfTga:
    """A fourth byte that is no attribute."""

    @pytest.fixture
    def source(self, tmp_path):
        self.texels = samples(9, 5, 4, np.uint8)
        Image.fromarray(self.texels).save(tmp_path / "a.tga")
        content = bytearray((tmp_path / "a.tga").read_bytes())
        content[17] &= 0xF0
        (tmp_path / "a.tga").write_bytes(content)
        return tmp_path / "a.tga"

    def result(self, source, name, **options):
        convert_texture_file(source, source.with_name(name), RULE, **options)
        return source.with_name(name).read_bytes()

    def test_stays_what_it_is(self, source):
        for name in ("b.tga", "c.tga"):
            content = self.result(source, name, channel="g")
            assert content[17] & 0x0F == 0
            self.texels[..., 1] = convert_texture(self.texels[..., 1], RULE)
            rows = np.frombuffer(content[18:][: 4 * 45], np.uint8).reshape(5, 9, 4)
            rows = rows if content[17] & 0x20 else rows[::-1]
            assert np.array_equal(rows[..., [2, 1, 0, 3]], self.texels)
            source = source.with_name(name)

    def test_is_left_out_elsewhere_unless_it_is_chosen(self, source):
        report = convert_texture_file(source, source.with_name("b.png"), RULE, channel="g")
        assert "no alpha" in report.remarks[0]
        expected = self.texels.copy()
        expected[..., 1] = convert_texture(expected[..., 1], RULE)
        assert np.array_equal(read(source.with_name("b.png")), expected[..., :3])
        self.result(source, "c.png", channel="a", to_channel="g")
        expected[..., 1] = convert_texture(expected[..., 3], RULE)
        assert np.array_equal(read(source.with_name("c.png")), expected[..., :3])
        self.result(source, "d.png", channel="a")
        assert read(source.with_name("d.png")).shape == (5, 9, 4)

    def test_is_alpha_once_something_goes_there(self, source):
        assert self.result(source, "b.tga", channel="g", to_channel="a")[17] & 0x0F == 8
        assert self.result(source, "c.tga", channel="a")[17] & 0x0F == 0


def test_two_orientations_are_put_together_as_stored_and_said(tmp_path):
    tag = Image.Exif()
    tag[274] = 6
    Image.new("L", (2, 2), 51).save(tmp_path / "gloss.png")
    Image.new("RGB", (2, 2), (1, 2, 3)).save(tmp_path / "orm.png", exif=tag)
    rule = TextureRule("ggx:glossiness", "ggx:roughness")
    report = convert_texture_file(
        tmp_path / "gloss.png",
        tmp_path / "out.png",
        rule,
        to_channel="g",
        into=tmp_path / "orm.png",
    )
    assert "has the orientation 1 and" in report.remarks[-1]
    assert np.asarray(Image.open(tmp_path / "out.png"))[0, 0].tolist() == [1, 204, 3]
