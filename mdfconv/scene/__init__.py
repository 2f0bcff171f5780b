"""Scene files: material libraries and roughness textures."""

from mdfconv.scene.gltf.asset import convert_gltf
from mdfconv.scene.gltf.images import GltfTextures
from mdfconv.scene.mitsuba.convert import convert_mitsuba
from mdfconv.scene.mtl.library import convert_mtl
from mdfconv.scene.texture.convert import convert_texture, convert_texture_file
from mdfconv.scene.texture.rule import TextureRule
from mdfconv.scene.texture.texel_map import TextureReport

__all__ = [
    "GltfTextures",
    "TextureReport",
    "TextureRule",
    "convert_gltf",
    "convert_mitsuba",
    "convert_mtl",
    "convert_texture",
    "convert_texture_file",
]
