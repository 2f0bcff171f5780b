"""What the shell completes: every name that an option takes, and what follows its colon."""

import os
import subprocess
import sys

import pytest
import typer

import mdfconv
from mdfconv.cli import app, completion
from mdfconv.distributions.endpoint import encodings_of
from mdfconv.fitting.metrics import list_metrics
from mdfconv.formula import LANGUAGES
from mdfconv.scene.texture.rule import TextureRule

# Completion is bound to the name of the installed program, which `python -m` is not.
PROGRAM = "import sys; sys.argv[0] = 'mdfconv'; from mdfconv.cli import main; main()"
GROUP = typer.main.get_command(app)
COMMANDS = GROUP.list_commands(None)
# What these options take is not a name from a list.
FREE = {
    "gltf": {"--output"},
    "mtl": {"--output"},
    "mitsuba": {"--output"},
    "fit": {
        "--gamma",
        "--noise",
        "--uncertainty",
        "--angle",
        "--theta-i",
        "--phi-i",
        "--theta-o",
        "--phi-o",
        "--values",
    },
    "convert": {"--gamma"},
    "recommend": {"--gamma"},
    "formula": {"--gamma", "--range"},
    "texture": {"--gamma", "--channel", "--to-channel", "--output"},
    "fit-table": {"--sweep"},
}


def completed(words, number):
    """Return what bash is answered for its array of words and the index of the current one."""
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM],
        capture_output=True,
        text=True,
        env={
            "COMP_WORDS": "\n".join(words),
            "COMP_CWORD": str(number),
            "_MDFCONV_COMPLETE": "complete_bash",
            "PATH": "/usr/bin:/bin",
            "PYTHONPATH": os.pathsep.join(sys.path),
        },
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout.split()


@pytest.mark.parametrize(
    ("words", "number", "expected"),
    [
        (["con"], 1, ["convert"]),
        (["convert", "--from", "gg"], 3, ["ggx"]),
        (["convert", "--to", "al"], 3, ["all"]),
        (["convert", "--to", "ggx:rough"], 3, ["ggx:roughness"]),
        # As bash divides words: only what stands behind the last colon is replaced.
        (["convert", "--to", "ggx", ":", "rough"], 5, ["roughness"]),
        (["convert", "--from", "ggx", ":", "roughness", "--to", "gg"], 7, ["ggx"]),
        (["convert", "--from", "ggx", ":", "roughness", "--met"], 6, ["--method", "--metric"]),
        (["convert", "--metric", "en"], 3, ["energy", "environment"]),
        (["convert", "--method", "f"], 3, ["fit", "fast"]),
        (["formula", "--lang", "h"], 3, ["hlsl"]),
        (["furnace", "--brdf", "ph"], 3, ["phong"]),
        (["furnace", "--brdf", "ggx", ":", "rou"], 5, ["roughness"]),
        (["furnace", "--brdf", "phong", ":", "re"], 5, []),
        (["fit", "--fresnel", "io"], 3, ["ior:"]),
        (["fit", "--angle-unit", "r"], 3, ["radians"]),
        (["mtl", "--to", "s"], 3, ["shininess"]),
        (["mitsuba", "--to", "b"], 3, ["beckmann"]),
        (["gltf", "--from", "blinn-phong", ":", "obj2"], 5, ["obj2gltf"]),
        (["texture", "--from", "blinn-phong", ":", "lo"], 5, ["log2"]),
        (["texture", "--from", "blinn-phong", ":", "ref"], 5, ["reflected", "reflected-exponent"]),
        (["convert", "--to", "konvert", ":", "l"], 5, []),
    ],
)
def test_in_bash(words, number, expected):
    assert completed(["mdfconv", *words], number) == expected


@pytest.mark.parametrize("mdf", mdfconv.list_distributions(), ids=lambda mdf: mdf.name)
def test_every_encoding_is_offered(mdf):
    assert mdf.name in completion.endpoints("")
    offered = completion.endpoints(f"{mdf.name}:")
    assert offered == [f"{mdf.name}:{name}" for name in encodings_of(mdf)]
    for name in completion.texels(f"{mdf.name}:"):
        if name.startswith(f"{mdf.name}:") and name.endswith(("log2", "exponent")):
            assert TextureRule(name, name).endpoints()[0].label == name


def test_every_metric_and_language_is_offered():
    assert completion.metrics() == list(list_metrics())
    assert completion.languages() == LANGUAGES.names


@pytest.mark.parametrize("command", COMMANDS)
def test_every_option_that_takes_a_name_completes(command):
    context = typer.Context(GROUP)
    for option in GROUP.get_command(context, command).get_params(context):
        named = (
            option.param_type_name == "option" and type(option.type).__name__ == "StringParamType"
        )
        if named and not FREE.get(command, set()) & set(option.opts):
            assert option._custom_shell_complete, f"{command} {option.opts}"
