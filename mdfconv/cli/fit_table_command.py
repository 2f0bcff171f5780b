"""``mdfconv fit-table``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from mdfconv.cli.output import FileOption, FormOption, progress, write_records
from mdfconv.errors import MdfconvError

if TYPE_CHECKING:
    from mdfconv.distributions.evaluation import Array
    from mdfconv.fitting.metrics import Metric

_LARGEST_SWEEP = 100_000


def command(
    format_: FormOption = None,
    output: FileOption = None,
    compare: Annotated[
        bool,
        typer.Option("--compare", help="Put each printed cell of the paper beside ours."),
    ] = False,
    sweep: Annotated[
        str | None,
        typer.Option(
            metavar="LO:HI:COUNT",
            help="Fit other m_B, spaced logarithmically; unit forms on β up to 4 m_B, where the "
            "paper's rows have limits of their own.",
        ),
    ] = None,
    m_b: Annotated[
        list[float] | None, typer.Option("--m-b", metavar="M", help="Fit this m_B; repeatable.")
    ] = None,
    metric: Annotated[
        str,
        typer.Option(
            metavar="METRIC",
            help="What the fit keeps: unit (the paper's), energy (the light) or display (the "
            "picture on a screen).",
        ),
    ] = "unit",
    exposure: Annotated[
        float, typer.Option(metavar="E", help="Exposure for the display metric.")
    ] = 1.0,
    extended: Annotated[
        bool, typer.Option("--extended", help="Add gtr (α and γ), schlick and smoothie.")
    ] = False,
    closed_forms: Annotated[
        bool,
        typer.Option("--closed-forms", help="Refit the coefficients of the paper's formulas."),
    ] = False,
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
    from mdfconv.fitting.metrics import metric as find_metric

    measure = find_metric(metric, exposure)
    if (compare or closed_forms) and (sweep or m_b or extended or compare == closed_forms):
        raise MdfconvError(
            "--compare and --closed-forms speak of the paper's rows: give one of them, without "
            "--sweep, --m-b or --extended"
        )
    if compare and measure.name != "unit":
        raise MdfconvError("--compare: the paper's table has the unit metric only")
    if compare:
        columns, rows, title = _comparison()
    elif closed_forms:
        columns, rows, title = _closed_forms(exposure)
    else:
        columns, rows, title = _table(measure, sweep, m_b, extended)
    write_records(columns, rows, format_, output, title)


def _comparison() -> tuple[list[str], list[dict[str, Any]], str]:
    from dataclasses import asdict

    from mdfconv.reports.table2 import compare

    rows = [asdict(cell) for cell in compare()]
    agreeing = sum(row["agrees"] for row in rows)
    title = f"Table 2 of Sawicki 2021: {agreeing} of {len(rows)} cells within 4e-4"
    return list(rows[0]), rows, title


def _closed_forms(exposure: float) -> tuple[list[str], list[dict[str, Any]], str]:
    from mdfconv.fitting.metrics import list_metrics
    from mdfconv.fitting.metrics import metric as find_metric
    from mdfconv.reports.closed_forms import refit

    rows = [
        {
            "from": found.form.source,
            "to": found.form.target,
            "formula": found.form.text,
            "metric": found.metric,
            "printed": _coefficients(found.form.printed),
            "worst_printed": found.printed_error,
            "refitted": _coefficients(found.coefficients),
            "worst_refitted": found.error,
        }
        for name in list_metrics()
        for found in refit(find_metric(name, exposure))
    ]
    return list(rows[0]), rows, "Closed forms: coefficients and worst relative error"


def _coefficients(values: tuple[float, ...]) -> str:
    return ", ".join(f"{letter}={value:.6g}" for letter, value in zip("ab", values, strict=False))


def _table(
    measure: Metric, sweep: str | None, m_b: list[float] | None, extended: bool
) -> tuple[list[str], list[dict[str, float]], str]:
    from mdfconv.reports.table2 import COLUMNS, EXTENDED_COLUMNS, fit_table

    values, reach = _sweep(sweep, m_b)
    with progress("Fitting", values.size) as advance:
        rows = fit_table(values, reach, measure, extended=extended, progress=advance)
    columns = [*COLUMNS, *(EXTENDED_COLUMNS if extended else ())]
    return columns, rows, f"Fits of Beckmann, metric {measure.name}"


def _sweep(sweep: str | None, m_b: list[float] | None) -> tuple[Array, Array]:
    """Return m_B and the limit of β for the paper's rows, a sweep or chosen values."""
    import numpy as np

    from mdfconv.distributions import distribution
    from mdfconv.reports.table2 import lobe_reach, paper_sweep

    if sweep and m_b:
        raise MdfconvError("give either --sweep or --m-b")
    if not sweep and not m_b:
        return paper_sweep()
    beckmann = distribution("beckmann")
    if m_b:
        values = np.array(beckmann.parameter.check(m_b, "beckmann"))
    else:
        low, high, count = _sweep_ends(sweep or "")
        ends = beckmann.parameter.check([low, high], "beckmann")
        values = np.geomspace(float(ends[0]), float(ends[1]), count)
    return values, lobe_reach(values)


def _sweep_ends(text: str) -> tuple[float, float, int]:
    try:
        low, high, count = text.split(":")
        ends = float(low), float(high), int(count)
    except ValueError:
        raise MdfconvError(f"--sweep takes LO:HI:COUNT, such as 0.001:1:10, not '{text}'") from None
    if not 1 <= ends[2] <= _LARGEST_SWEEP:
        raise MdfconvError(f"--sweep: COUNT is from 1 to {_LARGEST_SWEEP}")
    return ends
