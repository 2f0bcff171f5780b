"""The report folder: pages, their tables and pictures, and the index to them.

A new page is a template in ``pages/``, a function that returns its `PageFiles`, an entry in `PAGES`
and a row in ``pages/README.md``.
"""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass

from mdfconv.fitting.metrics import list_metrics
from mdfconv.output.files import file_bytes
from mdfconv.studies import paper_pages
from mdfconv.studies.fresnel import fresnel
from mdfconv.studies.furnace import furnace
from mdfconv.studies.importers_page import importers
from mdfconv.studies.lights_page import lights
from mdfconv.studies.methods_page import methods
from mdfconv.studies.pages import PageFiles, fill
from mdfconv.studies.stability import stability


@dataclass(frozen=True)
class Page:
    """A function that makes a page, and the names of the files whose contents it returns.

    Slow ones are begun first, so that no process ends long after the others.
    """

    make: Callable[[], PageFiles]
    files: Sequence[str]
    slow: bool = False


_BY_METRIC = [f"table2-{name}.{end}" for name in list_metrics()[1:] for end in ("md", "csv")]
PAGES = (
    Page(paper_pages.table2, ("table2.md", "table2.csv")),
    Page(paper_pages.table2_by_metric, _BY_METRIC),
    Page(paper_pages.closed_forms, ("closed-forms.md", "closed-forms.csv")),
    Page(paper_pages.errors, ("errors.md", "fig1.png", "fig1b.csv", "fig2.png", "fig2b.csv")),
    Page(paper_pages.pictures, ("pictures.md", "fig4.png", "fig4.csv", "fig5.png", "fig5.csv")),
    Page(paper_pages.comparison, ("comparison.html",)),
    Page(methods, ("methods.md", "methods.csv"), slow=True),
    Page(lights, ("lights.md", "lights.csv", "lights-constants.csv", "lights.png")),
    Page(importers, ("importers.md", "importers.csv", "importers.png")),
    Page(furnace, ("furnace.md", "furnace.csv", "furnace.png"), slow=True),
    Page(fresnel, ("fresnel.md", "fresnel.csv", "fresnel.png")),
    Page(stability, ("stability.md", "stability.csv"), slow=True),
)
INDEX = "README.md"


def build(advance: Callable[[int], None]) -> dict[str, bytes]:
    """Return the files of the report by their names; `advance` is called with 1 after each page."""
    files, figures = {}, {}
    for page, contents in zip(PAGES, made(PAGES), strict=True):
        for name, content in zip(page.files, contents.files, strict=True):
            files[name] = content if isinstance(content, bytes) else file_bytes(content)
        figures[page.make.__name__] = contents.figures
        advance(1)
    return files | {INDEX: file_bytes(fill("README", **figures))}


def made(pages: Sequence[Page], processes: int | None = None) -> Iterator[PageFiles]:
    """Yield the contents of pages in their order.

    `processes` make them, as many as there are processors by default; with 1 the caller's own.
    """
    count = processes or min(os.cpu_count() or 1, len(pages))
    if count == 1:
        yield from (page.make() for page in pages)
        return
    # An interrupt from a terminal reaches every process: those of the pool end at once, unheard.
    default = signal.SIGINT, signal.SIG_DFL
    pool = ProcessPoolExecutor(count, initializer=signal.signal, initargs=default)
    try:
        slowest_first = sorted(pages, key=lambda page: not page.slow)
        begun = {page.make: pool.submit(page.make) for page in slowest_first}
        for page in pages:
            yield begun[page.make].result()
    finally:
        pool.shutdown(cancel_futures=True)
