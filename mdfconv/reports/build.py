"""The report folder: every table and figure of the project, and the index to them.

A new artefact is a function that returns an `Artefact`, and one entry in `_ARTEFACTS`.
"""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import TypeAlias

from mdfconv.errors import MdfconvError
from mdfconv.output.files import file_bytes, write_files
from mdfconv.output.records import markdown_text
from mdfconv.reports import paper_pages
from mdfconv.reports.artefact import Artefact
from mdfconv.reports.fresnel_page import fresnel_page
from mdfconv.reports.furnace_page import furnace_page
from mdfconv.reports.importer_page import importer_page
from mdfconv.reports.interactive_page import interactive_page
from mdfconv.reports.lights_page import lights_page
from mdfconv.reports.method_page import method_page
from mdfconv.reports.stability_page import stability_page

_Make: TypeAlias = Callable[[], Artefact]

_ARTEFACTS: tuple[_Make, ...] = (
    paper_pages.table2,
    paper_pages.other_metrics,
    paper_pages.closed_forms,
    paper_pages.error_figures,
    paper_pages.pictures,
    interactive_page,
    method_page,
    lights_page,
    importer_page,
    furnace_page,
    fresnel_page,
    stability_page,
)
COUNT = len(_ARTEFACTS)
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


def build(folder: Path, processes: int | None = None) -> Iterator[Artefact]:
    """Write the report into a folder, yielding each artefact as it is written.

    Parameters
    ----------
    folder : Path
        Created if its parent exists.
    processes : int, optional
        How many make artefacts at a time; as many as there are processors by default. With 1
        all are made in the caller's own.

    Raises
    ------
    MdfconvError
        If the folder cannot be written.
    """
    try:
        folder.mkdir(exist_ok=True)
    except OSError as error:
        raise MdfconvError(f"cannot create {folder}: {error.strerror}") from None
    artefacts = []
    for artefact in _made(processes or min(os.cpu_count() or 1, COUNT)):
        write_files({folder / name: content for name, content in artefact.files.items()})
        artefacts.append(artefact)
        yield artefact
    artefacts += [other for other in _MADE_ELSEWHERE if (folder / min(other.files)).exists()]
    write_files({folder / "README.md": file_bytes(_index(artefacts))})


def _made(processes: int) -> Iterator[Artefact]:
    """Yield the artefacts in the order of the index."""
    if processes == 1:
        yield from (make() for make in _ARTEFACTS)
        return
    # An interrupt from a terminal reaches every process: those of the pool end at once, unheard.
    pool = ProcessPoolExecutor(
        processes, initializer=signal.signal, initargs=(signal.SIGINT, signal.SIG_DFL)
    )
    try:
        begun = {make: pool.submit(make) for make in dict.fromkeys([*_LONGEST, *_ARTEFACTS])}
        for make in _ARTEFACTS:
            yield begun[make].result()
    finally:
        pool.shutdown(cancel_futures=True)


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
