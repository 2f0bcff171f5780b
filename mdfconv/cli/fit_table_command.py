"""``mdfconv fit-table``."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from mdfconv.cli import options, tables
from mdfconv.cli.options import flag, option
from mdfconv.cli.outputs import Outputs
from mdfconv.distributions import distribution
from mdfconv.distributions.evaluation import Array
from mdfconv.distributions.parameter import percent_hint
from mdfconv.errors import MdfconvError

_LARGEST_SWEEP = 10_000

_COMPARE = flag("--compare", "Put each printed cell of the paper beside ours.")
_SWEEP = option(
    "LO:HI:COUNT",
    "Fit other m_B, spaced logarithmically; unit forms on β up to 4 m_B, where the "
    "paper's rows have limits of their own.",
)
_EXTENDED = flag("--extended", "Add what the paper's table lacks, with γ.")
_CLOSED_FORMS = flag("--closed-forms", "Refit the coefficients of the paper's formulas.")


def command(
    context: typer.Context,
    format_: options.FormatOption = None,
    output: options.OutputOption = None,
    compare: Annotated[bool, _COMPARE] = False,
    sweep: Annotated[str | None, _SWEEP] = None,
    m_b: Annotated[list[float] | None, option("M", "Fit this m_B; repeatable.")] = None,
    metric: options.MetricOption = "unit",
    exposure: options.ExposureOption = None,
    extended: Annotated[bool, _EXTENDED] = False,
    closed_forms: Annotated[bool, _CLOSED_FORMS] = False,
    force: options.ForceOption = False,
) -> None:
    """Reproduce Table 2 of Sawicki 2021: Beckmann fitted by the others over a sweep of m_B.

    Without options the paper's 17 rows by its own protocol. In CSV and JSON numbers have full
    precision.

    Examples:

    mdfconv fit-table

    mdfconv fit-table --compare

    mdfconv fit-table --sweep 0.001:1:10 --metric energy

    mdfconv fit-table --m-b 0.3 --extended --format json

    mdfconv fit-table --closed-forms --format markdown
    """
    if (compare or closed_forms) and (sweep or m_b or extended or compare == closed_forms):
        raise MdfconvError(
            "--compare and --closed-forms speak of the paper's rows: give one of them, without "
            "--sweep, --m-b or --extended"
        )
    chosen = options.chosen_metric(metric, exposure)
    if closed_forms:
        options.refuse_given(
            context, ["metric"], "does not go with --closed-forms, which has every metric"
        )
    if compare and chosen.name != "unit":
        raise MdfconvError("--compare: the paper's table has the unit metric only")
    outputs = Outputs(table=output, force=force, inputs=chosen.inputs)
    rows: list[dict[str, Any]]
    if closed_forms:
        from mdfconv.studies.table2 import refit_rows

        rows = refit_rows(options.every_metric(exposure))
        title = "Closed forms: coefficients and worst relative error"
        minor = ["formula", "worst_printed", "printed"]
    elif compare:
        from mdfconv.studies.table2 import printed_cells

        rows = list(printed_cells())
        agreeing = sum(row["agrees"] for row in rows)
        title = f"Table 2 of Sawicki 2021: {agreeing} of {len(rows)} cells within 4e-4"
        minor = ["units"]
    else:
        from mdfconv.studies.table2 import fit_table

        values, limit = _sweep(sweep, m_b)
        with tables.progress("Fitting", values.size) as advance:
            rows = fit_table(values, limit, chosen, extended=extended, progress=advance)
        title = f"Fits of Beckmann, metric {chosen}"
        minor = [name for name in rows[0] if name.startswith("rmse")]
    tables.write_table(list(rows[0]), rows, format_, outputs, title=title, secondary=minor)


def _sweep(sweep: str | None, m_b: list[float] | None) -> tuple[Array, Array]:
    """Return m_B and the limit of β for the paper's rows, a sweep or chosen values."""
    import numpy as np

    from mdfconv.studies.table2 import angle_limit, paper_sweep

    if sweep and m_b:
        raise MdfconvError("give either --sweep or --m-b")
    check = distribution("beckmann").parameter.check
    if sweep:
        low, high, count = _sweep_ends(sweep)
        ends = check([low, high], "beckmann")
        values = np.geomspace(float(ends[0]), float(ends[1]), count)
    elif m_b:
        values = np.array(check(m_b, "beckmann"))
    else:
        return paper_sweep()
    return values, angle_limit(values)


def _sweep_ends(text: str) -> tuple[float, float, int]:
    try:
        low, high, count = text.split(":")
        ends = float(low), float(high), int(count)
    except ValueError:
        reason = f"--sweep takes LO:HI:COUNT, such as 0.001:1:10, not '{text}'"
        raise MdfconvError(reason, percent_hint(text, ":")) from None
    if not 1 <= ends[2] <= _LARGEST_SWEEP:
        raise MdfconvError(f"--sweep: COUNT is from 1 to {_LARGEST_SWEEP}")
    return ends
