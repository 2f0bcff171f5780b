"""The method "fast" against "fit": run as a script.

    python -m tests.bench_fast [10000] [PROCESSES]

Prints, for every ordered pair and metric, the worst relative difference over random parameters,
and at the end conversions a second on an array of a million, and against fits one by one.
"""

import itertools
import statistics
import sys
import time
import warnings
from concurrent.futures import ProcessPoolExecutor

import numpy as np

import mdfconv
from mdfconv.distributions import distribution, one_parameter_distributions
from mdfconv.fitting.metrics import list_metrics, metric_named
from mdfconv.fitting.solve import fit

NAMES = [entry.name for entry in one_parameter_distributions() if entry.map_variables]
LIMIT = {"unit": 1e-6, "energy": 1e-6, "display": 1e-5, "environment": 1e-6}
MILLION = 1_000_000
REPEATS = 7


def parameters(name, count):
    """Return random parameters: roughness from 1e-4 to 1, half of it uniform, half logarithmic."""
    random = np.random.default_rng(len(name))
    if distribution(name).parameter.larger_is_smoother:
        return 10 ** random.uniform(-1, 6, count)
    half = count // 2
    return np.concatenate([random.uniform(0, 1, half), 10 ** random.uniform(-4, 0, count - half)])


def compare(job):
    """Return the worst relative difference of one pair under one metric, and how many answer."""
    name, source, target, count = job
    values = parameters(source, count)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", mdfconv.MdfconvWarning)
        fast = mdfconv.convert(values, source, target, method="fast", metric=name)
    exact = fit(distribution(source), values, distribution(target), metric_named(name)).parameter
    answered = np.isfinite(fast)
    worst = float(np.max(np.abs(fast[answered] / exact[answered] - 1)))
    return worst, int(answered.sum()), int(np.isfinite(exact).sum())


def seconds(function):
    """Return the median processor time of a function."""
    times = []
    for _ in range(REPEATS):
        start = time.thread_time()
        function()
        times.append(time.thread_time() - start)
    return statistics.median(times)


def speed(name, source, target):
    """Print conversions a second of both methods."""
    values = np.resize(parameters(source, 2000), MILLION)
    exponent = distribution(source).parameter.larger_is_smoother
    values = np.clip(values, 1, None) if exponent else np.clip(values, 1e-3, 0.8)
    fast = MILLION / seconds(lambda: mdfconv.convert(values, source, target, "fast", metric=name))
    few = values[:20].tolist()
    single = len(few) / seconds(
        lambda: [mdfconv.convert(value, source, target, "fit", metric=name) for value in few]
    )
    print(f"{name:8}{source:>12} {target:12}{fast / 1e6:7.1f} M/s {fast / single:10.0f} x fit")


def main(count=10_000, processes=2):
    """Print the tables."""
    pairs = list(itertools.permutations(NAMES, 2))
    jobs = [(name, *pair, int(count)) for name in list_metrics() for pair in pairs]
    with ProcessPoolExecutor(int(processes)) as pool:
        for job, (worst, fast, exact) in zip(jobs, pool.map(compare, jobs), strict=True):
            verdict = "" if worst <= LIMIT[job[0]] else "  BEYOND"
            print(
                f"{job[0]:8}{job[1]:>12} {job[2]:12}{worst:9.1e}{fast:7}{exact:7}{verdict}",
                flush=True,
            )
    for name, pair in itertools.product(list_metrics(), pairs):
        speed(name, *pair)


if __name__ == "__main__":
    main(*sys.argv[1:])
