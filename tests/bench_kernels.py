"""Times of the kernels against their textbook NumPy expressions: run as a script.

Prints, for 4 million angles, medians of interleaved repeats in milliseconds, the ratio, and the
peak of newly allocated memory over the size of the result.
"""

import statistics
import time
import tracemalloc

import numpy as np

import mdfconv

REPEATS = 11


def textbook(beta, m, n):
    """Return the printed expressions, written as one would in NumPy."""
    cos, sin = np.cos, np.sin

    def schlick():
        c = cos(beta)
        x = c + m - 1
        return m**5 * x / (c * (m * x**2 - x**2 + m**2) ** 2)

    return {
        "beckmann": lambda: np.exp(-(np.tan(beta) ** 2) / m**2) / cos(beta) ** 4,
        "gauss": lambda: np.exp(-(beta**2) / m**2),
        "ggx": lambda: (m**2 / (m**2 + (1 - m**2) * sin(beta) ** 2)) ** 2,
        "gtr": lambda: (m**2 / (m**2 + (1 - m**2) * sin(beta) ** 2)) ** 2,
        "blinn-phong": lambda: cos(beta) ** n,
        "schlick": schlick,
        "sawicki": lambda: 256 * cos(beta) / ((1 - n) * cos(beta) + n + 3) ** 4,
        "smoothie": lambda: (m**2 / (m**2 + 4 * sin(beta) ** 2)) ** 2,
    }


def medians(functions):
    """Return the median time of each function in ms, repeats interleaved."""
    times = {name: [] for name in functions}
    for repeat in range(REPEATS + 1):
        for name, function in functions.items():
            start = time.perf_counter()
            function()
            if repeat:
                times[name].append(time.perf_counter() - start)
    return {name: 1e3 * statistics.median(values) for name, values in times.items()}


def main():
    """Print the table."""
    print("dtype    distribution  mdfconv ms  textbook ms  ratio  memory")
    for dtype in (np.float64, np.float32):
        beta = np.linspace(0, np.pi / 2, 4_000_000, dtype=dtype)
        m, n = dtype(0.2), dtype(50)
        for name, plain in textbook(beta, m, n).items():
            entry = mdfconv.distribution(name)
            parameter = n if name in ("blinn-phong", "sawicki") else m

            def ours(entry=entry, beta=beta, parameter=parameter):
                return entry.unit(beta, parameter)

            times = medians({"ours": ours, "plain": plain})
            tracemalloc.start()
            ours()
            peak = tracemalloc.get_traced_memory()[1] / beta.nbytes
            tracemalloc.stop()
            print(
                f"{dtype.__name__}  {name:12}  {times['ours']:10.1f}  {times['plain']:11.1f}"
                f"  {times['plain'] / times['ours']:5.2f}  {peak:6.3f}"
            )


if __name__ == "__main__":
    main()
