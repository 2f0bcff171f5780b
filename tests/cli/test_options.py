"""Options over all commands: one wording, and none that is ignored without a word."""

import json
import re
from collections import defaultdict

import pytest
from PIL import Image
from typer.main import get_command

from mdfconv.cli import app
from tests.cli.runner import run
from tests.light.maps import room, write_map

COMMANDS = {
    name: get_command(app).get_command(None, name) for name in get_command(app).list_commands(None)
}
# Options with one name that are not of one kind: files and folders, switches, choices.
SEVERAL = {
    "--output": {"FILE", "DIR", "OUT"},
    "--from": {"MDF", "MDF:ENCODING", "MDF:PROGRAM"},
    "--to": {"MDF", "MDF:ENCODING", "WHAT"},
    "--png": {"FILE", None},
    "--csv": {"FILE", None},
    "--brdf": {"BRDF", None},
}


def options():
    found = defaultdict(list)
    for command, definition in COMMANDS.items():
        for option in definition.params:
            if option.param_type_name == "option":
                found[max(option.opts, key=len)].append((command, option))
    return found


@pytest.mark.parametrize("name", sorted(options()))
def test_an_option_is_spelled_alike_in_every_command(name):
    entries = options()[name]
    flags = {tuple(sorted(option.opts)) for _, option in entries}
    assert len(flags) == 1, flags
    metavars = {option.metavar for _, option in entries}
    assert metavars <= SEVERAL.get(name, metavars)
    if name not in SEVERAL:
        assert len(metavars) == 1, metavars
    assert all(option.help for _, option in entries)


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("mtl a.mtl -o b.mtl --exponent-max 10", "--exponent-max goes with --textures"),
        ("mtl a.mtl -o b.mtl --to shininess --textures", "go with --to roughness"),
        ("furnace 0.5 --seed 1", "--seed goes with --mc"),
        ("furnace 0.5 --normalizer arvo", "has no normalizer"),
        ("gltf a.gltf -o b.gltf --from blinn-phong:fbx --lossy", "--lossy goes with --textures"),
        ("gltf a.gltf -o b.gltf --from blinn-phong:fbx --texels ggx:alpha",
         "--texels goes with --textures"),
        ("fit-table --closed-forms --metric energy", "--metric does not go"),
        ("fit-table --exposure 2", "has no exposure"),
        ("formula --from ggx --to beckmann --all --tolerance 1", "--tolerance does not go"),
        ("formula --from ggx --to beckmann --format csv", "--format is the form of the table"),
        ("formula --from ggx --to ggx:roughness --range 0.1:1", "--range goes with a search"),
        ("plot-error --no-png --log", "--log is of pictures"),
        ("plot-error --no-png --dpi 100", "--dpi is of pictures"),
        ("list --metric unit", "--metric is of --encodings"),
        ("compare --method closed-form --metric energy", "--metric goes with a fit"),
        ("texture a.png -o b.png --from ggx:alpha --to ggx:roughness --exponent-max 9",
         "--exponent-max goes with blinn-phong:exponent"),
        ("texture a.png -o b.png --from ggx:alpha --to ggx:roughness --log2-scale 9",
         "--log2-scale goes with blinn-phong:log2"),
        ("texture a.png -o b.png --from ggx:alpha --to beckmann:alpha --method peak --metric unit",
         "--metric goes with a fit"),
        ("convert --from ggx --to beckmann --gamma 3 0.2", "γ"),
        ("convert --from ggx --to beckmann --specular 0.5 0.2", "specular"),
        ("convert --from ggx --to beckmann --exposure 2 0.2", "exposure"),
    ],
)  # fmt: skip
def test_an_option_that_would_be_ignored_is_refused(line, words, tmp_path):
    status, out, err = run(*line.split(), cwd=tmp_path)
    assert (status, out) == (2, "")
    assert words in err
    assert err.count("\n") == 1
    assert not list(tmp_path.iterdir())


LIBRARY = "newmtl a\nNs 100\nmap_Ns x.png\n"
SCENE = '<scene version="3.0.0"><bsdf type="roughplastic"/></scene>'
LOBE = "theta,v\n" + "".join(f"{t},{1 / (1 + t * t / 99)}\n" for t in range(60))
WRITING = [
    "mtl a.mtl -o new/ --textures",
    "mtl a.mtl --in-place --textures",
    "gltf a.gltf -o new.gltf --from blinn-phong:obj2gltf --textures --texels ggx:glossiness",
    "mitsuba a.xml -o new.xml",
    "texture x.png -o new.png --from blinn-phong:exponent --to ggx:roughness --png h.png",
    "fit a.csv --to ggx -o new.csv --png new.png --report new.md",
    "fit-table --m-b 0.2 -o new.csv",
    "formula --from ggx:glossiness --to ggx:roughness -o new.glsl",
    "plot-error -o new --svg --m-b 0.2",
    "compare -o new --size 32 0.3",
    "compare --html new.html",
    "light map.exr --csv new.csv --png new.png",
    "furnace 0.5 --png new.png -o new.txt",
    "fresnel --png new.png -o new.json",
    "stability --mdf sawicki -o new.csv --part kernels",
    pytest.param("bench --quick --csv a --json b --png c", marks=pytest.mark.slow),
    pytest.param("report -o new", marks=pytest.mark.slow),
]


def test_every_command_that_writes_is_asked():
    lines = [*WRITING[:-2], *(parameter.values[0] for parameter in WRITING[-2:])]
    kinds = {"--output", "--png", "--csv", "--json", "--html", "--report"}
    writing = {command for name in kinds for command, _ in options()[name]}
    assert {line.split()[0] for line in lines} == writing, (
        "each command that writes files has a line in WRITING of this file"
    )


@pytest.mark.parametrize("line", WRITING)
def test_each_file_that_is_written_is_named(line, tmp_path):
    (tmp_path / "a.mtl").write_text(LIBRARY)
    (tmp_path / "a.xml").write_text(SCENE)
    (tmp_path / "a.csv").write_text(LOBE)
    texture = {"index": 0}
    pbr = {"roughnessFactor": 0.9, "metallicRoughnessTexture": texture}
    document = {
        "asset": {"version": "2.0"},
        "materials": [{"pbrMetallicRoughness": pbr}],
        "textures": [{"source": 0}],
        "images": [{"uri": "rgb.png"}],
    }
    (tmp_path / "a.gltf").write_text(json.dumps(document))
    Image.new("L", (2, 2), 100).save(tmp_path / "x.png")
    Image.new("RGB", (2, 2), (1, 100, 3)).save(tmp_path / "rgb.png")
    write_map(tmp_path / "map.exr", room())
    before = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    status, out, err = run(*line.split(), cwd=tmp_path)
    assert status == 0, err
    after = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    changed = {path for path, content in after.items() if before.get(path) != content}
    told = re.findall(r"^mdfconv: wrote ([^:\n]*)", err, re.MULTILINE)
    assert changed
    assert sorted(tmp_path / name for name in told) == sorted(changed)
    assert "wrote" not in out
