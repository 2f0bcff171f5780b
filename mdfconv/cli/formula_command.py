"""``mdfconv formula``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mdfconv.cli import completion, options, tables
from mdfconv.cli.options import Format, flag, option
from mdfconv.cli.outputs import Outputs
from mdfconv.distributions.parameter import percent_hint
from mdfconv.errors import MdfconvError

if TYPE_CHECKING:
    from mdfconv.formula import SearchProblem
    from mdfconv.formula.code import Language

# Parameters of the command that mean nothing for an exact formula.
_OF_A_SEARCH = ("tolerance", "range_", "metric", "exposure", "every")
_COLUMNS = ("operations", "worst_error", "formula")

_TOLERANCE = option("T", "Worst relative error against the fit that is accepted.")
_RANGE = option(
    "LO:HI",
    "Values of the source; by default alpha 0.01:0.8, roughness and glossiness "
    "0.1:0.9, exponents 1:10000.",
    "--range",
)
_LANGUAGE = option(
    "LANG",
    "glsl, hlsl, wgsl, metal, osl, c, python, materialx (a node graph) or latex.",
    "--lang",
    words=completion.languages,
)
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
    output: options.OutputOption = None,
    force: options.ForceOption = False,
) -> None:
    """Print the cheapest formula for a conversion, to paste into a shader or an importer.

    Searches powers of polynomials and rational functions for the fewest operations whose worst
    relative error against the fit, in single precision, is within the tolerance. A value outside
    the range gives what the nearest end of it gives.

    Between stored forms of the same lobe the formula is exact and needs no search, so that
    tolerance, range and metric do not apply. Anisotropic forms have a formula for each number.

    Examples:

    mdfconv formula --from beckmann --to ggx

    mdfconv formula --from blinn-phong --to ggx:roughness --metric energy --lang hlsl

    mdfconv formula --from ggx --to beckmann --tolerance 1e-4 --range 0.05:0.5 --lang c

    mdfconv formula --from blinn-phong --to ggx --metric energy --all --lang latex

    mdfconv formula --from ggx:glossiness --to ggx:roughness --lang wgsl

    mdfconv formula --from ggx:openpbr --to ggx --lang materialx -o openpbr.mtlx
    """
    from mdfconv.distributions.endpoint import endpoints, with_specular
    from mdfconv.formula import (
        LANGUAGES,
        SearchProblem,
        cheapest,
        exact_relation,
        write_formula,
        write_relation,
    )

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
    outputs = Outputs(None if every else output, force=force, table=output if every else None)
    relation = exact_relation(*ends)
    if relation:
        why = f"goes with a search: {ends[0].label} to {ends[1].label} is exact"
        options.refuse_given(context, _OF_A_SEARCH, why)
        _write(write_relation(relation, language), output, outputs)
        return
    low, high = ends[0].stored.typical if range_ is None else _range(range_)
    problem = SearchProblem(*ends, options.chosen_metric(metric, exposure), low, high)
    if every:
        _write_front(problem, chosen_language, format_, outputs)
    else:
        _write(write_formula(cheapest(problem, tolerance), problem, language), output, outputs)


def _write(code: str, output: Path | None, outputs: Outputs) -> None:
    if output:
        outputs.write({output: f"{code}\n".encode()})
    else:
        typer.echo(code)


def _write_front(
    problem: SearchProblem, language: Language, format_: Format | None, outputs: Outputs
) -> None:
    """Write the table of cost against error."""
    from mdfconv.formula import pareto_front

    ends = f"{problem.source.label} to {problem.target.label}"
    rows = [
        {
            "operations": formula.shape.operations,
            "worst_error": float(f"{formula.error:.3g}"),
            "formula": language.one_line(formula, problem),
        }
        for formula in pareto_front(problem)
    ]
    title = f"Formulas from {ends}, {problem.low:g} to {problem.high:g}"
    tables.write_table(_COLUMNS, rows, format_, outputs, title=title)


def _range(text: str) -> tuple[float, float]:
    try:
        low, high = map(float, text.split(":"))
    except ValueError:
        reason = f"--range is LO:HI, two numbers, not '{text}'"
        raise MdfconvError(reason, percent_hint(text, ":")) from None
    return low, high
