"""``mdfconv report``."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer


def command(
    output: Annotated[Path, typer.Option(metavar="DIR", help="Folder to write to.")] = Path(
        "reports"
    ),
) -> None:
    """Write every table and figure, and an index (README.md) that says what each one is.

    Examples:

    mdfconv report

    mdfconv report --output /tmp/mdfconv-report
    """
    from rich.console import Console
    from rich.progress import Progress

    from mdfconv.reports.build import COUNT, build

    written: list[str] = []
    err = Console(stderr=True)
    with Progress(console=err, transient=True, disable=not sys.stderr.isatty()) as bar:
        task = bar.add_task("Report", total=COUNT)
        for artefact in build(output):
            written += [str(output / name) for name in artefact.files]
            bar.advance(task)
    typer.echo("\n".join([*written, str(output / "README.md")]))
