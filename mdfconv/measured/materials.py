"""Materials for renderers that show a measured surface, each with what it approximates.

The fit is k_d/π + k_s L F, in which the diffuse part does not depend on the Fresnel factor. Where a
renderer couples the two, the diffuse colour is that which reflects k_d along the normal.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any, TypeAlias
from xml.etree import ElementTree

import numpy as np

from mdfconv.brdf.fresnel import (
    Fresnel,
    conductor,
    dielectric,
    dielectric_index,
    schlick_fresnel,
)
from mdfconv.brdf.microfacet import MASKINGS, Microsurface, direction, dot, reflect
from mdfconv.distributions import Distribution
from mdfconv.distributions.evaluation import Array
from mdfconv.errors import MdfconvError
from mdfconv.measured.brdf_fit import MeasuredFit
from mdfconv.measured.samples import wavelengths_of
from mdfconv.measured.substitutes import LobePair, Substitute, lobe_pair, substitute
from mdfconv.output.records import percent

# The form of a parameter that renderers store.
_ROUGHNESS = "ggx:roughness"
# The distributions of renderers and of material libraries.
_LOBES = ("ggx", "beckmann", "blinn-phong")
# A reflectance above 1 by no more than this is a calibration, which is clamped.
_CALIBRATION = 0.05
# Angles, in degrees, at which a surface that reflects more than it receives is no material, and one
# at which the sum of a Lambertian and a Fresnel reflection may do so.
_MEASURED, _GRAZING = (0, 45), 75
_COMPARED = (0, 30, 45, 60, _GRAZING)
# Differences of less are not worth a word, nor a diffuse albedo of less in units of F₀.
_NOTICED, _LEAST_DIFFUSE = 0.02, 0.005
# A second lobe pays if it leaves no more than this share of the error.
_HALF = 0.5
# What reflects less is compared with this.
_BLACK = 1e-4
# Half vectors of an albedo: within 0.7 % at 75°.
_DRAWN = (64, 24)
# Between these a reflectance has an index of refraction.
_LEAST_REFLECTANCE, _LARGEST_REFLECTANCE = 1e-6, 0.9999
# How many conductors are compared with Schlick's curve, and which k² is 0.
_CONDUCTORS, _ROUNDING = 200, 1e-9
# From which wavelengths, in nm, to below which others colours are averaged: red, green and blue.
_BANDS = ((600, 701), (500, 600), (400, 500))
_COLOURS = (("r", "red"), ("g", "green"), ("b", "blue"))


@dataclass(frozen=True)
class Snippet:
    """A material in the form of a renderer or of a file.

    Parameters
    ----------
    title : str
        The form, such as ``"Mitsuba 3"``.
    text : str
        What to paste; empty if there is no such material.
    note : str
        What is approximated and its errors, or what to use instead; empty if there is nothing.
    """

    title: str
    text: str
    note: str


def snippets(fit: MeasuredFit, channels: Sequence[str]) -> list[Snippet]:
    """Return materials that show a fitted surface.

    Parameters
    ----------
    fit : MeasuredFit
        The fit; one to a single angle only hands its roughness on.
    channels : sequence of str
        The names of its channels: one for grey; red, green and blue; or wavelengths.

    Returns
    -------
    list of Snippet
        One for each form. A surface that reflects more than it receives has a single one without
        a text, whose note says so.
    """
    if fit.fresnel is None:
        return _roughness_only(fit)
    reflected = _largest_reflectance(fit)
    if reflected > 1 + _CALIBRATION:
        text = (
            f"Not a material: the fit reflects {100 * reflected:.3g} % of the light. Check the "
            "calibration, and whether the values are reflectance factors (π times a BRDF)."
        )
        return [Snippet("No material", "", text)]
    surface = _Appearance(fit, *_colours(channels))
    return [_snippet(title, form, surface) for title, form in _FORMS.items()]


def _largest_reflectance(fit: MeasuredFit) -> float:
    """Return what a fit reflects along the normal as a mirror, and at angles as it is, at most."""
    f0 = 1.0 if fit.f0 is None or fit.fresnel == "none" else fit.f0
    diffuse, specular = np.array(fit.diffuse, float), np.array(fit.specular, float)
    albedos = [fit.albedo(float(np.radians(angle))) for angle in _MEASURED]
    return float(np.max([diffuse + specular * f0, *albedos]))


def _snippet(title: str, form: Callable[[_Appearance], _Form], surface: _Appearance) -> Snippet:
    try:
        text, remarks, albedo = form(surface)
    except MdfconvError as error:
        return Snippet(title, "", f"{error}.")
    remarks = [*remarks, *([surface.difference(albedo)] if albedo else [])]
    return Snippet(title, text, " ".join(filter(None, [*remarks, *surface.remarks])))


# Of angles in radians: the share of the light that is reflected, shape (channels,).
_Albedo: TypeAlias = Callable[[float], Array]
# A form's text, remarks, and albedo if its formulas have one.
_Form: TypeAlias = tuple[str, Sequence[str], _Albedo | None]


@dataclass(frozen=True)
class _Appearance:
    """A fit in the channels of a renderer: one, or linear red, green and blue.

    `groups` has the fit's channels for each of them, `remark` says how they were chosen.
    """

    fit: MeasuredFit
    groups: Sequence[Sequence[int]]
    remark: str

    def averaged(self, values: Sequence[float] | Array | None) -> Array:
        """Return a number of each channel as one of each of the renderer's; 1 where not given."""
        if values is None:
            return np.ones(len(self.groups))
        return np.array([np.mean([values[index] for index in group]) for group in self.groups])

    @property
    def is_metal(self) -> bool:
        """Whether it has one reflectance per channel."""
        return self.fit.fresnel in ("metal", "none")

    @property
    def is_constant(self) -> bool:
        """Whether the reflectance is the same at all angles."""
        return self.fit.fresnel == "none"

    @property
    def normal(self) -> Array:
        """k_s F₀, at most 1."""
        f0 = None if self.is_constant else self.fit.f0
        return np.minimum(self.averaged(f0) * self.averaged(self.fit.specular), 1)

    @property
    def diffuse(self) -> Array:
        """k_d, at most what the specular reflection leaves; 0 where that is all there is."""
        diffuse = np.minimum(self.averaged(self.fit.diffuse), 1 - np.maximum(self.normal, _BLACK))
        return diffuse * (diffuse.max() > _LEAST_DIFFUSE * max(self.normal.max(), _BLACK))

    @property
    def has_diffuse(self) -> bool:
        """Whether there is a diffuse part."""
        return bool(self.diffuse.any())

    @property
    def index(self) -> float:
        """The index of refraction of a dielectric, of the mean of its channels."""
        return float(dielectric_index(min(self.normal.mean(), _LARGEST_REFLECTANCE)))

    @property
    def fresnel(self) -> Fresnel:
        """F with k_s in F₀."""
        if self.is_constant:
            return partial(_constant, normal=self.normal)
        if self.is_metal:
            return partial(schlick_fresnel, normal_reflectance=self.normal[:, None])
        return partial(dielectric, ior=self.index)

    @cached_property
    def remarks(self) -> list[str]:
        """What is true of all forms."""
        remarks = [self.remark]
        sums = self.averaged(self.fit.diffuse) + self.normal
        f0 = 0.0 if self.fit.f0 is None or self.is_constant else max(self.fit.f0)
        largest = max(float(sums.max()), f0)
        if largest > 1:
            remarks.append(
                f"A reflectance of {largest:.4g} is clamped to 1: check the calibration."
            )
        if not self.is_constant and not np.allclose(self.fit.specular or 1, 1):
            factors = ", ".join(map(_number, self.averaged(self.fit.specular)))
            remarks.append(f"The fitted k_s = {factors} is a part of the reflectance.")
        grazing = float(np.max(self._reflected[_GRAZING]))
        if grazing > 1:
            remarks.append(
                f"At {_GRAZING}° the fit reflects {100 * grazing:.4g} %, more than it receives."
            )
        return remarks

    @cached_property
    def ggx(self) -> Substitute:
        """The lobe of GGX that stands for the fitted one."""
        return substitute(self.fit, "ggx")

    @cached_property
    def pair(self) -> LobePair | None:
        """The two lobes of GGX that stand for the fitted one, if they halve the error of one."""
        if self.ggx.exact:
            return None
        pair = lobe_pair(self.fit, self.ggx)
        return pair if pair.errors[0] < _HALF * self.ggx.errors[0] else None

    @cached_property
    def _reflected(self) -> dict[int, Array]:
        """The fit's albedo at some angles, degrees."""
        return {
            angle: self.averaged(self.fit.albedo(float(np.radians(angle)))) for angle in _COMPARED
        }

    def gain(self, specular: _Albedo) -> float:
        """Return what balances the errors of a specular albedo over the angles; 1 if it is good."""
        ratios, worst = [], 0.0
        for angle, wanted in self._reflected.items():
            found = specular(float(np.radians(angle)))
            ratios += [*(found / np.maximum(wanted - self.diffuse, _BLACK))]
            error = (found + self.diffuse) / np.maximum(wanted, _BLACK) - 1
            worst = max(worst, float(np.max(np.abs(error))))
        return 2 / float(min(ratios) + max(ratios)) if worst > _NOTICED else 1.0

    def difference(self, albedo: _Albedo) -> str:
        """Return how far an albedo is from the fit's, at the angle where it is farthest."""
        worst, where = 0.0, 0
        for angle, wanted in self._reflected.items():
            ratio = np.broadcast_to(albedo(float(np.radians(angle))), wanted.shape) / np.maximum(
                wanted, _BLACK
            )
            far = float(ratio[np.argmax(np.abs(ratio - 1))]) - 1
            if abs(far) > abs(worst):
                worst, where = far, angle
        if abs(worst) < 0.5 * _NOTICED:
            return f"Its albedo is that of the fit up to {_GRAZING}°, within 1 %."
        comparison = "less" if worst < 0 else "more"
        return (
            f"Up to {_GRAZING}° it reflects at most {percent(abs(worst))} {comparison} "
            f"than the fit, at {where}°."
        )


# A share, a distribution and its parameter.
_Lobe: TypeAlias = tuple[float, Distribution, float]


def _albedo(
    theta: float, lobes: Sequence[_Lobe], fresnel: Fresnel, masking: str = "correlated"
) -> Array:
    """Return ∫ Σ share D G F / (4 cos θ_i) dω for a viewer at θ, shape (channels,) or (1,)."""
    view = direction(theta)
    first, second = ((np.arange(count) + 0.5) / count for count in _DRAWN)
    # The other half of the azimuths mirrors this one.
    grid = [axis.ravel() for axis in np.meshgrid(first, 0.5 * second)]
    total = np.zeros(1)
    for share, mdf, parameter in lobes:
        surface = Microsurface(mdf, parameter)
        m = surface.half_vectors(*grid)
        light = reflect(view, m)
        cosine = dot(np.broadcast_to(view, m.shape), m)
        lit = (cosine > 0) & (light[:, 2] > 0)
        shadow = MASKINGS[masking](surface)(light[lit], np.broadcast_to(view, m.shape)[lit], m[lit])
        value = shadow * cosine[lit] / (view[2] * m[lit, 2]) * fresnel(cosine[lit])
        total = total + share * np.atleast_1d(np.sum(value, axis=-1)) / cosine.size
    return total


def _colours(channels: Sequence[str]) -> tuple[Sequence[Sequence[int]], str]:
    """Return which channels make one, or red, green and blue, and what to know of that."""
    names = [channel.strip().lower() for channel in channels]
    everything = range(len(names))
    if len(names) == 1:
        return [everything], ""
    named = [[i for i in everything if names[i] in colour] for colour in _COLOURS]
    if len(names) == len(_COLOURS) and all(named):
        return named, ""
    known = wavelengths_of(channels)
    waves = [] if known is None else known.tolist()
    bands = [[i for i, wave in enumerate(waves) if low <= wave < high] for low, high in _BANDS]
    if all(bands):
        taken = "; ".join(" + ".join(channels[i] for i in band) for band in bands)
        return bands, f"Red, green and blue are the means of {taken}: not colorimetric."
    return [everything], f"The {len(names)} channels are averaged: grey."


def _number(value: float) -> str:
    return f"{value:.4g}"


def _numbers(values: Array, separator: str = " ") -> str:
    """Return three numbers of a colour."""
    return separator.join(map(_number, np.broadcast_to(values, 3)))


def _element(tag: str, *children: ElementTree.Element, **attributes: str) -> ElementTree.Element:
    element = ElementTree.Element(tag, attributes)
    element.extend(children)
    return element


def _xml(element: ElementTree.Element) -> str:
    ElementTree.indent(element)
    return ElementTree.tostring(element, "unicode")


def _mitsuba(surface: _Appearance) -> _Form:
    """Return a blend of what diffuse and a specular plugin reflect, each as much brighter."""
    lobes, remark = _mitsuba_lobes(surface)
    # So the diffuse part is as bright as can be.
    weight = 1 - float(surface.diffuse.max()) if surface.has_diffuse else 1.0
    plugin = partial(_optics, surface, weight, has_principled=lobes[0][1].name == "ggx")

    def specular(theta: float, fresnel: Fresnel) -> Array:
        return weight * _albedo(theta, lobes, fresnel, "separable")

    optics, fresnel = plugin(1.0)
    gain, remarks = surface.gain(partial(specular, fresnel=fresnel)), [remark]
    if gain != 1:
        optics, fresnel = plugin(gain)
        remarks.append(
            f"Its specular part is scaled by {_number(gain)}, for Mitsuba's masking is separable "
            "or the lobe another: so its albedo is off to both sides."
        )
    parts = [optics(mdf.name, alpha) for _, mdf, alpha in lobes]
    element = parts[0] if len(parts) == 1 else _blend(1 - lobes[0][0], *parts)
    if surface.has_diffuse:
        base = _bsdf("diffuse", _colour("reflectance", surface.diffuse / (1 - weight)))
        element = _blend(weight, base, element)
    return _xml(element), remarks, lambda theta: surface.diffuse + specular(theta, fresnel)


def _mitsuba_lobes(surface: _Appearance) -> tuple[list[_Lobe], str]:
    """Return the fitted lobes, or the nearest that Mitsuba has, and what that costs."""
    lobes = _lobes(surface.fit, *_LOBES[:2])
    if lobes:
        return lobes, ""
    if surface.pair:
        return _pair_of(surface, surface.pair)
    nearest = min(surface.ggx, substitute(surface.fit, "beckmann"), key=_error)
    return _whole(nearest), _stands_for(surface, nearest)


def _pair_of(surface: _Appearance, pair: LobePair) -> tuple[list[_Lobe], str]:
    """Return two lobes, and what they cost."""
    mdf, (first, second) = pair.distribution, pair.parameters
    lobes = [(pair.share, mdf, first), (1 - pair.share, mdf, second)]
    return lobes, pair.remark(surface.fit.label)


def _stands_for(surface: _Appearance, one: Substitute) -> str:
    """Return what a substitute costs, and what it leaves as it is."""
    remark = one.remark(surface.fit.label)
    if not remark:
        return ""
    f0 = ", ".join(map(_number, surface.normal))
    return f"{remark} The reflectance along the normal remains {f0}."


def _error(one: Substitute) -> float:
    return one.errors[0]


def _whole(one: Substitute) -> list[_Lobe]:
    """Return the lobe that stands for all."""
    return [(1.0, one.end.distribution, one.parameter)]


def _lobes(fit: MeasuredFit, *names: str) -> list[_Lobe]:
    """Return the lobes of a fit; none if its distribution has another name."""
    mdf = fit.distribution
    if mdf.name not in names:
        return []
    if fit.second is None or fit.share is None:
        return [(1.0, mdf, fit.parameter)]
    return [(fit.share, mdf, fit.parameter), (1 - fit.share, mdf, fit.second)]


def _optics(
    surface: _Appearance, weight: float, gain: float, *, has_principled: bool
) -> tuple[Callable[[str, float], ElementTree.Element], Fresnel]:
    """Return the specular plugin for a name and α, and its reflectance.

    A reflectance of roughconductor that is the same at all angles, that of a dielectric, or one
    like Schlick's; where that is not near enough principled has his, by its base colour.
    """
    scale = gain / weight
    if surface.is_constant:
        normal = np.minimum(scale * surface.normal, 1)
        optics = [_string("material", "none"), _colour("specular_reflectance", normal)]
        return partial(_rough, optics), partial(_constant, normal=normal)
    scale *= float(surface.averaged(surface.fit.specular).max())
    normal = surface.normal * (gain / (weight * scale))
    eta = dielectric_index(np.minimum(normal, _LARGEST_REFLECTANCE))
    k, error = np.zeros_like(normal), 0.0
    if surface.is_metal:
        eta, k, error = _conductor_like(normal)
    if error > _NOTICED and has_principled:
        base = np.minimum(scale * normal, 1)
        schlick = partial(schlick_fresnel, normal_reflectance=base[:, None])
        return partial(_principled, base), schlick
    optics = [_colour("eta", eta), _colour("k", k)]
    if not np.isclose(scale, 1):
        optics.append(_float("specular_reflectance", scale))

    def fresnel(cosine: Array) -> Array:
        return scale * np.stack([conductor(cosine, *pair) for pair in zip(eta, k, strict=True)])

    return partial(_rough, optics), fresnel


def _rough(optics: list[ElementTree.Element], name: str, alpha: float) -> ElementTree.Element:
    shape = _string("distribution", name), _float("alpha", alpha)
    return _bsdf("roughconductor", *shape, *optics)


def _principled(base: Array, name: str, alpha: float) -> ElementTree.Element:
    roughness = _float("roughness", alpha**0.5)
    return _bsdf("principled", _colour("base_color", base), _float("metallic", 1), roughness)


def _constant(cosine: Array, normal: Array) -> Array:
    return normal[:, None] * np.ones_like(cosine)


def _conductor_like(normal: Array) -> tuple[Array, Array, float]:
    """Return η and k whose reflectance is nearest to Schlick's up to 75°, and its largest error.

    F₀ leaves one of the two free: η = s (1 − F₀), k² = 2 s (1 + F₀) − η² − 1.
    """
    cosine = np.cos(np.radians(np.arange(0, _GRAZING + 1, 5)))
    found = []
    for f0 in np.clip(normal, _LEAST_REFLECTANCE, _LARGEST_REFLECTANCE):
        root = np.sqrt(f0)
        steps = np.geomspace(1 / (1 + root) ** 2, 1 / (1 - root) ** 2, _CONDUCTORS)
        etas = steps * (1 - f0)
        squares = 2 * steps * (1 + f0) - np.square(etas) - 1
        ks = np.where(squares > _ROUNDING, np.sqrt(np.abs(squares)), 0)
        wanted = schlick_fresnel(cosine, f0)
        errors = [
            float(np.max(np.abs(conductor(cosine, eta, k) / wanted - 1)))
            for eta, k in zip(etas, ks, strict=True)
        ]
        nearest = int(np.argmin(errors))
        found.append((etas[nearest], ks[nearest], errors[nearest]))
    eta, k, error = np.transpose(found)
    return eta, k, float(error.max())


def _bsdf(kind: str, *children: ElementTree.Element) -> ElementTree.Element:
    return _element("bsdf", *children, type=kind)


def _blend(weight: float, *parts: ElementTree.Element) -> ElementTree.Element:
    """Return a blend whose weight is that of the second part."""
    return _bsdf("blendbsdf", _float("weight", weight), *parts)


def _float(name: str, value: float) -> ElementTree.Element:
    return _element("float", name=name, value=_number(value))


def _string(name: str, value: str) -> ElementTree.Element:
    return _element("string", name=name, value=value)


def _colour(name: str, values: Array) -> ElementTree.Element:
    if np.ptp(values) == 0:
        return _float(name, float(values[0]))
    return _element("rgb", name=name, value=_numbers(values, ", "))


def _gltf(surface: _Appearance) -> _Form:
    stored = surface.ggx.stored_as(_ROUGHNESS)
    lobes, (base, metallic) = _whole(stored), _base(surface)
    material: dict[str, Any] = {
        "name": "measured",
        "pbrMetallicRoughness": {
            "baseColorFactor": [*map(_rounded, np.broadcast_to(base, 3)), 1],
            "metallicFactor": _rounded(metallic),
            "roughnessFactor": _rounded(stored.number),
        },
    }
    document: dict[str, Any] = {"asset": {"version": "2.0"}, "materials": [material]}
    if not surface.is_metal:
        extension = "KHR_materials_ior"
        material["extensions"] = {extension: {"ior": _rounded(surface.index)}}
        document = {"asset": {"version": "2.0"}, "extensionsUsed": [extension]} | document
    normal = 0.04 if surface.is_metal else float(surface.normal.mean())

    def albedo(theta: float) -> Array:
        metal = partial(schlick_fresnel, normal_reflectance=base[:, None])
        layer = partial(schlick_fresnel, normal_reflectance=normal)
        diffuse = base * (1 - _mean_layer(theta, normal))
        first, second = (_albedo(theta, lobes, curve) for curve in (metal, layer))
        return metallic * first + (1 - metallic) * (diffuse + second)

    return json.dumps(document, indent=2), [_stands_for(surface, stored)], albedo


def _rounded(value: float) -> float:
    return float(_number(value))


def _base(surface: _Appearance) -> tuple[Array, float]:
    """Return the base colour and the metalness of materials that have both.

    A metal with a diffuse part is a mixture of one and of a dielectric that is mostly diffuse.
    """
    if not surface.is_metal:
        return surface.diffuse / (1 - surface.normal), 0.0
    if not surface.has_diffuse:
        return surface.normal, 1.0
    base = np.minimum(surface.normal + surface.diffuse, 1)
    return base, float(surface.normal.mean() / base.mean())


def _mean_layer(theta: float, normal: float) -> float:
    """Return the mean of Schlick's factor at half vectors over light from all around, by cosine."""
    first, second = ((np.arange(count) + 0.5) / count for count in _DRAWN)
    share, turn = np.meshgrid(first, np.pi * second)
    light = direction(np.arcsin(np.sqrt(share)), turn)
    cosine = np.sqrt(0.5 * (1 + light @ direction(theta)))
    return float(np.mean(schlick_fresnel(cosine, normal)))


def _materialx(surface: _Appearance) -> _Form:
    """Return the sum of a diffuse and of specular nodes, whose distribution is GGX."""
    lobes, remark = _lobes(surface.fit, "ggx"), ""
    if not lobes and surface.pair:
        lobes, remark = _pair_of(surface, surface.pair)
    elif not lobes:
        lobes, remark = _whole(surface.ggx), _stands_for(surface, surface.ggx)
    nodes, name = [], ""
    for number, (share, _, alpha) in enumerate(lobes, 1):
        node = f"specular{number}" if len(lobes) > 1 else "specular"
        nodes.append(_specular_node(surface, share, alpha, node))
        name = _added(nodes, name, node)
    if surface.has_diffuse:
        colour = _colour3("color", surface.diffuse)
        nodes.append(_element("oren_nayar_diffuse_bsdf", colour, name="diffuse", type="BSDF"))
        name = _added(nodes, name, "diffuse")
    shader = _element("surface", _link("bsdf", "BSDF", name), name="shader", type="surfaceshader")

    def albedo(theta: float) -> Array:
        return surface.diffuse + _albedo(theta, lobes, surface.fresnel)

    remarks = [remark, _multiple_scattering(surface, lobes)]
    return _materialx_document(*nodes, shader), remarks, albedo


def _specular_node(
    surface: _Appearance, share: float, alpha: float, name: str
) -> ElementTree.Element:
    inputs = [_input("roughness", "vector2", f"{_number(alpha)}, {_number(alpha)}")]
    if share < 1:
        inputs.append(_input("weight", "float", _number(share)))
    if not surface.is_metal:
        inputs.append(_input("ior", "float", _number(surface.index)))
        return _element("dielectric_bsdf", *inputs, name=name, type="BSDF")
    ends = ("color0", "color82", "color90") if surface.is_constant else ("color0",)
    inputs += [_colour3(end, surface.normal) for end in ends]
    return _element("generalized_schlick_bsdf", *inputs, name=name, type="BSDF")


def _added(nodes: list[ElementTree.Element], first: str, second: str) -> str:
    """Append the sum of two BSDFs, if there are two; return the name of the whole."""
    if not first:
        return second
    name = f"{first}_and_{second}"
    inputs = _link("in1", "BSDF", first), _link("in2", "BSDF", second)
    nodes.append(_element("add", *inputs, name=name, type="BSDF"))
    return name


def _multiple_scattering(surface: _Appearance, lobes: Sequence[_Lobe]) -> str:
    """Return what is added by renderers that follow light from facet to facet."""
    lost = 1 - float(_albedo(0.0, lobes, np.ones_like)[0])
    added = lost * float(
        np.max(surface.normal / np.maximum(surface.normal + surface.diffuse, _BLACK))
    )
    if added < _NOTICED:
        return ""
    return (
        "The fit has no light that is scattered several times between facets: a renderer that "
        f"adds it reflects up to {percent(added)} more along the normal."
    )


def _materialx_document(*nodes: ElementTree.Element) -> str:
    """Return a document with a material of the shader that is the last of the nodes."""
    shader = _link("surfaceshader", "surfaceshader", nodes[-1].get("name", ""))
    material = _element("surfacematerial", shader, name="measured", type="material")
    root = _element("materialx", *nodes, material, version="1.39", colorspace="lin_rec709")
    return f'<?xml version="1.0"?>\n{_xml(root)}'


def _input(name: str, kind: str, value: str) -> ElementTree.Element:
    return _element("input", name=name, type=kind, value=value)


def _link(name: str, kind: str, node: str) -> ElementTree.Element:
    return _element("input", name=name, type=kind, nodename=node)


def _colour3(name: str, values: Array) -> ElementTree.Element:
    return _input(name, "color3", _numbers(values, ", "))


def _openpbr(surface: _Appearance) -> _Form:
    stored = surface.ggx.stored_as(_ROUGHNESS)
    lobes, (base, metalness) = _whole(stored), _base(surface)
    inputs = [
        _colour3("base_color", base),
        _input("base_metalness", "float", _number(metalness)),
        _input("specular_roughness", "float", _number(stored.number)),
    ]
    index = 1.5 if surface.is_metal else surface.index
    if not surface.is_metal:
        inputs.append(_input("specular_ior", "float", _number(index)))
    shader = _element("open_pbr_surface", *inputs, name="shader", type="surfaceshader")

    def albedo(theta: float) -> Array:
        metal = partial(schlick_fresnel, normal_reflectance=base[:, None])
        layer = partial(dielectric, ior=index)
        first, second = (_albedo(theta, lobes, curve) for curve in (metal, layer))
        return metalness * first + (1 - metalness) * (base * (1 - second) + second)

    remarks = [_stands_for(surface, stored), _multiple_scattering(surface, lobes)]
    return _materialx_document(shader), remarks, albedo


def _mtl(surface: _Appearance) -> _Form:
    roughness = surface.ggx.stored_as(_ROUGHNESS)
    exponent = substitute(surface.fit, "blinn-phong")
    lines = {
        "newmtl": "measured",
        "Kd": _numbers(surface.normal if surface.is_metal else surface.diffuse),
        "Ks": _numbers(surface.normal),
        "Ns": _number(exponent.number),
        "Pr": _number(roughness.number),
        "Pm": "1" if surface.is_metal else "0",
        "illum": "3" if surface.is_metal else "2",
    }
    remarks = [_stands_for(surface, roughness), exponent.remark(f"{surface.fit.label} in Ns")]
    if surface.is_metal:
        remarks.append(
            "Kd is the metal's colour for readers of Pm; others need "
            f"Kd {_numbers(surface.diffuse)}."
        )
    else:
        lines["Ni"] = _number(surface.index)
        remarks.append(
            "Blender takes the mean of Ks as the level of its specular reflection: there Ks is "
            "0.5 0.5 0.5, as Ni has the reflectance."
        )
    return "\n".join(f"{key} {value}" for key, value in lines.items()), remarks, None


def _mdfconv(surface: _Appearance) -> _Form:
    fit = surface.fit
    numbers = f"k_d = {_listed(fit.diffuse)}, F₀ = {_listed(fit.f0)}, k_s = {_listed(fit.specular)}"
    if fit.n is not None:
        numbers += f", n = {_number(fit.n)}"
    return f"# {numbers}\n{_call(fit)}", [], None


def _listed(values: Sequence[float] | None) -> str:
    return " ".join(map(_number, values)) if values is not None else "1"


def _call(fit: MeasuredFit) -> str:
    """Return the Python that evaluates a fitted distribution at angles."""
    mdf = fit.distribution
    gamma = "" if mdf.second_parameter is None else f", {_number(mdf.gamma)}"
    lines = ["import mdfconv", "", f'lobe = mdfconv.distribution("{mdf.name}"{gamma})']
    value = f"lobe.normalized(beta, {_number(fit.parameter)})"
    if fit.second is not None and fit.share is not None:
        rest = f"{_number(1 - fit.share)} * lobe.normalized(beta, {_number(fit.second)})"
        value = f"{_number(fit.share)} * {value} + {rest}"
    return "\n".join([*lines, f"density = {value}  # 1/sr, beta in radians"])


def _roughness_only(fit: MeasuredFit) -> list[Snippet]:
    """Return the roughness alone in each form."""
    why = "One angle tells the roughness, not the colour, nor whether it is a metal."
    call = Snippet("mdfconv", _call(fit), "")
    try:
        ggx, beckmann, exponent = (substitute(fit, name) for name in _LOBES)
    except MdfconvError as error:
        return [Snippet(call.title, call.text, f"{error}.")]
    slope, roughness = min(ggx, beckmann, key=_error), ggx.stored_as(_ROUGHNESS)
    number = _rounded(roughness.number)
    texts = {
        "Mitsuba 3": (
            "\n".join(
                _xml(element)
                for element in (
                    _string("distribution", slope.end.distribution.name),
                    _float("alpha", slope.number),
                )
            ),
            slope,
        ),
        "glTF 2.0": (f'"roughnessFactor": {number}', roughness),
        "MaterialX": (_xml(_input("specular_roughness", "float", str(number))), roughness),
        "Wavefront MTL": (f"Ns {_number(exponent.number)}\nPr {number}", roughness),
    }
    return [
        *(
            Snippet(title, text, f"{why} {stored.remark(fit.label)}".strip())
            for title, (text, stored) in texts.items()
        ),
        call,
    ]


_FORMS = {
    "Mitsuba 3": _mitsuba,
    "glTF 2.0": _gltf,
    "MaterialX": _materialx,
    "OpenPBR": _openpbr,
    "Wavefront MTL": _mtl,
    "mdfconv": _mdfconv,
}
