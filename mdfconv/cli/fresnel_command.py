"""``mdfconv fresnel``."""

from __future__ import annotations

from typing import Annotated

from mdfconv.cli.options import ForceOption, FormatOption, OutputOption, PngOption, option
from mdfconv.cli.outputs import Outputs
from mdfconv.cli.tables import write_table

_IOR = option("N", "Relative index of refraction, 0.25 to 4, not near 1.")


def command(
    ior: Annotated[float, _IOR] = 1.4,
    mu: Annotated[float, option("M", "Mean of the weight in l.h = 2 (l.H)^2, 0 to 2.")] = 0.55,
    sigma: Annotated[float, option("S", "Standard deviation of the weight.")] = 0.12,
    format_: FormatOption = None,
    output: OutputOption = None,
    png: PngOption = None,
    force: ForceOption = False,
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
    from mdfconv.studies.fresnel import COLUMNS, draw_fresnel, error_rows, fit

    outputs = Outputs(png, table=output, force=force)
    fitted = fit(ior, mu, sigma)
    title = (
        f"exp2({fitted.a:.6g} {fitted.b:+.6g} l·h), IOR {ior:g}, weight {mu:g} ± {sigma:g} in l·h"
    )
    picture = {png: draw_fresnel(fitted)} if png else {}
    write_table(COLUMNS, error_rows(fitted), format_, outputs, beside=picture, title=title)
