"""``mdfconv mitsuba``."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Annotated, Any

import typer

from mdfconv.cli import completion, material_files, options, process
from mdfconv.cli.options import argument, flag, option

_HEADINGS = {
    "name": "BSDF", "line": "line", "distribution": "from", "value": "α", "result": "new α",
    "rmse": "RMSE", "rmse_unchanged": "kept", "notes": "notes",
}  # fmt: skip

_FROM = option(
    "MDF:ENCODING",
    "What every alpha of the scenes is, such as ggx:roughness, if an exporter stored that "
    "there; if not given, the distribution says it.",
    "--from",
    words=completion.endpoints,
)
_TO = option(
    "MDF", "Distribution to convert to: ggx or beckmann.", words=completion.mitsuba_targets
)
_TEXTURES = flag("--textures", "Convert the bitmaps of alpha, too, beside the result.")
_COMPARE = flag("--compare", "Add what is left if alpha is kept: its error.")


def command(
    context: typer.Context,
    scenes: Annotated[list[str], argument("IN.xml...", "Scenes, or patterns such as '*.xml'.")],
    output: material_files.ResultOption = None,
    source: Annotated[str | None, _FROM] = None,
    to: Annotated[str, _TO] = "ggx",
    metric: options.MetricOption = "environment",
    exposure: options.ExposureOption = None,
    in_place: material_files.InPlaceOption = False,
    force: options.ForceOption = False,
    dry_run: options.DryRunOption = False,
    textures: Annotated[bool, _TEXTURES] = False,
    compare: Annotated[bool, _COMPARE] = False,
    format_: material_files.ReportFormatOption = "table",
) -> None:
    """Convert the distribution of rough BSDFs in Mitsuba scenes (0.6 and 3).

    Changes distribution and alpha of roughconductor, roughdielectric, roughplastic, pplastic and
    roughcoating, or adds them where their defaults count; every other byte is kept. What has to
    be left as it is, such as a textured alpha or the BSDFs phong and ward, is reported, and the
    exit status is 1.

    Examples:

    mdfconv mitsuba scene.xml -o scene-ggx.xml

    mdfconv mitsuba --in-place --to beckmann --metric display 'scenes/*.xml'

    mdfconv mitsuba exported.xml -o scene.xml --from ggx:roughness

    mdfconv mitsuba scene.xml -o out --textures --compare --format json
    """
    from mdfconv.scene.material_files import Destination, TextureFolder
    from mdfconv.scene.mitsuba import convert as mitsuba
    from mdfconv.scene.texture.rule import TextureRule

    target = mitsuba.check_target(to)
    # A wrong name is refused before any file is read.
    taken_for = options.asked_endpoint(source).label if source else None
    chosen = options.chosen_metric(metric, exposure)

    def convert(destination: Destination, data: bytes) -> mitsuba.MitsubaConversion:
        folder = TextureFolder(destination.source, destination.output)

        def texture(file: str, distribution: str) -> str:
            return folder.convert(
                file, TextureRule(distribution, target, metric=str(chosen)), target
            )

        with material_files.about(destination.source):
            conversion = mitsuba.convert_mitsuba(
                data,
                target,
                source=taken_for,
                metric=chosen,
                texture=texture if textures else None,
            )
        # A texture whose BSDF is left for another reason is not written.
        names = {texture.result for texture in conversion.textures}
        files = {path: data for path, data in folder.files.items() if path.name in names}
        return dataclasses.replace(conversion, files=files, inputs=folder.inputs)

    def add_unchanged_errors(
        materials: Sequence[mitsuba.MitsubaMaterial], rows: material_files.Rows
    ) -> None:
        errors = mitsuba.unchanged_errors(materials, target, chosen)
        for row, error in zip(rows, errors, strict=True):
            row["rmse_unchanged"] = error

    report = material_files.MaterialReport(
        form=format_,
        metric=chosen,
        details=lambda conversion: {
            **({"from": taken_for} if taken_for else {}),
            "target": target,
            "textures": list(map(vars, conversion.textures)),
            "includes": [{"line": line, "file": file} for line, file in conversion.includes],
            "notes": [{"line": line, "note": text} for line, text in conversion.notes],
        },
        headings=_HEADINGS,
        # With --compare 80 columns are too few for all.
        secondary=("from", "line"),
        compare=add_unchanged_errors if compare else None,
        print_more=_print_more,
    )
    material_files.convert_files(
        context, scenes, output, convert, report, in_place=in_place, force=force, dry_run=dry_run
    )


def _print_more(record: dict[str, Any]) -> None:
    """Print what became of textures, and what was not read."""
    for texture in record["textures"]:
        typer.echo(
            f"{texture['file']} became {texture['result']} (line {texture['line']})", err=True
        )
    for include in record["includes"]:
        place = f"{record['file']}:{include['line']}"
        process.tell(f"{place}: {include['file']} is included, and is not read: convert it, too")
