"""The house: imports go down only, and what is true of a distribution stands in its class.

Each test goes through all modules, and names everything that is wrong at once.
"""

import ast
import re
from collections import defaultdict
from pathlib import Path

import mdfconv

PACKAGE = Path(mdfconv.__file__).parent
# From the roof to the ground; a module imports from its own floor and those beneath. Above the
# product are only the command line and what studies it.
FLOORS = (
    "cli", "studies", "scene", "render", "recommend", "formula", "measured", "conversion", "brdf",
    "fitting", "light", "output", "timing", "distributions", "registry", "errors",
)  # fmt: skip
# What speaks to a terminal stands on the roof, alone.
TERMINAL = {"typer", "rich", "click"}
# Modules that may name distributions, because they are about those particular ones.
ABOUT_PARTICULAR_ONES = {
    "conversion/methods.py": "the formulas of Sawicki 2021 and the rule of Ward 1996",
    "studies/table2.py": "the columns of the paper's table, and its formulas",
    "studies/error_curves.py": "the paper's figures",
    "studies/paper_pages.py": "the paper's prose",
    "render/comparison.py": "the names of BRDFs",
    "studies/furnace.py": "the definitions of BRDFs",
    "brdf/reflection.py": "the definitions of BRDFs",
    "brdf/microfacet.py": "the sampler of Heitz 2018, which is that of an ellipsoid",
    "studies/lights_page.py": "the pair that was rendered, and laws of particular pairs",
    "cli/furnace_command.py": "the names of BRDFs",
    "cli/compare_command.py": "the names of BRDFs",
    "measured/model.py": "the mixture of two GGX lobes",
    "measured/materials.py": "the distributions of renderers and of material libraries",
    "scene/light.py": "what lights are described by",
    "scene/mitsuba/convert.py": "the target by default, of those that Mitsuba has",
    "scene/mitsuba/scene.py": "Mitsuba's distributions",
    "cli/mitsuba_command.py": "the target by default, of those that Mitsuba has",
    "scene/shininess.py": "the definition of Wavefront's Ns and Pr",
    "studies/bench.py": "the paper's sweep",
    "cli/bench_command.py": "the pair that is measured by default",
    "cli/plot_error_command.py": "the paper's reference",
    "cli/fit_table_command.py": "the paper's reference",
}
# Modules outside the command line that may quote options, each with the reason.
QUOTES_OPTIONS: dict[str, str] = {}
# The pages of studies say by which commands they are made.
QUOTING_WING = "studies/"
OPTION = re.compile(r"(?<![\w-])--[a-z]")
FACES = {"__init__.py", "__main__.py"}
TREES = {
    str(path.relative_to(PACKAGE)): ast.parse(path.read_text(encoding="utf-8"))
    for path in sorted(PACKAGE.rglob("*.py"))
}


def room_of(module):
    return module.split("/")[0].removesuffix(".py")


def imported(tree):
    """Yield the dotted names that a module imports, wherever in it."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def imported_rooms(tree):
    """Return the rooms of the package that a module imports from."""
    names = (name.split(".") for name in imported(tree))
    return {parts[1] for parts in names if parts[0] == "mdfconv" and len(parts) > 1} & set(FLOORS)


def texts(tree):
    """Yield the strings of a module that are not documentation."""
    kinds = (ast.Module, ast.ClassDef, ast.FunctionDef)
    documentation = {
        id(node.body[0].value)
        for node in ast.walk(tree)
        if isinstance(node, kinds) and node.body and isinstance(node.body[0], ast.Expr)
    }
    for node in ast.walk(tree):
        is_text = isinstance(node, ast.Constant) and isinstance(node.value, str)
        if is_text and id(node) not in documentation:
            yield node.value


def test_every_room_has_a_floor():
    assert {room_of(module) for module in TREES if module not in FACES} == set(FLOORS)


def test_imports_go_down():
    climbing = [
        f"{module} imports from {room}"
        for module, tree in TREES.items()
        if module not in FACES
        for room in sorted(imported_rooms(tree))
        if FLOORS.index(room) < FLOORS.index(room_of(module))
    ]
    assert climbing == []


def test_the_product_imports_no_study():
    """Only the command line, whose commands some studies are, knows of the other wing."""
    studying = [
        module
        for module, tree in TREES.items()
        if room_of(module) not in ("cli", "studies") and "studies" in imported_rooms(tree)
    ]
    assert studying == []


def test_only_the_command_line_speaks_to_a_terminal():
    speaking = [
        f"{module} imports {name}"
        for module, tree in TREES.items()
        if room_of(module) != "cli"
        for name in imported(tree)
        if name.split(".")[0] in TERMINAL
    ]
    assert speaking == []


def test_options_are_spoken_of_on_the_command_line_only():
    quoting = {
        module
        for module, tree in TREES.items()
        if room_of(module) != "cli" and any(map(OPTION.search, texts(tree)))
    }
    quoting = {module for module in quoting if not module.startswith(QUOTING_WING)}
    assert quoting - QUOTES_OPTIONS.keys() == set()
    no_more = QUOTES_OPTIONS.keys() - quoting
    assert no_more == set(), "these quote none any more: strike them from the list"


def test_no_class_name_is_taken_twice():
    homes = defaultdict(list)
    for module, tree in TREES.items():
        for node in ast.walk(tree):
            if isinstance(node, ast.ClassDef):
                homes[node.name.lstrip("_")].append(module)
    assert {name: modules for name, modules in homes.items() if len(modules) > 1} == {}


def test_no_module_elsewhere_names_a_distribution():
    entries = mdfconv.list_distributions()
    names = {name for entry in entries for name in (entry.name, *entry.aliases)}
    names |= {f"{entry.name}:{encoding.name}" for entry in entries for encoding in entry.encodings}
    modules = {type(entry).__module__ for entry in entries}
    naming = {
        module: sorted((names & set(texts(tree))) | (modules & set(imported(tree))))
        for module, tree in TREES.items()
        if room_of(module) != "distributions"
    }
    naming = {module: found for module, found in naming.items() if found}
    unexpected = {module: naming[module] for module in naming.keys() - ABOUT_PARTICULAR_ONES.keys()}
    assert unexpected == {}
    no_more = sorted(ABOUT_PARTICULAR_ONES.keys() - naming.keys())
    assert no_more == [], "these name none any more: strike them from the list"
