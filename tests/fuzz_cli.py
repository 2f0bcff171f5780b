"""Random command lines, from the grammar that each command declares, run in this process."""

import json
import os
import shlex
from pathlib import Path
from unittest import mock

import numpy as np
import typer
from PIL import Image

from mdfconv.cli import app
from tests import fuzz_api as api
from tests.cli.runner import run_here

GROUP = typer.main.get_command(app)
# Seconds to minutes each, and hardly an option that does not end them at once.
LEFT_OUT = {"report", "bench", "stability"}
# How often a command comes up: those that take a second seldom.
SELDOM = {"compare": 0.004, "plot-error": 0.01, "recommend": 0.01, "fit-table": 0.05, "fit": 0.1,
          "formula": 0.1, "light": 0.05, "furnace": 0.3}  # fmt: skip
COMMANDS = [name for name in GROUP.list_commands(None) if name not in LEFT_OUT]
WEIGHTS = [SELDOM.get(name, 1.0) for name in COMMANDS]
INTEGERS = ["-1", "0", "1", "2", "3", "10", "64", "1e3", "99999999999999999999", "x", "2.5"]
INPUTS = ["", "0.2\n", "0.2\n0.3\n", "nan\n", "0.2,0.3\n", "x\n", "\n\n", "1e-320\n", "\ufeff0.2\n",
          "0.2\r\n", "0 1\n", "\0\n", "1e400\n"]  # fmt: skip
RANGES = ["0.01:0.8", "0.1:1:3", "1:1", "1:0", "0:1:2", "1e-320:1e308:3", "0.1:1:99999999999", "x",
          "nan:nan", ":", "0.1:0.2:0", "1:10", "inf:inf:2"]  # fmt: skip
TOLD = ("mdfconv: wrote", "mdfconv: note:", "mdfconv: left out:")
# Of two commands in three that fit something.
MEASURED = ["scan.csv", "data.csv"]
DEGREES = ["0", "1", "5", "30", "45", "80", "1e30"]
FILES = ["data.csv", "scan.csv", "map.png", "rough.png", "chair.mtl", "chair.glb", "folder",
         "missing.csv", "empty", "/dev/null", "noise.bin", "no/such/file", "lib.gltf"]  # fmt: skip
OUTPUTS = ["out.csv", "out.png", "out.json", "out.md", "folder", "folder/", "no/such/file",
           "data.csv", "/dev/null", "/dev/full", "new/", "x.mtl", "x.glb"]  # fmt: skip


class _Cli:
    """Command lines."""

    def write_files(self):
        """Write the files that the commands may read into the current folder."""
        Path("folder").mkdir()
        beta = np.linspace(0, 1.5, 20)
        rows = [f"{angle},{np.exp(-np.square(np.tan(angle) / 0.3))}" for angle in beta]
        Path("data.csv").write_text("\n".join(["beta,value", *rows]))
        angles = [(i, o) for i in (15, 45, 60) for o in range(-70, 75, 10)]
        rows = [f"{i},{o},{0.1 + np.exp(-np.square((o - i) / 20))},0.01" for i, o in angles]
        Path("scan.csv").write_text("\n".join(["theta_i,theta_o,value,sigma", *rows]))
        Image.fromarray(np.arange(128, dtype=np.uint8).reshape(8, 16)).save("map.png")
        Image.fromarray(np.arange(64, dtype=np.uint8).reshape(8, 8)).save("rough.png")
        Path("chair.mtl").write_text("newmtl a\nNs 10\nnewmtl b\nNs x\nmap_Ns rough.png\nPr 0.5\n")
        Path("lib.gltf").write_text(
            '{"asset": {"version": "2.0"}, "materials": '
            '[{"pbrMetallicRoughness": {"roughnessFactor": 0.5}}]}'
        )
        Path("empty").write_bytes(b"")
        Path("noise.bin").write_bytes(bytes(range(256)))
        Path("chair.glb").write_bytes(b"glTF\2\0\0\0" + bytes(20))

    def draw(self, choose, name=None):
        """Return the name of a command, any if not given, and its line with what it reads."""
        name = name or choose.choices(COMMANDS, WEIGHTS)[0]
        with typer.Context(GROUP) as context:
            parameters = GROUP.get_command(context, name).get_params(context)
        words = []
        for parameter in parameters:
            words += _words(parameter, choose, name)
        if choose.random() < 0.03:
            words.insert(choose.randrange(len(words) + 1), choose.choice(["--x", "-", "--", "-1"]))
        return f"mdfconv {name}", ([name, *words], choose.choice(INPUTS))

    def text(self, case):
        """Return a command line as a shell takes it."""
        line, stdin = case
        return f"printf {shlex.quote(stdin)} | mdfconv {shlex.join(line)}"

    def run(self, case):
        """Run a command line; return the class of its outcome, raise for what is none."""
        line, stdin = case
        with mock.patch.dict(os.environ, MDFCONV_DEBUG="1"):
            status, out, err = run_here(*line, stdin=stdin)
        assert status in (0, 1, 2), f"status {status}: {' '.join(err.splitlines()[-3:])}"
        if status == 2:
            # What was written and noted before stays said.
            lines = [text for text in err.splitlines() if not text.startswith(TOLD)]
            assert len(lines) == 1, f"not one line: {err}"
            assert lines[0].startswith("mdfconv: "), f"no line of mdfconv: {err}"
        assert "Traceback" not in err, f"a traceback: {err}"
        if status == 0 and line[0] == "fit" and out.startswith("["):
            _check_fits(json.loads(out))
        return f"exit {status}"


def _check_fits(records):
    """Check that of each file and channel one fit is recommended, and it is judged."""
    best = [record for record in records if record["recommended"]]
    places = {(record.get("file"), record.get("channel")) for record in records}
    assert len(best) == len(places), f"{len(best)} of {len(records)} fits are recommended"
    for record in best:
        assert record["verdict"] in ("good", "usable", "poor")
        assert record["checks"]
        assert record["parameter"] > 0
        assert record["error"] is not None


def _words(parameter, choose, command):
    """Return the words for a parameter of a command, none where it is left out."""
    argument = parameter.param_type_name == "argument"
    wanted = parameter.required or argument
    is_fit = command == "fit"
    if choose.random() < (0.02 if wanted else 0.94 if is_fit else 0.75):
        return []
    if getattr(parameter, "is_flag", False):
        return [choose.choice([*parameter.opts, *parameter.secondary_opts])]
    count = choose.choice([1, 1, 2, 3]) if parameter.nargs == -1 or parameter.multiple else 1
    words = [_word(parameter, choose) for _ in range(count)]
    if is_fit and choose.random() < 0.7:
        if argument:
            return [choose.choice(MEASURED)]
        if parameter.type.name == "float":
            words = [choose.choice(DEGREES)]
    if argument:
        return words
    return [text for word in words for text in (parameter.opts[0], word)]


def _word(parameter, choose):
    """Return one word for a parameter."""
    kind, shown = parameter.type, parameter.metavar or ""
    if choose.random() < 0.03:
        return choose.choice(api.JUNK).replace("\0", "")
    if hasattr(kind, "choices"):
        return str(choose.choice([*kind.choices])) if choose.random() < 0.97 else "x"
    if kind.name == "integer":
        return choose.choice(INTEGERS)
    if kind.name == "float" or shown in ("VALUE...", "G", "N", "E", "L"):
        return _number(choose, pairs=shown == "VALUE...")
    if shown.startswith("MDF"):
        return str(api.endpoint_name(choose)).replace("\0", "")
    if ":" in shown:
        return choose.choice(RANGES)
    if shown.startswith(("METHOD", "METRIC")):
        name = (api.method_name if shown == "METHOD" else api.metric_name)(choose)
        return str(name or "environment")
    if kind.name in ("path", "file") or shown.startswith(("IN", "OUT", "DIR", "FILE", "DATA")):
        return choose.choice(OUTPUTS if "--output" in parameter.opts else FILES)
    offered = [item.value for item in parameter.shell_complete(typer.Context(GROUP), "")]
    return choose.choice([*offered, "x"])


def _number(choose, *, pairs):
    text = repr(api.number(choose))
    roll = choose.random()
    if pairs and roll < 0.1:
        return f"{text},{api.number(choose)!r}"
    if pairs and roll < 0.15:
        return "-"
    return choose.choice([f"{text}%", f"{text}x", "1_0", "٣", " 1"]) if roll > 0.97 else text


CLI = _Cli()
