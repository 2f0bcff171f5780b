"""A minimizer on another principle: textbook forms, a dense trapezoid rule, a dense scan.

The minimum is where the squared distances at p(1+h) and p(1−h) are equal, which needs no
derivative. Normalizing constants come from the same trapezoid rule, not from closed forms.
"""

import numpy as np
from scipy.optimize import brentq

FORMS = {
    "beckmann": lambda b, m: np.exp(-((np.tan(b) / m) ** 2)) / np.cos(b) ** 4,
    "gauss": lambda b, m: np.exp(-((b / m) ** 2)),
    "ggx": lambda b, a: (a**2 / (a**2 + (1 - a**2) * np.sin(b) ** 2)) ** 2,
    "blinn-phong": lambda b, n: np.cos(b) ** n,
    "sawicki": lambda b, n: 256 * np.cos(b) / ((1 - n) * np.cos(b) + n + 3) ** 4,
    "schlick": lambda b, m: schlick(np.cos(b), m),
    "smoothie": lambda b, a: (a**2 / (a**2 + 4 * np.sin(b) ** 2)) ** 2,
}


def schlick(c, m):
    x = np.maximum(c + m - 1, 0)
    bottom = np.where(x > 0, c * (m * x**2 - x**2 + m**2) ** 2, 1)
    return m**5 * x / bottom


def srgb(x):
    x = np.clip(x, 0, 1)
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)


def highest(form):
    """Return the maximum, between samples by a parabola."""
    place = int(np.argmax(form))
    if place in (0, len(form) - 1):
        return form[place]
    before, top, after = form[place - 1 : place + 2]
    return top - (after - before) ** 2 / (8 * (after - 2 * top + before))


class Grid:
    """A trapezoid rule in z with β = w (e^u − 1), u = U (1 − (1−z)³).

    Fine at the lobe, and at the horizon, where small powers of cos β are steep.
    """

    def __init__(self, width, count):
        z = np.linspace(0, 1, count)
        top = np.log1p(np.pi / 2 / width)
        u = top * (1 - (1 - z) ** 3)
        self.beta = np.minimum(width * np.expm1(u), np.pi / 2 * (1 - 1e-15))
        self.weight = (self.beta + width) * 3 * top * (1 - z) ** 2 * z[1]
        self.weight[[0, -1]] *= 0.5


class Problem:
    def __init__(self, metric, source, parameter, target, width, count):
        self.metric, self.target = metric, target
        self.grid = Grid(0.05 * width, count)
        self.energy = self.grid.weight * np.pi * np.sin(2 * self.grid.beta)
        form = FORMS[source](self.grid.beta, parameter)
        if metric == "unit":
            self.weight, self.peak = self.grid.weight, highest(form)
        else:
            self.weight, self.peak = self.energy, highest(form) / np.sum(self.energy * form)
        self.source = self.signal(form)

    def signal(self, form):
        form = form / (highest(form) if self.metric == "unit" else np.sum(self.energy * form))
        if self.metric == "unit":
            return form
        return srgb(form / self.peak) if self.metric == "display" else form / self.peak

    def at(self, parameter):
        return self.signal(FORMS[self.target](self.grid.beta, parameter))

    def distance(self, parameter):
        return np.sum(self.weight * (self.at(parameter) - self.source) ** 2)

    def imbalance(self, log_parameter, step):
        """Return the distance at p(1+h) less that at p(1−h), without cancellation."""
        above, below = (self.at(np.exp(log_parameter + sign * step)) for sign in (1, -1))
        return np.sum(self.weight * (above - below) * (above + below - 2 * self.source))


def minimum(metric, source, parameter, target, width, candidates):
    """Return the global minimum among candidates, refined; NaN if it is the lowest candidate."""
    coarse = Problem(metric, source, parameter, target, width, 1500)
    costs = [coarse.distance(candidate) for candidate in candidates]
    place = int(np.argmin(costs))
    if place == 0:
        return np.nan
    assert place < len(candidates) - 1, "the scan must hold the minimum inside"
    # The trapezoid rule sees the edge of Schlick's support as a kink, which takes more points.
    kinked = "schlick" in (source, target)
    step = 1.5e-4
    count = 150_000 if metric == "display" or width > 0.8 else 50_000
    if kinked:
        count = 350_000 if width > 0.3 else 100_000
    if kinked and width > 0.8:
        count, step = 1_000_000, 2e-5
    fine = Problem(metric, source, parameter, target, width, count)
    ends = np.log([candidates[place - 1], candidates[place + 1]])
    return np.exp(brentq(fine.imbalance, *ends, (step,), xtol=2e-9, rtol=1e-13))
