"""What programs store, against their own rules: written here as their sources have them."""

import math

import numpy as np
import pytest

import mdfconv
from mdfconv.distributions.dialects import DIALECTS, SAME, Specular
from mdfconv.distributions.endpoint import encodings_of, endpoint, texels_of
from mdfconv.errors import MdfconvError

EXPONENTS = np.geomspace(0.3, 3e4, 20).tolist()
ALPHAS = np.geomspace(2e-3, 1.0, 20).tolist()
WEIGHTS = {Specular.no: (1.0,), Specular.optional: (1.0, 0.2, 0.04), Specular.needed: (1.0, 0.3)}


def clamp(value, low=0.0, high=1.0):
    return max(low, min(high, value))


def babylon(n):
    """A cubic Bézier curve through (0, 1), (0, 0.1), (0, 0.1), (1300, 0.1)."""
    t = clamp(n, 0, 1300) ** (1 / 3) / 1300 ** (1 / 3)
    points = (1, 0.1, 0.1, 0.1)
    return sum(math.comb(3, k) * (1 - t) ** (3 - k) * t**k * points[k] for k in range(4))


def obj2gltf(n, weight):
    roughness = clamp(1.0 - n / 1000.0)
    return roughness * (1.0 - weight) if weight < 0.1 else roughness


def adobe(n, weight):
    roughness = math.sqrt(2 / (n * weight + 2))
    return 0.0 if roughness < 0.08 else roughness


# From exponent and specular weight to what is stored.
STORED = {
    "blender-obj": lambda n, weight: 1 - math.sqrt(clamp(n, 0, 1000) / 1000),
    "obj2gltf": obj2gltf,
    "assimp-gltf": lambda n, weight: max(0, 1 - weight * math.sqrt(n / 1000)),
    "fbx": lambda n, weight: max(0, 1 - math.sqrt(n) / 10),
    "unity-fbx": lambda n, weight: clamp(math.sqrt(n / 100)),
    "peak-alpha": lambda n, weight: math.sqrt(2 / (n + 2)),
    "peak": lambda n, weight: (2 / (n + 2)) ** 0.25,
    "babylon": lambda n, weight: babylon(n),
    "vtk-gltf": lambda n, weight: 1 / (1 + 0.2 * weight * n),
    "ifcopenshell-gltf": lambda n, weight: 1 / n,
    "mmd-tools": lambda n, weight: 1 / max(n, 1) ** 0.37,
    "adobe-usd": adobe,
    "adobe-fbx": lambda n, weight: max(0, 1 - n / 100),
    "mitsuba-phong": lambda n, weight: math.sqrt(2 / (n + 2)),
    "cycles-ashikhmin": lambda n, weight: math.sqrt(math.sqrt(2 / (n + 2))),
    "x3d": lambda n, weight: n / 128,
    # (30 (1 − r))² and 1000 (1 − r)² backwards.
    "blender-2.8": lambda n, weight: 1 - math.sqrt(clamp(n, 0, 900)) / 30,
    "blinn-phong:blender-2.7": lambda n, weight: (n - 1) * 1.9607843137254901,
    "linear": lambda n, scale: clamp(1.0 - n / scale),
    "niftools": lambda n, weight: 1 / (n + 1),
    # The exponent of the reflected ray is (N − 3)/4.
    "source-phong": lambda n, weight: ((n - 3) / 4 - 1) / 149,
    "povray": lambda n, weight: 1 / n,
}


def pbrt_alpha(roughness):
    x = math.log(max(roughness, 1e-3))
    return (
        1.62142 + 0.819955 * x + 0.1734 * x * x + 0.0171201 * x * x * x
        + 0.000640711 * x * x * x * x
    )  # fmt: skip


# From what is stored to α.
READ = {
    "pbrt-v3": pbrt_alpha,
    "pbrt-v4": math.sqrt,
    "blender-2.7": lambda r: r,
    "gltf-glossiness": lambda g: (1 - g) ** 2,
    "luxcore-glossy2": lambda u: math.sqrt(u * u),
    # One number is an isotropic surface.
    "openpbr": lambda r: r * r,
    "materialx": lambda r: r * r,
    "gltf-anisotropy": lambda r: r * r,
    "ward": lambda alpha: alpha,
}


def openpbr(r, a):
    along = r * r * math.sqrt(2 / (1 + (1 - a) * (1 - a)))
    return along, (1 - a) * along


def materialx(r, a):
    aspect = math.sqrt(1 - clamp(a, 0, 0.98))
    return min(r * r / aspect, 1), r * r * aspect


def gltf(r, a):
    alpha = r * r
    return alpha * (1 - a * a) + a * a, alpha


# From roughness and anisotropy to α along and across.
PAIRS = {"openpbr": openpbr, "materialx": materialx, "gltf-anisotropy": gltf}
CASES = [(owner, dialect) for dialect in DIALECTS for owner in dialect.owners]
IDS = [f"{owner}:{dialect.name}" for owner, dialect in CASES]


def rule(table, owner, dialect):
    """Return the rule of a dialect; one name may have another for each owner."""
    return table.get(f"{owner}:{dialect.name}", table.get(dialect.name))


def test_every_dialect_has_a_rule_of_its_source():
    missing = [
        f"{owner}:{dialect.name}"
        for owner, dialect in CASES
        if not (rule(STORED, owner, dialect) or rule(READ, owner, dialect))
    ]
    assert not missing, (
        "each dialect has its rule in STORED (from the exponent) or READ (to α) of this file"
    )
    names = {dialect.name for dialect in DIALECTS} | set(IDS)
    assert set(STORED) | set(READ) <= names
    for dialect in DIALECTS:
        assert dialect.program
        assert dialect.source
        assert dialect.formula


@pytest.mark.parametrize(("owner", "dialect"), CASES, ids=IDS)
def test_twenty_values_as_the_program_and_back(owner, dialect):
    scaled = dialect.setting is not None and dialect.specular is Specular.no
    for weight in (100, 128, 256) if scaled else WEIGHTS[dialect.specular]:
        setting = f":{weight}" if dialect.setting else ""
        end = endpoint(f"{owner}:{dialect.name}{setting}")
        inside = 0
        from_exponent = rule(STORED, owner, dialect)
        if from_exponent:
            for n in EXPONENTS:
                wanted = from_exponent(n, weight)
                stored = end.encode(np.array([n]))
                if np.isnan(stored[0]):
                    assert not end.stored.accepts(np.array(wanted))
                    continue
                assert stored[0] == pytest.approx(wanted, rel=1e-12, abs=1e-15)
                if not end.encoding.clamped(stored)[0]:
                    # Where a rule is 1 − …, the last digit of the stored number is worth more.
                    worth = 4e-16 / (1 - wanted) if wanted < 1 else 1e-9
                    assert end.decode(stored)[0] == pytest.approx(n, rel=max(1e-12, worth))
                    inside += 1
        else:
            stored = np.linspace(*end.stored.typical, 20)
            stored = stored[end.stored.accepts(stored)]
            wanted = [rule(READ, owner, dialect)(value) for value in stored]
            np.testing.assert_allclose(end.decode_legal(stored), wanted, rtol=1e-12)
            np.testing.assert_allclose(end.encode(np.array(wanted)), stored, rtol=1e-12)
            inside = stored.size
        assert inside >= 7


def test_examples_of_the_sources():
    assert mdfconv.convert(64.0, "blinn-phong", "blinn-phong:babylon") == pytest.approx(
        0.328809, abs=5e-7
    )
    # An OBJ's 100, by way of obj2gltf, is what 100 itself should have become.
    repaired = mdfconv.convert(0.9, "blinn-phong:obj2gltf", "ggx:roughness", metric="environment")
    assert repaired == pytest.approx(0.331488, abs=1e-6)
    assert mdfconv.convert(1.0, "ggx:blender-2.7", "ggx") == 1


def test_what_is_clamped_has_no_inverse():
    with pytest.raises(MdfconvError, match=r"no inverse here: r = 0 is any N ≥ 1000"):
        mdfconv.convert([0.5, 0.0], "blinn-phong:obj2gltf", "ggx")
    with pytest.raises(MdfconvError, match=r"r = 0 is any N ≥ 621"):
        mdfconv.convert(0, "blinn-phong:adobe-usd:0.5", "ggx")
    with pytest.raises(MdfconvError, match=r"r = 1 is any N ≤ 1"):
        mdfconv.convert(1.0, "blinn-phong:mmd-tools", "ggx")
    # The other way it is what the program stores, and a caution says what is lost.
    (found,) = mdfconv.explain([5000.0], "blinn-phong", "blinn-phong:fbx")
    assert found.result == 0
    assert "r = 0 is any N ≥ 100" in found.cautions[0]


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("blinn-phong:vtk-gltf", "depends on the specular weight"),
        ("blinn-phong:vtk-gltf:0", "above 0 and at most 1, not 0"),
        ("blinn-phong:vtk-gltf:much", "a specular weight is a number, not 'much'"),
        ("blinn-phong:fbx:0.5", "fbx does not depend on a specular weight"),
        ("ggx:roughness:0.5", "ggx:roughness takes no '0.5'"),
        ("blinn-phong:linear", "depends on the scale K; give it, as in blinn-phong:linear:64"),
        ("blinn-phong:linear:0", "a scale is above 0, not 0"),
        ("blinn-phong:linear:inf", "a scale is above 0, not inf"),
        ("blinn-phong:linear:half", "a scale is a number, not 'half'"),
        ("unity", "did you mean ggx:glossiness"),
        ("unreal", "did you mean ggx:roughness"),
        ("maya", "did you mean ggx:roughness"),
        ("3ds Max", "did you mean ggx:roughness"),
        ("V-Ray", "did you mean ggx:glossiness"),
        ("radiance", "did you mean beckmann:ward"),
        ("ward", "did you mean beckmann:ward"),
        ("povray", "did you mean blinn-phong:povray"),
        ("phong_size", "did you mean blinn-phong:reflected"),
        ("ggx:pbrt", "did you mean pbrt-v"),
        ("sawicki:fbx", "sawicki has no encoding 'fbx'"),
    ],
)
def test_mistakes(name, message):
    with pytest.raises(MdfconvError, match=message):
        endpoint(name)


@pytest.mark.parametrize("name", [f"{owner}:{dialect.name}" for owner, dialect in CASES])
def test_names_are_listed(name):
    owner, _, encoding = name.partition(":")
    assert encoding in encodings_of(mdfconv.distribution(owner))


@pytest.mark.parametrize("name", list(PAIRS))
@pytest.mark.parametrize("r", [0.05, 0.3, 0.7])
@pytest.mark.parametrize("a", [0.0, 0.2, 0.6, 0.9])
def test_pairs_of_roughness_and_anisotropy(name, r, a):
    wanted = PAIRS[name](r, a)
    along, across = mdfconv.convert((r, a), f"ggx:{name}", "ggx")
    assert (along, across) == pytest.approx(wanted, rel=1e-13)
    if along < 1:
        back = mdfconv.convert((along, across), "ggx", f"ggx:{name}")
        assert back == pytest.approx((r, a), rel=1e-12, abs=1e-7)
    (found,) = mdfconv.explain([(r, a)], f"ggx:{name}", "beckmann", "peak")
    assert found.value == (r, a)
    assert found.result == pytest.approx(wanted, rel=1e-13)


def test_pairs_of_arrays():
    r, a = np.array([0.2, 0.5]), np.array([0.1, 0.8])
    along, across = mdfconv.convert((r, a), "ggx:openpbr", "beckmann", metric="environment")
    factor = mdfconv.convert(1.0, "ggx", "beckmann", metric="environment")
    for index in range(2):
        wanted = openpbr(r[index], a[index])
        assert along[index] == pytest.approx(wanted[0] * factor, rel=1e-9)
        assert across[index] == pytest.approx(wanted[1] * factor, rel=1e-9)


@pytest.mark.parametrize(
    ("pair", "ends", "message"),
    [
        ((0.1, 0.4), ("ggx", "ggx:openpbr"), "x is the rougher axis"),
        ((0.9, 0.001), ("ggx", "ggx:materialx"), "no such pair"),
        ((0.5, 1.0), ("ggx:openpbr", "ggx"), r"a = 1 is outside"),
        ((0.5, -0.1), ("ggx:materialx", "ggx"), r"a = -0.1 is outside"),
        ((0.0, 0.1), ("ggx:gltf-anisotropy", "ggx"), r"r = 0 is outside"),
    ],
)
def test_pairs_that_are_none(pair, ends, message):
    with pytest.raises(MdfconvError, match=message):
        mdfconv.convert(pair, *ends)


def test_ward_is_near_and_says_so():
    assert "near, not equal" in endpoint("beckmann:ward").caution
    with pytest.warns(mdfconv.MdfconvWarning, match="near, not equal"):
        assert mdfconv.convert(0.3, "beckmann:ward", "beckmann") == 0.3


def test_source_of_an_engine():
    # $phongexponent 150 is a white texel of the exponent map.
    white = mdfconv.convert(1.0, "blinn-phong:source-phong", "blinn-phong")
    assert white == mdfconv.convert(150.0, "blinn-phong:reflected", "blinn-phong") == 603


@pytest.mark.parametrize(("owner", "dialect"), CASES, ids=IDS)
def test_texels_are_known_names(owner, dialect):
    assert dialect.texels in ("", SAME) or endpoint(dialect.texels)
    end = endpoint(f"{owner}:{dialect.example}")
    assert texels_of(end) == (end.label if dialect.texels == SAME else dialect.texels)


def test_texels_of_what_is_no_dialect():
    assert texels_of(endpoint("ggx")) == "ggx"
    assert texels_of(endpoint("ggx:glossiness")) == "ggx:glossiness"


@pytest.mark.parametrize("h", [0, 1, 2, 50, 51, 255, 511])
def test_hardness_of_blender(h):
    stored = (h - 1) * 1.9607843137254901
    end = endpoint("blinn-phong:blender-2.7")
    if h == 0:
        # A uniform lobe, for which there is no exponent.
        assert np.isnan(end.decode_legal(np.array([stored]))[0])
    else:
        assert end.decode([stored])[0] == pytest.approx(h, rel=1e-14)
        assert end.encode(np.array([float(h)]))[0] == pytest.approx(stored, rel=1e-14)
