"""Times of the fits: run as a script.

Prints the 17 × 4 table against a loop of scipy.optimize.curve_fit on the same samples, and the
reading and fitting of one MERL-sized file, imports excluded.
"""

import statistics
import tempfile
import time
from pathlib import Path

import numpy as np
from scipy.optimize import curve_fit

import mdfconv
from mdfconv.fitting.metrics.base import Unit
from mdfconv.fitting.quadrature import UniformSamples
from mdfconv.fitting.solve import fit
from mdfconv.measured.brdf_fit import fit_distribution
from mdfconv.measured.readers import read
from mdfconv.studies.table2 import FITTED, SAMPLES, paper_sweep

REPEATS = 15


def batched(m_b, limit):
    """Fit the four columns as the package does."""
    samples = UniformSamples(limit, SAMPLES)
    source = mdfconv.distribution("beckmann")
    for name in FITTED.values():
        fit(source, m_b, mdfconv.distribution(name), Unit(), samples)


def looped(m_b, limit):
    """Fit the 68 cells one by one, from the start that equation (11) suggests."""
    source = mdfconv.distribution("beckmann")
    for target in map(mdfconv.distribution, FITTED.values()):
        for m, end in zip(m_b, limit, strict=True):
            beta = np.linspace(0, end, SAMPLES)
            start = 2 / m**2 if target.parameter.larger_is_smoother else m
            with np.errstate(all="ignore"):
                curve_fit(target.printed.unit, beta, source.printed.unit(beta, m), p0=[start])


def merl(path):
    """Write a file of the database's size."""
    theta = (np.arange(90) / 90) ** 2 * np.pi / 2
    lobe = mdfconv.distribution("ggx").unit(theta, 0.2) / np.cos(theta) ** 2
    planes = np.ones((3, 90, 90, 180)) * (1 + 20 * lobe)[:, None, None]
    with path.open("wb") as file:
        np.array([90, 90, 180], "<i4").tofile(file)
        planes.tofile(file)


def read_and_fit(path):
    """Read the file and fit every distribution."""
    data = read(path)
    return [fit_distribution(data, entry) for entry in mdfconv.list_distributions()]


def seconds(function, *arguments):
    """Return the time of one call."""
    start = time.perf_counter()
    function(*arguments)
    return time.perf_counter() - start


def main():
    """Print the figures."""
    sweep = paper_sweep()
    batched(*sweep)
    looped(*sweep)
    times = [(seconds(batched, *sweep), seconds(looped, *sweep)) for _ in range(REPEATS)]
    ours, theirs = (1e3 * statistics.median(column) for column in zip(*times, strict=True))
    print(f"table 17 × 4: {ours:.1f} ms, curve_fit loop {theirs:.1f} ms, ratio {theirs / ours:.2f}")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "test.binary"
        merl(path)
        read_and_fit(path)
        once = statistics.median(seconds(read_and_fit, path) for _ in range(5))
    print(f"MERL file read and fitted to all: {once:.2f} s")


if __name__ == "__main__":
    main()
