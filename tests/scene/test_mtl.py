"""Material libraries: bytes kept, numbers right, read by others, files safe."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
import tinyobjloader
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

import mdfconv
from mdfconv.cli.tables import ROWS_SHOWN
from mdfconv.fitting.metrics import metric_named
from mdfconv.scene import convert_mtl
from mdfconv.scene.material_files import choose_outputs, write_conversions
from mdfconv.scene.shininess import (
    IMPORTERS,
    error_of,
    exponent_of,
    fit_error,
    importer_results,
    roughness_of,
)
from mdfconv.scene.stored import ProblemKind
from tests.cli.runner import run, run_on_terminal

DATA = Path(__file__).parent / "data"
OVERWRITE = "--overwrite-authored"
LIBRARIES = [DATA / "lecture_brdfs.mtl", DATA / "lecture_metals.mtl"]


def read(data, folder):
    """Return what an independent reader sees: the fields of each material by name."""
    (folder / "library.mtl").write_bytes(data)
    triangle = "mtllib library.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
    (folder / "scene.obj").write_text(triangle)
    reader = tinyobjloader.ObjReader()
    assert reader.ParseFromFile(str(folder / "scene.obj"))
    return {
        entry.name: {
            field: getattr(entry, field)
            for field in dir(entry)
            if not field.startswith("_") and not callable(getattr(entry, field))
        }
        for entry in reader.GetMaterials()
    }


@pytest.mark.parametrize("library", LIBRARIES, ids=lambda path: path.stem)
def test_another_reader_sees_the_roughness_and_nothing_else_changed(library, tmp_path):
    data = library.read_bytes()
    before = read(data, tmp_path)
    after = read(convert_mtl(data, overwrite=True).data, tmp_path)
    assert after.keys() == before.keys()
    for name, fields in after.items():
        exponent = before[name]["shininess"]
        # tinyobjloader has 1 where a library has no Ns.
        if b"Ns" in block(data, name):
            best = 1.0
            if exponent:
                best = mdfconv.convert(
                    exponent, "blinn-phong", "ggx:roughness", "fit", metric="environment"
                )
            assert fields["roughness"] == pytest.approx(best, rel=1e-6)
            del fields["roughness"], before[name]["roughness"]
        assert fields == before[name]


def block(data, name):
    return next(part for part in data.split(b"newmtl ") if part.startswith(name.encode()))


@pytest.mark.parametrize("metric", ["energy", "display"])
@pytest.mark.parametrize("replace", [False, True])
@pytest.mark.parametrize("library", LIBRARIES, ids=lambda path: path.stem)
def test_libraries_come_back(library, replace, metric, tmp_path):
    data = b"".join(
        line
        for line in library.read_bytes().splitlines(keepends=True)
        if not line.startswith(b"Pr")
    )
    there = convert_mtl(data, metric=metric, replace=replace)
    back = convert_mtl(there.data, "shininess", metric=metric, replace=True)
    assert not there.problems
    assert not back.problems
    assert read(back.data, tmp_path) == read(data, tmp_path)
    if replace:
        assert back.data == data


def test_the_answer_of_the_introduction():
    (found,) = convert_mtl(b"newmtl a\nNs 100\n").materials
    assert found.roughness == pytest.approx(0.3314878, abs=1e-6)
    assert found.roughness**2 == pytest.approx(0.1098842, abs=1e-6)


SOURCE = (
    b"\xef\xbb\xbf# caf\xe9\r\nnewmtl wood [oak]  \r\n\tNs   9.6078431e+01 # glossy\r\n\r\n"
    b"  Kd 1 0 0\r\nrefl -type sphere x.png\r\nnewmtl b\nPr  0.5\t# old\nNs 10\nNs 20"
)
CONVERTED = (
    b"\xef\xbb\xbf# caf\xe9\r\nnewmtl wood [oak]  \r\n\tNs   9.6078431e+01 # glossy\r\n"
    b"\tPr   0.3347842\r\n\r\n"
    b"  Kd 1 0 0\r\nrefl -type sphere x.png\r\nnewmtl b\nPr  0.49060728\t# old\nNs 10\nNs 20"
)
REPLACED = (
    b"\xef\xbb\xbf# caf\xe9\r\nnewmtl wood [oak]  \r\n\tPr   0.3347842 # glossy\r\n\r\n"
    b"  Kd 1 0 0\r\nrefl -type sphere x.png\r\nnewmtl b\nPr  0.49060728\t# old\n"
)


def test_every_other_byte_is_kept():
    found = convert_mtl(SOURCE, overwrite=True)
    assert found.data == CONVERTED
    assert [entry.name for entry in found.materials] == ["wood [oak]", "b"]
    assert found.materials[1].notes == ("2 statements: the last counts",)
    assert convert_mtl(SOURCE, replace=True, overwrite=True).data == REPLACED
    # Done once, it is done.
    assert convert_mtl(found.data).data == found.data


@pytest.mark.parametrize(
    ("statement", "text"),
    [
        (b"Ns", "Ns '' is not a number"),
        (b"Ns x", "Ns 'x' is not a number"),
        (b"Ns 1 2", "Ns '1 2' is not a number"),
        (b"Ns 0,5", "Ns '0,5' is not a number; it has a decimal comma: write 0.5"),
        (b"Ns 1.#INF00", "Ns '1.#INF00' is not a number; a runtime of Microsoft writes that"),
        (b"Ns -1.#IND", "Ns '-1.#IND' is not a number; a runtime of Microsoft writes that"),
        (
            b"Ns -1.960784",
            "Ns '-1.960784' is outside Ns ≥ 0; Blender 2.7 wrote that for the roughest",
        ),
        (b"Ns nan", "Ns 'nan' is not a number"),
        (b"Ns 1_000", "Ns '1_000' is not a number"),
        (b"Ns 1e999", "Ns '1e999' is outside Ns ≥ 0"),
        (b"Ns -1", "Ns '-1' is outside Ns ≥ 0"),
        (b"Ns \xff", "Ns '\ufffd' is not a number"),
    ],
)
def test_what_is_not_a_number_is_reported_and_left(statement, text):
    data = b"newmtl a\n" + statement + b"\n"
    found = convert_mtl(data)
    assert found.data == data
    assert found.problems == ((2, text, ProblemKind.OTHER),)
    assert not found.materials


def test_ends_of_the_range():
    data = b"newmtl a\nNs 0\nnewmtl b\nNs 0.03\nnewmtl c\nNs 1e6\nnewmtl d\nNs .5e-9\n"
    found = convert_mtl(data)
    none, low, high, tiny = found.materials
    assert (none.roughness, none.notes) == (1.0, ("Ns 0 is no highlight: Pr 1",))
    assert 0.99 < low.roughness < 1
    assert high.notes == ("Ns beyond 10000",)
    assert tiny.roughness == 1.0
    back = convert_mtl(b"newmtl a\nPr 0\nnewmtl b\nPr 1\nnewmtl c\nPr 1.5\n", "shininess")
    assert back.data == b"newmtl a\nPr 0\nnewmtl b\nPr 1\nNs 0\nnewmtl c\nPr 1.5\n"
    assert back.problems == ((6, "Pr '1.5' is outside 0 ≤ Pr ≤ 1", ProblemKind.OTHER),)


@settings(deadline=None)
@given(st.floats(0.1, 1e6), st.sampled_from(["energy", "display", "unit"]))
def test_exponents_come_back_to_six_digits(exponent, metric):
    data = b"newmtl a\nNs %.6g\n" % exponent
    there = convert_mtl(data, metric=metric, replace=True)
    (back,) = convert_mtl(there.data, "shininess", metric=metric).materials
    assert back.shininess == pytest.approx(float(f"{exponent:.6g}"), rel=1e-6)


WORDS = st.sampled_from(
    b"newmtl|Ns|Pr|map_Ns| |\t|\n|\r|\r\n|#|1|0.5|-1e3|x.png|-s|\\|\xff|\x00|\xef\xbb\xbf|Kd".split(
        b"|"
    )
)
SOUP = st.one_of(st.binary(max_size=200), st.lists(WORDS, max_size=60).map(b"".join))


@settings(deadline=None)
@given(SOUP, st.sampled_from(["roughness", "shininess"]), st.booleans())
def test_byte_soup_keeps_its_bytes(data, to, replace):
    refusal = ""
    try:
        found = convert_mtl(data, to, replace=replace)
    except mdfconv.MdfconvError as error:
        refusal = error.reason
    if refusal:
        assert refusal.startswith(("is no material library", "is text in UTF-16"))
        return
    changed = (b"Ns", b"Pr")
    if not (found.materials or found.textures):
        assert found.data == data
    # What is left of both when the statements in question are taken out is the same.
    assert untouched(found.data, changed) == untouched(data, changed)


def untouched(data, keywords):
    lines = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n").split(b"\n")
    kept = [
        line
        for line in lines
        if not line.removeprefix(b"\xef\xbb\xbf").strip(b" \t").startswith(keywords)
    ]
    # A new last line may need an end before it; an empty line is no statement.
    return [line for line in kept if line.strip(b" \t\xef\xbb\xbf")]


@settings(deadline=None)
@given(SOUP)
def test_without_a_statement_nothing_changes(data):
    data = data.replace(b"Ns", b"Nx").replace(b"Pr", b"Px") + b"\nnewmtl a"
    # Which would be text in UTF-16.
    data = data.lstrip(b"\xff\xfe")
    assert convert_mtl(data).data == data


def test_a_long_line_takes_no_long_time():
    data = b"newmtl a\nNs 1" + b" " * 200_000 + b"x\nmap_Ns " + b"-s 1 " * 20_000 + b"\n"
    assert convert_mtl(data).data == data


def test_command(tmp_path):
    (tmp_path / "a.mtl").write_bytes(SOURCE)
    status, out, err = run("mtl", "a.mtl", "-o", "b.mtl", OVERWRITE, cwd=tmp_path)
    assert (status, out) == (0, "")
    assert (tmp_path / "b.mtl").read_bytes() == CONVERTED
    assert (tmp_path / "a.mtl").read_bytes() == SOURCE
    assert "wood [oak]" in err
    assert "0.334784" in err
    status, out, _ = run(
        "mtl", "a.mtl", "-o", "c.mtl", "--format", "json", "--compare", OVERWRITE, cwd=tmp_path
    )
    (record,) = json.loads(out)
    assert [row["shininess"] for row in record["materials"]] == [96.078431, 20.0]
    rules = record["materials"][0]["importers"]["obj2gltf"]
    assert rules["roughness"] == pytest.approx(0.903921569)
    assert rules["rmse"] > 5 * record["materials"][0]["rmse"]
    fbx = record["materials"][0]["importers"]["fbx"]
    assert fbx["roughness"] == pytest.approx(0.0198, abs=1e-4)


def test_a_folder_named_as_one_is_created(tmp_path):
    (tmp_path / "a.mtl").write_bytes(SOURCE)
    assert run("mtl", "a.mtl", "-o", "new/", OVERWRITE, cwd=tmp_path)[0] == 0
    assert (tmp_path / "new" / "a.mtl").read_bytes() == CONVERTED


def test_in_place_twice_at_once_loses_nothing(tmp_path, monkeypatch):
    """The second finds the library changed, or its name for the backup taken."""
    library = tmp_path / "a.mtl"
    library.write_bytes(SOURCE)
    both = [choose_outputs([library], None)[0] for _ in range(2)]
    conversion = convert_mtl(SOURCE)
    write_conversions([(both[0], SOURCE, conversion)])
    with pytest.raises(mdfconv.MdfconvError, match="it has changed since it was read"):
        write_conversions([(both[1], SOURCE, conversion)])
    library.write_bytes(SOURCE)
    with pytest.raises(mdfconv.MdfconvError, match=r"a.mtl.bak exists"):
        write_conversions([(both[1], SOURCE, conversion)])
    assert library.read_bytes() == SOURCE
    assert (tmp_path / "a.mtl.bak").read_bytes() == SOURCE
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.mtl", "a.mtl.bak"]


def test_in_place_keeps_the_original(tmp_path):
    for name in ("a.mtl", "b.mtl"):
        (tmp_path / name).write_bytes(SOURCE)
    (tmp_path / "a.mtl").chmod(0o640)
    # Each file and its backup.
    for words, done, count in (
        ([], "wrote", 4), ([], "nothing to change in", 2), (["--replace"], "wrote", 4),
    ):  # fmt: skip
        status, _, err = run("mtl", "--in-place", OVERWRITE, "*.mtl", *words, cwd=tmp_path)
        assert status == 0
        assert err.count(f"mdfconv: {done} ") == count
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {f"{x}.mtl{end}" for x in "ab" for end in ("", ".bak", ".bak2")}
    assert (tmp_path / "a.mtl.bak2").read_bytes() == CONVERTED
    assert b"Ns" not in (tmp_path / "a.mtl").read_bytes()
    assert (tmp_path / "a.mtl.bak").read_bytes() == SOURCE
    assert (tmp_path / "a.mtl").stat().st_mode & 0o777 == 0o640


def test_a_bad_statement_turns_the_status_to_1(tmp_path):
    (tmp_path / "a.mtl").write_text("newmtl a\nNs x\nnewmtl b\nNs 5\n")
    status, _, err = run("mtl", "a.mtl", "-o", "b.mtl", cwd=tmp_path)
    assert status == 1
    assert "a.mtl:2: Ns 'x' is not a number: left as it is" in err
    assert "Pr 0.66892886" in (tmp_path / "b.mtl").read_text()


@pytest.mark.parametrize(
    ("to", "line", "words"),
    [
        ("roughness", "Ns 5\nmap_Ns x.png", ": --textures converts it"),
        ("shininess", "Pr 1\nmap_Pr x.png", ""),
    ],
)
def test_a_texture_that_is_left_turns_the_status_to_1(tmp_path, to, line, words):
    (tmp_path / "a.mtl").write_text(f"newmtl a\n{line}\n")
    status, _, err = run("mtl", "a.mtl", "-o", "b.mtl", "--to", to, cwd=tmp_path)
    assert status == 1
    statement = line.splitlines()[1]
    assert f"a.mtl:3: {statement} is a texture{words}: left as it is" in err


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["a.mtl"], "into another file or folder (--output), or in place (--in-place)"),
        (["a.mtl", "-o", "x.mtl", "--in-place"], "or in place (--in-place); choose one of them"),
        (["a.mtl", "-o", "a.mtl"], "a.mtl is the input"),
        (["a.mtl", "-o", "b.mtl"], "b.mtl exists; it can be replaced (--force)"),
        (["a.mtl", "b.mtl", "-o", "x.mtl"], "2 files need a folder"),
        (["a.mtl", "sub/a.mtl", "-o", "new"], "new/a.mtl is named for two results"),
        (["none.mtl", "-o", "x.mtl"], "cannot read none.mtl"),
        (["*.none", "-o", "x.mtl"], "cannot read *.none"),
        (["sub", "-o", "x.mtl"], "sub is a folder; name its files, as in 'sub/*'"),
        ([".", "-o", "out/"], ". is a folder"),
        (
            ["a.obj", "-o", "out/"],
            "a.obj: is a model, not a material library; its materials are in",
        ),
        (["noise", "-o", "out/"], "noise: is no material library: it has neither newmtl nor Ns"),
        (["a.mtl", "x.mtl"], "into another file or folder (--output), or in place (--in-place)"),
        (["a.mtl", "-o", "b.mtl/"], "cannot create b.mtl: it is a file"),
        (["a.mtl", "-o", "out/", "--to", "glossiness"], "not to 'glossiness'"),
        (["a.mtl", "-o", "none/x.mtl"], "cannot write none/x.mtl"),
        (["a.mtl", "-o", "none/none/"], "cannot create none/none"),
        (["a.mtl", "-o", "-"], "not a file or an existing folder"),
        (["a.mtl", "-o", "x.mtl", "--to", "glossiness"], "not to 'glossiness'"),
        (["a.mtl", "-o", "x.mtl", "--metric", "lihgt"], "unknown metric"),
        (["a.mtl", "-o", "x.mtl", "--to", "shininess", "--compare"], "--compare and --textures"),
    ],
)
def test_mistakes(words, message, tmp_path):
    (tmp_path / "sub").mkdir()
    (tmp_path / "new").mkdir()
    for name in ("a.mtl", "b.mtl", "sub/a.mtl"):
        (tmp_path / name).write_bytes(SOURCE)
    (tmp_path / "a.obj").write_text("# a model\n mtllib a.mtl\nv 0 0 0\n")
    (tmp_path / "noise").write_bytes(bytes(range(256)))
    before = sorted(tmp_path.rglob("*"))
    status, out, err = run("mtl", *words, cwd=tmp_path)
    assert (status, out) == (2, "")
    assert message in err
    assert len(err.splitlines()) == 1
    assert sorted(tmp_path.rglob("*")) == before
    assert (tmp_path / "a.mtl").read_bytes() == SOURCE


def test_errors_are_those_of_the_conversion():
    exponents = [0.5, 3.0, 40.0, 5000.0]
    data = b"".join(b"newmtl a\nNs %g\n" % exponent for exponent in exponents)
    found = convert_mtl(data).materials
    exact = mdfconv.explain(exponents, "blinn-phong", "ggx:roughness", "fit", metric="environment")
    for entry, wanted in zip(found, exact, strict=True):
        assert entry.rmse == pytest.approx(wanted.rmse, rel=1e-4)
    assert not any(math.isnan(entry.rmse) for entry in found)
    assert np.all(np.diff([entry.roughness for entry in found]) < 0)


def test_the_table_is_whole_on_a_narrow_terminal(tmp_path):
    (tmp_path / "in.mtl").write_text("newmtl chrome\nNs 500.5\n")
    words = "mtl", tmp_path / "in.mtl", "-o", tmp_path / "out.mtl", "--compare"
    status, out = run_on_terminal(*words, COLUMNS="60")
    assert status == 0
    for cell in ("chrome", "500.5", "0.222087", "blender-obj", "0.29254"):
        assert cell in out


def test_any_metric_is_answered():
    """Those without stored fits by the fit itself."""
    exponents = np.array([1.0, 2.0, 80.0])
    metric = metric_named("display:4")
    roughness = roughness_of(exponents, metric)
    expected = mdfconv.convert(exponents, "blinn-phong", "ggx:roughness", "fit", metric=metric)
    assert np.array_equal(roughness, expected)
    assert exponent_of(roughness, metric) == pytest.approx(exponents, rel=1e-6)
    (material,) = convert_mtl(b"newmtl a\nNs 80\n", metric="display:4").materials
    assert material.roughness == pytest.approx(expected[2], rel=1e-9)


def test_the_inverse_answers_beyond_what_libraries_hold():
    metric = metric_named("energy")
    assert exponent_of(np.array([1.0, 1 - 1e-12, 1e-6]), metric) == pytest.approx([0, 1e-6, 1e18])
    exponents = np.geomspace(1e-3, 1e9, 25)
    back = exponent_of(roughness_of(exponents, metric), metric)
    assert back == pytest.approx(exponents, rel=1e-6)


def test_importers_are_compared_as_data():
    exponents, metric = np.array([1.0, 100.0, 2000.0]), metric_named("energy")
    results = importer_results(exponents, metric)
    assert [list(row) for row in results] == [list(IMPORTERS)] * 3
    by_name = {importer: result.roughness for importer, result in results[1].items()}
    wanted = {"obj2gltf": 0.9, "blender-obj": 1 - 0.1**0.5, "fbx": 0, "unity-fbx": 0}
    assert {name: by_name[name] for name in wanted} == pytest.approx(wanted)
    for row, exponent in zip(results, exponents, strict=True):
        for result in row.values():
            alone = error_of(np.array([exponent]), np.array([result.roughness]), metric)
            assert result.rmse == pytest.approx(alone[0], rel=1e-12)
    assert math.isinf(next(iter(results[2].values())).rmse)


def test_textures_are_converted_beside_the_result(tmp_path):
    (tmp_path / "maps").mkdir()
    (tmp_path / "out").mkdir()
    texels = np.array([[0, 25, 128, 255]], np.uint8)
    Image.fromarray(texels).save(tmp_path / "maps" / "shine.png")
    library = "newmtl a\nNs 50\nmap_Ns -s 2 2 1 maps\\shine.png\nnewmtl b\nmap_Ns none.png\n"
    library += "newmtl c\nmap_Ns maps/shine.png\n"
    (tmp_path / "a.mtl").write_text(library)
    status, _, err = run("mtl", "a.mtl", "-o", "out", "--textures", cwd=tmp_path)
    assert status == 1
    assert "a.mtl:5: " in err
    written = (tmp_path / "out" / "a.mtl").read_text()
    assert "map_Pr -s 2 2 1 shine_Pr.png\n" in written
    assert written.count("map_Pr") == 2
    got = np.asarray(Image.open(tmp_path / "out" / "shine_Pr.png"))[0]
    exponents = texels[0, 1:] / 255 * 1000
    exact = mdfconv.convert(exponents, "blinn-phong", "ggx:roughness", "fit", metric="environment")
    assert got[0] == 255
    assert np.abs(got[1:] / 255 - exact).max() <= 0.5 / 255 + 1e-9
    read_back = read((tmp_path / "out" / "a.mtl").read_bytes(), tmp_path)
    assert read_back["a"]["roughness_texname"] == "shine_Pr.png"


def test_textures_of_one_name_are_not_mixed_up(tmp_path):
    for folder, texel in (("a", 50), ("b", 200)):
        (tmp_path / folder).mkdir()
        Image.fromarray(np.full((1, 1), texel, np.uint8)).save(tmp_path / folder / "x.png")
    lines = "newmtl {0}\nNs 50\nmap_Ns {0}/x.png\n"
    (tmp_path / "a.mtl").write_text(lines.format("a") + lines.format("b"))
    assert run("mtl", "a.mtl", "-o", "b.mtl", "--textures", cwd=tmp_path)[0] == 0
    read_back = read((tmp_path / "b.mtl").read_bytes(), tmp_path)
    for folder, texel in (("a", 50), ("b", 200)):
        new = np.asarray(Image.open(tmp_path / read_back[folder]["roughness_texname"]))[0, 0]
        exact = mdfconv.convert(
            texel / 255 * 1000, "blinn-phong", "ggx:roughness", "fit", metric="environment"
        )
        assert abs(new / 255 - exact) <= 0.5 / 255 + 1e-9


def test_textures_of_one_name_from_two_libraries_are_refused(tmp_path):
    for folder, texel in (("a", 50), ("b", 200)):
        (tmp_path / folder).mkdir()
        Image.fromarray(np.full((1, 1), texel, np.uint8)).save(tmp_path / folder / "x.png")
        (tmp_path / folder / f"{folder}.mtl").write_text("newmtl a\nNs 50\nmap_Ns x.png\n")
    (tmp_path / "out").mkdir()
    status, out, err = run("mtl", "*/*.mtl", "-o", "out", "--textures", cwd=tmp_path)
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert "two results would both be written to out/x_Pr.png" in err
    assert not list((tmp_path / "out").iterdir())


@pytest.mark.parametrize("force", [(), ("--force",)])
def test_textures_are_not_written_over_by_accident(tmp_path, force):
    texture = tmp_path / "x_Pr.png"
    Image.fromarray(np.full((1, 1), 50, np.uint8)).save(tmp_path / "x.png")
    texture.write_bytes(b"old")
    (tmp_path / "a.mtl").write_text("newmtl a\nmap_Ns x.png\n")
    status, _, err = run("mtl", "a.mtl", "-o", "b.mtl", "--textures", *force, cwd=tmp_path)
    assert status == (0 if force else 2)
    assert (texture.read_bytes() == b"old") == (not force)
    assert (tmp_path / "b.mtl").exists() == bool(force)
    # One that was read is never written over.
    texture.unlink()
    Image.fromarray(np.full((1, 1), 200, np.uint8)).save(texture)
    before = texture.read_bytes()
    (tmp_path / "a.mtl").write_text("newmtl a\nmap_Ns x.png\nnewmtl b\nmap_Ns x_Pr.png\n")
    status, _, err = run("mtl", "a.mtl", "-o", "c.mtl", "--textures", "--force", cwd=tmp_path)
    assert status == 2
    assert "x_Pr.png is the input" in err
    assert texture.read_bytes() == before


@pytest.mark.parametrize(
    ("empty", "filled"),
    [
        (b"Pr", b"Pr 0.35997397"),
        (b"\tPr \t", b"\tPr 0.35997397"),
        (b"Pr#x", b"Pr 0.35997397 #x"),
        (b"Pr  # x", b"Pr 0.35997397  # x"),
    ],
)
def test_a_statement_without_a_value_gets_one(empty, filled):
    for end in (b"", b"\n", b"\r\nNs 100\r\n"):
        for replace in (False, True):
            found = convert_mtl(
                b"newmtl a\nNs 100\n" + empty + end, metric="energy", replace=replace
            )
            assert filled + end.partition(b"Ns")[0] in found.data
            assert found.notes == ()


@pytest.mark.parametrize(
    ("empty", "filled"), [(b"map_Pr", b"map_Pr -s 2 2 1 y.png"), (b"map_Pr#x", b"y.png #x")]
)
def test_an_empty_statement_of_a_texture_gets_its_name(empty, filled):
    data = b"newmtl a\nmap_Ns -s 2 2 1 x.png\n" + empty
    found = convert_mtl(data, texture_names={"x.png": "y.png"})
    assert found.data.endswith(filled)
    assert found.notes == ()


def test_what_was_written_by_hand_is_noted_where_it_goes(tmp_path):
    text = "newmtl a\nPr 0.5 # mine\nNs 100\nmap_Ns x.png\nmap_Pr old.png\nnewmtl b\nPr 0.5\n"
    (tmp_path / "a.mtl").write_text(text)
    Image.new("L", (2, 2), 30).save(tmp_path / "x.png")
    status, out, err = run(
        "mtl", "a.mtl", "-o", "out/", "--textures", "--format", "json", OVERWRITE, cwd=tmp_path
    )
    assert status == 0
    assert json.loads(out)[0]["notes"] == [
        {"line": 2, "note": "Pr 0.5 was replaced"},
        {"line": 5, "note": "map_Pr old.png was replaced"},
    ]
    assert "mdfconv: note: a.mtl, line 2: Pr 0.5 was replaced\n" in err
    assert "mdfconv: note: a.mtl, line 5: map_Pr old.png was replaced\n" in err
    again = convert_mtl((tmp_path / "out" / "a.mtl").read_bytes())
    assert again.notes == ()
    assert convert_mtl(b"newmtl a\nPr 0.5\nNs 10", "shininess").notes == (
        (3, "Ns 10 was replaced"),
    )


def test_many_notes_are_counted(tmp_path):
    (tmp_path / "a.mtl").write_text("newmtl a\nNs 100\nPr 0.5\n" * 150)
    err = run("mtl", "a.mtl", "-o", "b.mtl", OVERWRITE, cwd=tmp_path)[2]
    assert err.count("was replaced") == 100
    assert "… and 50 more notes; --format json has them all" in err


@pytest.mark.parametrize("metric", ["unit", "energy", "environment", "display"])
def test_no_highlight_is_no_error(metric):
    """Ns 0 and Pr 1 are one lobe, the uniform one."""
    exponents = np.array([0.0, 1e-9, 1.0])
    assert fit_error(exponents, metric_named(metric))[:2].tolist() == [0, 0]
    for result in importer_results(exponents[:1], metric_named(metric))[0].values():
        assert (result.roughness, result.rmse) == (1, 0)


def test_only_what_is_shown_is_compared(tmp_path):
    count = 130
    (tmp_path / "a.mtl").write_text("".join(f"newmtl m{n}\nNs {n + 1}\n" for n in range(count)))
    status, _, err = run("mtl", "a.mtl", "-o", "b.mtl", "--compare", cwd=tmp_path)
    assert status == 0
    whole = ROWS_SHOWN // len(IMPORTERS)
    assert err.count(" obj2gltf ") == whole
    assert "… and 30 more; --format json" in err
    assert f"… and {(count - whole) * len(IMPORTERS)} more; --format json" in err
    out = run("mtl", "a.mtl", "-o", "c.mtl", "--compare", "--format", "json", cwd=tmp_path)[1]
    rows = json.loads(out)[0]["materials"]
    assert [len(row["importers"]) for row in rows] == [len(IMPORTERS)] * count
