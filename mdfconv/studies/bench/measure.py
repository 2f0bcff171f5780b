"""Everything that ``mdfconv bench`` measures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from mdfconv import recommend as substitutes
from mdfconv.distributions import Distribution
from mdfconv.distributions.evaluation import Array
from mdfconv.recommend import Substitute
from mdfconv.studies.bench import compiled, kernels, scaling
from mdfconv.studies.bench.compiled import CompiledSpeed, compiled_speeds
from mdfconv.studies.bench.kernels import KernelSpeed, kernel_speeds
from mdfconv.studies.bench.limits import Limit, limits
from mdfconv.studies.bench.machine import describe
from mdfconv.studies.bench.methods import MethodSpeed, method_speeds
from mdfconv.studies.bench.scaling import ConversionTime, conversion_times
from mdfconv.timing import Advance, Sizes


@dataclass(frozen=True)
class Task:
    """What is measured.

    Parameters
    ----------
    reference : Distribution
        What the distributions take the place of.
    parameters : numpy.ndarray, shape (n,)
        Its parameters.
    candidates : tuple of Distribution
        The distributions.
    source, target : Distribution
        The pair of the conversions.
    sizes : Sizes
        How much is measured.
    """

    reference: Distribution
    parameters: Array
    candidates: tuple[Distribution, ...]
    source: Distribution
    target: Distribution
    sizes: Sizes

    @property
    def steps(self) -> int:
        """How often `measure` advances."""
        return (
            substitutes.count_steps(self.parameters.size, self.sizes)
            + 2 * (self.sizes.rounds + 1)
            + scaling.count_steps(self.sizes)
            + kernels.count_steps(len(self.candidates), self.sizes)
            + compiled.count_steps(self.sizes)
        )


@dataclass(frozen=True)
class Measurements:
    """Speed against error on one machine.

    Parameters
    ----------
    machine : dict
        Processor, system and versions.
    sizes : Sizes
        How much was measured.
    substitutes, methods, scaling, limits, kernels, compiled : sequence
        The rows of the tables; of the last none without Dr.Jit.
    """

    machine: dict[str, str]
    sizes: Sizes
    substitutes: Sequence[Substitute]
    methods: Sequence[MethodSpeed]
    scaling: Sequence[ConversionTime]
    limits: Sequence[Limit]
    kernels: Sequence[KernelSpeed]
    compiled: Sequence[CompiledSpeed]

    def records(self) -> dict[str, list[dict[str, Any]]]:
        """Return the tables by their names, as flat rows in full precision."""
        return {
            "substitutes": [row.record() for row in self.substitutes],
            "methods": [row.record() for row in self.methods],
            "scaling": [row.record() for row in self.scaling],
            "limits": [row.record() for row in self.limits],
            "kernels": [row.record() for row in self.kernels],
            "compiled": [row.record() for row in self.compiled],
        }


def measure(task: Task, advance: Advance) -> Measurements:
    """Measure distributions, conversion methods and kernels.

    Parameters
    ----------
    task : Task
        What is measured.
    advance : callable
        Called with 1 after each of `task`.steps rounds.

    Raises
    ------
    MdfconvError
        If there is nothing to convert from source to target.
    """
    pair, sizes = (task.source, task.target), task.sizes
    # The conversions come first: they may refuse the pair.
    methods = method_speeds(*pair, sizes, advance)
    return Measurements(
        machine=describe(),
        sizes=sizes,
        methods=methods,
        scaling=conversion_times(*pair, sizes, advance),
        limits=limits(*pair, methods, sizes, advance),
        substitutes=substitutes.substitutes(
            task.reference, task.parameters, task.candidates, sizes, advance
        ),
        kernels=kernel_speeds(task.candidates, sizes, advance),
        compiled=compiled_speeds(sizes, advance),
    )
