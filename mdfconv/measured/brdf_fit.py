"""Fits of one candidate to measured reflectance, or to measured normals.

What is linear is solved for (`mdfconv.measured.projection`), the lobe's parameters are searched:
a scan finds starts on some of the samples, Levenberg and Marquardt's method the minimum near each
on more of them, and a few steps that of all. The search learns from its steps what the squares of
slopes leave out of the Hessian, which is much for a shape that does not fit.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import compress
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mdfconv.brdf.fresnel import normal_reflectance
from mdfconv.distributions import Distribution
from mdfconv.distributions.evaluation import Array
from mdfconv.errors import MdfconvError
from mdfconv.measured import projection
from mdfconv.measured.model import (
    DIELECTRIC,
    LOSSLESS,
    METAL,
    SLICE_LOSSES,
    BrdfModel,
    Lobe,
    LobeShape,
    SliceLobe,
    candidate,
    lobe_at,
)
from mdfconv.measured.projection import Projected, Projection, Terms
from mdfconv.measured.samples import DirectionalSamples, Measurements, Samples, some_rows
from mdfconv.measured.scans import MEDIANS, albedo, dependence, scan_order

# Samples of a scan for starts, and those on which a start is followed.
_SCANNED, _FIRST_FITTED = 600, 3_000
# Values that a scan holds at a time: 16 MB.
_SCANNED_AT_ONCE = 2_000_000
# Linear steps of the projection: in a scan, and from the coefficients of a point nearby.
_SCAN_STEPS, _WARM_STEPS = 4, 3
# Two lobes begin as this share of a narrower one, of so many widths.
_DOUBLE_SHARES = (0.3, 0.7)
_DOUBLE_WIDTHS = 13
# Inside the bounds by this: a search starts between them.
_INSIDE = 1e-9
# Nearer than this to an end of its range a coordinate is at the end.
_AT_END = 1e-3
# Of a coordinate, most a logarithm: a slope tells no more of a function so far away.
_LARGEST_DEVIATION = 2.0
# Robust weights are those of a point when it moves less than this.
_SETTLED = 1e-4
# Of what is moved again.
_NEARLY_SETTLED = 1e-3
# The largest value of no surface is less.
_LEAST_BRDF = 1e-30
# Of an exact fit, whose logarithm is wanted.
_LEAST_ERROR = 1e-150
# Of the largest value: what is smaller has no weight 1/value² in double precision.
_SMALLEST_LOGARITHM = 1e-100
# Standard deviations between which they have weights 1/σ².
_DEVIATIONS = (1e-100, 1e100)
_STEPS, _FIRST_STEPS, _POLISHING_STEPS = 60, 8, 4
_SMALLEST_STEP = 1e-6
# Steps that lessen the cost by no more, relatively, are not felt.
_LEAST_GAIN = 1e-10
_DAMPING, _LEAST_DAMPING, _LARGEST_DAMPING = 1e-4, 1e-12, 1e8
# Of the choice of samples: the same fit each time.
_SEED = 0
# Huber 1964: linear beyond so many standard deviations, which costs 5 % of the efficiency.
_HUBER = 1.345
_FIRST_PASSES, _ROBUST_PASSES, _LAST_PASSES = 2, 4, 2
# The index with which a search for one begins.
_STARTING_INDEX = 1.5
# What reflects less along the normal is no metal, whichever approximation of F fits better.
_DARKEST_METAL = 0.1
# How an unknown is called beside the names of the distribution's own.
_SYMBOLS = {
    "diffuse": "k_d",
    "f0": "F₀",
    "specular": "k_s",
    "specular_f0": "k_s F₀",
    "specular_rest": "k_s (1 − F₀)",
}


@dataclass(frozen=True)
class MeasuredFit:
    """One candidate fitted to measurements.

    Parameters
    ----------
    what : LobeShape
        What was fitted.
    distribution : Distribution
        The distribution, with the fitted γ if it has one; of two lobes that of both.
    parameters, errors : dict of str to float
        What was searched, by its names, and the standard errors: the distribution's parameter,
        ``"gamma"``, of two lobes ``"second"``, the parameter of the wider one, and ``"share"`` of
        the narrower one, and ``"n"``, the index of refraction. NaN is the error of what the data
        do not bound.
    linear, linear_errors : dict of str to tuple of float
        What was solved for, of each channel: ``"diffuse"`` (k_d), ``"f0"`` and ``"specular"``
        (k_s), or of one angle ``"offset"`` and ``"scale"``, and the standard errors.
    options : BrdfModel
        The options.
    fresnel : str or None
        The Fresnel factor, as in `BrdfModel`; None of one angle.
    error : float
        Root mean square of the loss's residuals with the robust weights, by which fits compare.
    rmse, log_rmse : float
        Root mean square of the residuals, and of those of the natural logarithms where both
        sample and model are positive.
    bic : float
        Schwarz's information criterion of the loss's residuals.
    unknowns : tuple of str
        All unknowns by their names, and of more channels the channel.
    correlation : numpy.ndarray, shape (unknowns, unknowns)
        The correlation of their estimates.
    at_limit : tuple of str
        Parameters at an end of their range.
    weights : numpy.ndarray, shape (n,)
        The robust weights of the samples, 1 for those that count fully.
    loss : str
        That of the options; ``"sigma"`` where uncertainties weight differences of values.
    validated_error, validated_spread : float
        The error at samples that were left out, and its standard error; NaN if not validated.
    """

    what: LobeShape
    distribution: Distribution
    parameters: dict[str, float]
    errors: dict[str, float]
    linear: dict[str, tuple[float, ...]]
    linear_errors: dict[str, tuple[float, ...]]
    options: BrdfModel
    fresnel: str | None
    error: float
    rmse: float
    log_rmse: float
    bic: float
    unknowns: tuple[str, ...]
    correlation: Array
    at_limit: tuple[str, ...]
    weights: Array = field(repr=False)
    point: Array = field(repr=False)
    loss: str
    validated_error: float = float("nan")
    validated_spread: float = float("nan")

    @property
    def name(self) -> str:
        """The name of the candidate."""
        return self.what.name

    @property
    def label(self) -> str:
        """What the candidate is called in a text."""
        return "two GGX lobes" if self.what.is_double else self.distribution.name

    @property
    def size(self) -> int:
        """How many parameters the shape has."""
        return len(self.parameters) - ("n" in self.parameters)

    @property
    def comparable_error(self) -> float:
        """The validated error; the error itself of a fit that is not validated."""
        return self.error if np.isnan(self.validated_error) else self.validated_error

    @property
    def parameter(self) -> float:
        """The distribution's own parameter; of two lobes that of the narrower one."""
        return self.parameters[self.distribution.parameter.name]

    @property
    def parameter_error(self) -> float:
        """Its standard error."""
        return self.errors[self.distribution.parameter.name]

    @property
    def gamma(self) -> float | None:
        """γ of a distribution that has one."""
        return self.distribution.gamma

    @property
    def gamma_error(self) -> float | None:
        """The standard error of γ; None if it was not fitted."""
        return self.errors.get("gamma")

    @property
    def second(self) -> float | None:
        """The parameter of the wider of two lobes."""
        return self.parameters.get("second")

    @property
    def share(self) -> float | None:
        """The share of the narrower of two lobes."""
        return self.parameters.get("share")

    @property
    def n(self) -> float | None:
        """The index of refraction of a dielectric."""
        if self.fresnel and self.fresnel.startswith("ior:"):
            return float(self.fresnel.partition(":")[2])
        return self.parameters.get("n")

    @property
    def n_error(self) -> float | None:
        """Its standard error; None if it was not fitted."""
        return self.errors.get("n")

    @property
    def f0(self) -> tuple[float, ...] | None:
        """The reflectance along the normal of each channel; None without Fresnel's factor."""
        if self.n is not None:
            return (normal_reflectance(self.n),) * len(self.linear["diffuse"])
        return self.linear.get("f0")

    @property
    def f0_error(self) -> tuple[float, ...] | None:
        """Its standard errors."""
        if self.n is not None:
            slope = 4 * abs(self.n - 1) / (self.n + 1) ** 3
            return (slope * (self.n_error or 0.0),) * len(self.linear["diffuse"])
        return self.linear_errors.get("f0")

    @property
    def diffuse(self) -> tuple[float, ...] | None:
        """k_d of each channel; None of one angle."""
        return self.linear.get("diffuse")

    @property
    def diffuse_error(self) -> tuple[float, ...] | None:
        """The standard errors of k_d."""
        return self.linear_errors.get("diffuse")

    @property
    def specular(self) -> tuple[float, ...] | None:
        """k_s of each channel, 1 unless it was free; None of one angle."""
        one = (1.0,) * len(self.diffuse) if self.diffuse else None
        return self.linear.get("specular", one)

    @property
    def specular_error(self) -> tuple[float, ...] | None:
        """The standard errors of k_s, 0 if it was not free."""
        zero = (0.0,) * len(self.diffuse) if self.diffuse else None
        return self.linear_errors.get("specular", zero)

    def model(self, samples: Measurements) -> Array:
        """Return the model at the angles or directions of samples, shape (n, channels)."""
        lobe = lobe_at(samples, self.what, self.options, self.fresnel or "none")
        return lobe.terms(self.point).at(self.coefficients(lobe.linear)).T

    def _coefficient(self, name: str) -> tuple[float, ...]:
        if name in ("specular_f0", "specular_rest"):
            f0, specular = np.array(self.linear["f0"]), np.array(self.linear["specular"])
            return tuple((specular * (f0 if name == "specular_f0" else 1 - f0)).tolist())
        return self.linear[name]

    def coefficients(self, names: Sequence[str]) -> Array:
        """Return what was solved for as the coefficients of a lobe, shape (channels, names)."""
        return np.array([self._coefficient(name) for name in names]).T

    def albedo(self, theta: float) -> Array:
        """Return the share of light from an angle, radians, that is reflected, shape (channels,).

        Of two directions only; the shape of an aperture is left out.
        """
        sharp = replace(self, options=replace(self.options, aperture=None))

        def value(incident: Array, outgoing: Array) -> Array:
            channels = tuple(map(str, range(len(self.linear["diffuse"]))))
            empty = np.ones((len(incident), len(channels)))
            return sharp.model(DirectionalSamples(incident, outgoing, empty, channels))

        return albedo(value, theta, float(self.distribution.half_width(self.parameter)))

    def record(self) -> dict[str, Any]:
        """Return the fit as a row of a table, lists by channel."""
        row: dict[str, Any] = {
            "distribution": self.name,
            "parameter": self.parameter,
            "gamma": self.gamma,
        }
        if self.what.is_double:
            row |= {"second": self.second, "share": self.share}
        if self.fresnel is None:
            row |= {name: list(values) for name, values in self.linear.items()}
        else:
            row |= {
                "fresnel": self.fresnel,
                "f0": list(self.f0) if self.f0 else None,
                "n": self.n,
                "diffuse": list(self.diffuse or ()),
                "specular": list(self.specular or ()),
            }
        row |= {"parameter_stderr": self.parameter_error, "gamma_stderr": self.gamma_error}
        if self.what.is_double:
            row |= {f"{name}_stderr": self.errors[name] for name in ("second", "share")}
        if self.fresnel is None:
            row |= {f"{name}_stderr": list(all_) for name, all_ in self.linear_errors.items()}
        else:
            row |= {
                "f0_stderr": list(self.f0_error) if self.f0_error else None,
                "n_stderr": self.n_error,
                "diffuse_stderr": list(self.diffuse_error or ()),
                "specular_stderr": list(self.specular_error or ()),
            }
        return row | {
            "loss": self.loss,
            "error": self.error,
            "validated_error": self.validated_error,
            "validated_spread": self.validated_spread,
            "rmse": self.rmse,
            "log_rmse": self.log_rmse,
            "bic": self.bic,
        }


def fit_distribution(
    samples: Measurements,
    target: str | Distribution | LobeShape,
    model: BrdfModel | None = None,
    *,
    gamma: float | None = None,
    patience: float = np.inf,
) -> MeasuredFit:
    """Fit one distribution to samples, all channels with one lobe.

    γ of a distribution that has one is free unless it is given; the others do not ask for it. The
    robust weights of a fit whose error exceeds `patience` are left as they are after two passes.
    Raises `MdfconvError` if there are fewer samples than unknowns, nothing to fit, or γ is illegal.
    """
    options, what = model or BrdfModel(), candidate(target, gamma)
    is_slice = isinstance(samples, Samples)
    if is_slice and options.loss not in SLICE_LOSSES:
        raise MdfconvError(
            f"the {options.loss} loss needs two directions", f"known: {', '.join(SLICE_LOSSES)}"
        )
    kinds = (LOSSLESS,) if is_slice else options.kinds
    first = Problem(checked(lobe_at(samples, what, options, kinds[0])))
    random = np.random.default_rng(_SEED)
    index = some_rows(random, len(samples.values), _FIRST_FITTED)
    some = first.part(index)
    few = some.part(some_rows(random, some.count, _SCANNED))
    starts = [few.extended(start) for start in few.starts()]
    start = starts[0]
    if len(starts) > 1:
        tried = (few.evaluated(start).descend(steps=_FIRST_STEPS) for start in starts)
        start = min(tried, key=lambda minimum: minimum.cost).point
    minima = []
    for kind in kinds:
        problem = some.with_fresnel(kind)
        # The shape has been searched; the rest is the problem's own.
        minimum = problem.evaluated(problem.extended(start[: few.lobe.shape_size]))
        minimum = minimum.descend(smallest=_NEARLY_SETTLED)
        minima.append(_robust(minimum, passes=_FIRST_PASSES))
    plausible = [minimum for minimum in minima if minimum.is_plausible] or minima
    found = min(plausible, key=lambda minimum: minimum.bic(first.count))
    if found.error <= patience:
        found = _robust(found, passes=_ROBUST_PASSES)
    if some is not first:
        whole = first.with_fresnel(found.problem.lobe.fresnel)
        found = _polished(whole, found.report())
    return found.report()


def refitted(samples: Measurements, fit: MeasuredFit) -> MeasuredFit:
    """Return the fit to more samples of the same surface, near which it is."""
    problem = Problem(lobe_at(samples, fit.what, fit.options, fit.fresnel or LOSSLESS))
    return _polished(problem, fit).report()


def refitted_as(
    samples: Measurements,
    fit: MeasuredFit,
    options: BrdfModel,
    fresnel: str | None,
    what: LobeShape | None = None,
) -> MeasuredFit:
    """Return the fit of the same lobe to other samples, or under other options, nearby.

    Raises `MdfconvError` as `fit_distribution`.
    """
    lobe = checked(lobe_at(samples, what or fit.what, options, fresnel or LOSSLESS))
    known = fit.parameters
    point = [u.coordinate(known.get(u.name, _STARTING_INDEX)) for u in lobe.unknowns]
    minimum = Problem(lobe).evaluated(np.array(point)).descend(smallest=_NEARLY_SETTLED)
    found = _robust(_robust(minimum, passes=_FIRST_PASSES), passes=_ROBUST_PASSES)
    if found.is_flat:
        raise MdfconvError(*lobe.refusal)
    return found.report()


def _polished(problem: Problem, fit: MeasuredFit) -> Minimum:
    """Return the minimum near a fit to some of the samples of a problem."""
    return _robust(problem.at(fit), passes=_LAST_PASSES, smallest=_NEARLY_SETTLED)


def _robust(minimum: Minimum, passes: int, smallest: float = _SETTLED) -> Minimum:
    """Return the minimum near a point with weights for which it is the robust one."""
    is_robust = minimum.problem.lobe.options.robust
    for _ in range(passes if is_robust else 1):
        before = minimum.point
        minimum = minimum.reweighted().descend(
            steps=_POLISHING_STEPS, smallest=smallest if is_robust else _SMALLEST_STEP
        )
        if np.abs(minimum.point - before).max() < _SETTLED:
            break
    return minimum


def checked(lobe: Lobe) -> Lobe:
    """Return a lobe; raise `MdfconvError` if there is nothing to fit at its samples."""
    values = lobe.samples.values
    unknowns = len(lobe.unknowns) + len(lobe.linear) * values.shape[1]
    if values.size <= unknowns or lobe.places < 4:
        raise MdfconvError(
            f"{values.size} values{lobe.where} are too few to fit {unknowns} unknowns of "
            f"{lobe.what.name}"
        )
    if np.ptp(values, axis=0).max() == 0:
        raise MdfconvError("all values are equal: there is no lobe to fit")
    largest = float(values.max())
    if largest <= 0:
        raise MdfconvError("no value is positive: there is no lobe to fit")
    if lobe.is_absolute and not _LEAST_BRDF < largest < 1 / _LEAST_BRDF:
        raise MdfconvError(
            f"values of at most {largest:.3g} are no f_r in 1/sr",
            "fit values of another unit with F = 1 and k_s free",
            argument="fresnel",
        )
    deviations = lobe.deviations()
    if deviations is not None and not _are_within(deviations, *_DEVIATIONS):
        raise MdfconvError(
            f"standard deviations between {deviations.min():.3g} and {deviations.max():.3g} are "
            f"outside {_DEVIATIONS[0]:g} to {_DEVIATIONS[1]:g}",
            "fit values of another unit, or without standard deviations",
        )
    if lobe.transform() and values.min() <= _SMALLEST_LOGARITHM * largest:
        raise MdfconvError(
            "the smallest value is less than 1e-100 of the largest: no loss of logarithms holds "
            "both",
            "leave out what is no measurement, or take the linear loss",
        )
    return lobe


def _are_within(values: Array, least: float, largest: float) -> bool:
    return bool(values.min() >= least and values.max() <= largest)


class Problem:
    """The projected problem: residuals of the best coefficients, by the point of a lobe."""

    def __init__(self, lobe: Lobe, robust: Array | None = None, unit: float | None = None) -> None:
        self.lobe = lobe
        values = np.ascontiguousarray(lobe.samples.values.T)
        # Whatever the unit of the measurement, in units of the largest value.
        largest = 1.0 if lobe.is_absolute else float(np.max(np.abs(values)))
        self.unit = largest if unit is None else unit
        self._values = values / self.unit
        self.robust = np.ones(values.shape[1]) if robust is None else robust
        self._transform = lobe.transform()
        weight = lobe.weight() * self.robust
        self.project = Projection(self._values, weight, self._transform)

    @property
    def count(self) -> int:
        """How many samples there are."""
        return self._values.shape[1]

    def part(self, index: Any) -> Problem:
        """Return the problem of some of the samples; itself for None."""
        if index is None:
            return self
        return Problem(self.lobe.part(index), self.robust[index], self.unit)

    def with_fresnel(self, fresnel: str) -> Problem:
        """Return the problem with another Fresnel factor."""
        if fresnel == self.lobe.fresnel:
            return self
        return Problem(self.lobe.with_fresnel(fresnel), self.robust, self.unit)

    def weighted(self, robust: Array) -> Problem:
        """Return the problem with other robust weights."""
        other = copy(self)
        other.robust = robust
        other.project = self.project.weighted(self.lobe.weight() * robust)
        return other

    def starts(self) -> list[Array]:
        """Return the best points of γ that are better than their neighbours, the best ones first.

        Raises `MdfconvError` if there is none.
        """
        lobe = self.lobe
        points: list[Array] = []
        least: list[float] = []
        for mdf, parameters in lobe.starts():
            if lobe.what.is_double:
                parameters = parameters[:: max(1, len(parameters) // _DOUBLE_WIDTHS)]
            terms, tried = lobe.scanned(mdf, parameters), np.log(parameters)[:, None]
            if lobe.what.is_double:
                terms, tried = _mixtures(terms, tried[:, 0])
            elif lobe.what.is_gamma_free:
                tried = np.hstack([tried, np.full_like(tried, np.log(mdf.gamma))])
            costs, strengths = self._scanned(terms)
            best = int(np.argmin(costs))
            points.append(tried[best])
            least.append(float(costs[best]) if strengths[best] else np.inf)
        if min(least) == np.inf:
            raise MdfconvError(*lobe.refusal)
        # A start that is worse than that of the next γ leads to the same minimum.
        around = np.array([np.inf, *least, np.inf])
        is_valley = np.array(least) <= np.minimum(around[:-2], around[2:])
        order = [place for place in np.argsort(least, kind="stable") if is_valley[place]]
        return [points[place] for place in order[: lobe.scan.starts]]

    def _scanned(self, terms: Terms) -> tuple[Array, Array]:
        """Return the costs of many lobes, and whether any channel has them."""
        costs, strengths = [], []
        size = max(1, _SCANNED_AT_ONCE // self._values.size)
        for start in range(0, len(terms.basis), size):
            block = Terms(*(part[start : start + size] for part in terms))
            projected = self.project(block, steps=_SCAN_STEPS)
            costs.append(np.square(projected.residual).sum(axis=(1, 2)))
            strengths.append((projected.coefficients[..., 1] > 0).any(axis=1))
        return np.concatenate(costs), np.concatenate(strengths)

    def extended(self, start: Array) -> Array:
        """Return a start with the unknowns that the scan does not search."""
        rest = self.lobe.unknowns[len(start) :]
        return np.array([*start, *(unknown.coordinate(_STARTING_INDEX) for unknown in rest)])

    def evaluated(self, point: Array) -> Minimum:
        """Return what is known at a point, moved inside the bounds."""
        low, high = self.lobe.bounds
        point = np.clip(point, low + _INSIDE, high - _INSIDE)
        terms = self.lobe.terms(point)
        return Minimum(self, point, terms, self.project(terms))

    def at(self, fit: MeasuredFit) -> Minimum:
        """Return what a fit to other samples makes of these."""
        terms, known = self.lobe.terms(fit.point), fit.coefficients(self.lobe.linear) / self.unit
        return Minimum(self, fit.point, terms, self.project(terms, known, steps=0))


def _mixtures(terms: Terms, coordinates: Array) -> tuple[Terms, Array]:
    """Return the terms of two lobes for all pairs of those of one, and their points."""
    first, second = np.triu_indices(len(coordinates), 1)
    bases, points = [], []
    for share in _DOUBLE_SHARES:
        bases.append(share * terms.basis[first] + (1 - share) * terms.basis[second])
        shares = np.full(len(first), share)
        points.append(np.stack([coordinates[first], coordinates[second], shares], axis=1))
    basis = np.concatenate(bases)
    return Terms(basis, np.zeros_like(basis[:, 0])), np.concatenate(points)


class Minimum:
    """A point of a problem, and the best coefficients there."""

    def __init__(
        self,
        problem: Problem,
        point: Array,
        terms: Terms,
        projected: Projected,
        curvature: Array | None = None,
    ) -> None:
        self.problem, self.point, self.terms, self.projected = problem, point, terms, projected
        self._curvature = np.zeros((len(point),) * 2) if curvature is None else curvature
        residual = projected.residual.ravel()
        self.cost = float(residual @ residual)

    @cached_property
    def _slopes(self) -> list[Terms]:
        """∂terms/∂coordinate."""
        return self.problem.lobe.slopes(self.point, self.terms)

    @cached_property
    def _jacobian(self) -> Array:
        """∂residual/∂coordinate with the linear part projected out."""
        return projection.projected_slope(self.terms, self._slopes, self.projected)

    @cached_property
    def _normal(self) -> Array:
        return np.einsum("in,jn->ij", self._jacobian, self._jacobian)

    @cached_property
    def _gradient(self) -> Array:
        return np.einsum("in,n->i", self._jacobian, self.projected.residual.ravel())

    def _learn(self, before: Minimum) -> None:
        """Learn from a step what JᵀJ leaves out of the Hessian (Dennis, Gay & Welsch 1981)."""
        step, change = self.point - before.point, self._gradient - before._gradient
        along = change @ step
        if not along > 0:
            return
        residual = self.projected.residual.ravel()
        wanted = self._gradient - np.einsum("in,n->i", before._jacobian, residual)
        known = before._curvature
        size = abs(step @ known @ step)
        known = known * min(1, abs(step @ wanted) / size) if size else known
        missing = wanted - known @ step
        # Before they are multiplied: residuals have any unit.
        share = change / along
        outer = np.outer(missing, share)
        square = (missing @ step) * np.outer(share, share)
        self._curvature = known + outer + outer.T - square

    def moved(self, point: Array) -> Minimum:
        """Return another point, whose best coefficients are near."""
        terms = self.problem.lobe.terms(point)
        projected = self.problem.project(terms, self.projected.coefficients, steps=_WARM_STEPS)
        return Minimum(self.problem, point, terms, projected, self._curvature)

    def weighted(self, robust: Array) -> Minimum:
        """Return the point in the problem with other robust weights, on which no slope depends."""
        problem, known = self.problem.weighted(robust), self.projected.coefficients
        projected = problem.project(self.terms, known, steps=_WARM_STEPS)
        other = Minimum(problem, self.point, self.terms, projected, self._curvature)
        other._slopes = self._slopes
        return other

    def error_at(self, robust: Array) -> float:
        """Return the error of the same coefficients with other robust weights."""
        problem, known = self.problem.weighted(robust), self.projected.coefficients
        return Minimum(
            problem, self.point, self.terms, problem.project(self.terms, known, steps=0)
        ).error

    def reweighted(self) -> Minimum:
        """Return the point in the problem in which what is far off there counts less."""
        if not self.problem.lobe.options.robust:
            return self
        residual = np.abs(self.projected.residual).max(axis=0) / np.sqrt(self.problem.robust)
        spread = MEDIANS * float(np.median(residual)) or 1.0
        return self.weighted(np.minimum(1, _HUBER * spread / np.maximum(residual, 1e-300)))

    def descend(self, *, steps: int = _STEPS, smallest: float = _SMALLEST_STEP) -> Minimum:
        """Return the minimum nearby (Levenberg 1944, Marquardt 1963)."""
        now, damping = self, _DAMPING
        for _ in range(steps):
            following, damping, is_last = now._step(damping, smallest)
            if is_last:
                return following
            following._learn(now)
            now = following
        return now

    def _step(self, damping: float, smallest: float) -> tuple[Minimum, float, bool]:
        """Return a better point, the damping for the next step, and whether that is not worth it.

        Where what was learnt of the Hessian misleads, JᵀJ stands for it.
        """
        low, high = self.problem.lobe.bounds
        normal, right = self._normal, self._gradient
        # At an end of its range a coordinate may only come back.
        held = ((self.point <= low) & (right > 0)) | ((self.point >= high) & (right < 0))
        free = np.flatnonzero(~held & (np.diagonal(normal) > 0))
        block = np.ix_(free, free)
        trials = [normal[block]]
        curved = (normal + self._curvature)[block]
        if self._curvature.any() and np.linalg.eigvalsh(curved).min(initial=np.inf) > 0:
            trials.append(curved)
        while free.size and damping < _LARGEST_DAMPING:
            matrix = trials[-1] + damping * np.diag(np.diagonal(trials[-1]))
            point = self.point.copy()
            point[free] -= np.linalg.solve(matrix, right[free])
            point = np.clip(point, low, high)
            gain = right @ (self.point - point)
            is_last = np.abs(point - self.point).max() < smallest
            is_last |= 0 <= gain < _LEAST_GAIN * self.cost
            following = self.moved(point)
            if following.cost <= self.cost:
                return following, max(damping / 10, _LEAST_DAMPING), is_last
            if is_last:
                break
            if len(trials) > 1:
                trials.pop()
            else:
                damping *= 10
        return self, damping, True

    @property
    def relative_error(self) -> float:
        """The root mean square residual, weighted by the robust weights, in the problem's unit."""
        weight = self.problem.robust.sum() * len(self.projected.coefficients)
        return float(np.sqrt(self.cost / weight))

    @property
    def error(self) -> float:
        """The same in the loss's units."""
        is_relative = self.problem.lobe.transform() is not None
        return self.relative_error * (1 if is_relative else self.problem.unit)

    @property
    def is_flat(self) -> bool:
        """Whether no channel has a lobe."""
        return not (self.problem.lobe.is_absolute or self.projected.coefficients[:, 1:].any())

    @property
    def is_plausible(self) -> bool:
        """Whether a metal reflects as much as one, and a dielectric no more."""
        lobe = self.problem.lobe
        if lobe.fresnel == METAL:
            return max(self.estimates()[1]["f0"]) >= _DARKEST_METAL
        return lobe.fresnel != DIELECTRIC or "n" not in self._at_limit()

    def bic(self, count: int) -> float:
        """Return Schwarz's criterion for so many samples."""
        size = count * len(self.projected.coefficients)
        unknowns = len(self.point) + self.projected.coefficients.size
        return size * np.log(max(self.relative_error, _LEAST_ERROR) ** 2) + unknowns * np.log(size)

    def estimates(self) -> tuple[dict[str, float], dict[str, tuple[float, ...]]]:
        """Return what was searched and what was solved for, by their names."""
        lobe = self.problem.lobe
        pairs = zip(lobe.unknowns, self.point, strict=True)
        searched = {unknown.name: float(unknown.value(x)) for unknown, x in pairs}
        columns = self.problem.unit * self.projected.coefficients.T
        linear = dict(zip(lobe.linear, columns, strict=True))
        if "specular_f0" in linear:
            normal, specular = (
                linear["specular_f0"],
                linear["specular_f0"] + linear["specular_rest"],
            )
            # A channel without a lobe reflects nothing.
            f0 = normal / np.where(specular > 0, specular, 1)
            linear = {"diffuse": linear["diffuse"], "f0": f0, "specular": specular}
        return searched, {name: tuple(column.tolist()) for name, column in linear.items()}

    def ordered(self) -> Minimum:
        """Return the point whose first lobe is the narrower of two."""
        if not self.problem.lobe.what.is_double or self.point[0] <= self.point[1]:
            return self
        first, second, share, *rest = self.point
        return self.moved(np.array([second, first, 1 - share, *rest]))

    def report(self) -> MeasuredFit:
        """Return the fit."""
        if self is not (ordered := self.ordered()):
            return ordered.report()
        lobe, channels = self.problem.lobe, self.problem.lobe.samples.channels
        searched, linear = self.estimates()
        deviations, correlation, names = self._uncertainty()
        count = len(lobe.unknowns)
        slopes = [u.slope(x) for u, x in zip(lobe.unknowns, self.point, strict=True)]
        known = np.where(self._is_bounded(deviations[:count]), deviations[:count], np.nan)
        errors = dict(zip(searched, (known * slopes).tolist(), strict=True))
        columns = self.problem.unit * deviations[count:].reshape(len(channels), -1).T
        deviation = dict(zip(lobe.linear, columns, strict=True))
        if "specular_f0" in deviation:
            deviation |= self._of_quotient(deviation, correlation[count:, count:])
        deviation = {name: deviation[name] for name in linear}
        near = self.terms.at(self.projected.coefficients) * self.problem.unit
        values = lobe.samples.values.T
        unit = self.problem.unit if lobe.transform() is None else 1.0
        size = values.size
        return MeasuredFit(
            what=lobe.what,
            distribution=lobe.distribution(self.point),
            parameters=searched,
            errors=errors,
            linear=linear,
            linear_errors={name: tuple(all_.tolist()) for name, all_ in deviation.items()},
            options=lobe.options,
            fresnel=None if isinstance(lobe, SliceLobe) else lobe.fresnel,
            error=self.error,
            rmse=_rmse(near, values),
            log_rmse=_log_rmse(near, values),
            bic=float(self.bic(self.problem.count) + 2 * size * np.log(unit)),
            unknowns=names,
            correlation=correlation,
            at_limit=self._at_limit(),
            weights=self.problem.robust,
            point=self.point,
            loss=lobe.loss,
        )

    def _uncertainty(self) -> tuple[Array, Array, tuple[str, ...]]:
        """Return deviations and correlation of coordinates and coefficients, and their names.

        Residuals of a scan resemble their neighbours: fewer of them are independent.
        """
        lobe = self.problem.lobe
        matrix = projection.information(self.terms, self._slopes, self.projected)
        size = np.sqrt(np.maximum(np.diagonal(matrix), np.finfo(float).tiny))
        inverse = np.linalg.pinv(matrix / (size[:, None] * size), hermitian=True)
        residual = self.projected.residual
        free = max(1, residual.size - len(matrix))
        spread = self.cost / free
        spread *= dependence(residual[:, scan_order(lobe.samples)])
        # Of few samples the spread itself is uncertain.
        spread *= student_quantile(free) ** 2
        channels = lobe.samples.channels
        places = channels if len(channels) > 1 else ("",)
        linear = [
            f"{_SYMBOLS.get(name, name)} {place}".rstrip()
            for place in places
            for name in lobe.linear
        ]
        names = *(unknown.name for unknown in lobe.unknowns), *linear
        # One after the other: a square of what the data do not tell may be too large.
        root = np.sqrt(np.maximum(np.diagonal(inverse), 0))
        divisor = np.where(root > 0, root, 1)
        return np.sqrt(spread) * root / size, inverse / divisor[:, None] / divisor, names

    def _of_quotient(self, deviation: dict[str, Array], correlation: Array) -> dict[str, Array]:
        """Return the deviations of F₀ = a/(a + b) and k_s = a + b, from those of a and b."""
        lobe, columns = self.problem.lobe, self.problem.unit * self.projected.coefficients.T
        of_a, of_b = map(lobe.linear.index, ("specular_f0", "specular_rest"))
        first = np.arange(columns.shape[1]) * len(lobe.linear)
        shared = correlation[first + of_a, first + of_b]
        a, da = columns[of_a], deviation["specular_f0"]
        b, db = columns[of_b], deviation["specular_rest"]
        total = np.where(a + b > 0, a + b, np.nan)
        p, q = b * da / total, a * db / total
        return {
            "f0": _root(p * p + q * q - 2 * shared * p * q) / total,
            "specular": _root(da * da + db * db + 2 * shared * da * db),
        }

    def _is_bounded(self, deviations: Array) -> NDArray[np.bool_]:
        """Return which coordinates the data bound, so that a standard error says something."""
        low, high = self.problem.lobe.bounds
        is_felt = (deviations > 0) | (self.cost == 0)
        return (
            is_felt
            & (deviations < np.minimum(_LARGEST_DEVIATION, 0.5 * (high - low)))
            & ~self._is_at_end()
        )

    def _is_at_end(self) -> NDArray[np.bool_]:
        low, high = self.problem.lobe.bounds
        return np.asarray(np.minimum(self.point - low, high - self.point) < _AT_END)

    def _at_limit(self) -> tuple[str, ...]:
        """Return the names of parameters at an end of their range; of a slice p has none."""
        lobe = self.problem.lobe
        first = 1 if isinstance(lobe, SliceLobe) else 0
        is_near = self._is_at_end()
        names = [unknown.name for unknown in lobe.unknowns]
        return tuple(compress(names[first:], is_near[first:]))


def _root(square: Array) -> Array:
    """Return the square root of what only rounding makes negative."""
    return np.sqrt(np.maximum(square, 0))


def student_quantile(free: int) -> float:
    """Return what one standard deviation is in Student's t (Abramowitz & Stegun 26.7.5).

    Of one degree of freedom within 1.5 %, of two within 0.1 %.
    """
    return 1 + 0.5 / free + 0.25 / free**2 + 0.0625 / free**3


def _rmse(near: Array, values: Array) -> float:
    """Return the root mean square difference; values may be too large for their squares."""
    largest = float(np.max(np.abs(values)))
    return largest * float(np.sqrt(np.mean(np.square((near - values) / largest))))


def _log_rmse(near: Array, values: Array) -> float:
    """Return the root mean square of ln(model/value) where both are positive, else NaN."""
    positive = (near > 0) & (values > 0)
    if not positive.any():
        return float("nan")
    ratio = np.log(near[positive] / values[positive])
    return float(np.sqrt(np.mean(np.square(ratio))))
