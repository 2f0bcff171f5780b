"""Best fits to 25 digits, for the reference values of `mdfconv stability`.

Where the squared distances at p(1+h) and p(1−h) are equal lies the minimum; with h = 1e-14 and
60 digits that is exact to 1e-25 and needs no derivative. The neighbourhood of the global minimum
comes from the brute-force minimizer of the tests.
"""

import functools
import itertools
from concurrent.futures import ProcessPoolExecutor

import mpmath as mp
import numpy as np

from tests import oracles
from tests.fitting import brute_force

METRICS = ("unit", "energy")
PAIRS = [
    ("beckmann", "ggx"),
    ("beckmann", "gauss"),
    ("ggx", "beckmann"),
    ("ggx", "blinn-phong"),
    ("blinn-phong", "ggx"),
    ("blinn-phong", "sawicki"),
]
ALPHAS, EXPONENTS = [1e-4, 0.02, 0.1, 0.3], [1e8, 5000, 200, 20]
STEP = mp.mpf("1e-14")
ORDER, HIGHER_ORDER = 32, 44
AGREEMENT = mp.mpf("1e-24")
_GROWTH = 1.6


def rows():
    """Yield a row for every pair and value: the best parameters under each metric."""
    cases = [
        (source, target, value)
        for source, target in PAIRS
        for value in (EXPONENTS if oracles.is_exponent(source) else ALPHAS)
    ]
    with ProcessPoolExecutor() as pool:
        yield from pool.map(row, *zip(*cases, strict=True))


def row(source, target, value):
    """Return the row of a pair and a value."""
    single = np.float32(value)
    results = {metric: best(metric, source, target, float(single)) for metric in METRICS}
    return {
        "source": source,
        "target": target,
        "regime": "mirror-smooth" if value in (ALPHAS[0], EXPONENTS[0]) else "usual",
        "value": str(single).removesuffix(".0"),
    } | {metric: mp.nstr(result, 20) for metric, result in results.items()}


def best(metric, source, target, value):
    """Return the best parameter; raise if a finer rule moves it."""
    width = float(oracles.half_width(source, value))
    guess = float(oracles.from_half_width(target, mp.mpf(width)))
    candidates = guess * np.geomspace(0.2, 5, 30)
    if oracles.is_exponent(target):
        candidates = guess * np.geomspace(5, 0.04, 30)
    start = mp.mpf(brute_force.minimum(metric, source, value, target, width, candidates))
    imbalance = functools.partial(_imbalance, metric, source, value, target)
    x0, x1 = mp.log(start), mp.log(start) + mp.mpf("1e-8")
    root = mp.findroot(lambda x: imbalance(x, ORDER, width), (x0, x1), tol=mp.mpf("1e-60"))
    slope = (imbalance(x1, ORDER, width) - imbalance(x0, ORDER, width)) / (x1 - x0)
    shift = imbalance(root, HIGHER_ORDER, width) / slope
    assert slope > 0, "a maximum"
    assert abs(shift) < AGREEMENT, shift
    return mp.exp(root)


def _imbalance(metric, source, value, target, log_parameter, order, width):
    """Return the distance at p(1+h) less that at p(1−h), over 2h."""
    scaled = [mp.exp(log_parameter + sign * STEP) for sign in (1, -1)]
    heights = [_height(metric, target, p) for p in scaled]
    height = _height(metric, source, value)
    total = mp.mpf(0)
    for beta, weight in _nodes(order, width):
        above, below = (
            h * oracles.ratio_mp(target, beta, p, 2) for h, p in zip(heights, scaled, strict=True)
        )
        wanted = height * oracles.ratio_mp(source, beta, value, 2)
        if metric == "energy":
            weight = weight * mp.sin(2 * beta)
        total += weight * (above - below) * (above + below - 2 * wanted)
    return total / (2 * STEP * height**2)


def _height(metric, name, parameter):
    return oracles.at_normal(name, parameter) if metric == "energy" else mp.mpf(1)


@functools.cache
def _nodes(order, width):
    """Return angles and weights on panels that grow from the lobe and shrink to the horizon."""
    edges = [mp.mpf(0), mp.mpf(width) / 20]
    while edges[-1] * _GROWTH < 1:
        edges.append(edges[-1] * _GROWTH)
    edges += [oracles.HALF_PI * (1 - mp.mpf(2) ** -k) for k in range(2, 9)] + [oracles.HALF_PI]
    edges = sorted(edges)
    nodes = []
    for low, high in itertools.pairwise(edges):
        half, middle = (high - low) / 2, (high + low) / 2
        nodes += [(middle + half * x, half * w) for x, w in _legendre(order)]
    return nodes


@functools.cache
def _legendre(order):
    """Return the Gauss-Legendre rule on [−1, 1], Newton steps from NumPy's nodes."""
    rule = []
    for start in np.polynomial.legendre.leggauss(order)[0]:
        x = mp.mpf(start)
        for _ in range(4):
            before, value = mp.legendre(order - 1, x), mp.legendre(order, x)
            slope = order * (x * value - before) / (x * x - 1)
            x -= value / slope
        rule.append((x, 2 / ((1 - x * x) * slope**2)))
    return rule
