"""Scene files: libraries and files of materials, and textures of their roughness."""

from typing import TYPE_CHECKING

from mdfconv import lazy_face

if TYPE_CHECKING:
    from mdfconv.scene.gltf.asset import GltfConversion, convert_gltf
    from mdfconv.scene.gltf.images import GltfTextures
    from mdfconv.scene.gltf.repair import GltfMaterial
    from mdfconv.scene.mitsuba.convert import MitsubaConversion, MitsubaMaterial, convert_mitsuba
    from mdfconv.scene.mtl.library import MtlConversion, MtlMaterial, convert_mtl
    from mdfconv.scene.stored import MaterialProblem, ProblemKind
    from mdfconv.scene.texture.convert import convert_texture, convert_texture_file
    from mdfconv.scene.texture.rule import TextureRule
    from mdfconv.scene.texture.texel_map import TextureReport

__all__ = [
    "GltfConversion",
    "GltfMaterial",
    "GltfTextures",
    "MaterialProblem",
    "MitsubaConversion",
    "MitsubaMaterial",
    "MtlConversion",
    "MtlMaterial",
    "ProblemKind",
    "TextureReport",
    "TextureRule",
    "convert_gltf",
    "convert_mitsuba",
    "convert_mtl",
    "convert_texture",
    "convert_texture_file",
]

# Imported when they are asked for: a command for one of the files needs nothing of the others.
_MODULES = {
    "gltf.asset": ("GltfConversion", "convert_gltf"),
    "gltf.images": ("GltfTextures",),
    "gltf.repair": ("GltfMaterial",),
    "mitsuba.convert": ("MitsubaConversion", "MitsubaMaterial", "convert_mitsuba"),
    "mtl.library": ("MtlConversion", "MtlMaterial", "convert_mtl"),
    "stored": ("MaterialProblem", "ProblemKind"),
    "texture.convert": ("convert_texture", "convert_texture_file"),
    "texture.rule": ("TextureRule",),
    "texture.texel_map": ("TextureReport",),
}
__getattr__ = lazy_face(__name__, _MODULES)


def __dir__() -> list[str]:
    """Return the public names, whether they are imported yet or not."""
    return sorted(__all__)
