"""The house: imports go down only, and what is true of a distribution stands in its class."""

import ast
from pathlib import Path

import pytest

import mdfconv

PACKAGE = Path(mdfconv.__file__).parent
# From the roof to the ground; a module imports from its own floor and those beneath.
FLOORS = (
    "cli", "studies", "scene", "render", "recommend", "formula", "measured", "conversion", "brdf",
    "fitting", "light", "output", "distributions", "timing", "registry", "errors",
)  # fmt: skip
# What speaks to a terminal stands on the roof, alone.
TERMINAL = {"typer", "rich", "click"}
# Modules that may name distributions, because they are about those particular ones.
ABOUT_PARTICULAR_ONES = {
    "conversion/methods.py": "the formulas of Sawicki 2021 and the rule of Ward 1996",
    "studies/table2.py": "the columns of the paper's table",
    "studies/closed_forms.py": "the paper's formulas, refitted",
    "studies/error_curves.py": "the paper's figures",
    "studies/report/paper_pages.py": "the paper's prose",
    "render/comparison.py": "the names of BRDFs",
    "studies/furnace.py": "the definitions of BRDFs",
    "brdf/reflection.py": "the definitions of BRDFs",
    "brdf/microfacet.py": "the sampler of Heitz 2018, which is that of an ellipsoid",
    "studies/report/furnace_page.py": "the names of BRDFs",
    "studies/report/lights_page.py": "the pair that was rendered, and laws of particular pairs",
    "cli/furnace_command.py": "the names of BRDFs",
    "cli/compare_command.py": "the names of BRDFs",
    "measured/report.py": "the forms in which files store a lobe",
    "measured/brdf_fit.py": "Schlick's Fresnel factor",
    "distributions/dialects.py": "whose parameter a program stores",
    "scene/light.py": "what lights are described by",
    "scene/mitsuba/convert.py": "the target by default, of those that Mitsuba has",
    "scene/mitsuba/scene.py": "Mitsuba's distributions",
    "cli/mitsuba_command.py": "the target by default, of those that Mitsuba has",
    "scene/shininess.py": "the definition of Wavefront's Ns and Pr",
    "studies/bench.py": "the paper's sweep, and the kernel that is written in Dr.Jit",
    "cli/bench_command.py": "the pair that is measured by default",
    "cli/plot_error_command.py": "the paper's reference",
    "cli/fit_table_command.py": "the paper's reference",
}
SOURCES = sorted(PACKAGE.rglob("*.py"))
MODULES = [str(path.relative_to(PACKAGE)) for path in SOURCES]


def tree_of(module):
    return ast.parse((PACKAGE / module).read_text())


def imported(tree):
    """Yield the dotted names that a module imports, wherever in it."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def floor_of(name):
    return FLOORS.index(name.split(".")[1])


@pytest.mark.parametrize("module", [name for name in MODULES if "/" in name])
def test_imports_go_down(module):
    own = FLOORS.index(module.split("/")[0])
    for name in imported(tree_of(module)):
        parts = name.split(".")
        if parts[0] == "mdfconv" and len(parts) > 1 and parts[1] in FLOORS:
            assert floor_of(name) >= own, f"{module} imports {name}"
        if parts[0] in TERMINAL:
            assert FLOORS[own] == "cli", f"{module} imports {name}"


def test_every_room_has_a_floor():
    rooms = {name.split("/")[0].removesuffix(".py") for name in MODULES}
    assert rooms - {"__init__", "__main__"} == set(FLOORS)


def docstrings(tree):
    """Return the string nodes that are documentation."""
    kinds = (ast.Module, ast.ClassDef, ast.FunctionDef)
    return {
        id(node.body[0].value)
        for node in ast.walk(tree)
        if isinstance(node, kinds) and node.body and isinstance(node.body[0], ast.Expr)
    }


@pytest.mark.parametrize("module", [n for n in MODULES if not n.startswith("distributions/")])
def test_no_module_elsewhere_names_a_distribution(module):
    entries = mdfconv.list_distributions()
    names = {name for entry in entries for name in (entry.name, *entry.aliases)}
    names |= {f"{entry.name}:{encoding.name}" for entry in entries for encoding in entry.encodings}
    rooms = {type(entry).__module__ for entry in entries}
    tree = tree_of(module)
    documentation = docstrings(tree)
    named = {
        node.value
        for node in ast.walk(tree)
        if isinstance(node, ast.Constant) and node.value in names and id(node) not in documentation
    }
    opened = rooms & set(imported(tree))
    if module in ABOUT_PARTICULAR_ONES:
        assert named or opened, f"{module} names none any more: strike it from the list"
    else:
        assert not named
        assert not opened
