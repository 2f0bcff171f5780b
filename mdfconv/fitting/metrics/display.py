"""The metric that keeps the picture on a screen."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import ClassVar, Self

import numpy as np

from mdfconv.distributions.evaluation import Array
from mdfconv.distributions.parameter import Parameter, number_text, percent_hint
from mdfconv.errors import MdfconvError
from mdfconv.fitting.metrics.base import Metric
from mdfconv.fitting.metrics.energy import Energy

# The sRGB encoding (IEC 61966-2-1) is linear up to here.
_SRGB_TOE = 0.0031308
# Of ln exposure, from which a fit can be followed from one exposure to the next: up to 16 times the
# usual, beyond which rough lobes are clipped as a whole, and by a third at a time.
_FARTHEST, _LARGEST_STEP = math.log(16), 0.35
_EXPOSURE = Parameter("exposure", "exposure", (0.25, 4.0), default=1.0)


class Display(Energy):
    """The picture on a screen: normalized forms, exposed, sRGB-encoded, clipped at white.

    Parameters
    ----------
    exposure : float
        What max D_s is multiplied with before encoding; 1 puts it at white.
    """

    name = "display"
    keeps = "picture on a screen"
    word = "picture"
    purpose = "as seen on a screen"
    meant_by: ClassVar[tuple[str, ...]] = ("screen", "picture", "srgb", "image")
    quantity = "normalized D as a screen shows it"
    setting = "exposure"

    def __init__(self, exposure: float = _EXPOSURE.default) -> None:
        self.exposure = _EXPOSURE.check_one(exposure, self.name)
        self.kinks = (_SRGB_TOE / self.exposure, 1 / self.exposure)

    @classmethod
    def with_setting(cls, text: str) -> Self:
        """Return the metric for an exposure, such as ``"4"`` in ``"display:4"``."""
        try:
            return cls(float(text))
        except MdfconvError:
            raise
        except ValueError:
            raise MdfconvError(
                f"the exposure of the display metric is a number, not '{text}'",
                percent_hint(text),
            ) from None

    def __str__(self) -> str:
        """Return the name, with the exposure unless it is 1."""
        usual = self.exposure == _EXPOSURE.default
        return self.name if usual else f"{self.name}:{number_text(self.exposure)}"

    def from_stored(self) -> Sequence[Metric]:
        """Return the exposures from the usual one to this; this alone if that is far away."""
        way = np.log(self.exposure / _EXPOSURE.default)
        if abs(way) > _FARTHEST:
            return (self,)
        steps = math.ceil(abs(way) / _LARGEST_STEP)
        between = np.exp(np.linspace(0, way, steps + 1)[:-1])
        return [*(type(self)(float(exposure)) for exposure in between), self]

    def encode(self, value: Array) -> Array:
        """Return the encoded value in [0, 1]."""
        return srgb(self.exposure * value)

    def encode_slope(self, value: Array) -> Array:
        """Return the slope of the encoding; 0 where it is clipped."""
        x = np.minimum(self.exposure * value, 1)
        power = 1.055 / 2.4 * np.maximum(x, _SRGB_TOE) ** (1 / 2.4 - 1)
        return self.exposure * np.where(x <= _SRGB_TOE, 12.92, np.where(x >= 1, 0, power))


def srgb(linear: Array) -> Array:
    """Return linear light in the sRGB encoding, clipped to [0, 1] (IEC 61966-2-1)."""
    x = np.clip(linear, 0, 1)
    return np.where(x <= _SRGB_TOE, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)


METRIC = Display
