"""Make the stored polynomials of the method "fast" from the fit: run as a script.

    python -m tests.generate_fast [FILE]

Takes some minutes; the same fit gives the same file.
"""

import itertools
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
from numpy.polynomial import chebyshev

import mdfconv
from mdfconv.distributions import one_parameter_distributions
from mdfconv.distributions.equivalence import exact_route, to_root
from mdfconv.fitting import maps
from mdfconv.fitting.fit import cold_fit
from mdfconv.fitting.metrics import list_metrics, metric_named

# A distribution that is another one in another parameter is a target of its own: near a uniform
# lobe its parameter resolves more.
TARGETS = [entry.name for entry in one_parameter_distributions() if entry.map_variables]
SOURCES = [name for name in TARGETS if name != "smoothie"]
# Lobes that become uniform at x = 1, and those that can become so with relative precision.
UNIFORM_SOURCES, UNIFORM_TARGETS = ("ggx", "schlick"), ("gauss", "ggx", "blinn-phong", "smoothie")
# A tenth or less of what the method promises.
TOLERANCE = {"unit": 5e-8, "energy": 5e-8, "display": 2e-5, "environment": 5e-8}
# The roughest source of each kind; towards a uniform lobe both ends are singular.
ROUGHEST = {"blinn-phong": 0.1, "sawicki": 0.1, "schlick": 1 - 1e-6}
# What stays short of uniform has no such end.
BOUNDED = ("beckmann",)
LEAST_TARGET = {"sawicki": 0.01}
NODES = 32
MOST_TERMS = 25
NARROWEST = 1e-7
BISECTIONS = 44


class Pair:
    """One map in the making: the fit as a function of x."""

    def __init__(self, source, target, metric_name):
        self.names = source, target
        self.source, self.target = mdfconv.distribution(source), mdfconv.distribution(target)
        self.metric = metric_named(metric_name)
        self.variables = self.source.map_variables, self.target.map_variables
        self.factored = source in UNIFORM_SOURCES and target in UNIFORM_TARGETS
        self.tolerance = TOLERANCE[metric_name]

    def parameter(self, x):
        """Return the source's parameter for x."""
        return self.variables[0].from_width(np.atleast_1d(x))

    def answer(self, x):
        """Return the fit's parameter, NaN where there is none that is usable."""
        got = cold_fit(self.source, self.parameter(x), self.target, self.metric).parameter
        with np.errstate(invalid="ignore"):
            return np.where(got >= LEAST_TARGET.get(self.names[1], 0), got, np.nan)

    def limited(self, x):
        """Return where the fit lies at the end of the target's legal range."""
        return cold_fit(self.source, self.parameter(x), self.target, self.metric).at_limit

    def stored(self, x, answer):
        """Return the function that is to be stored."""
        product = x * x * self.variables[1].concentration(answer)
        return product / ((1 - x) * (1 + x)) if self.factored else product

    def from_stored(self, x, value):
        """Return the parameter for the stored function."""
        product = value * (1 - x) * (1 + x) if self.factored else value
        return self.variables[1].from_map(x, product)


def boundary(inside, low, high):
    """Return where a condition that holds at `low` and not at `high` ends."""
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if inside(middle) else (low, middle)
    return low


def outline(pair):
    """Return the end of the range and the x at which the fit is known not to be smooth."""
    source, target = pair.names
    roughest = 1.0 if target in BOUNDED and source == "schlick" else ROUGHEST.get(source, 1.0)
    end = float(pair.variables[0].width(np.float64(roughest)))
    if pair.factored and source == "ggx":
        end = 1 - 1e-9
    grid = end * np.linspace(0, 1, 129)[1:]
    answers, limited = pair.answer(grid), pair.limited(grid)
    if np.isnan(answers).any():
        first = int(np.argmax(np.isnan(answers)))
        end = boundary(lambda x: np.isfinite(pair.answer(x)[0]), grid[first - 1], grid[first])
        end *= 1 - 1e-9
    breaks = []
    if limited.any():
        first = int(np.argmax(limited))
        breaks.append(boundary(lambda x: not pair.limited(x)[0], grid[first - 1], grid[first]))
    # From 1/√2 on Beckmann's maximum is off the normal.
    off_axis = np.sqrt(0.5)
    if source == "beckmann":
        breaks.append(off_axis)
    if target == "beckmann" and np.nanmax(answers) > off_axis:
        first = int(np.argmax(answers > off_axis))
        breaks.append(
            boundary(lambda x: pair.answer(x)[0] < off_axis, *grid[first - 1 : first + 1])
        )
    return end, sorted(x for x in breaks if x < end)


def polynomial(pair, low, high):
    """Return the shortest polynomial on a piece within the tolerance, and its error."""
    z = np.cos(np.pi * (np.arange(NODES) + 0.5) / NODES)
    x = 0.5 * (low + high) + 0.5 * (high - low) * z
    series = chebyshev.chebfit(z, pair.stored(x, pair.answer(x)), NODES - 1)
    # The upper end, where a target may run out, is the hardest place; the lower may be 0.
    z = np.linspace(-1, 1, 38)[1:]
    x = 0.5 * (low + high) + 0.5 * (high - low) * z
    wanted = pair.answer(x)
    worst = np.inf
    for terms in range(1, MOST_TERMS + 1):
        power = chebyshev.cheb2poly(series[:terms])
        got = pair.from_stored(x, np.polynomial.polynomial.polyval(z, power))
        worst = np.max(np.abs(got / wanted - 1))
        if worst < pair.tolerance:
            return power, worst
    return power, worst


def bend(pair, low, high):
    """Return where the fit jumps or bends in a piece, None if it is smooth."""
    # At 0 there is no surface.
    start = low, high = max(low, 1e-9), high
    for _ in range(20):
        x = np.linspace(low, high, 9)
        second = np.abs(np.diff(pair.stored(x, pair.answer(x)), 2))
        peak = int(np.argmax(second))
        if second[peak] < 8 * np.median(second):
            return None
        low, high = x[peak], x[peak + 2]
    return None if low == start[0] or high == start[1] else 0.5 * (low + high)


def pieces(pair, low, high, depth=0):
    """Yield the pieces between two x: (low, high, polynomial, error)."""
    power, worst = polynomial(pair, low, high)
    if worst < pair.tolerance or high - low < NARROWEST:
        yield low, high, power, worst
        return
    middle = bend(pair, low, high) if depth == 2 or depth == 5 else None
    middle = 0.5 * (low + high) if middle is None else middle
    yield from pieces(pair, low, middle, depth + 1)
    yield from pieces(pair, middle, high, depth + 1)


def make(key):
    """Return one map and what there is to say of it."""
    name, source, target = key.split()
    pair = Pair(source, target, name)
    end, breaks = outline(pair)
    ends = [0.0, *breaks, end]
    found = [piece for low, high in itertools.pairwise(ends) for piece in pieces(pair, low, high)]
    if (source, target) == ("schlick", "ggx"):
        # α is 1 here within the tolerance, whatever the little that is stored.
        found.append((end, 1.0, pair.stored(end, pair.answer(end)), 0.0))
        end = 1.0
    last = 1.0 if pair.factored and source == "ggx" else end
    edges = np.array([low for low, *_ in found] + [last])
    powers = tuple(power for _, _, power, _ in found)
    entry = maps.Map(edges, powers, pair.factored)
    worst = max(piece[-1] for piece in found)
    sizes = [power.size for _, _, power, _ in found]
    return key, entry, f"to x = {end:.6f}, worst {worst:.1e}, terms {sizes}"


def needs_map(metric_name, source, target):
    """Return whether a pair converts neither exactly nor by a constant."""
    if exact_route(source, target) is not None:
        return False
    roots = [to_root(end, same_lobe=True)[0] for end in (source, target)]
    return metric_named(metric_name).ratio(*roots) is None


def main(path=maps.FILE):
    """Write the data file."""
    keys = [
        f"{name} {source} {target}"
        for name in list_metrics()
        for source, target in itertools.product(SOURCES, TARGETS)
        if needs_map(name, mdfconv.distribution(source), mdfconv.distribution(target))
    ]
    made = {}
    with ProcessPoolExecutor() as pool:
        for key, entry, summary in pool.map(make, keys):
            made[key] = entry
            print(f"{key}: {summary}", flush=True)
    Path(path).parent.mkdir(exist_ok=True)
    np.savez_compressed(path, **maps.pack(made))
    print(f"{path}: {Path(path).stat().st_size} bytes")


if __name__ == "__main__":
    main(*sys.argv[1:])
