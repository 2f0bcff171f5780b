"""``mdfconv mitsuba``."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mdfconv.cli import completion
from mdfconv.cli.material_files import (
    MATERIALS_SHOWN,
    InPlaceOption,
    ReportFormat,
    ReportFormatOption,
    ResultOption,
    about,
    convert_files,
    print_materials,
)
from mdfconv.cli.options import ExposureOption, ForceOption, MetricOption, chosen_metric
from mdfconv.cli.process import tell
from mdfconv.output.records import json_text

if TYPE_CHECKING:
    from mdfconv.fitting.metrics import Metric
    from mdfconv.scene.material_files import Destination
    from mdfconv.scene.mitsuba.convert import MitsubaConversion

_HEADINGS = {
    "name": "BSDF", "line": "line", "distribution": "from", "value": "α", "result": "new α",
    "rmse": "RMSE", "rmse_unchanged": "kept", "notes": "notes",
}  # fmt: skip
# With --compare 80 columns are too few for all.
_SECONDARY = ("from", "line")


def command(
    context: typer.Context,
    scenes: Annotated[
        list[str],
        typer.Argument(metavar="IN.xml...", help="Scenes, or patterns such as '*.xml'."),
    ],
    output: ResultOption = None,
    to: Annotated[
        str,
        typer.Option(
            metavar="MDF",
            autocompletion=completion.mitsuba_targets,
            help="Distribution to convert to: ggx or beckmann.",
        ),
    ] = "ggx",
    metric: MetricOption = "environment",
    exposure: ExposureOption = None,
    in_place: InPlaceOption = False,
    force: ForceOption = False,
    textures: Annotated[
        bool,
        typer.Option("--textures", help="Convert the bitmaps of alpha, too, beside the result."),
    ] = False,
    compare: Annotated[
        bool,
        typer.Option("--compare", help="Add what is left if alpha is kept: its error."),
    ] = False,
    format_: ReportFormatOption = ReportFormat.table,
) -> None:
    """Convert the distribution of rough BSDFs in Mitsuba scenes (0.6 and 3).

    Changes distribution and alpha of roughconductor, roughdielectric, roughplastic and
    roughcoating, or adds them where their defaults count; every other byte is kept. What has to
    be left as it is, such as a textured alpha, is reported, and the exit status is 1.

    Examples:

    mdfconv mitsuba scene.xml -o scene-ggx.xml

    mdfconv mitsuba --in-place --to beckmann --metric display 'scenes/*.xml'

    mdfconv mitsuba scene.xml -o out --textures --compare --format json
    """
    from mdfconv.scene.mitsuba.convert import check_target, convert_mitsuba
    from mdfconv.scene.mitsuba.textures import BitmapConverter

    wanted = check_target(to)
    kept = chosen_metric(metric, exposure)

    def convert(destination: Destination, data: bytes) -> MitsubaConversion:
        paths = destination.source, destination.output
        bitmaps = BitmapConverter(*paths, wanted, kept) if textures else None
        with about(destination.source):
            conversion = convert_mitsuba(data, wanted, metric=kept, texture=bitmaps)
        if bitmaps is None:
            return conversion
        files = bitmaps.files({texture.result for texture in conversion.textures})
        return dataclasses.replace(conversion, files=files, inputs=bitmaps.inputs)

    def report(converted: list[tuple[Destination, MitsubaConversion]]) -> None:
        if format_ is ReportFormat.json:
            records = [_record(*each, wanted, kept, compare=compare) for each in converted]
            typer.echo(json_text(records))
            return
        for each in converted:
            record = _record(*each, wanted, kept, compare=compare, most=MATERIALS_SHOWN)
            _print_report(record, len(each[1].materials))

    convert_files(
        context,
        scenes,
        output,
        in_place=in_place,
        force=force,
        metric=kept,
        convert=convert,
        report=report,
    )


def _record(
    destination: Destination,
    conversion: MitsubaConversion,
    target: str,
    metric: Metric,
    *,
    compare: bool,
    most: int | None = None,
) -> dict[str, Any]:
    """Return what is said of a scene, of its first materials if there is a limit."""
    materials = [vars(each) | {"notes": list(each.notes)} for each in conversion.materials[:most]]
    if compare:
        from mdfconv.scene.mitsuba.convert import unchanged_errors

        errors = unchanged_errors(conversion.materials[:most], target, metric)
        for row, error in zip(materials, errors, strict=True):
            row["rmse_unchanged"] = error
    return {
        "file": str(destination.source),
        "output": str(destination.output),
        "target": target,
        "metric": str(metric),
        "materials": materials,
        "textures": [vars(texture) for texture in conversion.textures],
        "includes": [{"line": line, "file": file} for line, file in conversion.includes],
        "problems": [{"line": line, "problem": text} for line, text, _ in conversion.problems],
    }


def _print_report(record: dict[str, Any], count: int) -> None:
    """Print what was converted to standard error."""
    shown = record["materials"][:1]
    headings = {key: text for key, text in _HEADINGS.items() if shown and key in shown[0]}
    print_materials(record, headings, count, _SECONDARY)
    for texture in record["textures"]:
        typer.echo(
            f"{texture['file']} became {texture['result']} (line {texture['line']})", err=True
        )
    for include in record["includes"]:
        place = f"{record['file']}:{include['line']}"
        tell(f"{place}: {include['file']} is included, and is not read: convert it, too")
