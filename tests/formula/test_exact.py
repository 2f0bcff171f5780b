"""Formulas between stored forms of one lobe: exact, in every language, against `convert`."""

import itertools
import json
import re
import warnings

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from matplotlib.mathtext import MathTextParser

import mdfconv
from mdfconv.distributions import list_distributions, one_parameter_distributions
from mdfconv.distributions.endpoint import Endpoint, encodings_of, endpoint, exact_route
from mdfconv.distributions.parameter import Encoding, Parameter
from mdfconv.errors import MdfconvError
from mdfconv.formula import LANGUAGES, exact_relation, write_relation
from mdfconv.formula.algebra import simplified
from mdfconv.formula.expression import Expression, as_expression, number, variable
from tests.cli.runner import run
from tests.distributions.test_dialects import PAIRS
from tests.formula.latex import evaluated
from tests.formula.running import (
    PRECISION,
    RUN,
    SETTINGS,
    SINGLE,
    VALIDATED,
    validated,
    with_naga,
    with_python,
)

FORMS = [
    form
    for mdf in one_parameter_distributions()
    for form in (
        [mdf.name] if not encodings_of(mdf) or mdf.parameter.larger_is_smoother else []
    ) + [
        f"{mdf.name}:{name}{SETTINGS.get(name, '')}" for name in encodings_of(mdf)
    ]
]  # fmt: skip
# All pairs of forms of the same lobe, those of two distributions as well.
SAME_LOBES = [
    (source, target)
    for source, target in itertools.permutations(FORMS, 2)
    if exact_route(endpoint(source).distribution, endpoint(target).distribution) is not None
    and endpoint(source).label != endpoint(target).label
]
# Its inverse is Newton's method.
IN_STEPS = {"pbrt-v3"}
# Of each kind of operation one, in every language.
EXAMPLES = [
    ("ggx:glossiness", "ggx:roughness"),
    ("ggx:roughness", "ggx:glossiness"),
    ("ggx:roughness", "ggx"),
    ("ggx", "ggx:gltf-glossiness"),
    ("smoothie", "ggx"),
    ("gtr", "ggx"),
    ("ggx:pbrt-v3", "ggx"),
    ("ggx:glossiness", "ggx:pbrt-v4"),
    ("blinn-phong", "blinn-phong:babylon"),
    ("blinn-phong:mmd-tools", "blinn-phong:fbx"),
    ("blinn-phong", "blinn-phong:adobe-usd:0.5"),
    ("ggx:openpbr", "ggx"),
    ("ggx:materialx", "ggx:openpbr"),
    ("ggx:gltf-anisotropy", "ggx:roughness"),
    ("ggx", "ggx:gltf-anisotropy"),
    ("beckmann:materialx", "beckmann:glossiness"),
]


def columns_of(relation, count=24):
    """Return a column of numbers for each that the source stores, up to the ends of its range.

    Of a pair the first axis is the rougher one, where each axis is stored by itself.
    """
    stored = relation.stored(relation.source)
    columns = []
    for number_, one in enumerate(stored):
        low, high = one.parameter.typical
        low, high = max(low, 1e-3), min(high, 0.99 if one.name == "anisotropy" else high)
        values = np.geomspace(low, high, count).astype(np.float32).clip(low, high)
        # Both are not to rise together.
        columns.append(np.roll(values, 7 * number_))
    if len(stored) == 2 and not relation.source.pairing:
        rougher, smoother = np.maximum(*columns), np.minimum(*columns)
        # So that no stretch is taken of a difference that single precision has no digits of.
        smoother = np.minimum(smoother, rougher * np.float32(0.9))
        columns = [rougher, smoother]
        if stored[0].parameter.larger_is_smoother:
            columns.reverse()
    return [column.astype(float) for column in columns]


def converted(relation, columns):
    """Return what `convert` makes of columns, a column for each result; NaN where it refuses."""
    values = tuple(columns) if len(columns) == 2 else columns[0]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", mdfconv.MdfconvWarning)
        rows = []
        for row in zip(*columns, strict=True):
            values = tuple(row) if len(row) == 2 else row[0]
            try:
                made = mdfconv.convert(values, relation.source, relation.target)
            except MdfconvError:
                made = (np.nan,) * len(row)
            rows.append(made if isinstance(made, tuple) else (made,))
    return np.array(rows, float).T


def relation_of(pair):
    return exact_relation(*map(endpoint, pair))


@pytest.mark.parametrize("pair", SAME_LOBES, ids=" to ".join)
def test_every_pair_of_forms_of_one_lobe(pair):
    relation = relation_of(pair)
    if pair[1].partition(":")[2] in IN_STEPS:
        with pytest.raises(MdfconvError, match="has no formula: the rule of one is computed"):
            write_relation(relation, "python")
        return
    columns = columns_of(relation)
    wanted = converted(relation, columns)
    made = with_python(write_relation(relation, "python"), columns)
    known = np.isfinite(wanted)
    assert known.any(axis=1).all(), "the test asks for nothing that can be stored"
    # Where a rule is 1 − …, rounding is relative to the 1.
    np.testing.assert_allclose(made[known], wanted[known], rtol=1e-9, atol=1e-13)


@pytest.mark.parametrize("language", RUN)
@pytest.mark.parametrize("pair", EXAMPLES, ids=" to ".join)
def test_each_language_computes_the_same(pair, language):
    relation = relation_of(pair)
    columns = columns_of(relation)
    made = RUN[language](write_relation(relation, language), columns)
    wanted = with_python(write_relation(relation, "python"), columns)
    np.testing.assert_allclose(made, wanted, rtol=PRECISION[language], atol=PRECISION[language])


def test_wgsl_is_valid_and_computes_the_same():
    relations = list(map(relation_of, EXAMPLES))
    columns = list(map(columns_of, relations))
    codes = [write_relation(relation, "wgsl") for relation in relations]
    for relation, one, made in zip(relations, columns, with_naga(codes, columns), strict=True):
        wanted = with_python(write_relation(relation, "python"), one)
        np.testing.assert_allclose(made, wanted, rtol=SINGLE, atol=SINGLE)


@pytest.mark.parametrize("language", VALIDATED)
@pytest.mark.parametrize("pair", EXAMPLES, ids=" to ".join)
def test_each_shader_validates(pair, language):
    validated(write_relation(relation_of(pair), language), language)


def test_every_language_is_evaluated_validated_or_printed():
    assert {*RUN, *VALIDATED, "wgsl", "latex"} == set(LANGUAGES.names)


# What a person would write.
BODIES = {
    ("ggx:glossiness", "ggx:roughness"): ["return 1.0 - glossiness;"],
    ("ggx:roughness", "ggx:glossiness"): ["return 1.0 - roughness;"],
    ("beckmann:roughness", "beckmann:glossiness"): ["return 1.0 - roughness;"],
    ("ggx:roughness", "ggx"): ["return roughness * roughness;"],
    ("ggx", "ggx:roughness"): ["return sqrt(alpha);"],
    ("ggx", "ggx:gltf-glossiness"): ["return 1.0 - sqrt(alpha);"],
    ("ggx:gltf-glossiness", "ggx:roughness"): ["return 1.0 - glossiness;"],
    ("ggx:pbrt-v4", "ggx:roughness"): ["return sqrt(sqrt(roughness));"],
    ("smoothie", "ggx"): ["return alpha / sqrt(4.0 + alpha * alpha);"],
    ("gtr", "ggx"): ["return alpha;"],
    ("blinn-phong", "blinn-phong:obj2gltf"): ["return max(1.0 - exponent * 0.001, 0.0);"],
    # The clamp cannot act: N is at most 1000.
    ("blinn-phong:adobe-fbx", "blinn-phong:obj2gltf"): ["return 0.9 + roughness * 0.1;"],
    # 2/(w² + 2) of w² = 2/r⁴ − 2
    ("blinn-phong:peak", "blinn-phong:peak-alpha"): ["return roughness * roughness;"],
    ("blinn-phong:peak-alpha", "blinn-phong:peak"): ["return sqrt(roughness);"],
    ("blinn-phong:reflected", "blinn-phong"): ["return 3.0 + exponent * 4.0;"],
    ("ggx:gltf-anisotropy", "ggx:roughness"): [
        "float t1 = anisotropy * anisotropy;",
        "float t2 = roughness * roughness;",
        "return sqrt(t1 + t2 - t1 * t2);",
        "return roughness;",
    ],
    # Both store the same ratio of the axes.
    ("ggx:openpbr", "ggx:materialx"): [
        "float t1 = 1.0 - anisotropy;",
        "return roughness * sqrt(sqrt(t1 / (1.0 + t1 * t1))) * 1.1892071;",
        "return anisotropy;",
    ],
    ("ggx", "ggx:materialx"): [
        "return sqrt(sqrt(alpha_x * alpha_y));",
        "return 1.0 - alpha_y / alpha_x;",
    ],
}


@pytest.mark.parametrize("pair", BODIES, ids=" to ".join)
def test_what_is_written_is_what_a_person_would_write(pair):
    lines = write_relation(relation_of(pair), "glsl").splitlines()
    assert [line.strip() for line in lines if line.startswith("    ")] == BODIES[pair]


GLOSSINESS = {
    "glsl": "float {}(float glossiness) {{\n    return 1.0 - glossiness;\n}}",
    "hlsl": "float {}(float glossiness) {{\n    return 1.0 - glossiness;\n}}",
    "osl": "float {}(float glossiness) {{\n    return 1.0 - glossiness;\n}}",
    "wgsl": "fn {}(glossiness: f32) -> f32 {{\n    return 1.0 - glossiness;\n}}",
    "metal": "#include <metal_stdlib>\nusing namespace metal;\n"
    "float {}(float glossiness) {{\n    return 1.0f - glossiness;\n}}",
    "c": "#include <math.h>\nfloat {}(float glossiness) {{\n    return 1.0f - glossiness;\n}}",
    "python": "import numpy as np\n\n\ndef {}(glossiness):\n    return 1.0 - glossiness",
    "latex": r"r = 1 - g, \quad 0 \le g < 1",
    "materialx": """<materialx version="1.38">
  <nodegraph name="{}">
    <input name="glossiness" type="float" value="0.3" />
    <subtract name="subtract1" type="float">
      <input name="in1" type="float" value="1.0" />
      <input name="in2" type="float" interfacename="glossiness" />
    </subtract>
    <output name="roughness_out" type="float" nodename="subtract1" />
  </nodegraph>
</materialx>""",
}


@pytest.mark.parametrize("language", LANGUAGES.names)
def test_a_glossiness_in_every_language(language):
    code = write_relation(relation_of(("ggx:glossiness", "ggx:roughness")), language)
    comments = [LANGUAGES[language].remark(text) for text in (
        "ggx:glossiness g to ggx:roughness r: exact where 0 <= g < 1 and 0 < r <= 1.",
        f"By mdfconv {mdfconv.__version__}.",
    )]  # fmt: skip
    wanted = GLOSSINESS[language].format("ggx_roughness_from_ggx_glossiness")
    assert code == "\n".join([*comments, wanted])


@pytest.mark.parametrize("name", PAIRS)
def test_pairs_against_their_sources(name):
    """α of both axes, as the source of the program has it."""
    roughness, anisotropy = np.meshgrid(np.linspace(0.05, 0.95, 9), np.linspace(0, 0.97, 9))
    columns = [roughness.ravel(), anisotropy.ravel()]
    made = with_python(write_relation(relation_of((f"ggx:{name}", "ggx")), "python"), columns)
    wanted = np.transpose([PAIRS[name](*row) for row in zip(*columns, strict=True)])
    np.testing.assert_allclose(made, wanted, rtol=1e-12)
    there = made[0] < 1  # a clamped axis has lost what it was
    back = with_python(write_relation(relation_of(("ggx", f"ggx:{name}")), "python"), made)
    np.testing.assert_allclose(back[0][there], columns[0][there], rtol=1e-9)
    np.testing.assert_allclose(back[1][there], columns[1][there], atol=1e-7)


@pytest.mark.parametrize("pair", EXAMPLES, ids=" to ".join)
def test_latex_says_the_same(pair):
    relation = relation_of(pair)
    columns = columns_of(relation)
    symbols = [one.symbol for one in relation.stored(relation.source)]
    lines = write_relation(relation, "latex").splitlines()
    equations = [line for line in lines if not line.startswith("%")]
    wanted = with_python(write_relation(relation, "python"), columns)
    for line, column in zip(equations, wanted, strict=True):
        # Matplotlib has no cases.
        if "cases" not in line:
            text = re.sub(r".le ", r"\\leq ", line)
            MathTextParser("path").parse(f"${text}$")
        made = evaluated(line, dict(zip(symbols, columns, strict=True)))
        np.testing.assert_allclose(made * np.ones(24), column, rtol=SINGLE, atol=SINGLE)


@pytest.mark.parametrize("language", LANGUAGES.names)
def test_every_pair_is_written_in_every_language(language):
    for pair in SAME_LOBES:
        if pair[1].partition(":")[2] not in IN_STEPS:
            code = write_relation(relation_of(pair), language)
            assert code.isascii()
            assert all(code.count(a) == code.count(b) for a, b in ("()", "{}"))
            assert code.count(r"\left") == code.count(r"\right")


def test_a_fraction_in_latex():
    text = write_relation(relation_of(("smoothie", "ggx")), "latex").splitlines()[-1]
    root = r"\left(4 + \alpha_{s}^{2}\right)^{1/2}"
    assert text == rf"\alpha = \frac{{\alpha_{{s}}}}{{{root}}}, \quad 0 < \alpha_{{s}}"
    cases = write_relation(relation_of(("ggx", "ggx:gltf-anisotropy")), "latex").splitlines()[-1]
    assert r"1 - \alpha_{y} & \text{if } \alpha_{y}^{1/2} < 1 \\ 1 & \text{otherwise}" in cases
    logarithms = write_relation(relation_of(("ggx:pbrt-v3", "ggx")), "latex").splitlines()[-1]
    assert r"\alpha = 1.62142 + 0.819955 \ln r + 0.1734 \left(\ln r\right)^{2} + " in logarithms


def test_the_comment_says_what_clamps():
    code = write_relation(relation_of(("blinn-phong:blender-obj", "blinn-phong:fbx")), "c")
    assert code.isascii()
    start = (
        "// blinn-phong:blender-obj r to blinn-phong:fbx r: "
        "exact where 0 <= r <= 1 and 0 <= r <= 1."
    )
    assert code.startswith(start)
    assert "// blinn-phong:blender-obj: r = 0 is any N >= 1000." in code
    assert "// blinn-phong:fbx: r = 0 is any N >= 100." in code


def test_other_lobes_have_no_exact_formula():
    assert exact_relation(endpoint("beckmann"), endpoint("ggx")) is None
    # One number stands for both, but the lobes differ.
    assert exact_relation(endpoint("schlick"), endpoint("beckmann")) is None
    for name in ("ggx", "blinn-phong:fbx"):
        with pytest.raises(MdfconvError, match="two stored forms of one"):
            exact_relation(endpoint(name), endpoint(name))


def test_gamma_decides_whether_lobes_are_one():
    from mdfconv.distributions.endpoint import endpoints

    assert exact_relation(*endpoints("gtr", "ggx", 3.0)) is None
    assert exact_relation(*endpoints("gtr", "ggx", 2.0)) is not None
    assert any(mdf.second_parameter for mdf in list_distributions())


def form(decode, encode):
    parameter = Parameter("scale", "s", (0.1, 0.9), 0.0, 1.0)
    return Endpoint(endpoint("ggx").distribution, Encoding("scale", parameter, decode, encode, ""))


@pytest.mark.parametrize(
    "decode",
    [
        lambda s: np.arctan(s),
        lambda s: s if s > 0.5 else s * s,
        lambda s: np.where(s == 0.5, 1, s),
        lambda s: float(s) ** 2,
        lambda s: np.interp(s, [0, 1], [0, 1]),
        lambda s: np.add.reduce(s),
        lambda s: np.linspace(0, 1, 3) * s,
    ],
)
def test_a_rule_that_is_no_expression_is_refused(decode):
    relation = exact_relation(form(decode, np.sqrt), endpoint("ggx"))
    with pytest.raises(MdfconvError, match="ggx:scale to ggx has no formula"):
        write_relation(relation, "glsl")


@pytest.mark.parametrize(
    ("decode", "body"),
    [
        (lambda s: 2 ** (3 * s - 3), "return pow(2.0, (scale - 1.0) * 3.0);"),
        (lambda s: np.exp2(np.log2(s)), "return pow(2.0, log(scale) * 1.442695);"),
        (lambda s: np.log10(10**s), "return scale;"),
        (lambda s: np.clip(s, -1, 0.5), "return min(scale, 0.5);"),
        (lambda s: np.clip(s, -1, 2), "return scale;"),
        (lambda s: np.where(s >= 0.5, s, 0.5), "return scale < 0.5 ? 0.5 : scale;"),
        (lambda s: np.where(s > 0.5, 0.5, s), "return 0.5 < scale ? 0.5 : scale;"),
        (lambda s: np.negative(-s), "return scale;"),
        (lambda s: np.reciprocal(1 + np.reciprocal(s)), "return 1.0 / (1.0 + 1.0 / scale);"),
        (lambda s: np.asarray(s) * 1.0, "return scale;"),
        (lambda s: np.ones_like(s) * 0.5, "return 0.5;"),
    ],
)
def test_rules_of_ones_own(decode, body):
    code = write_relation(exact_relation(form(decode, np.sqrt), endpoint("ggx")), "glsl")
    assert code.splitlines()[-2].strip() == body
    made = with_python(
        write_relation(exact_relation(form(decode, np.sqrt), endpoint("ggx")), "python"),
        [np.linspace(0.05, 0.95, 9)],
    )
    np.testing.assert_allclose(made[0], decode(np.linspace(0.05, 0.95, 9)), rtol=1e-12)


X, Y = variable("x", (0.0, 1.0)), variable("y", (0.0, np.inf))
CONSTANTS = st.sampled_from([0.0, 0.25, 1.0, 2.0, 3.0, 0.1, 1 / 3]).map(number)
ATOMS = st.one_of(st.sampled_from([X, Y]), CONSTANTS)


def deeper(inner):
    two = st.tuples(inner, inner)
    return st.one_of(
        two.map(lambda pair: pair[0] + pair[1]),
        two.map(lambda pair: pair[0] * pair[1]),
        two.map(lambda pair: pair[0] - pair[1]),
        two.map(lambda pair: pair[0] / (1 + pair[1])),
        two.map(lambda pair: np.minimum(*pair)),
        two.map(lambda pair: np.maximum(*pair)),
        inner.map(lambda one: np.sqrt(np.maximum(one, 0))),
        inner.map(np.square),
        inner.map(lambda one: np.maximum(one, 0) ** 0.37),
        inner.map(lambda one: np.where(one < 0.5, one, 1 - one)),
    )


def value_of(node, values):
    """Return the value of an expression as NumPy evaluates its tree."""
    if node.operation == "number":
        return np.float64(node.value)
    if node.operation == "variable":
        return values[node.name]
    operands = [value_of(operand, values) for operand in node.operands]
    if node.operation == "select":
        return np.where(operands[0] < operands[1], *operands[2:])
    if node.operation in ("where", "clip"):
        return getattr(np, node.operation)(*operands)
    return getattr(np, node.operation)(*operands)


@settings(max_examples=300, deadline=None)
@given(st.recursive(ATOMS, deeper, max_leaves=12))
def test_simplifying_changes_no_value(expression):
    values = {
        "x": np.linspace(0.03, 0.97, 7),
        "y": np.geomspace(0.02, 40, 7)[[3, 6, 0, 5, 1, 4, 2]],
    }
    with np.errstate(all="ignore"):
        wanted = value_of(as_expression(expression), values) * np.ones(7)
        assume(np.isfinite(wanted).all() and (np.abs(wanted) < 1e6).all())
        made = value_of(simplified(expression)[0], values) * np.ones(7)
    # A root near 0 magnifies what rounding leaves of a difference.
    np.testing.assert_allclose(made, wanted, rtol=1e-6, atol=2e-6)


def test_an_expression_has_no_truth():
    with pytest.raises(TypeError, match="has no value"):
        bool(X)
    assert isinstance(X + 1, Expression)


@pytest.mark.parametrize(
    "words",
    [["--tolerance", "0.1"], ["--range", "0.1:0.5"], ["--metric", "energy"], ["--exposure", "2"],
     ["--all"]],
)  # fmt: skip
def test_options_of_a_search_are_refused(words):
    pair = ["--from", "ggx:glossiness", "--to", "ggx:roughness"]
    status, out, err = run("formula", *pair, *words)
    assert (status, out) == (2, "")
    assert err == (
        f"mdfconv: {words[0]} goes with a search: ggx:glossiness to ggx:roughness is exact\n"
    )


def test_command(tmp_path):
    status, out, err = run("formula", "--from", "ggx:openpbr", "--to", "ggx")
    assert (status, err) == (0, "")
    assert re.findall(r"^float (\w+)\(float roughness, float anisotropy\)", out, re.M) == [
        "ggx_alpha_x_from_ggx_openpbr_roughness_anisotropy",
        "ggx_alpha_y_from_ggx_openpbr_roughness_anisotropy",
    ]
    status, out, err = run("formula", "--from", "ggx", "--to", "ggx:pbrt-v3")
    assert (status, out, len(err.splitlines())) == (2, "", 1)
    specular = ["--from", "blinn-phong:assimp-gltf", "--to", "blinn-phong", "--specular", "0.5"]
    assert "blinn_phong_assimp_gltf_0_5_roughness(float" in run("formula", *specular)[1]


def test_a_file_is_written_and_kept(tmp_path):
    words = ["formula", "--from", "ggx:glossiness", "--to", "ggx:roughness", "-o", "f.glsl"]
    printed = run(*words[:-2])[1]
    status, out, err = run(*words, cwd=tmp_path)
    assert (status, out, err) == (0, "", "mdfconv: wrote f.glsl\n")
    assert (tmp_path / "f.glsl").read_text() == printed
    status, _, err = run(*words, "--lang", "c", cwd=tmp_path)
    assert status == 2
    assert "f.glsl" in err
    assert (tmp_path / "f.glsl").read_text() == printed
    assert run(*words, "--lang", "c", "--force", cwd=tmp_path)[0] == 0
    assert "#include" in (tmp_path / "f.glsl").read_text()


def test_the_table_of_a_search_goes_into_a_file(tmp_path):
    words = ["formula", "--from", "blinn-phong", "--to", "ggx", "--metric", "energy", "--all"]
    assert run(*words, "-o", "front.json", cwd=tmp_path)[0] == 0
    rows = json.loads((tmp_path / "front.json").read_text())
    assert {*rows[0]} == {"operations", "worst_error", "formula"}


def test_help_names_every_language():
    text = run("formula", "--help")[1]
    assert all(re.search(rf"\b{name}\b", text) for name in LANGUAGES.names)
