"""Textures as arrays: what each texel becomes, by which rule, and what rounding leaves."""

import doctest
import tracemalloc
import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

import mdfconv
from mdfconv import MdfconvError, MdfconvWarning
from mdfconv.distributions.endpoint import endpoint
from mdfconv.scene import TextureRule, convert_texture
from mdfconv.scene.texture import convert as texture_module
from mdfconv.scene.texture.texel_map import ErrorDiffusion, TexelMap

RULES = [
    ("ggx:alpha", "ggx:roughness"),
    ("ggx:roughness", "ggx:glossiness"),
    ("ggx:roughness", "beckmann:glossiness"),
    ("beckmann:roughness", "ggx"),
    ("blinn-phong:exponent", "ggx:roughness"),
    ("ggx:roughness", "blinn-phong:log2"),
    ("blinn-phong:log2", "sawicki:exponent"),
    ("blinn-phong:reflected-exponent", "ggx:roughness"),
    ("smoothie", "schlick"),
]
# Whether the stored value falls as the surface gets rougher.
FALLS = ("glossiness", "exponent", "log2", "reflected-exponent")
DTYPES = [np.uint8, np.uint16, np.float16, np.float32, np.float64]


def quiet(array, rule, **options):
    """Convert; here a clamped texel is no news."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", MdfconvWarning)
        return convert_texture(array, rule, **options)


def levels(dtype):
    return np.arange(np.iinfo(dtype).max + 1).astype(dtype)


@pytest.mark.parametrize("method", ["fast", "peak"])
@pytest.mark.parametrize(("source", "target"), RULES)
def test_table_is_what_convert_says_of_each_texel(source, target, method):
    rule = TextureRule(source, target, method)
    texels = quiet(levels(np.uint8), rule, depth=16)
    ends = rule.endpoints()
    compared = 0
    for level, texel in enumerate(texels):
        try:
            answer = mdfconv.convert(level / 255, *ends, method, metric="environment")
        except MdfconvError:
            continue
        assert texel == round(min(max(answer, 0), 1) * 65535)
        compared += 1
    assert compared > 150


def test_the_fit_and_the_closed_form_are_methods_too():
    few = np.array([[64, 128]], np.uint8)
    pair = "ggx:roughness", "beckmann:roughness"
    for method in ("fit", "closed-form"):
        converted = convert_texture(few, TextureRule(*pair, method, "energy"), depth=16)
        expected = mdfconv.convert(few / 255, *pair, method, metric="energy")
        assert np.array_equal(converted, np.rint(expected * 65535))


def test_the_metric_spells_its_exposure():
    few = np.array([0.1, 0.3])
    rule = TextureRule("ggx", "beckmann", "fit", "display:4")
    expected = mdfconv.convert(few, "ggx", "beckmann", "fit", metric="display:4")
    assert np.array_equal(convert_texture(few, rule), expected)
    assert not np.allclose(expected, mdfconv.convert(few, "ggx", "beckmann", metric="display"))


@pytest.mark.parametrize("target", ["gtr", "student-t"])
def test_a_second_parameter(target):
    few = np.array([0.2, 0.6])
    rule = TextureRule("ggx:alpha", target, "fit", gamma=3.0)
    expected = mdfconv.convert(few, "ggx", target, "fit", metric="environment", gamma=3.0)
    assert np.array_equal(convert_texture(few, rule), expected)
    # The usual γ makes both GGX.
    assert np.array_equal(convert_texture(few, TextureRule("ggx", target)), few)


def test_what_goes_beyond_1_needs_an_encoding():
    for entry in mdfconv.list_distributions():
        rule = TextureRule(entry.name, "ggx")
        if entry.parameter.typical[1] <= 1:
            assert rule.endpoints()[0].encoding is None
            continue
        with pytest.raises(MdfconvError, match="needs an encoding"):
            rule.endpoints()
        for encoding in ("exponent", "log2"):
            end, _ = TextureRule(f"{entry.name}:{encoding}", "ggx").endpoints()
            assert end.stored.larger_is_smoother == entry.parameter.larger_is_smoother
            low, high = end.stored.typical
            assert 0 <= low < high <= 1


@pytest.mark.parametrize(("source", "target"), RULES)
def test_monotone_stays_monotone(source, target):
    rule = TextureRule(source, target)
    falls = source.endswith(FALLS) != target.endswith(FALLS)
    for texels in (levels(np.uint16), np.linspace(-0.5, 1.5, 10001)):
        steps = np.diff(quiet(texels, rule).astype(np.float64))
        assert np.all(steps <= 0 if falls else steps >= 0)


@pytest.mark.parametrize(("source", "target"), RULES)
def test_every_finite_texel_becomes_one_from_0_to_1(source, target):
    found = quiet(
        np.array([-np.inf, -1, 0, 1e-300, 0.5, 1, 2, np.inf]), TextureRule(source, target)
    )
    assert np.all((found >= 0) & (found <= 1))


@pytest.mark.parametrize(
    ("source", "target", "texel", "expected"),
    [
        ("ggx:alpha", "ggx:roughness", 0, 0),  # a perfect mirror stays one
        ("ggx:roughness", "beckmann:glossiness", 0, 255),
        ("ggx:glossiness", "blinn-phong:exponent", 255, 255),
        ("ggx:alpha", "blinn-phong:log2", 0, 255),
        ("blinn-phong:exponent", "ggx:roughness", 0, 255),  # uniform
        ("blinn-phong:exponent", "beckmann:glossiness", 0, 0),
        ("ggx:roughness", "blinn-phong:exponent", 255, 0),
        ("ggx:roughness", "gauss", 255, 255),
    ],
)
def test_ends(source, target, texel, expected):
    for method in ("fast", "half-angle", "closed-form"):
        found = quiet(np.array([texel], np.uint8), TextureRule(source, target, method))
        assert abs(int(found[0]) - expected) <= (0 if texel == 0 or method == "fast" else 90)


def test_beyond_the_method_the_nearest_answer():
    # Closed-form: N = 1.696²/α² − 4.5 ends at α = 0.7995.
    rule = TextureRule("ggx", "blinn-phong:log2", "closed-form")
    found = quiet(np.linspace(0.79, 1, 50), rule)
    assert np.all(found[found.size // 4 :] == found[-1])
    # Gauss: on float texels the limit is the table's.
    assert quiet(np.array([0.999]), rule)[0] == quiet(np.array([1.0]), rule)[0]


def test_exponents():
    texels = np.array([1 / 16, 0.5, 1])
    rule = TextureRule("blinn-phong:exponent", "blinn-phong:log2", exponent_max=4096)
    assert convert_texture(texels, rule) == pytest.approx(np.log2(4096 * texels) / 13)
    back = TextureRule("blinn-phong:log2", "blinn-phong:exponent", log2_scale=10, exponent_max=1024)
    assert convert_texture(texels, back) == pytest.approx(2 ** (10 * texels) / 1024)
    assert TextureRule("phong:exponent", "ggx").exponent_max == 1000  # MTL


def test_exponents_with_an_offset():
    # exp2(10 g + 1), as many shaders have it; 1 + 149 v, of the reflected ray, as Source has it.
    texels = np.array([0, 64, 128, 255], np.uint8)
    gloss = TextureRule("blinn-phong:log2", "ggx:roughness", log2_scale=10, log2_offset=1)
    assert convert_texture(texels, gloss).tolist() == [201, 143, 94, 40]
    v = np.array([0, 0.25, 1])
    to = {"target": "blinn-phong:log2", "log2_scale": 12, "log2_offset": -1}
    linear = TextureRule("blinn-phong:exponent", exponent_min=5, exponent_max=105, **to)
    assert convert_texture(v, linear) == pytest.approx((np.log2(5 + 100 * v) + 1) / 12)
    source = TextureRule("phong:reflected-exponent", exponent_min=1, exponent_max=150, **to)
    exponent = 4 * (1 + 149 * v) + 3
    assert convert_texture(v, source) == pytest.approx((np.log2(exponent) + 1) / 12)
    number = mdfconv.convert(150.0, "blinn-phong:reflected", "ggx:roughness", metric="environment")
    rough = TextureRule(source.source, "ggx:roughness", exponent_min=1, exponent_max=150)
    assert convert_texture(v[2:], rough) == pytest.approx(number)


@given(st.floats(0, 100), st.floats(1, 5000), st.sampled_from(["exponent", "reflected-exponent"]))
@settings(max_examples=40, deadline=None)
def test_offsets_go_back(low, width, form):
    texels = np.linspace(0, 1, 33)[low == 0 :]
    there = f"blinn-phong:{form}", "blinn-phong:log2"
    ends = {"exponent_min": low, "exponent_max": low + width, "log2_offset": -1, "log2_scale": 20}
    smooth = quiet(texels, TextureRule(*there, **ends))
    back = quiet(smooth, TextureRule(*there[::-1], **ends))
    # Below N = 1 half a level of log2 is clamped.
    large = smooth > 0
    assert back[large] == pytest.approx(texels[large], abs=1e-6 * (1 + low / width))


@given(arrays.arrays(np.uint8, arrays.array_shapes(max_dims=3, max_side=20)))
def test_eight_bit_alpha_survives_sixteen_bit_roughness(alpha):
    roughness = convert_texture(alpha, TextureRule("ggx:alpha", "ggx:roughness"), depth=16)
    assert np.array_equal(roughness, np.rint(np.sqrt(alpha / 255) * 65535))
    back = convert_texture(roughness, TextureRule("ggx:roughness", "ggx:alpha"), depth=8)
    assert np.array_equal(back, alpha)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_alpha_within_the_quantum_at_the_same_depth(dtype):
    """Half a level of r is r of a level of α: for r < ½ none, else at most one."""
    alpha = levels(dtype)
    roughness = convert_texture(alpha, TextureRule("ggx:alpha", "ggx:roughness"))
    back = convert_texture(roughness, TextureRule("ggx:roughness", "ggx:alpha"))
    off = np.abs(back.astype(int) - alpha)
    assert off.max() <= 1
    smooth = np.sqrt(alpha / alpha[-1]) < 0.5 - 1 / alpha[-1]
    assert not off[smooth].any()


@given(
    st.sampled_from(DTYPES).flatmap(
        lambda dtype: arrays.arrays(dtype, arrays.array_shapes(min_dims=0, max_dims=4, min_side=0))
    )
)
@settings(max_examples=60)
def test_shape_and_type_are_kept(texels):
    before = texels.copy()
    found = quiet(texels, TextureRule("blinn-phong:log2", "ggx:roughness"))
    assert (found.shape, found.dtype) == (texels.shape, texels.dtype)
    assert np.array_equal(texels, before, equal_nan=texels.dtype.kind == "f")
    if texels.dtype.kind == "f":
        assert np.array_equal(np.isnan(found), np.isnan(texels))


def test_halves_are_singles():
    """The table of halves and the evaluation of singles agree."""
    halves = np.linspace(0, 1, 1001).astype(np.float16)
    rule = TextureRule("ggx:roughness", "beckmann:roughness")
    singles = quiet(halves.astype(np.float32), rule)
    assert np.array_equal(quiet(halves, rule), singles.astype(np.float16))


def test_strides_and_byte_order():
    texels = np.arange(600, dtype=">u2").reshape(20, 30)[::2, ::3]
    found = quiet(texels, TextureRule("ggx", "ggx:roughness"))
    assert np.array_equal(found, np.rint(np.sqrt(texels / 65535) * 65535))


def test_clamped_texels_are_told_once():
    rule = TextureRule("ggx:roughness", "blinn-phong:exponent")
    with pytest.warns(MdfconvWarning, match="3 of 4 texels are clamped") as caught:
        convert_texture(np.array([1, 2, 3, 200], np.uint8), rule)
    assert len(caught) == 1
    assert convert_texture(np.array([0], np.uint8), rule)[0] == 255  # a mirror is no accident


@given(
    arrays.arrays(
        np.float32,
        arrays.array_shapes(min_dims=2, max_dims=2, max_side=40),
        elements=st.floats(0, 255, width=32),
    ),
    st.integers(1, 40),
)
@settings(max_examples=60, deadline=None)
def test_dither_keeps_the_mean_in_blocks_of_any_height(picture, rows):
    diffusion = ErrorDiffusion(picture.shape[1])
    parts = [diffusion(picture[top : top + rows]) for top in range(0, len(picture), rows)]
    found = np.concatenate(parts)
    assert np.abs(found - picture).max() <= 1.001
    height, width = picture.shape
    lost = 0.5 * (width + 0.5 * height + 0.2 * height) + 1e-3
    assert abs(found.sum(dtype=float) - picture.sum(dtype=float)) <= lost


def one_by_one(picture):
    """Floyd and Steinberg as they wrote it."""
    height, width = picture.shape
    value = np.zeros((height + 1, width + 2))
    value[:height, 1:-1] = picture
    for y in range(height):
        for x in range(1, width + 1):
            rounded = min(max(np.rint(value[y, x]), 0), 255)
            error = value[y, x] - rounded
            value[y, x] = rounded
            value[y, x + 1] += error * 7 / 16
            value[y + 1, x - 1] += error * 3 / 16
            value[y + 1, x] += error * 5 / 16
            value[y + 1, x + 1] += error / 16
    return value[:height, 1:-1]


def test_dither_against_the_loop():
    y, x = np.mgrid[:37, :53]
    picture = (100 + 50 * np.sin(x / 9) * np.cos(y / 7)).astype(np.float32)
    found = ErrorDiffusion(53)(picture)
    # Where a sum in single precision rounds the other way, the neighbours follow.
    assert np.mean(found != one_by_one(picture.astype(float))) < 0.01


@pytest.mark.parametrize("shape", [(70000, 1), (3000, 2), (1, 70000)])
def test_dither_of_narrow_pictures(shape):
    tracemalloc.start()
    levels = np.full(shape, 100.4, np.float32)
    found = ErrorDiffusion(shape[1])(levels)
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert most < 64 * levels.size + 4e6
    assert set(np.unique(found)) == {100, 101}


def test_dither_shows_what_rounding_hides():
    grey = np.full((64, 64), 20000, np.uint16)
    rule = TextureRule("ggx:roughness", "ggx:alpha")
    exact = (20000 / 65535) ** 2 * 255
    found = convert_texture(grey, rule, depth=8, dither=True)
    assert found.dtype == np.uint8
    assert found.mean() == pytest.approx(exact, abs=0.02)
    assert abs(convert_texture(grey, rule, depth=8).mean() - exact) > 0.05
    assert np.array_equal(found, convert_texture(grey, rule, depth=8, dither=True))


@pytest.mark.parametrize(
    ("array", "options", "words"),
    [
        (np.zeros(3, np.int32), {}, "uint8, uint16"),
        (np.zeros(3, bool), {}, "bool"),
        (np.zeros((3, 3), np.uint16), {"dither": True}, "results of 8 bits"),
        (np.zeros(3, np.uint8), {"dither": True}, "rows and columns"),
        (np.zeros(3, np.float32), {"depth": 8}, "floats"),
        (np.zeros(3, np.uint8), {"depth": 12}, "8 or 16"),
    ],
)
def test_arrays_that_are_no_texture(array, options, words):
    with pytest.raises(MdfconvError, match=words):
        convert_texture(array, TextureRule("ggx", "ggx:roughness"), **options)


@pytest.mark.parametrize(
    ("rule", "words"),
    [
        (("blinn-phong", "ggx"), "blinn-phong:exponent or blinn-phong:log2"),
        (("blinn-phong:roughness", "ggx"), "known: exponent, log2, reflected-exponent"),
        (("ggx:log2", "ggx"), "encoding of ggx"),
        (("ggx", "ggy"), "did you mean"),
        (("gauss", "ggx", "ward"), "ward has no conversion"),
        (("ggx", "beckmann", "fast", "energetic"), "metric"),
        (("ggx", "beckmann", "fast", "display:100"), "fast has no conversion stored .*; use fit"),
        (("blinn-phong:exponent", "ggx", "fast", "unit", 0.0), "above 0"),
        (("blinn-phong:log2", "ggx", "fast", "unit", 1e3, np.inf), "log2"),
        (("ggx", "beckmann", "fast", "unit", 1e3, 13.0, 2.0), "neither ggx nor beckmann has a sec"),
        (
            ("blinn-phong:exponent", "ggx", None, "unit", 10.0, 1.0, None, 1.0, 10.0),
            "below the lar",
        ),
        (("blinn-phong:exponent", "ggx", None, "unit", 10.0, 1.0, None, 1.0, -1.0), "from 0"),
        (("phong:log2", "ggx", None, "unit", 10.0, 9.0, None, 1.0, 0.0, 992.0), "offset of log2"),
        (("phong:log2", "ggx", None, "unit", 10.0, 9.0, None, 1.0, 0.0, np.nan), "offset of log2"),
        (("ggx", "student-t", "fast", "unit", 1e3, 13.0, 1.0), "student-t γ = 1"),
        ((3, "ggx"), "named by a string"),
    ],
)
def test_rules_that_are_none(rule, words):
    with pytest.raises(MdfconvError, match=words):
        convert_texture(np.zeros(2, np.uint8), TextureRule(*rule))


def test_docstring_example():
    found = doctest.testmod(texture_module)
    assert (found.failed, found.attempted > 0) == (0, True)


@pytest.mark.parametrize(
    ("texels", "depth", "levels", "words"),
    [
        # n²/255 is 0 for all to 8 bits, and n² to 16.
        (np.arange(8, dtype=np.uint8), None, (1, 8), "1 of 8 levels remain"),
        (np.arange(8, dtype=np.uint8).repeat(9), None, (1, 8), "1 of 8 levels remain"),
        (np.arange(8, dtype=np.uint8), 16, (0, 0), ""),
        (np.array([100, 150, 200, 250], np.uint8), None, (4, 4), ""),
        (np.arange(8192, dtype=np.uint16), 8, (5, 256), "5 of 256 levels remain"),
        (np.arange(65536, dtype=np.uint16), 8, (256, 256), ""),
        (np.linspace(0, 0.1, 99, dtype=np.float32), None, (0, 0), ""),
    ],
)
def test_levels_that_8_bits_lose_are_counted(texels, depth, levels, words):
    convert = TexelMap(TextureRule("ggx:roughness", "ggx:alpha"), texels.dtype, depth)
    convert(texels)
    assert convert.report().levels == levels
    assert convert.report().lost_levels() == words


def test_a_nan_that_signals_is_one():
    texels = np.array([0x7F800001, 0x3F000000], np.uint32).view(np.float32)
    found = quiet(texels, TextureRule("ggx:roughness", "ggx:alpha"))
    assert np.isnan(found[0])
    assert found[1] == 0.25


@pytest.mark.parametrize("name", ["blinn-phong:blender-obj", "blinn-phong:blender-2.8"])
def test_texels_follow_the_rule_that_a_program_has_for_textures(name):
    """Blender has the picture of a roughness socket as map_Ns, where its numbers are exponents."""
    texels = levels(np.uint8)
    rule = TextureRule(name, "ggx:alpha")
    assert rule.endpoints()[0].label == "ggx:roughness"
    expected = np.rint(np.square(texels / 255) * 255)
    assert np.array_equal(convert_texture(texels, rule), expected)
    there, back = TextureRule("ggx:alpha", name), TextureRule("ggx:alpha", "ggx:roughness")
    assert np.array_equal(convert_texture(texels, there), convert_texture(texels, back))


@pytest.mark.parametrize("name", ["blinn-phong:obj2gltf", "blinn-phong:fbx", "phong:linear:128"])
def test_texels_that_are_not_known_are_refused(name):
    for pair in ((name, "ggx"), ("ggx", name)):
        with pytest.raises(MdfconvError, match=r"texels of .* are is not known") as caught:
            TextureRule(*pair).endpoints()
        for meant in ("ggx:glossiness", "blinn-phong:exponent", "ggx:roughness"):
            assert meant in caught.value.hint
            TextureRule(meant, "ggx").endpoints()
    # Who has looked it up says so.
    assert TextureRule(endpoint(name), "ggx").endpoints()[0].label == endpoint(name).label


def test_what_is_too_rough_for_the_target_is_the_roughest():
    """pbrt-v3's roughness is beyond GGX from 0.45 on: not a mirror because it is below a half."""
    texels = np.linspace(0, 1, 101, dtype=np.float32)[None]
    converted = convert_texture(texels, TextureRule("ggx:pbrt-v3", "ggx:roughness"))
    assert np.all(np.diff(converted[0]) >= 0)
    assert converted[0, 50:].min() == 1
