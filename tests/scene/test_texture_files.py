"""Textures in files: what is converted, and what is kept."""

import struct
import zlib

import numpy as np
import OpenEXR
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from mdfconv import MdfconvError
from mdfconv.scene import TextureRule, convert_texture, convert_texture_file
from mdfconv.scene.texture import convert as texture_module
from tests.scene.pictures import (
    PROFILE,
    exr_header,
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
@pytest.mark.parametrize(
    "options",
    [{}, {"deflate": True, "rows": 4}, {"order": ">", "rows": 5}, {"planes": True, "rows": 6}],
)
def test_tiff_to_tiff_and_png(tmp_path, dtype, channels, options):
    texels = samples(31, 17, channels, dtype)
    source = write_tiff(tmp_path / "a.tif", texels, **options)
    expected = texels.copy()
    expected[..., -1] = convert_texture(texels[..., -1], RULE)
    name = {1: "l", 3: "b", 4: "a"}[channels]
    for output in (tmp_path / "b.tiff", tmp_path / "b.png"):
        convert_texture_file(source, output, RULE, channel=name)
        assert np.array_equal(read(output), expected)
        with Image.open(output) as image:
            assert image.info["dpi"] == pytest.approx((101.6, 203.2), rel=1e-3)


def test_lzw(tmp_path):
    texels = samples(31, 17, 3, np.uint8)
    Image.fromarray(texels).save(tmp_path / "a.tif", compression="tiff_lzw")
    convert_texture_file(tmp_path / "a.tif", tmp_path / "b.tif", RULE, channel="r")
    texels[..., 0] = convert_texture(texels[..., 0], RULE)
    assert np.array_equal(read(tmp_path / "b.tif"), texels)


def orientation_of(path):
    """Return the tag of a PNG or a TIFF, as Pillow reads it."""
    with Image.open(path) as image:
        return image.getexif().get(274, 1)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
@pytest.mark.parametrize("channels", [1, 3])
@pytest.mark.parametrize("orientation", range(1, 9))
def test_texels_and_the_tag_of_a_tiff_stay(tmp_path, orientation, channels, dtype):
    texels = samples(9, 5, channels, dtype)
    source = write_tiff(tmp_path / "a.tif", texels, tags={274: [orientation]})
    texels[..., -1] = convert_texture(texels[..., -1], RULE)
    channel = "l" if channels == 1 else "b"
    for name in ("b.tif", "b.png"):
        report = convert_texture_file(source, tmp_path / name, RULE, channel=channel)
        assert np.array_equal(read(tmp_path / name), texels)
        assert orientation_of(tmp_path / name) == orientation
        assert not report.remarks
    assert [name for name, _ in png_chunks(tmp_path / "b.png")].count(b"eXIf") == (orientation > 1)


def exif(orientation, order="<"):
    """Return EXIF with nothing but the orientation."""
    start = b"II*\0" if order == "<" else b"MM\0*"
    return start + struct.pack(f"{order}IHHHIHHI", 8, 1, 274, 3, 1, orientation, 0, 0)


def raw_profile(data):
    """Return EXIF in the text in which ImageMagick writes it."""
    data = b"Exif\0\0" + data
    return b"\nexif\n%8d\n" % len(data) + data.hex().encode() + b"\n"


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("form", ["chunk", "text", "packed"])
def test_texels_and_the_tag_of_a_png_stay(tmp_path, form, order):
    texels = samples(9, 5, 3, np.uint8)
    keyword, data = b"Raw profile type exif", exif(6, order)
    tag = {
        "chunk": (b"eXIf", data),
        "text": (b"tEXt", keyword + b"\0" + raw_profile(data)),
        "packed": (b"zTXt", keyword + b"\0\0" + zlib.compress(raw_profile(data))),
    }[form]
    source = write_png(tmp_path / "a.png", texels, more=[(b"tEXt", b"Title\0wood"), tag])
    texels[..., 1] = convert_texture(texels[..., 1], RULE)
    for name in ("b.png", "b.tif"):
        report = convert_texture_file(source, tmp_path / name, RULE, channel="g")
        assert np.array_equal(read(tmp_path / name), texels)
        assert not report.remarks
    assert png_chunks(tmp_path / "b.png")[1:-2] == [tag]
    assert orientation_of(tmp_path / "b.tif") == 6
    report = convert_texture_file(source, tmp_path / "b.tga", RULE, channel="g")
    assert "orientation 6, which TGA does not hold" in report.remarks[0]
    with Image.open(tmp_path / "b.tga") as found:
        assert np.array_equal(np.asarray(found), texels)


def test_a_tag_behind_the_texels_of_a_png_is_kept(tmp_path):
    texels = samples(9, 5, 1, np.uint8)
    content = write_png(tmp_path / "a.png", texels, more=[(b"eXIf", exif(8))]).read_bytes()
    chunk = content[33 : 33 + 12 + len(exif(8))]
    whole = content.replace(chunk, b"").replace(content[-12:], chunk + content[-12:])
    (tmp_path / "a.png").write_bytes(whole)
    for name in ("b.png", "b.tif"):
        convert_texture_file(tmp_path / "a.png", tmp_path / name, RULE)
        expected = convert_texture(texels[..., 0], RULE)
        assert np.array_equal(read(tmp_path / name)[..., 0], expected)
        assert orientation_of(tmp_path / name) == 8
    assert (b"eXIf", exif(8)) in png_chunks(tmp_path / "b.png")


@pytest.mark.parametrize("data", [b"", b"MM", b"II*\0\xff\xff\xff\xff", exif(6)[:20]])
def test_exif_that_says_nothing_is_kept(tmp_path, data):
    source = write_png(tmp_path / "a.png", samples(9, 5, 1, np.uint8), more=[(b"eXIf", data)])
    for name in ("b.png", "b.tif"):
        convert_texture_file(source, tmp_path / name, RULE)
    assert orientation_of(tmp_path / "b.tif") == 1
    assert png_chunks(tmp_path / "b.png")[1] == (b"eXIf", data)


def test_texels_and_the_tag_of_a_jpeg_stay(tmp_path):
    grey = Image.fromarray(np.repeat(np.arange(0, 240, 8, np.uint8)[None], 8, axis=0))
    tag = Image.Exif()
    tag[274] = 6
    grey.save(tmp_path / "a.jpg", exif=tag, quality=100)
    with Image.open(tmp_path / "a.jpg") as image:
        expected = convert_texture(np.asarray(image), RULE)
    for name in ("b.png", "b.tif"):
        convert_texture_file(tmp_path / "a.jpg", tmp_path / name, RULE, lossy=True)
        assert np.array_equal(read(tmp_path / name)[..., 0], expected)
        assert orientation_of(tmp_path / name) == 6


@pytest.mark.parametrize("dtype", [np.float16, np.float32, np.float64])
@pytest.mark.parametrize("channels", [1, 3])
def test_float_tiff(tmp_path, channels, dtype):
    texels = np.random.default_rng(0).random((17, 31, channels)).astype(dtype)
    source = write_tiff(tmp_path / "a.tif", texels, deflate=True, rows=4)
    name = None if channels == 1 else "g"
    place = min(1, channels - 1)
    convert_texture_file(source, tmp_path / "b.tif", RULE, channel=name)
    found = read(tmp_path / "b.tif")
    texels[..., place] = convert_texture(texels[..., place], RULE)
    assert found.dtype == dtype
    assert np.array_equal(found, texels)


def test_a_fifth_channel_stays_in_a_tiff(tmp_path):
    texels = samples(9, 5, 5, np.uint16)
    source = write_tiff(tmp_path / "a.tif", texels, tags={338: [0, 0]})
    convert_texture_file(source, tmp_path / "b.tif", RULE, channel="g")
    texels[..., 1] = convert_texture(texels[..., 1], RULE)
    assert np.array_equal(read(tmp_path / "b.tif"), texels)
    with pytest.raises(MdfconvError, match="which PNG does not hold"):
        convert_texture_file(source, tmp_path / "b.png", RULE, channel="g")


@pytest.mark.parametrize("orientation", [-1, 1])
@pytest.mark.parametrize("compression", [None, "tga_rle"])
@pytest.mark.parametrize("channels", [1, 3, 4])
def test_tga(tmp_path, channels, compression, orientation):
    texels = samples(9, 5, channels, np.uint8)
    image = Image.fromarray(texels[..., 0] if channels == 1 else texels)
    image.save(tmp_path / "a.tga", compression=compression, orientation=orientation)
    texels[..., -1] = convert_texture(texels[..., -1], RULE)
    name = {1: "l", 3: "b", 4: "a"}[channels]
    for output in (tmp_path / "b.tga", tmp_path / "b.png"):
        convert_texture_file(tmp_path / "a.tga", output, RULE, channel=name)
        with Image.open(output) as found:
            assert np.array_equal(np.asarray(found).reshape(texels.shape), texels)


@pytest.mark.parametrize("name", ["rgb", "r,G,b", "RGB", "bgr"])
@pytest.mark.parametrize("dither", [False, True])
def test_several_channels(tmp_path, name, dither):
    grey = samples(40, 30, 1, np.uint8)
    source = write_png(tmp_path / "a.png", np.dstack([grey, grey, grey, grey[::-1]]))
    report = convert_texture_file(source, tmp_path / "b.png", RULE, channel=name, dither=dither)
    found = read(tmp_path / "b.png")
    expected = convert_texture(grey[..., 0], RULE, dither=dither)
    assert all(np.array_equal(found[..., place], expected) for place in range(3))
    assert np.array_equal(found[..., 3], grey[::-1, :, 0])
    assert report.texels == 3 * 40 * 30


@pytest.mark.parametrize("more", [[(b"sRGB", b"\0")], [(b"gAMA", (45455).to_bytes(4))]])
def test_a_gamma_is_told_of_and_kept(tmp_path, more):
    texels = samples(8, 8, 1, np.uint8)
    source = write_png(tmp_path / "a.png", texels, more=more)
    report = convert_texture_file(source, tmp_path / "b.png", RULE)
    assert "gamma" in report.notes()[-1]
    assert [name for name, _ in png_chunks(tmp_path / "b.png")] == [
        *(b"IHDR", more[0][0]),
        *(b"IDAT", b"IEND"),
    ]


def test_no_gamma_is_invented(tmp_path):
    for more in ([], [(b"gAMA", (100000).to_bytes(4))]):
        source = write_png(tmp_path / "a.png", samples(8, 8, 1, np.uint8), more=more)
        report = convert_texture_file(source, tmp_path / "b.png", RULE)
        assert not any("gamma" in note for note in report.notes())
        kept = [name for name, _ in more]
        names = [name for name, _ in png_chunks(tmp_path / "b.png")]
        assert names == [b"IHDR", *kept, b"IDAT", b"IEND"]


@pytest.mark.parametrize("profile", [PROFILE, b"no profile", PROFILE[:200], bytes(200)])
def test_profiles_are_kept_whatever_they_hold(tmp_path, profile):
    # A profile of colours belongs to no grey picture, and yet many have one.
    for channels, name in ((1, "l"), (3, "g")):
        texels = samples(8, 8, channels, np.uint8)
        sources = (
            write_png(tmp_path / "a.png", texels, icc=profile),
            write_tiff(tmp_path / "a.tif", texels, tags={34675: profile}),
        )
        for source in sources:
            report = convert_texture_file(source, tmp_path / "b.png", RULE, channel=name)
            with Image.open(tmp_path / "b.png") as image:
                assert image.info["icc_profile"] == profile
            assert "a colour profile" in report.notes()[-1]
            convert_texture_file(source, tmp_path / "b.tif", RULE, channel=name)
            assert bytes(read_tiff(tmp_path / "b.tif")[1][34675]) == profile


def test_the_same_file_each_time(tmp_path):
    write_png(tmp_path / "a.png", samples(8, 8, 1, np.uint8))
    write_exr(tmp_path / "a.exr", Y=np.ones((4, 4), np.float32))
    for source, output in (("a.png", "b.png"), ("a.png", "b.tif"), ("a.exr", "b.exr")):
        contents = set()
        for _ in range(2):
            convert_texture_file(tmp_path / source, tmp_path / output, RULE)
            contents.add((tmp_path / output).read_bytes())
        assert len(contents) == 1
        assert b"capDate" not in contents.pop()


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


@pytest.mark.parametrize("lines", [OpenEXR.INCREASING_Y, OpenEXR.DECREASING_Y])
def test_every_half_is_kept_in_windows_tiles_and_any_order(tmp_path, monkeypatch, lines):
    monkeypatch.setattr(texture_module, "BLOCK", 256 * 40)
    halves = np.arange(65536).astype(np.uint16).view(np.float16).reshape(256, 256)
    rough = np.linspace(0, 1, 65536).reshape(256, 256).astype(np.float16)
    corners = (np.array([-5, 7], np.int32), np.array([250, 262], np.int32))
    headers = (
        {"lineOrder": lines},
        {"dataWindow": corners},
        {"type": OpenEXR.tiledimage, "tiles": OpenEXR.TileDescription()},
    )
    for header in headers:
        source = write_exr(tmp_path / "a.exr", header=header, R=halves, rough=rough)
        convert_texture_file(source, tmp_path / "b.exr", RULE, channel="rough")
        found = read_exr(tmp_path / "b.exr")
        assert np.array_equal(found["R"].view(np.uint16), halves.view(np.uint16))
        assert np.array_equal(found["rough"], convert_texture(rough, RULE))
        given, written = (exr_header(tmp_path / name) for name in ("a.exr", "b.exr"))
        assert written.pop("lineOrder") == str(OpenEXR.INCREASING_Y)
        assert given.pop("lineOrder") == str(header.get("lineOrder", OpenEXR.INCREASING_Y))
        assert written == given


@pytest.mark.parametrize(
    ("name", "lossy"),
    [
        ("PXR24", {"float32"}),
        *((f"B44{letter}", {"float16"}) for letter in ("", "A")),
        *((f"DWA{letter}", {"float16", "float32"}) for letter in "AB"),
        *((name, set()) for name in ("NO", "RLE", "ZIP", "ZIPS", "PIZ")),
    ],
)
def test_losses_of_exr_are_accepted_if_at_all(tmp_path, name, lossy):
    for dtype in ("float16", "float32"):
        y, x = np.mgrid[:40, :40]
        texels = (0.5 + 0.4 * np.sin(x / 3) * np.cos(y / 5)).astype(dtype)
        compression = getattr(OpenEXR, f"{name}_COMPRESSION")
        source = write_exr(tmp_path / "a.exr", compression, G=texels)
        # What a decoder gives back is what it got, or it is called lossy.
        assert np.array_equal(read_exr(source)["G"], texels) == (dtype not in lossy)
        if dtype in lossy:
            with pytest.raises(MdfconvError, match="with losses") as caught:
                convert_texture_file(source, tmp_path / "b.exr", RULE)
            assert (caught.value.argument, name.lower() in str(caught.value)) == ("lossy", True)
        convert_texture_file(source, tmp_path / "b.exr", RULE, lossy=dtype in lossy)


def test_exr_with_losses_is_written_without(tmp_path):
    channels = {name: np.random.default_rng(1).random((40, 40), np.float32) for name in "RG"}
    write_exr(tmp_path / "a.exr", OpenEXR.DWAA_COMPRESSION, **channels)
    convert_texture_file(tmp_path / "a.exr", tmp_path / "b.exr", RULE, channel="r", lossy=True)
    before, after = (read_exr(tmp_path / name) for name in ("a.exr", "b.exr"))
    assert np.array_equal(after["G"], before["G"])
    assert np.array_equal(after["R"], convert_texture(before["R"].clip(0, 1), RULE))
