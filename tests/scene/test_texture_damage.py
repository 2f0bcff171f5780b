"""Damaged files are read or refused: no traceback, no crash, no word of a library, no half file."""

import random
import subprocess
import sys

import numpy as np
import OpenEXR
import pytest
from PIL import Image

from tests.scene.pictures import PROFILE, samples, write_exr, write_png, write_tiff

TRIES = 40
# In a process of its own, as a library may end it.
CHILD = """
import sys, warnings
from pathlib import Path
from mdfconv import MdfconvError
from mdfconv.scene import TextureRule, convert_texture_file
warnings.simplefilter("error")
folder, channel, suffix = Path(sys.argv[1]), sys.argv[2], sys.argv[3]
for source in sorted(folder.glob("bad*")):
    for name in ("out" + suffix, "out.tif" if suffix != ".exr" else "out2.exr"):
        output = folder / name
        try:
            convert_texture_file(source, output, TextureRule("ggx", "ggx:roughness"),
                                 channel=channel)
        except MdfconvError as error:
            assert "\\n" not in str(error), error
            assert not output.exists(), error
        else:
            output.unlink()
print("survived")
"""


def damaged(content, chance):
    """Cut a file, or flip some of its bits, more often of its start."""
    if chance.random() < 0.3:
        return content[: chance.randrange(len(content))]
    flipped = bytearray(content)
    for _ in range(chance.choice((1, 1, 1, 3, 8))):
        place = chance.randrange(chance.choice((len(flipped), min(200, len(flipped)))))
        flipped[place] ^= 1 << chance.randrange(8)
    return bytes(flipped)


def sources(folder):
    """Yield files with the channel to convert."""
    for channels, name in ((1, "y"), (4, "g")):
        for dtype in (np.uint8, np.uint16):
            texels = samples(33, 21, channels, dtype)
            label = f"{channels}-{texels.itemsize}"
            resolution = (3000, 4000)
            yield (
                write_png(folder / f"{label}.png", texels, icc=PROFILE, per_metre=resolution),
                name,
            )
            yield write_tiff(folder / f"{label}.tif", texels, rows=4), name
            yield write_tiff(folder / f"{label}-zip.tif", texels, rows=4, deflate=True), name
    for label, options in (("plain", {}), ("rle", {"compression": "tga_rle"})):
        Image.fromarray(samples(33, 21, 3, np.uint8)).save(folder / f"{label}.tga", **options)
        yield folder / f"{label}.tga", "g"
    random_numbers = np.random.default_rng(0)
    halves = random_numbers.random((33, 40)).astype(np.float16)
    singles = random_numbers.random((33, 40), np.float32)
    tiles = {"type": OpenEXR.tiledimage, "tiles": OpenEXR.TileDescription()}
    yield write_exr(folder / "mixed.exr", R=halves, G=singles), "R"
    yield write_exr(folder / "piz.exr", OpenEXR.PIZ_COMPRESSION, R=halves), "R"
    yield write_exr(folder / "dwa.exr", OpenEXR.DWAA_COMPRESSION, R=halves), "R"
    yield write_exr(folder / "tiled.exr", header=tiles, R=halves), "R"


@pytest.mark.parametrize("suffix", [".png", ".tif", ".tga", ".exr"])
def test_damaged_files(tmp_path, suffix):
    chance = random.Random(0)
    whole = tmp_path / "whole"
    whole.mkdir()
    for source, channel in sources(whole):
        if source.suffix != suffix:
            continue
        folder = tmp_path / source.stem
        folder.mkdir()
        for index in range(TRIES):
            content = damaged(source.read_bytes(), chance)
            (folder / f"bad{index}{suffix}").write_bytes(content)
        line = [sys.executable, "-c", CHILD, folder, channel, suffix]
        done = subprocess.run(line, capture_output=True, text=True, check=False)
        assert (done.returncode, done.stdout, done.stderr) == (0, "survived\n", ""), source
        assert all(entry.name.startswith("bad") for entry in folder.iterdir())


@pytest.mark.parametrize("name", ["out.png", "out.tif", "out.tga", "out.exr"])
@pytest.mark.parametrize("limit", [0, 10000, 50000, 100000])
def test_a_full_disk_leaves_nothing(tmp_path, name, limit):
    source = write_png(tmp_path / "a.png", samples(200, 200, 3, np.uint8))
    if name == "out.exr":
        texels = np.random.default_rng(0).random((200, 150), np.float32)
        source = write_exr(tmp_path / "a.exr", OpenEXR.NO_COMPRESSION, G=texels)
    limited = (
        "import resource, signal, sys; from mdfconv import MdfconvError;"
        "from mdfconv.scene import TextureRule, convert_texture_file;"
        "signal.signal(signal.SIGXFSZ, signal.SIG_IGN);"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[3]),) * 2);"
        "rule = TextureRule('ggx', 'ggx:roughness')\n"
        "try: convert_texture_file(sys.argv[1], sys.argv[2], rule, channel='g')\n"
        "except MdfconvError as error: print(str(error).count('\\n'), str(error)[:12])"
    )
    line = [sys.executable, "-c", limited, source, tmp_path / name, str(limit)]
    done = subprocess.run(line, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "0 cannot write\n", "")
    assert not (tmp_path / name).exists()
    assert not list(tmp_path.glob(".*"))
