"""What glTF files mean: by their generator, weights, texels and layers; marks, and what is left."""

import base64
import io
import json
from contextlib import suppress

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from PIL import Image

import mdfconv
from mdfconv.distributions.dialects import DIALECTS, Specular
from mdfconv.distributions.endpoint import endpoint
from mdfconv.errors import MdfconvError
from mdfconv.fitting.metrics import metric_named
from mdfconv.scene import GltfTextures, convert_gltf
from mdfconv.scene.gltf.ends import MaterialEnds
from mdfconv.scene.shininess import exponent_of
from mdfconv.scene.stored import ProblemKind
from tests.cli.runner import run
from tests.distributions.test_dialects import STORED, rule
from tests.scene.pictures import read_png, write_png
from tests.scene.test_gltf import (
    KNOWN,
    OBJ2GLTF,
    ROUGHNESS,
    content_of,
    data_uri,
    factor,
    factors_of,
    glb,
    png,
    texels_of,
    text_of,
    textured,
)

GLOSSINESS, EXTENSION = "ggx:gltf-glossiness", "KHR_materials_pbrSpecularGlossiness"
PEAK_ALPHA = "blinn-phong:peak-alpha"


def by(generator, *materials, **more):
    return text_of(*materials, asset={"version": "2.0", "generator": generator}, **more)


def extended(material, **extensions):
    return material | {"extensions": extensions}


def weighted(value, *color, **members):
    specular = members | ({"specularColorFactor": list(color)} if color else {})
    return extended(factor(value), KHR_materials_specular=specular)


def glossy(value=None, **more):
    return {EXTENSION: ({} if value is None else {"glossinessFactor": value}) | more}


# What a file says of who wrote it.


def test_a_generator_says_what_the_numbers_are(tmp_path):
    found = convert_gltf(by("FBX2glTF v0.9.7", factor(0.3)))
    assert (found.source, found.target) == (PEAK_ALPHA, ROUGHNESS)
    assert found.materials[0].result == pytest.approx(0.489322, abs=1e-6)
    assert found.remarks[0][0] == f"written by 'FBX2glTF v0.9.7': r = √(2/(N+2)) ({PEAK_ALPHA})"
    (tmp_path / "a.gltf").write_bytes(by("FBX2glTF v0.9.7", factor(0.3)))
    words = "gltf", "a.gltf", "-o", "b.gltf", "--format", "json"
    for more in ((), ("--from", "AUTO")):
        status, out, err = run(*words, *more, "--force", cwd=tmp_path)
        assert status == 0, err
        (record,) = json.loads(out)
        assert (record["from"], record["to"]) == (PEAK_ALPHA, ROUGHNESS)
        assert record["notes"] == [{"note": found.remarks[0][0]}]
        assert f"note: a.gltf: {found.remarks[0][0]}" in err
    # An option is above what the file says.
    status, _, err = run(*words, "--from", "ggx:alpha", "--force", cwd=tmp_path)
    assert status == 0
    assert "was written by 'FBX2glTF v0.9.7', which stands for --from blinn-phong:peak-a" in err
    assert factors_of((tmp_path / "b.gltf").read_bytes()) == pytest.approx([0.3**0.5])


@pytest.mark.parametrize(
    ("generator", "text"),
    [
        ("", "glTF's own roughness; mdfconv inspect"),
        ("Sketchfab-12.66.0", "was written by 'Sketchfab-12.66.0', whose rule is not known; name"),
        (
            "Khronos glTF Blender I/O v3.6.27",
            "stands for blinn-phong:blender-obj if its materials came from a Wavefront OBJ; name",
        ),
        ("trimesh by VTK", "stands for blinn-phong:peak or blinn-phong:vtk-gltf; name"),
    ],
)
def test_a_generator_that_says_too_little_is_refused(generator, text, tmp_path):
    (tmp_path / "a.gltf").write_bytes(by(generator, factor(0.3)))
    status, _, err = run("gltf", "a.gltf", "-o", "b.gltf", cwd=tmp_path)
    assert status == 2
    assert err.startswith("mdfconv: a.gltf: ")
    assert text in err
    assert err.endswith("(--from)\n")
    assert err.count("\n") == 1
    assert not (tmp_path / "b.gltf").exists()
    with pytest.raises(MdfconvError, match="mdfconv inspect") as caught:
        convert_gltf(by(generator, factor(0.3)))
    assert "--" not in str(caught.value)


# Weights of the specular lobe.


@pytest.mark.parametrize("name", ["assimp-gltf", "vtk-gltf", "adobe-usd", "obj2gltf"])
def test_materials_say_their_weights(name):
    source = f"blinn-phong:{name}"
    data = text_of(
        weighted(0.7, 0.04, 0.04, 0.04),
        weighted(0.7, 0.1, 0.5, 0.9, specularFactor=0.5),
        weighted(0.7, specularFactor=0.25),
        weighted(0.7),
        factor(0.7),
    )
    weights = 0.04, 0.5 * (0.2125 * 0.1 + 0.7154 * 0.5 + 0.0721 * 0.9), 0.25, 1, 0.375
    found = convert_gltf(data, source, specular=0.375)
    assert not found.problems
    assert not found.remarks
    for entry, weight in zip(found.materials, weights, strict=True):
        wanted = mdfconv.convert(0.7, f"{source}:{weight!r}", ROUGHNESS, metric="environment")
        assert entry.result == pytest.approx(wanted, rel=1e-7)
        known = weight if entry.index < 4 else np.nan
        assert entry.specular == pytest.approx(known, rel=1e-8, nan_ok=True)
        assert any("KHR_materials_specular" in note for note in entry.notes) == (entry.index < 4)
    named = convert_gltf(data, f"{source}:0.375")
    assert [each.result for each in named.materials] == [each.result for each in found.materials]


def test_a_weight_that_is_needed_is_asked_for(tmp_path):
    source = "blinn-phong:assimp-gltf"
    data = by("assimp", factor(0.7), weighted(0.7, 0.5, 0.5, 0.5))
    (tmp_path / "a.gltf").write_bytes(data)
    words = "gltf", "a.gltf", "-o", "b.gltf", "--force"
    status, _, err = run(*words, cwd=tmp_path)
    assert status == 1
    assert (
        "a.gltf:materials[0]: assimp-gltf depends on the specular weight L; give it, as in "
        "blinn-phong:assimp-gltf:0.5 (--specular): left as it is" in err
    )
    first, second = factors_of((tmp_path / "b.gltf").read_bytes())
    assert first == 0.7
    wanted = mdfconv.convert(0.7, f"{source}:0.5", ROUGHNESS, metric="environment")
    assert second == pytest.approx(wanted, rel=1e-7)
    # Of both options, and by the file's generator, too.
    for more in (["--specular", "0.5"], ["--from", f"{source}:0.5"]):
        status, _, err = run(*words, *more, cwd=tmp_path)
        assert status == 0, err
        result = factors_of((tmp_path / "b.gltf").read_bytes())
        assert result == pytest.approx([wanted, wanted], rel=1e-7)


def test_a_weight_that_is_assumed_is_noted_once():
    found = convert_gltf(text_of(factor(0.9), factor(0.5), weighted(0.9)), OBJ2GLTF)
    ((text, kind),) = found.remarks
    assert kind is ProblemKind.SPECULAR
    assert "L, the luminance of Ks, is not in the file: it was taken for 1" in text
    assert "for L < 0.1 times (1 − L)" in text
    assert found.materials[0].result == pytest.approx(KNOWN[0.9], abs=1e-6)
    for data, more in (
        (text_of(weighted(0.9)), {}),
        (text_of(factor(0.9)), {"specular": 0.5}),
        # It changes nothing here.
        (text_of(factor(1)), {}),
        (text_of(), {}),
    ):
        assert not convert_gltf(data, OBJ2GLTF, **more).remarks


@pytest.mark.parametrize(
    ("specular", "text"),
    [
        (3, "its KHR_materials_specular has no specular colour"),
        ({"specularFactor": "a"}, "has no specular colour"),
        ({"specularFactor": None}, "has no specular colour"),
        ({"specularColorFactor": [1, 1]}, "has no specular colour"),
        ({"specularColorFactor": [1, 1, "a"]}, "has no specular colour"),
        ({"specularColorFactor": 1}, "has no specular colour"),
        ({"specularFactor": 10**400}, "has no specular colour"),
        ({"specularColorFactor": [2, 2, 2]}, "a specular weight is above 0 and at most 1, not 2"),
        ({"specularFactor": 0}, "a specular weight is above 0 and at most 1, not 0"),
        ({"specularFactor": -0.5}, "at most 1, not -0.5"),
        ({"specularFactor": float("nan")}, "at most 1, not nan"),
    ],
)
def test_weights_that_are_none_are_problems(specular, text):
    data = text_of(extended(factor(0.7), KHR_materials_specular=specular), factor(0.7))
    found = convert_gltf(data, "blinn-phong:assimp-gltf:0.5")
    ((place, problem, _),) = found.problems
    assert place == "materials[0]"
    assert text in problem
    assert [entry.index for entry in found.materials] == [1]
    # For other rules it does not matter.
    assert len(convert_gltf(data, PEAK_ALPHA).materials) == 2


# Textures.


def with_texture(content, value=None, **more):
    return text_of(
        textured(0, value), textures=[{"source": 0}], images=[{"uri": data_uri(content)}], **more
    )


@pytest.fixture
def folders(tmp_path):
    return GltfTextures(tmp_path, tmp_path)


def test_texels_of_obj2gltf_are_asked_for(tmp_path):
    gloss = np.tile(np.linspace(0, 255, 32).round().astype(np.uint8), (4, 1))
    white = np.full_like(gloss, 255)
    content = io.BytesIO()
    Image.fromarray(np.stack([white, gloss, white], axis=-1)).save(content, "png")
    # As obj2gltf 3.2 stores a map_Ns: as it is, with a factor of 1.
    image = content.getvalue()
    images = [{"bufferView": 0, "mimeType": "image/png"}]
    views = [{"buffer": 0, "byteLength": len(image)}]
    shared = {"textures": [{"source": 0}], "images": images, "bufferViews": views}
    text = by("obj2gltf", textured(0, 1), factor(0.9), **shared, buffers=[{"byteLength": 9999}])
    (tmp_path / "a.glb").write_bytes(glb(text.replace(b"9999", str(len(image)).encode()), image))
    words = "gltf", "a.glb", "-o", "b.glb", "--textures", "--force"
    status, _, err = run(*words, cwd=tmp_path)
    assert status == 1
    assert "is not known of blinn-phong:obj2gltf (--texels): left as it is" in err
    assert image in (tmp_path / "b.glb").read_bytes()
    status, _, err = run(*words, "--texels", "ggx:glossiness", cwd=tmp_path, COLUMNS="200")
    assert status == 0, err
    assert "its texels taken for ggx:glossiness" in err
    result = (tmp_path / "b.glb").read_bytes()
    start = result.rindex(b"\x89PNG")
    texels = texels_of(result[start:])
    assert np.corrcoef(texels[..., 1].ravel(), gloss.ravel())[0, 1] == pytest.approx(-1)
    assert np.array_equal(texels[..., 1], 255 - gloss)
    assert np.array_equal(texels[..., [0, 2]], np.stack([white, white], axis=-1))
    assert b"0.33148781" in result


def test_texels_are_what_the_program_is_known_to_write(folders):
    # FBX2glTF: as the factors; texels times the factor, by hand.
    content = png(3)
    found = convert_gltf(with_texture(content, 0.5), PEAK_ALPHA, textures=folders)
    assert not found.problems
    assert found.materials[0].notes[1] == f"its texels taken for {PEAK_ALPHA}"
    (image,) = json.loads(found.data)["images"]
    texels = texels_of(content)[..., 1]
    wanted = mdfconv.convert(texels / 255 * 0.5, PEAK_ALPHA, ROUGHNESS, metric="environment")
    after = texels_of(content_of(image))[..., 1]
    assert np.abs(after / 255 - wanted).max() <= 0.5 / 255 + 1e-7
    # Blender's are a roughness, and are right, with a factor or without --textures.
    for more in ({"textures": folders}, {}):
        data = with_texture(content, 0.5)
        found = convert_gltf(data, "blinn-phong:blender-obj", **more)
        assert (found.data, found.problems) == (data, ())
        (entry,) = found.materials
        assert (entry.value, entry.result) == (0.5, 0.5)
        assert entry.notes == (f"the texels of its texture were taken for {ROUGHNESS}, and stay",)


@pytest.mark.parametrize(
    ("texels", "wanted"),
    [
        ("ggx:glossiness", lambda v: 1 - v),
        ("ggx", lambda v: v**0.5),
        (
            "blinn-phong:exponent",
            lambda v: mdfconv.convert(1000 * v, "blinn-phong", ROUGHNESS, metric="environment"),
        ),
    ],
)
def test_texels_as_they_are_said_to_be(texels, wanted, folders):
    content = png(4)
    found = convert_gltf(with_texture(content, 0.5), OBJ2GLTF, textures=folders, texels=texels)
    assert not found.problems
    assert found.materials[0].notes[1] == f"its texels taken for {texels}"
    (image,) = json.loads(found.data)["images"]
    values = np.array([wanted(v) for v in (texels_of(content)[..., 1] / 255 * 0.5).ravel()])
    after = texels_of(content_of(image))[..., 1].ravel()
    assert np.abs(after / 255 - values).max() <= 0.5 / 255 + 1e-7
    assert factors_of(found.data) == [1]


def test_a_factor_of_0_does_not_show_its_texture():
    found = convert_gltf(with_texture(png(), 0), "blinn-phong:unity-fbx")
    ((place, text, _),) = found.problems
    assert (place, text) == ("materials[0]", "roughnessFactor 0 before a texture would be 1")
    assert found.data == with_texture(png(), 0)


# Layers.


STRAYS = {
    "KHR_materials_clearcoat": {
        "clearcoatFactor": 1, "clearcoatRoughnessFactor": 0.3, "clearcoatRoughnessTexture": {}
    },
    "KHR_materials_sheen": {"sheenRoughnessFactor": 0.5},
    "KHR_materials_iridescence": {"iridescenceFactor": 0.5},
    "MSFT_packing_occlusionRoughnessMetallic": {"roughnessMetallicOcclusionTexture": {"index": 0}},
    "KHR_materials_cmnBlinnPhong": {"shininess": 80},
    "EXT_none": 3,
}  # fmt: skip


def test_every_other_roughness_is_named():
    data = text_of(extended(factor(0.3), **STRAYS, **glossy(0.7)), extended({}, **glossy()))
    found = convert_gltf(data, PEAK_ALPHA)
    path = "materials[0].extensions."
    named = f"is not converted ({GLOSSINESS} names it)"
    assert [problem[:2] for problem in found.problems] == [
        (f"{path}KHR_materials_clearcoat", "clearcoatRoughnessFactor 0.3 is not converted"),
        (f"{path}KHR_materials_clearcoat", "clearcoatRoughnessTexture is not converted"),
        (f"{path}KHR_materials_sheen", "sheenRoughnessFactor 0.5 is not converted"),
        (
            f"{path}MSFT_packing_occlusionRoughnessMetallic",
            "roughnessMetallicOcclusionTexture is not converted",
        ),
        (f"{path}KHR_materials_cmnBlinnPhong", "shininess 80 is not converted"),
        (path + EXTENSION, f"glossinessFactor 0.7 {named}"),
        # The default, which a viewer shows that knows the extension.
        (f"materials[1].extensions.{EXTENSION}", f"glossinessFactor 1 {named}"),
    ]
    assert len(found.materials) == 2


def test_what_would_not_change_is_not_named():
    data = text_of(extended(factor(0.3), **STRAYS, **glossy(0.7)))
    assert convert_gltf(data, ROUGHNESS).problems == ()
    # Of a mirror.
    clear = {"KHR_materials_clearcoat": {"clearcoatRoughnessFactor": 0}}
    assert convert_gltf(text_of(extended(factor(0.3), **clear)), PEAK_ALPHA).problems == ()
    assert len(convert_gltf(text_of(extended(factor(0.3), **clear)), OBJ2GLTF).problems) == 1


def test_what_is_left_turns_the_status_to_1(tmp_path):
    document = text_of(extended(factor(0.3), **glossy(0.7)))
    (tmp_path / "a.gltf").write_bytes(document)
    status, _, err = run("gltf", "a.gltf", "-o", "b.gltf", "--from", PEAK_ALPHA, cwd=tmp_path)
    assert status == 1
    assert f"a.gltf:materials[0].extensions.{EXTENSION}: glossinessFactor 0.7 is not" in err


# Specular and glossiness.


def rgba(seed=0):
    texels = np.random.default_rng(seed).integers(0, 256, (6, 5, 4), np.uint8)
    content = io.BytesIO()
    Image.fromarray(texels).save(content, "png")
    return content.getvalue()


def test_glossiness_is_converted_where_it_is(folders):
    layer = {"specularFactor": [0.2, 0.2, 0.2]}
    content = rgba()
    data = text_of(
        extended({}, **glossy(0.75, **layer)),
        extended(factor(0.5), **glossy(0.5, specularGlossinessTexture={"index": 0})),
        {"name": "without"},
        textures=[{"source": 0}],
        images=[{"uri": data_uri(content)}],
    )
    source = "blinn-phong:unity-fbx"
    found = convert_gltf(data, source, GLOSSINESS, textures=folders, texels=endpoint(source))
    # N = 100 g².
    wanted = mdfconv.convert(56.25, "blinn-phong", "ggx:glossiness", metric="environment")
    after = json.loads(found.data)
    layers = [each["extensions"][EXTENSION] for each in after["materials"][:2]]
    assert layers[0] == layer | {"glossinessFactor": pytest.approx(wanted, rel=1e-7)}
    assert layers[1] == {"glossinessFactor": 1, "specularGlossinessTexture": {"index": 0}}
    assert after["materials"][2] == {"name": "without"}
    assert [problem[:2] for problem in found.problems] == [
        ("materials[1].pbrMetallicRoughness", "roughnessFactor 0.5 is not converted")
    ]
    before, texels = texels_of(content), texels_of(content_of(after["images"][0]))
    assert np.array_equal(texels[..., :3], before[..., :3])
    values = before[..., 3] / 255 * 0.5
    exact = np.zeros(values.shape)
    exact[values > 0] = mdfconv.convert(
        values[values > 0], source, "ggx:glossiness", metric="environment"
    )
    assert np.abs(texels[..., 3] / 255 - exact).max() <= 0.5 / 255 + 1e-7


@pytest.mark.parametrize("place", ["data", "file", "chunk"])
def test_glossiness_moves_into_the_roughness(place, tmp_path):
    content = rgba(1)
    info = {"index": 0, "texCoord": 1, "extensions": {"KHR_texture_transform": {"scale": [2, 2]}}}
    materials = [
        extended({}, **glossy(0.75)),
        extended(factor(0.25) | {"name": "b"}, **glossy(0.5, specularGlossinessTexture=info)),
        extended({}, **glossy(specularGlossinessTexture={"index": 0})),
        extended({"pbrMetallicRoughness": {}}, **glossy(0, specularGlossinessTexture={"index": 0})),
        factor(0.125),
    ]
    image = {"data": {"uri": data_uri(content)}, "file": {"uri": "sg.png"}}.get(
        place, {"bufferView": 0, "mimeType": "image/png"}
    )
    (tmp_path / "sg.png").write_bytes(content)
    document = {"textures": [{"source": 0, "sampler": 0}], "images": [image]}
    if place == "chunk":
        document["bufferViews"] = [{"buffer": 0, "byteLength": len(content)}]
        document["buffers"] = [{"byteLength": len(content)}]
    data = text_of(*materials, **document)
    name = "a.gltf" if place != "chunk" else "a.glb"
    (tmp_path / name).write_bytes(glb(data, content) if place == "chunk" else data)
    out = name.replace("a", "b")
    words = "gltf", name, "-o", out, "--from", GLOSSINESS, "--textures"
    status, _, err = run(*words, cwd=tmp_path)
    assert status == 0, err
    assert f"note: {name}: viewers that know {EXTENSION} still use it" in err
    result = (tmp_path / out).read_bytes()
    after = json.loads(result[20 : 20 + int.from_bytes(result[12:16], "little")]
                       if place == "chunk" else result)  # fmt: skip
    # Everything that was there stays, in its layout.
    assert after["images"][:1] == document["images"]
    assert after["textures"][:1] == document["textures"]
    for old, new in zip(materials, after["materials"], strict=True):
        assert new.get("extensions") == old.get("extensions")
    pbr = [each.get("pbrMetallicRoughness") for each in after["materials"]]
    assert pbr[0] == {"roughnessFactor": 0.25}
    assert pbr[1] == {"roughnessFactor": 1, "metallicRoughnessTexture": info | {"index": 1}}
    assert pbr[2] == {"roughnessFactor": 1, "metallicRoughnessTexture": {"index": 2}}
    assert pbr[3:] == [{}, {"roughnessFactor": 0.125}]
    alpha = texels_of(content)[..., 3] / 255
    for at, value in ((1, 0.5), (2, 1)):
        texture = after["textures"][at]
        assert texture["sampler"] == 0
        image = after["images"][texture["source"]]
        if place == "chunk":
            view = after["bufferViews"][image["bufferView"]]
            start = 28 + int.from_bytes(result[12:16], "little") + view["byteOffset"]
            texels = texels_of(result[start : start + view["byteLength"]])
        elif place == "file":
            texels = texels_of((tmp_path / image["uri"]).read_bytes())
        else:
            texels = texels_of(content_of(image))
        assert texels.shape == (6, 5, 3)
        assert (texels[..., [0, 2]] == 255).all()
        assert np.abs(texels[..., 1] / 255 - (1 - value * alpha)).max() <= 0.5 / 255 + 1e-7


def test_sixteen_bits_move(folders):
    texels = np.arange(4 * 4 * 4, dtype=np.uint16).reshape(4, 4, 4) * 1023
    path = folders.source / "sg.png"
    write_png(path, texels)
    material = extended({}, **glossy(0.5, specularGlossinessTexture={"index": 0}))
    data = text_of(material, textures=[{"source": 0}], images=[{"uri": "sg.png"}])
    found = convert_gltf(data, GLOSSINESS, textures=folders)
    ((path, content),) = found.files.items()
    assert path.name == "sg_ggx-roughness.png"
    path.write_bytes(content)
    moved = read_png(path)
    assert moved.dtype == np.uint16
    assert (moved[..., [0, 2]] == 65535).all()
    wanted = 1 - texels[..., 3] / 65535 * 0.5
    assert np.abs(moved[..., 1] / 65535 - wanted).max() <= 0.5 / 65535 + 1e-9


@pytest.mark.parametrize(
    ("material", "text"),
    [
        (extended(textured(0), **glossy(0.5)), "has a metallicRoughnessTexture beside its gloss"),
        (extended({}, **glossy(2)), "glossinessFactor 2 is outside 0 ≤ g ≤ 1"),
        (extended({}, **glossy("a")), "glossinessFactor is not a number"),
        (extended({}, **{EXTENSION: 3}), f"its {EXTENSION} is no object"),
        ({"extensions": 3}, "its extensions is no object"),
        (extended({"pbrMetallicRoughness": 3}, **glossy(0.5)), "its pbrMetallicRoughness is no"),
        (extended(factor("a"), **glossy(0.5)), "roughnessFactor is not a number"),
        (extended({}, **glossy(0.5, specularGlossinessTexture={"index": 0})), "no channel 'a'"),
        (
            extended(textured(0), **glossy(0.5, specularGlossinessTexture={"index": 0})),
            "has a metallicRoughnessTexture beside its glossinessFactor",
        ),
    ],
)
def test_glossiness_that_does_not_move(material, text, folders):
    data = text_of(material, textures=[{"source": 0}], images=[{"uri": data_uri(png())}])
    found = convert_gltf(data, GLOSSINESS, textures=folders)
    ((place, problem, _),) = found.problems
    assert place == "materials[0]"
    assert text in problem
    assert found.data == data


def test_a_texture_of_glossiness_needs_to_be_asked_for():
    material = extended({}, **glossy(0.5, specularGlossinessTexture={"index": 0}))
    found = convert_gltf(text_of(material), GLOSSINESS)
    assert [problem[2] for problem in found.problems] == [ProblemKind.TEXTURE]


@settings(deadline=None)
@given(st.lists(st.floats(0, 1), min_size=1, max_size=5))
def test_roughness_is_what_glossiness_leaves(values):
    data = text_of(*(extended({}, **glossy(value)) for value in values))
    found = convert_gltf(data, GLOSSINESS)
    results = [1 if each is None else each for each in factors_of(found.data)]
    assert results == pytest.approx([1 - value for value in values], abs=1e-7)


# Dry runs and marks.


def test_a_dry_run_says_what_would_be_done(tmp_path):
    (tmp_path / "wood.png").write_bytes(png())
    images = [{"uri": "wood.png"}]
    data = by("FBX2glTF", textured(0), factor(0.3), textures=[{"source": 0}], images=images)
    (tmp_path / "a.gltf").write_bytes(data)
    words = "gltf", "a.gltf", "--dry-run", "--mark", "--textures"
    assert "nothing is written" in run(*words, cwd=tmp_path)[2]
    status, _, err = run(*words, "--in-place", cwd=tmp_path)
    assert status == 0, err
    assert "0.489322" in err
    assert f"its texels taken for {PEAK_ALPHA}" in " ".join(err.split())
    assert f"would write {tmp_path / 'wood_ggx-roughness.png'}" in err
    assert {path.name for path in tmp_path.iterdir()} == {"a.gltf", "wood.png"}
    assert (tmp_path / "a.gltf").read_bytes() == data


@pytest.mark.parametrize(
    ("asset", "wanted"),
    [
        ('{"version":"2.0"}', '{"version":"2.0","extras":{"mdfconv": M}}'),
        ('{"version":"2.0", "extras":{}}', '{"version":"2.0", "extras":{"mdfconv": M}}'),
        ('{"version":"2.0","extras":{"a":1}}', '{"version":"2.0","extras":{"a":1,"mdfconv":M}}'),
    ],
)
def test_a_mark_is_written_and_nothing_else(asset, wanted):
    text = '{"asset":%s,\n "materials":[{"pbrMetallicRoughness":{"roughnessFactor":%s}}]}'
    found = convert_gltf((text % (asset, "0.9")).encode(), OBJ2GLTF, mark=True)
    assert not found.problems
    mark = f'{{"from": "{OBJ2GLTF}", "to": "{ROUGHNESS}"}}'
    assert found.data.decode() == text % (wanted.replace("M", mark), "0.33148781")
    again = convert_gltf(found.data, OBJ2GLTF, mark=True)
    assert (again.data, again.materials, again.problems) == (found.data, (), ())
    ((remark, _),) = again.remarks
    assert remark == (
        f"marked as converted from {OBJ2GLTF} to {ROUGHNESS}, and stays as it is; without mdfconv "
        "in asset.extras it would be converted again"
    )


@pytest.mark.parametrize("asset", [{"version": "2.0", "extras": 3}, None, {}, [3]])
def test_what_takes_no_mark_is_told(asset):
    data = text_of(factor(0.9), asset=asset)
    found = convert_gltf(data, OBJ2GLTF, mark=True)
    assert [problem[:2] for problem in found.problems] == [
        ("asset", "has no asset with extras that take a mark")
    ]
    assert found.data == data.replace(b"0.9", b"0.33148781")


@pytest.mark.parametrize("mark", [1, "x", {}, {"from": [3]}, False])
def test_any_mark_counts(mark):
    data = text_of(factor(0.9), asset={"version": "2.0", "extras": {"mdfconv": mark}})
    assert convert_gltf(data, OBJ2GLTF).data == data


def test_marks_by_the_command(tmp_path):
    for name, generator in (("a", "obj2gltf"), ("b", "")):
        (tmp_path / f"{name}.glb").write_bytes(glb(by(generator, factor(0.9)), b"abc"))
    words = "gltf", "--in-place", "--mark", "--specular", "0.5", "*.glb", "--from"
    status, _, err = run(*words, OBJ2GLTF, cwd=tmp_path)
    assert status == 0, err
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}
    assert len(before) == 4
    # Whatever the second time says, and though the generator of one is not known.
    for source in (OBJ2GLTF, "blinn-phong:vtk-gltf"):
        status, _, err = run(*words, source, cwd=tmp_path)
        assert status == 0, err
        assert err.count("note: ") == err.count("marked as converted from") == 2
        assert {path: path.read_bytes() for path in tmp_path.iterdir()} == before
    status, _, err = run("gltf", "--in-place", "*.glb", cwd=tmp_path)
    assert status == 0, err
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_what_has_nothing_to_convert_is_not_marked():
    assert convert_gltf(text_of(), OBJ2GLTF, mark=True).data == text_of()


# Everything.


METRIC = metric_named("environment")
PROGRAMS = [
    dialect for dialect in DIALECTS if "blinn-phong" in dialect.owners and dialect.stored.upper <= 1
]


@settings(deadline=None, max_examples=200)
@given(
    st.sampled_from(PROGRAMS),
    st.floats(0.05, 0.97),
    st.floats(0.02, 1),
    st.sampled_from(["file", "name", "option"]),
)
def test_a_roughness_comes_back_from_what_any_program_stores(dialect, roughness, weight, where):
    exponent = float(exponent_of(np.array([roughness]), METRIC)[0])
    name = f"blinn-phong:{dialect.name}"
    if dialect.specular is Specular.no:
        weight, where = 1.0, "nowhere"
    if dialect.name == "linear":
        name, weight = f"{name}:128", 128
    stored = rule(STORED, "blinn-phong", dialect)(exponent, weight)
    source = f"{name}:{weight!r}" if where == "name" else name
    material = weighted(stored, weight, weight, weight) if where == "file" else factor(stored)
    given_weight = weight if where == "option" else None
    # What it clamps does not come back.
    end = MaterialEnds(source, ROUGHNESS, given_weight).pair[0]
    near = end.decode_legal(stored * np.array([1 - 1e-6, 1, 1 + 1e-6]))
    assume(np.isfinite(near).all())
    found = convert_gltf(text_of(material), source, specular=given_weight)
    assert not found.problems
    assert factors_of(found.data) == pytest.approx([roughness], abs=1e-6)


# Damage.


def everything():
    """Return a file that has all of what is looked at."""
    layers = glossy(0.5, specularGlossinessTexture={"index": 1})
    layers |= {"KHR_materials_specular": {"specularFactor": 0.5, "specularColorFactor": [1, 1, 1]}}
    target = {"path": "pointer", "extensions": {"KHR_animation_pointer": {"pointer": ""}}}
    tracks = "pbrMetallicRoughness/roughnessFactor", f"extensions/{EXTENSION}/glossinessFactor"
    channels = [{"sampler": 0, "target": json.loads(json.dumps(target))} for _ in tracks]
    for channel, track in zip(channels, tracks, strict=True):
        pointer = channel["target"]["extensions"]["KHR_animation_pointer"]
        pointer["pointer"] = f"/materials/0/{track}"
    keys = np.array([0.3, 0.6], "<f4").tobytes()
    address = "data:;base64," + base64.b64encode(keys).decode()
    return {
        "asset": {"version": "2.0", "generator": "assimp", "extras": {"a": 1}},
        "materials": [extended(factor(0.5), **layers, **STRAYS), extended(textured(0), **layers)],
        "textures": [{"source": 0}, {"source": 1}],
        "images": [{"uri": data_uri(png())}, {"uri": data_uri(rgba())}],
        "animations": [{"samplers": [{"input": 1, "output": 0}], "channels": channels}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 2, "type": "SCALAR", "min": [0.3]}
        ],
        "bufferViews": [{"buffer": 0, "byteLength": 8}, {"buffer": 0, "byteLength": 4}],
        "buffers": [{"byteLength": 8, "uri": address}],
    }


def places(value):
    """Yield the containers and keys of everything in a document."""
    pairs = value.items() if isinstance(value, dict) else enumerate(value)
    for key, inner in list(pairs):
        yield value, key
        if isinstance(inner, dict | list):
            yield from places(inner)


ODD = st.sampled_from(
    [None, True, -1, 0, 1, 2, 0.5, 1e300, 10**30, "", "x", [], {}, [{}], {"a": 1}]
)


@settings(
    deadline=None,
    max_examples=200,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(
    st.lists(st.tuples(st.integers(0, 10**6), ODD), max_size=2),
    st.sampled_from(
        [("auto", ROUGHNESS), (PEAK_ALPHA, ROUGHNESS), (GLOSSINESS, ROUGHNESS),
         ("blinn-phong:unity-fbx", GLOSSINESS)]
    ),
    st.booleans(),
)  # fmt: skip
def test_what_is_damaged_is_refused_or_left(folders, damages, pair, dropped):
    document = json.loads(json.dumps(everything()))
    for at, value in damages:
        found = list(places(document))
        container, key = found[at % len(found)]
        if dropped:
            del container[key]
        else:
            container[key] = json.loads(json.dumps(value))
    data = json.dumps(document).encode()
    more = {"textures": folders, "texels": pair[0] if pair[0] != "auto" else "ggx:alpha"}
    with suppress(MdfconvError):
        found = convert_gltf(data, *pair, mark=True, **more)
        check_damaged(document, found)
        again = convert_gltf(found.data, *pair, **more)
        marked = not any(problem.place == "asset" for problem in found.problems)
        assert again.data == found.data or not (marked and found.materials)


def check_damaged(document, found):
    assert all("\n" not in problem.text for problem in found.problems)
    after = json.loads(found.data)
    assert len(after.get("materials", [])) == len(document.get("materials", []))
    assert all(0 <= each.result <= 1 for each in found.materials)
