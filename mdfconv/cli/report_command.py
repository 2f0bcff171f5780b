"""``mdfconv report``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from mdfconv.cli.output import progress


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
    from mdfconv.reports.build import COUNT, build

    written: list[str] = []
    with progress("Report", COUNT) as advance:
        for artefact in build(output):
            written += [str(output / name) for name in artefact.files]
            advance(1)
    typer.echo("\n".join([*written, str(output / "README.md")]))
