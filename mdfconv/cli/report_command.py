"""``mdfconv report``."""

from __future__ import annotations

import typer

from mdfconv.cli.options import FolderOption, ForceOption
from mdfconv.cli.outputs import Outputs, check_folder
from mdfconv.cli.tables import progress


def command(
    context: typer.Context,
    output: FolderOption = None,
    force: ForceOption = False,
) -> None:
    """Write every table and figure, and an index (README.md) that says what each one is.

    Examples:

    mdfconv report

    mdfconv report --output /tmp/mdfconv-report
    """
    from mdfconv.studies.report.build import COUNT, ELSEWHERE, FILES, build, report_files

    folder = check_folder(context, output)
    outputs = Outputs(*(folder / name for name in FILES), force=force)
    artefacts = []
    with progress("Report", COUNT) as advance:
        for artefact in build():
            artefacts.append(artefact)
            advance(1)
    present = [name for name in ELSEWHERE if (folder / name).exists()]
    files = report_files(artefacts, present)
    outputs.write({folder / name: content for name, content in files.items()})
