"""`mdfconv inspect`: every kind of file is named, its numbers are right, and its lines run."""

import base64
import io
import json
import math
import re
import shlex
import struct
import zipfile
from pathlib import Path

import numpy as np
import OpenImageIO
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from PIL import Image

import mdfconv
from mdfconv.output.kinds import FOREIGN
from mdfconv.scene.inspection.files import inspect_file, list_kinds
from mdfconv.scene.inspection.records import FileInspection
from tests.cli.runner import run, run_here, run_on_terminal
from tests.light.maps import room, write_map
from tests.scene.pictures import write_png

# α of GGX for Beckmann's in the light of a natural environment, found independently.
CONSTANT = 0.7810619641


def inspected(path, *, status=0):
    """Return what JSON says of one file."""
    returned, out, _ = run("inspect", path.name, "--format", "json", cwd=path.parent)
    assert returned == status, out
    (record,) = json.loads(out)
    assert record["file"] == path.name
    return record


def scene(*bsdfs, version="0.6.0"):
    return f'<scene version="{version}">\n{"".join(bsdfs)}\n</scene>\n'.encode()


SCENE = scene(
    '<bsdf type="roughplastic" id="b"><float name="alpha" value="0.2"/></bsdf>\n',
    '<bsdf type="roughconductor"><string name="distribution" value="phong"/>'
    '<float name="alpha_u" value="0.2"/><float name="alpha_v" value="0.5"/></bsdf>\n',
    '<bsdf type="roughcoating"><texture name="alpha" type="bitmap"><float name="gamma" value="1"/>'
    '<string name="filename" value="maps/wood.png"/></texture></bsdf>\n',
    '<include filename="more.xml"/>',
)


def test_a_scene_has_its_numbers_textures_and_the_line_that_converts_it(tmp_path):
    (tmp_path / "maps").mkdir()
    Image.fromarray(np.full((2, 4), 50, np.uint8)).save(tmp_path / "maps" / "wood.png")
    (tmp_path / "a.xml").write_bytes(SCENE)
    record = inspected(tmp_path / "a.xml")
    assert (record["kind"], record["facts"]) == ("Mitsuba scene", {"version": "Mitsuba 0.6"})
    beckmann, phong, textured = record["numbers"]
    assert beckmann["name"] == "b"
    assert (beckmann["place"], beckmann["stored"], beckmann["quantity"]) == (2, 0.2, "alpha")
    assert beckmann["alpha"] == pytest.approx(0.2 * CONSTANT, rel=1e-9)
    assert beckmann["roughness"] == pytest.approx(math.sqrt(0.2 * CONSTANT), rel=1e-9)
    assert beckmann["exponent"] is None
    assert phong["taken_for"] == "phong"
    assert phong["exponent"] == pytest.approx([2 / a**2 - 2 for a in (0.2, 0.5)], rel=1e-12)
    assert textured["stored"] is None
    assert record["textures"] == [
        {
            "file": "maps/wood.png", "place": 4, "form": "PNG", "width": 4, "height": 2,
            "depth": "8 bits", "channels": "l", "channel": "l", "taken_for": "beckmann",
            "lossy": False,
        }
    ]  # fmt: skip
    assert record["notes"] == ["line 5: more.xml is included, and is not read"]
    assert record["command"] == "mdfconv mitsuba a.xml -o a-ggx.xml --textures"


def test_what_a_scene_leaves_is_said(tmp_path):
    (tmp_path / "a.xml").write_bytes(
        scene('<bsdf type="ward"/>\n', '<bsdf type="roughplastic"><texture name="alpha" '
              'type="bitmap"><string name="filename" value="no.exr"/></texture></bsdf>')
    )  # fmt: skip
    record = inspected(tmp_path / "a.xml", status=1)
    ward, texture = record["problems"]
    assert ward["place"] == 2
    assert "alpha 0.1 is nearest to ggx with alpha 0.0781062" in ward["problem"]
    assert texture["problem"] == "cannot read no.exr: No such file or directory"
    assert record["command"] == ""


@pytest.mark.parametrize(
    ("header", "stored", "source", "roughness", "exponent"),
    [
        ("# Blender 3.3.1 MTL File: 'a.blend'", "250.000000", "blender-obj", 0.5, None),
        ("# Blender MTL File: 'a.blend'", "225.000000", "blender-2.8", 0.5, None),
        ("# Blender MTL File: 'a.blend'", "96.078431", "blender-2.7", 0.393186, 50),
        ("# by hand", "50", "", 0.393186, 50),
    ],
)
def test_a_library_has_its_writer_and_what_its_numbers_mean(
    header, stored, source, roughness, exponent, tmp_path
):
    (tmp_path / "a.mtl").write_text(f"{header}\nnewmtl m\nNs {stored}\n")
    record = inspected(tmp_path / "a.mtl")
    assert record["kind"] == "Wavefront material library"
    assert record["writer"].startswith("Blender") == header.startswith("# Blender")
    label = f"blinn-phong:{source}".rstrip(":")
    assert record["taken_for"].startswith(f"{label}: ")
    (number,) = record["numbers"]
    assert (number["name"], number["place"], number["quantity"]) == ("m", 3, "Ns")
    assert number["taken_for"] == label
    assert number["roughness"] == pytest.approx(roughness, abs=1e-6)
    assert number["alpha"] == pytest.approx(roughness**2, abs=1e-6)
    wanted = exponent if exponent is None else pytest.approx(exponent, rel=1e-6)
    assert number["exponent"] == wanted
    assert record["command"] == "mdfconv mtl a.mtl -o a-ggx.mtl"


def test_an_authored_roughness_and_textures_of_a_library_are_said(tmp_path):
    Image.fromarray(np.zeros((2, 4), np.uint8)).save(tmp_path / "gloss.png")
    (tmp_path / "a.mtl").write_text(
        "newmtl a\nNs 250\nPr 0.5\nnewmtl b\nmap_Ns gloss.png\nnewmtl c\nmap_Ns no.png\n"
        "newmtl d\nNs 9,5\n"
    )
    record = inspected(tmp_path / "a.mtl", status=1)
    (number,) = record["numbers"]
    assert (number["quantity"], number["stored"], number["alpha"]) == ("Pr", 0.5, 0.25)
    assert len(record["notes"]) == 1
    assert "Pr 0.5 is authored" in record["notes"][0]
    (texture,) = record["textures"]
    assert (texture["file"], texture["place"]) == ("gloss.png", 5)
    assert texture["taken_for"] == "blinn-phong:exponent"
    missing, comma = record["problems"]
    assert (missing["place"], comma["place"]) == (7, 9)
    assert "cannot read no.png" in missing["problem"]
    assert "decimal comma" in comma["problem"]
    assert record["command"] == "mdfconv mtl a.mtl -o a-ggx.mtl --textures"


def gltf(*materials, generator="", **more):
    asset = {"version": "2.0"} | ({"generator": generator} if generator else {})
    return json.dumps({"asset": asset, "materials": materials} | more).encode()


def of_factor(factor, **more):
    return {"pbrMetallicRoughness": {"roughnessFactor": factor} | more}


def glb(data):
    data += b" " * (-len(data) % 4)
    head = struct.pack("<4sII", b"glTF", 2, 20 + len(data))
    return head + struct.pack("<I4s", len(data), b"JSON") + data


@pytest.mark.parametrize("binary", [False, True])
def test_a_gltf_has_its_generator_and_what_its_factors_mean(binary, tmp_path):
    data = gltf(of_factor(0.7), generator="obj2gltf")
    path = tmp_path / ("a.glb" if binary else "a.gltf")
    path.write_bytes(glb(data) if binary else data)
    record = inspected(path)
    assert record["kind"] == ("GLB (glTF 2.0)" if binary else "glTF 2.0")
    assert record["writer"] == "obj2gltf"
    assert "blinn-phong:obj2gltf" in record["taken_for"]
    (number,) = record["numbers"]
    assert (number["place"], number["quantity"]) == ("materials[0]", "roughnessFactor")
    assert number["exponent"] == pytest.approx(300, rel=1e-12)
    wanted = mdfconv.convert(300, "blinn-phong", "ggx:roughness", metric="environment")
    assert number["roughness"] == pytest.approx(wanted, rel=1e-9)
    assert record["command"] == f"mdfconv gltf {path.name} -o {path.stem}-ggx{path.suffix}"


def test_a_gltf_of_another_writer_is_what_gltf_defines(tmp_path):
    (tmp_path / "a.gltf").write_bytes(gltf(of_factor(0.5), generator="my own"))
    record = inspected(tmp_path / "a.gltf")
    assert (record["numbers"][0]["alpha"], record["numbers"][0]["exponent"]) == (0.25, None)
    assert (record["command"], record["repaired"]) == ("", "")
    assert "ggx:roughness" in record["taken_for"]


def test_a_rule_that_depends_on_a_weight_is_read_for_a_weight_of_1(tmp_path):
    (tmp_path / "a.gltf").write_bytes(gltf(of_factor(0.5), generator="assimp v5.2"))
    record = inspected(tmp_path / "a.gltf")
    assert record["writer"] == "assimp v5.2"
    assert record["numbers"][0]["taken_for"] == "blinn-phong:assimp-gltf"
    # With L = 1, r = 1 − √(N/1000).
    assert record["numbers"][0]["exponent"] == pytest.approx(250, rel=1e-9)
    assert record["command"].endswith("--specular L")


def test_a_condition_on_the_writer_is_a_note(tmp_path):
    (tmp_path / "a.gltf").write_bytes(gltf(of_factor(0.5), generator="Khronos glTF Blender I/O"))
    record = inspected(tmp_path / "a.gltf")
    assert record["numbers"][0]["alpha"] == 0.25
    assert "blinn-phong:blender-obj if its materials came from" in record["notes"][0]
    assert record["command"] == ""


def test_a_glossiness_is_read_and_moves(tmp_path):
    material = of_factor(0.3) | {
        "extensions": {"KHR_materials_pbrSpecularGlossiness": {"glossinessFactor": 0.6}}
    }
    (tmp_path / "a.gltf").write_bytes(gltf(material))
    record = inspected(tmp_path / "a.gltf")
    rough, glossy = record["numbers"]
    assert (rough["quantity"], glossy["quantity"]) == ("roughnessFactor", "glossinessFactor")
    assert rough["alpha"] == pytest.approx(0.09)
    assert (glossy["stored"], glossy["alpha"]) == (0.6, pytest.approx(0.16))
    assert record["command"].endswith("--from ggx:gltf-glossiness")


def test_textures_of_a_gltf_are_described_wherever_they_are(tmp_path):
    write_png(tmp_path / "orm.png", np.zeros((2, 4, 3), np.uint8))
    Image.fromarray(np.zeros((8, 8, 3), np.uint8)).save(tmp_path / "orm.jpg")
    uri = "data:image/png;base64," + base64.b64encode((tmp_path / "orm.png").read_bytes()).decode()
    materials = [of_factor(1, metallicRoughnessTexture={"index": at}) for at in (0, 1, 2, 3, 0)]
    data = gltf(
        *materials,
        generator="FBX2glTF",
        textures=[{"source": at} for at in range(4)],
        images=[{"uri": "orm.png"}, {"uri": uri, "name": "in"}, {"uri": "orm.jpg"}, {"uri": "no"}],
    )
    (tmp_path / "a.gltf").write_bytes(data)
    record = inspected(tmp_path / "a.gltf", status=1)
    assert [(each["file"], each["place"], each["form"]) for each in record["textures"]] == [
        ("orm.png", "materials[0]", "PNG"),
        ("images[1]", "materials[1]", "PNG"),
        ("orm.jpg", "materials[2]", "JPEG"),
    ]
    assert {each["channel"] for each in record["textures"]} == {"g"}
    assert [each["lossy"] for each in record["textures"]] == [False, False, True]
    assert record["problems"][0]["place"] == "materials[3]"
    words = record["command"].split()
    assert {"--textures", "--lossy"} <= set(words)


@pytest.mark.parametrize(
    ("name", "pixels", "words"),
    [
        ("gloss.png", np.zeros((2, 4), np.uint8), ["ggx:glossiness", "l", "8 bits"]),
        ("wood_roughness.png", np.zeros((2, 4), np.uint16), ["ggx:roughness", "l", "16 bits"]),
        ("WoodSmoothness.png", np.zeros((2, 4, 3), np.uint8), ["ggx:glossiness", "", "8 bits"]),
        ("T_MetallicSmoothness.png", np.zeros((2, 4, 4), np.uint8), ["ggx:glossiness", "a", ""]),
        ("metallicRoughness.tif", np.zeros((2, 4, 3), np.uint8), ["ggx:roughness", "g", "8 bits"]),
        ("wood.tga", np.zeros((2, 4), np.uint8), ["", "l", "8 bits"]),
        ("glossy-rough.png", np.zeros((2, 4), np.uint8), ["", "l", "8 bits"]),
    ],
)
def test_a_picture_says_its_form_and_its_name_the_rest(name, pixels, words, tmp_path):
    Image.fromarray(pixels).save(tmp_path / name)
    record = inspected(tmp_path / name)
    (texture,) = record["textures"]
    assert (texture["width"], texture["height"], texture["place"]) == (4, 2, "")
    taken_for, channel, depth = words
    assert (texture["taken_for"], texture["channel"]) == (taken_for, channel)
    assert texture["depth"].startswith(depth)
    assert record["kind"].endswith(" picture")
    command = record["command"]
    assert ("MDF:ENCODING" in command) == (taken_for == "")
    # glTF's own roughness is what most programs take.
    assert (command == "") == (taken_for == "ggx:roughness")
    assert ("--to-channel g" in command) == ("MetallicSmoothness" in name)
    assert ("--channel C" in command) == (channel == "" and command != "")


def test_a_jpeg_has_altered_its_texels(tmp_path):
    Image.fromarray(np.zeros((8, 8), np.uint8)).save(tmp_path / "gloss.jpg")
    record = inspected(tmp_path / "gloss.jpg")
    assert record["notes"] == ["its compression has altered the values"]
    assert record["textures"][0]["lossy"]
    assert record["command"] == (
        "mdfconv texture gloss.jpg -o gloss-ggx.png --from ggx:glossiness --to ggx:roughness "
        "--lossy"
    )


def test_an_environment_map_is_told_from_a_texture_of_floats(tmp_path):
    write_map(tmp_path / "room.exr", room())
    record = inspected(tmp_path / "room.exr")
    assert record["kind"] == "environment map"
    assert record["facts"]["size"] == "128×64"
    assert record["command"] == "mdfconv light room.exr"
    # Of one colour it is no light, and may be a texture.
    write_map(tmp_path / "flat.exr", np.full((64, 128), 0.3))
    assert inspected(tmp_path / "flat.exr")["kind"] == "OpenEXR picture"


def write_cube(path):
    spec = OpenImageIO.ImageSpec(8, 48, 3, "float")
    spec.attribute("textureformat", "CubeFace Environment")
    output = OpenImageIO.ImageOutput.create(str(path))
    output.open(str(path), spec)
    output.write_image(np.ones((48, 8, 3), np.float32))
    output.close()


LOBE = "theta_h,value\n" + "".join(f"{t},{math.exp(-(t**2) / 100)}\n" for t in range(0, 80, 4))


def test_measurements_say_their_form_angles_and_samples(tmp_path):
    (tmp_path / "lobe.csv").write_text(LOBE)
    record = inspected(tmp_path / "lobe.csv")
    assert record["kind"] == "measurements (text)"
    assert record["facts"]["samples"] == "20"
    assert record["facts"]["angles"] == "of the half vector, 0° to 76°"
    assert record["command"] == "mdfconv fit lobe.csv"
    astm = "NAME x\nVARS theta_i,phi_i,theta_s,phi_s,550nm\n" + "".join(
        f"0.3,0,{t / 10},3.1415926,{1 / (1 + t)}\n" for t in range(10)
    )
    (tmp_path / "scan.astm").write_text(astm)
    record = inspected(tmp_path / "scan.astm")
    assert record["kind"] == "measurements (ASTM E1392)"
    assert record["facts"]["quantity"] == "a BRDF"


def test_a_table_that_leaves_a_column_open_says_which_option_tells(tmp_path):
    (tmp_path / "a.csv").write_text(LOBE.replace("theta_h,value", "theta_a,theta_b"))
    record = inspected(tmp_path / "a.csv", status=1)
    assert record["command"] == "mdfconv fit a.csv --angle COLUMN"
    assert "several columns are called an angle" in record["problems"][0]["problem"]


def xlsx():
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        archive.writestr("[Content_Types].xml", "<Types/>")
        archive.writestr("xl/workbook.xml", "<workbook/>")
    return buffer.getvalue()


def npy():
    buffer = io.BytesIO()
    np.save(buffer, np.zeros(3))
    return buffer.getvalue()


POINTER = b"version https://git-lfs.github.com/spec/v1\noid sha256:" + b"0" * 64 + b"\nsize 12345\n"


@pytest.mark.parametrize(
    ("name", "content", "kind", "remedy"),
    [
        *(
            (f"a.{ending}", POINTER, "a Git LFS pointer", "git lfs pull")
            for ending in ("png", "mtl", "gltf", "xml", "hdr", "csv")
        ),
        ("a.xlsx", xlsx(), "an Excel workbook", "CSV"),
        ("a.csv", xlsx(), "an Excel workbook", "CSV"),
        ("a.npy", npy(), "a NumPy array", "CSV"),
        ("a.brdf", b"OPTIS - brdf surface file v9.0\n0\n", "a surface file of Speos", "CSV"),
        ("a.fbx", b"Kaydara FBX Binary  \0\x1a\0", "an FBX file", "glTF"),
    ],
)
def test_a_foreign_file_is_named_with_the_way_out(name, content, kind, remedy, tmp_path):
    (tmp_path / name).write_bytes(content)
    record = inspected(tmp_path / name, status=2)
    assert kind in record["kind"]
    assert remedy in record["remedy"]
    assert (record["read"], record["command"]) == (False, "")


def test_a_cube_map_is_named(tmp_path):
    write_cube(tmp_path / "cube.exr")
    record = inspected(tmp_path / "cube.exr", status=2)
    assert record["problems"][0]["problem"].endswith("is a cube map")
    assert "latitude and longitude" in record["remedy"]


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("a.bin", bytes(range(256)), "it is none of: "),
        ("a.md", b"# A text\n\nwith some words, and 1 number\n", "it is none of: "),
        ("a.png", b"no picture at all", "no PNG, TIFF, TGA or OpenEXR file"),
        ("a.png", b"\x89PNG\r\n\x1a\n\0\0", "is damaged"),
        ("a.tga", b"\0", "is not of 8 bits a channel"),
        ("a.xml", b"<scene>\n<bsdf>\n</scene>", "not well-formed XML, line 3"),
        ("a.xml", b"<svg/>", "it is no scene: its root is svg"),
        ("a.hdr", b"#?RADIANCE\n", ""),
        ("a.gltf", b'{"asset": {"version": "1.0"}}', "is glTF of version 1.0, not 2.0"),
        ("a.gltf", b"{", "no JSON"),
        ("a.glb", b"glTF\2\0\0\0", "is a GLB of 8 bytes"),
        ("a.obj", b"mtllib a.mtl\nv 0 0 0\n", "is a model, not a material library"),
        ("a.csv", b"words\nand\nmore\nof\nthem\n", "not numbers"),
        ("empty.mtl", b"", "it has no bytes"),
    ],
)
def test_what_cannot_be_read_has_a_reason(name, content, words, tmp_path):
    (tmp_path / name).write_bytes(content)
    record = inspected(tmp_path / name, status=2)
    assert not record["read"]
    assert words in record["problems"][0]["problem"]


def write_all(folder):
    """Write a file of each kind that is read; return those by their kinds."""
    write_map(folder / "room.exr", room())
    (folder / "b.mtl").write_text("newmtl a\nNs 100\n")
    (folder / "c.glb").write_bytes(glb(gltf(of_factor(0.7), generator="obj2gltf")))
    write_png(folder / "gloss.png", np.zeros((2, 4, 1), np.uint8))
    (folder / "a.xml").write_bytes(scene('<bsdf type="roughplastic"/>', version="3.0.0"))
    (folder / "lobe.csv").write_text(LOBE)


def test_every_line_runs_and_what_it_makes_is_done(tmp_path):
    write_all(tmp_path)
    before = sorted(tmp_path.iterdir())
    status, out, err = run("inspect", "*", "--format", "json", cwd=tmp_path)
    assert (status, err) == (0, "")
    # Nothing is written.
    assert sorted(tmp_path.iterdir()) == before
    for record in json.loads(out):
        words = shlex.split(record["command"])
        assert words[0] == "mdfconv"
        status, _, err = run(*words[1:], cwd=tmp_path)
        assert status == 0, err
        # What a glTF is after a repair nothing says, unless it is marked.
        if words[1] in ("mitsuba", "mtl"):
            again = inspected(tmp_path / words[words.index("-o") + 1])
            assert again["command"] == ""


def test_a_converted_file_is_said_to_look_repaired(tmp_path):
    (tmp_path / "a.mtl").write_text("newmtl a\nNs 100\n")
    assert run("mtl", "a.mtl", "-o", "b.mtl", cwd=tmp_path)[0] == 0
    assert inspected(tmp_path / "b.mtl")["repaired"] == "every Ns has its Pr already"
    (tmp_path / "a.glb").write_bytes(glb(gltf(of_factor(0.7), generator="obj2gltf")))
    assert run("gltf", "--mark", "a.glb", "-o", "b.glb", cwd=tmp_path)[0] == 0
    record = inspected(tmp_path / "b.glb")
    assert "marked as converted" in record["repaired"]
    assert record["command"] == ""
    (tmp_path / "a.xml").write_bytes(scene('<bsdf type="roughplastic"/>'))
    assert inspected(tmp_path / "a.xml")["repaired"] == ""
    assert run("mitsuba", "--in-place", "a.xml", cwd=tmp_path)[0] == 0
    assert inspected(tmp_path / "a.xml")["repaired"] == "every BSDF is ggx already"
    (tmp_path / "gloss.png.bak").write_bytes(b"")
    write_png(tmp_path / "gloss.png", np.zeros((2, 4, 1), np.uint8))
    assert "gloss.png.bak" in inspected(tmp_path / "gloss.png")["repaired"]


def test_several_files_are_said_each_and_the_worst_is_the_status(tmp_path):
    write_all(tmp_path)
    (tmp_path / "b.xml").write_bytes(scene('<bsdf type="ward"/>'))
    status, out, err = run("inspect", "gloss.png", "b.xml", cwd=tmp_path)
    assert (status, err) == (1, "")
    (tmp_path / "x.npy").write_bytes(npy())
    words = "inspect", "no.mtl", "x.npy", "b.xml", ".", "gloss.png", "gl*.png", "/dev/null"
    status, out, err = run(*words, cwd=tmp_path)
    assert status == 2
    assert err == "mdfconv: cannot read no.mtl and 3 more: the report says why\n"
    titles = [line for line in out.splitlines() if line and not line.startswith(" ")]
    assert titles == [
        "no.mtl: no file",
        "x.npy: a NumPy array (.npy)",
        "b.xml: Mitsuba scene",
        ".: no file",
        "gloss.png: PNG picture",
        "/dev/null: no file",
    ]


def test_a_pattern_passes_over_the_folders_that_it_matches(tmp_path):
    (tmp_path / "a" / "b").mkdir(parents=True)
    write_png(tmp_path / "a" / "b" / "gloss.png", np.zeros((2, 4, 1), np.uint8))
    status, out, err = run("inspect", "**/*", cwd=tmp_path)
    assert (status, err) == (0, "")
    assert out.startswith("a/b/gloss.png: PNG picture\n")
    assert run("inspect", "b/**", cwd=tmp_path)[0] == 2


def test_of_many_rows_the_first_are_printed_and_json_has_all(tmp_path):
    (tmp_path / "a.xml").write_bytes(
        scene(*150 * ['<bsdf type="ward"/>\n', '<bsdf type="roughplastic"/>\n'])
    )
    status, out, err = run("inspect", "a.xml", cwd=tmp_path)
    assert status == 1
    assert (out.count("cannot convert: "), out.count("  roughplastic")) == (100, 100)
    assert err.count("… and 50 more; --format json has them all") == 2
    record = inspected(tmp_path / "a.xml", status=1)
    assert (len(record["problems"]), len(record["numbers"])) == (150, 150)


KEYS = {
    "file", "kind", "read", "writer", "taken_for", "facts", "numbers", "textures", "problems",
    "remedy", "notes", "repaired", "command",
}  # fmt: skip


def test_json_has_the_same_keys_for_every_kind(tmp_path):
    write_all(tmp_path)
    (tmp_path / "x.npy").write_bytes(npy())
    (tmp_path / "noise").write_bytes(b"\0\1\2")
    status, out, _ = run("inspect", "*", "no", "--format", "json", cwd=tmp_path)
    assert status == 2
    records = json.loads(out)
    assert len(records) == 9
    assert all(record.keys() == KEYS for record in records)


def test_text_fits_80_columns_and_breaks_no_word(tmp_path):
    write_all(tmp_path)
    (tmp_path / "scene-with-a-long-name-and-all.xml").write_bytes(SCENE)
    (tmp_path / "x.npy").write_bytes(npy())
    (tmp_path / "b.xml").write_bytes(scene('<bsdf type="ward"/>'))
    files = [path for path in sorted(tmp_path.iterdir()) if path.is_file()]
    narrow, wide = (
        re.sub(r"\x1b\[[0-9;?]*[a-zA-Z]", "", run_on_terminal(
            "inspect", *files, COLUMNS=columns, TERM="dumb")[1]).replace("\r", "")
        for columns in ("80", "400")
    )  # fmt: skip
    # But for the file's own name, which is as long as it is.
    long = [x for x in narrow.splitlines() if len(x.rstrip()) > 80 and str(tmp_path) not in x]
    assert long == []
    # A rule is as wide as its table.
    words = {word for word in narrow.split() if word.strip("─")}
    assert words - set(wide.split()) <= {"\\"}
    # What is continued in the next line is one command for a shell.
    commands = re.findall(r"\$ (mdfconv (?:.*\\\n)*.*)", narrow)
    assert {shlex.split(line)[1] for line in commands} == {
        "light", "texture", "mitsuba", "fit", "mtl", "gltf",
    }  # fmt: skip


SUFFIXES = [
    ".mtl", ".gltf", ".glb", ".xml", ".png", ".tif", ".tga", ".exr", ".jpg", ".hdr", ".csv", ".txt",
    ".astm", ".bsdf", ".binary", ".npy", "", ".PNG", ".obj",
]  # fmt: skip
STARTS = [
    b"", b"\x89PNG\r\n\x1a\n", b"II*\0", b"MM\0+", b"v/1\1", b"\xff\xd8\xff", b"#?RADIANCE\n\n",
    b"glTF\2\0\0\0", b"{", b"<scene>", b"newmtl a\nNs ", b"VARS theta_i theta_s\n", b"theta,v\n",
    b"\xff\xfe", b"tensor_file\0\1\0", b"ANGLE, ", b"#ALTA HEADER\n", b"\0\0\0\0\2", b"PK\3\4",
    b'{"asset": {"version": "2.0"}, "materials": [', b"Source  Measured\nScatterRotation\n",
]  # fmt: skip
CONTENT = st.one_of(
    st.binary(max_size=300),
    st.builds(bytes.__add__, st.sampled_from(STARTS), st.binary(max_size=100)),
    st.builds(
        lambda start, words: start + b" ".join(words),
        st.sampled_from(STARTS),
        st.lists(st.sampled_from([b"0.5", b"1", b"\n", b",", b"a", b"nan", b"1e999", b"}", b"Ns"])),
    ),
)


@settings(deadline=None, max_examples=300)
@given(CONTENT, st.sampled_from(SUFFIXES))
@example(b"#?\n\n-Y 1 +X 1\n", ".hdr")
def test_arbitrary_bytes_are_some_kind_of_file(tmp_path_factory, content, suffix):
    path = tmp_path_factory.getbasetemp() / f"any{suffix}"
    path.write_bytes(content)
    found = inspect_file(path)
    assert isinstance(found, FileInspection)
    assert found.is_read or found.problems or found.remedy


@settings(deadline=None, max_examples=30)
@given(CONTENT, st.sampled_from(SUFFIXES), st.sampled_from(["table", "json"]))
def test_arbitrary_bytes_never_end_in_a_mistake(tmp_path_factory, content, suffix, form):
    path = tmp_path_factory.getbasetemp() / f"some{suffix}"
    path.write_bytes(content)
    status, _, err = run_here("inspect", path, "--format", form)
    assert status in (0, 1, 2)
    assert "Traceback" not in err


def test_every_foreign_kind_stays_foreign():
    # The kinds that are read do not take what another helper names.
    assert not {kind.name for kind in FOREIGN} & set(list_kinds())


def test_a_device_is_not_read(tmp_path):
    assert not inspect_file(Path("/dev/zero")).is_read
    (tmp_path / "folder").mkdir()
    assert not inspect_file(tmp_path / "folder").is_read
