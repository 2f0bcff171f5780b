"""What the commands that convert files of materials share: all but what a material is."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from mdfconv.cli.options import flag, option
from mdfconv.cli.process import tell
from mdfconv.cli.tables import ROWS_SHOWN, print_table
from mdfconv.errors import MdfconvError
from mdfconv.output.kinds import refuse_foreign
from mdfconv.output.records import json_text

if TYPE_CHECKING:
    from mdfconv.fitting.metrics import Metric
    from mdfconv.scene.material_files import Destination, FileConversion
    from mdfconv.scene.stored import MaterialProblem, ProblemKind

Rows = list[dict[str, Any]]

# Two milliseconds a row: of a hundred thousand materials the report is not to take the time.
MATERIALS_SHOWN = 100
_JSON = "--format json"
# What JSON has of a file, in this order.
_KEYS = (
    "file", "output", "writer", "from", "why", "to", "target", "metric", "count", "materials",
    "texels", "textures", "includes", "problems", "notes",
)  # fmt: skip


# The forms of the report on what was converted.
ReportFormat = Literal["table", "json"]
ResultOption = Annotated[
    str | None,
    option("OUT", "File, or a folder: one that exists, or out/ with a slash.", "--output", "-o"),
]
InPlaceOption = Annotated[
    bool, flag("--in-place", "Change the file itself; the original is kept as .bak.")
]
ReportFormatOption = Annotated[
    ReportFormat,
    typer.Option("--format", help="Report: table on standard error or json on standard output."),
]


@dataclass(frozen=True, kw_only=True)
class MaterialReport:
    """How a command reports what it converted.

    Parameters
    ----------
    form : ReportFormat
        A table, or JSON.
    metric : Metric
        What the conversions keep.
    details : callable
        From a conversion to what not every command has of it, by key.
    headings : mapping of str to str
        The fields of a material that the table shows, where there are such, and their headings.
    secondary : sequence of str
        As for `print_table`.
    place : str
        What JSON calls the place of a problem.
    remedies : mapping of ProblemKind to str
        The options that help, to stand behind the text of a problem.
    exponent : str
        The field of a material that is an exponent of Blinn/Phong, if what importers make of it
        is to be shown.
    weight : str
        The field with the specular weight, NaN for 1; "" for a weight of 1.
    surface : tuple of str
        The fields with the exponent and, where that is NaN, the roughness that a material has;
        none if it has the exponent that importers read.
    compare : callable, optional
        Adds other comparisons to the rows of materials.
    print_more : callable, optional
        Prints what else there is to say of a file, below its table.
    """

    form: ReportFormat
    metric: Metric
    details: Callable[[Any], dict[str, Any]]
    headings: Mapping[str, str]
    secondary: Sequence[str] = ()
    place: str = "line"
    remedies: Mapping[ProblemKind, str] = field(default_factory=dict)
    exponent: str = ""
    weight: str = ""
    surface: tuple[()] | tuple[str, str] = ()
    compare: Callable[[Sequence[Any], Rows], None] | None = None
    print_more: Callable[[dict[str, Any]], None] | None = None

    def print(self, converted: Sequence[tuple[Destination, FileConversion]]) -> None:
        """Print JSON of all to standard output, or tables to standard error."""
        if self.form == "json":
            typer.echo(json_text([self._record(*file) for file in converted]))
            return
        for destination, conversion in converted:
            self._print_tables(self._record(destination, conversion), conversion)

    def problem_text(self, problem: MaterialProblem) -> str:
        """Return what is wrong, with the option that helps."""
        return problem.text + self.remedies.get(problem.kind, "")

    def _record(self, destination: Destination, conversion: FileConversion) -> dict[str, Any]:
        """Return what is said of a file: of all materials, or of those that a table shows."""
        shown = conversion.materials
        if self.form == "table":
            shown = shown[:MATERIALS_SHOWN]
        rows = [vars(material) | {"notes": list(material.notes)} for material in shown]
        if self.compare:
            self.compare(shown, rows)
        if self.exponent:
            self._add_importers(rows)
        known = {
            "file": str(destination.source),
            "output": str(destination.output),
            "metric": str(self.metric),
            "materials": rows,
            "problems": [
                {self.place: problem.place, "problem": self.problem_text(problem)}
                for problem in conversion.problems
            ],
        } | self.details(conversion)
        return {key: known[key] for key in _KEYS if key in known}

    def _add_importers(self, rows: Rows) -> None:
        """Add what importers make of the exponents, to all rows or to those that are shown."""
        import numpy as np

        from mdfconv.scene.shininess import IMPORTERS, importer_results

        for row in rows:
            row["importers"] = {}
        known = [row for row in rows if math.isfinite(row[self.exponent])]
        if self.form == "table":
            known = known[: ROWS_SHOWN // len(IMPORTERS)]
        names = (self.exponent, self.weight, *self.surface)
        exponent, weight, *surface = (
            np.array([row[name] if name else 1.0 for row in known], float) for name in names
        )
        # A file need not have the weight.
        weight = np.nan_to_num(weight, nan=1.0)
        results = importer_results(exponent, self.metric, weight=weight, surface=surface)
        for row, made in zip(known, results, strict=True):
            row["importers"] = {name: result._asdict() for name, result in made.items()}

    def _print_tables(self, record: dict[str, Any], conversion: FileConversion) -> None:
        rows = record["materials"]
        if rows:
            headings = {key: text for key, text in self.headings.items() if key in rows[0]}
            cells = [{text: row[key] for key, text in headings.items()} for row in rows]
            source = f"from {record['from']}, " if "from" in record else ""
            title = f"{record['file']}, {source}{self.metric} metric"
            self._print_table(cells, title, len(conversion.materials))
        else:
            typer.echo(f"{record['file']}: nothing to convert", err=True)
        if self.exponent:
            self._print_importers(rows, conversion)
        if self.print_more:
            self.print_more(record)

    def _print_importers(self, rows: Rows, conversion: FileConversion) -> None:
        from mdfconv.scene.shininess import IMPORTERS

        cells = [
            {
                "material": row["name"],
                "importer": name,
                "roughness": result["roughness"],
                "RMSE": "a mirror" if math.isinf(result["rmse"]) else result["rmse"],
            }
            for row in rows
            for name, result in row["importers"].items()
        ]
        if cells:
            exponents = [getattr(each, self.exponent) for each in conversion.materials]
            count = len(IMPORTERS) * sum(map(math.isfinite, exponents))
            self._print_table(cells, "Importers", count)
            if self.weight and any(math.isnan(row[self.weight]) for row in rows):
                tell("note: materials without a specular colour get a specular weight of 1")

    def _print_table(self, rows: Rows, title: str, count: int) -> None:
        names, hidden = list(rows[0]), self.secondary
        print_table(names, rows, title, secondary=hidden, err=True, everything=_JSON, count=count)


def convert_files(
    context: typer.Context,
    patterns: Sequence[str],
    output: str | None,
    convert: Callable[[Destination, bytes], FileConversion],
    report: MaterialReport,
    *,
    in_place: bool,
    force: bool,
    dry_run: bool = False,
) -> None:
    """Convert files, write all or none, report, and exit with 1 if something had to be left.

    Without an output, a file or a folder, they are converted in place; in a dry run nothing is
    written, and no output is needed.

    Raises
    ------
    MdfconvError
        If a file cannot be read, converted at all, or written; nothing is then changed.
    """
    from mdfconv.cli.outputs import Outputs, new_folder
    from mdfconv.output.files import find_files
    from mdfconv.scene import material_files

    if not dry_run or output is not None:
        _check_choice(output, in_place=in_place)
    files = find_files(patterns)
    destinations = material_files.choose_outputs(files, output)
    inputs = *files, *report.metric.inputs

    def check(paths: Iterable[Path], inputs: Sequence[Path]) -> None:
        # A dry run does not create the folder.
        there = [path for path in paths if not dry_run or path.parent.is_dir()]
        Outputs(*there, force=force, inputs=inputs)

    if output and material_files.is_folder(output) and not dry_run:
        new_folder(context, Path(output))
    results = [[] if each.backup else [each.output] for each in destinations]
    check(chain(*results), inputs)
    converted = []
    for destination, result in zip(destinations, results, strict=True):
        data = material_files.read_file(destination.source)
        refuse_foreign(destination.source, data)
        conversion = convert(destination, data)
        # Which textures there are is known only now.
        check((*result, *conversion.files), (*inputs, *conversion.inputs))
        converted.append((destination, data, conversion))
    written = material_files.write_conversions(converted, force=force, dry_run=dry_run)
    report.print([(destination, conversion) for destination, _, conversion in converted])
    for destination, _, conversion in converted:
        if dry_run and output is None and not in_place:
            tell(f"{destination.source}: nothing is written in a dry run")
        elif destination in written:
            _tell_written(destination, conversion, "would write" if dry_run else "wrote")
        else:
            tell(f"nothing to change in {destination.output}")
        _tell_notes(destination.source, conversion.notes)
        for problem in conversion.problems:
            text = report.problem_text(problem)
            tell(f"{destination.source}:{problem.place}: {text}: left as it is")
    if any(conversion.problems for *_, conversion in converted):
        raise typer.Exit(1)


def _check_choice(output: str | None, *, in_place: bool) -> None:
    """Refuse both an output and a conversion in place, and neither."""
    # A second name may be meant for the result.
    if in_place == (output is not None):
        raise MdfconvError(
            "a file is converted into another file or folder (--output), or in place (--in-place)",
            "choose one of them",
        )


def _tell_written(destination: Destination, conversion: FileConversion, verb: str) -> None:
    """Say which files were written, which a result no longer finds, and what was done before."""
    beside = [path for path in (destination.backup, *conversion.files) if path]
    for path in (destination.output, *beside):
        tell(f"{verb} {path}")
    _tell_missing(destination, conversion)
    first = destination.source.with_name(f"{destination.source.name}.bak")
    if destination.backup and destination.backup != first:
        tell(
            f"note: {destination.source} was converted in place before ({first} is there): its "
            "numbers may be converted twice now"
        )


def _tell_missing(destination: Destination, conversion: FileConversion) -> None:
    """Say which files a result in another folder names and no longer finds."""
    before, now = destination.source.parent, destination.output.parent
    missing = [
        name
        for name in dict.fromkeys(conversion.named)
        if os.path.isfile(before / name) and not os.path.isfile(now / name)
    ]
    if missing:
        more = f" and {len(missing) - 1} more" if len(missing) > 1 else ""
        tell(
            f"note: {destination.output} names {missing[0]}{more}, which "
            f"{'is' if len(missing) == 1 else 'are'} found from {before} and not from {now}: "
            "copy them, too, or write beside the original"
        )


def _tell_notes(source: Path, notes: Sequence[tuple[int, str]]) -> None:
    for line, text in notes[:MATERIALS_SHOWN]:
        tell(f"note: {source}, line {line}: {text}")
    more = len(notes) - MATERIALS_SHOWN
    if more > 0:
        tell(f"… and {more} more notes; {_JSON} has them all")


@contextmanager
def about(path: Path) -> Iterator[None]:
    """Put the name of a file before what is wrong with it."""
    try:
        yield
    except MdfconvError as error:
        raise MdfconvError(f"{path}: {error.reason}", error.hint, argument=error.argument) from None
