"""What the measurements say, in sentences computed from them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mdfconv.distributions import distribution
from mdfconv.recommend import PRECISIONS, Substitute
from mdfconv.studies.bench.kernels import KernelSpeed
from mdfconv.studies.bench.measure import Measurements
from mdfconv.studies.bench.methods import COLD, LOOP, MethodSpeed
from mdfconv.studies.bench.pareto import front
from mdfconv.timing import NOISE


def on_substitutes(measurements: Measurements) -> list[str]:
    """Say whether rational forms are the faster ones, and which distributions pay."""
    precisions = PRECISIONS[::-1]
    sentences = [_rational(measurements.substitutes, precision) for precision in precisions]
    for precision in precisions:
        sentences += _without_tangent(measurements.kernels, precision)
    groups: dict[tuple[str, float], list[Substitute]] = {}
    for row in measurements.substitutes:
        groups.setdefault((row.reference, row.reference_parameter), []).append(row)
    return sentences + [_worth_it(rows) for rows in groups.values()]


def _rational(rows: Sequence[Substitute], precision: str) -> str:
    samples: dict[str, list[float]] = {}
    for row in rows:
        samples.setdefault(row.distribution, []).append(row.ns[precision].median)
    times = {name: float(np.median(values)) for name, values in samples.items()}
    rational = [name for name in times if "exp" not in distribution(name).functions]
    others = sorted((name for name in times if name not in rational), key=times.__getitem__)
    start = f"In {precision}, from β,"
    if not rational or not others:
        kind = "rational forms" if rational else "forms with an exponential or a power"
        return f"{start} the {kind} take {_listed(times, list(times))} ns."
    quickest, slowest = others[0], others[-1]
    winners = [name for name in rational if times[name] < (1 - NOISE) * times[quickest]]
    gain = f"speed for {_and(winners)} only" if winners else "no speed"
    comparisons = [_against(times, rational, name) for name in dict.fromkeys((slowest, quickest))]
    return (
        f"{start} the rational forms take {_listed(times, rational)} ns, those with an "
        f"exponential or a power {_listed(times, others)} ns. Of the rational ones "
        f"{'; '.join(comparisons)}. Against {quickest}, the quickest of those, being "
        f"rational buys {'speed' if winners == rational else gain} on this machine."
    )


def _against(times: dict[str, float], rational: Sequence[str], other: str) -> str:
    """Say which rational forms are faster or slower than another form by more than the noise."""
    faster = [name for name in rational if times[name] < (1 - NOISE) * times[other]]
    slower = [name for name in rational if times[name] > (1 + NOISE) * times[other]]
    return f"{_are(faster)} faster than {other}, {_are(slower)} slower"


def _are(names: Sequence[str]) -> str:
    return f"{_and(names) or 'none'} {'are' if len(names) > 1 else 'is'}"


def _without_tangent(rows: Sequence[KernelSpeed], precision: str) -> list[str]:
    """Say what the forms cost a renderer that has cos β; nothing if no tangent is timed."""
    timed = [row for row in rows if row.precision == precision and "tan" in row.functions.split()]
    tangents = [row.floor.median - row.copy.median for row in timed if row.functions == "tan copy"]
    if not tangents:
        return []
    tangent = float(np.median(tangents))
    rest = {row.distribution: row.kernel.median - tangent for row in timed}
    return [
        f"A renderer that has cos β needs no tangent of β: without its {tangent:.2g} ns in "
        f"{precision}, {_listed(rest, list(rest))} ns remain."
    ]


def _worth_it(rows: Sequence[Substitute]) -> str:
    best = front([(row.ns["float32"].median, row.rmse) for row in rows], NOISE)
    listed = [
        f"{row.distribution} ({row.ns['float32'].median:.2g} ns, RMSE {row.rmse:.2g})"
        for row in (rows[number] for number in best)
    ]
    return (
        f"In the place of {rows[0].reference} at {rows[0].reference_parameter:g}, but for noise "
        f"nothing is both faster and nearer than {_and(listed)}."
    )


def on_methods(measurements: Measurements) -> list[str]:
    """Say how fast the methods are, and how far from the best fit."""
    rows = measurements.methods
    fits = {row.metric: row for row in rows if row.method == "fit"}
    fitted = {"fit": "", LOOP: f"a loop of {LOOP}", COLD: f"a {COLD}"}
    sentences = [_approximation(row) for row in rows if row.method not in fitted]
    for row in rows:
        if row.method in (COLD, LOOP):
            ratio = fits[row.metric].per_second.median / row.per_second.median
            sentences.append(
                f"Under {row.metric}, fit converts {ratio:.2g} times as many values a second as "
                f"{fitted[row.method]}, which comes within {row.parameter_error_max:.2g} of it."
            )
    return sentences


def _approximation(row: MethodSpeed) -> str:
    return (
        f"{row.method} converts {_count(row.per_second.median)} values a second and is within "
        f"{row.parameter_error_max:.2g} of the best fit under {row.metric} (half of the sweep "
        f"within {row.parameter_error:.2g})."
    )


def on_scaling(measurements: Measurements) -> list[str]:
    """Say what a call of each method costs, and what a value among many does."""
    rows = measurements.scaling
    sentences = []
    for method in dict.fromkeys(row.method for row in rows):
        times = [row for row in rows if row.method == method]
        first, last = times[0], times[-1]
        call, value = 1e6 * first.seconds.median, 1e9 * last.seconds.median / last.values
        sentences.append(
            f"A call of {method} for one value takes {_plain(call)} µs; among {last.values:,} a "
            f"value takes {_plain(value)} ns."
        )
    return sentences


def on_limits(measurements: Measurements) -> list[str]:
    """Say how many times the unavoidable each method takes, metric by metric."""
    sentences = []
    for metric in dict.fromkeys(row.metric for row in measurements.limits):
        ratios = {row.method: row.ratio for row in measurements.limits if row.metric == metric}
        nearest = sorted(ratios, key=ratios.__getitem__)
        listed = _and([f"{name} {_plain(ratios[name])}" for name in nearest])
        sentences.append(f"Under {metric}, the times over those of the unavoidable are {listed}.")
    return sentences


def on_compiled(measurements: Measurements) -> list[str]:
    """Say how the kernel compares with the compiled one; nothing if that was not measured."""
    return [
        f"In {row.precision} Dr.Jit evaluates {row.distribution} in "
        f"{row.drjit.median / row.kernel.median:.2g} of the time of the kernel."
        for row in measurements.compiled
    ]


def on_kernels(measurements: Measurements) -> list[str]:
    """Say how the kernels compare with the printed expressions and with their floor."""
    sentences = []
    for precision in PRECISIONS:
        rows = [row for row in measurements.kernels if row.precision == precision]
        speedups = [row.speedup for row in rows]
        floors = [row.over_floor for row in rows]
        sentences.append(
            f"In {precision} the kernels are {min(speedups):.2g} to {max(speedups):.2g} times as "
            f"fast as the printed expressions in NumPy, and take {min(floors):.2g} to "
            f"{max(floors):.2g} times as long as the functions that they cannot avoid."
        )
    most = max(row.memory for row in measurements.kernels)
    return [*sentences, f"They allocate at most {most:.3g} times the size of the result."]


def _listed(values: dict[str, float], names: Sequence[str]) -> str:
    return _and([f"{name} {values[name]:.2g}" for name in names])


def _and(words: Sequence[str]) -> str:
    return "" if not words else ", ".join(words[:-1]) + " and " * (len(words) > 1) + words[-1]


def _plain(value: float) -> str:
    """Return two digits of a number, written out: 0.31, 4.2, 84,000."""
    return f"{float(f'{value:.2g}'):,.10g}"


def _count(value: float) -> str:
    """Return a number of values in words: 2.8 million, 350."""
    rounded = float(f"{value:.2g}")
    return f"{rounded / 1e6:g} million" if rounded >= 1e6 else f"{rounded:,.0f}"
