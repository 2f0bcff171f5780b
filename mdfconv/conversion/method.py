"""What every conversion method has in common."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar

from mdfconv.distributions import Distribution
from mdfconv.distributions.evaluation import Array, Mask
from mdfconv.fitting.metrics import Metric


class Method(ABC):
    """A rule that takes the parameter of one distribution to that of another."""

    name: ClassVar[str]
    source: ClassVar[str]
    # Whether the answer depends on the metric; else that is only what the errors measure.
    follows_metric: ClassVar[bool] = False
    # Whether elements of an array that have no answer become NaN, with a warning.
    gaps_as_nan: ClassVar[bool] = False

    @property
    def has_cautions(self) -> bool:
        """Whether a conversion may call for a caution."""
        return type(self).cautions is not Method.cautions

    @abstractmethod
    def keeps(self, metric: Metric) -> str:
        """Return what the conversion keeps, to follow the word "keeps"."""

    @abstractmethod
    def route(self, source: Distribution, target: Distribution) -> tuple[str, ...] | None:
        """Return the steps of the conversion in words; None if the pair is not covered."""

    @abstractmethod
    def convert(
        self, parameter: Array, source: Distribution, target: Distribution, metric: Metric
    ) -> Array:
        """Return target parameters (float64), for a pair that is covered.

        Where the rule leaves the target's legal range it returns what it computes; where it
        computes nothing, NaN.
        """

    def covers(self, source: Distribution, target: Distribution, metric: Metric) -> bool:
        """Return whether the method can answer for a pair under a metric."""
        return self.route(source, target) is not None

    def answered_by(
        self, parameter: Array, source: Distribution, target: Distribution, metric: Metric
    ) -> list[str]:
        """Return the name of the method that answers each value, for a pair that is covered."""
        return [self.name] * parameter.size

    def range_text(self, source: Distribution, target: Distribution, metric: Metric) -> str:
        """Return which parameters of the source a method with a range of its own covers."""
        return ""

    def cautions(
        self, parameter: Array, result: Array, source: Distribution, target: Distribution
    ) -> dict[str, Mask]:
        """Return what a careful user must know of conversions, beyond their error.

        Returns
        -------
        dict of str to numpy.ndarray of bool
            From sentences to which of the conversions they are true of.
        """
        return {}
