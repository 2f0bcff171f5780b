"""``mdfconv fit``."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mdfconv.cli.options import (
    Format,
    FormatOption,
    GammaOption,
    OutputOption,
    PngOption,
    chosen_gamma,
)
from mdfconv.cli.outputs import check_outputs
from mdfconv.cli.tables import form_of, table_text, tell, write_table
from mdfconv.errors import MdfconvError
from mdfconv.output.files import file_bytes, write_files

if TYPE_CHECKING:
    from mdfconv.distributions import Distribution
    from mdfconv.measured.lobe_fit import LobeFit
    from mdfconv.measured.samples import Samples

_BRDF_LIMIT = 80.0  # degrees


class Quantity(StrEnum):
    """What was measured."""

    ndf = "ndf"
    brdf = "brdf"


class Loss(StrEnum):
    """What a fit minimizes."""

    linear = "linear"
    log = "log"


def command(
    data: Annotated[Path, typer.Argument(metavar="DATA", help="File of samples.")],
    targets: Annotated[
        list[str] | None,
        typer.Option("--to", metavar="MDF", help="Distribution to fit; repeatable; default all."),
    ] = None,
    quantity: Annotated[
        Quantity | None,
        typer.Option(help="ndf (default for text), or brdf at θ_d ≈ 0 (default for MERL, ALTA)."),
    ] = None,
    angle: Annotated[
        str | None,
        typer.Option(
            metavar="COLUMN",
            help="Column of angles, by name or number from 1; by default from the names.",
        ),
    ] = None,
    angle_unit: Annotated[
        str | None,
        typer.Option(
            metavar="UNIT", help="degrees, radians or cosine; by default from the header."
        ),
    ] = None,
    values: Annotated[
        list[str] | None,
        typer.Option("--values", metavar="COLUMN", help="Column of values; repeatable."),
    ] = None,
    max_angle: Annotated[
        float | None,
        typer.Option(metavar="DEG", help="Leave out larger angles; 80 by default for brdf."),
    ] = None,
    separate: Annotated[
        bool,
        typer.Option("--separate", help="Fit every channel on its own, not with one parameter."),
    ] = False,
    loss: Annotated[Loss, typer.Option(help="Squared residuals, or those of logarithms.")] = (
        Loss.linear
    ),
    gamma: GammaOption = None,
    tolerance: Annotated[
        float,
        typer.Option(metavar="T", help="How much worse than the best the simplest may be."),
    ] = 0.05,
    format_: FormatOption = None,
    output: OutputOption = None,
    png: PngOption = None,
) -> None:
    """Fit distributions to measured reflectance or to a measured distribution of normals.

    The model is offset + scale · D̄(β); a second parameter is fitted, too, unless --gamma gives it.
    Reads text (CSV, TSV, blanks; an angle and one or more
    values a row), ALTA's 1-D text format and MERL's .binary. Ranks the fits, best first, and
    marks the simplest one that is nearly as good.

    Examples:

    mdfconv fit gold.binary

    mdfconv fit lobe.csv --to ggx --to beckmann --png lobe.png

    mdfconv fit scan.txt --angle theta --angle-unit degrees --values red --loss log
    """
    if not tolerance >= 0:
        raise MdfconvError("--tolerance is not negative")
    check_outputs(png, output, inputs=[data])
    fixed = chosen_gamma(gamma)
    shape = fixed if isinstance(fixed, float) else None
    samples = _restrict(_read(data, angle, angle_unit, values), quantity, max_angle, data)
    parts = _parts(samples) if separate else [samples]
    distributions = _targets(targets, shape)
    results = [_fit(part, distributions, loss, shape, tolerance, data) for part in parts]
    form = form_of(format_, output)
    columns, rows = _table(results, form, separate)
    contents = {}
    if output:
        contents[output] = file_bytes(table_text(columns, rows, form))
    if png:
        contents[png] = _picture(results[0], data.name, many=samples.values.shape[1] > 1)
    write_files(contents)
    if not output:
        write_table(columns, rows, form, title=f"Fits to {data.name}")
    _tell(samples, results, tolerance, separate)


@dataclass(frozen=True)
class _Result:
    """The fits to one set of samples, best first, and the simplest good one."""

    samples: Samples
    fits: list[LobeFit]
    simplest: LobeFit


def _fit(
    samples: Samples,
    targets: Sequence[Distribution],
    loss: Loss,
    gamma: float | None,
    tolerance: float,
    path: Path,
) -> _Result:
    from mdfconv.measured.lobe_fit import fit_lobe, rank, simplest

    try:
        fits = [fit_lobe(samples, target, loss.value, gamma=gamma) for target in targets]
    except MdfconvError as error:
        raise MdfconvError(f"{path}: {error}") from None
    return _Result(samples, rank(fits, loss), simplest(fits, tolerance, loss))


def _table(
    results: list[_Result], form: Format, separate: bool
) -> tuple[list[str], list[dict[str, Any]]]:
    rows = []
    for result in results:
        channel = {"channel": result.samples.channels[0]} if separate else {}
        rows += [channel | _record(fit, fit is result.simplest) for fit in result.fits]
    return list(rows[0]), _shown(rows, form)


def _picture(result: _Result, name: str, *, many: bool) -> bytes:
    from mdfconv.reports.fit_figure import draw_fits

    channel = f", channel {result.samples.channels[0]}" if many else ""
    return draw_fits(result.samples, result.fits, name + channel)


def _tell(samples: Samples, results: list[_Result], tolerance: float, separate: bool) -> None:
    """Write notes and verdicts to standard error."""
    limited = [fit.distribution for result in results for fit in result.fits if fit.at_limit]
    notes = [
        f"γ of {name} is at the end of the range that is searched"
        for name in dict.fromkeys(distribution.name for distribution in limited)
    ]
    for note in (*samples.notes, *notes):
        tell(f"note: {note}")
    for result in results:
        channel = f"channel {result.samples.channels[0]}: " if separate else ""
        cheap = result.simplest.distribution
        tell(
            f"{channel}best is {result.fits[0].distribution.name}; simplest within "
            f"{100 * tolerance:g} % of its error is {cheap.name}, at {cheap.operations} "
            "operations an evaluation"
        )


def _read(path: Path, angle: str | None, unit: str | None, values: list[str] | None) -> Samples:
    from mdfconv.measured.readers import ReadOptions, read
    from mdfconv.measured.samples import Samples

    samples = read(path, ReadOptions(angle=angle, unit=unit, values=tuple(values or ())))
    if not isinstance(samples, Samples):
        raise MdfconvError(f"{path}: values against two directions are not fitted yet")
    return samples


def _restrict(
    samples: Samples, quantity: Quantity | None, max_angle: float | None, path: Path
) -> Samples:
    """Set the quantity, leave out angles beyond the limit, and say what the model leaves out."""
    import numpy as np

    kind = quantity.value if quantity else samples.quantity
    limit = max_angle if max_angle is not None else (_BRDF_LIMIT if kind == "brdf" else 90.0)
    if not 0 < limit <= 90:
        raise MdfconvError("--max-angle is above 0 and at most 90 degrees")
    keep = samples.beta <= np.radians(limit) * (1 + 1e-12)
    notes = samples.notes
    if kind == "brdf":
        notes = (*notes, "brdf: the lobe is D̄/cos²β at θ_d = 0; masking is left out")
    if not keep.all():
        count = int(np.count_nonzero(~keep))
        notes = (*notes, f"{count} of {keep.size} samples beyond {limit:g}° are left out")
    if not keep.any():
        raise MdfconvError(f"{path}: no samples up to {limit:g}°")
    return replace(
        samples, beta=samples.beta[keep], values=samples.values[keep], quantity=kind, notes=notes
    )


def _targets(names: list[str] | None, gamma: float | None) -> list[Distribution]:
    """Return the distributions to fit: of all those that a given γ leaves legal.

    Raises
    ------
    MdfconvError
        If a name is unknown, or γ is given and means nothing for those that are named.
    """
    import numpy as np

    from mdfconv.distributions import distribution, one_parameter_distributions

    every = not names or "all" in [name.lower() for name in names]
    if every:
        targets = one_parameter_distributions()
    else:
        targets = list(dict.fromkeys(distribution(name) for name in names or ()))
    if gamma is None:
        return targets
    second = [target for target in targets if target.second_parameter]
    if not second:
        raise MdfconvError(f"{targets[0].name} has one parameter and no γ")
    illegal = [
        target
        for target in second
        if target.second_parameter and not target.second_parameter.accepts(np.asarray(gamma))
    ]
    if illegal and (not every or len(illegal) == len(second)):
        illegal[0].with_gamma(gamma)  # says what is legal
    for target in illegal:
        tell(f"note: {target.name} is left out: it has no γ = {gamma:g}")
    return [target for target in targets if target not in illegal]


def _parts(samples: Samples) -> list[Samples]:
    return [
        replace(samples, values=samples.values[:, place : place + 1], channels=(name,))
        for place, name in enumerate(samples.channels)
    ]


def _record(fit: LobeFit, is_simplest: bool) -> dict[str, Any]:
    free = len(fit.parameters) > 1
    return {
        "distribution": fit.distribution.name,
        "parameter": fit.parameters[0],
        "gamma": fit.parameters[1] if free else fit.distribution.gamma,
        "stderr": fit.errors[0],
        "gamma_stderr": fit.errors[1] if free else None,
        "offset": list(fit.offset),
        "scale": list(fit.scale),
        "rmse": fit.rmse,
        "log_rmse": fit.log_rmse,
        "aic": fit.aic,
        "bic": fit.bic,
        "simplest": is_simplest,
    }


def _shown(rows: list[dict[str, Any]], form: Format) -> list[dict[str, Any]]:
    """Return the records for the form: lists and nulls in JSON, text in the others."""
    if form is Format.json:
        return rows
    number = repr if form is Format.csv else "{:.4g}".format
    return [{key: _text(value, number) for key, value in row.items()} for row in rows]


def _text(value: Any, number: Callable[[float], str]) -> Any:
    if isinstance(value, list):
        return " ".join(map(number, value))
    return "" if value is None else value
