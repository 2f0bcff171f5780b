"""``mdfconv mtl``."""

from __future__ import annotations

import dataclasses
from typing import Annotated

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
_TEXTURES = flag(
    "--textures", "Convert the textures of map_Ns, too, into map_Pr beside the result."
)
_EXPONENT_MAX = option("N", "Exponent of a white texel in those textures.")
_COMPARE = flag("--compare", "Add what importers' rules make of Ns, and their error.")


def command(
    context: typer.Context,
    libraries: Annotated[list[str], _LIBRARIES],
    output: material_files.ResultOption = None,
    to: Annotated[str, _TO] = "roughness",
    metric: options.MetricOption = "environment",
    exposure: options.ExposureOption = None,
    replace: Annotated[bool, flag("--replace", "Drop the statement that was converted.")] = False,
    in_place: material_files.InPlaceOption = False,
    force: options.ForceOption = False,
    textures: Annotated[bool, _TEXTURES] = False,
    exponent_max: Annotated[float, _EXPONENT_MAX] = 1000.0,
    compare: Annotated[bool, _COMPARE] = False,
    format_: material_files.ReportFormatOption = "table",
) -> None:
    """Convert the shininess of Wavefront material libraries to roughness, or back.

    Adds or replaces Pr from Ns, the best fit of GGX (alpha = Pr squared) to Blinn/Phong; every
    other byte is kept. A statement that is not a number is reported and left, and the exit
    status is 1.

    Examples:

    mdfconv mtl chair.mtl -o chair-pbr.mtl

    mdfconv mtl --in-place --replace --metric display 'assets/*.mtl'

    mdfconv mtl chair.mtl -o chair-pbr.mtl --compare --format json

    mdfconv mtl --to shininess chair-pbr.mtl -o chair-phong.mtl
    """
    from mdfconv.scene.material_files import Destination, TextureFolder
    from mdfconv.scene.mtl import library
    from mdfconv.scene.stored import MaterialProblem, ProblemKind

    to = to.strip().lower()
    if to != "roughness" and (compare or textures):
        raise MdfconvError("--compare and --textures go with --to roughness")
    if not textures:
        options.refuse_given(context, ["exponent_max"], "goes with --textures")
    chosen = options.chosen_metric(metric, exposure)
    # A mistake in it is none of a library.
    rule = library.texture_rule(chosen, exponent_max)

    def convert(destination: Destination, data: bytes) -> library.MtlConversion:
        folder = TextureFolder(destination.source, destination.output)
        names: dict[str, str] | None = None
        problems: list[MaterialProblem] = []
        if textures:
            names, problems = library.convert_library_textures(data, folder, rule, tables.progress)
        with material_files.about(destination.source):
            conversion = library.convert_mtl(
                data, to, metric=chosen, replace=replace, texture_names=names
            )
        problems += conversion.problems
        return dataclasses.replace(
            conversion, files=folder.files, inputs=folder.inputs, problems=tuple(problems)
        )

    report = material_files.MaterialReport(
        form=format_,
        metric=chosen,
        details=lambda conversion: {
            "textures": list(map(vars, conversion.textures)),
            "notes": [{"line": line, "note": text} for line, text in conversion.notes],
        },
        headings=_HEADINGS,
        remedies={ProblemKind.TEXTURE: ": --textures converts it"},
        exponent="shininess" if compare else "",
    )
    material_files.convert_files(
        context, libraries, output, convert, report, in_place=in_place, force=force
    )
