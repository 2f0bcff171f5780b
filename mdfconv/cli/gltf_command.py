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
    "(mdfconv list --encodings has all); auto: what the file's asset.generator stands for.",
    "--from",
    words=completion.gltf_sources,
)
_TARGET = option(
    "MDF:ENCODING",
    "What the factors become; if not given ggx:roughness, as glTF defines them. "
    "ggx:gltf-glossiness is the glossiness of KHR_materials_pbrSpecularGlossiness.",
    "--to",
    words=completion.endpoints,
)
_TEXTURES = flag("--textures", "Convert roughness textures, too, each with the factor before it.")
_LOSSY = flag("--lossy", "Take JPEG textures, although altered; they become PNG.")
_MARK = flag("--mark", "Mark the result in asset.extras: a marked file is not converted again.")
_COMPARE = flag("--compare", "Add what importers' rules make of the exponents, and their error.")
_AUTO = "auto"


def command(
    context: typer.Context,
    files: Annotated[list[str], _FILES],
    output: material_files.ResultOption = None,
    source: Annotated[str, _SOURCE] = _AUTO,
    target: Annotated[str | None, _TARGET] = None,
    metric: options.MetricOption = "environment",
    exposure: options.ExposureOption = None,
    specular: options.SpecularOption = None,
    in_place: material_files.InPlaceOption = False,
    force: options.ForceOption = False,
    dry_run: options.DryRunOption = False,
    textures: Annotated[bool, _TEXTURES] = False,
    texels: options.TexelsOption = None,
    lossy: Annotated[bool, _LOSSY] = False,
    mark: Annotated[bool, _MARK] = False,
    compare: Annotated[bool, _COMPARE] = False,
    format_: material_files.ReportFormatOption = "table",
) -> None:
    """Repair the roughness factors of glTF 2.0 files whose writer had exponents.

    glTF's roughness is that of GGX, alpha = roughness squared; many programs store a number by a
    rule of their own instead. Replaces it by the best fit, in the keyframes of animations, too;
    every other byte of the JSON and the binary chunk are kept. What has no answer is reported and
    left, and the exit status is 1.

    Examples:

    mdfconv gltf chair.glb -o chair-pbr.glb

    mdfconv gltf --in-place --mark --textures --from blinn-phong:peak-alpha 'assets/*.gltf'

    mdfconv gltf chair.glb -o chair-pbr.glb --textures --texels ggx:glossiness

    mdfconv gltf lamp.gltf -o new.gltf --from blinn-phong:assimp-gltf --specular 0.5 --compare

    mdfconv gltf old.glb -o new.glb --from ggx:gltf-glossiness --textures
    """
    from mdfconv.scene.gltf.asset import AUTO, GltfConversion, convert_gltf
    from mdfconv.scene.gltf.ends import MaterialEnds
    from mdfconv.scene.gltf.images import GltfTextures
    from mdfconv.scene.material_files import Destination
    from mdfconv.scene.shininess import ROUGHNESS, SHININESS
    from mdfconv.scene.stored import ProblemKind
    from mdfconv.scene.texture.rule import TextureRule

    if not textures:
        options.refuse_given(context, ["lossy", "texels"], "goes with --textures")
    chosen = options.chosen_metric(metric, exposure)
    target = target or ROUGHNESS
    guessed = source.strip().lower() == AUTO
    source = AUTO if guessed else source
    # Wrong names are refused before any file is read.
    pair = MaterialEnds(target if guessed else source, target, None if guessed else specular).pair
    if texels:
        TextureRule(texels, pair[1]).endpoints()

    def check_exponents(label: str, distribution: str) -> None:
        if compare and distribution != SHININESS:
            raise MdfconvError(f"--compare is about exponents, {label} stores none")

    if not guessed:
        check_exponents(pair[0].label, pair[0].distribution.name)

    def convert(destination: Destination, data: bytes) -> GltfConversion:
        _check_form(destination.source, destination.output, data)
        folder = destination.source.parent
        folders = GltfTextures(folder, destination.output.parent, lossy)
        with material_files.about(destination.source):
            conversion = convert_gltf(
                data, source, target, metric=chosen, specular=specular,
                textures=folders if textures else None, texels=texels or "", folder=folder,
                mark=mark,
            )  # fmt: skip
            if conversion.materials:
                check_exponents(conversion.source, conversion.source.partition(":")[0])
        for text, kind in conversion.remarks:
            process.tell(f"note: {destination.source}: {text}{remedies.get(kind, '')}")
        proposals = _proposals(conversion.generator)
        if conversion.materials and proposals and _rule(conversion.source) not in proposals:
            process.tell(
                f"note: {destination.source} was written by '{conversion.generator}', which stands "
                f"for {' or '.join(proposals.values())}"
            )
        return conversion

    remedies = {
        ProblemKind.TEXTURE: ": --textures converts it",
        ProblemKind.LOSSY: " (--lossy)",
        ProblemKind.TEXELS: " (--texels)",
        ProblemKind.SPECULAR: " (--specular)",
    }
    report = material_files.MaterialReport(
        form=format_,
        metric=chosen,
        details=lambda conversion: {
            "from": conversion.source,
            "to": conversion.target,
            "count": len(conversion.materials),
            "textures": list(map(str, conversion.files)),
            "notes": [{"note": text + remedies.get(kind, "")} for text, kind in conversion.remarks],
        },
        headings=_HEADINGS,
        place="place",
        remedies=remedies,
        exponent="parameter" if compare else "",
        weight="specular",
    )
    material_files.convert_files(
        context, files, output, convert, report, in_place=in_place, force=force, dry_run=dry_run
    )


def _rule(label: str) -> str:
    """Return which rule a source is, such as ``"obj2gltf"``."""
    return label.split(":")[1] if ":" in label else ""


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
