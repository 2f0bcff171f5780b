"""``mdfconv formula``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from mdfconv.cli.output import TableFormat, write_records
from mdfconv.errors import MdfconvError, unknown_name

if TYPE_CHECKING:
    from mdfconv.formula import Problem

_COLUMNS = ("operations", "worst_error", "formula")


def command(
    source: Annotated[
        str,
        typer.Option(
            "--from",
            metavar="MDF",
            help="Distribution to convert from; ggx:roughness names a stored form.",
        ),
    ],
    target: Annotated[str, typer.Option("--to", metavar="MDF", help="Distribution to convert to.")],
    tolerance: Annotated[
        float,
        typer.Option(metavar="T", help="Worst relative error against the fit that is accepted."),
    ] = 0.01,
    range_: Annotated[
        str | None,
        typer.Option(
            "--range",
            metavar="LO:HI",
            help="Values of the source; by default alpha 0.01:0.8, roughness and glossiness "
            "0.1:0.9, exponents 1:10000.",
        ),
    ] = None,
    metric: Annotated[
        str,
        typer.Option(
            metavar="METRIC",
            help="What the fit keeps: unit (the shape), energy (the light) or display (the "
            "picture).",
        ),
    ] = "unit",
    exposure: Annotated[
        float, typer.Option(metavar="E", help="Exposure for the display metric.")
    ] = 1.0,
    language: Annotated[
        str, typer.Option("--lang", metavar="LANG", help="glsl, hlsl, c, python or latex.")
    ] = "glsl",
    every: Annotated[
        bool, typer.Option("--all", help="Print the table of cost against error instead.")
    ] = False,
    format_: Annotated[
        TableFormat | None,
        typer.Option("--format", help="Form of that table: table on a terminal, csv in a pipe."),
    ] = None,
) -> None:
    """Print the cheapest formula for a conversion, to paste into a shader or an importer.

    Searches powers of polynomials and rational functions for the fewest operations whose worst
    relative error against the fit, in single precision, is within the tolerance.

    Examples:

    mdfconv formula --from beckmann --to ggx

    mdfconv formula --from blinn-phong --to ggx:roughness --metric energy --lang hlsl

    mdfconv formula --from ggx --to beckmann --tolerance 1e-4 --range 0.05:0.5 --lang c

    mdfconv formula --from blinn-phong --to ggx --metric energy --all
    """
    from mdfconv.conversion.endpoint import endpoint
    from mdfconv.fitting.metrics import metric as find_metric
    from mdfconv.formula import LANGUAGES, Problem, cheapest, usual_range, write_formula

    form = language.strip().lower()
    if form not in LANGUAGES:
        raise unknown_name("language", language, list(LANGUAGES))
    if format_ and not every:
        raise MdfconvError("--format is the form of the table of --all; a formula has --lang")
    sides = endpoint(source), endpoint(target)
    low, high = usual_range(sides[0]) if range_ is None else _range(range_)
    problem = Problem(*sides, find_metric(metric, exposure), low, high)
    if every:
        title = f"Formulas from {sides[0].label} to {sides[1].label}, {low:g} to {high:g}"
        write_records(_COLUMNS, _rows(problem), format_, None, title)
    else:
        typer.echo(write_formula(cheapest(problem, tolerance), problem, form))


def _range(text: str) -> tuple[float, float]:
    low, colon, high = text.partition(":")
    try:
        found = float(low), float(high)
    except ValueError:
        colon = ""
    if not colon:
        raise MdfconvError(f"--range is LO:HI, two numbers, not '{text}'")
    return found


def _rows(problem: Problem) -> list[dict[str, Any]]:
    from mdfconv.formula import pareto_front
    from mdfconv.formula.languages import latex

    return [
        {
            "operations": formula.shape.operations,
            "worst_error": float(f"{formula.error:.3g}"),
            "formula": latex(formula, problem),
        }
        for formula in pareto_front(problem)
    ]
