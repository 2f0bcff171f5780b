"""What importers, exporters and renderers store where a surface has an exponent or an α.

Each was read in the source of the program. N is Blinn's exponent, r a stored roughness; s is a
stored smoothness or shininess, g a glossiness, L the luminance of the specular colour or the
weight of the specular lobe. A new dialect is one more entry of `DIALECTS`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from enum import StrEnum

import numpy as np

from mdfconv.distributions.base import same
from mdfconv.distributions.evaluation import Array
from mdfconv.distributions.parameter import Clamp, Encoding, Pairing, Parameter, percent_hint
from mdfconv.errors import MdfconvError

# From stored number or parameter, and the specular weight, to the other.
_Rule = Callable[[Array, float], Array]

_ROUGHNESS = Parameter("roughness", "r", (0.0, 1.0), 0, 1, lower_closed=True, upper_closed=True)
_ABOVE_ZERO = replace(_ROUGHNESS, lower_closed=False)
_SMOOTHNESS = replace(_ROUGHNESS, name="smoothness", symbol="s", larger_is_smoother=True)
_SHININESS = replace(_SMOOTHNESS, name="shininess", lower_closed=False)
_GLOSSINESS = replace(_SMOOTHNESS, name="glossiness", symbol="g", upper_closed=False)
_ALPHA = replace(_ABOVE_ZERO, name="alpha", symbol="α")
# The typical range of stored numbers ends so near to where they are clamped.
_SHORT_OF_CLAMP = 0.9


class Specular(StrEnum):
    """Whether a rule depends on the specular weight."""

    no = "no"
    optional = "optional"
    needed = "needed"


@dataclass(frozen=True)
class Dialect:
    """What a program stores for a distribution's parameter.

    Parameters
    ----------
    name : str
        The word after the colon, as in ``blinn-phong:obj2gltf``.
    owners : tuple of str
        The distributions whose parameter it is.
    formula : str
        The rule, in the form in which the program has it.
    decode, encode : callable
        From the stored number and the specular weight to the parameter, and back as the program
        does; elementwise on arrays.
    program, source : str
        The programs, and where in their source the rule stands.
    stored : Parameter
        Name, symbol and legal range of the stored number.
    clamps : tuple of Clamp
        Where the program clamps.
    specular : Specular
        Whether the rule depends on the specular weight, which is 1 if not given.
    roughness : callable or None
        From the stored number to the roughness (α = r²) as which GGX renders it; None where the
        program renders the distribution itself, so that the rule makes no error.
    note : str
        What else to know.
    pairing : Pairing or None
        How it stores both axes of an anisotropic surface; None for each by itself.
    generators : tuple of str
        What ``asset.generator`` has, in lower case, in a glTF file with numbers of this rule.
    provided : str
        On what condition it has; "" for none.
    """

    name: str
    owners: tuple[str, ...]
    formula: str
    decode: _Rule
    encode: _Rule
    program: str
    source: str
    stored: Parameter = _ROUGHNESS
    clamps: tuple[Clamp, ...] = ()
    specular: Specular = Specular.no
    roughness: Callable[[Array], Array] | None = field(default=None, compare=False)
    note: str = ""
    pairing: Pairing | None = None
    generators: tuple[str, ...] = ()
    provided: str = ""

    def encoding(self, parameter: Parameter, setting: str = "") -> Encoding:
        """Return it as an encoding of a parameter.

        Parameters
        ----------
        parameter : Parameter
            That of the distribution.
        setting : str
            The specular weight, from above 0 to 1; "" if not given.

        Raises
        ------
        MdfconvError
            If the weight is missing, none of the rule's, or illegal.
        """
        weight = self._weight(setting)

        with np.errstate(all="ignore"):
            clamps = tuple(
                replace(clamp, limit=float(self.decode(np.array(clamp.edge), weight)))
                for clamp in self.clamps
            )
        low, high = parameter.typical
        for clamp in clamps:
            if clamp.above:
                high = min(high, _SHORT_OF_CLAMP * clamp.limit)
            else:
                low = max(low, clamp.limit / _SHORT_OF_CLAMP)
        # What cannot be stored is beyond the least number.
        ends = sorted(
            float(np.nan_to_num(self.encode(np.array(end), weight), nan=self.stored.lower))
            for end in (low, high)
        )
        return Encoding(
            f"{self.name}:{setting}" if setting else self.name,
            replace(self.stored, typical=(ends[0], min(ends[1], 1.0))),
            lambda stored: self.decode(stored, weight),
            lambda value: self.encode(value, weight),
            self.formula,
            clamps,
            self.pairing,
        )

    def _weight(self, setting: str) -> float:
        if not setting:
            if self.specular is Specular.needed:
                raise MdfconvError(
                    f"{self.name} stores what depends on the specular weight",
                    f"give it, as in {self.owners[0]}:{self.name}:0.5",
                    argument="specular",
                )
            return 1.0
        if self.specular is Specular.no:
            raise MdfconvError(f"{self.name} does not depend on a specular weight")
        try:
            weight = float(setting)
        except ValueError:
            reason = f"a specular weight is a number, not '{setting}'"
            raise MdfconvError(reason, percent_hint(setting)) from None
        if not 0 < weight <= 1:
            raise MdfconvError(f"a specular weight is above 0 and at most 1, not {setting}")
        return weight


def _falling(scale: float, power: float) -> tuple[_Rule, _Rule]:
    """Return N = scale ((1 − r)/L)^power and back, clamped to 0 ≤ r."""
    return (
        lambda r, weight: scale * ((1 - r) / weight) ** power,
        lambda n, weight: np.maximum(1 - weight * (n / scale) ** (1 / power), 0),
    )


def _inverse_power(power: float) -> tuple[_Rule, _Rule]:
    """Return N = (2 / r^power − 2) / L and back."""
    return (
        lambda r, weight: 2 * (1 - r**power) / (weight * r**power),
        lambda n, weight: (2 / (weight * n + 2)) ** (1 / power),
    )


# obj2gltf makes what has less than this luminance rougher.
_OBJ2GLTF_DARK = 0.1


def _obj2gltf(weight: float) -> float:
    return 1 - weight if weight < _OBJ2GLTF_DARK else 1.0


# pbrt-v3's α as a polynomial of ln r, lowest power first, and from which r on it holds.
_PBRT = np.polynomial.Polynomial([1.62142, 0.819955, 0.1734, 0.0171201, 0.000640711])
_PBRT_LEAST, _NEWTON_STEPS, _ROUNDING = 0.001, 40, 1e-12


def _from_pbrt(alpha: Array, weight: float) -> Array:
    # The polynomial is convex and rises: steps from the right close in from above.
    slope, x = _PBRT.deriv(), np.ones(np.shape(alpha))
    for _ in range(_NEWTON_STEPS):
        x = x - (_PBRT(x) - alpha) / slope(x)
    least = _PBRT(np.log(_PBRT_LEAST)) * (1 - _ROUNDING)
    return np.where(alpha >= least, np.maximum(np.exp(x), _PBRT_LEAST), np.nan)


# The exponent at which Babylon.js's curve ends, and its roughness there.
_BABYLON_MOST, _BABYLON_LEAST = 1300.0, 0.1
_MMD_POWER = 0.37
_ADOBE_LEAST = 0.08


_ANISOTROPY = Parameter("anisotropy", "a", (0.0, 0.9), 0, 1, lower_closed=True)
# MaterialX reads any larger anisotropy as this.
_MATERIALX_MOST = 0.98


def _openpbr_axes(r: Array, a: Array) -> tuple[Array, Array]:
    x = r * (2 / (1 + np.square(1 - a))) ** 0.25
    return x, x * np.sqrt(1 - a)


def _materialx_axes(r: Array, a: Array) -> tuple[Array, Array]:
    aspect = np.sqrt(1 - a)
    return np.sqrt(np.minimum(r * r / aspect, 1)), r * np.sqrt(aspect)


def _stretch(x: Array, y: Array) -> Array:
    """Return 1 − α_y/α_x, for roughness along the axes."""
    return (x - y) * (x + y) / np.square(x)


def _gltf_axes(r: Array, a: Array) -> tuple[Array, Array]:
    return np.sqrt(r * r + (1 - r) * (1 + r) * a * a), r * np.ones_like(a)


def _gltf_pair(x: Array, y: Array) -> tuple[Array, Array]:
    # At α 1 across there is nothing to stretch to.
    room = np.where(y < 1, (1 - y) * (1 + y), 1)
    return y, np.sqrt((x - y) * (x + y) / room)


_OPENPBR = Pairing(
    _ANISOTROPY,
    _openpbr_axes,
    lambda x, y: (np.sqrt(np.hypot(x * x, y * y) / np.sqrt(2)), _stretch(x, y)),
    "α_x = r² √(2/(1 + (1−a)²)), α_y = (1−a) α_x",
)
_MATERIALX = Pairing(
    replace(_ANISOTROPY, upper=_MATERIALX_MOST, upper_closed=True),
    _materialx_axes,
    lambda x, y: (np.sqrt(x * y), _stretch(x, y)),
    "α_x = r²/s, α_y = r² s, s = √(1−a)",
)
_GLTF_ANISOTROPY = Pairing(
    replace(_ANISOTROPY, upper_closed=True),
    _gltf_axes,
    _gltf_pair,
    "α_y = r², α_x = α_y + (1−α_y) a²",
)


# α = r², of each axis.
_SQUARE: tuple[_Rule, _Rule] = (lambda r, weight: np.square(r), lambda a, weight: np.sqrt(a))
_PHONG = ("blinn-phong",)
_GGX, _SLOPES = ("ggx",), ("ggx", "beckmann")
_TO_MIRROR = (Clamp(0.0, 0.0),)

DIALECTS = (
    Dialect(
        "blender-obj", _PHONG, "r = 1 − √(N/1000)", *_falling(1000, 2),
        "Blender, OBJ import and export", "wavefront_obj/importer/obj_import_mtl.cc",
        clamps=_TO_MIRROR, roughness=same, generators=("blender i/o", "khronos blender"),
        provided="if its materials came from a Wavefront OBJ",
    ),
    Dialect(
        "obj2gltf", _PHONG, "r = 1 − N/1000, times 1 − L below L = 0.1",
        lambda r, weight: 1000 * (1 - r / _obj2gltf(weight)),
        lambda n, weight: np.maximum(1 - n / 1000, 0) * _obj2gltf(weight),
        "CesiumGS obj2gltf", "lib/loadMtl.js",
        clamps=_TO_MIRROR, specular=Specular.optional, roughness=same, generators=("obj2gltf",),
    ),
    Dialect(
        "assimp-gltf", _PHONG, "r = 1 − L √(N/1000)", *_falling(1000, 2),
        "assimp, glTF 2 export", "code/AssetLib/glTF2/glTF2Exporter.cpp",
        clamps=_TO_MIRROR, specular=Specular.needed, roughness=same,
        generators=("assimp", "open asset import library"),
    ),
    Dialect(
        "fbx", _PHONG, "r = 1 − √N/10", *_falling(100, 2),
        "assimp, Blender and ufbx, FBX import (ufbx OBJ, too)",
        "code/AssetLib/FBX/FBXConverter.cpp; io_scene_fbx/import_fbx.py; ufbx.c",
        clamps=_TO_MIRROR, roughness=same,
    ),
    Dialect(
        "unity-fbx", _PHONG, "s = √(N/100)",
        lambda s, weight: 100 * s**2, lambda n, weight: np.minimum(np.sqrt(n / 100), 1),
        "Unity URP, model import", "FBXMaterialDescriptionPreprocessor.cs",
        _SMOOTHNESS, clamps=(Clamp(1.0, 1.0),), roughness=lambda s: 1 - s,
    ),
    Dialect(
        "peak-alpha", _PHONG, "r = √(2/(N+2))", *_inverse_power(2),
        "FBX2glTF, Filament, Falcor, conway (IFC), trimesh COLLADA",
        "src/gltf/Raw2Gltf.cpp; libs/filamentapp/src/MeshAssimp.cpp; AssimpImporter.cpp; "
        "trimesh/exchange/dae.py",
        _ABOVE_ZERO, roughness=same, note="α stored as roughness: one square root short",
        generators=("fbx2gltf",),
    ),
    Dialect(
        "peak", _PHONG, "r = (2/(N+2))^¼", *_inverse_power(4),
        "trimesh OBJ, O3DE, Panda3D",
        "trimesh/visual/material.py; MaterialConverterSystemComponent.cpp; "
        "panda/src/gobj/material.cxx",
        _ABOVE_ZERO, roughness=same, generators=("trimesh",),
    ),
    Dialect(
        "babylon", _PHONG, "r = 0.1 + 0.9 (1 − (N/1300)^⅓)³",
        lambda r, weight: _BABYLON_MOST * (
            1 - np.cbrt((r - _BABYLON_LEAST) / (1 - _BABYLON_LEAST))
        ) ** 3,
        lambda n, weight: _BABYLON_LEAST + (1 - _BABYLON_LEAST) * (
            1 - np.cbrt(np.minimum(n / _BABYLON_MOST, 1))
        ) ** 3,
        "Babylon.js, glTF export", "glTFMaterialExporter.ts",
        replace(_ROUGHNESS, lower=_BABYLON_LEAST),
        clamps=(Clamp(_BABYLON_LEAST, _BABYLON_LEAST),), roughness=same,
        note="its test: N = 64 gives 0.328809", generators=("babylon",),
    ),
    Dialect(
        "vtk-gltf", _PHONG, "r = 1/(1 + 0.2 L N)",
        lambda r, weight: 5 * (1 - r) / (r * weight),
        lambda n, weight: 1 / (1 + 0.2 * weight * n),
        "VTK, glTF export", "IO/Export/vtkGLTFExporter.cxx",
        _ABOVE_ZERO, specular=Specular.needed, roughness=same, generators=("vtk",),
    ),
    Dialect(
        "ifcopenshell-gltf", _PHONG, "r = 1/N",
        lambda r, weight: 1 / r, lambda n, weight: 1 / n,
        "IfcOpenShell", "mapping.cpp",
        _ABOVE_ZERO, roughness=same, generators=("ifcopenshell",),
    ),
    Dialect(
        "mmd-tools", _PHONG, "r = 1/max(N, 1)^0.37",
        lambda r, weight: r ** (-1 / _MMD_POWER), lambda n, weight: np.maximum(n, 1) ** -_MMD_POWER,
        "Blender mmd_tools", "mmd_tools/core/material.py",
        _ABOVE_ZERO, clamps=(Clamp(1.0, 1.0, above=False),), roughness=same,
    ),
    Dialect(
        "adobe-usd", _PHONG, "r = √(2/(L N + 2)), 0 where that is below 0.08",
        _inverse_power(2)[0],
        lambda n, weight: np.where((r := _inverse_power(2)[1](n, weight)) < _ADOBE_LEAST, 0, r),
        "Adobe USD plugins", "utils/src/materials.cpp",
        replace(_ROUGHNESS, lower=_ADOBE_LEAST), clamps=(Clamp(0.0, _ADOBE_LEAST),),
        specular=Specular.needed, roughness=same,
    ),
    Dialect(
        "adobe-fbx", _PHONG, "N = 100 (1 − r)",
        lambda r, weight: 100 * (1 - r), lambda n, weight: np.maximum(1 - n / 100, 0),
        "Adobe USD plugins, FBX export", "utils/src/materials.cpp",
        clamps=_TO_MIRROR, note="what it makes of a roughness",
    ),
    Dialect(
        "mitsuba-phong", _PHONG, "N = 2/α² − 2", *_inverse_power(2),
        "Mitsuba 0.6, distribution phong", "src/bsdfs/microfacet.h", _ALPHA,
    ),
    Dialect(
        "cycles-ashikhmin", ("blinn-phong", "ashikhmin-shirley"),
        "N = 2/r⁴ − 2", *_inverse_power(4),
        "Blender Cycles, Ashikhmin-Shirley", "src/kernel/closure/bsdf_ashikhmin_shirley.h",
        _ABOVE_ZERO,
    ),
    Dialect(
        "x3d", _PHONG, "N = 128 s",
        lambda s, weight: 128 * s, lambda n, weight: n / 128,
        "X3D and VRML shininess", "ISO/IEC 19775-1, Material", _SHININESS,
    ),
    Dialect(
        "pbrt-v3", _SLOPES,
        "α = 1.62142 + 0.819955 x + 0.1734 x² + 0.0171201 x³ + 0.000640711 x⁴, x = ln r",
        lambda r, weight: _PBRT(np.log(r)), _from_pbrt,
        "pbrt-v3, remaproughness", "src/core/microfacet.h",
        replace(_ABOVE_ZERO, lower=_PBRT_LEAST, lower_closed=True),
        note="what is below 0.001 is read as 0.001",
    ),
    Dialect(
        "pbrt-v4", _SLOPES, "α = √r",
        lambda r, weight: np.sqrt(r), lambda alpha, weight: np.square(alpha),
        "pbrt-v4, remaproughness", "src/pbrt/util/scattering.h", _ABOVE_ZERO,
        note="its author: kept although incorrect (issue 479)",
    ),
    Dialect(
        "blender-2.7", _SLOPES, "α = r",
        lambda r, weight: r, lambda alpha, weight: alpha,
        "Blender before 2.8", "versioning code", _ABOVE_ZERO,
    ),
    Dialect(
        "gltf-glossiness", _GGX, "α = (1 − g)²",
        lambda g, weight: np.square(1 - g), lambda alpha, weight: 1 - np.sqrt(alpha),
        "glTF, KHR_materials_pbrSpecularGlossiness", "text of the extension", _GLOSSINESS,
    ),
    Dialect(
        "luxcore-glossy2", _GGX, "α = √(u v), for u = v",
        lambda u, weight: u, lambda alpha, weight: alpha,
        "LuxCore glossy2", "material.cpp; glossy2.cpp", replace(_ABOVE_ZERO, symbol="u"),
        note="its own Schlick lobe is GGX and not schlick",
    ),
    Dialect(
        "openpbr", _GGX, _OPENPBR.formula, *_SQUARE,
        "OpenPBR", "specification 1.1, specular_roughness_anisotropy", _ABOVE_ZERO,
        pairing=_OPENPBR,
    ),
    Dialect(
        "materialx", _SLOPES, _MATERIALX.formula, *_SQUARE,
        "MaterialX, roughness_anisotropy", "mx_roughness_anisotropy.glsl", _ABOVE_ZERO,
        pairing=_MATERIALX, note="α_x is at most 1; an a beyond 0.98 is read as 0.98",
    ),
    Dialect(
        "gltf-anisotropy", _GGX, _GLTF_ANISOTROPY.formula, *_SQUARE,
        "glTF, KHR_materials_anisotropy", "text of the extension", _ABOVE_ZERO,
        pairing=_GLTF_ANISOTROPY,
    ),
)  # fmt: skip


def dialects_of(owner: str) -> dict[str, Dialect]:
    """Return the dialects of a distribution's parameter by their names."""
    return {dialect.name: dialect for dialect in DIALECTS if owner in dialect.owners}
