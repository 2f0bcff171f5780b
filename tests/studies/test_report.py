"""The report folder: what is committed is what the code makes, and the same twice."""

import multiprocessing
import os
from pathlib import Path

import pytest
from matplotlib.figure import Figure

from mdfconv.errors import MdfconvError
from mdfconv.studies.pages import PageFiles, tracked
from mdfconv.studies.paper_pages import closed_forms, table2, table2_by_metric
from mdfconv.studies.report import INDEX, PAGES, Page, build, made
from tests.cli.runner import run

REPORTS = Path(__file__).parents[2] / "reports"
# What other commands make.
ELSEWHERE = ("speed-error.md", "speed-error.csv", "speed-error.png", "comparison.png")

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The report, built here, without its pictures: the command draws them."""
    path = tmp_path_factory.mktemp("report")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(os, "cpu_count", lambda: 1)
        patch.setattr(Figure, "savefig", lambda figure, file, **options: file.write(b"a picture"))
        for name, content in build(lambda work: None).items():
            (path / name).write_bytes(content)
    return path


def test_report_is_what_the_code_makes(folder):
    names = {path.name for path in folder.iterdir()}
    assert names == {path.name for path in REPORTS.iterdir()} - set(ELSEWHERE)
    assert names == {INDEX, *(name for page in PAGES for name in page.files)}
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
        assert path.read_bytes() == (folder / path.name).read_bytes()


def test_a_folder_that_cannot_be(tmp_path):
    status, _, err = run("report", "--output", tmp_path / "no" / "folder")
    assert status == 2
    assert "cannot create" in err


def refuse():
    raise MdfconvError("no such light", "there are two", argument="light")


@pytest.mark.parametrize("processes", [1, 2])
def test_a_page_that_cannot_be(processes):
    pages = made([Page(table2, ()), Page(refuse, ()), Page(closed_forms, ())], print, processes)
    assert "# Table 2" in next(pages).files[0]
    with pytest.raises(MdfconvError, match="no such light; there are two") as caught:
        next(pages)
    assert caught.value.argument == "light"
    assert multiprocessing.active_children() == []


def parts():
    for _ in tracked("abcd"):
        pass
    return PageFiles(["parts"], {})


@pytest.mark.parametrize("processes", [1, 2])
def test_the_bar_hears_of_parts_and_of_all_work(processes):
    heard = []
    pages = [Page(parts, (), 10), Page(table2, (), 3)]
    assert [page.files[0][:5] for page in made(pages, heard.append, processes)] == [
        "parts", "# Tab",
    ]  # fmt: skip
    assert sorted(heard) == [0, 2.5, 2.5, 2.5, 2.5, 3]
    assert list(tracked([1, 2])) == [1, 2]


def test_what_is_heard_of_the_report_is_its_work(monkeypatch):
    """No page says that more than the whole of it is done."""
    monkeypatch.setattr(Figure, "savefig", lambda figure, file, **options: file.write(b"a picture"))
    for page in PAGES:
        heard = []
        page.made(heard.append)
        assert min(heard) > -1e-9
        assert sum(heard) == pytest.approx(page.work)


def test_processes_take_turns_and_keep_the_order():
    contents = made([Page(table2_by_metric, ()), Page(table2, (), 9)], print, 2)
    titles = [each.files[0].splitlines()[0] for each in contents]
    assert titles == [
        "# Table 2 under the energy metric",
        "# Table 2 of Sawicki 2021, recomputed",
    ]
