"""``mdfconv mtl``."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mdfconv.cli import completion
from mdfconv.cli.material_files import (
    InPlaceOption,
    ReportFormat,
    ReportFormatOption,
    ResultOption,
    about,
    convert_files,
    material_rows,
    print_importers,
    print_materials,
)
from mdfconv.cli.options import (
    ExposureOption,
    ForceOption,
    MetricOption,
    chosen_metric,
    refuse_given,
)
from mdfconv.cli.tables import progress
from mdfconv.errors import MdfconvError
from mdfconv.output.records import json_text

if TYPE_CHECKING:
    from mdfconv.fitting.metrics import Metric
    from mdfconv.scene.material_files import Destination
    from mdfconv.scene.mtl.library import MtlConversion
    from mdfconv.scene.mtl.textures import MtlTextures
    from mdfconv.scene.stored import MaterialProblem

_HEADINGS = {
    "name": "material", "shininess": "Ns", "roughness": "Pr", "rmse": "RMSE", "notes": "notes",
}  # fmt: skip


def command(
    context: typer.Context,
    libraries: Annotated[
        list[str],
        typer.Argument(
            metavar="IN.mtl...", help="Material libraries, or patterns such as '*.mtl'."
        ),
    ],
    output: ResultOption = None,
    to: Annotated[
        str,
        typer.Option(
            metavar="WHAT",
            autocompletion=completion.mtl_targets,
            help="roughness (Pr from Ns) or shininess (Ns from Pr, the inverse).",
        ),
    ] = "roughness",
    metric: MetricOption = "environment",
    exposure: ExposureOption = None,
    replace: Annotated[
        bool, typer.Option("--replace", help="Drop the statement that was converted.")
    ] = False,
    in_place: InPlaceOption = False,
    force: ForceOption = False,
    textures: Annotated[
        bool,
        typer.Option(
            "--textures", help="Convert the textures of map_Ns, too, into map_Pr beside the result."
        ),
    ] = False,
    exponent_max: Annotated[
        float,
        typer.Option(metavar="N", help="Exponent of a white texel in those textures."),
    ] = 1000.0,
    compare: Annotated[
        bool,
        typer.Option("--compare", help="Add what importers' rules make of Ns, and their error."),
    ] = False,
    format_: ReportFormatOption = ReportFormat.table,
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
    from mdfconv.scene.mtl.library import convert_mtl

    wanted = to.strip().lower()
    if wanted != "roughness" and (compare or textures):
        raise MdfconvError("--compare and --textures go with --to roughness")
    if not textures:
        refuse_given(context, ["exponent_max"], "goes with --textures")
    kept = chosen_metric(metric, exposure)

    def convert(destination: Destination, data: bytes) -> MtlConversion:
        new = _convert_textures(destination, data, kept, exponent_max) if textures else None
        names = new.names if new else None
        with about(destination.source):
            conversion = convert_mtl(
                data, wanted, metric=kept, replace=replace, texture_names=names
            )
        if new is None:
            return dataclasses.replace(conversion, problems=_with_option(conversion.problems))
        problems = (*new.problems, *conversion.problems)
        return dataclasses.replace(
            conversion, files=new.files, inputs=new.inputs, problems=problems
        )

    convert_files(
        context,
        libraries,
        output,
        in_place=in_place,
        force=force,
        metric=kept,
        convert=convert,
        report=lambda converted: _report(converted, kept, form=format_, compare=compare),
    )


def _with_option(problems: Sequence[MaterialProblem]) -> tuple[MaterialProblem, ...]:
    """Return what is left in a library, with the option that helps."""
    from mdfconv.scene.stored import ProblemKind

    return tuple(
        problem._replace(text=f"{problem.text}: --textures converts it")
        if problem.kind is ProblemKind.TEXTURE
        else problem
        for problem in problems
    )


def _convert_textures(
    destination: Destination, data: bytes, metric: Metric, exponent_max: float
) -> MtlTextures:
    """Convert the textures of a library."""
    from mdfconv.scene.mtl.library import texture_statements
    from mdfconv.scene.mtl.textures import convert_textures

    textures = texture_statements(data)
    paths = destination.source, destination.output
    with progress("Textures", len(textures)) as advance:
        return convert_textures(textures, *paths, metric, exponent_max, advance)


def _report(
    converted: list[tuple[Destination, MtlConversion]],
    metric: Metric,
    *,
    form: ReportFormat,
    compare: bool,
) -> None:
    every = form is ReportFormat.json
    known = [[material.shininess for material in each.materials] for _, each in converted]
    records: list[dict[str, Any]] = [
        {
            "file": str(destination.source),
            "output": str(destination.output),
            "metric": str(metric),
            "materials": material_rows(
                conversion.materials, exponents, metric, every=every, compare=compare
            ),
            "textures": [vars(texture) for texture in conversion.textures],
            "problems": [{"line": line, "problem": text} for line, text, _ in conversion.problems],
            "notes": [{"line": line, "note": text} for line, text in conversion.notes],
        }
        for (destination, conversion), exponents in zip(converted, known, strict=True)
    ]
    if every:
        typer.echo(json_text(records))
        return
    for record, exponents in zip(records, known, strict=True):
        print_materials(record, _HEADINGS, len(exponents))
        if compare:
            print_importers(record, exponents)
