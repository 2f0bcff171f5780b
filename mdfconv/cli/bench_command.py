"""``mdfconv bench``."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mdfconv.cli.output import FormOption, TableFormat, default_form, progress, write_records
from mdfconv.errors import MdfconvError

if TYPE_CHECKING:
    from mdfconv.benchmark.measure import Measurements, Task
    from mdfconv.distributions.evaluation import Array

_REFERENCE = "beckmann"
_PARAMETERS = (0.2, 0.05)


def command(
    reference: Annotated[
        str, typer.Option(metavar="MDF", help="Distribution that the others take the place of.")
    ] = _REFERENCE,
    parameter: Annotated[
        list[float] | None,
        typer.Option(
            metavar="P",
            help="Its parameter; repeatable; by default lobes as wide as beckmann's at 0.2 and "
            "0.05.",
        ),
    ] = None,
    source: Annotated[
        str, typer.Option("--from", metavar="MDF", help="Source of the timed conversions.")
    ] = "beckmann",
    target: Annotated[
        str, typer.Option("--to", metavar="MDF", help="Target of the timed conversions.")
    ] = "ggx",
    quick: Annotated[
        bool, typer.Option("--quick", help="Seconds in place of a minute: fewer values, rounds.")
    ] = False,
    format_: FormOption = None,
    csv: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write the tables as one CSV.")
    ] = None,
    json: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write tables and machine as JSON.")
    ] = None,
    png: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Draw error against time.")
    ] = None,
) -> None:
    """Measure speed against error on this machine.

    Distributions in the place of another one, conversion methods, and kernels against their
    textbook expressions: medians of interleaved repeats with quartiles, and what they say in
    sentences. CSV has the three tables one below another, told apart by the column "table";
    markdown is a page.

    Examples:

    mdfconv bench

    mdfconv bench --quick --format json

    mdfconv bench --reference ggx:roughness --parameter 0.5 --from ggx --to blinn-phong

    mdfconv bench --format markdown --png speed-error.png > speed-error.md
    """
    from mdfconv.benchmark.measure import measure
    from mdfconv.reports.text import file_bytes, write_files

    places = [place for place in (csv, json, png) if place]
    _check_places(places)
    task = _task(reference, parameter, source, target, quick=quick)
    with progress("Measuring", task.steps) as advance:
        found = measure(task, advance)
    contents: dict[Path, bytes] = {}
    if csv:
        contents[csv] = file_bytes(_csv(found))
    if json:
        contents[json] = file_bytes(_json(found))
    if png:
        from mdfconv.benchmark.figure import draw

        contents[png] = draw(found)
    write_files(contents)
    _print(found, format_ or default_form(None), png)
    for place in places:
        typer.echo(f"mdfconv: wrote {place}", err=True)


def _check_places(places: list[Path]) -> None:
    """Refuse places that cannot be written, before anything is measured."""
    if len({place.resolve() for place in places}) < len(places):
        raise MdfconvError("two outputs have the same name: give each its own file")
    for place in places:
        if place.is_dir():
            raise MdfconvError(f"cannot write {place}: Is a directory")
        if not place.parent.is_dir():
            raise MdfconvError(f"cannot write {place}: {place.parent} is not an existing directory")
        if not os.access(place.parent, os.W_OK):
            raise MdfconvError(f"cannot write {place}: Permission denied")


def _task(
    reference: str, parameter: list[float] | None, source: str, target: str, *, quick: bool
) -> Task:
    from mdfconv.benchmark.measure import Task
    from mdfconv.benchmark.timing import FULL, QUICK
    from mdfconv.cli.names import one_parameter_distributions, one_parameter_names
    from mdfconv.conversion.endpoint import endpoint
    from mdfconv.distributions import distribution

    side = endpoint(reference)
    one_parameter_names([side.distribution.name])
    names = [one_parameter_names([name])[0] for name in (source, target)]
    return Task(
        reference=side.distribution,
        parameters=side.decode(parameter) if parameter else _default_lobes(side.distribution.name),
        candidates=tuple(one_parameter_distributions()),
        source=distribution(names[0]),
        target=distribution(names[1]),
        sizes=QUICK if quick else FULL,
    )


def _default_lobes(name: str) -> Array:
    import numpy as np

    from mdfconv.conversion import convert

    return np.asarray(convert(np.array(_PARAMETERS), _REFERENCE, name, "half-angle"))


def _print(found: Measurements, form: TableFormat, png: Path | None) -> None:
    from mdfconv.benchmark import page

    if form is TableFormat.csv:
        typer.echo(_csv(found))
    elif form is TableFormat.json:
        typer.echo(_json(found))
    elif form is TableFormat.markdown:
        typer.echo(page.markdown_page(found, png.name if png else None))
    else:
        said = page.sentences(found)
        for name, rows in page.tables(found).items():
            write_records(list(rows[0]), rows, form, None, page.title(found, name))
            typer.echo("\n".join(said[name]) + "\n")


def _csv(found: Measurements) -> str:
    from mdfconv.reports.text import csv_text

    rows = [{"table": name} | row for name, table in found.records().items() for row in table]
    columns = dict.fromkeys(column for row in rows for column in row)
    return csv_text(list(columns), rows)


def _json(found: Measurements) -> str:
    from mdfconv.benchmark.page import sentences
    from mdfconv.reports.text import json_text

    content: dict[str, Any] = {"machine": found.machine, "sizes": vars(found.sizes)}
    return json_text(content | found.records() | {"verdicts": sentences(found)})
