"""The report folder: what is committed is what the code makes, and the same twice."""

import multiprocessing
import shutil
from pathlib import Path

import pytest
from matplotlib.figure import Figure

from mdfconv.errors import MdfconvError
from mdfconv.studies.report import build as report
from mdfconv.studies.report.build import ELSEWHERE, FILES, build, report_files
from mdfconv.studies.report.paper_pages import closed_forms, other_metrics, table2
from tests.cli.runner import run

REPORTS = Path(__file__).parents[2] / "reports"

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The report, built here, without its pictures: the command draws them."""
    path = tmp_path_factory.mktemp("report")
    for name in ELSEWHERE:
        shutil.copy(REPORTS / name, path)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Figure, "savefig", lambda figure, file, **options: file.write(b"a picture"))
        for name, content in report_files(list(build(processes=1)), ELSEWHERE).items():
            (path / name).write_bytes(content)
    return path


def test_report_is_what_the_code_makes(folder):
    names = {path.name for path in folder.iterdir()}
    assert names == {path.name for path in REPORTS.iterdir()} == {*FILES, *ELSEWHERE}
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
    status, _, err = run("report", "--output", tmp_path, PYTHONHASHSEED="1")
    assert status == 0
    assert "README.md" in err
    files = [path for path in tmp_path.iterdir() if path.suffix in (".csv", ".md", ".html")]
    assert len(files) > 15
    for path in files:
        if path.name != "README.md":
            assert path.read_bytes() == (folder / path.name).read_bytes()
    # The index here lists what another command measured, too.
    lines = (folder / "README.md").read_text().splitlines()
    own = [line for line in lines if not any(f"[{name}]" in line for name in ELSEWHERE)]
    assert (tmp_path / "README.md").read_text().splitlines() == own


def test_a_folder_that_cannot_be(tmp_path):
    status, _, err = run("report", "--output", tmp_path / "no" / "folder")
    assert status == 2
    assert "cannot create" in err


def refuse():
    raise MdfconvError("no such light", "there are two", argument="light")


@pytest.mark.parametrize("processes", [1, 2])
def test_an_artefact_that_cannot_be(processes, monkeypatch):
    monkeypatch.setattr(report, "_LONGEST", ())
    monkeypatch.setattr(report, "_ARTEFACTS", (table2, refuse, closed_forms))
    made = build(processes)
    assert "table2.csv" in next(made).files
    with pytest.raises(MdfconvError, match="no such light; there are two") as caught:
        next(made)
    assert caught.value.argument == "light"
    assert multiprocessing.active_children() == []


def test_processes_take_turns_and_keep_the_order(monkeypatch):
    monkeypatch.setattr(report, "_LONGEST", (table2,))
    monkeypatch.setattr(report, "_ARTEFACTS", (other_metrics, table2))
    made = list(build(2))
    assert [next(iter(artefact.files)) for artefact in made] == ["table2-energy.csv", "table2.csv"]
    index = report_files(made, [])["README.md"].decode()
    assert index.index("table2-energy.csv") < index.index("[table2.csv]")
