"""Make the stored polynomials of the method "fast" from the fit: run as a script.

    python -m tests.generate_fast [FILE]

Takes some minutes; the same fit gives the same file, and what is stored starts none of them.
"""

import itertools
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np

import mdfconv
from mdfconv.distributions import one_parameter_distributions
from mdfconv.distributions.endpoint import exact_route, to_root
from mdfconv.fitting import maps
from mdfconv.fitting.maps import MapMaker, Piece
from mdfconv.fitting.metrics import list_metrics, metric_named
from mdfconv.fitting.problem import ConversionTask
from mdfconv.fitting.solve import FitCurve, cold_fit

# A distribution that is another one in another parameter is a target of its own: near a uniform
# lobe its parameter resolves more.
TARGETS = [entry.name for entry in one_parameter_distributions() if entry.map_variables]
SOURCES = [name for name in TARGETS if name != "smoothie"]
# Lobes that become uniform at x = 1, and those that can become so with relative precision.
UNIFORM_SOURCES, UNIFORM_TARGETS = ("ggx", "schlick"), ("gauss", "ggx", "blinn-phong", "smoothie")
# A tenth or less of what the method promises.
TOLERANCE = {"unit": 5e-8, "energy": 5e-8, "display": 1e-6, "environment": 5e-8}
# The roughest source of each kind; towards a uniform lobe both ends are singular.
ROUGHEST = {"blinn-phong": 0.1, "sawicki": 0.1, "schlick": 1 - 1e-6}
# What stays short of uniform has no such end.
BOUNDED = ("beckmann",)
LEAST_TARGET = {"sawicki": 0.01}
# Fits between so many x start from those there.
GRID = 129
# A jump of the fit stays within a piece so narrow in x.
NARROWEST = 1e-7
BISECTIONS = 44


class Pair(MapMaker):
    """One map in the making, its fits cold where those of a grid lead nowhere."""

    def __init__(self, source, target, metric_name):
        self.names = source, target
        self.source, self.target = mdfconv.distribution(source), mdfconv.distribution(target)
        self.metric = metric_named(metric_name)
        super().__init__(
            (self.source.map_variables, self.target.map_variables),
            source in UNIFORM_SOURCES and target in UNIFORM_TARGETS,
            self.answer,
            TOLERANCE[metric_name],
            NARROWEST,
        )
        roughest = 1.0 if target in BOUNDED and source == "schlick" else ROUGHEST.get(source, 1.0)
        self.end = float(self.source.map_variables.width(np.float64(roughest)))
        if self.factored and source == "ggx":
            self.end = 1 - 1e-9
        self.grid = self.end * np.linspace(0, 1, GRID)[1:]
        knots = self.source.map_variables.from_width(self.grid)
        self.curve = FitCurve(ConversionTask(self.source, knots, self.target, self.metric))

    def answer(self, parameter):
        """Return the fits' parameters, NaN where there is none that is usable."""
        attempt = self.curve(parameter)
        got, cold = attempt.fits, ~attempt.settled
        if cold.any():
            task = ConversionTask(self.source, parameter[cold], self.target, self.metric)
            fits = cold_fit(task)
            got[cold] = fits.parameter
        with np.errstate(invalid="ignore"):
            return np.where(got >= LEAST_TARGET.get(self.names[1], 0), got, np.nan)

    def limited(self, x):
        """Return where the fit lies at the end of the target's legal range."""
        upper = self.target.parameter.upper
        return (self.fitted(x) == upper) & self.target.parameter.upper_closed


def boundary(inside, low, high):
    """Return where a condition that holds at `low` and not at `high` ends."""
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if inside(np.array([middle]))[0] else (low, middle)
    return low


def outline(pair):
    """Return the end of the range and the x at which the fit is known not to be smooth."""
    source, target = pair.names
    grid, end = pair.grid, pair.end
    answers, limited = pair.fitted(grid), pair.limited(grid)
    if np.isnan(answers).any():
        first = int(np.argmax(np.isnan(answers)))
        end = boundary(lambda x: np.isfinite(pair.fitted(x)), grid[first - 1], grid[first])
        end *= 1 - 1e-9
    breaks = []
    if limited.any():
        first = int(np.argmax(limited))
        breaks.append(boundary(lambda x: ~pair.limited(x), grid[first - 1], grid[first]))
    # From 1/√2 on Beckmann's maximum is off the normal.
    off_axis = np.sqrt(0.5)
    if source == "beckmann":
        breaks.append(off_axis)
    if target == "beckmann" and np.nanmax(answers) > off_axis:
        first = int(np.argmax(answers > off_axis))
        breaks.append(boundary(lambda x: pair.fitted(x) < off_axis, *grid[first - 1 : first + 1]))
    return end, sorted(x for x in breaks if x < end)


def make(key):
    """Return one map and what there is to say of it."""
    name, source, target = key.split()
    pair = Pair(source, target, name)
    end, breaks = outline(pair)
    ends = [0.0, *breaks, end]
    found = [piece for low, high in itertools.pairwise(ends) for piece in pair.pieces(low, high)]
    if (source, target) == ("schlick", "ggx"):
        # α is 1 here within the tolerance, whatever the little that is stored.
        x = np.array([end])
        found.append(Piece(end, 1.0, pair.product(x, pair.fitted(x)), 0.0))
        end = 1.0
    entry = pair.map(found, 1.0 if pair.factored and source == "ggx" else end)
    worst = max(piece.error for piece in found)
    sizes = [piece.coefficients.size for piece in found]
    return key, entry, f"to x = {end:.6f}, worst {worst:.1e}, terms {sizes}"


def needs_map(metric_name, source, target):
    """Return whether a pair converts neither exactly nor by a constant."""
    if exact_route(source, target) is not None:
        return False
    roots = [to_root(end, same_lobe=True)[0] for end in (source, target)]
    return metric_named(metric_name).ratio(*roots) is None


def pack(made):
    """Return maps as the arrays of the data file."""
    pieces = [piece for stored in made.values() for piece in stored.coefficients]
    return {
        "names": np.array(list(made)),
        "factored": np.array([stored.factored for stored in made.values()]),
        "pieces": np.array([len(stored.coefficients) for stored in made.values()]),
        "terms": np.array([piece.size for piece in pieces]),
        "edges": np.concatenate([stored.edges for stored in made.values()]),
        "coefficients": np.concatenate(pieces),
    }


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
    np.savez_compressed(path, **pack(made))
    print(f"{path}: {Path(path).stat().st_size} bytes")


if __name__ == "__main__":
    main(*sys.argv[1:])
