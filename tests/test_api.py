"""What a user finds: the names of the package, their documentation, and those that are promised."""

import importlib
import inspect
import pydoc
import re
import subprocess
import sys
from pathlib import Path

import pytest

import mdfconv

ROOT = Path(__file__).parents[1]
DOCUMENTS = "README.md", "CONTRIBUTING.md"
DOTTED = sorted(
    {
        name
        for document in DOCUMENTS
        for name in re.findall(r"\bmdfconv(?:\.[A-Za-z_]\w*)+", (ROOT / document).read_text())
    }
)
CALLABLE = sorted(name for name in mdfconv.__all__ if callable(getattr(mdfconv, name)))
PACKAGES = sorted(path.parent.name for path in (ROOT / "mdfconv").glob("*/__init__.py"))


def test_few_names_are_public():
    assert dir(mdfconv) == sorted(mdfconv.__all__)
    assert len(mdfconv.__all__) <= 25
    assert {"convert", "explain", "distribution", "list_metrics", "register"} <= {*CALLABLE}
    page = pydoc.plain(pydoc.render_doc(mdfconv))
    for name in CALLABLE:
        assert name in page


def test_every_public_name_has_a_home():
    homes = {name for names in mdfconv._ROOMS.values() for name in names}
    assert homes | {"__version__"} == set(mdfconv.__all__)
    assert "nothing" not in dir(mdfconv)
    with pytest.raises(AttributeError, match="'mdfconv' has no attribute 'nothing'"):
        _ = mdfconv.nothing


def test_fits_are_found_in_their_package():
    assert mdfconv.fitting.fit.__module__ == "mdfconv.fitting.solve"
    assert all(callable(getattr(mdfconv.fitting, name)) for name in mdfconv.fitting.__all__)
    assert dir(mdfconv.fitting) == sorted(mdfconv.fitting.__all__)


def test_both_forms_of_a_distribution_name_their_options():
    for form in (mdfconv.Distribution.unit, mdfconv.Distribution.normalized):
        names = list(inspect.signature(form).parameters)
        assert names == ["self", "beta", "parameter", "phi", "gamma", "variable", "threads"]


@pytest.mark.parametrize("name", CALLABLE)
def test_public_names_are_documented(name):
    documentation = inspect.getdoc(getattr(mdfconv, name))
    assert re.match(r"[A-Z].*[.:]$", documentation.splitlines()[0])
    if inspect.isclass(getattr(mdfconv, name)) and issubclass(getattr(mdfconv, name), Warning):
        return
    signature = inspect.signature(getattr(mdfconv, name))
    if signature.parameters:
        assert "Parameters\n----------" in documentation
        for parameter in signature.parameters:
            assert re.search(rf"\b{parameter}\b", documentation), parameter
    if inspect.isfunction(getattr(mdfconv, name)) and signature.return_annotation != "None":
        assert "Returns\n-------" in documentation or documentation.startswith("Return ")
    source = inspect.getsource(getattr(mdfconv, name))
    if re.search(r"^    raise MdfconvError", source, re.M):
        assert "Raises\n------" in documentation


@pytest.mark.parametrize("name", DOTTED)
def test_a_name_in_the_documents_is_one(name):
    """Reached from `import mdfconv` alone, but for modules of a package, which are imported."""
    found = mdfconv
    for index, part in enumerate(name.split(".")[1:], start=2):
        if not hasattr(found, part):
            importlib.import_module(".".join(name.split(".")[:index]))
        found = getattr(found, part)


def test_there_are_names_in_the_documents():
    assert {"mdfconv.convert", "mdfconv.convert_texture", "mdfconv.brdf.Microsurface"} <= {*DOTTED}


@pytest.mark.parametrize("package", PACKAGES)
def test_packages_are_reached_without_an_import(package):
    assert inspect.ismodule(getattr(mdfconv, package))


def test_nothing_is_imported_before_it_is_asked_for():
    code = (
        "import sys, mdfconv; before = set(sys.modules); mdfconv.scene.convert_texture;"
        "print('numpy' in before, [n for n in before if n.startswith('mdfconv.')])"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT
    )
    assert done.stdout == "False []\n"
