"""``mdfconv plot-error``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mdfconv.cli.folder import check_folder, write_all
from mdfconv.cli.names import one_parameter_names
from mdfconv.cli.output import TableFormat, write_records
from mdfconv.errors import MdfconvError

if TYPE_CHECKING:
    from mdfconv.fitting.metrics import Metric
    from mdfconv.reports.error_curves import Curves

_COLUMNS = ("figure", "distribution", "parameter", "max_error_percent", "beta_rad")


def command(
    m_b: Annotated[
        list[float] | None,
        typer.Option("--m-b", metavar="M", help="Beckmann's m_B; repeatable; default the paper's."),
    ] = None,
    method: Annotated[
        str | None,
        typer.Option(
            metavar="METHOD", help="How --m-b is converted for the others; default closed-form."
        ),
    ] = None,
    metric: Annotated[
        str, typer.Option(metavar="METRIC", help="What is compared, and what a fit keeps.")
    ] = "unit",
    exposure: Annotated[
        float, typer.Option(metavar="E", help="Exposure for the display metric.")
    ] = 1.0,
    reference: Annotated[
        str, typer.Option(metavar="MDF", help="Distribution that the errors are taken against.")
    ] = "beckmann",
    mdf: Annotated[
        list[str] | None,
        typer.Option("--mdf", metavar="MDF", help="Distribution to draw; repeatable."),
    ] = None,
    output: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder to write to; default ./reports.")
    ] = None,
    png: Annotated[bool, typer.Option("--png/--no-png", help="Write pictures.")] = True,
    csv: Annotated[bool, typer.Option("--csv/--no-csv", help="Write the errors.")] = True,
    svg: Annotated[bool, typer.Option("--svg", help="Write pictures as SVG, too.")] = False,
    dpi: Annotated[int, typer.Option(metavar="N", help="Resolution of the PNG.")] = 150,
    points: Annotated[int, typer.Option(metavar="N", help="Angles a curve.")] = 1001,
    log: Annotated[bool, typer.Option("--log", help="Logarithmic, for the tails.")] = False,
    format_: Annotated[
        TableFormat | None,
        typer.Option("--format", help="Form of the table that is printed."),
    ] = None,
) -> None:
    """Draw distributions and their error: Figures 1 and 2 of Sawicki 2021.

    Without options the paper's two parameter sets, as fig1.png, fig1b.csv, fig2.png, fig2b.csv.
    Prints the largest |error| of each distribution and where it occurs.

    Examples:

    mdfconv plot-error

    mdfconv plot-error --m-b 0.1 --m-b 0.8 --method fit --log

    mdfconv plot-error --m-b 0.2 --reference ggx --mdf beckmann --no-csv --output /tmp
    """
    from mdfconv.fitting.metrics import metric as find_metric

    if not 1 <= dpi <= 2400:
        raise MdfconvError("--dpi is from 1 to 2400")
    folder = check_folder(output)
    measure = find_metric(metric, exposure)
    shown = _curves(m_b, method, measure, reference, mdf, points)
    contents: dict[str, bytes] = {}
    rows: list[dict[str, Any]] = []
    for name, found in shown.items():
        rows += [{"figure": name} | row for row in found.maxima()]
        contents |= _files(name, found, png=png, csv=csv, svg=svg, dpi=dpi, log=log)
    paths = write_all(folder, contents)
    write_records(_COLUMNS, rows, format_, None, f"Largest error against {_only(shown)}")
    for path in paths:
        typer.echo(f"mdfconv: wrote {path}", err=True)


def _only(shown: dict[str, Curves]) -> str:
    return next(iter(shown.values())).reference


def _curves(
    m_b: list[float] | None,
    method: str | None,
    measure: Metric,
    reference: str,
    mdf: list[str] | None,
    points: int,
) -> dict[str, Curves]:
    from mdfconv.conversion import DEFAULT_METHOD
    from mdfconv.reports.error_curves import DRAWN, PAPER_SETS, curves, parameters_for

    (chief,) = one_parameter_names([reference])
    names = one_parameter_names(mdf or ())
    if m_b:
        names = names or [name for name in ("beckmann", *DRAWN) if name != chief]
        wanted = dict.fromkeys([chief, *names])
        sets = {
            f"error-m_b-{value:g}": parameters_for(
                value, list(wanted), method or DEFAULT_METHOD, measure
            )
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
            figure: {name: given[name] for name in dict.fromkeys([chief, *names])}
            for figure, given in PAPER_SETS.items()
        }
    if any(set(given) == {chief} for given in sets.values()):
        raise MdfconvError(f"{chief} is the reference: name another --mdf to compare with it")
    return {name: curves(given, chief, measure, points) for name, given in sets.items()}


def _files(
    name: str, found: Curves, *, png: bool, csv: bool, svg: bool, dpi: int, log: bool
) -> dict[str, bytes]:
    from mdfconv.reports.text import file_bytes

    contents = {}
    title = f"{found.reference} and its substitutes ({name})"
    forms = ["png"] * png + ["svg"] * svg
    if forms:
        from mdfconv.reports.error_figure import draw_errors

        for form in forms:
            picture = draw_errors(found, title, form=form, dpi=dpi, log=log)
            contents[f"{name}.{form}"] = picture
    if csv:
        contents[f"{name}b.csv"] = file_bytes(found.error_text())
    return contents
