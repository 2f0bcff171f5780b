"""``mdfconv report``."""

from __future__ import annotations

import typer

from mdfconv.cli.options import FolderOption, ForceOption
from mdfconv.cli.outputs import Outputs, check_folder
from mdfconv.cli.tables import progress


def command(
    context: typer.Context, output: FolderOption = None, force: ForceOption = False
) -> None:
    """Write every table and figure, and an index (README.md) that says what each one is.

    Examples:

    mdfconv report

    mdfconv report --output /tmp/mdfconv-report
    """
    from mdfconv.studies.report import INDEX, PAGES, WORK, build

    folder = check_folder(context, output)
    names = [name for page in PAGES for name in page.files] + [INDEX]
    # What exists is found before minutes of work.
    outputs = Outputs(*(folder / name for name in names), force=force)
    with progress("Report", WORK) as advance:
        files = build(advance)
    outputs.write({folder / name: content for name, content in files.items()})
