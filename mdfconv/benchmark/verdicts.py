"""What the measurements say, in sentences computed from them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mdfconv.benchmark.kernels import KernelSpeed
from mdfconv.benchmark.measure import Measurements
from mdfconv.benchmark.methods import LOOP, MethodSpeed
from mdfconv.benchmark.pareto import front
from mdfconv.benchmark.substitutes import PRECISIONS, Substitute
from mdfconv.benchmark.timing import NOISE

_RATIONAL = ("schlick", "sawicki", "smoothie")
_EXPONENTIAL = ("beckmann", "gauss", "blinn-phong")


def on_substitutes(found: Measurements) -> list[str]:
    """Say whether rational forms are the faster ones, and which distributions pay."""
    sentences = [_rational(found.substitutes, precision) for precision in reversed(PRECISIONS)]
    sentences += [_without_tangent(found.kernels, precision) for precision in reversed(PRECISIONS)]
    groups: dict[tuple[str, float], list[Substitute]] = {}
    for row in found.substitutes:
        groups.setdefault((row.reference, row.reference_parameter), []).append(row)
    return sentences + [_worth_it(rows) for rows in groups.values()]


def _rational(rows: Sequence[Substitute], precision: str) -> str:
    samples: dict[str, list[float]] = {}
    for row in rows:
        samples.setdefault(row.distribution, []).append(row.ns[precision].median)
    times = {name: float(np.median(samples[name])) for name in (*_RATIONAL, *_EXPONENTIAL)}
    quickest = min(_EXPONENTIAL, key=times.__getitem__)
    winners = [name for name in _RATIONAL if times[name] < (1 - NOISE) * times[quickest]]
    gain = f"speed for {_and(winners)} only" if winners else "no speed"
    return (
        f"In {precision}, from β, the rational forms take {_listed(times, _RATIONAL)} ns, those "
        f"with an exponential or a power {_listed(times, _EXPONENTIAL)} ns. Of the rational ones "
        f"{_against(times, 'beckmann')}; {_against(times, quickest)}. On the vector units of this "
        f"machine, being rational buys {'speed' if winners == list(_RATIONAL) else gain}."
    )


def _against(times: dict[str, float], other: str) -> str:
    """Say which rational forms are faster or slower than another form by more than the noise."""
    faster = [name for name in _RATIONAL if times[name] < (1 - NOISE) * times[other]]
    slower = [name for name in _RATIONAL if times[name] > (1 + NOISE) * times[other]]
    return f"{_are(faster)} faster than {other}, {_are(slower)} slower"


def _are(names: Sequence[str]) -> str:
    return f"{_and(names) or 'none'} {'are' if len(names) > 1 else 'is'}"


def _without_tangent(rows: Sequence[KernelSpeed], precision: str) -> str:
    there = {row.distribution: row for row in rows if row.precision == precision}
    tangent = there["ggx"].floor.median - there["ggx"].copy.median
    names = [name for name in (*_RATIONAL, "beckmann", "blinn-phong") if name in there]
    left = {name: there[name].kernel.median - tangent for name in names}
    return (
        f"A renderer that has cos β needs no tangent of β: without its {tangent:.2g} ns in "
        f"{precision}, {_listed(left, names)} ns are left."
    )


def _worth_it(rows: Sequence[Substitute]) -> str:
    best = front([(row.ns["float32"].median, row.rmse) for row in rows], NOISE)
    listed = [
        f"{row.distribution} ({row.ns['float32'].median:.2g} ns, RMSE {row.rmse:.2g})"
        for row in (rows[place] for place in best)
    ]
    return (
        f"In the place of {rows[0].reference} at {rows[0].reference_parameter:g}, but for noise "
        f"nothing is both faster and nearer than {_and(listed)}."
    )


def on_methods(found: Measurements) -> list[str]:
    """Say how fast the methods are, and how far from the best fit."""
    rows = found.methods
    fits = {row.metric: row for row in rows if row.method == "fit"}
    sentences = [_approximation(row) for row in rows if row.method not in ("fit", LOOP)]
    for row in rows:
        if row.method == LOOP:
            ratio = fits[row.metric].per_second.median / row.per_second.median
            sentences.append(
                f"Under {row.metric}, fit converts {ratio:.2g} times as many values a second as "
                f"a loop of {LOOP}, which comes within {row.parameter_error_max:.2g} of it."
            )
    return sentences


def _approximation(row: MethodSpeed) -> str:
    return (
        f"{row.method} converts {_count(row.per_second.median)} values a second and is within "
        f"{row.parameter_error_max:.2g} of the best fit under {row.metric} (half of the sweep "
        f"within {row.parameter_error:.2g})."
    )


def on_kernels(found: Measurements) -> list[str]:
    """Say how the kernels compare with the printed expressions and with their floor."""
    sentences = []
    for precision in PRECISIONS:
        rows = [row for row in found.kernels if row.precision == precision]
        speedups = [row.speedup for row in rows]
        floors = [row.over_floor for row in rows]
        sentences.append(
            f"In {precision} the kernels are {min(speedups):.2g} to {max(speedups):.2g} times as "
            f"fast as the printed expressions in NumPy, and take {min(floors):.2g} to "
            f"{max(floors):.2g} times as long as the functions that they cannot avoid."
        )
    most = max(row.memory for row in found.kernels)
    return [*sentences, f"They allocate at most {most:.3g} times the size of the result."]


def _listed(values: dict[str, float], names: Sequence[str]) -> str:
    return _and([f"{name} {values[name]:.2g}" for name in names])


def _and(words: Sequence[str]) -> str:
    return "" if not words else ", ".join(words[:-1]) + " and " * (len(words) > 1) + words[-1]


def _count(value: float) -> str:
    """Return a number of values in words: 2.8 million, 350."""
    rounded = float(f"{value:.2g}")
    return f"{rounded / 1e6:g} million" if rounded >= 1e6 else f"{rounded:,.0f}"
