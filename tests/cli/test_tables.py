"""Tables on a terminal: within its width, no number broken, and what is left out is said."""

import json
import re
from itertools import pairwise

import numpy as np
import pytest
from typer.main import get_command

from mdfconv.cli import app
from tests.cli.runner import run, run_on_terminal
from tests.light.maps import room, write_map

LIBRARY = "newmtl a_material_with_a_long_name\nNs 1234.5678\nNs 100\nnewmtl b\nNs 0\n"
FACTORS = {
    "asset": {"version": "2.0"},
    "materials": [
        {"name": "a material with a long name", "pbrMetallicRoughness": {"roughnessFactor": 0.9}}
    ],
}
SCENE = """<scene version="3.0.0"><bsdf type="roughplastic" id="b"/>
<bsdf type="roughconductor" id="a-bsdf-with-a-long-name">
<float name="alpha_u" value="0.12345678"/><float name="alpha_v" value="0.3"/></bsdf></scene>"""
LOBES = [(to, np.exp(-((to - 20) ** 2) / 300)) for to in range(0, 80, 3)]
BSDF = ["theta_i,phi_i,theta_o,phi_o,red,green"]
BSDF += [f"20,0,{to},180,{lobe + 0.1},{lobe + 0.2}" for to, lobe in LOBES]
LOBE = ["theta,value"] + [f"{t},{np.exp(-(t**2) / 100) + 0.01}" for t in range(60)]
FILES = {
    "a.mtl": LIBRARY,
    "a.gltf": json.dumps(FACTORS),
    "a.xml": SCENE,
    "lobe.csv": "\n".join(LOBE),
    "two.csv": "\n".join(BSDF),
}
# Whether two runs print the same numbers, and the line.
SAME = [
    "convert --from beckmann --to all 0.2",
    "convert --from ashikhmin-shirley --to ggx 100,20",
    "convert --from blinn-phong --to ggx:roughness --metric environment 1 12345.678",
    "convert --from beckmann --to student-t --gamma free 0.2",
    "mtl {0}/a.mtl --compare -o {1}/a.mtl",
    "gltf {0}/a.gltf --from blinn-phong:obj2gltf --compare -o {1}/a.gltf",
    "mitsuba {0}/a.xml --compare -o {1}/a.xml",
    "inspect {0}/a.mtl {0}/a.gltf {0}/a.xml",
    "inspect {0}/lobe.csv {0}/map.exr {0}/two.csv",
    "formula --from beckmann --to ggx --all",
    "formula --from blinn-phong --to ggx:roughness --all --lang latex",
    "fit {0}/lobe.csv",
    "fit {0}/two.csv",
    "fit {0}/two.csv --separate",
    "fit {0}/two.csv {0}/lobe.csv --to ggx",
    "list",
    "list --encodings",
    "fit-table",
    "fit-table --compare",
    "fit-table --m-b 0.3 --extended",
    "fit-table --closed-forms",
    "plot-error --output {1}",
    "compare --size 32 --output {1}",
    "light {0}/map.exr",
    "furnace 0.5 --mc 1000",
    "fresnel",
    "stability --mdf beckmann",
]
TIMED = [
    "recommend --from beckmann 0.2",
    pytest.param("bench --quick", marks=pytest.mark.slow),
]
NO_TABLE = {"report", "texture"}


def test_every_command_is_asked():
    lines = [*SAME, *TIMED[:-1], *TIMED[-1].values]
    commands = set(get_command(app).list_commands(None))
    assert {line.split()[0] for line in lines} | NO_TABLE == commands, (
        "each command has a line in SAME or TIMED of this file, or its name in NO_TABLE"
    )


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    # With a short name, which stands in titles.
    path = tmp_path_factory.mktemp("t")
    for name, text in FILES.items():
        (path / name).write_text(text)
    write_map(path / "map.exr", room())
    return path


def printed(line, columns, folder, output):
    """Return the lines of tables, and what is said of columns that are left out."""
    output.mkdir()
    status, text = run_on_terminal(
        *line.format(folder, output).split(), COLUMNS=str(columns), LINES="50", TERM="dumb"
    )
    assert status == 0, text
    text = re.sub(r"\x1b\[[0-9;?]*[a-zA-Z]", "", text).replace("\r\n", "\n")
    lines = [part.rpartition("\r")[2].rstrip() for part in text.split("\n")]
    told = [part for part in lines if part.startswith("mdfconv: too narrow for ")]
    return [part for part in lines if not re.match(r"mdfconv: |\S+: nothing|\S* *━", part)], told


def columns_left_out(told):
    return {name for text in told for name in re.search(r"for (.*): --format", text)[1].split(", ")}


@pytest.mark.parametrize("line", SAME)
def test_a_table_fits_and_breaks_no_number(line, folder, tmp_path):
    narrow, told = printed(line, 80, folder, tmp_path / "a")
    wide, all_told = printed(line, 900, folder, tmp_path / "b")
    assert max(map(len, narrow)) <= 80
    assert not all_told
    words = {word for text in wide for word in text.split()}
    numbers = [word for text in narrow for word in text.split() if word[-1].isdigit()]
    assert numbers
    paths = str(folder)
    assert [n for n in numbers if n not in words and n not in paths] == []
    # Nothing vanishes that is not spoken of.
    headings = [before for before, rule in pairwise(wide) if "───" in rule]
    shown = " ".join(narrow)
    missing = {
        name for text in headings for name in re.split(r" {2,}", text.strip()) if name not in shown
    }
    assert {name for name in missing if " " not in name} <= columns_left_out(told)


@pytest.mark.parametrize("line", TIMED)
def test_a_table_of_times_fits(line, folder, tmp_path):
    narrow, _ = printed(line, 80, folder, tmp_path / "a")
    assert max(map(len, narrow)) <= 80


def test_what_is_left_out_has_an_option_that_shows_it(folder, tmp_path):
    _, told = printed("fit {0}/two.csv", 80, folder, tmp_path / "a")
    assert len(told) == 1
    assert told[0].endswith(": --format csv has all columns")
    header = run("fit", folder / "two.csv", "--format", "csv")[1].splitlines()[0].split(",")
    # Those for people have symbols: F₀ is f0, a validated error validated_error.
    assert len(header) > len(columns_left_out(told)) > 0
    assert {"f0", "validated_error"} < set(header)
    _, told = printed("mtl {0}/a.mtl -o {1}/a.mtl", 40, folder, tmp_path / "b")
    assert told[0].endswith(": --format json has all columns")


def test_a_pipe_and_a_file_have_every_column(tmp_path):
    arguments = "fit-table", "--m-b", "0.2", "--format"
    columns = run(*arguments, "csv")[1].splitlines()[0].split(",")
    assert run(*arguments, "table")[1].split("───")[0].split()[-len(columns) :] == columns
    run(*arguments, "table", "-o", tmp_path / "a.txt")
    assert (tmp_path / "a.txt").read_text().split("───")[0].split() == columns
