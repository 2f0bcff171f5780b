"""``mdfconv stability``."""

from __future__ import annotations

from typing import Annotated, Literal

import typer

from mdfconv.cli import completion, tables
from mdfconv.cli.options import ForceOption, FormatOption, OutputOption, option
from mdfconv.cli.outputs import Outputs

# Of a table in a narrow terminal.
_SECONDARY = ("textbook", "worst", "error_in_eps", "cases", "out_of_range")

_MDF = option("MDF", "Only this distribution; repeatable.", words=completion.distributions)
_PART = typer.Option(help="Only this part.")


def command(
    format_: FormatOption = None,
    output: OutputOption = None,
    force: ForceOption = False,
    mdf: Annotated[list[str] | None, _MDF] = None,
    part: Annotated[Literal["kernels", "conversions"] | None, _PART] = None,
) -> None:
    """Audit the hard cases: errors against 50-digit values, beside those of the printed formulas.

    For every distribution the unit form, the normalized form and the conversions from it, where
    formulas lose their digits: mirror-smooth surfaces, grazing angles, edges, limits. `error` is
    the worst relative error, `error_in_eps` the same in units of the type's rounding, `textbook`
    that of the printed expression in plain NumPy. `out_of_range` counts exact values that the
    type holds as 0, a subnormal number or infinity only; any other result there is an error of
    inf.

    Examples:

    mdfconv stability

    mdfconv stability --mdf ggx --part kernels

    mdfconv stability --part conversions --format markdown
    """
    from mdfconv.studies.stability import COLUMNS, audit

    outputs = Outputs(table=output, force=force)
    rows = [finding.record() for finding in audit(mdf or (), part)]
    title = "Hard cases: worst relative errors"
    tables.write_table(COLUMNS, rows, format_, outputs, title=title, secondary=_SECONDARY)
