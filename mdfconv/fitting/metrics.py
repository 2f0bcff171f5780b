"""What "best fit" means: the metrics under which two distributions are compared.

A new metric is a class here and one entry in `_METRICS`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import ClassVar

import numpy as np

from mdfconv.distributions import Distribution
from mdfconv.distributions.evaluation import Array
from mdfconv.distributions.parameter import Parameter
from mdfconv.errors import check_name, unknown_name

# The sRGB encoding (IEC 61966-2-1) is linear up to here.
_SRGB_TOE = 0.0031308
_EXPOSURE = Parameter("exposure", "exposure")


class Metric(ABC):
    """A squared distance ∫ (S(D_t/P) − S(D_s/P))² w dβ over [0, π/2], P = max D_s.

    Attributes
    ----------
    keeps, quantity : str
        What a fit under the metric keeps, and what its signal is, in words.
    normalized : bool
        Whether D is the normalized or the unit form.
    kinks : tuple of float
        Values of D/P at which S is not smooth.
    """

    name: ClassVar[str]
    keeps: ClassVar[str]
    quantity: ClassVar[str]
    normalized: ClassVar[bool]
    kinks: tuple[float, ...] = ()

    @abstractmethod
    def weight(self, beta: Array) -> Array:
        """Return w at an angle, radians."""

    def signal(self, value: Array) -> Array:
        """Return S for D/P."""
        return value

    def signal_slope(self, value: Array) -> Array | float:
        """Return dS/d(D/P)."""
        return 1.0

    def signal_of(
        self, distribution: Distribution, beta: Array, parameter: Array, peak: Array
    ) -> Array:
        """Return S of a distribution for P = `peak`; `beta` has the shape of the result."""
        with np.errstate(all="ignore"):
            value = distribution.shape(beta, parameter)
            value *= distribution.maximum(parameter, normalized=self.normalized) / peak
        return self.signal(value)


class Unit(Metric):
    """The shape of the lobe: unit forms, every angle alike (the paper's view)."""

    name = "unit"
    keeps = "shape of the lobe"
    quantity = "unit form D / max D"
    normalized = False

    def weight(self, beta: Array) -> Array:
        """Return 1."""
        return np.broadcast_to(1.0, beta.shape)


class Energy(Metric):
    """The light: normalized forms, over the hemisphere with cos β dω."""

    name = "energy"
    keeps = "light"
    quantity = "normalized D / max D of the reference"
    normalized = True

    def weight(self, beta: Array) -> Array:
        """Return 2π sin β cos β."""
        return np.pi * np.sin(2 * beta)


class Display(Energy):
    """The picture on a screen: normalized forms, exposed, sRGB-encoded, clipped at white.

    Parameters
    ----------
    exposure : float
        What max D_s is multiplied with before encoding; 1 puts it at white.
    """

    name = "display"
    keeps = "picture on a screen"
    quantity = "normalized D as a screen shows it"

    def __init__(self, exposure: float = 1.0) -> None:
        self.exposure = _EXPOSURE.check_one(exposure, self.name)
        self.kinks = (_SRGB_TOE / self.exposure, 1 / self.exposure)

    def signal(self, value: Array) -> Array:
        """Return the encoded value in [0, 1]."""
        return srgb(self.exposure * value)

    def signal_slope(self, value: Array) -> Array:
        """Return the slope of the encoding; 0 where it is clipped."""
        x = np.minimum(self.exposure * value, 1)
        power = 1.055 / 2.4 * np.maximum(x, _SRGB_TOE) ** (1 / 2.4 - 1)
        return self.exposure * np.where(x <= _SRGB_TOE, 12.92, np.where(x >= 1, 0, power))


def srgb(linear: Array) -> Array:
    """Return linear light in the sRGB encoding, clipped to [0, 1] (IEC 61966-2-1)."""
    x = np.clip(linear, 0, 1)
    return np.where(x <= _SRGB_TOE, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)


_METRICS: dict[str, Callable[[float], Metric]] = {
    "unit": lambda exposure: Unit(),
    "energy": lambda exposure: Energy(),
    "display": Display,
}


def list_metrics() -> list[str]:
    """Return the names of the metrics, the default first."""
    return list(_METRICS)


def metric(name: str | Metric, exposure: float = 1.0) -> Metric:
    """Return the metric with a given name.

    Parameters
    ----------
    name : str or Metric
        ``"unit"``, ``"energy"`` or ``"display"``.
    exposure : float
        For ``"display"``; the others do not depend on it.

    Raises
    ------
    MdfconvError
        If the name is not known or the exposure not positive.
    """
    if isinstance(name, Metric):
        return name
    key = check_name("metric", name).strip().lower()
    if key not in _METRICS:
        raise unknown_name("metric", name, list(_METRICS))
    return _METRICS[key](exposure)
