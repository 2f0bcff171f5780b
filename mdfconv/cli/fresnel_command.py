"""``mdfconv fresnel``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from mdfconv.cli.output import (
    FileOption,
    FormOption,
    TableFormat,
    check_distinct,
    default_form,
    write_records,
)


def command(
    ior: Annotated[
        float,
        typer.Option(metavar="N", help="Relative index of refraction, 0.25 to 4, not near 1."),
    ] = 1.4,
    mu: Annotated[
        float, typer.Option(metavar="M", help="Mean of the weight in l.h = 2 (l.H)^2, 0 to 2.")
    ] = 0.55,
    sigma: Annotated[
        float, typer.Option(metavar="S", help="Standard deviation of the weight.")
    ] = 0.12,
    format_: FormOption = None,
    output: FileOption = None,
    png: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Draw the curves and their errors.")
    ] = None,
) -> None:
    """Fit the Fresnel term of the Smoothie article: exp2(a + b l.h), h = l + v not normalized.

    The reflectance is F0 + (1 - F0) times the term. Weighted least squares to the exact curve of a
    dielectric; by default the article's fit. Beside it stand the printed constants, Schlick's
    (1-x)^5 and exp(-6x), x = l.H: `weighted_rms` is the error under the weight, `max_error`
    and `rms_error` are those on a range of l.H.

    Examples:

    mdfconv fresnel

    mdfconv fresnel --ior 1.5 --mu 1 --sigma 0.5 --png fresnel.png

    mdfconv fresnel --format json
    """
    from mdfconv.brdf.fresnel_fit import fit
    from mdfconv.reports.fresnel_page import COLUMNS, draw_fresnel, error_rows
    from mdfconv.reports.text import write_files

    check_distinct(png, output)
    found = fit(ior, mu, sigma)
    rows = error_rows(found)
    form = format_ or default_form(output)
    if form is not TableFormat.json:
        # Null has no other form than JSON's: a cell stays empty.
        rows = [
            {name: "" if value is None else value for name, value in row.items()} for row in rows
        ]
    if png:
        write_files({png: draw_fresnel(found)})
    title = f"exp2({found.a:.6g} {found.b:+.6g} l·h), IOR {ior:g}, weight {mu:g} ± {sigma:g} in l·h"
    write_records(COLUMNS, rows, form, output, title)
    if png:
        typer.echo(f"mdfconv: wrote {png}", err=True)
