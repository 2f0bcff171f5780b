"""Which of several fits to the same samples is the best, and which the simplest good one."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol, TypeVar

from mdfconv.distributions import Distribution


class RankedFit(Protocol):
    """A fit whose error compares with that of others to the same samples."""

    @property
    def distribution(self) -> Distribution:
        """The distribution."""

    @property
    def parameters(self) -> Any:
        """What was fitted of it: as many as there are."""

    @property
    def error(self) -> float:
        """Root mean square of the loss's residuals."""


Fit = TypeVar("Fit", bound=RankedFit)


def rank(fits: Sequence[Fit]) -> list[Fit]:
    """Return fits by their error, the smallest first."""
    return sorted(fits, key=lambda fit: fit.error)


def simplest(fits: Sequence[Fit], tolerance: float) -> Fit:
    """Return the cheapest of fits whose error is within a relative tolerance of the best.

    Cheapest has the fewest parameters, then the fewest operations per evaluation.
    """
    best = min(fit.error for fit in fits)
    good = [fit for fit in fits if fit.error <= (1 + tolerance) * best]
    return min(good, key=lambda fit: (len(fit.parameters), fit.distribution.operations))
