"""``mdfconv fit``."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from shlex import join
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from mdfconv.cli import completion, options, process, tables
from mdfconv.cli.options import Format, argument, flag, option
from mdfconv.cli.outputs import Outputs
from mdfconv.errors import MdfconvError
from mdfconv.output.records import cell_text
from mdfconv.registry import ALL

if TYPE_CHECKING:
    from mdfconv.distributions import Distribution
    from mdfconv.distributions.endpoint import Endpoint
    from mdfconv.measured import Analysis, ReadOptions

# What a narrow terminal and the page of fits to two directions show first.
_CHIEF = ("file", "channel", "distribution", "parameter", "gamma", "rmse", "simplest")
_SECOND = ("stderr", "error", "reflectance", "diffuse", "specular", "masking")


def _column(what: str, otherwise: str = "") -> Any:
    return option("COLUMN", f"Column of {what}, by name or number from 1{otherwise}.")


_DATA = argument("DATA...", "Files of samples, or patterns such as '*.csv'; - is standard input.")
_TARGETS = option(
    "MDF",
    "Distribution to fit, or the form in which its parameter is printed, such as "
    "ggx:roughness; repeatable; default all.",
    "--to",
    words=completion.targets,
)
_QUANTITY = typer.Option(
    help="ndf (default for text), or brdf at θ_d ≈ 0 (default for MERL, ALTA)."
)
_ANGLE_IS = typer.Option(
    help="Of one angle: that of the half vector (default for a bare angle), the zenith of the "
    "reflected or incident direction (default for names such as theta_r), or the angle from the "
    "specular direction, positive towards the horizon."
)
_INCIDENCE = option(
    "DEG",
    "Angle of incidence of a scan with one angle, that of the detector; by default from a comment "
    "such as '# theta_i = 45 deg'. With --angle-is incident the angle of the detector.",
)
_VALUES_ARE = typer.Option(
    help="brdf: f_r, 1/sr (default); factor: reflectance factors π f_r, divided by π."
)
_UNCERTAINTY = option(
    "COLUMN",
    "Column of standard uncertainties, one for all values or repeated for each; by default from "
    "names such as u_brdf, sigma or std.",
)
_WAVELENGTH = option(
    "NM", "Of a table with a column of wavelengths: the rows of one; default all, a channel each."
)
_ANGLE_UNIT = option(
    "UNIT", "degrees, radians or cosine; by default from the header.", words=completion.angle_units
)
_CELLS = option("N", "Of a MERL file: N cells of the whole, not the slice θ_d ≈ 0.", min=1)
_MAX_ANGLE = option("DEG", "Leave out larger angles; 80 by default for brdf at θ_d ≈ 0.")
_SEPARATE = flag("--separate", "Fit every channel on its own, not with one parameter.")
_LOSS = typer.Option(
    help="Squared residuals, those of logarithms, or of two directions those of f_r "
    "cos θ_i cos θ_o."
)
_MASKING = typer.Option(
    help="Of two directions: smith, where a distribution has its Λ, else v-cavity; or one for all."
)
_FRESNEL = option(
    "F",
    "Of two directions: none (default), schlick (F₀ 0.04), ior:N, or fit (F₀ free).",
    words=completion.fresnel_factors,
)
_ROBUST = flag("--robust", "Of two directions: let outliers count less.")
_GAMMA = option(
    "G",
    "Second parameter, of gtr and student-t, as a number that is kept; free, or not "
    "given, it is fitted.",
)
_TOLERANCE = option("T", "How much worse than the best the simplest may be.")
_REPORT = option("FILE", "Write a page for a colleague: .html, or .md with its pictures.")


def command(
    data: Annotated[list[str], _DATA],
    targets: Annotated[list[str] | None, _TARGETS] = None,
    quantity: Annotated[Literal["ndf", "brdf"] | None, _QUANTITY] = None,
    angle: Annotated[str | None, _column("angles", "; by default from the names")] = None,
    angle_is: Annotated[
        Literal["half", "reflected", "incident", "specular"] | None, _ANGLE_IS
    ] = None,
    incidence: Annotated[float | None, _INCIDENCE] = None,
    theta_i: Annotated[str | None, _column("the incident zenith")] = None,
    phi_i: Annotated[str | None, _column("the incident azimuth")] = None,
    theta_o: Annotated[str | None, _column("the outgoing zenith")] = None,
    phi_o: Annotated[str | None, _column("the outgoing azimuth")] = None,
    angle_unit: Annotated[str | None, _ANGLE_UNIT] = None,
    values: Annotated[list[str] | None, option("COLUMN", "Column of values; repeatable.")] = None,
    values_are: Annotated[Literal["brdf", "factor"] | None, _VALUES_ARE] = None,
    uncertainty: Annotated[list[str] | None, _UNCERTAINTY] = None,
    wavelength: Annotated[float | None, _WAVELENGTH] = None,
    cells: Annotated[int | None, _CELLS] = None,
    max_angle: Annotated[float | None, _MAX_ANGLE] = None,
    separate: Annotated[bool, _SEPARATE] = False,
    loss: Annotated[Literal["linear", "log", "cosine"], _LOSS] = "linear",
    masking: Annotated[Literal["smith", "v-cavity", "none"] | None, _MASKING] = None,
    fresnel: Annotated[str | None, _FRESNEL] = None,
    robust: Annotated[bool, _ROBUST] = False,
    gamma: Annotated[str | None, _GAMMA] = None,
    tolerance: Annotated[float, _TOLERANCE] = 0.05,
    format_: options.FormatOption = None,
    output: options.OutputOption = None,
    png: options.PngOption = None,
    report: Annotated[Path | None, _REPORT] = None,
    force: options.ForceOption = False,
) -> None:
    """Fit distributions to measured reflectance or to a measured distribution of normals.

    Of one angle, that of the half vector, the model is offset + scale · D̄(β); of two directions
    k_d/π + k_s D G F / (4 cos θ_i cos θ_o). A second parameter is fitted, too, unless --gamma
    gives it. Samples of two directions that are exactly 0 are left out: the detector was in the
    way of the light. Ranks the fits, best first, and marks the simplest one that is nearly as good.
    Several files make one table.

    Examples:

    mdfconv fit gold.binary

    mdfconv fit lobe.csv --to ggx --to beckmann --png lobe.png

    mdfconv fit scan.txt --angle theta --angle-unit degrees --values red --loss log

    mdfconv fit paint.csv --loss log --fresnel fit --report paint.html

    mdfconv fit '*.csv' --format csv -o fits.csv
    """
    from mdfconv.measured import ReadOptions
    from mdfconv.measured.brdf_fit import BrdfModel
    from mdfconv.output.files import find_files

    files = find_files(data)
    outputs = Outputs(png, report, table=output, force=force, inputs=files)
    if len(files) > 1 and (png or report):
        raise MdfconvError("--png and --report are of one file")
    if report:
        from mdfconv.measured.report import check_report_name

        check_report_name(report)
    ends = _ends(targets or [])
    fixed = options.chosen_gamma(gamma)
    shape = fixed if isinstance(fixed, float) else None
    settings = {
        "targets": _targets(ends, shape),
        "gamma": shape,
        **vars(BrdfModel(loss, masking or "smith", fresnel or "none", robust)),
        "quantity": quantity,
        "max_angle": max_angle,
        "separate": separate,
        "tolerance": tolerance,
    }
    columns = ReadOptions(
        angle=angle,
        theta_i=theta_i,
        phi_i=phi_i,
        theta_o=theta_o,
        phi_o=phi_o,
        values=tuple(values or ()),
        uncertainty=tuple(uncertainty or ()),
        unit=angle_unit,
        angle_is=angle_is,
        incidence=incidence,
        wavelength=wavelength,
        values_are=values_are,
        cells=cells,
    )
    needs_two = bool(masking or fresnel or robust or loss == "cosine")
    work = partial(_analysis, columns=columns, settings=settings, needs_two=needs_two)
    analyses = [work(files[0])] if len(files) == 1 else _in_processes(work, files)
    names, rows = _table(analyses, ends, separate=separate)
    contents: dict[Path, bytes] = {}
    logarithms = loss == "log"
    if png:
        from mdfconv.measured.figures import draw_analysis

        contents[png] = draw_analysis(analyses[0], logarithms=logarithms)
    if report:
        from mdfconv.measured.report import report_files

        line = join(["mdfconv", *sys.argv[1:]])
        texts = _shown(rows, "markdown")
        contents |= report_files(
            analyses[0], texts, line, report, chief=_CHIEF + _SECOND, logarithms=logarithms
        )
    title = f"Fits to {analyses[0].name}" if len(analyses) == 1 else "Fits"
    ranked = "log_rmse" if logarithms and "log_rmse" in names else "rmse"
    minor = [*_SECOND, *(name for name in names if name not in _CHIEF + _SECOND), "rmse"]
    minor.remove(ranked)
    form = tables.form_of(format_, output)
    shown = _shown(rows, form)
    tables.write_table(names, shown, form, outputs, beside=contents, title=title, secondary=minor)
    for analysis in analyses:
        _tell(analysis, tolerance, named=len(analyses) > 1)


def _analysis(
    path: Path, columns: ReadOptions, settings: dict[str, Any], *, needs_two: bool
) -> Analysis:
    """Return the fits to a file."""
    from mdfconv.measured import Samples, fit, read

    samples = read(path, columns)
    if needs_two and isinstance(samples, Samples):
        reason = "--masking, --fresnel, --robust and --loss cosine need two directions"
        raise MdfconvError(f"{path}: {reason}", "this file has one angle")
    return fit(samples, name=path.name, **settings)


def _in_processes(work: Callable[[Path], Analysis], files: Sequence[Path]) -> list[Analysis]:
    """Return the fits to several files, with a bar on a terminal."""
    analyses = []
    with (
        tables.progress("Files", len(files)) as advance,
        ProcessPoolExecutor(min(len(files), os.cpu_count() or 1)) as pool,
    ):
        for analysis in pool.map(work, files):
            analyses.append(analysis)
            advance(1)
    return analyses


def _table(
    analyses: Sequence[Analysis], ends: Sequence[Endpoint], *, separate: bool
) -> tuple[list[str], list[dict[str, Any]]]:
    """Return the names of the columns and a row for each fit."""
    rows = []
    for analysis in analyses:
        file = {"file": analysis.name} if len(analyses) > 1 else {}
        for result in analysis.results:
            channel = {"channel": result.samples.channels[0]} if separate else {}
            records = options.in_asked_forms(result.records(), ends)
            rows += [file | channel | record for record in records]
    names = list(dict.fromkeys(name for row in rows for name in row))
    return names, [{name: row.get(name) for name in names} for row in rows]


def _shown(rows: list[dict[str, Any]], form: Format) -> list[dict[str, Any]]:
    """Return the records for the form: lists and nulls where they have a place, else text."""
    if form in ("json", "table"):
        return rows
    number = cell_text if form == "markdown" else repr

    def text(value: Any) -> Any:
        if isinstance(value, list):
            return " ".join(map(number, value))
        return "" if value is None else value

    return [{name: text(value) for name, value in row.items()} for row in rows]


def _tell(analysis: Analysis, tolerance: float, *, named: bool) -> None:
    """Write notes and verdicts to standard error."""
    file = f"{analysis.name}: " if named else ""
    for note in analysis.notes:
        process.tell(f"{file}note: {note}")
    for result in analysis.results:
        channels = result.samples.channels
        channel = f"channel {channels[0]}: " if len(analysis.results) > 1 else ""
        cheap = result.simplest.distribution
        process.tell(
            f"{file}{channel}best is {result.fits[0].distribution.name}; simplest within "
            f"{100 * tolerance:g} % of its error is {cheap.name}, at {cheap.operations} "
            "operations an evaluation"
        )


def _ends(names: Sequence[str]) -> list[Endpoint]:
    """Return what is named, each once; nothing for all."""
    from mdfconv.distributions.endpoint import endpoint

    if ALL in [name.strip().lower() for name in names]:
        return []
    ends = (options.noted(endpoint(name)) for name in names)
    return list({end.label: end for end in ends}.values())


def _targets(ends: Sequence[Endpoint], gamma: float | None) -> list[Distribution]:
    """Return the distributions to fit, and say which of all a given γ leaves out."""
    from mdfconv.measured.analysis import fitted_distributions

    named = list(dict.fromkeys(end.distribution for end in ends))
    targets = fitted_distributions(named, gamma)
    for mdf in () if named else fitted_distributions(None, None):
        if mdf not in targets:
            process.tell(f"note: {mdf.name} is left out: it has no γ = {gamma:g}")
    return targets
