"""What Ns means: the header and the numbers of a library say who wrote it."""

import itertools
import json
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

import mdfconv
from mdfconv.distributions.dialects import DIALECTS
from mdfconv.scene import convert_mtl
from mdfconv.scene.mtl.meaning import asked_meaning, likely_meaning
from mdfconv.scene.stored import ProblemKind
from tests.cli.runner import run, run_on_terminal

PYTHON = "# Blender MTL File: 'None'"
# What exporters print for roughness r or hardness h, as their sources have it.
WRITTEN = {
    "blender-2.8": lambda r: f"{((1.0 - float(np.float32(r))) * 30) ** 2:.6f}",
    "blender-obj": lambda r: f"{(1 - np.float32(r)) ** 2 * np.float32(1000):.6f}",
    "blender-2.7": lambda h: f"{(h - 1) * 1.9607843137254901:.6f}",
}
HEADERS = {
    "blender-2.8": PYTHON,
    "blender-obj": "# Blender 4.4.1 MTL File: 'x.blend'",
    "blender-2.7": PYTHON,
}


def library(header, numbers):
    materials = (f"newmtl m{at}\nNs {number}\n" for at, number in enumerate(numbers))
    return "\n".join([header, *materials]).encode()


@pytest.mark.parametrize(
    ("header", "number", "source", "roughness"),
    [
        ("# Blender 3.3.1 MTL File: 'None'", "250.000000", "blender-obj", 0.5),
        ("# Blender 3.1.0 MTL File: 'None'", "225.000000", "blender-2.8", 0.5),
        ("# Blender 3.2.2 MTL File: 'None'", "250.000000", "blender-obj", 0.5),
        ("# Blender 5.0.0 Alpha MTL File: 'x'", "250.000000", "blender-obj", 0.5),
        ("# Blender 4.2.3 LTS MTL File: x", "250", "blender-obj", 0.5),
        ("#  Blender  4.2.3 MTL File: x", "250", "blender-obj", 0.5),
        ("# Blender v2.93.1 MTL File", "225.000000", "blender-2.8", 0.5),
        (PYTHON, "225.000000", "blender-2.8", 0.5),
        (PYTHON, "323.999994", "blender-2.8", 0.4),
        (PYTHON, "359.999993", "blender-obj", 0.4),
        # N = 50, and the roughest.
        (PYTHON, "96.078431", "blender-2.7", 0.393186),
        (PYTHON, "-1.960784", "blender-2.7", 1.0),
        ("# Blender3D MTL File: x.blend", "96.078431", "blender-2.7", 0.393186),
    ],
)
def test_headers_and_numbers_of_real_libraries(header, number, source, roughness):
    found = convert_mtl(library(header, [number]))
    assert found.source == f"blinn-phong:{source}"
    assert found.writer.startswith("Blender")
    assert found.materials[0].roughness == pytest.approx(roughness, abs=1e-6)
    assert found.notes == ((1, found.why),)
    assert not found.problems


def test_a_black_ambient_colour_is_of_blender_before_2_8():
    """Every undecided library of a field test had one: from 2.80 on it is never black."""
    data = library(PYTHON, ["0.000000"])
    assert "may be those of blender-2.7 instead" in convert_mtl(data).why
    found = convert_mtl(data + b"Ka 0.000000 0.000000 0.000000\n")
    assert found.source == "blinn-phong:blender-2.7"
    assert found.why == "written by Blender: Ns = 1.960784 (N − 1)"
    assert found.materials[0].exponent == 1


def test_without_a_header_it_is_an_exponent():
    found = convert_mtl(b"# 3ds Max Wavefront OBJ Exporter\nnewmtl a\nNs 250\n")
    assert (found.source, found.writer, found.notes) == ("blinn-phong", "", ())
    assert found.materials[0].exponent == 250
    # And on request in spite of one.
    found = convert_mtl(library(PYTHON, ["225"]), source="blinn-phong")
    best = mdfconv.convert(225.0, "blinn-phong", "ggx:roughness", metric="environment")
    assert found.materials[0].roughness == pytest.approx(best, rel=1e-12)


@pytest.mark.parametrize("count", [1, 2, 5])
def test_values_tell_the_exporters_of_one_header_apart(count):
    """Over all h of 1 … 511 and all r of 0 … 1 in steps of 0.01."""
    hardness = [float(WRITTEN["blender-2.7"](h)) for h in range(1, 512)]
    roughness = [float(WRITTEN["blender-2.8"](n / 100)) for n in range(101)]
    for source, numbers in (("blender-2.7", hardness), ("blender-2.8", roughness)):
        wrong, undecided = set(), set()
        for library_ in (numbers[at : at + count] for at in range(len(numbers) - count + 1)):
            meaning = likely_meaning([(1, PYTHON)], np.array(library_))
            if "instead" in meaning.why:
                undecided |= set(library_)
            elif meaning.end.label != f"blinn-phong:{source}":
                wrong |= set(library_)
        assert not wrong
        # r of 0 and 1 are h of 460 and 1, and of 511 by the rule from 3.3 on: libraries of
        # nothing else.
        ends_alone = {0.0, 900.0} | ({1000.0} if source == "blender-2.7" else set())
        assert undecided == (ends_alone if count == 1 else set())
    ends = itertools.product([0.0, 900.0], repeat=count)
    assert all("instead" in likely_meaning([(1, PYTHON)], np.array(x)).why for x in ends)


def test_the_twenty_first_numbers_against_the_sources():
    for n in range(20):
        r, h = n / 20, 1 + 26 * n
        for source, authored in (("blender-2.8", r), ("blender-obj", r), ("blender-2.7", h)):
            number = WRITTEN[source](authored)
            (found,) = convert_mtl(library("", [number]), source=f"blinn-phong:{source}").materials
            if source == "blender-2.7":
                assert found.exponent == pytest.approx(h, rel=1e-6)
            else:
                assert found.roughness == pytest.approx(r, abs=2e-6)
                assert math.isnan(found.exponent)
                assert found.rmse == 0


STORING = [dialect for dialect in DIALECTS if dialect.roughness]


@settings(deadline=None)
@given(st.sampled_from(STORING), st.floats(0.02, 0.98))
def test_any_roughness_comes_back(dialect, roughness):
    """Written as the program does, r is what Pr says."""
    setting = dialect.setting.example if dialect.setting else 1.0
    stored = dialect.stored.lower + roughness * (dialect.stored.upper - dialect.stored.lower)
    number = float(dialect.decode(np.array(stored), setting))
    wanted = float(np.clip(dialect.roughness(np.array(stored)), 0, 1))
    source = f"blinn-phong:{dialect.name}{f':{setting}' if dialect.setting else ''}"
    found = convert_mtl(f"newmtl a\nNs {number!r}\n".encode(), source=source)
    assert not found.problems
    assert found.materials[0].roughness == pytest.approx(wanted, abs=1e-6)


def test_numbers_that_no_program_wrote_are_left():
    found = convert_mtl(library("# Blender 4.0.0 MTL File", ["1000", "1000.1", "-1"]))
    assert [material.roughness for material in found.materials] == [0]
    assert [problem.text for problem in found.problems] == [
        "Ns '1000.1' is outside 0 ≤ Ns ≤ 1000 of blinn-phong:blender-obj",
        "Ns '-1' is outside 0 ≤ Ns ≤ 1000 of blinn-phong:blender-obj",
    ]


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("ggx", "Ns of a library is not stored as ggx"),
        ("blinn-phong:reflected", "it is an exponent"),
        ("blinn-phong:x3d", "not stored as blinn-phong:x3d"),
        ("blinn-phong:blendr", "did you mean blender"),
    ],
)
def test_what_ns_cannot_be(name, message):
    with pytest.raises(mdfconv.MdfconvError, match=message):
        asked_meaning(name)


AUTHORED = b"newmtl a\nNs 250\nPr 0.5\nnewmtl b\nNs 225\nmap_Pr rough.png\nnewmtl c\nNs 100\n"


def test_authored_roughness_is_left_and_said():
    found = convert_mtl(AUTHORED)
    assert found.data == AUTHORED + b"Pr 0.33148781\n"
    assert [material.name for material in found.materials] == ["c"]
    assert [(place, kind) for place, _, kind in found.problems] == [
        (3, ProblemKind.AUTHORED),
        (6, ProblemKind.AUTHORED),
    ]
    assert found.problems[0].text == "Pr 0.5 is authored, Ns 250 gives Pr 0.26403503"
    # Once more, nothing changes, and what has its roughness needs no word.
    again = convert_mtl(found.data)
    assert again.data == found.data
    assert again.problems == found.problems
    found = convert_mtl(AUTHORED, overwrite=True)
    assert found.data == (
        b"newmtl a\nNs 250\nPr 0.26403503\nnewmtl b\nNs 225\nPr 0.27105072\nnewmtl c\nNs 100\n"
        b"Pr 0.33148781\n"
    )
    # With `replace` an authored roughness and its Ns stay, too.
    assert convert_mtl(AUTHORED, replace=True).data == (
        b"newmtl a\nNs 250\nPr 0.5\nnewmtl b\nNs 225\nmap_Pr rough.png\nnewmtl c\nPr 0.33148781\n"
    )


def test_a_picture_of_roughness_keeps_its_file(tmp_path):
    """Blender writes the picture of the Roughness socket as map_Ns."""
    text = "# Blender 4.0.0 MTL File: 'None'\nnewmtl a\nNs 250\nmap_Ns -s 2 2 1 rough.png\n"
    (tmp_path / "a.mtl").write_text(text)
    Image.new("RGB", (2, 2), (30, 30, 30)).save(tmp_path / "rough.png")
    status, out, err = run(
        "mtl", "a.mtl", "-o", "b.mtl", "--textures", "--format", "json", cwd=tmp_path
    )
    assert status == 0, err
    (record,) = json.loads(out)
    assert record["texels"] == "ggx:roughness"
    assert record["materials"][0]["roughness"] == 1
    assert record["materials"][0]["notes"] == ["Pr 1, as map_Pr has the roughness"]
    # The map has the whole roughness: readers multiply it by Pr.
    assert (tmp_path / "b.mtl").read_text() == (
        text.replace("Ns 250\n", "Ns 250\nPr 1\n") + "map_Pr -s 2 2 1 rough.png\n"
    )
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.mtl", "b.mtl", "rough.png"]


def test_unknown_texels_are_left_until_they_are_named(tmp_path):
    text = f"{PYTHON}\nnewmtl a\nNs 96.078431\nmap_Ns hard.png\n"
    (tmp_path / "a.mtl").write_text(text)
    Image.new("L", (2, 2), 51).save(tmp_path / "hard.png")
    status, _, err = run("mtl", "a.mtl", "-o", "b.mtl", "--textures", cwd=tmp_path)
    assert status == 1
    assert "a.mtl:4: what the texels of map_Ns hard.png are is not known (--texels)" in err
    status, _, err = run(
        "mtl", "a.mtl", "-o", "c.mtl", "--textures", "--texels", "ggx:glossiness", cwd=tmp_path
    )
    assert status == 0
    assert "texels of map_Ns were taken for ggx:glossiness" in err
    assert np.asarray(Image.open(tmp_path / "hard_Pr.png")).tolist() == [[204, 204]] * 2
    assert "map_Pr hard_Pr.png" in (tmp_path / "c.mtl").read_text()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--texels", "ggx:roughness"], "--texels goes with --textures"),
        (["--textures", "--texels", "ggx:rough"], "did you mean roughness"),
        (["--textures", "--texels", "blinn-phong"], "needs an encoding"),
        (
            ["--textures", "--texels", "ggx:roughness", "--exponent-max", "9"],
            "--exponent-max goes with --texels blinn-phong:exponent",
        ),
        (["--from", "ggx"], "Ns of a library is not stored as ggx"),
        (["--to", "shininess", "--overwrite-authored"], "goes with --to roughness"),
    ],
)
def test_mistakes(words, message, tmp_path):
    (tmp_path / "a.mtl").write_text("newmtl a\nNs 5\n")
    status, _, err = run("mtl", "a.mtl", "-o", "b.mtl", *words, cwd=tmp_path)
    assert status == 2
    assert message in err
    assert not (tmp_path / "b.mtl").exists()


def test_utf_16_is_named():
    for encoding in ("utf-16-le", "utf-16-be"):
        with pytest.raises(mdfconv.MdfconvError, match="is text in UTF-16; save it as UTF-8"):
            convert_mtl("\ufeffnewmtl a\nNs 100\n".encode(encoding))


def test_importers_are_compared_with_what_the_author_meant(tmp_path):
    """Blender's importer gives back the roughness of Blender's exporter; Ks weighs rules."""
    text = "# Blender 4.0.0 MTL File\nnewmtl a\nNs 250\nKs 0.04 0.04 0.04\n"
    (tmp_path / "a.mtl").write_text(text)
    status, out, _ = run(
        "mtl", "a.mtl", "-o", "b.mtl", "--compare", "--format", "json", cwd=tmp_path
    )
    assert status == 0
    importers = json.loads(out)[0]["materials"][0]["importers"]
    assert importers["blender-obj"] == {"roughness": 0.5, "rmse": 0}
    assert importers["obj2gltf"]["roughness"] == pytest.approx(0.75 * 0.96)
    assert importers["obj2gltf"]["rmse"] > 0.3
    assert importers["assimp-gltf"]["roughness"] == pytest.approx(1 - 0.04 * math.sqrt(0.25))
    assert "specular weight" not in run("mtl", "a.mtl", "--dry-run", "--compare", cwd=tmp_path)[2]
    (tmp_path / "a.mtl").write_text(text.replace("Ks", "Kd"))
    err = run("mtl", "a.mtl", "--dry-run", "--compare", cwd=tmp_path)[2]
    assert "materials without a specular colour get a specular weight of 1" in err


def test_a_dry_run_writes_nothing(tmp_path):
    (tmp_path / "a.mtl").write_bytes(AUTHORED)
    for words in ([], ["-o", "b.mtl"], ["-o", "new/"], ["--in-place"]):
        status, out, err = run("mtl", "a.mtl", "--dry-run", *words, cwd=tmp_path)
        assert (status, out) == (1, "")
        assert ("mdfconv: would write " if words else "nothing is written in a dry run") in err
        assert "0.331488" in err
        assert [path.name for path in tmp_path.iterdir()] == ["a.mtl"]
    assert (tmp_path / "a.mtl").read_bytes() == AUTHORED
    # What would be refused is.
    status, _, err = run("mtl", "a.mtl", "--dry-run", "-o", "a.mtl", "--force", cwd=tmp_path)
    assert status == 2
    assert "a.mtl is the input" in err


@pytest.mark.parametrize("source", ["blender-obj", "blender-2.8", "blender-2.7"])
def test_shininess_is_what_the_writer_of_the_library_means(source):
    """There and back a library of Blender is the same, to the digits of Ns."""
    authored = [50, 12, 200] if source == "blender-2.7" else [0.5, 0.25, 0.35]
    numbers = [WRITTEN[source](each) for each in authored]
    there = convert_mtl(library(HEADERS[source], numbers), metric="energy")
    back = convert_mtl(there.data, "shininess", metric="energy")
    assert back.source == f"blinn-phong:{source}"
    wanted = [float(number) for number in numbers]
    assert [each.shininess for each in back.materials] == pytest.approx(wanted, rel=1e-6)
    # And on request an exponent.
    other = convert_mtl(there.data, "shininess", source="blinn-phong", metric="energy")
    assert other.materials[0].shininess == pytest.approx(
        mdfconv.convert(
            there.materials[0].roughness, "ggx:roughness", "blinn-phong", metric="energy"
        ),
        rel=0.1,
    )


def test_a_number_that_a_program_cannot_write_is_of_another():
    assert convert_mtl(library(PYTHON, ["950"])).source == "blinn-phong:blender-obj"


def test_the_table_says_what_ns_was_taken_for(tmp_path):
    (tmp_path / "a.mtl").write_bytes(library(PYTHON, ["225.000000"]))
    files = str(tmp_path / "a.mtl"), "-o", str(tmp_path / "b.mtl")
    status, text = run_on_terminal("mtl", *files, COLUMNS="80")
    assert status == 0
    assert "blinn-phong:blender-2.8," in text
    assert "written by Blender: Ns = 900 (1 − r)², as its numbers say" in " ".join(text.split())


def textured(folder, text, *words):
    """Convert a library with its textures; return status, result and messages."""
    (folder / "a.mtl").write_text(text)
    Image.new("L", (2, 2), 51).save(folder / "g.png")
    status, _, err = run("mtl", "a.mtl", "-o", "b.mtl", "--textures", *words, cwd=folder)
    return status, (folder / "b.mtl").read_text(), err


def test_texels_that_are_rescaled_are_left(tmp_path):
    text = "newmtl a\nNs 5\nmap_Ns -mm 0.5 0.25 g.png\nnewmtl b\nmap_Ns -mm 0 1 g.png\n"
    status, result, err = textured(tmp_path, text)
    assert status == 1
    assert "a.mtl:3: map_Ns g.png has -mm 0.5 0.25, by which its texels are rescaled" in err
    assert result == text.replace("Ns 5\n", "Ns 5\nPr 0.66892886\n") + "map_Pr -mm 0 1 g_Pr.png\n"
    # A picture of roughness may be rescaled as before.
    status, result, err = textured(tmp_path, text, "--texels", "ggx:roughness", "--force")
    assert status == 0
    assert "map_Pr -mm 0.5 0.25 g.png\n" in result


def test_what_is_authored_stays_where_a_map_fails(tmp_path):
    text = "newmtl a\nNs 3\nmap_Ns none.png\nmap_Pr keep.png\n"
    status, result, err = textured(tmp_path, text, "--overwrite-authored")
    assert (status, result) == (1, text)
    assert "cannot read" in err


def test_of_two_maps_the_last_counts(tmp_path):
    text = "newmtl a\nmap_Ns g.png\nmap_Ns none.png\n"
    status, result, _ = textured(tmp_path, text)
    assert (status, result) == (1, text)


def test_a_texture_alone_is_written_in_place_too(tmp_path):
    (tmp_path / "a.mtl").write_text("newmtl a\nmap_Ns g.png\n")
    Image.new("L", (2, 2), 51).save(tmp_path / "g.png")
    assert run("mtl", "a.mtl", "--in-place", "--textures", cwd=tmp_path)[0] == 0
    before = (tmp_path / "g_Pr.png").read_bytes()
    again = ["--overwrite-authored", "--force", "--texels", "ggx:glossiness"]
    status, _, err = run("mtl", "a.mtl", "--in-place", "--textures", *again, cwd=tmp_path)
    assert status == 0
    assert "wrote g_Pr.png" in err.replace(f"{tmp_path}/", "")
    assert (tmp_path / "g_Pr.png").read_bytes() != before
    assert np.asarray(Image.open(tmp_path / "g_Pr.png"))[0, 0] == 204
    assert not (tmp_path / "a.mtl.bak2").exists()


def test_a_second_conversion_in_place_is_noted(tmp_path):
    (tmp_path / "a.mtl").write_text("newmtl a\nNs 5\n")
    err = run("mtl", "a.mtl", "--in-place", "--replace", cwd=tmp_path)[2]
    assert "before" not in err
    (tmp_path / "a.mtl").write_text("newmtl a\nNs 5\n")
    err = run("mtl", "a.mtl", "--in-place", "--replace", cwd=tmp_path)[2]
    assert "a.mtl was converted in place before" in err
