"""Runs functions of WGSL on a processor: naga validates them, SwiftShader computes.

A program of its own, for a driver that fails ends the process: of standard input it reads a list
of ``{"code", "name", "arguments"}``, and it writes the results, a list of numbers for each.
"""

import ctypes
import json
import os
import shutil
import struct
import subprocess
import sys
from pathlib import Path

SHADER = """
@group(0) @binding(0) var<storage, read> given: array<f32>;
@group(0) @binding(1) var<storage, read_write> made: array<f32>;
{code}
@compute @workgroup_size(1)
fn main(@builtin(global_invocation_id) at: vec3<u32>) {{
    made[at.x] = {name}({arguments});
}}
"""
MISSING = 77


def results(functions):
    """Return what functions make of their arguments; None where there is no driver for it."""
    done = subprocess.run(
        [sys.executable, __file__],
        input=json.dumps(functions),
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode == MISSING:
        return None
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def use_chromium():
    """Take the driver that comes with Chromium, if there is one and no other is asked for."""
    programs = map(shutil.which, ("chromium", "chromium-browser", "chrome"))
    folders = [
        Path("/usr/lib/chromium"),
        *(Path(path).resolve().parent for path in programs if path),
    ]
    for folder in folders:
        driver = folder / "vk_swiftshader_icd.json"
        if driver.exists() and "VK_DRIVER_FILES" not in os.environ:
            ctypes.CDLL(str(folder / "libvulkan.so.1"), ctypes.RTLD_GLOBAL)
            os.environ |= dict.fromkeys(("VK_DRIVER_FILES", "VK_ICD_FILENAMES"), str(driver))


def run(code, name, arguments):
    from wgpu.utils.compute import compute_with_buffers

    count, rows = len(arguments), len(arguments[0])
    given = ", ".join(f"given[at.x * {count}u + {index}u]" for index in range(count))
    values = [value for row in zip(*arguments, strict=True) for value in row]
    shader = SHADER.format(code=code, name=name, arguments=given)
    packed = struct.pack(f"{len(values)}f", *values)
    return list(compute_with_buffers({0: packed}, {1: (rows, "f")}, shader, n=rows)[1])


if __name__ == "__main__":
    use_chromium()
    try:
        from wgpu.utils import get_default_device

        get_default_device()
    except (ImportError, RuntimeError) as error:
        print(error, file=sys.stderr)
        sys.exit(MISSING)
    print(json.dumps([run(**each) for each in json.load(sys.stdin)]))
