"""Keyframes of roughness in glTF: converted as the factors, wherever they are, or named."""

import base64
import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import mdfconv
from mdfconv.scene import GltfTextures, convert_gltf
from tests.cli.runner import run
from tests.scene.test_gltf import ROUGHNESS, chunks_of, factor, glb, text_of, textured

PEAK_ALPHA = "blinn-phong:peak-alpha"
MATERIALS = (factor(0.3),)
FACTOR = "/materials/{}/pbrMetallicRoughness/roughnessFactor"
# The fits of √(2/(N+2)) as it is to r under the environment metric.
KNOWN = {0.3: 0.489322, 0.6: 0.715233}
COMPONENTS = {5120: ("<i1", 127), 5121: ("<u1", 255), 5122: ("<i2", 32767), 5123: ("<u2", 65535)}
COMPONENTS |= {5125: ("<u4", 1), 5126: ("<f4", 1)}


def fit(value, source=PEAK_ALPHA):
    return mdfconv.convert(float(value), source, ROUGHNESS, metric="environment")


def channel(pointer, sampler=0):
    extension = {"KHR_animation_pointer": {"pointer": pointer}}
    return {"sampler": sampler, "target": {"path": "pointer", "extensions": extension}}


def floats(*numbers):
    return np.array(numbers, "<f4").tobytes()


def animated(content, *pointers, materials=MATERIALS, accessor=None, views=None, **more):
    """Return the JSON of a file whose first accessor is one of keyframes."""
    count = len(content) // 4
    first = {"bufferView": 0, "componentType": 5126, "count": count, "type": "SCALAR"}
    times = {"bufferView": 1, "componentType": 5126, "count": count, "type": "SCALAR"}
    pointers = pointers or (FACTOR.format(0),)
    document = {
        "accessors": [first | (accessor or {}), times],
        "bufferViews": views
        or [
            {"buffer": 0, "byteLength": len(content)},
            {"buffer": 0, "byteOffset": len(content), "byteLength": 4 * count},
        ],
        "animations": [
            {
                "samplers": [{"input": 1, "output": 0}],
                "channels": [channel(pointer) for pointer in pointers],
            }
        ],
    }
    return text_of(*materials, **(document | more))


def in_data(content, *pointers, **more):
    everything = content + floats(*range(len(content) // 4))
    packed = base64.b64encode(everything).decode()
    buffers = [{"byteLength": len(everything), "uri": f"data:application/x;base64,{packed}"}]
    return animated(content, *pointers, buffers=buffers, **more)


def in_chunk(content, *pointers, **more):
    everything = content + floats(*range(len(content) // 4))
    text = animated(content, *pointers, buffers=[{"byteLength": len(everything)}], **more)
    return glb(text, everything)


def document_of(data):
    return json.loads(chunks_of(data)[0][1] if data.startswith(b"glTF") else data)


def read(data, accessor):
    """Return the numbers of an accessor as the specification has it."""
    document = document_of(data)
    entry = document["accessors"][accessor]
    view = document["bufferViews"][entry["bufferView"]]
    buffer = document["buffers"][view["buffer"]]
    content = (
        base64.b64decode(buffer["uri"].partition(",")[2]) if "uri" in buffer
        else chunks_of(data)[1][1]
    )  # fmt: skip
    assert buffer["byteLength"] <= len(content) < buffer["byteLength"] + 4
    assert view.get("byteOffset", 0) + view["byteLength"] <= buffer["byteLength"]
    kind, one = COMPONENTS[entry["componentType"]]
    start = view.get("byteOffset", 0) + entry.get("byteOffset", 0)
    assert start % np.dtype(kind).itemsize == 0
    numbers = np.frombuffer(content, kind, entry["count"], start)
    assert numbers.nbytes + entry.get("byteOffset", 0) <= view["byteLength"]
    for name, limit in (("min", np.min), ("max", np.max)):
        if name in entry:
            assert entry[name] == [limit(numbers)]
    return numbers / one if entry.get("normalized") else numbers


def keyframes(data, animation=0, at=0):
    """Return what a channel plays."""
    entry = document_of(data)["animations"][animation]
    sampler = entry["samplers"][entry["channels"][at]["sampler"]]
    assert sampler["input"] == 1
    return read(data, sampler["output"])


@pytest.mark.parametrize("form", [in_data, in_chunk])
def test_keyframes_are_converted_where_they_stand(form):
    limits = {"min": [0.30000001192092896], "max": [0.6000000238418579]}
    data = form(floats(0.3, 0.6), accessor=limits)
    found = convert_gltf(data, PEAK_ALPHA)
    assert not found.problems
    assert keyframes(found.data) == pytest.approx([KNOWN[0.3], KNOWN[0.6]], abs=1e-6)
    assert read(found.data, 1).tolist() == [0, 1]
    before, after = document_of(data), document_of(found.data)
    assert after["accessors"][0].pop("min") == [np.float32(fit(np.float32(0.3)))]
    assert after["accessors"][0].pop("max") == [np.float32(fit(np.float32(0.6)))]
    # Nothing else is changed, and nothing added.
    del before["accessors"][0]["min"], before["accessors"][0]["max"]
    after["materials"] = before["materials"]
    if form is in_data:
        uris = [each["buffers"][0].pop("uri") for each in (before, after)]
        assert [uri.partition(",")[0] for uri in uris] == ["data:application/x;base64"] * 2
        assert len(uris[0]) == len(uris[1])
    assert after == before
    assert found.materials[0].notes == ("with 2 keyframes of animations[0].channels[0]",)
    assert convert_gltf(found.data, ROUGHNESS).data == found.data


def test_keyframes_in_a_file_are_added_and_the_file_stays(tmp_path):
    content = floats(0.3, 0.6) + floats(0, 1)
    (tmp_path / "keys.bin").write_bytes(content)
    data = animated(floats(0.3, 0.6), buffers=[{"byteLength": 16, "uri": "keys.bin"}])
    (tmp_path / "a.gltf").write_bytes(data)
    status, _, err = run("gltf", "a.gltf", "-o", "b.gltf", "--from", PEAK_ALPHA, cwd=tmp_path)
    assert status == 0, err
    result = (tmp_path / "b.gltf").read_bytes()
    assert keyframes(result) == pytest.approx([KNOWN[0.3], KNOWN[0.6]], abs=1e-6)
    assert (tmp_path / "keys.bin").read_bytes() == content
    assert {path.name for path in tmp_path.iterdir()} == {"keys.bin", "a.gltf", "b.gltf"}
    before, after = document_of(data), document_of(result)
    for name in ("accessors", "bufferViews", "buffers"):
        assert after[name][:-1] == before[name]
    # Without a folder they are named.
    found = convert_gltf(data, PEAK_ALPHA)
    ((place, text, _),) = found.problems
    assert place == "animations[0].channels[0]"
    assert text == (
        "animates roughnessFactor of materials[0], and is not converted: "
        "names keys.bin, for which there is no folder"
    )
    folders = GltfTextures(tmp_path, tmp_path)
    assert convert_gltf(data, PEAK_ALPHA, textures=folders).data == result


def uses(document, where):
    """Return a change by which something else needs the keyframes."""
    if where == "sampler":
        document["animations"][0]["channels"].append(
            channel("/materials/0/pbrMetallicRoughness/metallicFactor")
        )
    elif where == "accessor":
        document["animations"].append(
            {"samplers": [{"input": 1, "output": 0}], "channels": [channel("/nodes/0/weights")]}
        )
    elif where == "attribute":
        document["meshes"] = [{"primitives": [{"attributes": {"_HEAT": 0}}]}]
    elif where == "view":
        document["accessors"].append(document["accessors"][0])
    elif where == "bytes":
        document["bufferViews"].append({"buffer": 0, "byteOffset": 4, "byteLength": 8})
    elif where == "no view":
        document["bufferViews"].append(3)
    return document


@pytest.mark.parametrize("where", ["sampler", "accessor", "attribute", "view", "bytes", "no view"])
@pytest.mark.parametrize("form", [in_data, in_chunk])
def test_what_else_uses_the_keyframes_keeps_them(where, form):
    content = floats(0.3, 0.6)
    data = form(content)
    text = json.dumps(uses(document_of(data), where)).encode()
    data = glb(text, chunks_of(data)[1][1]) if form is in_chunk else text
    found = convert_gltf(data, PEAK_ALPHA)
    assert not found.problems
    assert keyframes(found.data) == pytest.approx([KNOWN[0.3], KNOWN[0.6]], abs=1e-6)
    assert read(found.data, 0).tobytes() == content
    before, after = document_of(data), document_of(found.data)
    for name in ("accessors", "bufferViews"):
        assert after[name][:-1] == before[name]
    if where == "sampler":
        assert keyframes(found.data, at=1).tobytes() == content
        assert after["animations"][0]["samplers"][:1] == before["animations"][0]["samplers"]
    if where == "accessor":
        assert after["animations"][1] == before["animations"][1]


@pytest.mark.parametrize("weights", [(0.5, 0.5), (0.5, 0.25), (0.25, None)])
def test_materials_that_share_keyframes(weights):
    materials = [
        factor(0.3)
        | ({"extensions": {"KHR_materials_specular": {"specularFactor": weight}}} if weight else {})
        for weight in weights
    ]
    # The one sampler is shared by three channels.
    pointers = FACTOR.format(0), FACTOR.format(1), "/cameras/0/perspective/yfov"
    data = in_chunk(floats(0.3, 0.6), *pointers, materials=materials)
    found = convert_gltf(data, "blinn-phong:assimp-gltf:0.125")
    assert not found.problems
    for at, weight in enumerate(weights):
        source = f"blinn-phong:assimp-gltf:{weight or 0.125}"
        wanted = [fit(np.float32(each), source) for each in (0.3, 0.6)]
        assert keyframes(found.data, at=at) == pytest.approx(wanted, rel=1e-6)
        assert found.materials[at].result == pytest.approx(fit(0.3, source), rel=1e-6)
    assert keyframes(found.data, at=2).tobytes() == floats(0.3, 0.6)
    assert len(document_of(found.data)["accessors"]) == 2 + len(set(weights))


@pytest.mark.parametrize("component", [5120, 5121, 5122, 5123])
def test_normalized_integers_become_floats(component):
    kind, one = COMPONENTS[component]
    numbers = np.array([one // 3, one // 2, one * 4 // 5], kind)
    content = numbers.tobytes().ljust(12, b"\0")
    entry = {"componentType": component, "normalized": True, "count": 3}
    found = convert_gltf(in_data(content, accessor=entry), PEAK_ALPHA)
    assert not found.problems
    wanted = [fit(number / one) for number in numbers]
    assert keyframes(found.data) == pytest.approx(wanted, rel=1e-6)


def cubic(content, **more):
    document = json.loads(in_data(content, **more))
    document["animations"][0]["samplers"][0]["interpolation"] = "CUBICSPLINE"
    return json.dumps(document).encode()


def test_tangents_of_splines_get_the_slope_of_the_conversion():
    values, before, behind = [0.3, 0.6, 1.0], [0.5, -2.0, 1.0], [1.5, 0.25, 0.0]
    content = floats(*np.column_stack([before, values, behind]).ravel())
    found = convert_gltf(cubic(content), PEAK_ALPHA)
    assert not found.problems
    results = keyframes(found.data).reshape(3, 3)
    # At r = 1 the slope is that from below.
    steps = [(-1e-3, 1e-3), (-1e-3, 1e-3), (-1e-4, 0)]
    for row, value, *tangents, (low, high) in zip(
        results, values, before, behind, steps, strict=True
    ):
        ends = [fit(value + step) for step in (low, high)] if value < 1 else [fit(value + low), 1.0]
        slope = (ends[1] - ends[0]) / (high - low)
        assert row[1] == pytest.approx(fit(value) if value < 1 else 1.0, abs=1e-6)
        assert row[[0, 2]] == pytest.approx(np.array(tangents) * slope, rel=2e-3, abs=1e-6)
    assert found.materials[0].notes == ("with 3 keyframes of animations[0].channels[0]",)
    (problem,) = convert_gltf(cubic(floats(0.3, 0.6)), PEAK_ALPHA).problems
    assert "no three numbers a keyframe" in problem.text


@pytest.mark.parametrize(
    ("source", "content", "accessor", "text"),
    [
        ("blinn-phong:obj2gltf:1", (0.3, 0), {}, "keyframe 1: blinn-phong:obj2gltf:1 has no inv"),
        ("blinn-phong:babylon", (0.05, 0.3), {}, "keyframe 0: blinn-phong:babylon r = 0.05"),
        (PEAK_ALPHA, (0.3, 1.5), {}, "outside the legal range"),
        (PEAK_ALPHA, (0.3, np.nan), {}, "not a finite number"),
        (PEAK_ALPHA, (0.3, -np.inf), {}, "not a finite number"),
        (PEAK_ALPHA, (0.3, 0.6), {"type": "VEC2"}, "are no single numbers"),
        (PEAK_ALPHA, (0.3, 0.6), {"componentType": 5124}, "are no single numbers"),
        (PEAK_ALPHA, (0.3, 0.6), {"componentType": [5126]}, "are no single numbers"),
        (PEAK_ALPHA, (0.3, 0.6), {"count": None}, "are no single numbers"),
        (PEAK_ALPHA, (0.3, 0.6), {"count": 3}, "not within their buffer"),
        (PEAK_ALPHA, (0.3, 0.6), {"count": 10**30}, "not within their buffer"),
        (PEAK_ALPHA, (0.3, 0.6), {"count": -1}, "not within their buffer"),
        (PEAK_ALPHA, (0.3, 0.6), {"byteOffset": 4}, "not within their buffer"),
        (PEAK_ALPHA, (0.3, 0.6), {"byteOffset": "x"}, "are no single numbers"),
        (PEAK_ALPHA, (0.3, 0.6), {"bufferView": 7}, "names no bufferView"),
        (PEAK_ALPHA, (0.3, 0.6), {"bufferView": None}, "names no bufferView"),
        (PEAK_ALPHA, (0.3, 0.6), {"sparse": {"count": 1}}, "in a sparse accessor"),
    ],
)
def test_keyframes_that_are_left(source, content, accessor, text):
    data = in_data(floats(*content), accessor=accessor)
    found = convert_gltf(data, source)
    ((place, problem, _),) = found.problems
    assert place == "animations[0].channels[0]"
    assert text in problem
    assert len(found.materials) == 1
    after, before = json.loads(found.data), json.loads(data)
    del after["materials"], before["materials"]
    assert json.dumps(after) == json.dumps(before)


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"samplers": []}, "names no sampler"),
        ({"samplers": 3}, "names no sampler"),
        ({"samplers": [4]}, "names a sampler that is no object"),
        ({"samplers": [{"output": 9}]}, "names no accessor"),
        ({"samplers": [{}]}, "names no accessor"),
        ({"channels": [channel(FACTOR.format(0), {})]}, "names no sampler"),
        ({"channels": [channel(FACTOR.format(0), 1)]}, "names no sampler"),
        ({"channels": [channel(FACTOR.format(7))]}, "of materials[7], and is not converted"),
    ],
)
def test_animations_that_do_not_add_up(change, text):
    document = json.loads(in_data(floats(0.3, 0.6)))
    document["animations"][0] |= change
    found = convert_gltf(json.dumps(document).encode(), PEAK_ALPHA)
    ((_, problem, _),) = found.problems
    assert text in problem


@pytest.mark.parametrize(
    "animations",
    [3, [3], [{}], [{"channels": 3}], [{"channels": [3, {}, {"target": 3}]}]]
    + [[{"channels": [channel(each)]}] for each in (3, "", "/materials/x", "/materials/0/name")]
    + [[{"channels": [channel("/materials/00/roughness")]}]]
    + [[{"channels": [channel(f"/materials/{'9' * 5000}/roughness")]}]],
)
def test_what_animates_no_roughness_is_nothing(animations):
    found = convert_gltf(text_of(factor(0.3), animations=animations), PEAK_ALPHA)
    assert not found.problems
    assert len(found.materials) == 1


def test_compressed_views_are_left():
    document = json.loads(in_data(floats(0.3, 0.6)))
    for more in ({"byteStride": 8}, {"extensions": {"EXT_meshopt_compression": {}}}):
        document["bufferViews"][0] = {"buffer": 0, "byteLength": 8} | more
        (problem,) = convert_gltf(json.dumps(document).encode(), PEAK_ALPHA).problems
        assert "compressed or apart" in problem.text


@pytest.mark.parametrize(
    ("member", "source"),
    [
        ("extensions/KHR_materials_clearcoat/clearcoatRoughnessFactor", PEAK_ALPHA),
        ("extensions/KHR_materials_sheen/sheenRoughnessFactor", PEAK_ALPHA),
        ("extensions/KHR_materials_pbrSpecularGlossiness/glossinessFactor", PEAK_ALPHA),
        ("extensions/KHR_materials_pbrSpecularGlossiness/glossinessFactor", "ggx:gltf-glossiness"),
        ("pbrMetallicRoughness/roughnessFactor", "ggx:gltf-glossiness"),
    ],
)
def test_animations_of_other_layers_are_named(member, source):
    glossiness = {"KHR_materials_pbrSpecularGlossiness": {"glossinessFactor": 0.3}}
    material = {"extensions": glossiness}
    found = convert_gltf(
        in_data(floats(0.3, 0.6), f"/materials/0/{member}", materials=[material]), source
    )
    name = member.rpartition("/")[2]
    text = f"animates {name} of materials[0], and is not converted"
    assert ("animations[0].channels[0]", text) in [each[:2] for each in found.problems]
    assert keyframes(found.data).tobytes() == floats(0.3, 0.6)


def test_what_means_the_same_is_not_named():
    pointer = "/materials/0/extensions/KHR_materials_clearcoat/clearcoatRoughnessFactor"
    data = in_data(floats(0.3, 0.6), pointer, FACTOR.format(0))
    for source in (ROUGHNESS, "ggx:gltf-glossiness"):
        found = convert_gltf(data, source)
        assert (found.data, found.problems) == (data, ())


def test_glossiness_is_converted_where_it_is():
    name = "KHR_materials_pbrSpecularGlossiness"
    material = {"extensions": {name: {"glossinessFactor": 0.3}}}
    pointer = f"/materials/0/extensions/{name}/glossinessFactor"
    data = in_data(floats(0.3, 0.6), pointer, materials=[material])
    source, target = "blinn-phong:unity-fbx", "ggx:gltf-glossiness"
    found = convert_gltf(data, source, target)
    assert not found.problems
    wanted = [
        mdfconv.convert(float(each), source, target, metric="environment") for each in (0.3, 0.6)
    ]
    assert keyframes(found.data) == pytest.approx(wanted, abs=1e-6)


def test_a_texture_whose_factor_is_animated_is_left_with_it(tmp_path):
    data = in_data(floats(0.3, 0.6), materials=[textured(0, 0.5)], textures=[{"source": 0}])
    for folders in (None, GltfTextures(tmp_path, tmp_path)):
        found = convert_gltf(data, PEAK_ALPHA, textures=folders)
        assert [each.place for each in found.problems] == [
            "materials[0]", "animations[0].channels[0]"
        ]  # fmt: skip
        assert found.data == data
    assert "keyframes of roughnessFactor, which is before a texture" in found.problems[0].text


@settings(deadline=None, max_examples=30)
@given(st.lists(st.floats(2**-7, 1, width=32), min_size=1, max_size=6), st.booleans())
def test_keyframes_become_what_factors_do(values, chunked):
    data = (in_chunk if chunked else in_data)(floats(*values))
    found = convert_gltf(data, "blinn-phong:peak")
    factors = convert_gltf(text_of(*map(factor, values)), "blinn-phong:peak").materials
    assert not found.problems
    assert keyframes(found.data) == pytest.approx([each.result for each in factors], rel=1e-6)
