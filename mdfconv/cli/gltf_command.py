"""``mdfconv gltf``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from mdfconv.cli import completion, material_files, options, process
from mdfconv.cli.options import argument, flag, option
from mdfconv.errors import MdfconvError

_HEADINGS = {
    "index": "#", "name": "material", "value": "was", "result": "is", "rmse": "RMSE",
    "notes": "notes",
}  # fmt: skip

_FILES = argument("IN.glb...", "glTF or GLB files, or patterns such as '*.glb'.")
_SOURCE = option(
    "MDF:PROGRAM",
    "What the program that wrote the file stored, such as blinn-phong:obj2gltf "
    "(mdfconv list --encodings has all).",
    "--from",
    words=completion.endpoints,
)
_TARGET = option(
    "MDF:ENCODING",
    "What the factors become; if not given ggx:roughness, as glTF defines them.",
    "--to",
    words=completion.endpoints,
)
_TEXTURES = flag("--textures", "Convert roughness textures, too, each with the factor before it.")
_LOSSY = flag("--lossy", "Take JPEG textures, although altered; they become PNG.")
_GUESS = flag("--guess", "Only propose --from by the file's asset.generator; write nothing.")
_COMPARE = flag("--compare", "Add what importers' rules make of the exponents, and their error.")


def command(
    context: typer.Context,
    files: Annotated[list[str], _FILES],
    output: material_files.ResultOption = None,
    source: Annotated[str | None, _SOURCE] = None,
    target: Annotated[str | None, _TARGET] = None,
    metric: options.MetricOption = "environment",
    exposure: options.ExposureOption = None,
    specular: options.SpecularOption = None,
    in_place: material_files.InPlaceOption = False,
    force: options.ForceOption = False,
    textures: Annotated[bool, _TEXTURES] = False,
    lossy: Annotated[bool, _LOSSY] = False,
    guess: Annotated[bool, _GUESS] = False,
    compare: Annotated[bool, _COMPARE] = False,
    format_: material_files.ReportFormatOption = "table",
) -> None:
    """Repair the roughness factors of glTF 2.0 files whose writer had exponents.

    glTF's roughness is that of GGX, alpha = roughness squared; many programs store a number by a
    rule of their own instead. Replaces it by the best fit; every other byte of the JSON and the
    binary chunk are kept. What has no answer is reported and left, and the exit status is 1.

    Examples:

    mdfconv gltf chair.glb --guess

    mdfconv gltf chair.glb -o chair-pbr.glb --from blinn-phong:obj2gltf

    mdfconv gltf --in-place --textures --from blinn-phong:peak-alpha 'assets/*.gltf'

    mdfconv gltf lamp.gltf -o new.gltf --from blinn-phong:assimp-gltf --specular 0.5 --compare
    """
    from mdfconv.distributions.endpoint import with_specular
    from mdfconv.scene.gltf.asset import GltfConversion, convert_gltf, factor_endpoints
    from mdfconv.scene.gltf.images import GltfTextures
    from mdfconv.scene.material_files import Destination
    from mdfconv.scene.shininess import ROUGHNESS, SHININESS
    from mdfconv.scene.stored import ProblemKind

    if guess:
        others = {option.name for option in context.command.params if option.name}
        others -= {"files", "guess"}
        options.refuse_given(
            context, others, "does not go with --guess, which only proposes --from"
        )
        _propose(files)
        return
    if not textures:
        options.refuse_given(context, ["lossy"], "goes with --textures")
    if source is None:
        reason = "the rule by which the factors were stored is missing: give --from"
        raise MdfconvError(reason, "--guess proposes one")
    chosen = options.chosen_metric(metric, exposure)
    names = with_specular(source, target or ROUGHNESS, specular)
    # A mistake in the names is none of a file.
    pair = factor_endpoints(*names)
    dialect = pair[0].encoding.name.partition(":")[0] if pair[0].encoding else ""
    if compare and pair[0].distribution.name != SHININESS:
        raise MdfconvError(f"--compare is about exponents, {pair[0].label} stores none")

    def convert(destination: Destination, data: bytes) -> GltfConversion:
        _check_form(destination.source, destination.output, data)
        folders = GltfTextures(destination.source.parent, destination.output.parent, lossy)
        with material_files.about(destination.source):
            conversion = convert_gltf(
                data, *pair, metric=chosen, textures=folders if textures else None
            )
        proposals = _proposals(conversion.generator)
        if proposals and dialect not in proposals:
            process.tell(
                f"note: {destination.source} was written by '{conversion.generator}', which stands "
                f"for {' or '.join(proposals.values())}"
            )
        return conversion

    report = material_files.MaterialReport(
        form=format_,
        metric=chosen,
        details=lambda conversion: {
            "from": names[0],
            "to": names[1],
            "count": len(conversion.materials),
            "textures": list(map(str, conversion.files)),
        },
        headings=_HEADINGS,
        place="place",
        remedies={ProblemKind.TEXTURE: ": --textures converts it", ProblemKind.LOSSY: " (--lossy)"},
        exponent="parameter" if compare else "",
    )
    material_files.convert_files(
        context, files, output, convert, report, in_place=in_place, force=force
    )


def _check_form(source: Path, output: Path, data: bytes) -> None:
    """Refuse a name that says of a file that it is of the other form, which it does not become."""
    from mdfconv.scene.gltf.document import is_glb

    form = ".glb" if is_glb(data) else ".gltf"
    named = output.suffix.lower()
    if output.name != source.name and named in {".glb", ".gltf"} - {form}:
        reason = f"{source} stays {form[1:]} in its form, {output} says {named[1:]}"
        raise MdfconvError(reason, f"name it {output.with_suffix(form)}")


def _proposals(generator: str) -> dict[str, str]:
    """Return the dialects that a generator lets expect, with the options that name them."""
    from mdfconv.distributions.dialects import Specular
    from mdfconv.scene.gltf.asset import dialects_by_generator

    proposals = {}
    for dialect in dialects_by_generator(generator):
        needed = " --specular L" if dialect.specular is Specular.needed else ""
        option = f"--from {dialect.owners[0]}:{dialect.name}{needed} {dialect.provided}"
        proposals[dialect.name] = option.rstrip()
    return proposals


def _propose(files: list[str]) -> None:
    """Print which source each file's generator lets expect."""
    from mdfconv.output.files import find_files
    from mdfconv.scene.gltf.asset import generator_of
    from mdfconv.scene.material_files import read_file

    lines = []
    for path in find_files(files):
        with material_files.about(path):
            generator = generator_of(read_file(path))
        proposals = _proposals(generator).values()
        said = f"asset.generator is '{generator}'" if generator else "no asset.generator"
        lines.append(f"{path}: {said}: {' or '.join(proposals) or 'unknown'}")
    typer.echo("\n".join(lines))
