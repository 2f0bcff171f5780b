"""``mdfconv bench``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mdfconv.cli import completion, options
from mdfconv.cli.options import flag, option
from mdfconv.cli.outputs import Outputs
from mdfconv.cli.tables import form_of, progress, table_text, write_table
from mdfconv.output.files import file_bytes
from mdfconv.output.records import json_text

if TYPE_CHECKING:
    from mdfconv.studies.bench import Measurements

# The paper's reference, and its common rough and smooth surface.
_REFERENCE, _PARAMETERS = "beckmann", (0.2, 0.05)

_REFERENCE_OPTION = option(
    "MDF", "Distribution that the others take the place of.", words=completion.endpoints
)
_PARAMETER = option(
    "P", "Its parameter; repeatable; by default lobes as wide as beckmann's at 0.2 and 0.05."
)
_SOURCE = option(
    "MDF", "Source of the timed conversions.", "--from", words=completion.distributions
)
_TARGET = option("MDF", "Target of the timed conversions.", "--to", words=completion.distributions)
_QUICK = flag("--quick", "Some ten seconds in place of a minute: fewer values, rounds.")


def command(
    reference: Annotated[str, _REFERENCE_OPTION] = _REFERENCE,
    parameter: Annotated[list[float] | None, _PARAMETER] = None,
    source: Annotated[str, _SOURCE] = _REFERENCE,
    target: Annotated[str, _TARGET] = "ggx",
    quick: Annotated[bool, _QUICK] = False,
    format_: options.FormatOption = None,
    csv: Annotated[Path | None, option("FILE", "Write the tables as one CSV.")] = None,
    json: Annotated[Path | None, option("FILE", "Write tables and machine as JSON.")] = None,
    png: options.PngOption = None,
    force: options.ForceOption = False,
) -> None:
    """Measure speed against error on this machine.

    Distributions in the place of another one, conversion methods beside loops of SciPy's curve_fit,
    and kernels beside their textbook expressions, a copy of the angles and, if it is installed,
    Dr.Jit: medians of interleaved repeats with quartiles. CSV has the tables one below another,
    told apart by the column "table"; markdown is a page that says what they mean.

    Examples:

    mdfconv bench

    mdfconv bench --quick --format json

    mdfconv bench --reference ggx:roughness --parameter 0.5 --from ggx --to blinn-phong

    mdfconv bench --format markdown --png speed-error.png > speed-error.md
    """
    import numpy as np

    from mdfconv.conversion import convert
    from mdfconv.distributions import one_parameter_distribution, one_parameter_distributions
    from mdfconv.studies import bench, bench_page

    outputs = Outputs(csv, json, png, force=force)
    end = options.asked_endpoint(reference)
    mdf = end.distribution
    if parameter:
        # The kernels compute in single precision, too.
        lobes = mdf.parameter.check(end.decode(parameter), mdf.name, np.dtype(np.float32))
    else:
        lobes = np.asarray(convert(np.array(_PARAMETERS), _REFERENCE, mdf.name, "half-angle"))
    task = bench.Task(
        reference=mdf,
        parameters=lobes,
        candidates=tuple(one_parameter_distributions()),
        source=one_parameter_distribution(source),
        target=one_parameter_distribution(target),
        sizes=bench.QUICK if quick else bench.FULL,
    )
    with progress("Measuring", task.steps) as advance:
        measurements = bench.measure(task, advance)
    contents: dict[Path, bytes] = {}
    if csv:
        contents[csv] = file_bytes(_csv(measurements))
    if json:
        contents[json] = file_bytes(_json(measurements))
    if png:
        contents[png] = bench_page.draw(measurements)
    outputs.write(contents)
    form = form_of(format_)
    if form == "csv":
        typer.echo(_csv(measurements))
    elif form == "json":
        typer.echo(_json(measurements))
    elif form == "markdown":
        typer.echo(bench_page.markdown_page(measurements, png.name if png else None))
    else:
        for name, rows in bench_page.tables(measurements).items():
            write_table(list(rows[0]), rows, form, title=bench_page.title(measurements, name))


def _csv(measurements: Measurements) -> str:
    tables = measurements.records()
    columns = dict.fromkeys(name for rows in tables.values() for row in rows for name in row)
    blank = dict.fromkeys(columns)
    rows = [{"table": name} | blank | row for name, table in tables.items() for row in table]
    return table_text(["table", *columns], rows, "csv")


def _json(measurements: Measurements) -> str:
    content: dict[str, Any] = {"machine": measurements.machine, "sizes": vars(measurements.sizes)}
    return json_text(content | measurements.records())
