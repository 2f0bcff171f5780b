"""``mdfconv fit``."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mdfconv.cli.output import (
    FileOption,
    FormOption,
    TableFormat,
    default_form,
    record_text,
    write_records,
)
from mdfconv.errors import MdfconvError
from mdfconv.reports.text import file_bytes, write_files

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
        str, typer.Option(metavar="COLUMN", help="Column of angles, by name or number from 1.")
    ] = "1",
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
    gamma: Annotated[
        float | None, typer.Option(metavar="G", help="γ of gtr; fitted if not given.")
    ] = None,
    tolerance: Annotated[
        float,
        typer.Option(metavar="T", help="How much worse than the best the simplest may be."),
    ] = 0.05,
    format_: FormOption = None,
    output: FileOption = None,
    png: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Draw data, fits and residuals.")
    ] = None,
) -> None:
    """Fit distributions to measured reflectance or to a measured distribution of normals.

    The model is offset + scale · D̄(β). Reads text (CSV, TSV, blanks; an angle and one or more
    values a row), ALTA's 1-D text format and MERL's .binary. Ranks the fits, best first, and
    marks the simplest one that is nearly as good.

    Examples:

    mdfconv fit gold.binary

    mdfconv fit lobe.csv --to ggx --to beckmann --png lobe.png

    mdfconv fit scan.txt --angle theta --angle-unit degrees --values red --loss log
    """
    if not tolerance >= 0:
        raise MdfconvError("--tolerance is not negative")
    _check_places(data, output, png)
    samples = _read(data, angle, angle_unit, values)
    samples = _restrict(samples, quantity, max_angle, data)
    parts = _parts(samples) if separate else [samples]
    results = [_fit(part, _targets(targets), loss, gamma, tolerance, data) for part in parts]
    form = format_ or default_form(output)
    columns, rows = _table(results, form, separate)
    contents = {}
    if output:
        contents[output] = file_bytes(record_text(columns, rows, form))
    if png:
        contents[png] = _picture(results[0], data.name, many=samples.values.shape[1] > 1)
    write_files(contents)
    if not output:
        write_records(columns, rows, form, None, f"Fits to {data.name}")
    _tell(samples, results, tolerance, separate)


@dataclass(frozen=True)
class _Result:
    """The fits to one set of samples, best first, and the simplest good one."""

    samples: Samples
    fits: list[LobeFit]
    simplest: LobeFit


def _check_places(data: Path, *places: Path | None) -> None:
    """Refuse to write over the measurements."""
    for place in places:
        if place and place.exists() and data.exists() and place.samefile(data):
            raise MdfconvError(f"{place} is the file of samples: write to another one")


def _fit(
    samples: Samples,
    targets: list[Distribution],
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
    results: list[_Result], form: TableFormat, separate: bool
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
    notes = list(samples.notes)
    if any(fit.at_limit for result in results for fit in result.fits):
        notes.append("γ of gtr is at the end of the range that is searched")
    for note in notes:
        typer.echo(f"mdfconv: note: {note}", err=True)
    for result in results:
        channel = f"channel {result.samples.channels[0]}: " if separate else ""
        cheap = result.simplest.distribution
        typer.echo(
            f"mdfconv: {channel}best is {result.fits[0].distribution.name}; simplest within "
            f"{100 * tolerance:g} % of its error is {cheap.name}, at {cheap.operations} "
            "operations an evaluation",
            err=True,
        )


def _read(path: Path, angle: str, unit: str | None, values: list[str] | None) -> Samples:
    from mdfconv.measured.merl import read_merl
    from mdfconv.measured.text import Columns, read_text

    try:
        columns = Columns(angle, unit, tuple(values or ()))
        if path.suffix.lower() == ".binary":
            columns.refuse(path, "a MERL file has no columns")
            return read_merl(path)
        return read_text(path, columns)
    except OSError as error:
        raise MdfconvError(f"cannot read {path}: {error.strerror}") from None


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


def _targets(names: list[str] | None) -> list[Distribution]:
    from mdfconv.cli.names import one_parameter_distributions
    from mdfconv.distributions import distribution

    if not names or "all" in [name.lower() for name in names]:
        return one_parameter_distributions()
    return list(dict.fromkeys(distribution(name) for name in names))


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
        "gamma": fit.parameters[1] if free else getattr(fit.distribution, "gamma", None),
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


def _shown(rows: list[dict[str, Any]], form: TableFormat) -> list[dict[str, Any]]:
    """Return the records for the form: lists and nulls in JSON, text in the others."""
    if form is TableFormat.json:
        return rows
    number = repr if form is TableFormat.csv else "{:.4g}".format
    return [{key: _text(value, number) for key, value in row.items()} for row in rows]


def _text(value: Any, number: Callable[[float], str]) -> Any:
    if isinstance(value, list):
        return " ".join(map(number, value))
    return "" if value is None else value
