"""``mdfconv recommend``."""

from __future__ import annotations

from typing import Annotated

import typer

from mdfconv.cli import options, process, tables
from mdfconv.cli.options import argument, option
from mdfconv.output.records import json_text

_FOOTNOTE = (
    "[dim]Errors: root mean square and maximum under the metric, relative to the source's. "
    "ops: of one evaluation, as a shader has it. ns: the same in float32 in NumPy, now.[/dim]"
)

_HEADINGS = {
    "distribution": "distribution", "parameter": "parameter", "method": "by", "chosen": "for",
    "operations": "ops", "ns": "ns", "max_error": "max error", "rmse": "RMSE", "within": "within",
}  # fmt: skip

_TOLERANCE = option(
    "T", "Largest maximum error allowed under the metric, relative to the source's."
)


def command(
    value: Annotated[float, argument("VALUE", "Parameter of the surface.")],
    source: options.FromOption,
    tolerance: Annotated[float, _TOLERANCE] = 0.05,
    metric: options.MetricOption = "environment",
    exposure: options.ExposureOption = None,
    gamma: options.FixedGammaOption = None,
    format_: options.FormatOption = None,
) -> None:
    """Recommend the cheapest distribution and conversion for a surface.

    Leaves out distributions whose best fit exceeds the tolerance. For a shader the cheapest has the
    fewest operations; for NumPy it is the quickest on this machine, timed now, of several within
    10 % the one with the smallest error. Each with the cheapest conversion that stays within the
    tolerance.

    Examples:

    mdfconv recommend --from beckmann 0.2

    mdfconv recommend --from blinn-phong 100 --tolerance 0.002

    mdfconv recommend --from ggx:roughness 0.5 --tolerance 0.1 --metric display --format json
    """
    from mdfconv.distributions import one_parameter_distributions
    from mdfconv.distributions.endpoint import with_gamma
    from mdfconv.recommend import recommend

    end = with_gamma(options.asked_endpoint(source), options.fixed_gamma(gamma))
    kept = options.chosen_metric(metric, exposure)
    recommendation = recommend(
        end.distribution, end.decode_one(value), one_parameter_distributions(), kept, tolerance
    )
    rows, reason = recommendation.records(), recommendation.reason
    columns, answers = list(rows[0]), recommendation.chosen
    sentence = reason[0].upper() + reason[1:]
    form = tables.form_of(format_, in_pipe="plain")
    if form == "json":
        asked = {"from": end.label, "value": value, "metric": str(kept), "tolerance": tolerance}
        chosen = {use: vars(candidate) for use, candidate in answers.items()}
        typer.echo(json_text(asked | chosen | {"reason": reason, "candidates": rows}))
    elif form == "markdown":
        typer.echo(f"{tables.table_text(columns, rows, form)}\n\n{sentence}")
    elif form == "table":
        shown = [{heading: row[key] for key, heading in _HEADINGS.items()} for row in rows]
        styles = ["bold" if row["chosen"] else "" if row["within"] else "dim" for row in rows]
        title = f"{end.label} {value:g} within {tolerance:g}, {kept}"
        tables.print_table(list(shown[0]), shown, title, styles, secondary=("RMSE", "within"))
        tables.console().print(f"{sentence}\n{_FOOTNOTE}")
    else:
        lines = [
            f"{use} {answer.distribution} {tables.value_text(answer.parameter)} {answer.method}"
            for use, answer in answers.items()
        ]
        typer.echo("\n".join(lines) if form == "plain" else tables.table_text(columns, rows, form))
        process.tell(reason)
