"""Fits of an offset and a multiple of a lobe to measured reflectance, or to measured normals.

Of two directions the model is k_d/π + k_s D G F / (4 cos θ_i cos θ_o). A slice at θ_d = 0 is the
case offset + scale · D̄(β)/cos²β of it, in which masking is left out, and a distribution of normals
the case offset + scale · D̄(β). Offset and scale are linear and solved for
(`mdfconv.measured.projection`); D's parameters, and F₀ where it is free, are searched. Many samples
start from a fit of some.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property, partial
from itertools import compress
from typing import Any, ClassVar, Self, TypeAlias

import numpy as np
from scipy.optimize import least_squares

from mdfconv.brdf.fresnel import dielectric, schlick_fresnel
from mdfconv.brdf.microfacet import dot, polar_angle, v_cavity
from mdfconv.distributions import Distribution
from mdfconv.distributions.endpoint import follow, to_root
from mdfconv.distributions.evaluation import Array, Indices
from mdfconv.distributions.parameter import percent_hint
from mdfconv.errors import MdfconvError
from mdfconv.measured import projection
from mdfconv.measured.samples import DirectionalSamples, Measurements, Samples
from mdfconv.registry import unknown_name

SLICE_LOSSES = ("linear", "log")
LOSSES = (*SLICE_LOSSES, "cosine")
MASKINGS = ("smith", "v-cavity", "none")
FRESNELS = ("none", "schlick", "ior:N", "fit")
# F of cos θ_d; None for Schlick's with F₀ free.
Fresnel: TypeAlias = Callable[[Array], Array | float] | None

# F₀ of a dielectric and of a dark metal, between which a search finds its way.
_STARTING_F0 = (0.04, 0.5)
_F0_RANGE = (1e-4, 1 - 1e-4)
# Of a directional fit's differences, in a logarithm or in F₀.
_DIFFERENCE = 1e-5
# Of a central difference: truncation falls with h², rounding rises with ε/h.
_CENTRAL_DIFFERENCE = float(np.finfo(float).eps) ** (1 / 3)
# Inside the bounds by this: the solver starts between them.
_INSIDE = 1e-9
# Nearer than this to an end of its range a parameter is at the end.
_AT_END = 1e-3
# Values that a scan holds at a time: 16 MB.
_SCANNED_AT_ONCE = 2_000_000
# From the fit of some samples so many steps lead to that of all.
_STEPS = 4
_SMALLEST_STEP = 1e-6
# Of the choice of samples: the same fit each time.
_SEED = 0
# Huber 1964: linear beyond so many standard deviations, which costs 5 % of the efficiency.
_HUBER = 1.345
_ROBUST_PASSES = 8
# The standard deviation in medians of absolute deviations.
_MEDIANS = 1.4826
# Combinations of parameters that the data determine worse than this, relatively, are undetermined.
_UNDETERMINED = 1e-3


@dataclass(frozen=True)
class BrdfModel:
    """What is fitted beside the distribution; of one angle only the loss applies.

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
        if self.loss not in LOSSES:
            raise unknown_name("loss", self.loss, LOSSES)
        if self.masking not in MASKINGS:
            raise unknown_name("masking", self.masking, MASKINGS)
        fresnel_named(self.fresnel)


def fresnel_named(name: str) -> Fresnel:
    """Return the factor of a name of `FRESNELS`; raise `MdfconvError` if there is none."""
    if name == "none":
        return lambda cosine: 1.0
    if name == "schlick":
        return schlick_fresnel
    if name == "fit":
        return None
    head, _, number = name.partition(":")
    try:
        index = float(number) if head == "ior" else 0.0
    except ValueError:
        index = 0.0
    if not 0 < index < np.inf:
        near = percent_hint(number)
        if near:
            raise MdfconvError(f"an index of refraction is a number, not '{number}'", near)
        raise unknown_name("Fresnel factor", name, FRESNELS)
    return partial(dielectric, ior=index)


@dataclass(frozen=True)
class MeasuredFit:
    """One distribution fitted to measurements.

    Parameters
    ----------
    distribution : Distribution
        The distribution, with the fitted γ if it has one.
    parameters, errors : dict of str to float
        What was searched, by its names, ``"reflectance"`` for F₀, and the standard errors.
    linear, linear_errors : dict of str to tuple of float
        What was solved for, of each channel: ``"diffuse"`` (k_d) and ``"specular"`` (k_s), or of
        one angle ``"offset"`` and ``"scale"``, and the standard errors.
    rmse, log_rmse : float
        Root mean square of the residuals, and of those of the natural logarithms where both
        sample and model are positive.
    error : float
        Root mean square of the loss's residuals, by which fits are ranked.
    aic, bic : float
        Information criteria of the loss's residuals.
    masking : str or None
        The masking that was used; None of one angle, where it is left out.
    fresnel : str
        The Fresnel factor, as in `BrdfModel`.
    at_limit : tuple of str
        Parameters at an end of their range.
    undetermined : tuple of str
        Parameters that the data do not tell apart.
    """

    distribution: Distribution
    parameters: dict[str, float]
    errors: dict[str, float]
    linear: dict[str, tuple[float, ...]]
    linear_errors: dict[str, tuple[float, ...]]
    rmse: float
    log_rmse: float
    error: float
    aic: float
    bic: float
    masking: str | None
    fresnel: str
    at_limit: tuple[str, ...] = ()
    undetermined: tuple[str, ...] = ()

    @property
    def parameter(self) -> float:
        """The distribution's own parameter."""
        return self.parameters[self.distribution.parameter.name]

    @property
    def notes(self) -> tuple[str, ...]:
        """What the data do not tell, and parameters at an end of their range."""
        name = self.distribution.name
        if self.masking is None:
            text = f"γ of {name} is at the end of the range that is searched"
            return (text,) * len(self.at_limit)
        notes = [f"{limited} is at the end of its range" for limited in self.at_limit]
        if self.undetermined:
            notes.append(f"the data do not tell {' and '.join(self.undetermined)} apart")
        return tuple(notes)

    def model(self, samples: Measurements) -> Array:
        """Return the model at the angles or directions of samples, shape (n, channels)."""
        options = BrdfModel(masking=self.masking or "none", fresnel=self.fresnel)
        lobe = _lobe_at(samples, self.distribution, options, free_gamma=False)
        parameter = np.array([[self.parameter]])
        value = lobe.value(self.distribution, parameter, self.parameters.get("reflectance"))
        linear = (np.array(self.linear[name]) / unit for name, unit in lobe.linear.items())
        return projection.model(value[0], *linear)

    def record(self) -> dict[str, Any]:
        """Return the fit as a row of a table."""
        first = self.distribution.parameter.name
        record: dict[str, Any] = {
            "distribution": self.distribution.name,
            "parameter": self.parameter,
            "gamma": self.distribution.gamma,
            "stderr": self.errors[first],
            "gamma_stderr": self.errors.get("gamma"),
        }
        linear = {name: list(values) for name, values in self.linear.items()}
        errors = {"rmse": self.rmse, "log_rmse": self.log_rmse}
        criteria = {"aic": self.aic, "bic": self.bic}
        if self.masking is None:
            return record | linear | errors | criteria
        record |= {
            "reflectance": self.parameters.get("reflectance"),
            "reflectance_stderr": self.errors.get("reflectance"),
        }
        linear |= {f"{name}_stderr": list(values) for name, values in self.linear_errors.items()}
        errors |= {"error": self.error}
        remarks = {"masking": self.masking, "notes": list(self.notes)}
        return record | linear | errors | criteria | remarks


def fit_distribution(
    samples: Measurements,
    target: Distribution,
    model: BrdfModel | None = None,
    *,
    gamma: float | None = None,
) -> MeasuredFit:
    """Fit one distribution to samples, all channels with one lobe.

    γ of a distribution that has one is free unless it is given; the others do not ask for it.
    Raises `MdfconvError` if there are fewer samples than unknowns, nothing to fit, or γ is illegal.
    """
    model = model or BrdfModel()
    if isinstance(samples, Samples) and model.loss not in SLICE_LOSSES:
        raise MdfconvError(
            f"the {model.loss} loss needs two directions", f"known: {', '.join(SLICE_LOSSES)}"
        )
    if target.second_parameter and gamma is not None:
        target = target.with_gamma(gamma)
    if model.loss == "log":
        samples = samples.select((samples.values > 0).all(axis=1))
        if not len(samples.values):
            raise MdfconvError("no sample is positive: a logarithmic loss has nothing to fit")
    problem = _Problem(_lobe_at(samples, target, model, free_gamma=gamma is None))
    search = problem.lobe.search
    random = np.random.default_rng(_SEED)
    some = problem.part(random, search.first_fitted)
    starts = some.part(random, search.scanned).starts()
    point = min((some.refine(start) for start in starts), key=some.cost)
    if some is not problem:
        point = problem.descend(point)
    for _ in range(_ROBUST_PASSES if model.robust else 0):
        problem = problem.reweighted(point)
        point = problem.descend(point)
    return problem.report(point)


@dataclass(frozen=True)
class _Search:
    """Where minima are looked for.

    A scan takes half widths, by their tangents, for each γ of a grid, of so many of the samples;
    the best of its starts, if not all of them, are refined on more.
    """

    narrowest: float
    widest: float
    half_widths: int
    gammas: int
    tolerance: float
    starts: int | None = None
    scanned: int | None = None
    first_fitted: int | None = None


class _Lobe(ABC):
    """The lobe of a distribution at samples; a point is ln p, ln γ if it is free, F₀ likewise."""

    search: ClassVar[_Search]
    # Offset and scale by the names under which they are reported, in units of the model's.
    linear: ClassVar[dict[str, float]]
    # Whether the offset is a reflectance, which is not negative.
    has_floor: ClassVar[bool]
    # What is said of values that no lobe fits.
    refusal: ClassVar[tuple[str, ...]]
    masking: str | None = None
    has_free_reflectance = False

    def __init__(
        self,
        samples: Any,
        target: Distribution,
        options: BrdfModel,
        gamma_range: tuple[float, float] | None,
    ) -> None:
        self.samples, self.target, self.options = samples, target, options
        self.gamma_range = gamma_range
        # Of the squared residuals.
        self.weight = np.ones(len(samples.values))
        # How many places there are samples at, and how a message says it.
        self.places, self.where = len(samples.values), ""

    def part(self, index: Indices) -> Self:
        """Return the lobe at some of the samples."""
        some = self.samples.select(index)
        return type(self)(some, self.target, self.options, self.gamma_range)

    @property
    def names(self) -> list[str]:
        """What is searched."""
        names = [self.target.parameter.name]
        names += ["gamma"] * (self.gamma_range is not None)
        return names + ["reflectance"] * self.has_free_reflectance

    @cached_property
    def scan(self) -> list[Array]:
        """Points of all half widths for each γ and F₀ of a grid, shape (candidates, unknowns)."""
        search = self.search
        tangents = np.geomspace(search.narrowest, search.widest, search.half_widths)
        gammas = np.geomspace(*self.gamma_range, search.gammas) if self.gamma_range else [None]
        scan = []
        for gamma in gammas:
            target = self.target if gamma is None else self.target.with_gamma(float(gamma))
            first = _half_width_logarithms(target, tangents)
            rest = [] if gamma is None else [np.full_like(first, np.log(gamma))]
            for reflectance in _STARTING_F0 if self.has_free_reflectance else (None,):
                last = [] if reflectance is None else [np.full_like(first, reflectance)]
                scan.append(np.stack([first, *rest, *last], axis=1))
        return scan

    @cached_property
    def bounds(self) -> Array:
        """The least and the largest point, shape (2, unknowns)."""
        ends = [self._parameter_ends()]
        if self.gamma_range:
            ends.append(tuple(np.log(self.gamma_range)))
        if self.has_free_reflectance:
            ends.append(_F0_RANGE)
        return np.array(ends).T

    def distribution(self, point: Array) -> Distribution:
        """Return the distribution with the γ of a point."""
        second = self.target.second_parameter
        if self.gamma_range is None or second is None:
            return self.target
        # exp(ln γ) rounds, and an end of the range may be the end of the legal values.
        return self.target.with_gamma(float(np.clip(np.exp(point[1]), second.lower, second.upper)))

    def at_points(self, points: Array) -> Array:
        """Return the lobes of points of one γ and one F₀, shape (points, n)."""
        reflectance = float(points[0, -1]) if self.has_free_reflectance else None
        return self.value(self.distribution(points[0]), np.exp(points[:, :1]), reflectance)

    def at(self, point: Array) -> Array:
        """Return the lobe of a point, shape (n,)."""
        return np.asarray(self.at_points(point[None, :])[0])

    @abstractmethod
    def value(self, mdf: Distribution, parameter: Array, reflectance: float | None) -> Array:
        """Return the lobes of parameters, shape (parameters, 1), at the samples."""

    @abstractmethod
    def slopes(self, point: Array) -> list[Array]:
        """Return the slopes of the lobe in each parameter."""

    @abstractmethod
    def _parameter_ends(self) -> tuple[float, float]:
        """Return the range of ln p that is searched."""


class _SliceLobe(_Lobe):
    """D̄, or D̄/cos²β of a BRDF at θ_d = 0: of few samples, so that all of them are scanned."""

    # Half widths from narrower than any measurement resolves to nearly uniform. Neighbours of 120
    # differ by 13 %, which no valley of the cost falls between. Lobes of different γ are valleys
    # of their own, and the lowest candidate need not lie in the deepest: each is refined.
    search = _Search(narrowest=1e-5, widest=30.0, half_widths=120, gammas=9, tolerance=1e-12)
    linear: ClassVar = {"offset": 1.0, "scale": 1.0}
    has_floor = False
    refusal = ("the values do not fall with the angle: there is no lobe to fit",)

    def __init__(self, samples: Samples, *rest: Any) -> None:
        super().__init__(samples, *rest)
        self._foreshortening = foreshortening(samples.beta, samples.quantity)
        self.places = np.unique(samples.beta).size
        self.where = f" at {self.places} angles"

    def value(self, mdf: Distribution, parameter: Array, reflectance: float | None) -> Array:
        beta = np.broadcast_to(self.samples.beta, (len(parameter), self.samples.beta.size))
        with np.errstate(all="ignore"):
            return mdf.shape(beta, parameter) / self._foreshortening

    def slopes(self, point: Array) -> list[Array]:
        with np.errstate(all="ignore"):
            _, slope = self.distribution(point).with_slope(
                self.samples.beta[None, :], np.exp(point[:1])[:, None], normalized=False
            )
        slopes = [slope[0] / self._foreshortening]
        if self.gamma_range:
            step = np.array([0, _CENTRAL_DIFFERENCE])
            low, high = point - step, point + step
            # At an end of the legal values one-sided.
            ratio = self.distribution(high).gamma / self.distribution(low).gamma
            slopes.append((self.at(high) - self.at(low)) / np.log(ratio))
        return slopes

    def _parameter_ends(self) -> tuple[float, float]:
        logarithms = np.concatenate([points[:, 0] for points in self.scan])
        # Beyond the candidates a lobe is narrower than the angles resolve, or nearly uniform.
        upper = min(np.log(self.target.parameter.upper), logarithms.max() + 5)
        return logarithms.min() - 1, upper


class _DirectionalLobe(_Lobe):
    """D G F / (4 cos θ_i cos θ_o)."""

    # Half widths from narrower than a goniometer resolves to nearly uniform.
    search = _Search(
        narrowest=1e-3,
        widest=10.0,
        half_widths=40,
        gammas=5,
        tolerance=1e-10,
        starts=3,
        scanned=600,
        first_fitted=3_000,
    )
    linear: ClassVar = {"diffuse": np.pi, "specular": 1.0}
    has_floor = True
    refusal = (
        "the values do not rise towards the mirror direction: there is no lobe to fit",
        "check which columns and which unit the angles are, and look at the largest angles",
    )

    def __init__(self, samples: DirectionalSamples, *rest: Any) -> None:
        super().__init__(samples, *rest)
        incident, outgoing, half = samples.incident, samples.outgoing, samples.half
        self._beta = polar_angle(half)
        self._difference_cosine = np.clip(dot(incident, half), 0, 1)
        self._tangents = [np.hypot(w[:, 0], w[:, 1]) / w[:, 2] for w in (incident, outgoing)]
        self._v_cavity = v_cavity(incident, outgoing, half)
        cosines = incident[:, 2] * outgoing[:, 2]
        self._denominator = 4 * cosines
        if self.options.loss == "cosine":
            self.weight = np.square(cosines)
        fresnel = fresnel_named(self.options.fresnel)
        self.has_free_reflectance = fresnel is None
        self._fresnel = fresnel(self._difference_cosine) if fresnel else 1.0
        self.masking = self.options.masking
        # With a free γ no Λ is known.
        if self.masking == "smith" and (
            self.gamma_range or _smith_form(self.target, np.ones(1)) is None
        ):
            self.masking = "v-cavity"

    def value(self, mdf: Distribution, parameter: Array, reflectance: float | None) -> Array:
        beta = np.broadcast_to(self._beta, (len(parameter), self._beta.size))
        with np.errstate(all="ignore"):
            value = mdf.shape(beta, parameter)
            value *= mdf.maximum(parameter, normalized=True)
            value /= self._denominator
            value *= self._masked(mdf, parameter)
        if reflectance is None:
            return value * self._fresnel
        return value * schlick_fresnel(self._difference_cosine, reflectance)

    def _masked(self, mdf: Distribution, parameter: Array) -> Array | float:
        form = _smith_form(mdf, parameter) if self.masking == "smith" else None
        if form is None:
            return 1.0 if self.masking == "none" else self._v_cavity
        smith, alpha = form
        incident, outgoing = (smith.smith_lambda(tangent, alpha) for tangent in self._tangents)
        return 1 / (1 + incident + outgoing)

    def slopes(self, point: Array) -> list[Array]:
        slopes = []
        for index in range(len(point)):
            ends = np.stack([point, point])
            ends[:, index] += (-_DIFFERENCE, _DIFFERENCE)
            ends = np.clip(ends, *self.bounds)
            rise = self.at(ends[1]) - self.at(ends[0])
            slopes.append(rise / (ends[1, index] - ends[0, index]))
        return slopes

    def _parameter_ends(self) -> tuple[float, float]:
        parameter = self.target.parameter
        return np.log(max(parameter.lower, 1e-8)), np.log(min(parameter.upper, 1e12))


def _lobe_at(
    samples: Measurements, target: Distribution, options: BrdfModel, *, free_gamma: bool
) -> _Lobe:
    """Return the lobe of a distribution at samples."""
    second = target.second_parameter
    gamma_range = second.fit_range if second and free_gamma else None
    if isinstance(samples, DirectionalSamples):
        return _DirectionalLobe(samples, target, options, gamma_range)
    return _SliceLobe(samples, target, options, gamma_range)


def foreshortening(beta: Array, quantity: str) -> Array:
    """Return cos²β for a BRDF at θ_d = 0, where it is D̄/cos²β but for masking; else 1."""
    return np.square(np.cos(beta)) if quantity == "brdf" else np.ones_like(beta)


def _smith_form(mdf: Distribution, parameter: Array) -> tuple[Distribution, Array] | None:
    """Return the distribution of the same lobe whose Λ is known, and its α; None for none."""
    root, steps, _ = to_root(mdf, same_lobe=True)
    return (root, follow(steps, parameter)) if root.smith else None


def _half_width_logarithms(target: Distribution, tangents: Array) -> Array:
    """Return the logarithms of the parameters for half widths, ascending, of those that exist."""
    parameters = target.from_half_tangent(tangents)
    existing = np.sort(parameters[np.isfinite(parameters)])
    if not existing.size:
        raise MdfconvError(
            f"{target.name} of γ = {target.gamma:g} has no lobe whose half width can be measured"
        )
    return np.asarray(np.log(existing))


class _Problem:
    """The projected problem: residuals of the best offset and scale, by the point of a lobe."""

    def __init__(self, lobe: _Lobe, reweighting: Array | float = 1.0) -> None:
        self.lobe = lobe
        self._values: Array = lobe.samples.values
        self._check()
        # In units of the largest value, whatever the measurement's.
        self._unit = float(np.max(np.abs(self._values)))
        self._weight = lobe.weight * reweighting
        self._is_log = lobe.options.loss == "log"
        values = self._values / self._unit
        weight = self._weight[:, None] * np.ones_like(values)
        self._project = projection.Projection(
            values, weight, log=self._is_log, floor=lobe.has_floor
        )

    def _check(self) -> None:
        values = self._values
        unknowns = len(self.lobe.names) + 2 * values.shape[1]
        if values.size <= unknowns or self.lobe.places < 4:
            raise MdfconvError(
                f"{values.size} values{self.lobe.where} are too few to fit {unknowns} unknowns of "
                f"{self.lobe.target.name}"
            )
        if np.ptp(values, axis=0).max() == 0:
            raise MdfconvError("all values are equal: there is no lobe to fit")
        if self.lobe.has_floor and (values <= 0).all():
            raise MdfconvError("no value is positive: there is no lobe to fit")

    def part(self, random: np.random.Generator, count: int | None) -> _Problem:
        """Return the problem of some of the samples, itself if there are not more."""
        if count is None or len(self._values) <= count:
            return self
        index = np.sort(random.choice(len(self._values), count, replace=False))
        return _Problem(self.lobe.part(index))

    def reweighted(self, point: Array) -> _Problem:
        """Return the problem in which what is far off at a point counts less."""
        residual = np.abs(self.residual(point).reshape(len(self._values), -1)).max(axis=1)
        spread = _MEDIANS * float(np.median(residual)) or 1.0
        weight = np.minimum(1, _HUBER * spread / np.maximum(residual, 1e-300))
        return _Problem(self.lobe, weight)

    def starts(self) -> list[Array]:
        """Return the best point of each scan; of many the best ones."""
        best = [points[int(np.argmin(self._costs(points)))] for points in self.lobe.scan]
        count = self.lobe.search.starts
        return best if count is None else sorted(best, key=self.cost)[:count]

    def _costs(self, points: Array) -> Array:
        """Return the costs of the points of a scan."""
        size = max(1, _SCANNED_AT_ONCE // self._values.size)
        blocks = [points[start : start + size] for start in range(0, len(points), size)]
        residuals = (self._project(self.lobe.at_points(block)).residual for block in blocks)
        return np.concatenate([np.sum(np.square(some), axis=(1, 2)) for some in residuals])

    def descend(self, point: Array) -> Array:
        """Return the minimum near a point: a few Gauss-Newton steps, or a search if they rise."""
        start, before = point, np.inf
        for _ in range(_STEPS):
            lobe, slopes = self.lobe.at(point), self.lobe.slopes(point)
            residual, gain, _, scale = self._project(lobe)
            cost = float(np.sum(np.square(residual)))
            if cost > before * (1 + _SMALLEST_STEP):
                return self.refine(start)
            slope = projection.projected_slope(lobe, slopes, gain, scale)
            step = np.linalg.lstsq(slope.T @ slope, slope.T @ residual.ravel(), rcond=None)[0]
            point, before = np.clip(point - step, *self.lobe.bounds), cost
            if np.abs(step).max() < _SMALLEST_STEP:
                break
        return point

    def refine(self, start: Array) -> Array:
        """Return the minimum whose valley a point lies in."""
        low, high = self.lobe.bounds
        tolerance = self.lobe.search.tolerance
        start = np.clip(start, low + _INSIDE, high - _INSIDE)
        ends = {"xtol": tolerance, "ftol": tolerance / 100, "gtol": tolerance / 100}
        result = least_squares(
            self.residual, start, self.slope, bounds=(low, high), x_scale="jac", **ends
        )
        return np.asarray(result.x)

    def cost(self, point: Array) -> float:
        """Return the sum of the squared residuals."""
        return float(np.sum(np.square(self.residual(point))))

    def residual(self, point: Array) -> Array:
        """Return the residuals, flattened."""
        return self._project(self.lobe.at(point)).residual.ravel()

    def slope(self, point: Array) -> Array:
        """Return ∂residual/∂point with the linear part projected out."""
        lobe = self.lobe.at(point)
        _, gain, _, scale = self._project(lobe)
        return projection.projected_slope(lobe, self.lobe.slopes(point), gain, scale)

    def report(self, point: Array) -> MeasuredFit:
        """Return the fit at a point, with standard errors from the full Jacobian."""
        lobe, slopes = self.lobe.at(point), self.lobe.slopes(point)
        residual, gain, offset, scale = self._project(lobe)
        if not scale.any():
            raise MdfconvError(*self.lobe.refusal)
        searched = self.lobe.names
        names = [*searched, *list(self.lobe.linear) * scale.size]
        matrix, undetermined = self._factored(projection.jacobian(lobe, slopes, gain, scale), names)
        count, unknowns = residual.size, len(names)
        cost = float(np.sum(np.square(residual)))
        spread = np.sqrt(cost / (count - unknowns)) * projection.standard_deviations(matrix)
        factors = np.array(list(self.lobe.linear.values()))[:, None]
        linear = factors * self._unit * np.stack([offset, scale])
        linear_errors = factors * (self._unit * spread[len(searched) :].reshape(-1, 2).T)
        near, values = projection.model(lobe, offset, scale), self._values / self._unit
        rmse = self._unit * float(np.sqrt(np.mean(np.square(near - values))))
        unit = 1.0 if self._is_log else self._unit
        likelihood = count * np.log(max(cost, np.finfo(float).tiny) / count)
        likelihood += 2 * count * np.log(unit)
        mdf = self.lobe.distribution(point)
        is_logarithm = np.array([name != "reflectance" for name in searched])
        parameters = np.where(is_logarithm, np.exp(point), point)
        errors = spread[: len(searched)] * np.where(is_logarithm, parameters, 1)
        return MeasuredFit(
            distribution=mdf,
            parameters=dict(zip(searched, parameters.tolist(), strict=True)),
            errors=dict(zip(searched, errors.tolist(), strict=True)),
            linear=dict(zip(self.lobe.linear, map(tuple, linear.tolist()), strict=True)),
            linear_errors=dict(
                zip(self.lobe.linear, map(tuple, linear_errors.tolist()), strict=True)
            ),
            rmse=rmse,
            log_rmse=_log_rmse(near, values),
            error=unit * float(np.sqrt(cost / np.sum(self._weight) / scale.size)),
            aic=float(likelihood + 2 * unknowns),
            bic=float(likelihood + unknowns * np.log(count)),
            masking=self.lobe.masking,
            fresnel=self.lobe.options.fresnel,
            at_limit=self._at_limit(point),
            undetermined=undetermined,
        )

    def _at_limit(self, point: Array) -> tuple[str, ...]:
        """Return the names of parameters at an end of their range; of a slice p has none."""
        first = 1 if isinstance(self.lobe, _SliceLobe) else 0
        low, high = self.lobe.bounds
        is_near = np.minimum(point - low, high - point) < _AT_END
        return tuple(compress(self.lobe.names[first:], is_near[first:]))

    def _factored(self, blocks: Iterator[Array], names: list[str]) -> tuple[Array, tuple[str, ...]]:
        """Return J, or its R, and the names of what the data do not tell apart."""
        if isinstance(self.lobe, _SliceLobe):
            whole = np.concatenate(list(blocks))
            return whole.reshape(-1, len(names)), ()
        triangle = projection.upper_triangle(
            block[:, channel] for block in blocks for channel in range(block.shape[1])
        )
        return triangle, _undetermined(triangle, names)


def _undetermined(triangle: Array, names: list[str]) -> tuple[str, ...]:
    """Return the parameters of a combination that the data do not tell, by R; none if they do."""
    norms = np.linalg.norm(triangle, axis=0)
    if not (norms > 0).all():
        return ()
    _, singular, basis = np.linalg.svd(triangle / norms)
    if singular[-1] > _UNDETERMINED * singular[0]:
        return ()
    strongest = np.argsort(-np.abs(basis[-1]))[:2]
    return tuple(dict.fromkeys(names[index] for index in sorted(strongest)))


def _log_rmse(near: Array, values: Array) -> float:
    """Return the root mean square of ln(model/value) where both are positive, else NaN."""
    positive = (near > 0) & (values > 0)
    if not positive.any():
        return float("nan")
    ratio = np.log(near[positive] / values[positive])
    return float(np.sqrt(np.mean(np.square(ratio))))
