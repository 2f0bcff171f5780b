"""What every metric has in common."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from pathlib import Path
from typing import ClassVar, Self

import numpy as np

from mdfconv.distributions import Distribution
from mdfconv.distributions.evaluation import Array
from mdfconv.errors import MdfconvError
from mdfconv.fitting.quadrature import LobeQuadrature, Quadrature


def scaled(parameter: Array, ratio: float, target: Distribution) -> Array:
    """Return the fits of a pair that has a `Metric.ratio`, within the target's legal range."""
    limited: Array = np.minimum(parameter * ratio, target.parameter.upper)
    return limited


class Metric(ABC):
    """A squared distance ∫ (S(D_t/P) − S(D_s/P))² w dβ over [0, π/2], P = max D_s.

    Attributes
    ----------
    keeps, quantity : str
        What a fit under the metric keeps, and what its signal S is, in words.
    word : str
        What it keeps, in one word.
    meant_by : tuple of str
        Words that are no names of metrics, by which users may mean this one.
    purpose : str
        Where that is right, in a few.
    normalized : bool
        Whether D is the normalized or the unit form.
    kinks : tuple of float
        Values of D/P at which S is not smooth.
    inputs : tuple of Path
        Files that it was read from.
    setting : str
        What may follow the name and a colon, in a word; "" for nothing.
    needs_setting : bool
        Whether it must.
    over_angles : bool
        Whether S is a function of β.
    similar_below : float
        Lobes of a smaller tan β_half convert as one that has it, scaled: smooth lobes are similar,
        and rounding would hide what they differ by.
    """

    name: ClassVar[str]
    keeps: ClassVar[str]
    word: ClassVar[str]
    purpose: ClassVar[str]
    quantity: ClassVar[str]
    normalized: ClassVar[bool]
    kinks: tuple[float, ...] = ()
    inputs: tuple[Path, ...] = ()
    meant_by: ClassVar[tuple[str, ...]] = ()
    setting: ClassVar[str] = ""
    needs_setting: ClassVar[bool] = False
    over_angles: ClassVar[bool] = True
    similar_below: ClassVar[float] = 0.0

    @classmethod
    def with_setting(cls, text: str) -> Self:
        """Return the metric for the setting that follows its name and a colon.

        Raises
        ------
        MdfconvError
            If the metric has none, or the text does not say one.
        """
        raise MdfconvError(f"the {cls.name} metric has no setting '{text}'")

    def __str__(self) -> str:
        """Return the name, with the setting where it is not the usual one."""
        return self.name

    def from_stored(self) -> Sequence[Metric]:
        """Return metrics from one whose fits may be stored to this, each near the one before."""
        return (self,)

    @abstractmethod
    def weight(self, beta: Array) -> Array:
        """Return w at an angle, radians."""

    def quadrature(self, half_width: Array) -> Quadrature:
        """Return where S is sampled, for lobes of which β_half is the narrowest, radians."""
        return LobeQuadrature(half_width)

    def ratio(self, source: Distribution, target: Distribution) -> float | None:
        """Return p_target/p_source of the fit where that is one constant, else None."""
        return None

    def encode(self, value: Array) -> Array:
        """Return S for D/P."""
        return value

    def encode_slope(self, value: Array) -> Array | float:
        """Return dS/d(D/P)."""
        return 1.0

    def signal(
        self, distribution: Distribution, beta: Array, parameter: Array, peak: Array
    ) -> Array:
        """Return S of a distribution for P = `peak`; `beta` has the shape of the result."""
        with np.errstate(all="ignore"):
            value = distribution.shape(beta, parameter)
            value *= distribution.maximum(parameter, normalized=self.normalized) / peak
        return self.encode(value)

    def signal_and_slope(
        self, distribution: Distribution, beta: Array, parameter: Array, peak: Array
    ) -> tuple[Array, Array]:
        """Return S and ∂S/∂ ln p; `beta` has shape (n, k), `parameter` p and `peak` (n, 1)."""
        value, slope = distribution.with_slope(beta, parameter, normalized=self.normalized)
        if self.normalized:
            value /= peak
            slope *= self.encode_slope(value) / peak
        return self.encode(value), slope
