"""The search for the cheapest formula that is accurate enough."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from mdfconv.conversion.endpoint import Endpoint
from mdfconv.distributions.evaluation import Array
from mdfconv.errors import MdfconvError
from mdfconv.fitting.metrics import Metric
from mdfconv.formula.family import Formula, Shape, evaluate, horner, power, shapes

# Fits over the range; between them a spline is far below the rounding of float32.
_FITS = 160
_CHECKS = 4096
_REWEIGHTINGS = 40
# Steps after which a denominator has settled.
_SETTLED = 5
# The error of a power is that of its base times the exponent, but for terms of higher order.
_SLACK = 1.1
_GAIN = 0.9
_SPLINE_DEGREE = 5
_GLOSSINESS = "glossiness"
_USUAL = {
    "alpha": (0.01, 0.8),
    "width": (0.01, 0.8),
    "roughness": (0.1, 0.9),
    _GLOSSINESS: (0.1, 0.9),
    "exponent": (1.0, 1e4),
    "exponents": (1.0, 1e4),
}


@dataclass(frozen=True)
class Problem:
    """What a formula is to compute: the fit of a pair over a range.

    Parameters
    ----------
    source, target : Endpoint
        Distributions, with the encodings in which their parameters are stored.
    metric : Metric
        The metric of the fit.
    low, high : float
        The range of the source's stored value.

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
        if not self.low < self.high:
            raise MdfconvError(f"the range {self.low:g}:{self.high:g} is empty: LO < HI")
        if self.source.distribution.name == self.target.distribution.name:
            raise MdfconvError("a formula needs two distributions; an encoding has its own")

    @cached_property
    def samples(self) -> tuple[Array, Array]:
        """Return w and t of the fits, at points that crowd towards the ends of the range."""
        from mdfconv.fitting.core import fit

        ends = np.log(natural(self.source, np.array([self.low, self.high])))
        turn = np.cos(np.pi * np.arange(_FITS) / (_FITS - 1))
        w = np.exp(ends.mean() + 0.5 * (ends[1] - ends[0]) * turn[::-1])
        w[[0, -1]] = np.exp(ends)
        given = self.source.decode(np.clip(natural(self.source, w), self.low, self.high))
        pair = self.source.distribution, self.target.distribution
        answer = fit(pair[0], given, pair[1], self.metric).parameter
        stored = natural(self.target, self.target.encode(answer))
        if not np.isfinite(stored).all():
            missing = natural(self.source, w[~np.isfinite(stored)])
            raise MdfconvError(
                f"the fit has no answer in {self.target.label} for {self.source.label} from "
                f"{missing.min():.6g} to {missing.max():.6g}: narrow the range"
            )
        return w, stored

    @cached_property
    def checks(self) -> tuple[Array, Array]:
        """Return w in float32 and t of the fit there, densely over the range."""
        from scipy.interpolate import make_interp_spline

        w, t = self.samples
        order = np.argsort(w)
        spline = make_interp_spline(np.log(w[order]), np.log(t[order]), _SPLINE_DEGREE)
        dense = np.geomspace(w.min(), w.max(), _CHECKS).astype(np.float32)
        return dense, np.exp(spline(np.log(dense.astype(float))))


def usual_range(side: Endpoint) -> tuple[float, float]:
    """Return the range of stored values that scenes use and that every pair can answer."""
    return _USUAL[side.stored.name]


def is_glossy(side: Endpoint) -> bool:
    """Return whether a side stores a glossiness, for which 1 − it is the natural variable."""
    return side.encoding is not None and side.encoding.name == _GLOSSINESS


def natural(side: Endpoint, stored: Array) -> Array:
    """Return w for stored values, or stored values for w: the rule is its own inverse."""
    return 1 - stored if is_glossy(side) else stored


def cheapest(problem: Problem, tolerance: float) -> Formula:
    """Return the cheapest formula whose worst relative error is at most the tolerance.

    Parameters
    ----------
    problem : Problem
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
    best: Formula | None = None
    for shape in shapes():
        if best is not None and shape.operations > best.shape.operations:
            return best
        found = _best(problem, shape, tolerance if best is None else best.error)
        if found is not None and found.error <= tolerance:
            best = found
    if best is None:
        last = pareto_front(problem)[-1]
        raise MdfconvError(
            f"no formula is within {tolerance:g} in float32; the most accurate reaches "
            f"{last.error:.2g} with {last.shape.operations} operations"
        )
    return best


def pareto_front(problem: Problem) -> list[Formula]:
    """Return the formulas that nothing as cheap beats, each a tenth better than the one before."""
    front: list[Formula] = []
    for shape in shapes():
        same_price = bool(front) and front[-1].shape.operations == shape.operations
        best = front[-1].error * (1 if same_price else _GAIN) if front else np.inf
        found = _best(problem, shape, best)
        if found is not None and found.error < best:
            front[len(front) - same_price :] = [found]
    return front


def _best(problem: Problem, shape: Shape, bound: float) -> Formula | None:
    """Return the formula of a shape with nearly the smallest worst error.

    None if the shape does not apply, or cannot stay below the bound.
    """
    w, t = problem.samples
    with np.errstate(all="ignore"):
        wanted = power(t, 1 / shape.outer) / power(w, shape.factor)
        u = power(w, shape.variable)
        scale = np.max(np.abs(u))
        found = _minimax(u / scale, wanted, shape, _SLACK * bound / abs(shape.outer))
    if found is None:
        return None
    up, down = found[: shape.numerator], found[shape.numerator :]
    formula = Formula(
        shape,
        _single(up * scale ** -np.arange(up.size)),
        _single(down * scale ** -np.arange(1.0, down.size + 1)),
    )
    dense, exact = problem.checks
    error = float(np.max(np.abs(evaluate(formula, dense) / exact - 1)))
    return replace(formula, error=error) if error < bound or error == bound else None


def _single(values: Array) -> tuple[float, ...]:
    with np.errstate(all="ignore"):
        return tuple(values.astype(np.float32).astype(float).tolist())


def _minimax(u: Array, wanted: Array, shape: Shape, bound: float) -> Array | None:
    """Return coefficients of P and Q that make the worst relative error nearly smallest.

    Least squares, reweighted by its own errors (Lawson 1961) and, for a rational function, by
    its own denominator (Sanathanan & Koerner 1963). The weighted mean of the squared errors
    never exceeds the smallest worst one: None as soon as it is beyond the bound.
    """
    powers = u[:, None] ** np.arange(max(shape.numerator, shape.denominator + 1))
    up = powers[:, : shape.numerator] / wanted[:, None]
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
        found = np.linalg.lstsq(columns * root[:, None], root, rcond=None)[0]
        down = horner((1.0, *found[shape.numerator :].tolist()), u)
        error = np.abs((columns @ found - 1) / down)
        if not ((down > 0).all() and np.isfinite(error).all()):
            break
        if np.max(error) < smallest:
            best, smallest = found, np.max(error)
        mean = np.sqrt(weight @ error**2)
        if mean > bound and (step >= _SETTLED or not shape.denominator):
            return None
        if not weight @ error > 0:
            break
        weight = weight * error / (weight @ error)
    return best
