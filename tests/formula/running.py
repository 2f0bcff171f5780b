"""Formulas run as their users would: each language by what compiles, parses or evaluates it.

`RUN` has for a language what takes code and the columns of its arguments, and returns a column for
each result; a test is skipped where the machine has not what it takes.
"""

import ctypes
import re
import shutil
import subprocess
import tempfile
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from mdfconv.distributions.dialects import DIALECTS
from tests.formula import wgsl

# What a rule needs besides the stored number.
SETTINGS = {
    dialect.name: f":{dialect.setting.example / 2:g}"
    for dialect in DIALECTS
    if dialect.setting and dialect.setting.default is None
}
# Of OSL (Language Specification) and of the Metal Shading Language, what is not in C++.
SHIMS = {
    "osl": """
        static float inversesqrt(float x) { return 1.0f / sqrtf(x); }
        static float clamp(float x, float low, float high) { return fminf(fmaxf(x, low), high); }
        static float min(float x, float y) { return fminf(x, y); }
        static float max(float x, float y) { return fmaxf(x, y); }
    """,
    "metal": """
        namespace metal {
        static inline float rsqrt(float x) { return 1.0f / sqrtf(x); }
        static inline float clamp(float x, float a, float b) { return fminf(fmaxf(x, a), b); }
        static inline float min(float x, float y) { return fminf(x, y); }
        static inline float max(float x, float y) { return fmaxf(x, y); }
        }
    """,
}
# In OSL all numbers are of single precision.
FLAGS = {"osl": ["-fsingle-precision-constant"], "metal": ["-I."], "c": []}


def function_names(code):
    return re.findall(r"^(?:float|def|fn) (\w+)\(", code, re.M)


def with_compiler(language):
    """Return what compiles code as C or C++, with what the language has besides."""

    def run(code, columns):
        compiler = "gcc" if language == "c" else "g++"
        if shutil.which(compiler) is None:
            pytest.skip(f"there is no {compiler}")
        ending = "c" if language == "c" else "cpp"
        with tempfile.TemporaryDirectory() as folder:
            # What Metal includes by this name.
            Path(folder, "metal_stdlib").write_text("#include <math.h>\n" + SHIMS["metal"])
            shim = "" if language == "c" else '#include <math.h>\nextern "C" {\n'
            shim += SHIMS["osl"] if language == "osl" else ""
            end = "" if language == "c" else "\n}\n"
            Path(folder, f"code.{ending}").write_text(shim + code + end)
            flags = [
                "-Wall",
                "-Wextra",
                "-Wno-unused-function",
                "-Wno-unused-parameter",
                "-Werror",
                "-O2",
                "-shared",
            ]
            flags += ["-std=c99", "-Wdouble-promotion"] if language == "c" else ["-std=c++14"]
            words = [compiler, *flags, *FLAGS[language], "-fPIC", f"code.{ending}", "-o", "code.so"]
            subprocess.run([*words, "-lm"], cwd=folder, check=True)
            library = ctypes.CDLL(str(Path(folder, "code.so")))
        made = []
        for name in function_names(code):
            call = getattr(library, name)
            call.argtypes, call.restype = [ctypes.c_float] * len(columns), ctypes.c_float
            made.append([call(*row) for row in zip(*map(np.float32, columns), strict=True)])
        return np.array(made)

    return run


def with_python(code, columns):
    scope = {}
    exec(code, scope)
    made = [scope[name](*map(np.asarray, columns)) for name in function_names(code)]
    return np.array([np.broadcast_to(column, np.shape(columns[0])) for column in made])


def with_naga(codes, columns):
    """Return the results of several codes, each with the columns of its arguments, at once."""
    asked = [
        {
            "code": code,
            "name": name,
            "arguments": [np.asarray(one, float).tolist() for one in given],
        }
        for code, given in zip(codes, columns, strict=True)
        for name in function_names(code)
    ]
    made = wgsl.results(asked)
    if made is None:
        pytest.skip("there is no wgpu, or no driver that it could use")
    results = iter(made)
    return [np.array([next(results) for _ in function_names(code)]) for code in codes]


@cache
def standard_nodes():
    mx = pytest.importorskip("MaterialX")
    library = mx.createDocument()
    mx.loadLibraries(mx.getDefaultDataLibraryFolders(), mx.getDefaultDataSearchPath(), library)
    return library


def with_materialx(code, columns):
    mx = pytest.importorskip("MaterialX")
    document = mx.createDocument()
    mx.readFromXmlString(document, code)
    document.setDataLibrary(standard_nodes())
    valid, message = document.validate()
    assert valid, message
    graph = document.getNodeGraph(re.search(r'<nodegraph name="(\w+)"', code)[1])
    for node in graph.getNodes():
        assert node.getNodeDef() is not None, f"{node.getCategory()} is no standard node"
    single = [np.float32(column) for column in columns]
    given = dict(zip((one.getName() for one in graph.getInputs()), single, strict=True))
    return np.array([
        np.broadcast_to(node_value(graph.getNode(one.getNodeName()), given), np.shape(columns[0]))
        for one in graph.getOutputs()
    ])  # fmt: skip


# As the specification has the nodes ("MaterialX Standard Nodes").
NODES = {
    "add": lambda v: v["in1"] + v["in2"],
    "subtract": lambda v: v["in1"] - v["in2"],
    "multiply": lambda v: v["in1"] * v["in2"],
    "divide": lambda v: v["in1"] / v["in2"],
    "power": lambda v: v["in1"] ** v["in2"],
    "sqrt": lambda v: np.sqrt(v["in"]),
    "ln": lambda v: np.log(v["in"]),
    "min": lambda v: np.minimum(v["in1"], v["in2"]),
    "max": lambda v: np.maximum(v["in1"], v["in2"]),
    "clamp": lambda v: np.clip(v["in"], v["low"], v["high"]),
    "ifgreater": lambda v: np.where(v["value1"] > v["value2"], v["in1"], v["in2"]),
    "constant": lambda v: v["value"],
    "dot": lambda v: v["in"],
}


def node_value(node, given):
    """Return what a node makes of the inputs of its graph, with unknown inputs an error."""
    values = {}
    definition = {one.getName() for one in node.getNodeDef().getActiveInputs()}
    for one in node.getInputs():
        assert one.getName() in definition
        if one.getInterfaceName():
            values[one.getName()] = given[one.getInterfaceName()]
        elif one.getNodeName():
            values[one.getName()] = node_value(node.getParent().getNode(one.getNodeName()), given)
        else:
            values[one.getName()] = np.float32(one.getValue())
    return NODES[node.getCategory()](values)


def validated(code, language):
    """Raise unless glslangValidator takes functions as part of a shader."""
    if shutil.which("glslangValidator") is None:
        pytest.skip("there is no glslangValidator")
    count = max(line.count("float ") - 1 for line in code.splitlines() if line.startswith("float "))
    calls = ["+".join(f"{name}({', '.join(['x'] * count)})" for name in function_names(code))]
    if language == "glsl":
        code = (
            f"#version 310 es\nprecision highp float;\n{code}\nlayout(location = 0) in float x;\n"
        )
        code += "layout(location = 0) out vec4 color;\n"
        code += f"void main() {{ color = vec4({calls[0]}); }}\n"
        words = ["code.frag"]
    else:
        code += f"\nfloat4 main(float x : TEXCOORD0) : SV_Target {{ return ({calls[0]}).xxxx; }}\n"
        words = ["-D", "-V", "-S", "frag", "-e", "main", "code.frag"]
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "code.frag").write_text(code)
        done = subprocess.run(
            ["glslangValidator", *words], cwd=folder, capture_output=True, text=True, check=False
        )
    assert done.returncode == 0, done.stdout
    assert "WARNING" not in done.stdout


RUN = {
    "c": with_compiler("c"),
    "metal": with_compiler("metal"),
    "osl": with_compiler("osl"),
    "python": with_python,
    "materialx": with_materialx,
}
# Those that nothing here evaluates.
VALIDATED = ("glsl", "hlsl")
# Relative: of some operations in single precision, of which a root or a logarithm is one.
SINGLE, DOUBLE = 3e-6, 1e-12
PRECISION = dict.fromkeys(RUN, SINGLE) | {"python": DOUBLE}
