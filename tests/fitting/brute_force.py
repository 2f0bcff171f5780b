"""A minimizer on another principle: textbook forms, a dense trapezoid rule, a dense scan.

The minimum is where the squared distances at p(1+h) and p(1−h) are equal, which needs no
derivative. Normalizing constants come from the same trapezoid rule, not from closed forms.
"""

from itertools import pairwise

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq, minimize_scalar

FORMS = {
    "beckmann": lambda at, m: np.exp(at.tan2 / -(m**2)) / at.cos4,
    "gauss": lambda at, m: np.exp(at.beta2 / -(m**2)),
    "ggx": lambda at, a: (a**2 / (a**2 + (1 - a**2) * at.sin2)) ** 2,
    "blinn-phong": lambda at, n: np.exp(n * at.log_cos),
    "sawicki": lambda at, n: 256 * at.cos / (4 + (n - 1) * at.versine) ** 4,
    "schlick": lambda at, m: schlick(at.cos, m),
    "smoothie": lambda at, a: (a**2 / (a**2 + 4 * at.sin2)) ** 2,
}
HORIZON = np.pi / 2 * (1 - 1e-15)
COARSE, FINE = 300, 600
STEP = 1e-5
# The sRGB curve has a corner at the end of its straight piece, and one where it is clipped.
STRAIGHT, WHITE = 0.0031308, 1.0
# What is compared of the light, of metrics that compare that.
ENCODINGS = {
    "energy": lambda light: light,
    "display": lambda light: srgb(light),
    "cube-root": np.cbrt,
}
METRICS = {"unit", "environment", *ENCODINGS}


def schlick(c, m):
    x = np.maximum(c + (m - 1), 0)
    bottom = np.where(x > 0, c * ((m - 1) * x**2 + m**2) ** 2, 1)
    return m**5 * x / bottom


def srgb(x):
    x = np.minimum(x, WHITE)
    return np.where(x <= STRAIGHT, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)


class Angles:
    """Angles β and what the forms take of them."""

    def __init__(self, beta):
        self.beta, self.beta2 = beta, beta**2
        self.cos, self.sin2 = np.cos(beta), np.sin(beta) ** 2
        self.versine = 2 * np.sin(beta / 2) ** 2
        self.tan2, self.cos4 = self.sin2 / self.cos**2, self.cos**4
        self.log_cos = np.log(self.cos)


class Grid(Angles):
    """A trapezoid rule in s on each piece between corners of the integrand.

    On a piece from a, β = a + w (e^u − 1), u = U (1 − (1−z)³), z = s³ (10 − 15 s + 6 s²): fine at
    the lobe, and at the horizon, where small powers of cos β are steep. At both ends the weights
    vanish with their slopes, so that few points give many digits.
    """

    def __init__(self, width, count, corners):
        s = np.linspace(0, 1, count)
        z = s**3 * (10 - 15 * s + 6 * s**2)
        slope = 30 * (s * (1 - s)) ** 2 * s[1]
        beta, weight = [], []
        for start, end in pairwise(np.unique([0, *corners, HORIZON])):
            top = np.log1p((end - start) / width)
            piece = width * np.expm1(top * (1 - (1 - z) ** 3))
            beta.append(np.minimum(start + piece, end))
            weight.append((piece + width) * 3 * top * (1 - z) ** 2 * slope)
        super().__init__(np.concatenate(beta))
        self.weight = np.concatenate(weight)
        sine = np.sin(2 * self.beta)
        self.energy = self.weight * np.pi * sine
        self.environment = self.weight * 4 / np.maximum(sine, 1e-300)
        self.points = np.arange(sine.size)

    def share(self, form):
        """Return the part of a form's energy below each angle."""
        # The steps vanish where two pieces meet: the spline runs on through the corners.
        below = CubicSpline(self.points, self.energy * form, axis=-1).antiderivative()(self.points)
        return below / below[..., -1:]


class Lobe:
    """A distribution with a parameter, or with a column of parameters."""

    def __init__(self, name, parameter):
        self.name, self.parameter = name, parameter

    def form(self, angles):
        return FORMS[self.name](angles, self.parameter)

    def corners(self):
        """Return the angles at which the form bends."""
        return [np.arccos(max(1 - self.parameter, 0))] if self.name == "schlick" else []

    def highest(self, grid):
        """Return the form's maximum, refined between points if it is not at an end."""
        form = self.form(grid)
        top = np.argmax(form)
        if top in (0, len(form) - 1):
            return form[top]
        return -minimize_scalar(
            lambda beta: -self.form(Angles(beta)),
            bounds=(grid.beta[top - 1], grid.beta[top + 1]),
            method="bounded",
            options={"xatol": 1e-8},
        ).fun

    def crossings(self, level, grid):
        """Return the angles at which the form passes a level."""
        for cell in np.flatnonzero(np.diff(self.form(grid) > level)):
            around = Angles(np.linspace(grid.beta[cell], grid.beta[cell + 1], 50))
            form = self.form(around)
            order = np.argsort(form)
            yield np.interp(level, form[order], around.beta[order])


class Problem:
    def __init__(self, metric, source, parameter, target, width):
        if metric not in METRICS:
            raise LookupError(
                f"no oracle for the metric {metric}: add it to ENCODINGS, or to `signal` and "
                "`weight`, in tests/fitting/brute_force.py"
            )
        self.metric, self.source, self.target = metric, Lobe(source, parameter), target
        self.width = 0.05 * width
        # Only Schlick's corner and the screen's make a grid depend on the target.
        self.fixed = Grid(self.width, FINE, self.source.corners())
        form = self.source.form(self.fixed)
        self.white = self.source.highest(self.fixed) / np.sum(self.fixed.energy * form)

    def distances(self, parameters):
        """Return the distances from the source to many targets, on a coarse grid."""
        grid = Grid(self.width, COARSE, self.source.corners())
        source, targets = (
            self.signal(form, form.max(axis=-1, keepdims=True), grid)
            for form in (self.source.form(grid), Lobe(self.target, parameters[:, None]).form(grid))
        )
        return (targets - source) ** 2 @ self.weight(grid)

    def distance(self, parameter):
        """Return the distance from the source to one target, on a fine grid with their corners."""
        lobes = Lobe(self.target, parameter), self.source
        grid = self.grid(lobes)
        target, source = (self.signal(lobe.form(grid), lobe.highest(grid), grid) for lobe in lobes)
        return np.sum(self.weight(grid) * (target - source) ** 2)

    def imbalance(self, log_parameter):
        """Return the distance at p(1+h) less that at p(1−h), without cancellation."""
        above, below = (Lobe(self.target, np.exp(log_parameter + step)) for step in (STEP, -STEP))
        lobes = above, below, self.source
        grid = self.grid(lobes)
        above, below, source = (
            self.signal(lobe.form(grid), lobe.highest(grid), grid) for lobe in lobes
        )
        return np.sum(self.weight(grid) * (above - below) * (above + below - 2 * source))

    def errors(self, parameter):
        """Return the relative root mean square and maximum error of a target."""
        lobes = Lobe(self.target, parameter), self.source
        grid = self.grid(lobes)
        target, source = (self.signal(lobe.form(grid), lobe.highest(grid), grid) for lobe in lobes)
        # A uniform lobe leaves no contrast.
        signal = source - grid.sin2 if self.metric == "environment" else source
        squares = [np.sum(self.weight(grid) * part**2) for part in (target - source, signal)]
        return np.sqrt(squares[0] / squares[1]), np.abs(target - source).max() / signal.max()

    def signal(self, form, highest, grid):
        if self.metric == "unit":
            return form / highest
        if self.metric == "environment":
            return grid.share(form)
        light = form / (self.white * np.sum(grid.energy * form, axis=-1, keepdims=True))
        return ENCODINGS[self.metric](light)

    def weight(self, grid):
        return {"unit": grid.weight, "environment": grid.environment}.get(self.metric, grid.energy)

    def grid(self, lobes):
        """Return a fine grid with a piece between any two corners of the lobes' signals."""
        corners = [corner for lobe in lobes for corner in lobe.corners()]
        grid = Grid(self.width, FINE, corners) if self.target == "schlick" else self.fixed
        if self.metric != "display":
            return grid
        for lobe in lobes:
            white = self.white * np.sum(grid.energy * lobe.form(grid))
            for level in (STRAIGHT, WHITE):
                corners += lobe.crossings(level * white, grid)
        return Grid(self.width, FINE, corners)


def minimum(metric, source, parameter, target, width, candidates):
    """Return the global minimum among candidates, refined; NaN if it is the lowest candidate."""
    problem = Problem(metric, source, parameter, target, width)
    # The edge of a lobe is steep under a root, and moves with the candidate: each has its own grid.
    steep = metric in ENCODINGS and ENCODINGS[metric](np.array(1e-12)) > 1e-6
    scanned = list(map(problem.distance, candidates)) if steep else problem.distances(candidates)
    lowest = int(np.argmin(scanned))
    if lowest == 0:
        return np.nan
    assert lowest < len(candidates) - 1, "the scan must hold the minimum inside"
    ends = np.log([candidates[lowest - 1], candidates[lowest + 1]])
    return np.exp(brentq(problem.imbalance, *ends, xtol=2e-9, rtol=1e-13))
