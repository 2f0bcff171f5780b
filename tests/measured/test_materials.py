"""Materials of a fit: each shows the measured surface, by the formulas of its own program."""

import json
import re
from types import SimpleNamespace
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import erf

import mdfconv
from mdfconv.conversion.explanation import remaining_error
from mdfconv.distributions.angles import Angles
from mdfconv.fitting.metrics import metric_named
from mdfconv.measured.brdf_fit import fit_distribution
from mdfconv.measured.materials import snippets
from mdfconv.measured.model import BrdfModel
from mdfconv.measured.samples import directional_samples
from mdfconv.measured.substitutes import LobeMixture, lobe_pair, substitute

ANGLES = (0, 30, 60, 75)
TITLES = ["Mitsuba 3", "glTF 2.0", "MaterialX", "OpenPBR", "Wavefront MTL", "mdfconv"]
# Midpoints of the lobe's cumulative distribution and of half the azimuths.
COUNT = 300


def schlick(cosine, f0):
    return f0 + (1 - f0) * (1 - cosine) ** 5


def exact(cosine, eta, k=0.0):
    """Fresnel's reflectance from the two amplitudes, as textbooks have them."""
    m = complex(eta, k)
    below = np.sqrt(m * m - 1 + cosine**2)
    s = (cosine - below) / (cosine + below)
    p = (m * m * cosine - below) / (m * m * cosine + below)
    return (abs(s) ** 2 + abs(p) ** 2) / 2


def smith(name, alpha, cosine):
    a = alpha * np.sqrt(np.maximum(1 - cosine**2, 0)) / np.maximum(cosine, 1e-9)
    if name == "ggx":
        return (np.sqrt(1 + a * a) - 1) / 2
    x = 1 / np.maximum(a, 1e-9)
    return (erf(x) - 1 + np.exp(-x * x) / (x * np.sqrt(np.pi))) / 2


def reflected(angle, name, alpha, fresnel, separable=False):
    """∫ D G F / (4 cos θ_i) dω: a mean over half vectors drawn by D cos θ_h."""
    theta = np.radians(angle)
    u = (np.arange(COUNT) + 0.5) / COUNT
    u, phi = np.meshgrid(u, np.pi * u)
    square = alpha**2 * (u / (1 - u) if name == "ggx" else -np.log1p(-u))
    z = 1 / np.sqrt(1 + square)
    x = np.sqrt(1 - z**2) * np.cos(phi)
    cosine = np.sin(theta) * x + np.cos(theta) * z
    outgoing = 2 * cosine * z - np.cos(theta)
    seen = (cosine > 0) & (outgoing > 0)
    first, second = (smith(name, alpha, c) for c in (np.cos(theta), np.maximum(outgoing, 1e-9)))
    masking = (1 + first) * (1 + second) if separable else 1 + first + second
    value = fresnel(np.clip(cosine, 0, 1)) * cosine / (z * masking * np.cos(theta))
    return np.mean(np.where(seen, value, 0))


def fit(name="ggx", alpha=0.1, fresnel="dielectric", diffuse=(0.4,), **others):
    """A fit as it is handed on, whose albedo is computed here."""
    n, f0, second, share = (others.get(key) for key in ("n", "f0", "second", "share"))
    specular = others.get("specular", (1.0,) * len(diffuse))
    if fresnel not in ("metal", "none", None):
        n = n or 1.5
        f0 = (((n - 1) / (n + 1)) ** 2,) * len(diffuse)
    lobes = [(1.0, alpha)] if second is None else [(share, alpha), (1 - share, second)]
    curves = {"metal": lambda c, f: schlick(c, f), "none": lambda c, f: 1 + 0 * c}

    def albedo(theta):
        angle, shape = np.degrees(theta), name if name in ("ggx", "beckmann") else "ggx"
        curve = curves.get(fresnel, lambda c, f: exact(c, n))
        total = []
        for channel, (d, s) in enumerate(zip(diffuse, specular, strict=True)):

            def value(c, f=f0[channel] if f0 else 1.0):
                return curve(c, f)

            total.append(d + s * sum(w * reflected(angle, shape, a, value) for w, a in lobes))
        return np.array(total)

    distribution = mdfconv.distribution(name, others.get("gamma"))
    label = "two GGX lobes" if second else distribution.label
    return SimpleNamespace(
        distribution=distribution, label=label, parameter=alpha, gamma=distribution.gamma,
        second=second, share=share, fresnel=fresnel, n=n, f0=f0, albedo=albedo,
        diffuse=diffuse if fresnel else None, specular=specular if fresnel else None,
    )  # fmt: skip


def of(measured, channels=("Y",)):
    return {one.title: one for one in snippets(measured, channels)}


# --- the programs' own formulas -------------------------------------------------------------------


def values_of(element):
    """The properties of a BSDF of Mitsuba by their names, numbers as arrays, nested BSDFs apart."""
    properties = {}
    for child in element:
        if child.tag in ("float", "rgb"):
            properties[child.get("name")] = np.array(
                [float(part) for part in child.get("value").split(",")]
            )
        elif child.tag == "string":
            properties[child.get("name")] = child.get("value")
    return properties, element.findall("bsdf")


def mitsuba_albedo(element, angle, channel):
    """The albedo of a BSDF of Mitsuba 3 by its documentation; masking is separable there."""
    properties, nested = values_of(element)

    def number(name, default=None):
        value = properties.get(name, default)
        return None if value is None else np.broadcast_to(value, 3)[channel]

    kind = element.get("type")
    if kind == "blendbsdf":
        assert 0 <= number("weight") <= 1
        first, second = (mitsuba_albedo(one, angle, channel) for one in nested)
        return (1 - number("weight")) * first + number("weight") * second
    if kind == "diffuse":
        assert 0 <= number("reflectance") <= 1
        return number("reflectance")
    if kind == "principled":
        assert number("metallic") == 1
        alpha, base = number("roughness") ** 2, number("base_color")
        return reflected(angle, "ggx", alpha, lambda c: schlick(c, base), separable=True)
    assert kind == "roughconductor"
    tint = number("specular_reflectance", 1.0)
    # In colour Mitsuba refuses what is above 1.
    assert tint <= 1 or properties["specular_reflectance"].size == 1
    curve = lambda c: exact(c, number("eta"), number("k"))  # noqa: E731
    if properties.get("material") == "none":
        curve = np.ones_like
    shape = properties["distribution"], number("alpha")
    return tint * reflected(angle, *shape, curve, separable=True)


def cosine_weighted(angle, function):
    """The mean over light from all around, by its cosine, of a function of v·h."""
    u = (np.arange(COUNT) + 0.5) / COUNT
    u, phi = np.meshgrid(u, np.pi * u)
    theta = np.radians(angle)
    product = np.sqrt(u) * np.cos(phi) * np.sin(theta) + np.sqrt(1 - u) * np.cos(theta)
    return np.mean(function(np.sqrt((1 + product) / 2)))


def gltf_albedo(text, angle, channel):
    """The albedo by appendix B of the specification and KHR_materials_ior."""
    material = json.loads(text)["materials"][0]
    pbr = material["pbrMetallicRoughness"]
    base, metallic = pbr["baseColorFactor"][channel], pbr["metallicFactor"]
    ior = material.get("extensions", {}).get("KHR_materials_ior", {}).get("ior", 1.5)
    f0, alpha = ((1 - ior) / (1 + ior)) ** 2, pbr["roughnessFactor"] ** 2
    metal = reflected(angle, "ggx", alpha, lambda c: schlick(c, base))
    layer = reflected(angle, "ggx", alpha, lambda c: schlick(c, f0))
    under = base * cosine_weighted(angle, lambda c: 1 - schlick(c, f0))
    return metallic * metal + (1 - metallic) * (under + layer)


def materialx_albedo(text, angle, channel):
    """The albedo of the shader of a document by the specification's nodes."""
    root = ElementTree.fromstring(text)
    nodes = {node.get("name"): node for node in root}
    inputs = {
        name: {one.get("name"): one.get("value") or nodes[one.get("nodename")] for one in node}
        for name, node in nodes.items()
    }

    def colour(node, name):
        return float(inputs[node.get("name")][name].split(",")[channel])

    def number(node, name, default):
        return float(inputs[node.get("name")].get(name, str(default)).split(",")[0])

    def albedo(node):
        own = inputs[node.get("name")]
        if node.tag == "add":
            return albedo(own["in1"]) + albedo(own["in2"])
        if node.tag == "oren_nayar_diffuse_bsdf":
            return colour(node, "color")
        if node.tag == "dielectric_bsdf":
            curve = lambda c: exact(c, number(node, "ior", 1.5))  # noqa: E731
        else:
            assert node.tag == "generalized_schlick_bsdf"
            f0, f90 = colour(node, "color0"), 1.0
            if "color90" in own:
                assert own["color0"] == own["color82"] == own["color90"]
                f90 = f0
            curve = lambda c: f0 + (f90 - f0) * (1 - c) ** 5  # noqa: E731
        alpha = number(node, "roughness", 0.05)
        return number(node, "weight", 1) * reflected(angle, "ggx", alpha, curve)

    shader = inputs["measured"]["surfaceshader"]
    if shader.tag == "surface":
        return albedo(inputs["shader"]["bsdf"])
    assert shader.tag == "open_pbr_surface"
    base, metalness = colour(shader, "base_color"), number(shader, "base_metalness", 0)
    alpha = number(shader, "specular_roughness", 0.3) ** 2
    metal = reflected(angle, "ggx", alpha, lambda c: schlick(c, base))
    layer = reflected(angle, "ggx", alpha, lambda c: exact(c, number(shader, "specular_ior", 1.5)))
    return metalness * metal + (1 - metalness) * (layer + base * (1 - layer))


# --- each class shows the fitted surface ----------------------------------------------------------

COLOUR = ("R", "G", "B")
CLASSES = {
    "glossy plastic": fit(alpha=0.05, n=1.5),
    "satin plastic": fit(alpha=0.3, n=1.3, diffuse=(0.1,)),
    "matt plastic": fit(alpha=0.5, n=1.8, diffuse=(0.3,)),
    "white plastic": fit(alpha=0.1, n=1.5, diffuse=(0.8,)),
    "black glass": fit(alpha=0.1, n=1.5, diffuse=(0.0,)),
    "Beckmann plastic": fit("beckmann", 0.2, n=1.6),
    "red plastic": fit(alpha=0.1, diffuse=(0.6, 0.1, 0.05)),
    "chrome": fit(alpha=0.05, fresnel="metal", f0=(0.55,), diffuse=(0.0,)),
    "silver": fit(alpha=0.3, fresnel="metal", f0=(0.98,), diffuse=(0.0,)),
    "rough silver": fit(alpha=0.5, fresnel="metal", f0=(0.98,), diffuse=(0.0,)),
    "copper": fit("beckmann", 0.2, "metal", f0=(0.95, 0.64, 0.54), diffuse=(0.0,) * 3),
    "dark metal": fit(alpha=0.2, fresnel="metal", f0=(0.17,), diffuse=(0.0,)),
    "dirty metal": fit(alpha=0.2, fresnel="metal", f0=(0.6,), diffuse=(0.1,)),
    "constant": fit(alpha=0.2, fresnel="none", specular=(0.5,), diffuse=(0.1,)),
    "free k_s": fit(alpha=0.2, specular=(0.6,)),
    "two lobes": fit(
        alpha=0.0139, second=0.206, share=0.75, fresnel="metal", f0=(0.17,), diffuse=(0.0,)
    ),
    "two lobes on a base": fit(alpha=0.05, second=0.3, share=0.6),
}
TEXTS = {
    name: of(one, COLOUR if len(one.diffuse) == 3 else ("Y",)) for name, one in CLASSES.items()
}


def differences(name, title, albedo):
    """The relative differences of a form's albedo by angle and channel."""
    measured, text = CLASSES[name], TEXTS[name][title].text
    wanted = np.array([measured.albedo(np.radians(angle)) for angle in ANGLES])
    channels = range(wanted.shape[1])
    return np.array([[albedo(text, angle, c) for c in channels] for angle in ANGLES]) / wanted - 1


@pytest.mark.parametrize("name", CLASSES)
def test_mitsuba_reflects_what_the_fit_does(name):
    def albedo(text, angle, channel):
        return mitsuba_albedo(ElementTree.fromstring(text), angle, channel)

    assert np.abs(differences(name, "Mitsuba 3", albedo)).max() < 0.03


# One lobe in the place of two masks more; k_s is a part of F₀, of which F at grazing is not.
LOOSE = {"Beckmann plastic": 0.04, "copper": 0.06, "free k_s": 0.08}


@pytest.mark.parametrize("name", CLASSES)
def test_materialx_nodes_reflect_what_the_fit_does(name):
    found = differences(name, "MaterialX", materialx_albedo)
    assert np.abs(found).max() < LOOSE.get(name, 0.01)


FORMULAS = {"glTF 2.0": gltf_albedo, "MaterialX": materialx_albedo, "OpenPBR": materialx_albedo}


@pytest.mark.parametrize("title", FORMULAS)
@pytest.mark.parametrize("name", CLASSES)
def test_notes_say_how_far_an_albedo_is_from_that_of_the_fit(name, title):
    found = 100 * np.abs(differences(name, title, FORMULAS[title])).max()
    note = TEXTS[name][title].note
    said = re.search(r"it reflects at most ([\d.]+) % (more|less) than the fit, at \d+°", note)
    if said:
        assert found < 1.1 * float(said[1]) + 0.5
    else:
        assert "Its albedo is that of the fit" in note
        assert found < 1.5


@pytest.mark.parametrize("name", ["chrome", "silver", "dirty metal", "dark metal"])
def test_gltf_and_openpbr_have_the_albedo_of_metals(name):
    for title in ("glTF 2.0", "OpenPBR"):
        assert np.abs(differences(name, title, FORMULAS[title])).max() < 0.02


@pytest.mark.parametrize("name", ["glossy plastic", "white plastic", "red plastic"])
def test_gltf_gives_the_fitted_diffuse_albedo_along_the_normal(name):
    assert np.abs(differences(name, "glTF 2.0", gltf_albedo)[:2]).max() < 0.03


def test_every_class_has_every_form():
    assert all(list(texts) == TITLES for texts in TEXTS.values())


def test_plastic_is_no_metal_and_metal_no_plastic():
    plastic, copper = TEXTS["red plastic"], TEXTS["copper"]
    material = json.loads(plastic["glTF 2.0"].text)["materials"][0]
    assert material["pbrMetallicRoughness"] == {
        "baseColorFactor": [0.625, 0.1042, 0.05208, 1],
        "metallicFactor": 0,
        "roughnessFactor": 0.3162,
    }
    assert material["extensions"] == {"KHR_materials_ior": {"ior": 1.5}}
    material = json.loads(copper["glTF 2.0"].text)["materials"][0]
    assert material["pbrMetallicRoughness"]["baseColorFactor"] == [0.95, 0.64, 0.54, 1]
    assert material["pbrMetallicRoughness"]["metallicFactor"] == 1
    assert 'name="base_metalness" type="float" value="1"' in copper["OpenPBR"].text
    lines = dict(line.split(" ", 1) for line in plastic["Wavefront MTL"].text.splitlines())
    assert (lines["Kd"], lines["Ks"], lines["Ni"]) == ("0.6 0.1 0.05", "0.04 0.04 0.04", "1.5")
    assert (lines["Pm"], lines["Pr"], lines["illum"]) == ("0", "0.3162", "2")
    lines = dict(line.split(" ", 1) for line in copper["Wavefront MTL"].text.splitlines())
    assert (lines["Kd"], lines["Pm"]) == ("0.95 0.64 0.54", "1")
    assert "others need Kd 0 0 0" in copper["Wavefront MTL"].note


@pytest.mark.parametrize("title", ["MaterialX", "OpenPBR"])
@pytest.mark.parametrize("name", CLASSES)
def test_materialx_validates_the_documents(name, title):
    materialx = pytest.importorskip("MaterialX")
    library = materialx.createDocument()
    folders = materialx.getDefaultDataLibraryFolders()
    materialx.loadLibraries(folders, materialx.getDefaultDataSearchPath(), library)
    document = materialx.createDocument()
    materialx.readFromXmlString(document, TEXTS[name][title].text)
    document.setDataLibrary(library)
    valid, message = document.validate()
    assert valid, message
    for node in document.getNodes():
        definition = node.getNodeDef()
        assert definition is not None, node.getName()
        for one in node.getInputs():
            assert definition.getActiveInput(one.getName()) is not None, one.getName()


@pytest.mark.slow
def test_mitsuba_loads_the_snippets_and_reflects_what_the_fit_does():
    mitsuba = pytest.importorskip("mitsuba")
    mitsuba.set_variant("scalar_rgb")
    random = np.random.default_rng(5)
    for name, texts in TEXTS.items():
        text = texts["Mitsuba 3"].text.replace("<bsdf ", '<bsdf version="3.0.0" ', 1)
        bsdf, context = mitsuba.load_string(text), mitsuba.BSDFContext()
        for angle in (0, 60):
            interaction = mitsuba.SurfaceInteraction3f()
            theta = np.radians(angle)
            interaction.wi = [float(np.sin(theta)), 0, float(np.cos(theta))]
            draws = random.random((10_000, 3)).tolist()
            weights = [bsdf.sample(context, interaction, u, [v, w])[1] for u, v, w in draws]
            wanted = CLASSES[name].albedo(theta)
            found = np.mean(np.array(weights, float), axis=0)[: wanted.size]
            assert found == pytest.approx(wanted, rel=0.045), (name, angle)


@settings(deadline=None, max_examples=25)
@given(
    st.floats(0.02, 0.8), st.floats(1.05, 2.5), st.floats(0, 0.9), st.floats(0, 1), st.booleans()
)
def test_numbers_are_those_that_programs_accept(alpha, n, diffuse, f0, is_metal):
    diffuse *= 1 - f0 if is_metal else 0.8
    kind = {"fresnel": "metal", "f0": (f0,) * 3} if is_metal else {"n": n}
    for one in snippets(fit(alpha=alpha, diffuse=(diffuse,) * 3, **kind), COLOUR):
        if one.title == "Mitsuba 3":
            for rgb in ElementTree.fromstring(one.text).iter("rgb"):
                values = [float(part) for part in rgb.get("value").split(",")]
                assert rgb.get("name") in ("eta", "k") or max(values) <= 1
        if one.title == "glTF 2.0":
            pbr = json.loads(one.text)["materials"][0]["pbrMetallicRoughness"]
            numbers = [*pbr["baseColorFactor"], pbr["metallicFactor"], pbr["roughnessFactor"]]
            assert 0 <= min(numbers) <= max(numbers) <= 1
        assert "nan" not in one.text + one.note
        assert "inf" not in one.text


# --- what is no material, or less -----------------------------------------------------------------


@pytest.mark.parametrize(
    "measured",
    [
        fit(diffuse=(7.4,)),
        fit(fresnel="metal", f0=(0.9,), diffuse=(0.3,)),
        fit(fresnel="metal", f0=(1.2,), diffuse=(0.0,)),
        fit(fresnel="none", specular=(1.5,), diffuse=(0.0,)),
        fit(diffuse=(0.2, 0.2, 1.1)),
    ],
)
def test_what_reflects_more_than_it_receives_is_no_material(measured):
    (one,) = snippets(measured, [str(i) for i in range(len(measured.diffuse))])
    assert one.text == ""
    assert re.match(r"Not a material: the fit reflects 1?\d\d+ % of the light\.", one.note)


def test_a_reflectance_just_above_one_is_clamped():
    texts = of(fit(fresnel="metal", f0=(1.02,), diffuse=(0.0,)))
    assert "A reflectance of 1.02 is clamped to 1" in texts["glTF 2.0"].note
    material = json.loads(texts["glTF 2.0"].text)["materials"][0]
    assert material["pbrMetallicRoughness"]["baseColorFactor"] == [1, 1, 1, 1]


def test_a_fit_that_reflects_too_much_at_grazing_says_so():
    note = of(fit(alpha=0.05, diffuse=(0.85,)))["Mitsuba 3"].note
    assert re.search(r"At 75° the fit reflects 10\d(\.\d)? %, more than it receives\.", note)
    assert "At 75°" not in TEXTS["glossy plastic"]["Mitsuba 3"].note


def test_one_angle_hands_its_roughness_on_and_nothing_else():
    texts = of(fit(fresnel=None, alpha=0.04))
    assert texts["glTF 2.0"].text == '"roughnessFactor": 0.2'
    assert texts["Wavefront MTL"].text.splitlines()[1] == "Pr 0.2"
    assert 'name="alpha" value="0.04"' in texts["Mitsuba 3"].text
    assert 'name="specular_roughness" type="float" value="0.2"' in texts["MaterialX"].text
    assert "normalized(beta, 0.04)" in texts["mdfconv"].text
    for title in ("Mitsuba 3", "glTF 2.0", "MaterialX", "Wavefront MTL"):
        assert "not the colour, nor whether it is a metal" in texts[title].note
        assert "metallic" not in texts[title].text.lower()
        assert "color" not in texts[title].text.lower()


# --- other distributions, and two lobes -----------------------------------------------------------


def errors_in(note):
    return re.search(
        r"(?:r|α) ([\d.]+) keeps linear light \(error ([\d.]+) % under environment, "
        r"([\d.]+) % under display\)",
        note,
    )


def test_another_distribution_has_a_substitute_with_both_errors():
    source, target = mdfconv.distribution("gtr", 1.6), mdfconv.distribution("ggx")
    texts = of(fit("gtr", 0.1, gamma=1.6))
    said = errors_in(texts["glTF 2.0"].note)
    roughness = mdfconv.convert(0.1, "gtr", "ggx:roughness", gamma=1.6, metric="environment")
    assert float(said[1]) == pytest.approx(roughness, rel=1e-3)
    for position, metric in ((2, "environment"), (3, "display")):
        lobes = source, np.array([0.1]), target, np.array([roughness**2])
        (error,), _ = remaining_error(*lobes, metric_named(metric))
        assert float(said[position]) == pytest.approx(100 * error, rel=0.05)
    material = json.loads(texts["glTF 2.0"].text)["materials"][0]
    assert material["pbrMetallicRoughness"]["roughnessFactor"] == float(said[1])
    assert "The reflectance along the normal remains 0.04." in texts["glTF 2.0"].note


def test_mitsuba_takes_the_nearer_of_its_distributions():
    assert 'value="ggx"' in of(fit("gtr", 0.1, gamma=1.8))["Mitsuba 3"].text
    assert 'value="beckmann"' in of(fit("blinn-phong", 100.0))["Mitsuba 3"].text


def test_the_same_lobe_by_another_name_costs_nothing():
    note = of(fit("student-t", 0.1, gamma=2.0))["glTF 2.0"].note
    assert "stands for" not in note


def test_two_lobes_are_blended_where_a_renderer_can():
    element = ElementTree.fromstring(TEXTS["two lobes"]["Mitsuba 3"].text)
    properties, nested = values_of(element)
    assert element.get("type") == "blendbsdf"
    assert properties["weight"] == 0.25
    assert len(nested) == 2
    assert TEXTS["two lobes"]["MaterialX"].text.count('name="weight"') == 2
    assert "0.75 * lobe.normalized" in TEXTS["two lobes"]["mdfconv"].text


def test_two_lobes_in_one_have_the_numbers_that_were_rendered():
    """Measured-like aluminium: r 0.14 keeps linear light, 0.22 looks nearest on a display."""
    note = TEXTS["two lobes"]["glTF 2.0"].note
    assert float(errors_in(note)[1]) == pytest.approx(0.14, rel=0.1)
    screen = re.search(r"r ([\d.]+) looks nearest in a picture on a display", note)
    assert float(screen[1]) == pytest.approx(0.22, rel=0.1)
    better, worse = re.search(r"error there ([\d.]+) % instead of ([\d.]+) %", note).groups()
    assert float(better) < float(worse)
    assert "remains 0.17" in note


def test_two_lobes_stand_for_a_distribution_with_long_tails():
    texts = of(fit("gtr", 0.0023, gamma=1.12))
    element = ElementTree.fromstring(texts["Mitsuba 3"].text)
    assert len(element.findall("bsdf")) == 2
    for title in ("Mitsuba 3", "MaterialX"):
        said = re.search(
            r"Two ggx lobes, α ([\d.]+) and ([\d.]+) at (\d+):\d+, stand for gtr \(γ = 1.12\) "
            r"\(error ([\d.]+) % under environment, ([\d.]+) % under display\)",
            texts[title].note,
        )
        first, second, share, *errors = map(float, said.groups())
        # The metric by hand: the difference of the shares within β, over ln tan β.
        tangent = np.exp(np.linspace(-25, 10, 40_000))
        beta = np.arctan(tangent)
        gtr = mdfconv.distribution("gtr", 1.12).cumulative(beta, 0.0023)
        two = [share / 100, 1 - share / 100] @ np.array(
            [tangent**2 / (tangent**2 + alpha**2) for alpha in (first, second)]
        )
        error = np.sqrt(np.sum((two - gtr) ** 2) / np.sum((gtr - np.sin(beta) ** 2) ** 2))
        assert errors[0] == pytest.approx(100 * error, abs=0.5)
        assert errors[0] < 0.5 * float(errors_in(texts["glTF 2.0"].note)[2])
        assert errors[1] < 0.5 * float(errors_in(texts["glTF 2.0"].note)[3])


def test_a_pair_finds_the_lobes_of_a_mixture():
    measured = CLASSES["two lobes"]
    pair = lobe_pair(measured, substitute(measured, "ggx"))
    assert pair.share == pytest.approx(0.75, rel=1e-3)
    assert pair.parameters == pytest.approx((0.0139, 0.206), rel=1e-3)
    assert max(pair.errors) < 1e-3


def test_the_mixture_is_the_sum_of_its_lobes():
    ggx = mdfconv.distribution("ggx")
    mixture = LobeMixture(ggx, 0.75, 10.0)
    beta = np.linspace(0, 1.5, 7)
    for alpha in (0.003, 0.05):
        for form in (ggx.normalized, ggx.cumulative):
            wanted = 0.75 * form(beta, alpha) + 0.25 * form(beta, 10 * alpha)
            assert getattr(mixture, form.__name__)(beta, alpha) == pytest.approx(wanted, rel=1e-12)
        wanted = np.gradient(
            [np.log(mixture.normalized(beta, alpha * np.exp(x))) for x in (-1e-5, 0, 1e-5)],
            1e-5,
            axis=0,
        )[1]
        value, slope = mixture.with_slope(
            Angles(beta[None]), np.full((1, 1), alpha), normalized=True
        )
        assert slope[0] / value[0] == pytest.approx(wanted, rel=1e-6, abs=1e-8)


# --- channels -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("channels", "wanted"),
    [
        (("R", "G", "B"), [0.1, 0.2, 0.3]),
        (("blue", "Green", "RED"), [0.3, 0.2, 0.1]),
        (("465nm", "525nm", "630nm"), [0.3, 0.2, 0.1]),
        (("450", "550", "650.0"), [0.3, 0.2, 0.1]),
        (("1064nm", "1310nm", "1550nm"), [0.2, 0.2, 0.2]),
        (("a", "b", "c"), [0.2, 0.2, 0.2]),
    ],
)
def test_channels_become_colours(channels, wanted):
    texts = of(fit(diffuse=(0.1, 0.2, 0.3)), channels)
    lines = dict(line.split(" ", 1) for line in texts["Wavefront MTL"].text.splitlines())
    assert [float(part) for part in lines["Kd"].split()] == pytest.approx(wanted)
    note = texts["Wavefront MTL"].note
    assert ("not colorimetric" in note) == channels[0].startswith(("465", "450"))
    assert ("averaged: grey" in note) == (wanted[0] == wanted[1])


def test_a_spectrum_is_averaged_by_bands():
    channels = [f"{wave} nm" for wave in range(400, 701, 20)]
    texts = of(fit(diffuse=tuple(wave / 1000 for wave in range(400, 701, 20))), channels)
    lines = dict(line.split(" ", 1) for line in texts["Wavefront MTL"].text.splitlines())
    wanted = [np.mean(range(600, 701, 20)), np.mean(range(500, 600, 20)), 440]
    assert [float(part) for part in lines["Kd"].split()] == pytest.approx(np.array(wanted) / 1000)


def test_a_surface_without_any_reflectance_along_the_normal_has_every_form():
    for measured in (
        fit(fresnel="metal", f0=(0.0,), diffuse=(1.0,)),
        fit(fresnel="metal", f0=(0.0,), diffuse=(0.0,)),
        fit(n=1.0001, diffuse=(1.0,)),
    ):
        texts = of(measured)
        assert list(texts) == TITLES
        assert all(one.text and "nan" not in one.text + one.note for one in texts.values())


def test_a_diffuse_albedo_that_is_noise_is_left_out():
    texts = of(fit(fresnel="metal", f0=(0.9,), diffuse=(3e-5,)))
    assert "diffuse" not in texts["Mitsuba 3"].text + texts["MaterialX"].text
    assert json.loads(texts["glTF 2.0"].text)["materials"][0]["pbrMetallicRoughness"][
        "metallicFactor"
    ] == 1  # fmt: skip


def test_a_fit_to_samples_is_handed_on():
    """The fit itself instead of a double: its numbers and its albedo."""
    angles = np.radians(np.arange(-75, 76, 3.0))
    out, inward = (part.ravel() for part in np.meshgrid(angles, np.radians([20, 45, 70])))
    # In the plane of incidence; a positive angle is on the mirror's side.
    half, cosine = (out - inward) / 2, np.cos((out + inward) / 2)
    masking = 1 / (1 + smith("ggx", 0.2, np.cos(inward)) + smith("ggx", 0.2, np.cos(out)))
    lobe = mdfconv.distribution("ggx").normalized(np.abs(half), 0.2) * masking
    values = 0.3 / np.pi + lobe * exact(cosine, 1.5) / (4 * np.cos(inward) * np.cos(out))
    flat = np.zeros_like(out)
    samples = directional_samples("made", inward, flat, out, flat + np.pi, values[:, None], ("Y",))
    measured = fit_distribution(
        samples, mdfconv.distribution("ggx"), BrdfModel(fresnel="dielectric")
    )
    texts = of(measured)
    assert list(texts) == TITLES
    pbr = json.loads(texts["glTF 2.0"].text)["materials"][0]["pbrMetallicRoughness"]
    assert pbr["roughnessFactor"] == pytest.approx(0.2**0.5, rel=2e-3)
    assert pbr["baseColorFactor"][0] == pytest.approx(0.3 / 0.96, rel=5e-3)
    element = ElementTree.fromstring(texts["Mitsuba 3"].text)
    for angle in ANGLES:
        wanted = measured.albedo(np.radians(angle))[0]
        assert mitsuba_albedo(element, angle, 0) == pytest.approx(wanted, rel=0.03)
