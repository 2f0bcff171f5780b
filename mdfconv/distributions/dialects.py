"""What importers, exporters and renderers store where a surface has an exponent or an α.

Each was read in the source of the program. N is Blinn's exponent, r a stored roughness; s is a
stored smoothness or shininess, g a glossiness, L the luminance of the specular colour or the
weight of the specular lobe. A new dialect is one more entry of `DIALECTS`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import Any

import numpy as np

from mdfconv.distributions.base import same
from mdfconv.distributions.evaluation import Array
from mdfconv.distributions.parameter import (
    REFLECTED,
    Clamp,
    Encoding,
    Pairing,
    Parameter,
    percent_hint,
)
from mdfconv.errors import MdfconvError

# From stored number or parameter, and the setting of the rule, to the other.
_Rule = Callable[[Array, Any], Array]

_ROUGHNESS = Parameter("roughness", "r", (0.0, 1.0), 0, 1, lower_closed=True, upper_closed=True)
_ABOVE_ZERO = replace(_ROUGHNESS, lower_closed=False)
_SMOOTHNESS = replace(_ROUGHNESS, name="smoothness", symbol="s", larger_is_smoother=True)
_SHININESS = replace(_SMOOTHNESS, name="shininess", lower_closed=False)
_GLOSSINESS = replace(_SMOOTHNESS, name="glossiness", symbol="g", upper_closed=False)
_ALPHA = replace(_ABOVE_ZERO, name="alpha", symbol="α")
# The typical range of stored numbers ends so near to where they are clamped.
_SHORT_OF_CLAMP = 0.9
# And starts at no less than this share of its end where a larger number is smoother.
_LEAST_SHARE = 0.001
# Of textures that hold what the rule says of numbers.
SAME = "same"


class Specular(StrEnum):
    """Whether a rule depends on the specular weight."""

    no = "no"
    optional = "optional"
    needed = "needed"


@dataclass(frozen=True)
class Setting:
    """A number besides the stored one that a rule depends on; it follows the name and a colon.

    Parameters
    ----------
    name : str
        What it is, in words.
    symbol : str
        Its symbol in the rule.
    default : float or None
        What is taken where it is not given; None if it must be given.
    example : float
        A usual value, for lists of rules.
    largest : float
        The largest that is legal; all are above 0.
    argument : str
        The argument of functions that has it.
    """

    name: str
    symbol: str
    default: float | None
    example: float
    largest: float = float("inf")
    argument: str = ""


_WEIGHT = Setting("specular weight", "L", None, 1.0, 1.0, "specular")
_OPTIONAL_WEIGHT = replace(_WEIGHT, default=1.0)
_SCALE = Setting("scale", "K", None, 128.0)


@dataclass(frozen=True)
class LibraryNumbers:
    """What Ns is in the Wavefront material libraries that a program writes.

    Parameters
    ----------
    rule : str
        The rule from what the author set to Ns.
    header : str
        A regular expression for a comment of the library, with the groups ``name`` (of the
        program) and, where the program writes it, ``version``.
    step : float
        What authors set is a multiple of it as a rule: of a hardness always.
    before : tuple of int
        The first version that writes it no longer; empty if all do.
    never : str
        A regular expression for a line that the program does not write; "" for none.
    """

    rule: str
    header: str
    step: float
    before: tuple[int, ...] = ()
    never: str = ""


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
    setting : Setting or None
        What else the rule depends on.
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
    texels : str
        What the program's *textures* hold: `SAME` for what the rule says of numbers, an endpoint
        such as ``"ggx:roughness"``, or "" where it is not known.
    library : LibraryNumbers or None
        How its numbers get into material libraries; None if they do not.
    caution : str
        What everybody who uses it must know; "" for nothing.
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
    setting: Setting | None = None
    roughness: Callable[[Array], Array] | None = field(default=None, compare=False)
    note: str = ""
    pairing: Pairing | None = None
    generators: tuple[str, ...] = ()
    provided: str = ""
    texels: str = ""
    library: LibraryNumbers | None = None
    caution: str = ""

    @property
    def specular(self) -> Specular:
        """Whether the rule depends on the specular weight."""
        if self.setting is None or self.setting.symbol != _WEIGHT.symbol:
            return Specular.no
        return Specular.needed if self.setting.default is None else Specular.optional

    @property
    def example(self) -> str:
        """The name with a usual value of the setting that it needs."""
        needed = self.setting is not None and self.setting.default is None
        return f"{self.name}:{self.setting.example:g}" if self.setting and needed else self.name

    def encoding(self, parameter: Parameter, setting: str = "") -> Encoding:
        """Return it as an encoding of a parameter.

        Parameters
        ----------
        parameter : Parameter
            That of the distribution.
        setting : str
            The setting, as text; "" if not given.

        Raises
        ------
        MdfconvError
            If the setting is missing, illegal, or the rule has none.
        """
        weight = self.setting_value(setting)

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
        least, largest = self.stored.lower, self.stored.upper
        ends = sorted(
            float(
                np.clip(
                    np.nan_to_num(self.encode(np.array(end), weight), nan=least), least, largest
                )
            )
            for end in (low, high)
        )
        if self.stored.larger_is_smoother:
            # Ranges are searched by the logarithm.
            ends[0] = max(ends[0], _LEAST_SHARE * ends[1])
        return Encoding(
            f"{self.name}:{setting}" if setting else self.name,
            replace(self.stored, typical=(ends[0], ends[1])),
            lambda stored: self.decode(stored, weight),
            lambda value: self.encode(value, weight),
            self.formula,
            clamps,
            self.pairing,
        )

    def setting_value(self, text: str = "") -> float:
        """Return the setting that a text gives, or its default; 1 where the rule has none."""
        setting = self.setting
        if setting is None:
            if text:
                raise MdfconvError(
                    f"{self.name} does not depend on a specular weight or another setting",
                    f"leave out :{text}",
                )
            return 1.0
        if not text:
            if setting.default is None:
                raise MdfconvError(
                    f"{self.name} depends on the {setting.name} {setting.symbol}",
                    f"give it, as in {self.owners[0]}:{self.name}:{setting.example / 2:g}",
                    argument=setting.argument,
                )
            return setting.default
        try:
            value = float(text)
        except ValueError:
            reason = f"a {setting.name} is a number, not '{text}'"
            raise MdfconvError(reason, percent_hint(text)) from None
        if not (0 < value <= setting.largest and value < np.inf):
            limit = "" if setting.largest == np.inf else f" and at most {setting.largest:g}"
            raise MdfconvError(f"a {setting.name} is above 0{limit}, not {text}")
        return value


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


def _obj2gltf(weight: Any) -> Any:
    return np.where(np.less(weight, _OBJ2GLTF_DARK), 1 - weight, 1.0)


# Blender's hardness, 1 to 511, in the range of Ns, which ends at 1000; 0 is the roughest.
_HARDNESS = 1.9607843137254901
_HARDEST = 511


_SOURCE_LEAST, _SOURCE_RANGE = 1.0, 149.0


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
_GGX_ROUGHNESS = "ggx:roughness"
# A roughness is set with three digits at most.
_ROUGHNESS_STEP = 0.001
# Of exporters from 2.80 on: without a version, or with one such as "4.0.0 Alpha".
_BLENDER_HEADER = r"#\s*(?P<name>Blender)(?:\s+v?(?P<version>\d[\d.]*)[^':]*?)?\s+MTL File"
# From 2.80 on Blender writes 1, or the metallic that is not 0.
_BLACK_AMBIENT = r"Ka 0\.0+ 0\.0+ 0\.0+\s"

DIALECTS = (
    Dialect(
        "blender-2.8", _PHONG, "r = 1 − √N/30", *_falling(900, 2),
        "Blender 2.80 to 3.2, OBJ export", "io_scene_obj/export_obj.py; obj_export_mtl.cc",
        clamps=_TO_MIRROR, roughness=same, texels=_GGX_ROUGHNESS,
        library=LibraryNumbers(
            "Ns = 900 (1 − r)²", _BLENDER_HEADER,
            _ROUGHNESS_STEP, before=(3, 3), never=_BLACK_AMBIENT,
        ),
    ),
    Dialect(
        "blender-obj", _PHONG, "r = 1 − √(N/1000)", *_falling(1000, 2),
        "Blender from 3.3 on, OBJ import and export",
        "wavefront_obj/importer/obj_import_mtl.cc; obj_export_mtl.cc",
        clamps=_TO_MIRROR, roughness=same, generators=("blender i/o", "khronos blender"),
        provided="if its materials came from a Wavefront OBJ", texels=_GGX_ROUGHNESS,
        library=LibraryNumbers(
            "Ns = 1000 (1 − r)²", _BLENDER_HEADER,
            _ROUGHNESS_STEP, never=_BLACK_AMBIENT,
        ),
    ),
    Dialect(
        "blender-2.7", _PHONG, "Ns = 1.960784 (N − 1)",
        lambda ns, _: ns / _HARDNESS + 1, lambda n, _: (n - 1) * _HARDNESS,
        "Blender up to 2.79, OBJ export", "io_scene_obj/export_obj.py (specular_hardness)",
        Parameter(
            "shininess", "Ns", (0, 1000), -_HARDNESS, 1000.0, lower_closed=True, upper_closed=True,
            larger_is_smoother=True,
        ),
        library=LibraryNumbers(
            "Ns = 1.960784 (N − 1)", r"#\s*(?P<name>Blender)(?:3D)?\s+MTL File", 1.0
        ),
    ),
    Dialect(
        "obj2gltf", _PHONG, "r = 1 − N/1000, for L < 0.1 times (1 − L)",
        lambda r, weight: 1000 * (1 - r / _obj2gltf(weight)),
        lambda n, weight: np.maximum(1 - n / 1000, 0) * _obj2gltf(weight),
        "CesiumGS obj2gltf", "lib/loadMtl.js",
        clamps=_TO_MIRROR, setting=_OPTIONAL_WEIGHT, roughness=same, generators=("obj2gltf",),
        note="map_Ns is copied as it is, with factor 1",
    ),
    Dialect(
        "assimp-gltf", _PHONG, "r = 1 − L √(N/1000)", *_falling(1000, 2),
        "assimp, glTF 2 export", "code/AssetLib/glTF2/glTF2Exporter.cpp",
        clamps=_TO_MIRROR, setting=_WEIGHT, roughness=same,
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
        texels=SAME,
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
        _ABOVE_ZERO, setting=_WEIGHT, roughness=same, generators=("vtk",),
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
        setting=_WEIGHT, roughness=same,
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
        texels=SAME,
    ),
    Dialect(
        "cycles-ashikhmin", ("blinn-phong", "ashikhmin-shirley"),
        "N = 2/r⁴ − 2", *_inverse_power(4),
        "Blender Cycles, Ashikhmin-Shirley", "src/kernel/closure/bsdf_ashikhmin_shirley.h",
        _ABOVE_ZERO,
        texels=SAME,
    ),
    Dialect(
        "x3d", _PHONG, "N = 128 s",
        lambda s, weight: 128 * s, lambda n, weight: n / 128,
        "X3D and VRML shininess", "ISO/IEC 19775-1, Material", _SHININESS,
        texels=SAME,
    ),
    Dialect(
        "linear", _PHONG, "r = 1 − N/K",
        lambda r, scale: scale * (1 - r), lambda n, scale: np.maximum(1 - n / scale, 0),
        "shaders and importers, K = 100, 128, 256", "as in 1.0 - shininess / 128.0",
        clamps=_TO_MIRROR, setting=_SCALE, roughness=same,
    ),
    Dialect(
        "niftools", _PHONG, "r = 1/(N + 1)",
        lambda r, _: 1 / r - 1, lambda n, _: 1 / (n + 1),
        "niftools Blender add-on, NIF glossiness",
        "nif_import/property/material/__init__.py (import_material_gloss)",
        _ABOVE_ZERO, roughness=same,
    ),
    Dialect(
        "source-phong", _PHONG, "n = 1 + 149 v, of the reflected ray; N = 4 n + 3",
        lambda v, _: REFLECTED.decode(_SOURCE_LEAST + _SOURCE_RANGE * v),
        lambda n, _: (REFLECTED.encode(n) - _SOURCE_LEAST) / _SOURCE_RANGE,
        "Source engine, $phongexponenttexture", "skin_ps20b.fxc (fSpecExp)",
        replace(_SMOOTHNESS, name="texel", symbol="v"), texels=SAME,
        note="$phongexponent is n itself: blinn-phong:reflected",
    ),
    Dialect(
        "povray", _PHONG, "N = 1/roughness",
        lambda r, _: 1 / r, lambda n, _: 1 / n,
        "POV-Ray, finish roughness", "documentation of finish, specular and roughness",
        replace(_ABOVE_ZERO, upper=np.inf, upper_closed=False),
        note="phong_size is the exponent of the reflected ray: blinn-phong:reflected",
    ),
    Dialect(
        "ward", ("beckmann",), "m_B = α, nearly",
        lambda alpha, _: alpha, lambda m, _: m,
        "Radiance plastic and metal, Mitsuba 0.6 ward", "Ward 1992, isotropic model",
        replace(_ALPHA, upper=np.inf, upper_closed=False), texels=SAME,
        caution="the exponential of Ward's lobe is Beckmann's with m_B = α, its other factors are "
        "not: the result is near, not equal",
    ),
    Dialect(
        "pbrt-v3", _SLOPES,
        "α = 1.62142 + 0.819955 x + 0.1734 x² + 0.0171201 x³ + 0.000640711 x⁴, x = ln r",
        lambda r, weight: _PBRT(np.log(r)), _from_pbrt,
        "pbrt-v3, remaproughness", "src/core/microfacet.h",
        replace(_ABOVE_ZERO, lower=_PBRT_LEAST, lower_closed=True),
        note="what is below 0.001 is read as 0.001",
        texels=SAME,
    ),
    Dialect(
        "pbrt-v4", _SLOPES, "α = √r",
        lambda r, weight: np.sqrt(r), lambda alpha, weight: np.square(alpha),
        "pbrt-v4, remaproughness", "src/pbrt/util/scattering.h", _ABOVE_ZERO,
        note="its author: kept although incorrect (issue 479)",
        texels=SAME,
    ),
    Dialect(
        "blender-2.7", _SLOPES, "α = r",
        lambda r, weight: r, lambda alpha, weight: alpha,
        "Blender before 2.8", "versioning code", _ABOVE_ZERO,
        texels=SAME,
    ),
    Dialect(
        "gltf-glossiness", _GGX, "α = (1 − g)²",
        lambda g, weight: np.square(1 - g), lambda alpha, weight: 1 - np.sqrt(alpha),
        "glTF, KHR_materials_pbrSpecularGlossiness", "text of the extension", _GLOSSINESS,
        texels=SAME,
    ),
    Dialect(
        "luxcore-glossy2", _GGX, "α = √(u v), for u = v",
        lambda u, weight: u, lambda alpha, weight: alpha,
        "LuxCore glossy2", "material.cpp; glossy2.cpp", replace(_ABOVE_ZERO, symbol="u"),
        note="its own Schlick lobe is GGX and not schlick",
        texels=SAME,
    ),
    Dialect(
        "openpbr", _GGX, _OPENPBR.formula, *_SQUARE,
        "OpenPBR", "specification 1.1, specular_roughness_anisotropy", _ABOVE_ZERO,
        pairing=_OPENPBR,
        texels=SAME,
    ),
    Dialect(
        "materialx", _SLOPES, _MATERIALX.formula, *_SQUARE,
        "MaterialX, roughness_anisotropy", "mx_roughness_anisotropy.glsl", _ABOVE_ZERO,
        pairing=_MATERIALX, note="α_x is at most 1; an a beyond 0.98 is read as 0.98",
        texels=SAME,
    ),
    Dialect(
        "gltf-anisotropy", _GGX, _GLTF_ANISOTROPY.formula, *_SQUARE,
        "glTF, KHR_materials_anisotropy", "text of the extension", _ABOVE_ZERO,
        pairing=_GLTF_ANISOTROPY,
        texels=SAME,
    ),
)  # fmt: skip


def dialects_of(owner: str) -> dict[str, Dialect]:
    """Return the dialects of a distribution's parameter by their names."""
    return {dialect.name: dialect for dialect in DIALECTS if owner in dialect.owners}
