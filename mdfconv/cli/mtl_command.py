"""``mdfconv mtl``."""

from __future__ import annotations

import dataclasses
from typing import Annotated, Any

import typer

from mdfconv.cli import completion, material_files, options, tables
from mdfconv.cli.options import argument, flag, option
from mdfconv.errors import MdfconvError

_HEADINGS = {
    "name": "material", "shininess": "Ns", "roughness": "Pr", "rmse": "RMSE", "notes": "notes",
}  # fmt: skip

_LIBRARIES = argument("IN.mtl...", "Material libraries, or patterns such as '*.mtl'.")
_TO = option(
    "WHAT",
    "roughness (Pr from Ns) or shininess (Ns from Pr, the inverse).",
    words=completion.mtl_targets,
)
_SOURCE = option(
    "MDF:PROGRAM",
    "What Ns is: auto (by the header and the numbers of the library), blinn-phong (an exponent), "
    "or what a program wrote, such as blinn-phong:blender-obj.",
    "--from",
    words=completion.library_sources,
)
_OVERWRITE = flag(
    "--overwrite-authored", "Overwrite Pr and map_Pr that a material has already; else it is left."
)
_TEXTURES = flag(
    "--textures", "Convert the textures of map_Ns, too, into map_Pr beside the result."
)
_EXPONENT_MAX = option("N", "Exponent of a white texel in those textures.")
_COMPARE = flag("--compare", "Add what importers' rules make of Ns, and their error.")


def command(
    context: typer.Context,
    libraries: Annotated[list[str], _LIBRARIES],
    output: material_files.ResultOption = None,
    source: Annotated[str, _SOURCE] = "auto",
    to: Annotated[str, _TO] = "roughness",
    metric: options.MetricOption = "environment",
    exposure: options.ExposureOption = None,
    replace: Annotated[bool, flag("--replace", "Drop the statement that was converted.")] = False,
    overwrite: Annotated[bool, _OVERWRITE] = False,
    in_place: material_files.InPlaceOption = False,
    force: options.ForceOption = False,
    dry_run: options.DryRunOption = False,
    textures: Annotated[bool, _TEXTURES] = False,
    texels: options.TexelsOption = None,
    exponent_max: Annotated[float, _EXPONENT_MAX] = 1000.0,
    compare: Annotated[bool, _COMPARE] = False,
    format_: material_files.ReportFormatOption = "table",
) -> None:
    """Convert the shininess of Wavefront material libraries to roughness, or back.

    Adds Pr from Ns, the best fit of GGX (alpha = Pr squared) to Blinn/Phong; every other byte is
    kept. Ns is what the writer of the library meant by it: Blender stores a roughness by rules of
    its own, and is known by its header. A material that has a Pr or a map_Pr keeps it. What is
    left is reported, and the exit status is 1.

    Examples:

    mdfconv mtl chair.mtl -o chair-pbr.mtl

    mdfconv mtl --in-place --replace --metric display 'assets/*.mtl'

    mdfconv mtl --from blinn-phong:linear:128 chair.mtl -o chair-pbr.mtl --dry-run

    mdfconv mtl chair.mtl -o chair-pbr.mtl --compare --format json

    mdfconv mtl --to shininess chair-pbr.mtl -o chair-phong.mtl
    """
    from mdfconv.scene.material_files import Destination, TextureFolder
    from mdfconv.scene.mtl import library
    from mdfconv.scene.mtl.meaning import AUTO, TEXTURE_EXPONENT, asked_meaning
    from mdfconv.scene.stored import MaterialProblem, ProblemKind

    to = to.strip().lower()
    if to != "roughness":
        if compare or textures:
            raise MdfconvError("--compare and --textures go with --to roughness")
        options.refuse_given(context, ["overwrite"], "goes with --to roughness")
    if not textures:
        options.refuse_given(context, ["texels", "exponent_max"], "goes with --textures")
    if texels and texels.strip().lower() != TEXTURE_EXPONENT:
        reason = f"goes with --texels {TEXTURE_EXPONENT}"
        options.refuse_given(context, ["exponent_max"], reason)
    chosen = options.chosen_metric(metric, exposure)
    # Wrong options are refused before any library is read.
    library.texture_rule(texels or TEXTURE_EXPONENT, chosen, exponent_max)
    if source.strip().lower() != AUTO:
        asked_meaning(source)

    def convert(destination: Destination, data: bytes) -> library.MtlConversion:
        folder = TextureFolder(destination.source, destination.output)
        names: dict[str, str] | None = None
        problems: list[MaterialProblem] = []
        taken_for = ""
        with material_files.about(destination.source):
            if textures:
                taken_for = texels or library.library_texels(data, source)
                rule = library.texture_rule(taken_for, chosen, exponent_max) if taken_for else None
                names, problems = library.convert_library_textures(
                    data, folder, rule, tables.progress, overwrite=overwrite
                )
            conversion = library.convert_mtl(
                data, to, source=source, metric=chosen, replace=replace, overwrite=overwrite,
                texture_names=names,
            )  # fmt: skip
        problems += conversion.problems
        return dataclasses.replace(
            conversion,
            files=folder.files,
            inputs=folder.inputs,
            problems=tuple(problems),
            texels=taken_for if names else "",
        )

    report = material_files.MaterialReport(
        form=format_,
        metric=chosen,
        details=lambda conversion: {
            "from": conversion.source,
            "writer": conversion.writer,
            "why": conversion.why,
            "texels": conversion.texels,
            "textures": list(map(vars, conversion.textures)),
            "notes": [{"line": line, "note": text} for line, text in conversion.notes],
        },
        headings=_HEADINGS,
        remedies={
            ProblemKind.TEXTURE: ": --textures converts it",
            ProblemKind.TEXELS: " (--texels)",
            ProblemKind.AUTHORED: " (--overwrite-authored replaces it)",
        },
        exponent="shininess" if compare else "",
        weight="specular",
        surface=("exponent", "roughness"),
        print_more=_print_texels,
    )
    material_files.convert_files(
        context, libraries, output, convert, report, in_place=in_place, force=force, dry_run=dry_run
    )


def _print_texels(record: dict[str, Any]) -> None:
    """Print what the texels of converted textures were taken for."""
    if record["texels"]:
        typer.echo(f"texels of map_Ns were taken for {record['texels']}", err=True)
