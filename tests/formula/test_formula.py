"""Formulas to paste: compiled, run and validated as their users would."""

import ctypes
import itertools
import math
import re
import shutil
import subprocess

import numpy as np
import pytest

from mdfconv.distributions import list_distributions, one_parameter_distributions
from mdfconv.distributions.dialects import DIALECTS
from mdfconv.distributions.endpoint import Endpoint, encodings_of, endpoint, endpoints
from mdfconv.distributions.parameter import Encoding, Parameter
from mdfconv.errors import MdfconvError
from mdfconv.fitting.metrics import metric_named
from mdfconv.fitting.solve import fit
from mdfconv.formula import LANGUAGES, SearchProblem, cheapest, pareto_front, write_formula
from mdfconv.formula.code import argument_name
from mdfconv.formula.family import Formula, Shape
from mdfconv.formula.search import is_glossy
from tests.cli.runner import run
from tests.formula.latex import evaluated
from tests.formula.running import RUN, SETTINGS, with_naga

# What the machine has: `.ci/run` installs both.
COMPILERS = [name for name in ("gcc",) if shutil.which(name)]
VALIDATORS = [name for name in ("glslangValidator",) if shutil.which(name)]
CASES = [
    ("beckmann", "ggx", "unit", 0.01, 0.8, 1e-2),
    ("blinn-phong", "ggx:roughness", "energy", 1, 1e4, 1e-2),
    ("ggx", "blinn-phong", "energy", 0.02, 0.9, 1e-4),
    ("ggx:roughness", "beckmann:glossiness", "display", 0.2, 0.8, 1e-3),
    ("ggx:glossiness", "sawicki", "unit", 0.2, 0.9, 3e-5),
    ("sawicki", "gauss", "energy", 2, 1e6, 1e-4),
    ("schlick", "smoothie", "unit", 0.01, 0.7, 1e-3),
]


@pytest.fixture(scope="module", params=CASES, ids=lambda case: f"{case[0]}-{case[1]}")
def solved(request):
    source, target, metric, low, high, tolerance = request.param
    problem = SearchProblem(endpoint(source), endpoint(target), metric_named(metric), low, high)
    return problem, cheapest(problem, tolerance), tolerance


def exact(problem, values):
    """Return stored values of the target by the fit, for float32 values of the source."""
    parameter = problem.source.decode(values.astype(float))
    pair = problem.source.distribution, problem.target.distribution
    return problem.target.encode(fit(pair[0], parameter, pair[1], problem.metric).parameter)


def values_in(problem):
    values = np.geomspace(problem.low, problem.high, 97).astype(np.float32)
    return np.clip(values, np.float32(problem.low), np.float32(problem.high))


@pytest.fixture(scope="module")
def wanted(solved):
    """The fit's answers at `values_in`."""
    problem = solved[0]
    return exact(problem, values_in(problem))


def worst(problem, got, wanted):
    """Return the worst relative error, of 1 − g for a glossiness."""
    if problem.target.stored.name == "glossiness":
        got, wanted = 1 - got, 1 - wanted
    return np.max(np.abs(got / wanted - 1))


def function_name(code):
    return re.search(r"^(?:float|def) (\w+)\(", code, re.M)[1]


def compiled(compiler, code, folder):
    """Return a function of C as one of Python."""
    (folder / "formula.c").write_text(code)
    flags = [
        "-Wall",
        "-Wextra",
        "-Wdouble-promotion",
        "-Werror",
        "-std=c99",
        "-O2",
        "-shared",
        "-fPIC",
    ]
    subprocess.run(
        [compiler, *flags, "formula.c", "-o", "formula.so", "-lm"], cwd=folder, check=True
    )
    call = getattr(ctypes.CDLL(str(folder / "formula.so")), function_name(code))
    call.argtypes, call.restype = [ctypes.c_float], ctypes.c_float
    return call


@pytest.mark.parametrize("compiler", COMPILERS)
def test_c_compiles_runs_and_keeps_its_word(solved, wanted, tmp_path, compiler):
    problem, formula, tolerance = solved
    assert formula.error <= tolerance
    call = compiled(compiler, write_formula(formula, problem, "c"), tmp_path)
    values = values_in(problem)
    got = np.array([call(value) for value in values.tolist()])
    assert worst(problem, got, wanted) <= formula.error * 1.02 + 3e-7


def test_python_runs_on_numbers_and_arrays(solved, wanted):
    problem, formula, _ = solved
    code = write_formula(formula, problem, "python")
    scope = {}
    exec(code, scope)
    function = scope[function_name(code)]
    values = values_in(problem)
    got = function(values.astype(float))
    assert worst(problem, got, wanted) <= formula.error * 1.02 + 3e-7
    assert function(float(values[5])) == pytest.approx(got[5], rel=1e-12)


def outside(problem):
    """Return values beyond the range, and the end of it that is nearest to each."""
    below = [0.0, -0.0, -1.0, -math.inf, 0.5 * problem.low]
    above = [2.0 * problem.high, 1e30, math.inf]
    return below + above, [problem.low] * len(below) + [problem.high] * len(above)


@pytest.mark.parametrize("compiler", COMPILERS)
def test_c_gives_the_nearest_end_outside_the_range(solved, tmp_path, compiler):
    problem, formula, _ = solved
    call = compiled(compiler, write_formula(formula, problem, "c"), tmp_path)
    beyond, ends = outside(problem)
    assert list(map(call, beyond)) == list(map(call, ends))
    assert call(math.nan) == call(problem.low)


def test_python_gives_the_nearest_end_outside_the_range(solved):
    problem, formula, _ = solved
    code = write_formula(formula, problem, "python")
    scope = {}
    exec(code, scope)
    function = scope[function_name(code)]
    beyond, ends = outside(problem)
    assert list(map(function, beyond)) == list(map(function, ends))
    np.testing.assert_array_equal(function(np.array(beyond)), function(np.array(ends)))
    single = function(np.array(beyond, np.float32))
    assert single.dtype == np.float32
    np.testing.assert_array_equal(single, function(np.array(ends, np.float32)))
    assert function(0) == function(problem.low)
    assert math.isnan(function(math.nan))


@pytest.mark.parametrize("language", [name for name in RUN if name not in ("c", "python")])
def test_other_languages_compute_the_same(solved, wanted, language):
    problem, formula, _ = solved
    values = values_in(problem)
    (got,) = RUN[language](write_formula(formula, problem, language), [values])
    assert worst(problem, got, wanted) <= formula.error * 1.02 + 1e-6
    beyond, ends = outside(problem)
    (got,) = RUN[language](write_formula(formula, problem, language), [beyond])
    (at_ends,) = RUN[language](write_formula(formula, problem, language), [ends])
    np.testing.assert_array_equal(got, at_ends)


def test_wgsl_computes_the_same():
    """All at once, for the driver takes seconds to start."""
    ends = [(endpoint(first), endpoint(last)) for first, last, *_ in CASES]
    problems = [
        SearchProblem(*pair, metric_named(case[2]), *case[3:5])
        for pair, case in zip(ends, CASES, strict=True)
    ]
    formulas = [cheapest(problem, case[5]) for problem, case in zip(problems, CASES, strict=True)]
    codes = [write_formula(*both, "wgsl") for both in zip(formulas, problems, strict=True)]
    values = list(map(values_in, problems))
    results = with_naga(codes, [[column] for column in values])
    for problem, formula, column, (got,) in zip(problems, formulas, values, results, strict=True):
        assert worst(problem, got, exact(problem, column)) <= formula.error * 1.02 + 1e-6


@pytest.mark.parametrize("validator", VALIDATORS)
def test_shaders_validate(solved, tmp_path, validator):
    problem, formula, _ = solved
    validate(validator, problem, formula, tmp_path)


def validate(validator, problem, formula, folder):
    glsl = write_formula(formula, problem, "glsl")
    name = function_name(glsl)
    source = f"#version 310 es\nprecision highp float;\n{glsl}\nlayout(location = 0) in float x;\n"
    source += f"layout(location = 0) out vec4 color;\nvoid main() {{ color = vec4({name}(x)); }}\n"
    (folder / "formula.frag").write_text(source)
    hlsl = write_formula(formula, problem, "hlsl")
    hlsl += f"\nfloat4 main(float x : TEXCOORD0) : SV_Target {{ return {name}(x).xxxx; }}\n"
    (folder / "formula.hlsl").write_text(hlsl)
    for words in (["formula.frag"], ["-D", "-V", "-S", "frag", "-e", "main", "formula.hlsl"]):
        done = subprocess.run(
            [validator, *words], cwd=folder, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stdout
        assert "WARNING" not in done.stdout


def test_latex_says_the_same(solved):
    problem, formula, _ = solved
    text = write_formula(formula, problem, "latex").splitlines()[-1]
    assert text.count("{") == text.count("}")
    assert text.count(r"\left(") == text.count(r"\right)")
    for coefficient in formula.numerator:
        assert str(np.float32(abs(coefficient))).partition("e")[0] in text
    condition = re.sub(r" \\cdot 10\^{(.*?)}", r"e\1", text.partition(r"\quad ")[2])
    low, _, high = condition.split(r" \le ")
    assert (float(low), float(high)) == (problem.low, problem.high)


def test_latex_computes_the_same(solved, wanted):
    problem, formula, _ = solved
    line = write_formula(formula, problem, "latex").splitlines()[-1]
    got = evaluated(line, {problem.source.stored.symbol: values_in(problem).astype(float)})
    assert worst(problem, got, wanted) <= formula.error * 1.02 + 1e-6


def test_the_comment_states_what_was_promised(solved):
    problem, formula, _ = solved
    code = write_formula(formula, problem, "c")
    assert code.isascii()
    assert f"for {problem.low:.10g} to {problem.high:.10g}; outside, the input is clamped" in code
    assert f"the {problem.metric} metric" in code
    assert f"{formula.error:.2g} in float32" in code
    assert f"{formula.shape.operations} operations" in code


def test_operations_are_those_of_the_code(solved):
    problem, formula, _ = solved
    lines = write_formula(formula, problem, "glsl").splitlines()
    body = " ".join(line for line in lines if line.startswith("    "))
    cheap = sum(body.count(f" {sign} ") for sign in "+-*")
    slow = body.count(" / ") + body.count("sqrt(")
    assert body.count("clamp(") == 1
    glossy = [problem.source.stored.name, problem.target.stored.name].count("glossiness")
    assert cheap + 4 * slow + 2 == formula.shape.operations + glossy


@pytest.fixture(scope="module")
def simple():
    problem = SearchProblem(*endpoints("blinn-phong", "ggx"), metric_named("energy"), 1, 1e4)
    return problem, cheapest(problem, 0.1)


def test_a_constant_has_nothing_to_clamp(simple):
    problem, _ = simple
    formula = cheapest(problem, 1)
    assert formula.shape.operations == 0
    for language in ("glsl", "hlsl", "c", "python"):
        assert LANGUAGES[language].one_line(formula, problem).startswith("return 0.")


def test_the_comment_spells_the_metrics_setting(simple):
    problem, formula = simple
    exposed = SearchProblem(problem.source, problem.target, metric_named("display:4"), 1, 1e4)
    assert "under the display:4 metric: keeps the picture" in write_formula(formula, exposed, "c")


def stored_as(name, **options):
    """Return an end of GGX that stores α under another name."""
    parameter = Parameter(name, "α", (0.01, 0.8), 0.0, 1.0, **options)
    return Endpoint(
        endpoint("ggx").distribution,
        Encoding(name, parameter, lambda stored: stored, lambda alpha: alpha, ""),
    )


NAMES = [
    "scale", "u", "v", "w", "w2", "sqrt", "clamp", "fminf", "np", "half", "lambda", "float",
     "float3", "sample", "in", "m_B", "mean slope", "α", "2nd", "input", "register", "row__major",
     "Texture", "t1", "kernel", "device", "thread", "closure", "color", "normal", "point",
     "emit", "fn", "let", "var", "loop", "self", "target", "mod", "ref", "macro", "super",
     "override", "enable", "from", "await", "storage", "workgroup", "std", "handle", "move", "get",
]  # fmt: skip
# Of all shapes the one that needs most names: 1 − w⁴ under a root.
MANY = Shape(variable=4.0, factor=1.0, outer=0.5, numerator=2, denominator=2)


def with_many_names(name):
    """Return a formula, what it is for, values of its argument and what it makes of them."""
    problem = SearchProblem(stored_as(name), endpoint("beckmann"), metric_named("unit"), 0.01, 0.8)
    values = np.linspace(0.1, 0.8, 5)
    w4 = values**4
    wanted = np.sqrt(values * (1 + 0.5 * w4) / (1 + 0.25 * w4 + 0.125 * w4**2))
    return Formula(MANY, (1.0, 0.5), (0.25, 0.125), 0.1), problem, values, wanted


def test_any_name_of_a_parameter_is_valid_wgsl():
    cases = list(map(with_many_names, NAMES))
    codes = [write_formula(formula, problem, "wgsl") for formula, problem, *_ in cases]
    for (*_, wanted), (got,) in zip(
        cases, with_naga(codes, [[values] for *_, values, _ in cases]), strict=True
    ):
        np.testing.assert_allclose(got, wanted, rtol=1e-6)


@pytest.mark.parametrize("name", NAMES)
def test_any_name_of_a_parameter_is_valid_code(name, tmp_path):
    formula, problem, values, wanted = with_many_names(name)
    for language in ("metal", "osl", "materialx"):
        (got,) = RUN[language](write_formula(formula, problem, language), [values])
        np.testing.assert_allclose(got, wanted, rtol=1e-6)
    code = write_formula(formula, problem, "python")
    scope = {}
    exec(code, scope)
    np.testing.assert_allclose(scope[function_name(code)](values), wanted)
    for compiler in COMPILERS:
        call = compiled(compiler, write_formula(formula, problem, "c"), tmp_path)
        np.testing.assert_allclose(list(map(call, values)), wanted, rtol=1e-6)
    for validator in VALIDATORS:
        validate(validator, problem, formula, tmp_path)


def test_names_of_arguments_say_what_they_are():
    for entry in list_distributions():
        for parameter in (entry.parameter, *(encoding.stored for encoding in entry.encodings)):
            assert argument_name(parameter.name) == parameter.name
    assert argument_name("half") == "half_value"


def test_a_glossiness_is_known_by_what_is_declared(simple):
    assert is_glossy(endpoint("beckmann:glossiness"))
    assert is_glossy(stored_as("sheen", larger_is_smoother=True))
    assert not is_glossy(stored_as("alpha"))
    assert not is_glossy(endpoint("blinn-phong"))


@pytest.mark.parametrize(
    ("gamma", "name"),
    [
        (None, "gtr_alpha_from_beckmann_alpha"),
        (2.0, "gtr_alpha_from_beckmann_alpha"),
        (3.0, "gtr_gamma_3_alpha_from_beckmann_alpha"),
        (2.5, "gtr_gamma_2_5_alpha_from_beckmann_alpha"),
    ],
)
def test_a_second_parameter_is_in_the_name_if_it_is_not_the_usual(gamma, name):
    source, target = endpoints("beckmann", "gtr", gamma)
    problem = SearchProblem(source, target, metric_named("unit"), 0.01, 0.5)
    formula = cheapest(problem, 0.02)
    codes = {language: write_formula(formula, problem, language) for language in LANGUAGES.names}
    assert function_name(codes["c"]) == name
    assert all(f"to gtr C_TR at gamma = {gamma or 2:g}, for" in code for code in codes.values())
    values = values_in(problem)
    scope = {}
    exec(codes["python"], scope)
    got = scope[name](values.astype(float))
    assert worst(problem, got, exact(problem, values)) <= formula.error * 1.02 + 3e-7


def test_two_values_of_gamma_are_two_distributions():
    (first,), (second,) = (endpoints("gtr", "gtr", gamma)[:1] for gamma in (2.0, 3.0))
    problem = SearchProblem(first, second, metric_named("unit"), 0.01, 0.5)
    assert cheapest(problem, 0.05).error <= 0.05
    with pytest.raises(MdfconvError, match="two distributions"):
        SearchProblem(second, second, metric_named("unit"), 0.01, 0.5)


def test_no_formula_of_the_front_is_beaten():
    problem = SearchProblem(
        endpoint("blinn-phong"), endpoint("ggx"), metric_named("energy"), 1, 1e4
    )
    front = pareto_front(problem)
    prices = [formula.shape.operations for formula in front]
    errors = [formula.error for formula in front]
    assert prices == sorted(set(prices))
    assert all(later < 0.9 * former for former, later in itertools.pairwise(errors))
    # 1/√(a N + b): what the paper's closed form looks like, with the light's coefficients.
    simple = next(formula for formula in front if formula.error < 1e-2)
    assert (simple.shape.outer, simple.shape.numerator, simple.shape.denominator) == (-0.5, 2, 0)
    assert cheapest(problem, 1e-2) == simple


def test_coefficients_are_nearly_minimax():
    """A polynomial is compared with the exact minimax one, from linear programming."""
    from scipy.optimize import linprog

    problem = SearchProblem(
        endpoint("beckmann"), endpoint("gauss"), metric_named("energy"), 0.01, 0.7
    )
    w, t = problem.samples
    front = {f.shape: f for f in pareto_front(problem)}
    shape, formula = next(
        (s, f) for s, f in front.items() if s.outer == 1 and not s.denominator and s.numerator == 3
    )
    columns = w[:, None] ** (shape.factor + shape.variable * np.arange(3)) / t[:, None]
    ones = np.ones((w.size, 1))
    limits = np.concatenate([np.hstack([columns, -ones]), np.hstack([-columns, -ones])])
    bounds = np.concatenate([np.ones(w.size), -np.ones(w.size)])
    least = linprog([0, 0, 0, 1], limits, bounds, bounds=[(None, None)] * 4).fun
    assert least * 0.999 <= formula.error <= least * 1.05


@pytest.mark.parametrize(
    ("source", "target", "low", "high"),
    [("ggx", "blinn-phong", 0.01, 0.1), ("smoothie", "beckmann", 0.001, 0.01)],
)
def test_nearly_exact_shapes_do_not_break_the_search(source, target, low, high):
    problem = SearchProblem(endpoint(source), endpoint(target), metric_named("unit"), low, high)
    front = pareto_front(problem)
    assert front[-1].error < 1e-6


def test_tolerances_that_cannot_be_met_say_what_can():
    problem = SearchProblem(endpoint("beckmann"), endpoint("ggx"), metric_named("unit"), 0.01, 1)
    with pytest.raises(MdfconvError, match=r"no formula is within 6e-08 in float32; the most acc"):
        cheapest(problem, 6e-8)
    for bad in (0.0, -1.0, math.nan):
        with pytest.raises(MdfconvError, match="a tolerance is positive"):
            cheapest(problem, bad)


def test_command():
    words = ["formula", "--from", "blinn-phong", "--to", "ggx:roughness", "--metric", "energy"]
    status, out, err = run(*words)
    assert (status, err) == (0, "")
    assert out.startswith("// blinn-phong N to ggx:roughness r, for 1 to 10000; outside")
    assert "inversesqrt" in out
    assert "rsqrt" in run(*words, "--lang", "HLSL")[1]
    assert run(*words, "--all")[1].startswith("operations,worst_error,formula\n0,0.77,return 0.2")


ONE_LINE = {
    "glsl": "float w = clamp(exponent, 1.0, 10000.0); float v = {} + w * {}; return inversesqrt(v)",
    "hlsl": "float w = clamp(exponent, 1.0, 10000.0); float v = {} + w * {}; return rsqrt(v)",
    "wgsl": "let w = clamp(exponent, 1.0, 10000.0); let v = {} + w * {}; return inverseSqrt(v)",
    "metal": "float w = clamp(exponent, 1.0f, 10000.0f); float v = {}f + w * {}f; return rsqrt(v)",
    "osl": "float w = clamp(exponent, 1.0, 10000.0); float v = {} + w * {}; return inversesqrt(v)",
    "c": "float w = fminf(fmaxf(exponent, 1.0f), 10000.0f); float v = {}f + w * {}f; "
    "return 1.0f / sqrtf(v)",
    "python": "w = np.clip(exponent, 1.0, 10000.0); v = {} + w * {}; return v ** -0.5",
    "materialx": '<clamp name="w" type="float"> '
    '<input name="in" type="float" interfacename="exponent" /> '
    '<input name="low" type="float" value="1.0" /> '
    '<input name="high" type="float" value="10000.0" /> </clamp> '
    '<multiply name="multiply1" type="float"> <input name="in1" type="float" value="{1}" /> '
    '<input name="in2" type="float" nodename="w" /> </multiply> '
    '<add name="v" type="float"> <input name="in1" type="float" nodename="multiply1" /> '
    '<input name="in2" type="float" value="{0}" /> </add> '
    '<sqrt name="sqrt1" type="float"> <input name="in" type="float" nodename="v" /> </sqrt> '
    '<divide name="divide1" type="float"> <input name="in1" type="float" value="1.0" /> '
    '<input name="in2" type="float" nodename="sqrt1" /> </divide>',
    "latex": r"\alpha = \left({} + {} N\right)^{{-1/2}}",
}


@pytest.mark.parametrize("language", LANGUAGES.names)
def test_a_formula_in_one_line(simple, language):
    problem, _ = simple
    formula = cheapest(problem, 0.01)
    wanted = ONE_LINE[language].format(*map(str, np.float32(formula.numerator)))
    assert LANGUAGES[language].one_line(formula, problem) == wanted


@pytest.mark.parametrize("form", ["json", "table"])
def test_the_table_shows_the_language(simple, form):
    problem, _ = simple
    wanted = LANGUAGES["hlsl"].one_line(cheapest(problem, 0.01), problem)
    words = ["--from", "blinn-phong", "--to", "ggx", "--metric", "energy", "--lang", "hlsl"]
    status, out, _ = run("formula", *words, "--all", "--format", form)
    assert status == 0
    assert wanted in out


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--lang", "rust"], "unknown language 'rust'"),
        (["--range", "1"], "--range is LO:HI"),
        (["--range", "5:5"], "the range 5:5 is empty"),
        (["--range=-1:5"], "blinn-phong N = -1"),
        # In single precision the range ends in 0 or infinity, or is a point.
        (["--range", "1e-50:5"], "blinn-phong N = 0 is outside the legal range"),
        (["--range", "5:1e40"], "blinn-phong N = inf is not a finite number"),
        (["--range", "5:5.00000001"], "the range 5:5 is empty"),
        (["--tolerance", "0"], "a tolerance is positive"),
        (["--tolerance", "1e-12"], "a tolerance is at least 5.96e-08"),
        (["--to", "blinn-phong"], "a formula needs two distributions"),
        (["--to", "sawicki", "--range", "0.001:10"], "the fit has no answer in sawicki"),
        (["--format", "csv"], "--format is the form of the table of --all"),
    ],
)
def test_mistakes(words, message):
    both = ["--from", "blinn-phong", *([] if "--to" in words else ["--to", "ggx"]), *words]
    status, out, err = run("formula", *both)
    assert (status, out) == (2, "")
    assert message in err
    assert len(err.splitlines()) == 1


FORMS = [
    f"{mdf.name}:{form}{SETTINGS.get(form, '')}"
    for mdf in one_parameter_distributions()
    for form in encodings_of(mdf)
]


@pytest.mark.parametrize("name", FORMS)
def test_every_form_is_a_source(name):
    """Over its whole range, of which an end can be 0 or 1."""
    source, target = endpoint(name), endpoint("gauss")
    low, high = source.stored.typical
    problem = SearchProblem(source, target, metric_named("unit"), low, high)
    code = {}
    exec(write_formula(cheapest(problem, 0.1), problem, "python"), code)
    stored = np.geomspace(low, high, 50).clip(low, high)
    formula = next(value for key, value in code.items() if key.startswith(target.distribution.name))
    exact = fit(source.distribution, source.decode(stored), target.distribution, problem.metric)
    np.testing.assert_allclose(formula(stored), exact.parameter, rtol=0.11)


CLAMPING_AT_0 = [
    f"{owner}:{dialect.name}{SETTINGS.get(dialect.name, '')}"
    for dialect in DIALECTS
    if any(clamp.stored == 0 for clamp in dialect.clamps)
    for owner in dialect.owners
]


@pytest.mark.parametrize("name", CLAMPING_AT_0)
def test_to_a_clamped_0_there_is_no_formula(name):
    """No error is relative to it; where a target does not clamp there is one."""
    target, source = endpoint(name), endpoint("gauss")
    metric = metric_named("energy")

    def answer(low, high):
        return cheapest(SearchProblem(source, target, metric, low, high), 0.1).error

    with pytest.raises(MdfconvError, match=r"has no answer in .* narrow the range") as refusal:
        answer(1e-3, 0.5)
    last = float(re.search(r" to (\S+);", str(refusal.value))[1])
    assert answer(1.2 * last, 0.5) <= 0.1
