"""The BRDFs of the white-furnace test by name, with their samplers.

A new one is a function here and one entry in `_MODELS`.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from mdfconv.brdf import phong, smoothie
from mdfconv.brdf.directions import dot, mirrored, reflect
from mdfconv.brdf.furnace import FurnaceModel, Reflection, Sampler
from mdfconv.brdf.masking import masking as find_masking
from mdfconv.brdf.microfacet import ashikhmin_shirley, reflection
from mdfconv.brdf.sampling import (
    cosine_lobe,
    cosine_lobe_density,
    half_vector_density,
    half_vectors,
    reflected_density,
    visible_normal_density,
    visible_normals,
)
from mdfconv.distributions import distribution
from mdfconv.distributions.evaluation import Array
from mdfconv.distributions.smoothie import to_ggx
from mdfconv.errors import MdfconvError, unknown_name


def furnace_model(
    name: str, parameter: float, *, normalizer: str | None = None, masking: str | None = None
) -> FurnaceModel:
    """Return a BRDF for the white-furnace test, its Fresnel term 1.

    Parameters
    ----------
    name : str
        One of `list_models`.
    parameter : float
        Exponent of the Phong BRDFs, α of the others.
    normalizer : str, optional
        Of modified Phong: one of `mdfconv.brdf.phong.NORMALIZERS`; "usual" if not given.
    masking : str, optional
        Of ggx and beckmann: one of `mdfconv.brdf.masking.MASKINGS`; "correlated" if not given.

    Raises
    ------
    MdfconvError
        If a name is not known, does not apply, or the parameter is illegal.
    """
    key = name.strip().lower()
    if key not in _MODELS:
        raise unknown_name("BRDF", name, list(_MODELS))
    if normalizer is not None and key != "modified-phong":
        raise MdfconvError(f"{key} has no normalizer: modified-phong has")
    if masking is not None and key not in ("ggx", "beckmann"):
        raise MdfconvError(f"the masking of {key} is part of it: ggx and beckmann have a choice")
    return _MODELS[key](float(parameter), normalizer or "usual", masking or "correlated")


def list_models() -> list[str]:
    """Return the names of the BRDFs."""
    return list(_MODELS)


def _microfacets(name: str) -> Callable[[float, str, str], FurnaceModel]:
    def model(alpha: float, normalizer: str, masking: str) -> FurnaceModel:
        entry = distribution(name)
        alpha = entry.parameter.check_one(alpha, name)
        shadow = find_masking(masking, name, alpha)

        def reflect_light(light: Array, view: Array) -> Array:
            return reflection(light, view, entry, alpha, shadow)

        return FurnaceModel(reflect_light, alpha, False, _microfacet_sampler(name, alpha))

    return model


def _microfacet_sampler(name: str, alpha: float) -> Sampler:
    """Return a sampler of reflected directions: by visible normals for GGX, else by D cos θ."""

    def sample(view: Array, u1: Array, u2: Array) -> tuple[Array, Array]:
        if name == "ggx":
            m = visible_normals(view, alpha, u1, u2)
            density = visible_normal_density(view, alpha, m)
        else:
            m = half_vectors(name, alpha, u1, u2)
            density = half_vector_density(name, alpha, m)
        density = np.where(dot(view, m) > 0, density, 0)
        return reflect(view, m), reflected_density(density, view, m)

    return sample


def _phong(reflect_light: Reflection, exponent: float) -> FurnaceModel:
    def sample(view: Array, u1: Array, u2: Array) -> tuple[Array, Array]:
        axis = mirrored(view)
        light = cosine_lobe(axis, exponent, u1, u2)
        return light, cosine_lobe_density(axis, exponent, light)

    return FurnaceModel(reflect_light, 1 / np.sqrt(exponent + 1), True, sample)


def _original_phong(exponent: float, normalizer: str, masking: str) -> FurnaceModel:
    phong.check_exponent(exponent)
    return _phong(lambda light, view: phong.original(light, view, exponent), exponent)


def _modified_phong(exponent: float, normalizer: str, masking: str) -> FurnaceModel:
    phong.normalization(normalizer, np.ones(1), exponent)

    def reflect_light(light: Array, view: Array) -> Array:
        return phong.modified(light, view, exponent, normalizer)

    return _phong(reflect_light, exponent)


def _smoothie(
    function: Callable[[Array, Array, float], Array],
) -> Callable[[float, str, str], FurnaceModel]:
    def model(alpha: float, normalizer: str, masking: str) -> FurnaceModel:
        alpha = distribution("smoothie").parameter.check_one(alpha, "smoothie")
        width = float(to_ggx(np.asarray(alpha)))
        sample = _microfacet_sampler("ggx", width)
        return FurnaceModel(lambda light, view: function(light, view, alpha), width, False, sample)

    return model


def _ashikhmin_shirley(exponent: float, normalizer: str, masking: str) -> FurnaceModel:
    entry = distribution("ashikhmin-shirley")
    exponent = entry.parameter.check_one(exponent, entry.name)
    width = float(np.sqrt(2 / (exponent + 2)))

    def reflect_light(light: Array, view: Array) -> Array:
        return ashikhmin_shirley(light, view, entry, exponent)

    return FurnaceModel(reflect_light, width, False, _microfacet_sampler("ggx", width))


_MODELS: dict[str, Callable[[float, str, str], FurnaceModel]] = {
    "ggx": _microfacets("ggx"),
    "beckmann": _microfacets("beckmann"),
    "phong": _original_phong,
    "modified-phong": _modified_phong,
    "smoothie": _smoothie(smoothie.exact),
    "smoothie-approx": _smoothie(smoothie.approximate),
    "ashikhmin-shirley": _ashikhmin_shirley,
}
