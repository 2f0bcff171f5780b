"""Radiance pictures, against encoders by the book and against OpenImageIO's writer."""

from contextlib import suppress

import numpy as np
import OpenImageIO
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from mdfconv.errors import MdfconvError
from mdfconv.light.radiance import read_radiance
from mdfconv.light.spectrum import read_environment_map
from tests.cli.runner import run
from tests.light.maps import room, write_map


def head(height, width, *lines, first="#?RADIANCE", size="-Y {} +X {}"):
    return "\n".join([first, *lines, "", size.format(height, width), ""]).encode()


def flat(texels):
    return texels.tobytes()


def old_runs(texels):
    """Each texel, and 1 1 1 n for n more of it; of 256 and more the next 8 bits in another one."""
    out = b""
    for row in texels:
        place = 0
        while place < len(row):
            same = 1
            while place + same < len(row) and (row[place + same] == row[place]).all():
                same += 1
            out += row[place].tobytes()
            more = same - 1
            while more:
                out += bytes([1, 1, 1, more % 256])
                more //= 256
            place += same
    return out


def new_runs(texels):
    """2 2 and the width, then each of the four bytes of all texels: 128 + n of one, or n of any."""
    out = b""
    for row in texels:
        out += b"\2\2" + len(row).to_bytes(2)
        for plane in row.T:
            values, place = plane.tobytes(), 0
            while place < len(values):
                same = 1
                while values[place : place + 1] * (same + 1) == values[place : place + same + 1]:
                    same += 1
                if same > 2:
                    count = min(same, 127)
                    out += bytes([128 + count, values[place]])
                else:
                    count = min(len(values) - place, 1 + values[place] % 5)
                    out += bytes([count]) + values[place : place + count]
                place += count
    return out


def value(texels):
    """(r, g, b) · 2^(e − 136), and black where e is 0, one texel at a time."""
    result = np.zeros((*texels.shape[:2], 3))
    for place in np.ndindex(texels.shape[:2]):
        *mantissa, exponent = map(int, texels[place])
        if exponent:
            result[place] = [m * 2.0 ** (exponent - 136) for m in mantissa]
    return result.astype(np.float32)


def stored(height, width):
    """Texels with long runs, without those by which the encodings are told: 1 1 1 and 2 2."""
    texel = st.tuples(*[st.integers(3, 255)] * 3, st.integers(0, 255))
    palette = st.lists(texel, min_size=1, max_size=3)
    index = arrays(np.uint8, (height, width), elements=st.integers(0, 2), fill=st.just(0))
    return st.tuples(palette, index).map(
        lambda drawn: np.array(drawn[0], np.uint8)[drawn[1] % len(drawn[0])]
    )


SIZES = st.tuples(st.integers(1, 4), st.sampled_from([1, 7, 8, 9, 130, 600]))


@settings(deadline=None, max_examples=60)
@given(texels=SIZES.flatmap(lambda size: stored(*size)))
@pytest.mark.parametrize("encode", [flat, old_runs, new_runs])
def test_every_encoding(encode, texels):
    height, width = texels.shape[:2]
    if encode is new_runs and width < 8:
        encode = flat
    data = head(height, width, "FORMAT=32-bit_rle_rgbe") + encode(texels)
    read = read_radiance(data)
    assert read.dtype == np.float32
    np.testing.assert_array_equal(read, value(texels))


def test_a_run_of_many_texels():
    texels = np.full((1, 300000, 4), 77, np.uint8)
    data = old_runs(texels)
    assert len(data) == 4 + 3 * 4
    wanted = value(texels[:, :1]).repeat(300000, axis=1)
    np.testing.assert_array_equal(read_radiance(head(1, 300000) + data), wanted)


def test_both_encodings_in_one_file():
    texels = np.random.default_rng(1).integers(2, 255, (4, 16, 4)).astype(np.uint8)
    data = head(4, 16) + new_runs(texels[:3]) + old_runs(texels[3:])
    np.testing.assert_array_equal(read_radiance(data), value(texels))


@pytest.mark.parametrize("ending", ["hdr", "rgbe"])
def test_as_openimageio_writes_and_reads_it(tmp_path, ending):
    path = tmp_path / f"a.{ending}"
    pixels = np.random.default_rng(2).random((64, 128, 3), np.float32)
    pixels[10:20] = 0.25
    output = OpenImageIO.ImageOutput.create("a.hdr")
    output.open(str(path), OpenImageIO.ImageSpec(128, 64, 3, "float"))
    output.write_image(pixels)
    output.close()
    theirs = OpenImageIO.ImageInput.open(str(path)).read_image(0, 0, 0, 3, "float")
    np.testing.assert_array_equal(read_radiance(path.read_bytes()), theirs)


@pytest.mark.parametrize(
    ("size", "turned"),
    [
        ("-Y {} +X {}", lambda texels: texels),
        ("+Y {} +X {}", lambda texels: texels[::-1]),
        ("-Y {} -X {}", lambda texels: texels[:, ::-1]),
        ("+Y {}  -X  {} ", lambda texels: texels[::-1, ::-1]),
    ],
)
def test_the_order_of_rows_and_columns(size, turned):
    texels = np.random.default_rng(3).integers(2, 255, (3, 9, 4)).astype(np.uint8)
    data = head(3, 9, size=size) + new_runs(texels)
    np.testing.assert_array_equal(read_radiance(data), value(turned(texels)))


@pytest.mark.parametrize("first", ["#?RADIANCE", "#?RGBE", "#?AUTOPANO"])
@pytest.mark.parametrize("lines", [[], ["# a comment", "EXPOSURE=2", "FORMAT=32-bit_rle_rgbe"]])
def test_heads(first, lines):
    data = head(1, 1, *lines, first=first) + bytes([3, 2, 1, 136])
    np.testing.assert_array_equal(read_radiance(data), [[[3, 2, 1]]])


def test_xyze_has_the_luminance_as_its_second_number(tmp_path):
    texels = np.random.default_rng(4).integers(2, 255, (64, 128, 4)).astype(np.uint8)
    texels[..., 3] = 129
    path = tmp_path / "sky.hdr"
    path.write_bytes(head(64, 128, "FORMAT=32-bit_rle_xyze") + flat(texels))
    np.testing.assert_array_equal(read_environment_map(path), texels[..., 1] / 128)


@pytest.mark.parametrize("name", ["sky.hdr", "sky.pic", "sky.exr", "sky"])
def test_the_content_decides_not_the_name(tmp_path, name):
    grey = write_map(tmp_path / "a.hdr", room())
    path = tmp_path / name
    path.write_bytes(grey.read_bytes())
    wanted = read_environment_map(write_map(tmp_path / "wanted.exr", room()))
    # Eight bits of mantissa, cut off.
    np.testing.assert_allclose(read_environment_map(path), wanted, rtol=2 / 256)
    assert run("light", path, "--m-b", "0.1")[0] == 0


WHOLE = np.full((64, 128, 4), 5, np.uint8)


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n", "its size, '', is not as in -Y 512 +X 1024"),
        (head(64, 128, size="+X {} -Y {}") + flat(WHOLE), "its size, '+X 64 -Y 128', is not"),
        (
            head(64, 128, "FORMAT=Radiance_spectra") + flat(WHOLE),
            "its format, 'Radiance_s",
        ),
        (head(64, 0), "it has 0×64 texels, not 1 to 134217728"),
        (head(999999999, 999999999), "it has 999999999×999999999 texels, not 1 to 134217728"),
        (head(64, 128) + flat(WHOLE)[:-4], "it is truncated or damaged"),
        (head(64, 128) + old_runs(WHOLE)[:-4], "it is truncated or damaged"),
        (head(64, 128) + new_runs(WHOLE)[:-1], "it is truncated or damaged"),
        (head(64, 128) + b"\1\1\1\5" + flat(WHOLE), "it is truncated or damaged"),
        (head(1, 2) + bytes([9, 9, 9, 9, 1, 1, 1, 5]), "it is truncated or damaged"),
        (head(64, 128), "it is truncated or damaged"),
    ],
)
def test_what_cannot_be_read(tmp_path, data, reason):
    path = tmp_path / "bad.hdr"
    path.write_bytes(data)
    status, out, err = run("light", path)
    assert (status, out) == (2, "")
    assert err.count("\n") == 1
    assert f"cannot read {path}: {reason}" in err


@settings(deadline=None, max_examples=300)
@given(rest=st.binary(max_size=80), head_=st.binary(max_size=30), data=st.data())
def test_arbitrary_bytes(rest, head_, data):
    height, width = data.draw(SIZES)
    lead = data.draw(st.sampled_from([b"", b"\2\2" + width.to_bytes(2), bytes(4), b"\1\1\1\xff"]))
    whole = head(height, width) + lead + rest
    for content in (b"#?" + head_ + rest, whole, whole[: data.draw(st.integers(2, len(whole)))]):
        with suppress(ValueError):
            pixels = read_radiance(content)
            assert np.isfinite(pixels).all()
            assert (pixels >= 0).all()


def test_cube_maps_are_named(tmp_path):
    tall = np.random.default_rng(5).random((384, 64, 3), np.float32)
    way_out = "convert it to latitude and longitude, 2:1"
    tool = " (exrenvmap -l, of OpenEXR)"
    for name, kind, pixels, said in (
        ("cube.exr", "CubeFace Environment", tall, tool),
        ("cross.exr", "CubeFace Environment", tall[:256, :48], tool),
        ("strip.exr", "", tall, tool),
        ("strip.tif", "", tall, ""),
        ("wide.tif", "", tall.swapaxes(0, 1), ""),
    ):
        path = tmp_path / name
        height, width = pixels.shape[:2]
        shape = OpenImageIO.ImageSpec(width, height, 3, "float")
        if kind:
            shape.attribute("textureformat", kind)
        output = OpenImageIO.ImageOutput.create(str(path))
        output.open(str(path), shape)
        output.write_image(np.ascontiguousarray(pixels))
        output.close()
        with pytest.raises(MdfconvError) as caught:
            read_environment_map(path)
        assert str(caught.value) == f"{path} is a cube map; {way_out}{said}"
    square = write_map(tmp_path / "ball.exr", np.ones((64, 64)))
    with pytest.raises(MdfconvError, match=f"not 64×64; {way_out}"):
        read_environment_map(square)
