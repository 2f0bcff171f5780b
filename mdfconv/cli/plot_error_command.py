"""``mdfconv plot-error``."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated

import typer

from mdfconv.cli import completion
from mdfconv.cli.options import (
    DpiOption,
    ExposureOption,
    FolderOption,
    ForceOption,
    FormatOption,
    MethodOption,
    OptionalMetricOption,
    asked_endpoint,
    asked_metric,
    in_asked_forms,
    refuse_given,
)
from mdfconv.cli.outputs import Outputs, check_folder, value_name
from mdfconv.cli.tables import write_table
from mdfconv.distributions import one_parameter_distribution
from mdfconv.errors import MdfconvError
from mdfconv.output.files import file_bytes

if TYPE_CHECKING:
    from mdfconv.distributions.endpoint import Endpoint
    from mdfconv.fitting.metrics import Metric
    from mdfconv.studies.error_curves import Curves

_REFERENCE = "beckmann"
_COLUMNS = ("figure", "distribution", "parameter", "max_error_percent", "beta_rad")


def command(
    context: typer.Context,
    m_b: Annotated[
        list[float] | None,
        typer.Option("--m-b", metavar="M", help="Beckmann's m_B; repeatable; default the paper's."),
    ] = None,
    method: MethodOption = None,
    metric: OptionalMetricOption = None,
    exposure: ExposureOption = None,
    reference: Annotated[
        str,
        typer.Option(
            metavar="MDF",
            autocompletion=completion.distributions,
            help="Distribution that the errors are taken against.",
        ),
    ] = _REFERENCE,
    mdf: Annotated[
        list[str] | None,
        typer.Option(
            metavar="MDF",
            autocompletion=completion.endpoints,
            help="Only this distribution, or the form in which its parameter is printed, such as "
            "ggx:roughness; repeatable.",
        ),
    ] = None,
    output: FolderOption = None,
    force: ForceOption = False,
    png: Annotated[bool, typer.Option("--png/--no-png", help="Write pictures.")] = True,
    csv: Annotated[bool, typer.Option("--csv/--no-csv", help="Write the errors.")] = True,
    svg: Annotated[bool, typer.Option("--svg", help="Write pictures as SVG, too.")] = False,
    dpi: DpiOption = 150,
    points: Annotated[int, typer.Option(metavar="N", help="Angles a curve.")] = 1001,
    log: Annotated[bool, typer.Option("--log", help="Logarithmic, for the tails.")] = False,
    format_: FormatOption = None,
) -> None:
    """Draw distributions and their error: Figures 1 and 2 of Sawicki 2021.

    Without options the paper's two parameter sets, as fig1.png, fig1b.csv, fig2.png, fig2b.csv.
    Prints the largest |error| of each distribution and where it occurs.

    Examples:

    mdfconv plot-error

    mdfconv plot-error --m-b 0.1 --m-b 0.8 --method fit --log

    mdfconv plot-error --m-b 0.2 --reference ggx --mdf beckmann --no-csv --output /tmp
    """
    from mdfconv.conversion.values import metric_or_default
    from mdfconv.studies.error_curves import curves

    if not png and not svg:
        refuse_given(context, ["dpi", "log"], "is of pictures: give no --no-png, or --svg")
    asked = asked_metric(metric, exposure)
    chief = one_parameter_distribution(reference).name
    ends = [asked_endpoint(name) for name in mdf or ()]
    sets = _sets(m_b, method, asked, chief, ends)
    endings = [*[".png"] * png, *[".svg"] * svg, *["b.csv"] * csv]
    folder = check_folder(context, output)
    outputs = Outputs(*(folder / f"{name}{end}" for name in sets for end in endings), force=force)
    shown = metric_or_default(asked)
    figures = {name: curves(each, chief, shown, points) for name, each in sets.items()}
    contents = {
        folder / f"{name}{end}": _file(name, drawn, end, dpi=dpi, log=log)
        for name, drawn in figures.items()
        for end in endings
    }
    rows = [
        {"figure": name} | row
        for name, drawn in figures.items()
        for row in in_asked_forms(drawn.maxima(), ends)
    ]
    title = f"Largest error against {chief}"
    write_table(_COLUMNS, rows, format_, outputs, beside=contents, title=title)


def _sets(
    m_b: list[float] | None,
    method: str | None,
    metric: Metric | None,
    chief: str,
    ends: Sequence[Endpoint],
) -> dict[str, dict[str, float]]:
    """Return the parameters of each figure by its name."""
    from mdfconv.render.comparison import DRAWN, PAPER_SETS
    from mdfconv.studies.error_curves import parameters_for

    names = list(dict.fromkeys(end.distribution.name for end in ends))
    if m_b:
        names = names or [name for name in (_REFERENCE, *DRAWN) if name != chief]
        wanted = dict.fromkeys([chief, *names])
        sets = {
            f"error-m_b-{value_name(value)}": parameters_for(value, list(wanted), method, metric)
            for value in m_b
        }
    else:
        if method:
            raise MdfconvError("--method converts an --m-b: give one")
        names = names or list(PAPER_SETS["fig1"])
        unknown = [name for name in [chief, *names] if name not in PAPER_SETS["fig1"]]
        if unknown:
            raise MdfconvError(f"the paper's figures have no {unknown[0]}: give --m-b")
        sets = {
            figure: {name: printed[name] for name in dict.fromkeys([chief, *names])}
            for figure, printed in PAPER_SETS.items()
        }
    if any(set(parameters) == {chief} for parameters in sets.values()):
        raise MdfconvError(f"{chief} is the reference: name another --mdf to compare with it")
    return sets


def _file(name: str, drawn: Curves, end: str, *, dpi: int, log: bool) -> bytes:
    """Return the content of a figure's file by what its name ends in."""
    if end == "b.csv":
        return file_bytes(drawn.error_text())
    from mdfconv.studies.error_curves import draw_errors

    title = f"{drawn.reference} and its substitutes ({name})"
    return draw_errors(drawn, title, form=end.removeprefix("."), dpi=dpi, log=log)
