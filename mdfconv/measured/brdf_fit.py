"""Fits of k_d/π + k_s D G F / (4 cos θ_i cos θ_o) to samples of two directions.

k_d and k_s are linear and solved for (`mdfconv.measured.projection`); D's parameters, and F₀ where
it is free, are searched. Many samples start from a fit of some.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from mdfconv.brdf.fresnel import dielectric, schlick_fresnel
from mdfconv.brdf.microfacet import polar_angle, v_cavity
from mdfconv.distributions import Distribution, distribution
from mdfconv.distributions.evaluation import Array
from mdfconv.distributions.parameter import percent_hint
from mdfconv.errors import MdfconvError
from mdfconv.measured.lobe_fit import half_width_logarithms
from mdfconv.measured.projection import (
    Projection,
    log_rmse,
    model,
    projected_slope,
    standard_deviations,
    upper_triangle,
)
from mdfconv.measured.samples import DirectionalSamples
from mdfconv.registry import unknown_name

LOSSES = ("linear", "log", "cosine")
MASKINGS = ("smith", "v-cavity", "none")
FRESNELS = ("none", "schlick", "ior:N", "fit")
# Half widths from narrower than a goniometer resolves to nearly uniform, and γ of a grid.
_NARROWEST, _WIDEST, _CANDIDATES, _GAMMAS = 1e-3, 10.0, 40, 5
# F₀ of a dielectric and of a dark metal, between which a search finds its way.
_STARTS = (0.04, 0.5)
_LEAST_F0, _MOST_F0 = 1e-4, 1 - 1e-4
# Of so many samples a scan is made, and of so many a fit, from which some steps lead to that of
# all.
_SCANNED, _SOME, _STEPS, _SMALLEST_STEP = 600, 3_000, 4, 1e-6
_SEED = 0
_DIFFERENCE = 1e-5
_INSIDE = 1e-9
_AT_END = 1e-3
# Huber 1964: linear beyond so many standard deviations, which costs 5 % of the efficiency.
_HUBER, _ROBUST_PASSES = 1.345, 8
# The standard deviation in medians of absolute deviations.
_MEDIANS = 1.4826
# Combinations of parameters that the data determine worse than this, relatively, are undetermined.
_UNDETERMINED = 1e-3
_BLOCK = 65536


@dataclass(frozen=True)
class BrdfModel:
    """What is fitted beside the distribution.

    Parameters
    ----------
    loss : str
        ``"linear"``: squared residuals. ``"log"``: those of the logarithms, of positive samples.
        ``"cosine"``: those of f_r cos θ_i cos θ_o (Löw et al. 2012).
    masking : str
        ``"smith"``: height-correlated (Heitz 2014) where the distribution has its Λ, else V-cavity
        (Torrance & Sparrow 1967). ``"v-cavity"``, ``"none"``.
    fresnel : str
        ``"none"``: F = 1. ``"schlick"``: Schlick 1994 with F₀ = 0.04. ``"ior:N"``: a dielectric
        of that index. ``"fit"``: Schlick with F₀ free.
    robust : bool
        Whether outliers count linearly (Huber 1964).
    """

    loss: str = "linear"
    masking: str = "smith"
    fresnel: str = "none"
    robust: bool = False

    def __post_init__(self) -> None:
        for name, known in (("loss", LOSSES), ("masking", MASKINGS)):
            if getattr(self, name) not in known:
                value = getattr(self, name)
                raise unknown_name(name, value, known)
        if self.fresnel not in FRESNELS[:2] + FRESNELS[3:]:
            _index(self.fresnel)


@dataclass(frozen=True)
class BrdfFit:
    """One distribution fitted to samples of two directions.

    Parameters
    ----------
    distribution : Distribution
        The distribution, with the fitted γ if it has one.
    parameters, errors : dict of str to float
        The fitted parameters by their names, ``"reflectance"`` for F₀, and their standard errors.
    diffuse, specular, diffuse_errors, specular_errors : tuple of float
        k_d and k_s of each channel, and their standard errors.
    rmse, log_rmse : float
        Root mean square of the residuals of f_r, 1/sr, and of those of the natural logarithms
        where both sample and model are positive.
    error : float
        Root mean square of the loss's residuals.
    aic, bic : float
        Information criteria of the loss's residuals.
    masking, fresnel : str
        The masking that was used, and the Fresnel factor, as in `BrdfModel`.
    notes : tuple of str
        What the data do not tell, and parameters at an end of their range.
    """

    distribution: Distribution
    parameters: dict[str, float]
    errors: dict[str, float]
    diffuse: tuple[float, ...]
    specular: tuple[float, ...]
    diffuse_errors: tuple[float, ...]
    specular_errors: tuple[float, ...]
    rmse: float
    log_rmse: float
    error: float
    aic: float
    bic: float
    masking: str
    fresnel: str
    notes: tuple[str, ...] = field(default=())

    def model(self, data: DirectionalSamples) -> Array:
        """Return f_r of the fit for the directions of samples, 1/sr, shape (n, channels)."""
        geometry = _Geometry(data, BrdfModel())
        parameter = np.array([self.parameters[self.distribution.parameter.name]])
        fresnel = geometry.fresnel(self.parameters.get("reflectance", self.fresnel))
        lobe = geometry.lobe(self.distribution, parameter, self.masking) * fresnel
        return model(lobe, np.array(self.diffuse) / np.pi, np.array(self.specular))


def fit_brdf(
    data: DirectionalSamples,
    target: Distribution,
    options: BrdfModel | None = None,
    *,
    gamma: float | None = None,
) -> BrdfFit:
    """Fit one distribution to samples of two directions, all channels with one lobe.

    Parameters
    ----------
    data : DirectionalSamples
        The measurements.
    target : Distribution
        What to fit; γ of a distribution of two parameters is free unless `gamma` is given.
    options : BrdfModel, optional
        Loss, masking and Fresnel factor.
    gamma : float, optional
        γ of a distribution that has one; the others do not ask for it.

    Returns
    -------
    BrdfFit
        The best fit, with standard errors.

    Raises
    ------
    MdfconvError
        If there are fewer samples than unknowns, nothing to fit, or γ is illegal.
    """
    options = options or BrdfModel()
    if target.second_parameter and gamma is not None:
        target = target.with_gamma(gamma)
    problem = _DirectionalProblem(_Geometry(data, options), target, options, free=gamma is None)
    random = np.random.default_rng(_SEED)
    some = problem.part(random, _SOME)
    starts = some.part(random, _SCANNED).starts()
    point = min((some.refine(start) for start in starts), key=some.cost)
    if some is not problem:
        point = problem.descend(point)
    for _ in range(_ROBUST_PASSES if options.robust else 0):
        problem = problem.reweighted(point)
        point = problem.descend(point)
    return problem.report(point)


def _index(text: str) -> float:
    """Return N of ``"ior:N"``."""
    head, _, number = text.partition(":")
    try:
        index = float(number) if head == "ior" else 0.0
    except ValueError:
        index = 0.0
    if not 0 < index < np.inf:
        near = percent_hint(number)
        if near:
            raise MdfconvError(f"an index of refraction is a number, not '{number}'", near)
        raise unknown_name("Fresnel factor", text, FRESNELS)
    return index


class _Geometry:
    """What of the samples does not depend on the distribution."""

    def __init__(self, data: DirectionalSamples, options: BrdfModel) -> None:
        values = data.values
        keep = (values > 0).all(axis=1) if options.loss == "log" else np.ones(len(values), bool)
        incident, outgoing = data.incident[keep], data.outgoing[keep]
        if not keep.any():
            raise MdfconvError("no sample is positive: a logarithmic loss has nothing to fit")
        half = replace(data, incident=incident, outgoing=outgoing).half
        self.beta = polar_angle(half)
        self.difference = np.clip(np.einsum("ij,ij->i", incident, half), 0, 1)
        self.cosines = np.stack([incident[:, 2], outgoing[:, 2]])
        self.tangents = np.stack(
            [np.hypot(w[:, 0], w[:, 1]) / w[:, 2] for w in (incident, outgoing)]
        )
        self.v_cavity = v_cavity(incident, outgoing, half)
        self.values = values[keep]

    def fresnel(self, kind: str | float) -> Array | float:
        """Return F of a kind of `BrdfModel`, 1 for one that is to be fitted, or for an F₀."""
        if kind in ("none", "fit"):
            return 1.0
        if kind == "schlick":
            return schlick_fresnel(self.difference)
        if isinstance(kind, str):
            return dielectric(self.difference, _index(kind))
        return schlick_fresnel(self.difference, kind)

    def lobe(self, mdf: Distribution, parameter: Array, masking: str) -> Array:
        """Return D G / (4 cos θ_i cos θ_o), shape (n,), for a parameter, shape (1,)."""
        with np.errstate(all="ignore"):
            value = mdf.shape(self.beta, parameter)
            value *= mdf.maximum(parameter, normalized=True)
            value /= 4 * np.prod(self.cosines, axis=0)
            value *= self._masking(mdf, parameter, masking)
        return value

    def _masking(self, mdf: Distribution, parameter: Array, masking: str) -> Array | float:
        form = _smith_form(mdf, parameter)
        if masking == "none":
            return 1.0
        if masking == "v-cavity" or form is None:
            return self.v_cavity
        smith, alpha = form
        incident, outgoing = (smith.smith_lambda(alpha * tangent) for tangent in self.tangents)
        return 1 / (1 + incident + outgoing)

    def part(self, index: NDArray[np.intp]) -> _Geometry:
        """Return some of the samples."""
        some = object.__new__(_Geometry)
        for name, array in vars(self).items():
            setattr(some, name, array[..., index] if name != "values" else array[index])
        return some


class _DirectionalProblem:
    """The projected problem: residuals and slopes in ln p, ln γ and F₀."""

    def __init__(
        self,
        geometry: _Geometry,
        target: Distribution,
        options: BrdfModel,
        *,
        free: bool,
        weight: Array | None = None,
    ) -> None:
        self._geometry, self._target, self._options = geometry, target, options
        second = target.second_parameter
        self._gamma_range = second.fit_range if second and free else None
        self._free_reflectance = options.fresnel == "fit"
        self._unit = float(np.max(np.abs(geometry.values)))
        self._check()
        product = np.prod(geometry.cosines, axis=0)
        self._weight = np.square(product) if options.loss == "cosine" else np.ones_like(product)
        if weight is not None:
            self._weight = self._weight * weight
        self._projection = Projection(
            geometry.values / self._unit,
            log=options.loss == "log",
            weight=self._weight[:, None],
            floor=True,
        )
        self._fresnel = geometry.fresnel(options.fresnel)
        self._used_masking = self._masking()
        low = [np.log(max(target.parameter.lower, 1e-8))]
        high = [np.log(min(target.parameter.upper, 1e12))]
        if self._gamma_range:
            low.append(np.log(self._gamma_range[0]))
            high.append(np.log(self._gamma_range[1]))
        if self._free_reflectance:
            low.append(_LEAST_F0)
            high.append(_MOST_F0)
        self._bounds = np.array([low, high])

    @property
    def _names(self) -> list[str]:
        names = [self._target.parameter.name]
        names += ["gamma"] * bool(self._gamma_range)
        return names + ["reflectance"] * self._free_reflectance

    @property
    def _size(self) -> int:
        return len(self._geometry.values)

    def _check(self) -> None:
        values = self._geometry.values
        unknowns = len(self._names) + 2 * values.shape[1]
        if values.size <= unknowns or len(values) < 4:
            raise MdfconvError(
                f"{values.size} values are too few to fit {unknowns} unknowns of "
                f"{self._target.name}"
            )
        if self._unit == 0 or np.ptp(values, axis=0).max() == 0:
            raise MdfconvError("all values are equal: there is no lobe to fit")
        if (values <= 0).all():
            raise MdfconvError("no value is positive: there is no lobe to fit")

    def part(self, random: np.random.Generator, count: int) -> _DirectionalProblem:
        """Return the problem of some of the samples, itself if there are not more."""
        if self._size <= count:
            return self
        index = np.sort(random.choice(self._size, count, replace=False))
        free = self._gamma_range is not None
        return _DirectionalProblem(
            self._geometry.part(index), self._target, self._options, free=free
        )

    def reweighted(self, point: Array) -> _DirectionalProblem:
        """Return the problem in which what is far off at a point counts less."""
        residual = np.abs(self.residual(point).reshape(self._size, -1)).max(axis=1)
        spread = _MEDIANS * float(np.median(residual)) or 1.0
        weight = np.minimum(1, _HUBER * spread / np.maximum(residual, 1e-300))
        free = self._gamma_range is not None
        return _DirectionalProblem(
            self._geometry, self._target, self._options, free=free, weight=weight
        )

    def starts(self) -> list[Array]:
        """Return the best point of a scan over p for each γ of a grid and each F₀."""
        tangents = np.geomspace(_NARROWEST, _WIDEST, _CANDIDATES)
        gammas = np.geomspace(*self._gamma_range, _GAMMAS) if self._gamma_range else [None]
        starts = []
        for gamma in gammas:
            target = self._target if gamma is None else self._target.with_gamma(float(gamma))
            first = half_width_logarithms(target, tangents)
            for reflectance in _STARTS if self._free_reflectance else (None,):
                rest = [] if gamma is None else [np.log(gamma)]
                rest += [] if reflectance is None else [reflectance]
                points = [np.array([value, *rest]) for value in first]
                starts.append(min(points, key=self.cost))
        return sorted(starts, key=self.cost)[:3]

    def descend(self, point: Array) -> Array:
        """Return the minimum near a point: a few Gauss-Newton steps, or a search if they rise."""
        start, before = point, np.inf
        for _ in range(_STEPS):
            lobe, slopes = self._lobe(point), self._slopes(point)
            residual, gain, _, scale = self._projection(lobe)
            cost = float(np.sum(np.square(residual)))
            if cost > before * (1 + _SMALLEST_STEP):
                return self.refine(start)
            slope = projected_slope(lobe, slopes, gain, scale)
            step = np.linalg.lstsq(slope.T @ slope, slope.T @ residual.ravel(), rcond=None)[0]
            point, before = np.clip(point - step, *self._bounds), cost
            if np.abs(step).max() < _SMALLEST_STEP:
                break
        return point

    def refine(self, start: Array) -> Array:
        """Return the minimum whose valley a point lies in."""
        found: Array = least_squares(
            self.residual,
            np.clip(start, self._bounds[0] + _INSIDE, self._bounds[1] - _INSIDE),
            self.slope,
            bounds=self._bounds,
            xtol=1e-10,
            ftol=1e-12,
            gtol=1e-12,
            x_scale="jac",
        ).x
        return found

    def cost(self, point: Array) -> float:
        """Return the sum of the squared residuals."""
        return float(np.sum(np.square(self.residual(point))))

    def residual(self, point: Array) -> Array:
        """Return the residuals that the best k_d and k_s leave, flattened."""
        return self._projection(self._lobe(point))[0].ravel()

    def slope(self, point: Array) -> Array:
        """Return ∂residual/∂point with the linear part projected out."""
        return self._projection.slope(self._lobe(point), self._slopes(point))

    def report(self, point: Array) -> BrdfFit:
        """Return the fit at a point."""
        lobe, slopes = self._lobe(point), self._slopes(point)
        residual, gain, offset, scale = self._projection(lobe)
        if not scale.any():
            raise MdfconvError(
                "the values do not rise towards the mirror direction: there is no lobe to fit",
                "check which columns and which unit the angles are, and look at the largest angles",
            )
        names = [*self._names, *("diffuse", "specular") * scale.size]
        triangle = upper_triangle(_jacobian(lobe, slopes, gain, scale))
        count, unknowns = residual.size, len(names)
        cost = float(np.sum(np.square(residual)))
        spread = np.sqrt(cost / (count - unknowns)) * standard_deviations(triangle)
        near, wanted = model(lobe, offset, scale), self._geometry.values / self._unit
        likelihood = count * np.log(max(cost, np.finfo(float).tiny) / count)
        scaled = 1.0 if self._options.loss == "log" else self._unit
        likelihood += 2 * count * np.log(scaled)
        mdf, values = self._at(point), self._values(point)
        free = len(self._names)
        errors = spread[:free] * np.where(
            [name != "reflectance" for name in self._names], values, 1
        )
        linear = spread[free:].reshape(-1, 2) * self._unit
        return BrdfFit(
            distribution=mdf,
            parameters=dict(zip(self._names, values.tolist(), strict=True)),
            errors=dict(zip(self._names, errors.tolist(), strict=True)),
            diffuse=tuple((np.pi * self._unit * offset).tolist()),
            specular=tuple((self._unit * scale).tolist()),
            diffuse_errors=tuple((np.pi * linear[:, 0]).tolist()),
            specular_errors=tuple(linear[:, 1].tolist()),
            rmse=self._unit * float(np.sqrt(np.mean(np.square(near - wanted)))),
            log_rmse=log_rmse(near, wanted),
            error=scaled * float(np.sqrt(cost / np.sum(self._weight) / scale.size)),
            aic=float(likelihood + 2 * unknowns),
            bic=float(likelihood + unknowns * np.log(count)),
            masking=self._used_masking,
            fresnel=self._options.fresnel,
            notes=(*self._at_ends(point), *_undetermined(triangle, names)),
        )

    def _values(self, point: Array) -> Array:
        """Return the parameters themselves."""
        logarithms = len(point) - self._free_reflectance
        return np.concatenate([np.exp(point[:logarithms]), point[logarithms:]])

    def _at_ends(self, point: Array) -> Iterator[str]:
        for name, value, low, high in zip(self._names, point, *self._bounds, strict=True):
            if min(value - low, high - value) < _AT_END:
                yield f"{name} is at the end of its range"

    def _at(self, point: Array) -> Distribution:
        """Return the distribution with the γ of a point."""
        second = self._target.second_parameter
        if self._gamma_range is None or second is None:
            return self._target
        return self._target.with_gamma(float(np.clip(np.exp(point[1]), *self._gamma_range)))

    def _lobe(self, point: Array) -> Array:
        """Return D G F / (4 cos θ_i cos θ_o), shape (n,)."""
        reflectance = float(point[-1]) if self._free_reflectance else None
        fresnel = self._fresnel if reflectance is None else self._geometry.fresnel(reflectance)
        mdf, parameter = self._at(point), np.exp(point[:1])
        return self._geometry.lobe(mdf, parameter, self._used_masking) * fresnel

    def _slopes(self, point: Array) -> list[Array]:
        """Return the slopes of the lobe in each parameter, by differences within the bounds."""
        slopes = []
        for index in range(len(point)):
            ends = np.stack([point, point])
            ends[:, index] += (-_DIFFERENCE, _DIFFERENCE)
            ends = np.clip(ends, *self._bounds)
            rise = self._lobe(ends[1]) - self._lobe(ends[0])
            slopes.append(rise / (ends[1, index] - ends[0, index]))
        return slopes

    def _masking(self) -> str:
        """Return the masking that is used: with a free γ no Λ is known."""
        known = not self._gamma_range and _smith_form(self._target, np.ones(1)) is not None
        return (
            "v-cavity" if self._options.masking == "smith" and not known else self._options.masking
        )


def _smith_form(mdf: Distribution, parameter: Array) -> tuple[Distribution, Array] | None:
    """Return the distribution of the same lobe whose Λ is known, and its α; None for none."""
    while not mdf.smith:
        equal = mdf.equivalent
        if equal is None or not equal.same_lobe:
            return None
        mdf, parameter = distribution(equal.name), equal.forward(parameter)
    return mdf, parameter


def _jacobian(lobe: Array, slopes: list[Array], gain: Array, scale: Array) -> Iterator[Array]:
    """Yield blocks of rows of ∂residual/∂(parameters, k_d and k_s of each channel)."""
    channels = gain.shape[1]
    for channel in range(channels):
        for start in range(0, lobe.size, _BLOCK):
            rows = slice(start, start + _BLOCK)
            part = gain[rows, channel]
            block = np.zeros((part.size, len(slopes) + 2 * channels))
            for column, slope in enumerate(slopes):
                block[:, column] = part * slope[rows] * scale[channel]
            block[:, len(slopes) + 2 * channel] = part
            block[:, len(slopes) + 2 * channel + 1] = part * lobe[rows]
            yield block


def _undetermined(triangle: Array, names: list[str]) -> tuple[str, ...]:
    """Return what is to be said of a combination of parameters that the data do not tell."""
    norms = np.linalg.norm(triangle, axis=0)
    if not (norms > 0).all():
        return ()
    _, singular, basis = np.linalg.svd(triangle / norms)
    if singular[-1] > _UNDETERMINED * singular[0]:
        return ()
    strongest = np.argsort(-np.abs(basis[-1]))[:2]
    both = " and ".join(dict.fromkeys(names[index] for index in sorted(strongest)))
    return (f"the data do not tell {both} apart",)
