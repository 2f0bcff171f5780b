"""glTF 2.0: the roughness of every material from what a program stored, every other byte kept."""

from __future__ import annotations

from dataclasses import dataclass
from operator import itemgetter
from pathlib import Path

from mdfconv.distributions.dialects import DIALECTS, Dialect
from mdfconv.distributions.endpoint import Endpoint, endpoint
from mdfconv.errors import MdfconvError
from mdfconv.fitting.metrics import Metric, metric_named
from mdfconv.scene.gltf.document import MARK, GltfDocument
from mdfconv.scene.gltf.ends import MaterialEnds
from mdfconv.scene.gltf.images import GltfTextures
from mdfconv.scene.gltf.repair import GltfMaterial, Remark, Repair
from mdfconv.scene.material_files import FileConversion
from mdfconv.scene.shininess import ROUGHNESS
from mdfconv.scene.stored import ProblemKind

AUTO = "auto"


@dataclass(frozen=True, kw_only=True)
class GltfConversion(FileConversion):
    """A converted glTF file; the places of its problems are such as ``materials[3]``.

    Parameters
    ----------
    materials : tuple of GltfMaterial
        What was converted, in the order of the file.
    generator : str
        What wrote the file; "" if it does not say.
    source, target : str
        What its numbers were taken for, and what they became.
    remarks : tuple of (str, ProblemKind)
        What a careful user must know of the whole file, and which option would help.
    """

    materials: tuple[GltfMaterial, ...]
    generator: str
    source: str
    target: str
    remarks: tuple[Remark, ...] = ()


def convert_gltf(
    data: bytes,
    source: str | Endpoint = AUTO,
    target: str | Endpoint = ROUGHNESS,
    *,
    metric: str | Metric = "environment",
    specular: float | None = None,
    textures: GltfTextures | None = None,
    texels: str | Endpoint = "",
    folder: Path | None = None,
    mark: bool = False,
) -> GltfConversion:
    """Convert the roughness of all materials of a glTF 2.0 file, and its keyframes.

    Parameters
    ----------
    data : bytes
        A glTF or a GLB. What is not converted is kept: all other JSON byte by byte, and the
        chunks behind it.
    source, target : str or Endpoint
        What the numbers are, such as ``"blinn-phong:obj2gltf"``, and what they become: glTF
        defines ``"ggx:roughness"``, α = r². ``"auto"`` is what the file's generator stores.
        ``"ggx:gltf-glossiness"`` is the glossiness of KHR_materials_pbrSpecularGlossiness: as
        the target the numbers of that extension are converted where they are, as the source
        alone they move into the roughness. A rule that depends on the specular weight takes it
        from KHR_materials_specular where a material has it.
    metric : str or Metric
        What the fit keeps.
    specular : float, optional
        The weight of the specular lobe, for rules that depend on it, of materials that do not say
        it.
    textures : GltfTextures, optional
        Where the file's textures are, if they are to be converted; materials with a texture of
        roughness are left as they are without.
    texels : str or Endpoint
        What the texels of those are, as a source of `TextureRule`; if not given what the source's
        program makes of them.
    folder : Path, optional
        Where the buffers are that the file names, if not where its textures are; keyframes in
        files are left as they are without.
    mark : bool
        Whether to mark a converted file in its ``asset.extras``. One that is marked is left as
        it is, whether this is set or not.

    Returns
    -------
    GltfConversion
        The file and what there is to say about it.

    Raises
    ------
    MdfconvError
        If the file is no glTF 2.0, a name or the metric is not known, or the generator stands for
        no source.
    """
    # Wrong names are refused before the file is read.
    MaterialEnds(target if source == AUTO else source, target)
    document, metric = GltfDocument(data), metric_named(metric)
    if document.mark is not None:
        return _marked(document, data, target)
    remarks = []
    if source == AUTO:
        source = source_by_generator(document.generator)
        remarks.append(_read_by_generator(document.generator, source))
    ends = MaterialEnds(source, target, specular)
    repair = Repair(document, ends, metric, textures, texels, folder)
    materials = repair.convert()
    if mark and materials:
        repair.mark()
    encoded = document.encoded()
    return GltfConversion(
        data=encoded,
        materials=tuple(materials),
        problems=tuple(problem for _, problem in sorted(repair.problems, key=itemgetter(0))),
        files=repair.files,
        inputs=repair.buffers.inputs,
        # Without the files that new ones have replaced.
        named=(GltfDocument(encoded) if repair.files else document).named_files,
        generator=document.generator,
        source=ends.pair[0].label,
        target=ends.pair[1].label,
        remarks=(*remarks, *repair.remarks),
    )


def _marked(document: GltfDocument, data: bytes, target: str | Endpoint) -> GltfConversion:
    """Return a file that is marked as converted as it is."""
    pairs = document.mark.items() if isinstance(document.mark, dict) else ()
    words = " ".join(f"{key} {value}" for key, value in pairs)
    remark = (
        f"marked as converted {words}".rstrip() + f", and stays as it is; without {MARK} in "
        "asset.extras it would be converted again"
    )
    label = endpoint(target).label
    return GltfConversion(
        data=data,
        materials=(),
        named=document.named_files,
        generator=document.generator,
        source=label,
        target=label,
        remarks=((remark, ProblemKind.OTHER),),
    )


def _read_by_generator(generator: str, source: str) -> Remark:
    """Return what a generator lets take the numbers for, in words."""
    (dialect,) = dialects_by_generator(generator)
    return f"written by '{generator}': {dialect.formula} ({source})", ProblemKind.OTHER


def generator_of(data: bytes) -> str:
    """Return what wrote a glTF file, as it says itself in ``asset.generator``; "" if nothing."""
    return GltfDocument(data).generator


def dialects_by_generator(generator: str) -> list[Dialect]:
    """Return the dialects of the programs that a generator may name."""
    text = generator.lower()
    return [each for each in DIALECTS if any(piece in text for piece in each.generators)]


def source_by_generator(generator: str) -> str:
    """Return the one source that a generator stands for.

    Raises
    ------
    MdfconvError
        If it stands for none, for several, or for one on a condition.
    """
    wrote = f"was written by '{generator}'" if generator else "does not say what wrote it"
    found = dialects_by_generator(generator)
    names = [f"{each.owners[0]}:{each.name}" for each in found]
    if len(found) == 1 and not found[0].provided:
        return names[0]
    meant = " or ".join(
        f"{name} {each.provided}".strip() for name, each in zip(names, found, strict=True)
    )
    raise MdfconvError(
        f"{wrote}, which stands for {meant}"
        if found
        else f"{wrote}{', whose rule is not known' if generator else ''}",
        "name what its numbers are, if they are not glTF's own roughness; mdfconv inspect shows "
        "them",
        argument="source",
    )
