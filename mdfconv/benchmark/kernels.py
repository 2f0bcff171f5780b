"""Kernels against the printed expressions, and against what no kernel can save."""

from __future__ import annotations

import tracemalloc
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from mdfconv.benchmark.substitutes import PRECISIONS
from mdfconv.benchmark.textbook import textbook
from mdfconv.benchmark.timing import Advance, Sizes, Spread, interleave, spread
from mdfconv.distributions import Distribution
from mdfconv.distributions.evaluation import Array

_ROUGHNESS, _EXPONENT = 0.2, 50.0

_Step: TypeAlias = tuple[str, Callable[..., Any], Array]


@dataclass(frozen=True)
class KernelSpeed:
    """One distribution's unit form in one precision; times in nanoseconds an evaluation.

    Parameters
    ----------
    distribution, precision : str
        Name, and "float64" or "float32".
    parameter : float
        The parameter.
    functions : str
        The transcendental functions of β that it cannot avoid; for a rational form the tangent
        and a copy of it.
    kernel : Spread
        `Distribution.unit`.
    textbook : Spread
        The printed expression in NumPy.
    floor : Spread
        Those functions alone, the first into a new array and the others in place, on the
        arguments that the kernel gives them.
    copy : Spread
        Copying the array of β.
    speedup, over_floor, over_copy : float
        Textbook/kernel, kernel/floor and kernel/copy: medians of the ratios within a round.
    memory : float
        Peak of newly allocated memory over the size of the result.
    """

    distribution: str
    precision: str
    parameter: float
    functions: str
    kernel: Spread
    textbook: Spread
    floor: Spread
    copy: Spread
    speedup: float
    over_floor: float
    over_copy: float
    memory: float

    def record(self) -> dict[str, Any]:
        """Return a flat row of a table."""
        row: dict[str, Any] = {}
        for name, value in vars(self).items():
            row |= value.columns(f"{name}_ns") if isinstance(value, Spread) else {name: value}
        return row


def kernel_speeds(
    candidates: Sequence[Distribution], sizes: Sizes, advance: Advance
) -> list[KernelSpeed]:
    """Measure the unit forms of distributions in both precisions.

    Parameters
    ----------
    candidates : sequence of Distribution
        The distributions.
    sizes : Sizes
        How much is measured.
    advance : callable
        Called with 1 after each of `count_steps` rounds.
    """
    found = []
    for precision in PRECISIONS:
        beta = np.linspace(0, np.pi / 2, sizes.angles, dtype=precision)
        found += [_measure(entry, beta, sizes, advance) for entry in candidates]
    return found


def count_steps(candidates: int, sizes: Sizes) -> int:
    """Return how often `kernel_speeds` advances for a number of distributions."""
    return candidates * len(PRECISIONS) * (sizes.rounds + 1)


def _measure(entry: Distribution, beta: Array, sizes: Sizes, advance: Advance) -> KernelSpeed:
    parameter = _EXPONENT if entry.parameter.name == "exponent" else _ROUGHNESS
    steps = _transcendentals(entry.name, beta, parameter)
    functions: dict[str, Callable[[], object]] = {
        "kernel": lambda: entry.unit(beta, parameter),
        "textbook": lambda: textbook(entry.name, beta, parameter),
        "floor": lambda: _run(steps),
        "copy": beta.copy,
    }
    times = interleave(functions, sizes.rounds, advance)
    kernel = times["kernel"]
    return KernelSpeed(
        distribution=entry.name,
        precision=beta.dtype.name,
        parameter=parameter,
        functions=" ".join(name for name, *_ in steps),
        **{name: spread(1e9 * samples / beta.size) for name, samples in times.items()},
        speedup=float(np.median(times["textbook"] / kernel)),
        over_floor=float(np.median(kernel / times["floor"])),
        over_copy=float(np.median(kernel / times["copy"])),
        memory=_peak_memory(functions["kernel"]) / beta.nbytes,
    )


def _transcendentals(name: str, beta: Array, parameter: float) -> list[_Step]:
    """Return the functions that a unit form cannot avoid, with their names and arguments."""
    tangent: _Step = ("tan", np.tan, beta)
    square = np.square(np.tan(beta))
    if name in ("beckmann", "gauss"):
        return [tangent, ("exp", np.exp, square / -(parameter**2))]
    if name == "blinn-phong":
        power = -0.5 * parameter * np.log1p(square)
        return [tangent, ("log1p", np.log1p, square), ("exp", np.exp, power)]
    return [tangent, ("copy", np.positive, beta)]


def _run(steps: list[_Step]) -> None:
    (_, first, argument), *rest = steps
    out = first(argument)
    for _, function, argument in rest:
        function(argument, out=out)


def _peak_memory(function: Callable[[], object]) -> int:
    tracemalloc.start()
    function()
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return peak
