"""A kernel as Dr.Jit compiles it, where that is installed, beside the one of this package."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from typing import Any

import numpy as np

from mdfconv.distributions import distribution
from mdfconv.distributions.evaluation import Array
from mdfconv.recommend import PRECISIONS
from mdfconv.timing import Advance, Sizes, Spread, interleave, spread

_NAME = "ggx"


@dataclass(frozen=True)
class CompiledSpeed:
    """A unit form in one precision; times in nanoseconds an evaluation.

    Parameters
    ----------
    distribution, precision : str
        Name, and "float64" or "float32".
    kernel : Spread
        `Distribution.unit`.
    drjit : Spread
        The form as Dr.Jit's LLVM backend compiles it, in one thread.
    """

    distribution: str
    precision: str
    kernel: Spread
    drjit: Spread

    def record(self) -> dict[str, Any]:
        """Return a flat row of a table."""
        row: dict[str, Any] = {"distribution": self.distribution, "precision": self.precision}
        return row | self.kernel.columns("kernel_ns") | self.drjit.columns("drjit_ns")


def compiled_speeds(sizes: Sizes, advance: Advance) -> list[CompiledSpeed]:
    """Measure a kernel of both in both precisions; nothing without Dr.Jit or LLVM.

    Parameters
    ----------
    sizes : Sizes
        How much is measured.
    advance : callable
        Called with 1 after each of `count_steps` rounds.
    """
    if not _drjit():
        return []
    entry = distribution(_NAME)
    parameter = entry.parameter.typical_value
    speeds = []
    for precision in PRECISIONS:
        beta = np.linspace(0, np.pi / 2, sizes.angles, dtype=precision)
        functions: dict[str, Callable[[], object]] = {
            "kernel": partial(entry.unit, beta, parameter),
            "drjit": evaluation(beta, parameter),
        }
        times = interleave(functions, sizes.rounds, advance)
        spreads = {name: spread(1e9 * samples / beta.size) for name, samples in times.items()}
        speeds.append(CompiledSpeed(_NAME, precision, **spreads))
    return speeds


def count_steps(sizes: Sizes) -> int:
    """Return how often `compiled_speeds` advances."""
    return len(PRECISIONS) * (sizes.rounds + 1) if _drjit() else 0


def evaluation(beta: Array, parameter: float) -> Callable[[], Any]:
    """Return what evaluates the form in Dr.Jit, which is installed, in one thread.

    Parameters
    ----------
    beta : numpy.ndarray, shape (n,)
        Angles in radians, float64 or float32.
    parameter : float
        α of GGX.
    """
    drjit = _drjit()
    drjit.set_thread_count(1)
    kind = drjit.llvm.Float64 if beta.dtype == np.float64 else drjit.llvm.Float
    angles, slope = kind(beta), 1 / parameter**2 - 1

    def evaluate() -> Any:
        value = drjit.square(drjit.rcp(drjit.fma(drjit.square(drjit.sin(angles)), slope, 1)))
        drjit.eval(value)
        drjit.sync_thread()
        return value

    return evaluate


def _drjit() -> Any:
    """Return the module; None where it is not installed or finds no LLVM."""
    try:
        drjit = import_module("drjit")
        import_module("drjit.llvm")
    except ImportError:
        return None
    return drjit if drjit.has_backend(drjit.JitBackend.LLVM) else None
