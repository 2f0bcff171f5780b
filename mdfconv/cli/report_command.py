"""``mdfconv report``."""

from __future__ import annotations

from pathlib import Path

from mdfconv.cli.options import FolderOption
from mdfconv.cli.tables import progress, tell


def command(
    output: FolderOption = None,
) -> None:
    """Write every table and figure, and an index (README.md) that says what each one is.

    Examples:

    mdfconv report

    mdfconv report --output /tmp/mdfconv-report
    """
    from mdfconv.reports.build import COUNT, build

    folder = output or Path("reports")
    written: list[str] = []
    with progress("Report", COUNT) as advance:
        for artefact in build(folder):
            written += artefact.files
            advance(1)
    for name in (*written, "README.md"):
        tell(f"wrote {folder / name}")
