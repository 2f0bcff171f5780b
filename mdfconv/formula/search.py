"""The search for the cheapest formula that is accurate enough."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import groupby

import numpy as np

from mdfconv.distributions.endpoint import Endpoint
from mdfconv.distributions.evaluation import Array
from mdfconv.errors import MdfconvError
from mdfconv.fitting.maps import horner
from mdfconv.fitting.metrics import Metric
from mdfconv.formula.family import Formula, Shape, evaluate, power, shapes

# Fits over the range, and the degree of the spline between them: on the usual ranges within the
# rounding of float32 of the fit, and within 2e-5 at a kink, as where a maximum leaves the normal.
_FITS = 160
_SPLINE_DEGREE = 5
# Half a unit in the last place of single precision: no formula reaches less.
_LEAST_TOLERANCE = 2.0**-24
# Points at which the error is taken: what its peaks rise to between two of them is less than a
# thousandth of it.
_CHECKS = 4096
# Of Lawson's method, which converges linearly: the worst error is then within a few per cent of
# the smallest, as the comparison with linear programming in the tests shows.
_REWEIGHTINGS = 40
# Steps after which a denominator has settled.
_SETTLED = 5
# The error of a power is that of its base times the exponent, but for terms of higher order.
_SLACK = 1.1
# A more expensive formula has to be better by a tenth to be worth a line of the table.
_GAIN = 0.9


@dataclass(frozen=True)
class SearchProblem:
    """What a formula is to compute: the fit of a pair over a range.

    Parameters
    ----------
    source, target : Endpoint
        Distributions, with their γ if they have one, and the encodings in which their parameters
        are stored.
    metric : Metric
        The metric of the fit.
    low, high : float
        The range of the source's stored value, to which the code clamps it.

    Raises
    ------
    MdfconvError
        If the range is empty or illegal, or the fit has no answer in it.
    """

    source: Endpoint
    target: Endpoint
    metric: Metric
    low: float
    high: float

    def __post_init__(self) -> None:
        self.source.decode([self.low, self.high])
        # Rounding may have taken an end to 0, to infinity, or a glossiness to 1.
        self.source.decode(self.bounds)
        if not self.bounds[0] < self.bounds[1]:
            raise MdfconvError(
                f"the range {self.low:g}:{self.high:g} is empty", "the smaller value comes first"
            )
        if self.source.distribution.is_same(self.target.distribution):
            raise MdfconvError("a formula needs two distributions; an encoding has its own")

    @cached_property
    def bounds(self) -> Array:
        """The ends of the range in float32, to which the code clamps its input."""
        with np.errstate(over="ignore"):
            return np.array([self.low, self.high], np.float32)

    def clamped(self, stored: Array) -> Array:
        """Return stored values of the source clamped to the range, in their type."""
        return np.clip(stored, *self.bounds)

    @cached_property
    def samples(self) -> tuple[Array, Array]:
        """Return w and t of the fits, at points that crowd towards the ends of the range."""
        from mdfconv.fitting.solve import fit

        limits = np.log(natural(self.source, self.bounds.astype(float)))
        turn = np.cos(np.pi * np.arange(_FITS) / (_FITS - 1))
        w = np.exp(limits.mean() + 0.5 * (limits[1] - limits[0]) * turn[::-1])
        w[[0, -1]] = np.exp(limits)
        parameter = self.source.decode(self.clamped(natural(self.source, w)))
        fitted = fit(self.source.distribution, parameter, self.target.distribution, self.metric)
        t = natural(self.target, self.target.encode(fitted.parameter))
        # To 0, where a rule clamps, no error is relative.
        usable = np.isfinite(t) & (t > 0)
        if not usable.all():
            missing = natural(self.source, w[~usable])
            raise MdfconvError(
                f"the fit has no answer in {self.target.label}, or only the end of its range, for "
                f"{self.source.label} from {missing.min():.6g} to {missing.max():.6g}",
                "narrow the range",
            )
        return w, t

    @cached_property
    def checks(self) -> tuple[Array, Array]:
        """Return w in float32, as the code has it, and t of the fit, densely over the range."""
        from scipy.interpolate import make_interp_spline

        w, t = self.samples
        order = np.argsort(w)
        spline = make_interp_spline(np.log(w[order]), np.log(t[order]), _SPLINE_DEGREE)
        dense = natural(self.source, np.geomspace(w.min(), w.max(), _CHECKS))
        stored = self.clamped(dense.astype(np.float32))
        exact = np.exp(spline(np.log(natural(self.source, stored.astype(float)))))
        return natural(self.source, stored), exact


def is_glossy(end: Endpoint) -> bool:
    """Return whether an end stores a glossiness, for which 1 − it is the natural variable.

    That is a number from 0 to 1 of which the larger is the smoother, and 1 a mirror.
    """
    stored = end.stored
    to_one = stored.lower == 0 and stored.upper == 1 and not stored.upper_closed
    return stored.larger_is_smoother and to_one


def natural(end: Endpoint, stored: Array) -> Array:
    """Return w for stored values, or stored values for w: the rule is its own inverse."""
    return 1 - stored if is_glossy(end) else stored


def cheapest(problem: SearchProblem, tolerance: float) -> Formula:
    """Return the cheapest formula whose worst relative error is at most the tolerance.

    Parameters
    ----------
    problem : SearchProblem
        What is to be computed.
    tolerance : float
        Relative error against the fit, evaluated in float32.

    Returns
    -------
    Formula
        Of those of one price the most accurate.

    Raises
    ------
    MdfconvError
        If the tolerance is not positive, or none reaches it; the message says what can.
    """
    if not tolerance > 0:
        raise MdfconvError(f"a tolerance is positive, not {tolerance:g}")
    if tolerance < _LEAST_TOLERANCE:
        raise MdfconvError(
            f"a tolerance is at least {_LEAST_TOLERANCE:.3g}, about what single precision rounds, "
            f"not {tolerance:g}"
        )
    best: Formula | None = None
    for shape in shapes():
        if best is not None and shape.operations > best.shape.operations:
            return best
        formula = _best(problem, shape, tolerance if best is None else best.error)
        if formula is not None and formula.error <= tolerance:
            best = formula
    if best is None:
        last = pareto_front(problem)[-1]
        raise MdfconvError(
            f"no formula is within {tolerance:g} in float32; the most accurate reaches "
            f"{last.error:.2g} with {last.shape.operations} operations"
        )
    return best


def pareto_front(problem: SearchProblem) -> list[Formula]:
    """Return the formulas that nothing as cheap beats, each a tenth better than the one before."""
    front: list[Formula] = []
    for _, of_one_price in groupby(shapes(), key=lambda shape: shape.operations):
        bound = _GAIN * front[-1].error if front else np.inf
        best: Formula | None = None
        for shape in of_one_price:
            formula = _best(problem, shape, bound)
            if formula is not None and formula.error < bound:
                best, bound = formula, formula.error
        if best is not None:
            front.append(best)
    return front


def _best(problem: SearchProblem, shape: Shape, bound: float) -> Formula | None:
    """Return the formula of a shape with nearly the smallest worst error.

    None if the shape does not apply, or cannot stay below the bound.
    """
    w, t = problem.samples
    with np.errstate(all="ignore"):
        needed = power(t, 1 / shape.outer) / power(w, shape.factor)
        u = power(w, shape.variable)
        scale = np.max(np.abs(u))
        coefficients = _minimax(u / scale, needed, shape, _SLACK * bound / abs(shape.outer))
    if coefficients is None:
        return None
    up, down = coefficients[: shape.numerator], coefficients[shape.numerator :]
    formula = Formula(
        shape,
        _single(up * scale ** -np.arange(up.size)),
        _single(down * scale ** -np.arange(1.0, down.size + 1)),
    )
    dense, exact = problem.checks
    error = float(np.max(np.abs(evaluate(formula, dense) / exact - 1)))
    return replace(formula, error=error) if error <= bound else None


def _single(values: Array) -> tuple[float, ...]:
    with np.errstate(all="ignore"):
        return tuple(values.astype(np.float32).astype(float).tolist())


def _minimax(u: Array, needed: Array, shape: Shape, bound: float) -> Array | None:
    """Return coefficients of P and Q whose worst relative error is nearly the smallest.

    Least squares, reweighted by its own errors (Lawson 1961) and, for a rational function, by
    its own denominator (Sanathanan & Koerner 1963). The weighted mean of the squared errors
    never exceeds the smallest worst one: None as soon as it is beyond the bound.
    """
    powers = u[:, None] ** np.arange(max(shape.numerator, shape.denominator + 1))
    up = powers[:, : shape.numerator] / needed[:, None]
    columns = np.concatenate([up, -powers[:, 1 : shape.denominator + 1]], axis=1)
    if not np.isfinite(columns).all():
        return None
    weight: Array = np.full(u.size, 1 / u.size)
    down: Array = np.ones(u.size)
    best, smallest = None, np.inf
    for step in range(_REWEIGHTINGS):
        root = np.sqrt(weight) / down
        if not np.isfinite(root).all():
            break
        coefficients = np.linalg.lstsq(columns * root[:, None], root, rcond=None)[0]
        down = horner(np.append(1.0, coefficients[shape.numerator :]), u)
        error = np.abs((columns @ coefficients - 1) / down)
        if not ((down > 0).all() and np.isfinite(error).all()):
            break
        if np.max(error) < smallest:
            best, smallest = coefficients, np.max(error)
        mean = np.sqrt(weight @ error**2)
        if mean > bound and (step >= _SETTLED or not shape.denominator):
            return None
        if not weight @ error > 0:
            break
        weight = weight * error / (weight @ error)
    return best
