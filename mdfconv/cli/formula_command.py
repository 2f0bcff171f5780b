"""``mdfconv formula``."""

from __future__ import annotations

from typing import Annotated

import typer

from mdfconv.cli import completion, options, tables
from mdfconv.cli.options import flag, option
from mdfconv.distributions.parameter import percent_hint
from mdfconv.errors import MdfconvError

_COLUMNS = ("operations", "worst_error", "formula")

_TOLERANCE = option("T", "Worst relative error against the fit that is accepted.")
_RANGE = option(
    "LO:HI",
    "Values of the source; by default alpha 0.01:0.8, roughness and glossiness "
    "0.1:0.9, exponents 1:10000.",
    "--range",
)
_LANGUAGE = option("LANG", "glsl, hlsl, c, python or latex.", "--lang", words=completion.languages)
_EVERY = flag("--all", "Print the table of cost against error instead, in that language.")


def command(
    context: typer.Context,
    source: options.FromOption,
    target: options.ToOption,
    tolerance: Annotated[float, _TOLERANCE] = 0.01,
    range_: Annotated[str | None, _RANGE] = None,
    metric: options.MetricOption = "environment",
    exposure: options.ExposureOption = None,
    gamma: options.FixedGammaOption = None,
    specular: options.SpecularOption = None,
    language: Annotated[str, _LANGUAGE] = "glsl",
    every: Annotated[bool, _EVERY] = False,
    format_: options.FormatOption = None,
) -> None:
    """Print the cheapest formula for a conversion, to paste into a shader or an importer.

    Searches powers of polynomials and rational functions for the fewest operations whose worst
    relative error against the fit, in single precision, is within the tolerance. A value outside
    the range gives what the nearest end of it gives.

    Examples:

    mdfconv formula --from beckmann --to ggx

    mdfconv formula --from blinn-phong --to ggx:roughness --metric energy --lang hlsl

    mdfconv formula --from ggx --to beckmann --tolerance 1e-4 --range 0.05:0.5 --lang c

    mdfconv formula --from blinn-phong --to ggx --metric energy --all --lang latex
    """
    from mdfconv.distributions.endpoint import endpoints, with_specular
    from mdfconv.formula import LANGUAGES, SearchProblem, cheapest, pareto_front, write_formula

    if every:
        options.refuse_given(
            context, ["tolerance"], "does not go with --all, which has every error"
        )
    else:
        options.refuse_given(
            context, ["format_"], "is the form of the table of --all: a formula has --lang"
        )
    chosen_language = LANGUAGES[language]  # names are wrong more often than ranges
    first, last = endpoints(*with_specular(source, target, specular), options.fixed_gamma(gamma))
    ends = options.noted(first), options.noted(last)
    low, high = ends[0].stored.typical if range_ is None else _range(range_)
    problem = SearchProblem(*ends, options.chosen_metric(metric, exposure), low, high)
    if every:
        title = f"Formulas from {ends[0].label} to {ends[1].label}, {low:g} to {high:g}"
        rows = [
            {
                "operations": formula.shape.operations,
                "worst_error": float(f"{formula.error:.3g}"),
                "formula": chosen_language.one_line(formula, problem),
            }
            for formula in pareto_front(problem)
        ]
        tables.write_table(_COLUMNS, rows, format_, title=title)
    else:
        typer.echo(write_formula(cheapest(problem, tolerance), problem, language))


def _range(text: str) -> tuple[float, float]:
    try:
        low, high = map(float, text.split(":"))
    except ValueError:
        reason = f"--range is LO:HI, two numbers, not '{text}'"
        raise MdfconvError(reason, percent_hint(text, ":")) from None
    return low, high
