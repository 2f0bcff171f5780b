"""The report folder: pages, their tables and pictures, and the index to them.

A new page is a template in ``pages/``, a function that returns its `PageFiles`, an entry in `PAGES`
and a row in ``pages/README.md``.
"""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, wait
from dataclasses import dataclass
from multiprocessing import SimpleQueue

from mdfconv.fitting.metrics import list_metrics
from mdfconv.output.files import file_bytes
from mdfconv.studies import paper_pages
from mdfconv.studies.fresnel import fresnel
from mdfconv.studies.furnace import furnace
from mdfconv.studies.importers_page import importers
from mdfconv.studies.lights_page import lights
from mdfconv.studies.methods_page import methods
from mdfconv.studies.pages import PageFiles, fill, heard_by
from mdfconv.studies.stability import stability


@dataclass(frozen=True)
class Page:
    """A function that makes a page, and the names of the files whose contents it returns.

    `work` is about its time, in tenths of a second. What takes longest is begun first, so that no
    process ends long after the others.
    """

    make: Callable[[], PageFiles]
    files: Sequence[str]
    work: int = 1

    def made(self, tell: Callable[[float], None]) -> PageFiles:
        """Return the contents; `tell` hears of each part of the work, and of the whole in all."""
        parts = []

        def hear(share: float) -> None:
            parts.append(share * self.work)
            tell(parts[-1])

        with heard_by(hear):
            contents = self.make()
        tell(self.work - sum(parts))
        return contents


_BY_METRIC = [f"table2-{name}.{end}" for name in list_metrics()[1:] for end in ("md", "csv")]
PAGES = (
    Page(paper_pages.table2, ("table2.md", "table2.csv")),
    Page(paper_pages.table2_by_metric, _BY_METRIC),
    Page(paper_pages.closed_forms, ("closed-forms.md", "closed-forms.csv"), 2),
    Page(paper_pages.errors, ("errors.md", "fig1.png", "fig1b.csv", "fig2.png", "fig2b.csv"), 12),
    Page(paper_pages.pictures, ("pictures.md", "fig4.png", "fig4.csv", "fig5.png", "fig5.csv"), 25),
    Page(paper_pages.comparison, ("comparison.html",), 15),
    Page(methods, ("methods.md", "methods.csv"), 23),
    Page(lights, ("lights.md", "lights.csv", "lights-constants.csv", "lights.png"), 15),
    Page(importers, ("importers.md", "importers.csv", "importers.png"), 12),
    Page(furnace, ("furnace.md", "furnace.csv", "furnace.png"), 35),
    Page(fresnel, ("fresnel.md", "fresnel.csv", "fresnel.png"), 4),
    Page(stability, ("stability.md", "stability.csv"), 28),
)
WORK = sum(page.work for page in PAGES)
INDEX = "README.md"
# How often processes are listened to, seconds.
_LISTENING = 0.05


def build(advance: Callable[[float], None]) -> dict[str, bytes]:
    """Return the files of the report by their names; `advance` hears of work, in all `WORK`."""
    files, figures = {}, {}
    for page, contents in zip(PAGES, made(PAGES, advance), strict=True):
        for name, content in zip(page.files, contents.files, strict=True):
            files[name] = content if isinstance(content, bytes) else file_bytes(content)
        figures[page.make.__name__] = contents.figures
    return files | {INDEX: file_bytes(fill("README", **figures))}


def made(
    pages: Sequence[Page], advance: Callable[[float], None], processes: int | None = None
) -> Iterator[PageFiles]:
    """Yield the contents of pages in their order; `advance` hears of their work.

    `processes` make them, as many as there are processors by default; with 1 the caller's own.
    """
    count = processes or min(os.cpu_count() or 1, len(pages))
    if count == 1:
        yield from (page.made(advance) for page in pages)
        return
    heard: SimpleQueue[float] = SimpleQueue()
    pool = ProcessPoolExecutor(count, initializer=_begin, initargs=(heard,))
    longest_first = sorted(pages, key=lambda page: -page.work)
    try:
        begun = {page.make: pool.submit(_made, page) for page in longest_first}
        for page in pages:
            while wait([begun[page.make]], _LISTENING).not_done or not heard.empty():
                while not heard.empty():
                    advance(heard.get())
            yield begun[page.make].result()
    finally:
        pool.shutdown(cancel_futures=True)


# Of a process of the pool: what hears of its work.
_process: dict[str, SimpleQueue[float]] = {}


def _begin(heard: SimpleQueue[float]) -> None:
    """Begin a process of the pool."""
    # An interrupt from a terminal reaches every process: those of the pool end at once, unheard.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    _process["heard"] = heard


def _made(page: Page) -> PageFiles:
    return page.made(_process["heard"].put)
