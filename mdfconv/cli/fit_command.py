"""``mdfconv fit``."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from enum import StrEnum
from functools import partial
from pathlib import Path
from shlex import join
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mdfconv.cli import completion
from mdfconv.cli.options import (
    ForceOption,
    Format,
    FormatOption,
    OutputOption,
    PngOption,
    chosen_gamma,
    in_asked_forms,
    noted,
)
from mdfconv.cli.outputs import Outputs
from mdfconv.cli.process import tell
from mdfconv.cli.tables import form_of, progress, write_table
from mdfconv.errors import MdfconvError
from mdfconv.output.records import cell_text
from mdfconv.registry import ALL

if TYPE_CHECKING:
    from mdfconv.distributions import Distribution
    from mdfconv.distributions.endpoint import Endpoint
    from mdfconv.measured.analysis import Analysis, FitOptions
    from mdfconv.measured.readers import ReadOptions

# What a narrow terminal and the page of fits to two directions show first.
_CHIEF = ("file", "channel", "distribution", "parameter", "gamma", "rmse", "simplest")
_SECOND = ("stderr", "error", "reflectance", "diffuse", "specular", "masking")


class Quantity(StrEnum):
    """What was measured."""

    ndf = "ndf"
    brdf = "brdf"


class Loss(StrEnum):
    """What a fit minimizes."""

    linear = "linear"
    log = "log"
    cosine = "cosine"


class AngleIs(StrEnum):
    """What one angle is the angle of."""

    half = "half"
    reflected = "reflected"
    incident = "incident"


def _column_option(name: str, what: str) -> Any:
    help_ = f"Column of the {what}, by name or number from 1."
    return typer.Option(name, metavar="COLUMN", help=help_)


class Masking(StrEnum):
    """The masking of a BRDF."""

    smith = "smith"
    v_cavity = "v-cavity"
    none = "none"


def command(
    data: Annotated[
        list[str],
        typer.Argument(
            metavar="DATA...",
            help="Files of samples, or patterns such as '*.csv'; - is standard input.",
        ),
    ],
    targets: Annotated[
        list[str] | None,
        typer.Option(
            "--to",
            metavar="MDF",
            autocompletion=completion.targets,
            help="Distribution to fit, or the form in which its parameter is printed, such as "
            "ggx:roughness; repeatable; default all.",
        ),
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
    angle_is: Annotated[
        AngleIs | None,
        typer.Option(
            help="Of one angle: that of the half vector (default), or the zenith of the reflected "
            "or incident direction, the other along the normal."
        ),
    ] = None,
    theta_i: Annotated[str | None, _column_option("--theta-i", "incident zenith")] = None,
    phi_i: Annotated[str | None, _column_option("--phi-i", "incident azimuth")] = None,
    theta_o: Annotated[str | None, _column_option("--theta-o", "outgoing zenith")] = None,
    phi_o: Annotated[str | None, _column_option("--phi-o", "outgoing azimuth")] = None,
    angle_unit: Annotated[
        str | None,
        typer.Option(
            metavar="UNIT",
            autocompletion=completion.angle_units,
            help="degrees, radians or cosine; by default from the header.",
        ),
    ] = None,
    values: Annotated[
        list[str] | None,
        typer.Option("--values", metavar="COLUMN", help="Column of values; repeatable."),
    ] = None,
    cells: Annotated[
        int | None,
        typer.Option(
            metavar="N", min=1, help="Of a MERL file: N cells of the whole, not the slice θ_d ≈ 0."
        ),
    ] = None,
    max_angle: Annotated[
        float | None,
        typer.Option(
            metavar="DEG", help="Leave out larger angles; 80 by default for brdf at θ_d ≈ 0."
        ),
    ] = None,
    separate: Annotated[
        bool,
        typer.Option("--separate", help="Fit every channel on its own, not with one parameter."),
    ] = False,
    loss: Annotated[
        Loss,
        typer.Option(
            help="Squared residuals, those of logarithms, or of two directions those of f_r "
            "cos θ_i cos θ_o."
        ),
    ] = Loss.linear,
    masking: Annotated[
        Masking | None,
        typer.Option(
            help="Of two directions: smith, where a distribution has its Λ, else v-cavity; or one "
            "for all."
        ),
    ] = None,
    fresnel: Annotated[
        str | None,
        typer.Option(
            metavar="F",
            autocompletion=completion.fresnel_factors,
            help="Of two directions: none (default), schlick (F₀ 0.04), ior:N, or fit (F₀ free).",
        ),
    ] = None,
    robust: Annotated[
        bool, typer.Option("--robust", help="Of two directions: let outliers count less.")
    ] = False,
    gamma: Annotated[
        str | None,
        typer.Option(
            metavar="G",
            help="Second parameter, of gtr and student-t, as a number that is kept; free, or not "
            "given, it is fitted.",
        ),
    ] = None,
    tolerance: Annotated[
        float,
        typer.Option(metavar="T", help="How much worse than the best the simplest may be."),
    ] = 0.05,
    format_: FormatOption = None,
    output: OutputOption = None,
    png: PngOption = None,
    report: Annotated[
        Path | None,
        typer.Option(
            "--report",
            metavar="FILE",
            help="Write a page for a colleague: .html, or .md with its pictures.",
        ),
    ] = None,
    force: ForceOption = False,
) -> None:
    """Fit distributions to measured reflectance or to a measured distribution of normals.

    Of one angle, that of the half vector, the model is offset + scale · D̄(β); of two directions
    k_d/π + k_s D G F / (4 cos θ_i cos θ_o). A second parameter is fitted, too, unless --gamma
    gives it. Ranks the fits, best first, and marks the simplest one that is nearly as good.
    Several files make one table.

    Examples:

    mdfconv fit gold.binary

    mdfconv fit lobe.csv --to ggx --to beckmann --png lobe.png

    mdfconv fit scan.txt --angle theta --angle-unit degrees --values red --loss log

    mdfconv fit paint.csv --loss log --fresnel fit --report paint.html

    mdfconv fit '*.csv' --format csv -o fits.csv
    """
    from mdfconv.measured.readers import ReadOptions
    from mdfconv.output.files import find_files

    files = find_files(data)
    outputs = Outputs(png, report, table=output, force=force, inputs=files)
    if len(files) > 1 and (png or report):
        raise MdfconvError("--png and --report are of one file")
    if report:
        from mdfconv.measured.report import check_report_name

        check_report_name(report)
    ends = _ends(targets or [])
    options = _options(
        ends, gamma, _model(loss, masking, fresnel, robust=robust), quantity, max_angle,
        tolerance, separate=separate,
    )  # fmt: skip
    columns = ReadOptions(
        angle, theta_i, phi_i, theta_o, phi_o, tuple(values or ()), angle_unit,
        angle_is.value if angle_is else None, cells,
    )  # fmt: skip
    only_two = bool(masking or fresnel or robust or loss is Loss.cosine)
    analyses = _analyses(files, columns, options, only_two=only_two)
    form = form_of(format_, output)
    names, rows = _table(analyses, form, ends, separate)
    contents: dict[Path, bytes] = {}
    logarithms = loss is Loss.log
    if png:
        from mdfconv.measured.report import draw_analysis

        contents[png] = draw_analysis(analyses[0], logarithms=logarithms)
    if report:
        contents |= _report(analyses[0], report, ends, separate=separate, logarithms=logarithms)
    title = f"Fits to {analyses[0].name}" if len(analyses) == 1 else "Fits"
    ranked = "log_rmse" if logarithms and "log_rmse" in names else "rmse"
    minor = [*_SECOND, *(name for name in names if name not in _CHIEF + _SECOND), "rmse"]
    minor.remove(ranked)
    write_table(names, rows, form, outputs, beside=contents, title=title, secondary=minor)
    for analysis in analyses:
        _tell(analysis, tolerance, named=len(analyses) > 1)


def _model(loss: Loss, masking: Masking | None, fresnel: str | None, *, robust: bool) -> Any:
    from mdfconv.measured.brdf_fit import BrdfModel

    used = masking.value if masking else Masking.smith.value
    return BrdfModel(loss.value, used, fresnel or "none", robust)


def _options(
    ends: Sequence[Endpoint],
    gamma: str | None,
    model: Any,
    quantity: Quantity | None,
    max_angle: float | None,
    tolerance: float,
    *,
    separate: bool,
) -> FitOptions:
    from mdfconv.measured.analysis import FitOptions

    fixed = chosen_gamma(gamma)
    shape = fixed if isinstance(fixed, float) else None
    return FitOptions(
        targets=tuple(_targets(ends, shape)),
        gamma=shape,
        model=model,
        quantity=quantity.value if quantity else None,
        max_angle=max_angle,
        separate=separate,
        tolerance=tolerance,
    )


def _analyses(
    files: Sequence[Path], columns: ReadOptions, options: FitOptions, *, only_two: bool
) -> list[Analysis]:
    """Return the fits to each file; to several in processes."""
    work = partial(_analyse, columns=columns, options=options, only_two=only_two)
    if len(files) == 1:
        return [work(files[0])]
    analyses = []
    with (
        progress("Files", len(files)) as advance,
        ProcessPoolExecutor(min(len(files), os.cpu_count() or 1)) as pool,
    ):
        for analysis in pool.map(work, files):
            analyses.append(analysis)
            advance(1)
    return analyses


def _analyse(path: Path, columns: ReadOptions, options: FitOptions, *, only_two: bool) -> Analysis:
    from mdfconv.measured.analysis import analyse
    from mdfconv.measured.readers import read
    from mdfconv.measured.samples import DirectionalSamples

    samples = read(path, columns)
    if only_two and not isinstance(samples, DirectionalSamples):
        raise MdfconvError(
            f"{path}: --masking, --fresnel, --robust and --loss cosine need two directions",
            "this file has one angle",
        )
    return analyse(path.name, samples, options)


def _table(
    analyses: Sequence[Analysis], form: Format, ends: Sequence[Endpoint], separate: bool
) -> tuple[list[str], list[dict[str, Any]]]:
    """Return the names of the columns and a row for each fit."""
    rows = []
    for analysis in analyses:
        file = {"file": analysis.name} if len(analyses) > 1 else {}
        for result in analysis.results:
            channel = {"channel": result.samples.channels[0]} if separate else {}
            records = in_asked_forms(result.records(), ends)
            rows += [file | channel | record for record in records]
    names = list(dict.fromkeys(name for row in rows for name in row))
    rows = [{name: row.get(name) for name in names} for row in rows]
    return names, _shown(rows, form)


def _report(
    analysis: Analysis, path: Path, ends: Sequence[Endpoint], *, separate: bool, logarithms: bool
) -> dict[Path, bytes]:
    from mdfconv.measured.report import report_files, report_of

    names, rows = _table([analysis], Format.markdown, ends, separate)
    if "specular" in names:
        names = [name for name in names if name in _CHIEF + _SECOND]
        names = [name for name in names if any(row[name] != "" for row in rows)]
    texts = [{name: _cell(row[name]) for name in names} for row in rows]
    line = join(["mdfconv", *sys.argv[1:]])
    return report_files(report_of(analysis, texts, line, logarithms=logarithms), path)


def _cell(value: Any) -> str:
    """Return a cell of the report's table."""
    if isinstance(value, bool):
        return "yes" if value else ""
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _tell(analysis: Analysis, tolerance: float, *, named: bool) -> None:
    """Write notes and verdicts to standard error."""
    file = f"{analysis.name}: " if named else ""
    for note in analysis.notes:
        tell(f"{file}note: {note}")
    for result in analysis.results:
        channels = result.samples.channels
        channel = f"channel {channels[0]}: " if len(analysis.results) > 1 else ""
        cheap = result.simplest.distribution
        tell(
            f"{file}{channel}best is {result.fits[0].distribution.name}; simplest within "
            f"{100 * tolerance:g} % of its error is {cheap.name}, at {cheap.operations} "
            "operations an evaluation"
        )


def _ends(names: Sequence[str]) -> list[Endpoint]:
    """Return what is named, each once; nothing for all."""
    from mdfconv.distributions.endpoint import endpoint

    if ALL in [name.strip().lower() for name in names]:
        return []
    return list({end.label: end for end in (noted(endpoint(name)) for name in names)}.values())


def _targets(ends: Sequence[Endpoint], gamma: float | None) -> list[Distribution]:
    """Return the distributions to fit: of all those that a given γ leaves legal.

    Raises
    ------
    MdfconvError
        If γ is given and means nothing for those that are named.
    """
    import numpy as np

    from mdfconv.distributions import one_parameter_distributions

    every = not ends
    named = list(dict.fromkeys(end.distribution for end in ends))
    targets = named or one_parameter_distributions()
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


def _shown(rows: list[dict[str, Any]], form: Format) -> list[dict[str, Any]]:
    """Return the records for the form: lists and nulls where they have a place, else text."""
    if form in (Format.json, Format.table):
        return rows
    number = cell_text if form is Format.markdown else repr
    return [{key: _text(value, number) for key, value in row.items()} for row in rows]


def _text(value: Any, number: Callable[[float], str]) -> Any:
    if isinstance(value, list):
        return " ".join(map(number, value))
    return "" if value is None else value
