"""One file, one line: what is registered works everywhere, and its missing oracle is noticed."""

import csv
import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import mdfconv

HERE = Path(__file__).parent
# Runs commands in one process, and writes what each said.
RUNNER = """
import io, json, sys
import registered
from matplotlib.figure import Figure
from mdfconv.cli import main
from mdfconv.studies import bench

# What is drawn and how long it takes is not the question here.
Figure.savefig = lambda figure, file, **options: file.write(b"a picture")
bench.QUICK = bench.Sizes(
    angles=512, conversions=64, fits=4, loop=2, rounds=2, patience=0.05
)

answers = []
for arguments in json.load(sys.stdin):
    streams = [io.TextIOWrapper(io.BytesIO(), encoding="utf-8") for _ in range(2)]
    sys.argv, (sys.stdout, sys.stderr) = ["mdfconv", *map(str, arguments)], streams
    try:
        main()
    except SystemExit as end:
        status = end.code
    except Exception as error:
        status = repr(error)
    for stream in streams:
        stream.flush()
    answers.append([status, *(stream.buffer.getvalue().decode() for stream in streams)])
json.dump(answers, sys.__stdout__)
"""
NAMES = ("cubic-slope", "power-slope")
COMMANDS = {
    "list": ["list"],
    **{f"convert {n}": ["convert", "--from", "beckmann", "--to", n, 0.2] for n in NAMES},
    **{f"convert from {n}": ["convert", "--from", n, "--to", "ggx", 0.2] for n in NAMES},
    "convert all": ["convert", "--from", "beckmann", "--to", "all", "--method", "fit", 0.2],
    "convert fast": [
        "convert", "--from", "beckmann", "--to", "cubic-slope", "--method", "fast", 0.2,
    ],
    "convert power": ["convert", "--from", "ggx", "--to", "power-slope", "--gamma", "5", 0.2],
    "convert free": [
        "convert", "--from", "student-t", "--to", "power-slope", "--gamma", "free", "--metric",
        "energy", 0.2,
    ],
    "convert illegal": ["convert", "--from", "cubic-slope", "--to", "ggx", 0.9],
    "convert root": [
        "convert", "--from", "beckmann", "--to", "ggx", "--method", "fit", "--metric", "root", 0.2,
    ],
    "convert fast root": [
        "convert", "--from", "beckmann", "--to", "ggx", "--method", "fast", "--metric", "root", 0.2,
    ],
    "convert table": [
        "convert", "--from", "beckmann", "--to", "ggx", "--format", "table", 0.2,
    ],
    "fit-table": ["fit-table", "--m-b", 0.2, "--extended"],
    "fit-table root": ["fit-table", "--m-b", 0.2, "--metric", "root"],
    "fit": ["fit", "lobe.csv", "--angle-unit", "radians"],
    "formula": ["formula", "--from", "beckmann", "--to", "cubic-slope", "--lang", "c"],
    "formula from": ["formula", "--from", "cubic-slope", "--to", "ggx", "--lang", "glsl"],
    "formula root": ["formula", "--from", "beckmann", "--to", "ggx", "--metric", "root"],
    "plot-error": [
        "plot-error", "--m-b", 0.2, "--mdf", "cubic-slope", "--mdf", "power-slope", "--method",
        "fit", "--no-png", "--output", ".",
    ],
    "compare": [
        "compare", 0.2, "--to", "cubic-slope", "--method", "fit", "--metric", "root",
        "--size", 32, "--dpi", 40, "--output", ".",
    ],
    "recommend": ["recommend", "--from", "cubic-slope", 0.2, "--format", "csv"],
    "recommend root": ["recommend", "--from", "beckmann", 0.2, "--metric", "root"],
    "stability": ["stability", "--mdf", "cubic-slope"],
    "bench": [
        "bench", "--quick", "--from", "cubic-slope", "--to", "beckmann", "--format", "json",
    ],
    "mtl root": ["mtl", "one.mtl", "-o", "two.mtl", "--metric", "root", "--format", "json"],
    "report": ["report", "--output", "report"],
}  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("registered")
    shutil.copy(HERE / "registered.py", path)
    (path / "one.mtl").write_text("newmtl a\nNs 100\n")
    student = mdfconv.distribution("student-t").with_gamma(3)
    rows = [f"{beta / 100},{student.unit(beta / 100, 0.2)}" for beta in range(80)]
    (path / "lobe.csv").write_text("\n".join(["theta,D", *rows]))
    return path


@pytest.fixture(scope="module")
def answers(folder):
    done = subprocess.run(
        [sys.executable, "-c", RUNNER],
        input=json.dumps(list(COMMANDS.values())),
        capture_output=True,
        text=True,
        cwd=folder,
        check=True,
    )
    return dict(zip(COMMANDS, json.loads(done.stdout), strict=True))


REFUSED = {
    "convert fast": "fast has no conversion from beckmann to cubic-slope; use half-angle",
    "convert illegal": "cubic-slope a = 0.9 is outside the legal range: 0 < a ≤ 0.85",
    "convert fast root": "fast has no conversion stored from beckmann to ggx under the root metric",
}


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_takes_what_is_registered(answers, command):
    status, out, err = answers[command]
    if command in REFUSED:
        assert (status, out) == (2, "")
        assert REFUSED[command] in err
        assert err.count("\n") == 1
    else:
        assert status == 0, err
        assert out or "wrote" in err


def test_the_answers_make_sense(answers):
    out = {command: answer[1] for command, answer in answers.items()}
    assert set(NAMES) <= set(out["list"].split())
    # The default is the fit where there is no closed form.
    cubic, power = (float(out[f"convert {name}"]) for name in NAMES)
    assert cubic == pytest.approx(power, rel=1e-8)
    assert 0.2 < cubic < 0.25
    alpha, gamma = map(float, out["convert free"].split())
    assert (alpha, gamma) != (0.2, 3)
    assert {"cubic-slope", "power-slope"} <= {
        line.split()[0] for line in out["convert all"].splitlines()
    }
    assert "in between" in out["convert table"]
    (row,) = csv.DictReader(out["fit-table"].splitlines())
    assert float(row["gamma_power_slope"]) == pytest.approx(40)
    assert float(row["rmse_cubic_slope"]) < float(row["rmse_c_tr"])
    fits = list(csv.DictReader(out["fit"].splitlines()))
    assert fits[0]["distribution"] in ("cubic-slope", "power-slope", "student-t")
    assert "cubic_slope_scale_from_beckmann_alpha" in out["formula"]
    bench = json.loads(out["bench"])
    measured = {row["distribution"] for row in bench["substitutes"]}
    assert set(NAMES) <= measured
    assert {row["metric"] for row in bench["methods"]} >= {"root", "unit"}
    (library,) = json.loads(out["mtl root"])
    assert library["metric"] == "root"
    assert 0.2 < library["materials"][0]["roughness"] < 0.5


def test_the_report_is_whole(answers, folder):
    assert answers["report"][0] == 0
    names = {path.name for path in (folder / "report").iterdir()}
    assert {"README.md", "table2-root.md", "methods.md", "stability.md"} <= names
    audit = (folder / "report" / "stability.md").read_text()
    assert "| cubic-slope | unit | no stored references |  |  |  |  |  |  |" in audit
    methods = (folder / "report" / "methods.csv").read_text()
    assert "root,peak,40" in methods
    assert "root,fit" not in methods


@pytest.mark.parametrize(
    "tests", ["test_kernels.py", "test_normalization.py", "test_cumulative.py"]
)
def test_a_missing_oracle_is_noticed(folder, tests):
    """Of a wrong lobe, too, as no test could agree with it."""
    done = subprocess.run(
        [
            sys.executable, "-m", "pytest", "-o", "addopts=", "-p", "registered", "-q", "-x",
            "-k", "cubic", HERE / "distributions" / tests,
        ],
        capture_output=True,
        text=True,
        cwd=HERE.parent,
        env={"PYTHONPATH": str(folder), "PATH": "/usr/bin:/bin"},
        check=False,
    )  # fmt: skip
    if tests in ("test_normalization.py",):
        # Quadrature needs no oracle: the lobe is right.
        assert done.returncode == 0, done.stdout
    else:
        assert done.returncode == 1, done.stdout
        assert "KeyError: 'cubic-slope'" in done.stdout
