"""The report folder: every table and figure of the project, and the index to them.

A new artefact is a function that returns an `Artefact`, and one entry in `_ARTEFACTS`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from mdfconv.errors import MdfconvError
from mdfconv.output.files import file_bytes, write_files
from mdfconv.output.records import markdown_text
from mdfconv.reports import paper_pages
from mdfconv.reports.artefact import Artefact
from mdfconv.reports.fresnel_page import fresnel_page
from mdfconv.reports.furnace_page import furnace_page
from mdfconv.reports.importer_page import importer_page
from mdfconv.reports.lights_page import lights_page
from mdfconv.reports.method_page import method_page
from mdfconv.reports.stability_page import stability_page

_ARTEFACTS: tuple[Callable[[], Artefact], ...] = (
    paper_pages.table2,
    paper_pages.other_metrics,
    paper_pages.closed_forms,
    paper_pages.error_figures,
    paper_pages.pictures,
    method_page,
    lights_page,
    importer_page,
    furnace_page,
    fresnel_page,
    stability_page,
)
COUNT = len(_ARTEFACTS)
# Times cannot be reproduced: these are made by `mdfconv bench`, and only listed here.
MEASURED = ("speed-error.md", "speed-error.csv", "speed-error.png")


def build(folder: Path) -> Iterator[Artefact]:
    """Write the report into a folder, yielding each artefact as it is written.

    Parameters
    ----------
    folder : Path
        Created if its parent exists.

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
    for make in _ARTEFACTS:
        artefact = make()
        write_files({folder / name: content for name, content in artefact.files.items()})
        artefacts.append(artefact)
        yield artefact
    measured = [name for name in MEASURED if (folder / name).exists()]
    write_files({folder / "README.md": file_bytes(_index(artefacts, measured))})


def _index(artefacts: Sequence[Artefact], measured: Sequence[str]) -> str:
    """Return the index; `measured` are files in the folder that another command made."""
    rows = [
        {
            "files": _links(artefact.files),
            "reproduces": artefact.reproduces,
            "agreement": artefact.agreement,
            "command": f"`{artefact.command}`",
        }
        for artefact in artefacts
    ]
    if measured:
        rows.append(
            {
                "files": _links(measured),
                "reproduces": "speed against error: what the choices cost",
                "agreement": "measured on one machine; other machines give other times",
                "command": "`mdfconv bench`",
            }
        )
    return "\n".join(
        [
            "# Report",
            "",
            "Everything that mdfconv reproduces or shows, made by `mdfconv report`.",
            "",
            markdown_text(["files", "reproduces", "agreement", "command"], rows),
        ]
    )


def _links(names: Sequence[str] | dict[str, bytes]) -> str:
    return ", ".join(f"[{name}]({name})" for name in names)
