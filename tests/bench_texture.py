"""Times and memory of a 4096×4096 texture of 16 bits: ``python -m tests.bench_texture``."""

import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from PIL import Image

from mdfconv.scene import TextureRule, convert_texture, convert_texture_file
from tests.scene.pictures import write_tiff

SIZE = 4096
RULE = TextureRule("blinn-phong:exponent", "ggx:roughness", metric="energy")
_CHILD = (
    "import sys; from tests.bench_texture import *; base = peak();"
    "convert_texture_file(sys.argv[1], sys.argv[2], RULE, depth=int(sys.argv[3]),"
    " channel=sys.argv[4]);"
    "print(base, peak())"
)


def peak():
    """Return the most memory that this process has held, in kB (ru_maxrss is the parent's)."""
    return int(re.search(r"VmHWM:\s+(\d+)", Path("/proc/self/status").read_text())[1])


def texture():
    """Return smooth shading with noise, uint16."""
    y, x = np.mgrid[:SIZE, :SIZE].astype(np.float32) / SIZE
    noise = np.random.default_rng(0).normal(0, 400, (SIZE, SIZE)).astype(np.float32)
    smooth = 32000 + 20000 * np.sin(9 * x) * np.cos(7 * y)
    return np.clip(smooth + noise, 0, 65535).astype(np.uint16)


def timed(function, *arguments, **options):
    start = time.perf_counter()
    result = function(*arguments, **options)
    return time.perf_counter() - start, result


def main():
    given = texture()
    raw = given.nbytes
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        source, output = folder / "in.png", folder / "out.png"
        encoding, _ = timed(Image.fromarray(given).save, source)
        decoding, _ = timed(lambda: Image.open(source).load())
        convert_texture(given[:2], RULE)
        converting, _ = timed(convert_texture, given, RULE)
        dithering, _ = timed(convert_texture, given, RULE, depth=8, dither=True)
        whole, _ = timed(convert_texture_file, source, output, RULE)
        print(f"decode {decoding:.2f} s, encode {encoding:.2f} s, file {whole:.2f} s")
        print(f"convert {converting:.3f} s: {100 * converting / (decoding + encoding):.1f} %")
        print(f"dithered to 8 bits {dithering:.2f} s")
        deep = write_tiff(
            folder / "deep.tif", np.repeat(given[..., None], 3, axis=2), deflate=True, rows=64
        )
        for file, depth, channel, size in (
            (source, 16, "l", raw),
            (source, 8, "l", raw),
            (deep, 16, "g", 3 * raw),
        ):
            line = [sys.executable, "-c", _CHILD, file, output, str(depth), channel]
            done = subprocess.run(line, capture_output=True, text=True, check=True)
            base, most = (1024 * int(word) for word in done.stdout.split())
            print(
                f"{file.name} to {depth} bits: raw {size / 1e6:.0f} MB, peak {most / 1e6:.0f} MB, "
                f"{most / size:.2f} × raw, above the imports {(most - base) / size:.2f} × raw"
            )


if __name__ == "__main__":
    main()
