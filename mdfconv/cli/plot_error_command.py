"""``mdfconv plot-error``."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

import typer

from mdfconv.cli import completion, options, tables
from mdfconv.cli.options import flag, option
from mdfconv.cli.outputs import Outputs, check_folder, value_name
from mdfconv.distributions import one_parameter_distribution
from mdfconv.errors import MdfconvError
from mdfconv.fitting.metrics import Metric
from mdfconv.output.files import file_bytes

_REFERENCE = "beckmann"
_COLUMNS = ("figure", "distribution", "parameter", "max_error_percent", "beta_rad")

_M_B = option("M", "Beckmann's m_B; repeatable; default the paper's.")
_REFERENCE_OPTION = option(
    "MDF", "Distribution that the errors are taken against.", words=completion.distributions
)
_MDF = option(
    "MDF",
    "Only this distribution, or the form in which its parameter is printed, such as "
    "ggx:roughness; repeatable.",
    words=completion.endpoints,
)


def command(
    context: typer.Context,
    m_b: Annotated[list[float] | None, _M_B] = None,
    method: options.MethodOption = None,
    metric: options.OptionalMetricOption = None,
    exposure: options.ExposureOption = None,
    reference: Annotated[str, _REFERENCE_OPTION] = _REFERENCE,
    mdf: Annotated[list[str] | None, _MDF] = None,
    output: options.FolderOption = None,
    force: options.ForceOption = False,
    png: Annotated[bool, typer.Option("--png/--no-png", help="Write pictures.")] = True,
    csv: Annotated[bool, typer.Option("--csv/--no-csv", help="Write the errors.")] = True,
    svg: Annotated[bool, flag("--svg", "Write pictures as SVG, too.")] = False,
    dpi: options.DpiOption = 150,
    points: Annotated[int, option("N", "Angles a curve.")] = 1001,
    log: Annotated[bool, flag("--log", "Logarithmic, for the tails.")] = False,
    format_: options.FormatOption = None,
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
    from mdfconv.studies.error_curves import curves, draw_errors

    if not png and not svg:
        options.refuse_given(context, ["dpi", "log"], "is of pictures: give no --no-png, or --svg")
    chosen = options.asked_metric(metric, exposure)
    reference = one_parameter_distribution(reference).name
    endpoints = [options.asked_endpoint(name) for name in mdf or ()]
    names = [one.distribution.name for one in endpoints]
    sets = _parameter_sets(m_b, method, chosen, reference, names)
    forms = [*["png"] * png, *["svg"] * svg]
    folder = check_folder(context, output)
    endings = [*(f".{form}" for form in forms), *["b.csv"] * csv]
    outputs = Outputs(*(folder / f"{name}{end}" for name in sets for end in endings), force=force)
    contents, rows = {}, []
    for name, parameters in sets.items():
        drawn = curves(parameters, metric_or_default(chosen), points)
        title = f"{reference} and its substitutes ({name})"
        for form in forms:
            picture = draw_errors(drawn, title, form=form, dpi=dpi, log=log)
            contents[folder / f"{name}.{form}"] = picture
        if csv:
            contents[folder / f"{name}b.csv"] = file_bytes(drawn.error_text())
        rows += [
            {"figure": name} | row for row in options.in_asked_forms(drawn.maxima(), endpoints)
        ]
    title = f"Largest error against {reference}"
    tables.write_table(_COLUMNS, rows, format_, outputs, beside=contents, title=title)


def _parameter_sets(
    m_b: list[float] | None,
    method: str | None,
    metric: Metric | None,
    reference: str,
    names: Sequence[str],
) -> dict[str, dict[str, float]]:
    """Return the parameters of each figure by its name, the reference's first."""
    from mdfconv.render.comparison import DRAWN, PAPER_SETS
    from mdfconv.studies.error_curves import parameters_for

    if method and not m_b:
        raise MdfconvError("--method converts an --m-b: give one")
    printed = PAPER_SETS["fig1"]
    shown = list(dict.fromkeys([reference, *(names or ((_REFERENCE, *DRAWN) if m_b else printed))]))
    missing = [name for name in shown if name not in printed]
    if missing and not m_b:
        raise MdfconvError(f"the paper's figures have no {missing[0]}: give --m-b")
    if len(shown) == 1:
        raise MdfconvError(f"{reference} is the reference: name another --mdf to compare with it")
    if not m_b:
        return {figure: {name: of[name] for name in shown} for figure, of in PAPER_SETS.items()}
    return {
        f"error-m_b-{value_name(value)}": parameters_for(value, shown, method, metric)
        for value in m_b
    }
