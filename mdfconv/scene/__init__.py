"""Scene files: material libraries and roughness textures."""

from mdfconv.scene.gltf import convert_gltf
from mdfconv.scene.gltf_images import GltfTextures
from mdfconv.scene.mitsuba import convert_mitsuba
from mdfconv.scene.mtl import convert_mtl
from mdfconv.scene.texture import convert_texture, convert_texture_file
from mdfconv.scene.texture_map import TextureReport
from mdfconv.scene.texture_rule import TextureRule

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
