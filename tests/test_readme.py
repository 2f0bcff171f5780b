"""The README tells the truth: its examples are run, its commands exist."""

import doctest
import json
import re
import shlex
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import mdfconv
from tests.cli.runner import run

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text()
CONSOLE = re.findall(r"```console\n(.*?)```", README, re.S)


def examples():
    """Return (command line, expected output) for every prompt in a console block."""
    for block in CONSOLE:
        for chunk in re.split(r"^\$ ", block, flags=re.M)[1:]:
            line, _, expected = chunk.partition("\n")
            yield line, expected


@pytest.fixture(autouse=True)
def _checkout(tmp_path):
    """A folder with the tracked files that commands would write by default: none may change."""
    reports = tmp_path / "reports"
    reports.mkdir()
    names = [path.name for path in (ROOT / "reports").iterdir()]
    for name in names:
        (reports / name).write_text("tracked")
    yield
    assert {path.name: path.read_text() for path in reports.iterdir()} == dict.fromkeys(
        names, "tracked"
    )


@pytest.mark.parametrize(("line", "expected"), list(examples()))
def test_console_example(line, expected, tmp_path):
    if not line.startswith("mdfconv"):
        assert re.match(r"make (demo|test)$|pip install", line)
        return
    # The README shows what a terminal shows: a table.
    words = shlex.split(line)[1:]
    if words[0] == "convert" and "--format" not in words:
        words += ["--format", "table"]
    status, out, _ = run(*words, cwd=tmp_path)
    assert status == 0
    assert normal(out) == normal(expected)


def normal(text):
    return [" ".join(line.split()) for line in text.splitlines() if line.strip(" ─")]


def test_python_examples():
    module = doctest.testmod(mdfconv)
    parser = doctest.DocTestParser()
    test = parser.get_doctest(
        "\n".join(re.findall(r"```pycon\n(.*?)```", README, re.S)), {}, "README", "README.md", 0
    )
    outcome = doctest.DocTestRunner().run(test)
    assert outcome.failed == module.failed == 0
    assert outcome.attempted > 3
    assert module.attempted


@pytest.mark.parametrize("module", ["mdfconv.conversion.values", "mdfconv.distributions"])
def test_docstring_examples(module):
    found = doctest.testmod(__import__(module, fromlist=["_"]))
    assert found.failed == 0
    assert found.attempted


RECIPES = re.findall(r"^\| .* \| `(mdfconv .*)` \|$", README, re.M)


def files_of_recipes(folder):
    """Write what the recipes start from."""
    (folder / "chair.mtl").write_text("newmtl wood\nNs 100\n")
    robot = {
        "asset": {"version": "2.0", "generator": "obj2gltf"},
        "materials": [{"pbrMetallicRoughness": {"roughnessFactor": 0.9}}],
    }
    (folder / "robot.gltf").write_text(json.dumps(robot))
    texels = np.linspace(20, 250, 64).astype(np.uint8).reshape(8, 8)
    for name in ("gloss.png", "glossiness.png"):
        Image.fromarray(texels).save(folder / name)
    Image.fromarray(np.stack([texels] * 4, axis=-1), "RGBA").save(folder / "unity.png")
    (folder / "kitchen.xml").write_text(
        '<scene version="3.0.0"><bsdf type="roughconductor">'
        '<float name="alpha" value="0.2"/></bsdf></scene>\n'
    )
    beta = np.linspace(0, 80, 60)
    values = mdfconv.distribution("ggx").unit(np.radians(beta), 0.2)
    rows = "\n".join(f"{angle},{value}" for angle, value in zip(beta, values, strict=True))
    (folder / "paint.csv").write_text(f"angle_degrees,value\n{rows}\n")


@pytest.mark.parametrize("line", RECIPES)
def test_recipe(line, tmp_path):
    files_of_recipes(tmp_path)
    words = shlex.split(line)[1:]
    status, out, err = run(*words, cwd=tmp_path)
    assert status == 0, err
    for option in ("-o", "--report"):
        if option in words:
            assert (tmp_path / words[words.index(option) + 1]).stat().st_size
    assert out or "wrote" in err


# Lines of commands that write into ./reports, which is tracked, if they name no folder.
DRAWING = re.findall(r"^ {4}(mdfconv (?:plot-error|compare|report)\b.*?)(?: *#.*)?$", README, re.M)
SMALL = {"compare": ["--size", "64", "--dpi", "20"], "plot-error": ["--dpi", "20"]}


@pytest.mark.parametrize("line", DRAWING)
def test_pictures_go_into_a_folder_that_git_ignores(line, tmp_path):
    words = shlex.split(line)[1:]
    status, _, err = run(*words, *SMALL[words[0]], cwd=tmp_path)
    assert status == 0, err
    assert list((tmp_path / "out").iterdir())
    assert "out/" in (ROOT / ".gitignore").read_text().splitlines()


def test_there_are_recipes():
    assert len(DRAWING) > 3
    commands = {line.split()[1] for line in RECIPES}
    assert {"mtl", "gltf", "texture", "mitsuba", "convert", "formula", "fit"} <= commands


def test_every_command_and_distribution_is_documented():
    from mdfconv.cli import _COMMANDS

    for command in _COMMANDS:
        assert f"mdfconv {command}" in README
    for entry in mdfconv.list_distributions():
        assert f"`{entry.name}`" in README
    for method in mdfconv.list_methods():
        assert f"`{method.name}`" in README
