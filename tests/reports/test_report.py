"""The report folder: what is committed is what the code makes, and the same twice."""

import shutil
from pathlib import Path

import pytest
from matplotlib.figure import Figure

from mdfconv.reports.build import MEASURED, build
from tests.cli.runner import run

REPORTS = Path(__file__).parents[2] / "reports"

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The report, built here, without its pictures: the command draws them."""
    path = tmp_path_factory.mktemp("report")
    for name in MEASURED:
        shutil.copy(REPORTS / name, path)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Figure, "savefig", lambda figure, file, **options: file.write(b"a picture"))
        for _ in build(path):
            pass
    return path


def test_report_is_what_the_code_makes(folder):
    names = {path.name for path in folder.iterdir()}
    assert names == {path.name for path in REPORTS.iterdir()}
    for path in sorted(folder.iterdir()):
        if path.suffix in (".csv", ".md"):
            # The orders of magnitude of rounding errors depend on the processor.
            rel = 9.5 if path.name.startswith("stability") else 1e-4
            compare_text(path.read_text(), (REPORTS / path.name).read_text(), path.name, rel)


def compare_text(ours, committed, name, rel):
    """Compare word by word, numbers to 1e-4 or so: another machine may round otherwise."""
    words = [text.replace(",", " ").split() for text in (ours, committed)]
    assert len(words[0]) == len(words[1]), name
    for one, other in zip(*words, strict=True):
        if one == other:
            continue
        try:
            numbers = float(one), float(other)
        except ValueError:
            pytest.fail(f"{name}: {one} is not {other}")
        assert numbers[0] == pytest.approx(numbers[1], rel=rel, abs=1e-12), name


def test_report_is_the_same_twice(folder, tmp_path):
    # A new interpreter, with an order of sets of its own.
    status, out, _ = run("report", "--output", tmp_path, PYTHONHASHSEED="1")
    assert status == 0
    assert "README.md" in out
    files = [path for path in tmp_path.iterdir() if path.suffix in (".csv", ".md")]
    assert len(files) > 15
    for path in files:
        if path.name != "README.md":
            assert path.read_bytes() == (folder / path.name).read_bytes()
    # The index here lists what another command measured, too.
    lines = (folder / "README.md").read_text().splitlines()
    own = [line for line in lines if "speed-error" not in line]
    assert (tmp_path / "README.md").read_text().splitlines() == own


def test_a_folder_that_cannot_be(tmp_path):
    status, _, err = run("report", "--output", tmp_path / "no" / "folder")
    assert status == 2
    assert "cannot create" in err
