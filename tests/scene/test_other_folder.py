"""Results in another folder: what they name by paths that no longer lead there."""

import json

import pytest

from tests.cli.runner import run

# A file of each kind with two that it names, the second of which goes with it wherever it goes.
FILES = {
    "a.mtl": "newmtl a\nNs 5\nmap_Kd -s 1 1 1 sub/x.png # wood\nBump {there}\n",
    "a.gltf": json.dumps(
        {
            "asset": {"version": "2.0"},
            "materials": [{"pbrMetallicRoughness": {"roughnessFactor": 0.9}}],
            "images": [{"uri": "sub/x%2Epng"}, {"uri": "data:image/png;base64,AA=="}],
            "buffers": [{"uri": "{there}", "byteLength": 1}, {"byteLength": 1}],
        }
    ),
    "a.xml": '<scene version="3.0.0"><include filename="{there}"/><texture type="bitmap">'
    '<string name="filename" value="sub/x.png"/></texture></scene>\n',
}
WORDS = {
    "a.mtl": ["mtl"],
    "a.gltf": ["gltf", "--from", "blinn-phong:obj2gltf:0.5"],
    "a.xml": ["mitsuba"],
}


@pytest.fixture(params=FILES)
def name(request, tmp_path):
    (tmp_path / "sub").mkdir()
    for file in ("sub/x.png", "there"):
        (tmp_path / file).touch()
    content = FILES[request.param].replace("{there}", str(tmp_path / "there"))
    (tmp_path / request.param).write_text(content)
    return request.param


def test_what_is_no_longer_found_is_named(name, tmp_path):
    status, _, err = run(*WORDS[name], name, "-o", "out/", cwd=tmp_path)
    assert status == 0
    note = f"note: out/{name} names sub/x.png, which is found from . and not from out: copy them"
    assert err.count(note) == 1
    # Where it is found there, too, nothing is to be said.
    (tmp_path / "out/sub").mkdir()
    (tmp_path / "out/sub/x.png").touch()
    assert "note:" not in run(*WORDS[name], name, "-o", "out/", "--force", cwd=tmp_path)[2]


def test_beside_the_original_all_is_found(name, tmp_path):
    status, _, err = run(*WORDS[name], name, "-o", f"new-{name}", cwd=tmp_path)
    assert status == 0
    assert "note:" not in err


@pytest.mark.parametrize("names", [("a.gltf", "b.glb"), ("a.glb", "b.gltf")])
def test_the_form_of_a_gltf_is_what_its_name_says(names, tmp_path):
    text = FILES["a.gltf"].encode()
    if names[0] == "a.glb":
        body = text + b" " * (-len(text) % 4)
        sizes = (20 + len(body)).to_bytes(4, "little"), len(body).to_bytes(4, "little")
        text = b"glTF" + (2).to_bytes(4, "little") + sizes[0] + sizes[1] + b"JSON" + body
    (tmp_path / names[0]).write_bytes(text)
    words = *WORDS["a.gltf"], names[0], "-o"
    status, out, err = run(*words, names[1], cwd=tmp_path)
    assert (status, out) == (2, "")
    right = f"b{names[0][1:]}"
    assert err.endswith(f"; name it {right}\n")
    assert run(*words, right, cwd=tmp_path)[0] == 0
