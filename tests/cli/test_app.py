"""The command line as a whole: help, version, list, completion, start-up."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

import mdfconv.cli
from mdfconv.cli import _PANELS
from tests.cli.runner import run


def test_version_and_help():
    assert run("--version") == (0, f"mdfconv {mdfconv.__version__}\n", "")
    status, out, err = run("--help")
    assert (status, err) == (0, "")
    assert "mdfconv convert --from beckmann --to ggx 0.2" in out
    assert run()[:2] == (status, out)


@pytest.mark.parametrize(
    "command", ["convert", "list", "fit", "fit-table", "report", "plot-error", "compare"]
)
def test_every_command_has_help_with_examples(command):
    status, out, _ = run(command, "--help")
    assert status == 0
    assert "Examples:" in out
    assert f"mdfconv {command}" in out


def test_unknown_command():
    status, out, err = run("konvert")
    assert (status, out) == (2, "")
    assert err.count("\n") == 1


def test_list():
    assert run("list")[1].split() == [entry.name for entry in mdfconv.list_distributions()]
    status, out, _ = run("list", "--format", "json")
    assert status == 0
    found = {record["name"]: record for record in json.loads(out)}
    assert found["ggx"]["aliases"] == ["trowbridge-reitz", "tr"]
    encodings = found["ggx"]["encodings"]
    assert (encodings["roughness"], encodings["glossiness"]) == ("α = r²", "α = (1 − g)²")
    assert encodings["pbrt-v4"] == "α = √r"
    assert found["ggx"]["anisotropic"]
    assert found["gtr"]["parameters"][1]["symbol"] == "γ"
    assert all(record["source"] and record["unit_form"] for record in found.values())
    status, out, _ = run("list", "--format", "table")
    assert status == 0
    assert "trowbridge-reitz" in out
    status, out, _ = run("list", "--format", "csv")
    assert status == 0
    assert "name: alpha; symbol: m_B; legal: m_B > 0; typical: 0.01,0.8" in out
    assert "{" not in out


def test_help_shows_every_command_in_its_panel():
    out = run("--help")[1]
    places = [out.index(f"─ {panel} ─") for panel in _PANELS]
    assert places == sorted(places)
    for panel, start, end in zip(_PANELS, places, [*places[1:], len(out)], strict=True):
        for command in _PANELS[panel]:
            assert f"│ {command} " in out[start:end]


def test_every_command_is_in_one_panel():
    files = {
        path.stem.removesuffix("_command").replace("_", "-")
        for path in Path(mdfconv.cli.__file__).parent.glob("*_command.py")
    }
    named = [name for names in _PANELS.values() for name in names]
    assert sorted(named) == sorted(
        name.removesuffix("_command").replace("_", "-") for name in files
    )


def test_start_up_imports_only_what_the_command_needs():
    code = (
        "import sys; sys.argv = ['mdfconv', 'convert', '--from', 'beckmann', '--to', 'ggx', '1'];"
        "from mdfconv.cli import main\n"
        "try: main()\n"
        "except SystemExit: print(sorted({'scipy', 'matplotlib', 'rich.table'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"
