"""The report folder: every table and figure of the project, and the index to them.

A new artefact is a function that returns an `Artefact`, and one entry in `_ARTEFACTS`
with the names of its files.
"""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from typing import TypeAlias

from mdfconv.fitting.metrics import list_metrics
from mdfconv.output.files import file_bytes
from mdfconv.output.records import markdown_text
from mdfconv.studies.report import paper_pages
from mdfconv.studies.report.artefact import Artefact
from mdfconv.studies.report.fresnel_page import fresnel_page
from mdfconv.studies.report.furnace_page import furnace_page
from mdfconv.studies.report.importer_page import importer_page
from mdfconv.studies.report.interactive_page import interactive_page
from mdfconv.studies.report.lights_page import lights_page
from mdfconv.studies.report.method_page import method_page
from mdfconv.studies.report.stability_page import stability_page

_Make: TypeAlias = Callable[[], Artefact]

# With the names of their files, so that one that is there is found before minutes of work.
_ARTEFACTS: Mapping[_Make, tuple[str, ...]] = {
    paper_pages.table2: ("table2.csv", "table2.md"),
    paper_pages.other_metrics: tuple(
        f"table2-{metric}.{end}" for metric in list_metrics()[1:] for end in ("csv", "md")
    ),
    paper_pages.closed_forms: ("closed-forms.csv", "closed-forms.md"),
    paper_pages.error_figures: ("fig1.png", "fig1b.csv", "fig2.png", "fig2b.csv", "errors.md"),
    paper_pages.pictures: ("fig4.png", "fig4.csv", "fig5.png", "fig5.csv", "pictures.md"),
    interactive_page: ("comparison.html",),
    method_page: ("methods.csv", "methods.md"),
    lights_page: ("lights.md", "lights.csv", "lights-constants.csv", "lights.png"),
    importer_page: ("importers.csv", "importers.md", "importers.png"),
    furnace_page: ("furnace.csv", "furnace.md", "furnace.png"),
    fresnel_page: ("fresnel.csv", "fresnel.md", "fresnel.png"),
    stability_page: ("stability.csv", "stability.md"),
}
COUNT = len(_ARTEFACTS)
INDEX = "README.md"
FILES = (*(name for names in _ARTEFACTS.values() for name in names), INDEX)
# They are begun first, so that no process ends long after the others.
_LONGEST = (furnace_page, stability_page, method_page)
# Neither times nor a browser's picture can be reproduced: these are only listed here.
_MADE_ELSEWHERE = (
    Artefact(
        dict.fromkeys(("speed-error.md", "speed-error.csv", "speed-error.png"), b""),
        "speed against error: what the choices cost",
        "measured on one machine; other machines give other times",
        "mdfconv bench",
    ),
    Artefact(
        {"comparison.png": b""},
        "comparison.html in a browser",
        "a picture of the page as it opens",
        "make screenshot",
    ),
)
ELSEWHERE = tuple(name for artefact in _MADE_ELSEWHERE for name in artefact.files)


def build(processes: int | None = None) -> Iterator[Artefact]:
    """Yield the artefacts in the order of the index.

    Parameters
    ----------
    processes : int, optional
        How many make artefacts at a time; as many as there are processors by default. With 1
        all are made in the caller's own.
    """
    count = processes or min(os.cpu_count() or 1, COUNT)
    if count == 1:
        yield from (make() for make in _ARTEFACTS)
        return
    # An interrupt from a terminal reaches every process: those of the pool end at once, unheard.
    pool = ProcessPoolExecutor(
        count, initializer=signal.signal, initargs=(signal.SIGINT, signal.SIG_DFL)
    )
    try:
        begun = {make: pool.submit(make) for make in dict.fromkeys([*_LONGEST, *_ARTEFACTS])}
        for make in _ARTEFACTS:
            yield begun[make].result()
    finally:
        pool.shutdown(cancel_futures=True)


def report_files(artefacts: Sequence[Artefact], present: Collection[str]) -> dict[str, bytes]:
    """Return the files of the report by their names; the index lists what is there, too."""
    files = {name: content for each in artefacts for name, content in each.files.items()}
    there = [other for other in _MADE_ELSEWHERE if set(other.files) <= set(present)]
    return {**files, INDEX: file_bytes(_index([*artefacts, *there]))}


def _index(artefacts: Sequence[Artefact]) -> str:
    """Return the index."""
    rows = [
        {
            "files": _links(artefact.files),
            "reproduces": artefact.reproduces,
            "agreement": artefact.agreement,
            "command": f"`{artefact.command}`",
        }
        for artefact in artefacts
    ]
    return "\n".join(
        [
            "# Report",
            "",
            "Everything that mdfconv reproduces or shows, made by `mdfconv report`.",
            "",
            markdown_text(["files", "reproduces", "agreement", "command"], rows),
        ]
    )


def _links(names: Iterable[str]) -> str:
    return ", ".join(f"[{name}]({name})" for name in names)
