"""Files that mdfconv does not read: each kind is named by every command, with the way out."""

import bz2
import gzip
import io
import json
import lzma
import struct
import tarfile
import zipfile

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from PIL import Image

from mdfconv.errors import MdfconvError
from mdfconv.light.spectrum import read_environment_map
from mdfconv.measured import read
from mdfconv.output.kinds import FOREIGN, HEAD_BYTES, foreign
from mdfconv.scene.texture.convert import convert_texture_file
from mdfconv.scene.texture.rule import TextureRule
from tests.cli.runner import run
from tests.scene.pictures import write_png

NAMES = [kind.name for kind in FOREIGN]
POINTER = b"version https://git-lfs.github.com/spec/v1\noid sha256:" + b"0" * 64 + b"\nsize 199\n"


def archive(*names, content=b"some content", compression=zipfile.ZIP_DEFLATED):
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", compression) as zipped:
        for name in names:
            zipped.writestr(name, content)
    return file.getvalue()


def saved(save, *arguments, **named):
    file = io.BytesIO()
    save(file, *arguments, **named)
    return file.getvalue()


def picture(form):
    return saved(Image.new("RGB", (4, 4)).save, form)


def tar():
    file = io.BytesIO()
    with tarfile.open(fileobj=file, mode="w") as packed:
        packed.addfile(tarfile.TarInfo("a.csv"))
    return file.getvalue()


SPREADSHEET = b"application/vnd.oasis.opendocument.spreadsheet"
# As the programs write them, or the first bytes that their formats prescribe.
SAMPLES = {
    "a Git LFS pointer, not the file itself": [POINTER],
    "a git-annex pointer, not the file itself": [b"/annex/objects/SHA256E-s9--0.csv\n"],
    "a web page": [
        b"\n\n<!DOCTYPE html>\n<html lang='en'>",
        b"\xef\xbb\xbf<html><head>",
        b'<?xml version="1.0" encoding="UTF-8"?>\n<!doctype HTML PUBLIC "x">',
    ],
    "the error message of a download": [b"404: Not Found", b"403 Forbidden\n"],
    "an Excel workbook": [
        archive("[Content_Types].xml", "_rels/.rels", "xl/workbook.xml"),
        archive("docProps/app.xml", "xl/worksheets/sheet1.xml"),
    ],
    "an OpenDocument spreadsheet": [
        archive("mimetype", content=SPREADSHEET, compression=zipfile.ZIP_STORED)
    ],
    "an OLE file, as Excel 97's (.xls)": [bytes.fromhex("d0cf11e0a1b11ae1") + bytes(504)],
    "a NumPy array (.npy)": [saved(np.save, np.ones((3, 3)))],
    "an archive of NumPy arrays (.npz)": [
        saved(np.savez, a=np.ones(3)), saved(np.savez_compressed, theta_i=np.ones(3))
    ],
    "a MATLAB file": [b"MATLAB 5.0 MAT-file, Platform: GLNXA64".ljust(128) + bytes(40)],
    "an HDF5 file": [b"\x89HDF\r\n\x1a\n\0\0\0\0"],
    "a Parquet file": [b"PAR1\x15\x04"],
    "a surface file of Speos (OPTIS)": [
        b"OPTIS - brdf surface file v9.0\n0\nScattering surface\n",
        b"\xef\xbb\xbfOPTIS - Anisotropic BSDF surface file v8.0\r\n",
    ],
    "a PDF document": [b"%PDF-1.7\n%\xe2\xe3\xcf\xd3\n"],
    "a USDZ archive": [archive("scene.usdc", compression=zipfile.ZIP_STORED)],
    "a USD file": [b"PXR-USDC\0\x08", b'#usda 1.0\n(\n    defaultPrim = "a"\n)\n'],
    "an FBX file": [b"Kaydara FBX Binary  \0\x1a\0", b"; FBX 7.4.0 project file\n"],
    "a Blender file": [b"BLENDER-v300RENDH", b"BLENDER17-01v0500"],
    "a Collada file": [b'<?xml version="1.0"?>\n<COLLADA xmlns="x" version="1.4.1">\n'],
    "a DDS texture": [picture("dds")],
    "a KTX texture": [b"\xabKTX 11\xbb\r\n\x1a\n", b"\xabKTX 20\xbb\r\n\x1a\n"],
    "a Basis texture": [struct.pack("<HHH", 0x4273, 0x13, 77) + bytes(71)],
    "a WebP picture": [b"RIFF\x1a\0\0\0WEBPVP8L"],
    "an AVIF or HEIF picture": [b"\0\0\0\x1cftypavif", b"\0\0\0\x18ftypheic"],
    "a JPEG XL picture": [b"\0\0\0\x0cJXL \r\n\x87\n"],
    "a JPEG 2000 picture": [b"\0\0\0\x0cjP  \r\n\x87\n", b"\xff\x4f\xff\x51\0\x2f"],
    "a GIF picture": [picture("gif")],
    "a BMP picture": [picture("bmp")],
    "a Photoshop document": [b"8BPS\0\x01" + bytes(6)],
    "a Radiance picture": [b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n\1\2\3\4"],
    "a ZIP archive": [archive("scans/a.csv"), archive("[Content_Types].xml", "word/document.xml")],
    "compressed by gzip": [gzip.compress(b"theta,brdf\n")],
    "compressed by bzip2": [bz2.compress(b"theta,brdf\n")],
    "compressed by xz": [lzma.compress(b"theta,brdf\n")],
    "compressed by Zstandard": [b"\x28\xb5\x2f\xfd\x24\x0b"],
    "a 7-Zip archive": [b"7z\xbc\xaf\x27\x1c\0\x04"],
    "a RAR archive": [b"Rar!\x1a\x07\x01\0"],
    "a tar archive": [tar()],
}  # fmt: skip
# A command for each of the ways in which files are read, and the ending of its files.
COMMANDS = {
    "mtl": ("mtl", []),
    "gltf": ("gltf", ["--from", "ggx:alpha"]),
    "mitsuba": ("xml", []),
    "texture": ("png", ["--from", "ggx:alpha", "--to", "ggx:roughness"]),
    "light": ("hdr", []),
    "fit": ("csv", []),
}
ARBITRARY = settings(
    max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)


def test_each_kind_has_a_sample():
    assert list(SAMPLES) == NAMES, "add the first bytes of such a file to SAMPLES"


@pytest.mark.parametrize("name", NAMES)
def test_each_kind_is_known_by_its_first_bytes(name):
    for sample in SAMPLES[name]:
        kind = foreign(sample)
        assert kind is not None
        assert kind.name == name
        assert kind.way_out
        assert foreign(sample.ljust(2 * HEAD_BYTES)) == kind or name.startswith("the error")


def test_what_is_read_is_not_foreign(tmp_path):
    texts = (
        "", "\n", "newmtl a\nNs 10\n", "# Blender MTL File\nnewmtl a\n", '{"asset": {}}', "glTF",
        '<?xml version="1.0"?><scene version="3.0.0"/>', "theta,brdf\n1,2\n", "404,1\n405,2\n",
        "%PDF is no comment here", "#usd 1\n", "BM,1\n", "tensor_file\0", "VARS theta_i\n",
    )  # fmt: skip
    png = write_png(tmp_path / "a.png", np.zeros((2, 2, 1), np.uint8)).read_bytes()
    pictures = [png, *(picture(form) for form in ("tiff", "jpeg", "tga"))]
    for content in [*(text.encode() for text in texts), *pictures]:
        assert foreign(content) is None
        assert foreign(content[:3]) is None


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_names_a_pointer(tmp_path, command):
    ending, arguments = COMMANDS[command]
    path, output = tmp_path / f"file.{ending}", tmp_path / f"result.{ending}"
    path.write_bytes(POINTER)
    written = [] if command in ("light", "fit") else ["-o", output]
    status, out, err = run(command, path, *written, *arguments)
    assert (status, out) == (2, "")
    said = "is a Git LFS pointer, not the file itself; fetch the file: git lfs pull"
    assert err == f"mdfconv: {path} {said}\n"
    assert list(tmp_path.iterdir()) == [path]


def test_textures_of_materials_are_named(tmp_path):
    (tmp_path / "t.png").write_bytes(POINTER)
    (tmp_path / "a.mtl").write_text("newmtl a\nNs 100\nmap_Ns t.png\n")
    texture = {"index": 0}
    material = {"pbrMetallicRoughness": {"metallicRoughnessTexture": texture}}
    document = {"asset": {"version": "2.0"}, "images": [{"uri": "t.png"}]}
    document |= {"textures": [{"source": 0}], "materials": [material]}
    (tmp_path / "a.gltf").write_text(json.dumps(document))
    for name, arguments in (("a.mtl", []), ("a.gltf", ["--from", "ggx:alpha"])):
        path, output = tmp_path / name, tmp_path / f"new_{name}"
        command = path.suffix[1:]
        status, _, err = run(command, path, "-o", output, "--textures", *arguments)
        assert status == 1
        assert "is a Git LFS pointer, not the file itself; fetch the file: git lfs pull" in err


@pytest.mark.parametrize("name", [name for name in NAMES if "Radiance" not in name])
@ARBITRARY
@given(rest=st.binary(max_size=600))
def test_arbitrary_bytes_behind_a_signature_are_refused(tmp_path, name, rest):
    """As measurements, as a texture and, where OpenImageIO does not read them, as a light."""
    refusals = []
    rule = TextureRule("ggx:alpha", "ggx:roughness")
    for place, sample in enumerate(SAMPLES[name]):
        path = tmp_path / f"{place}.bin"
        path.write_bytes(sample + rest)
        for reading in (
            lambda path=path: read(path),
            lambda path=path: convert_texture_file(path, tmp_path / "result.png", rule),
        ):
            with pytest.raises(MdfconvError) as caught:
                reading()
            refusals.append(str(caught.value))
        with pytest.raises(MdfconvError) as caught:
            read_environment_map(path)
        assert len(str(caught.value).splitlines()) == 1
    if name.startswith("the error"):
        return  # which is the whole of a file
    way_out = foreign(SAMPLES[name][0]).way_out
    assert all(f" is {name}; {way_out}" in refusal for refusal in refusals)


@pytest.mark.parametrize(
    ("content", "kind"),
    [
        (b' {"theta": [1, 2]}', "a JSON file"),
        (b"\n[[1, 2], [3, 4]]", "a JSON file"),
        (b'<?xml version="1.0"?><a/>', "an XML file"),
        (picture("png"), "a picture, not measurements"),
        (picture("jpeg"), "a picture, not measurements"),
    ],
)
def test_what_other_commands_read_is_named_as_no_measurements(tmp_path, content, kind):
    path = tmp_path / "scan.csv"
    path.write_bytes(content)
    with pytest.raises(MdfconvError, match=f"scan.csv is {kind}; save its numbers as CSV"):
        read(path)


@ARBITRARY
@given(content=st.binary(max_size=HEAD_BYTES + 9))
def test_any_bytes_have_a_kind_or_none(content):
    assert foreign(content) in (*FOREIGN, None)
