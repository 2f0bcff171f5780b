"""``mdfconv recommend``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from mdfconv.cli.options import (
    ExposureOption,
    FixedGammaOption,
    Format,
    FormatOption,
    FromOption,
    MetricOption,
    chosen_metric,
    fixed_gamma,
)
from mdfconv.cli.tables import (
    console,
    form_of,
    print_table,
    table_text,
    tell,
    value_text,
)
from mdfconv.output.records import json_text

if TYPE_CHECKING:
    from mdfconv.benchmark.recommendation import Recommendation

_FOOTNOTE = (
    "[dim]Errors: root mean square and maximum under the metric, relative to the source's. "
    "ns: one evaluation in float32, now.[/dim]"
)

_HEADINGS = {
    "distribution": "distribution", "parameter": "parameter", "method": "by", "ns": "ns",
    "operations": "ops", "rmse": "RMSE", "max_error": "max error", "within": "within",
}  # fmt: skip


def command(
    value: Annotated[float, typer.Argument(metavar="VALUE", help="Parameter of the surface.")],
    source: FromOption,
    tolerance: Annotated[
        float,
        typer.Option(
            metavar="T",
            help="Largest maximum error allowed under the metric, relative to the source's.",
        ),
    ] = 0.05,
    metric: MetricOption = "environment",
    exposure: ExposureOption = None,
    gamma: FixedGammaOption = None,
    format_: FormatOption = None,
) -> None:
    """Recommend the cheapest distribution and conversion for a surface.

    Times every distribution on this machine, which takes about a second, and leaves out those
    whose best fit exceeds the tolerance. Of the quickest within 10 % it takes the one with the
    fewest operations, and the cheapest conversion that stays within the tolerance.

    Examples:

    mdfconv recommend --from beckmann 0.2

    mdfconv recommend --from blinn-phong 100 --tolerance 0.002

    mdfconv recommend --from ggx:roughness 0.5 --tolerance 0.1 --metric display --format json
    """
    from mdfconv.benchmark.recommendation import recommend
    from mdfconv.conversion.endpoint import endpoint, with_gamma
    from mdfconv.distributions import one_parameter_distribution, one_parameter_distributions

    end = with_gamma(endpoint(source), fixed_gamma(gamma))
    one_parameter_distribution(end.distribution.name)
    kept = chosen_metric(metric, exposure)
    recommendation = recommend(
        end.distribution, float(end.decode(value)), one_parameter_distributions(), kept, tolerance
    )
    asked = {"from": end.label, "value": value, "metric": str(kept), "tolerance": tolerance}
    _write(recommendation, asked, form_of(format_, in_pipe=Format.plain))


def _write(recommendation: Recommendation, asked: dict[str, Any], form: Format) -> None:
    rows, reason = recommendation.records(), recommendation.reason
    columns, chosen = list(rows[0]), recommendation.chosen
    sentence = reason[0].upper() + reason[1:]
    if form is Format.json:
        answer = {"chosen": chosen.distribution, "reason": reason, "candidates": rows}
        typer.echo(json_text(asked | answer))
    elif form is Format.markdown:
        typer.echo(f"{table_text(columns, rows, form)}\n\n{sentence}")
    elif form is Format.table:
        out = console()
        _print_table(rows, asked)
        out.print(sentence)
        out.print(_FOOTNOTE)
    else:
        line = f"{chosen.distribution} {value_text(chosen.parameter)} {chosen.method}"
        typer.echo(line if form is Format.plain else table_text(columns, rows, form))
        tell(reason)


def _print_table(rows: list[dict[str, Any]], asked: dict[str, Any]) -> None:
    title = f"{asked['from']} {asked['value']:g} within {asked['tolerance']:g}, {asked['metric']}"
    shown = [{heading: row[key] for key, heading in _HEADINGS.items()} for row in rows]
    styles = ["bold" if row["chosen"] else "" if row["within"] else "dim" for row in rows]
    print_table(list(shown[0]), shown, title, styles, secondary=("within", "RMSE"))
