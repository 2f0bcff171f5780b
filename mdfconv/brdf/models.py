"""The BRDFs of the white-furnace test by name, with their samplers.

A new one is a function from its parameter to a `FurnaceModel`, and one line at the end.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from mdfconv.brdf import phong, reflection
from mdfconv.brdf.directions import Brdf, dot, mirrored, reflect
from mdfconv.brdf.fresnel import Fresnel, lossless
from mdfconv.brdf.furnace import FurnaceModel
from mdfconv.brdf.masking import MASKINGS
from mdfconv.brdf.microsurface import Microsurface
from mdfconv.brdf.sampling import cosine_lobe, cosine_lobe_density, reflected_density
from mdfconv.distributions import distribution
from mdfconv.distributions.evaluation import Array
from mdfconv.errors import MdfconvError
from mdfconv.registry import Registry


@dataclass(frozen=True)
class _Definition:
    """A BRDF by name: how it is built, the one option that it has, and its distribution."""

    name: str
    build: Callable[..., FurnaceModel]
    option: str = ""
    distribution: str = ""


_REGISTRY: Registry[_Definition] = Registry("BRDF")
# Why a BRDF does not take an option.
_WITHOUT = {"normalizer": "{} has no normalizer", "masking": "the masking of {} is part of it"}


def furnace_model(
    name: str, parameter: float, *, normalizer: str | None = None, masking: str | None = None
) -> FurnaceModel:
    """Return a BRDF for the white-furnace test, its Fresnel term 1.

    Parameters
    ----------
    name : str
        One of `list_models`.
    parameter : float
        Exponent of the Phong BRDFs, the distribution's parameter of the others.
    normalizer : str, optional
        Of modified Phong: a name in `mdfconv.brdf.phong.NORMALIZERS`; "usual" by default.
    masking : str, optional
        Of ggx and beckmann: a name in `mdfconv.brdf.masking.MASKINGS`; "correlated" by
        default.

    Raises
    ------
    MdfconvError
        If a name is not known, does not apply, or the parameter is illegal.
    """
    definition = _REGISTRY[name]
    options = {"normalizer": normalizer, "masking": masking}
    chosen = {option: value for option, value in options.items() if value is not None}
    for option in chosen:
        if option != definition.option:
            others = " and ".join(other.name for other in _REGISTRY if other.option == option)
            reason = _WITHOUT[option].format(definition.name)
            raise MdfconvError(reason, f"it can be chosen for {others}")
    return definition.build(float(parameter), **chosen)


def model_distribution(name: str) -> str:
    """Return the distribution whose parameter a BRDF takes; "" for an exponent of Phong's."""
    return _REGISTRY[name].distribution


def list_models() -> list[str]:
    """Return the names of the BRDFs."""
    return _REGISTRY.names


def _microfacets(name: str) -> Callable[..., FurnaceModel]:
    def build(alpha: float, masking: str = "correlated") -> FurnaceModel:
        surface = Microsurface(distribution(name), alpha)
        shadow = MASKINGS[masking](surface)
        return _facet_model(reflection.microfacet(surface, lossless, shadow), surface)

    return build


def _with_distribution(
    name: str, mdf: str, brdf: Callable[[Microsurface, Fresnel], Brdf]
) -> _Definition:
    def build(parameter: float) -> FurnaceModel:
        surface = Microsurface(distribution(mdf), parameter)
        return _facet_model(brdf(surface, lossless), surface)

    return _Definition(name, build, distribution=mdf)


def _register(definition: _Definition) -> None:
    """Register a BRDF, under all names of its distribution if it has that of one."""
    name, owner = definition.name, definition.distribution
    if owner == name:
        mdf = distribution(name)
        _REGISTRY.add(name, definition, mdf.aliases, mdf.meant_by)
    else:
        phong = distribution("blinn-phong").meant_by if not owner else {}
        _REGISTRY.add(name, definition, meant_by=dict.fromkeys(phong, "phong"))


def _facet_model(brdf: Brdf, surface: Microsurface) -> FurnaceModel:
    """Return the model of a BRDF in half vectors, sampled by the facets of its surface."""

    def sample(view: Array, u1: Array, u2: Array) -> tuple[Array, Array]:
        if surface.has_visible_normals:
            m = surface.visible_normals(view, u1, u2)
            density = surface.visible_normal_density(view, m)
        else:
            m = surface.half_vectors(u1, u2)
            density = surface.half_vector_density(m)
        density = np.where(dot(view, m) > 0, density, 0)
        return reflect(view, m), reflected_density(density, view, m)

    width = float(surface.distribution.peak_alpha(surface.parameter))
    return FurnaceModel(brdf, width, False, sample)


def _original_phong(exponent: float) -> FurnaceModel:
    return _mirror_model(phong.original(exponent), exponent)


def _modified_phong(exponent: float, normalizer: str = "usual") -> FurnaceModel:
    return _mirror_model(phong.modified(exponent, normalizer), exponent)


def _mirror_model(brdf: Brdf, exponent: float) -> FurnaceModel:
    """Return the model of a BRDF around the mirror image of the viewer."""

    def sample(view: Array, u1: Array, u2: Array) -> tuple[Array, Array]:
        axis = mirrored(view)
        light = cosine_lobe(axis, exponent, u1, u2)
        return light, cosine_lobe_density(axis, exponent, light)

    return FurnaceModel(brdf, 1 / np.sqrt(exponent + 1), True, sample)


for _definition in (
    _Definition("ggx", _microfacets("ggx"), "masking", "ggx"),
    _Definition("beckmann", _microfacets("beckmann"), "masking", "beckmann"),
    _Definition("phong", _original_phong),
    _Definition("modified-phong", _modified_phong, "normalizer"),
    _with_distribution("smoothie", "smoothie", reflection.smoothie),
    _with_distribution("smoothie-approx", "smoothie", reflection.smoothie_approx),
    _with_distribution("ashikhmin-shirley", "ashikhmin-shirley", reflection.ashikhmin_shirley),
):
    _register(_definition)
