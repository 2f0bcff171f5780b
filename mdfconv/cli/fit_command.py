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
from mdfconv.cli.options import argument, flag, option
from mdfconv.cli.outputs import Outputs
from mdfconv.errors import MdfconvError
from mdfconv.output.records import with_error
from mdfconv.registry import ALL

if TYPE_CHECKING:
    from mdfconv.distributions.endpoint import Endpoint
    from mdfconv.measured import Analysis, ReadOptions
    from mdfconv.measured.model import LobeShape

# What a narrow terminal leaves out first, from the end.
_SECONDARY = ("k_s", "n", "validated error", "F₀")
# What may make right what a check finds, by the argument that it names.
_HINTS = {"values_are": "--values-are factor"}
# Of more channels a table for people has the range.
_MOST_CHANNELS = 3


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
_MAX_ANGLE = option("DEG", "Leave out larger angles; default 80, of an ndf 90.")
_SEPARATE = flag("--separate", "Fit every channel on its own, not with one parameter.")
_LOSS = typer.Option(
    help="What is squared: differences of logarithms, of values, and of two directions of "
    "f_r cos θ_i cos θ_o or of the cube roots of f_r cos θ_o."
)
_MASKING = typer.Option(help="Of two directions: smith (default), v-cavity or none.")
_FRESNEL = option(
    "F",
    "Of two directions: auto (default; dielectric or metal, by BIC), dielectric (n is fitted), "
    "metal (F₀ of each channel is fitted), ior:N, or none (F = 1, k_s is fitted).",
    words=completion.fresnel_factors,
)
_FREE_SPECULAR = flag("--free-specular", "Of two directions: fit k_s, too, which else is 1.")
_NO_ROBUST = flag("--no-robust", "Let outliers count fully.")
_APERTURE = option("DEG", "Of two directions: diameter of the detector, over which to average.")
_NOISE = option("SHARE", "Relative standard deviation of values, such as 2% or 0.02.")
_FLOOR = option("VALUE", "Absolute standard deviation of values, 1/sr.")
_GAMMA = option(
    "G",
    "Second parameter, of gtr and student-t, as a number that is kept; free, or not "
    "given, it is fitted.",
)
_REPORT = option("FILE", "Write a report: .html, or .md with its pictures.")


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
    loss: Annotated[Literal["log", "linear", "cosine", "cube-root"], _LOSS] = "log",
    masking: Annotated[Literal["smith", "v-cavity", "none"] | None, _MASKING] = None,
    fresnel: Annotated[str | None, _FRESNEL] = None,
    free_specular: Annotated[bool, _FREE_SPECULAR] = False,
    no_robust: Annotated[bool, _NO_ROBUST] = False,
    aperture: Annotated[float | None, _APERTURE] = None,
    noise: Annotated[str | None, _NOISE] = None,
    floor: Annotated[float | None, _FLOOR] = None,
    gamma: Annotated[str | None, _GAMMA] = None,
    format_: options.FormatOption = None,
    output: options.OutputOption = None,
    png: options.PngOption = None,
    report: Annotated[Path | None, _REPORT] = None,
    force: options.ForceOption = False,
) -> None:
    """Fit distributions to measured reflectance or to a measured distribution of normals.

    Of two directions the model is k_d/π + k_s D G F / (4 cos θ_i cos θ_o) with k_s = 1: F carries
    the strength of the reflection, as a dielectric's or a metal's. Of one angle, that of the half
    vector, it is offset + scale · D̄(β). Samples of 0 or less are left out. Recommends the simplest
    distribution whose error, at angles of incidence that were left out, is within one standard
    error of the least one, and says how well it describes the surface. ggx+ggx is the mixture of
    two GGX lobes. Several files make one table and one report.

    Examples:

    mdfconv fit paint.csv --report paint.html

    mdfconv fit gold.binary

    mdfconv fit lobe.csv --to ggx --to beckmann --png lobe.png

    mdfconv fit detector.csv --incidence 45

    mdfconv fit scan.txt --angle theta --angle-unit degrees --values red --loss linear

    mdfconv fit '*.csv' --format csv -o fits.csv
    """
    from mdfconv.measured import ReadOptions
    from mdfconv.measured.model import BrdfModel
    from mdfconv.output.files import find_files

    files = find_files(data)
    outputs = Outputs(png, report, table=output, force=force, inputs=files)
    if len(files) > 1 and png:
        raise MdfconvError("--png is of one file", "--report takes several")
    if report:
        from mdfconv.measured.report import check_report_name

        check_report_name(report)
    ends = _ends(targets or [])
    fixed = options.chosen_gamma(gamma)
    shape = fixed if isinstance(fixed, float) else None
    share = None if noise is None else options.share(noise, "noise")
    model = BrdfModel(
        loss, masking or "smith", fresnel or "auto", free_specular, not no_robust, aperture, share,
        floor,
    )  # fmt: skip
    settings = {
        "targets": _targets(targets or [], ends, shape),
        "gamma": shape,
        **vars(model),
        "quantity": quantity,
        "max_angle": max_angle,
        "separate": separate,
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
    directional = {
        "masking": masking, "fresnel": fresnel, "free-specular": free_specular,
        "aperture": aperture, "noise": noise, "floor": floor,
        "loss cosine": loss == "cosine", "loss cube-root": loss == "cube-root",
    }  # fmt: skip
    needs_two = [f"--{name}" for name, given in directional.items() if given]
    work = partial(
        _analysis,
        columns=columns,
        settings=settings,
        needs_two=needs_two,
        is_reported=report is not None,
    )
    analyses = [work(files[0])] if len(files) == 1 else _in_processes(work, files)
    contents: dict[Path, bytes] = {}
    if png:
        from mdfconv.measured.figures import draw_analysis

        contents[png] = draw_analysis(analyses[0])
    if report:
        from mdfconv.measured.report import report_files

        line = join(["mdfconv", *sys.argv[1:]])
        contents |= report_files(analyses, line, report, list(map(_sha256, files)))
    form = tables.form_of(format_, output)
    is_for_people = form in ("table", "markdown")
    rows = _rows(analyses, ends, separate=separate, for_people=is_for_people)
    names = list(dict.fromkeys(name for row in rows for name in row))
    if is_for_people:
        names = [name for name in names if any(row.get(name) for row in rows)]
    rows = [{name: row.get(name) for name in names} for row in rows]
    title = f"Fits to {analyses[0].name}" if len(analyses) == 1 else "Fits"
    tables.write_table(
        names, rows, form, outputs, beside=contents, title=title, secondary=_SECONDARY[::-1]
    )
    for analysis in analyses:
        _tell(analysis, named=len(analyses) > 1)


def _analysis(
    path: Path,
    columns: ReadOptions,
    settings: dict[str, Any],
    *,
    needs_two: Sequence[str],
    is_reported: bool,
) -> Analysis:
    """Return the fits to a file."""
    from mdfconv.measured import Samples, fit, read

    samples = read(path, columns)
    if needs_two and isinstance(samples, Samples):
        which = f"{' and '.join(needs_two)} {'need' if len(needs_two) > 1 else 'needs'}"
        raise MdfconvError(f"{path}: {which} two directions", "this file has one angle")
    analysis = fit(samples, name=path.name, **settings)
    for result in analysis.results:
        # In the process of the file, if there are several.
        _ = result.verdict, is_reported and result.choices
    return analysis


def _sha256(path: Path) -> str:
    """Return the SHA-256 of a file, in hexadecimal; nothing of standard input, which is read."""
    from hashlib import sha256

    from mdfconv.output.files import STANDARD_INPUT

    return "" if str(path) == STANDARD_INPUT else sha256(path.read_bytes()).hexdigest()


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


def _rows(
    analyses: Sequence[Analysis], ends: Sequence[Endpoint], *, separate: bool, for_people: bool
) -> list[dict[str, Any]]:
    """Return a row for each fit: for people with symbols, units and ±, else as a record."""
    rows = []
    for analysis in analyses:
        file = {"file": analysis.name} if len(analyses) > 1 else {}
        for result in analysis.results:
            channel = {"channel": result.samples.channels[0]} if separate else {}
            records = options.in_asked_forms(result.records(), ends)
            if for_people:
                records = [_row_for_people(record) for record in records]
            rows += [file | channel | record for record in records]
    return rows


def _row_for_people(record: dict[str, Any]) -> dict[str, Any]:
    """Return the chief numbers of a record, each with its standard error."""
    row = {
        "": "✓" if record["recommended"] else "",
        "distribution": record["distribution"],
        "parameter": _measured(record, "parameter"),
        "γ": _measured(record, "gamma"),
    }
    if "second" in record:
        second, share = _measured(record, "second"), _measured(record, "share")
        row["parameter"] += f", {second}, share {share}"
    symbols = {"f0": "F₀", "n": "n", "diffuse": "k_d", "specular": "k_s"}
    for name, symbol in (symbols | {"offset": "offset", "scale": "scale"}).items():
        if name in record:
            row[symbol] = _measured(record, name)
    is_relative = record["loss"] == "log"
    for name, heading in (("error", "error"), ("validated_error", "validated error")):
        value = record[name]
        unit = " σ" if record["loss"] == "sigma" else ""
        row[heading] = f"{100 * value:.3g} %" if is_relative else f"{value:.3g}{unit}"
    return row


def _measured(record: dict[str, Any], name: str) -> str:
    """Return a number of a record with its standard error, of many channels their range."""
    value, error = record[name], record.get(f"{name}_stderr")
    if value is None:
        return ""
    if not isinstance(value, list):
        return with_error(value, error)
    if len(value) > _MOST_CHANNELS:
        return f"{min(value):.3g} to {max(value):.3g}"
    pairs = zip(value, error or [None] * len(value), strict=True)
    return ", ".join(with_error(*pair) for pair in pairs)


def _tell(analysis: Analysis, *, named: bool) -> None:
    """Write notes, verdicts and failed checks to standard error."""
    file = f"{analysis.name}: " if named else ""
    for note in analysis.notes:
        process.tell(f"{file}note: {note}")
    for result in analysis.results:
        channels = result.samples.channels
        channel = f"channel {channels[0]}: " if len(analysis.results) > 1 else ""
        verdict = result.verdict
        process.tell(f"{file}{channel}{verdict.grade}: {verdict.sentence}")
        for check in result.checks:
            if check.passed is False:
                hint = f" ({_HINTS[check.argument]})" if check.argument else ""
                process.tell(f"{file}{channel}warning: {check.name}: {check.text}{hint}")


def _ends(names: Sequence[str]) -> list[Endpoint]:
    """Return what is named, each once; nothing for all."""
    from mdfconv.distributions.endpoint import endpoint

    if ALL in [name.strip().lower() for name in names]:
        return []
    ends = (options.noted(endpoint(name)) for name in names if not _is_two_lobes(name))
    return list({end.label: end for end in ends}.values())


def _is_two_lobes(name: str) -> bool:
    from mdfconv.measured.model import TWO_LOBES

    return name.strip().lower() == TWO_LOBES


def _targets(
    names: Sequence[str], ends: Sequence[Endpoint], gamma: float | None
) -> list[LobeShape] | None:
    """Return the candidates to fit, None for all, and say which of all a given γ leaves out."""
    from mdfconv.measured.analysis import fitted_candidates
    from mdfconv.measured.model import TWO_LOBES

    named: list[Any] = list(dict.fromkeys(end.distribution for end in ends))
    if ALL not in [name.strip().lower() for name in names]:
        named += [TWO_LOBES] * any(map(_is_two_lobes, names))
    if named:
        return fitted_candidates(named, gamma)
    if gamma is not None:
        left = {what.name for what in fitted_candidates(None, gamma)}
        for what in fitted_candidates(None, None):
            if what.name not in left:
                process.tell(f"note: {what.name} is left out: it has no γ = {gamma:g}")
    return None
