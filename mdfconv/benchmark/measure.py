"""Everything that ``mdfconv bench`` measures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from mdfconv.benchmark import kernels, substitutes
from mdfconv.benchmark.kernels import KernelSpeed, kernel_speeds
from mdfconv.benchmark.machine import describe
from mdfconv.benchmark.methods import MethodSpeed, method_speeds
from mdfconv.benchmark.substitutes import Substitute
from mdfconv.benchmark.timing import Advance, Sizes
from mdfconv.distributions import Distribution
from mdfconv.distributions.evaluation import Array


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
            + (self.sizes.rounds + 1)
            + kernels.count_steps(len(self.candidates), self.sizes)
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
    substitutes, methods, kernels : sequence
        The rows of the three tables.
    """

    machine: dict[str, str]
    sizes: Sizes
    substitutes: Sequence[Substitute]
    methods: Sequence[MethodSpeed]
    kernels: Sequence[KernelSpeed]

    def records(self) -> dict[str, list[dict[str, Any]]]:
        """Return the tables by their names, as flat rows in full precision."""
        return {
            "substitutes": [row.record() for row in self.substitutes],
            "methods": [row.record() for row in self.methods],
            "kernels": [row.record() for row in self.kernels],
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
    # The conversions come first: they may refuse the pair.
    return Measurements(
        machine=describe(),
        sizes=task.sizes,
        methods=method_speeds(task.source, task.target, task.sizes, advance),
        substitutes=substitutes.substitutes(
            task.reference, task.parameters, task.candidates, task.sizes, advance
        ),
        kernels=kernel_speeds(task.candidates, task.sizes, advance),
    )
