"""Kernels against the printed expressions, and against what no kernel can save."""

from __future__ import annotations

import tracemalloc
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from mdfconv.distributions import Distribution
from mdfconv.distributions.evaluation import Array
from mdfconv.recommend import PRECISIONS
from mdfconv.studies.stability import printed_form
from mdfconv.timing import Advance, Sizes, Spread, interleave, spread

_Step: TypeAlias = tuple[Callable[..., Any], Array]


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
        `Distribution.functions`, and a copy if there are fewer than two.
    kernel : Spread
        `Distribution.unit`.
    textbook : Spread
        The printed expression in NumPy.
    floor : Spread
        Those functions alone, the first into a new array and the others in place, on arguments
        as the kernel gives them.
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
    speeds = []
    for precision in PRECISIONS:
        beta = np.linspace(0, np.pi / 2, sizes.angles, dtype=precision)
        speeds += [_speed(candidate, beta, sizes, advance) for candidate in candidates]
    return speeds


def count_steps(candidates: int, sizes: Sizes) -> int:
    """Return how often `kernel_speeds` advances for a number of distributions."""
    return candidates * len(PRECISIONS) * (sizes.rounds + 1)


def _speed(candidate: Distribution, beta: Array, sizes: Sizes, advance: Advance) -> KernelSpeed:
    parameter = candidate.parameter.typical_value
    rounded = beta.dtype.type(parameter)
    steps = _transcendentals(candidate, beta, parameter)
    functions: dict[str, Callable[[], object]] = {
        "kernel": lambda: candidate.unit(beta, parameter),
        "textbook": lambda: printed_form(candidate, "unit", beta, rounded),
        "floor": lambda: _run(list(steps.values())),
        "copy": beta.copy,
    }
    times = interleave(functions, sizes.rounds, advance)
    kernel = times["kernel"]
    return KernelSpeed(
        distribution=candidate.name,
        precision=beta.dtype.name,
        parameter=parameter,
        functions=" ".join(steps),
        **{name: spread(1e9 * samples / beta.size) for name, samples in times.items()},
        speedup=float(np.median(times["textbook"] / kernel)),
        over_floor=float(np.median(kernel / times["floor"])),
        over_copy=float(np.median(kernel / times["copy"])),
        memory=_peak_memory(functions["kernel"]) / beta.nbytes,
    )


def _transcendentals(candidate: Distribution, beta: Array, parameter: float) -> dict[str, _Step]:
    """Return the functions that a unit form cannot avoid, with their arguments."""
    # Of an exponential that underflows the logarithm of the smallest number will do.
    unit = np.maximum(candidate.unit(beta, parameter), np.finfo(beta.dtype).tiny)
    arguments = {"log1p": np.square(np.tan(beta)), "exp": np.log(unit)}
    steps: dict[str, _Step] = {
        name: (getattr(np, name), arguments.get(name, beta)) for name in candidate.functions
    }
    if len(steps) < 2:
        steps["copy"] = np.positive, beta
    return steps


def _run(steps: list[_Step]) -> None:
    (first, argument), *rest = steps
    out = first(argument)
    for function, argument in rest:
        function(argument, out=out)


def _peak_memory(function: Callable[[], object]) -> int:
    tracemalloc.start()
    function()
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return peak
