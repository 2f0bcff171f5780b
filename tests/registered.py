"""A distribution of one parameter, one of two, and a metric, as somebody else would write them.

Not part of the package: `tests.test_registration` copies this file to a folder of its own.
"""

import numpy as np

from mdfconv.distributions import register
from mdfconv.distributions.base import Distribution, Printed
from mdfconv.distributions.parameter import Parameter
from mdfconv.fitting.metrics import register_metric
from mdfconv.fitting.metrics.base import Energy


def printed(beta, scale):
    return (1 + np.tan(beta) ** 2) ** 2 / (1 + np.tan(beta) ** 2 / (2 * scale**2)) ** 3


class CubicSlope(Distribution):
    """D̄ = (1+t²)² / (1 + t²/2a²)³; its parameter has a name that languages use."""

    name = "cubic-slope"
    unit_formula = "(1+tan²β)² / (1 + tan²β/2a²)³"
    normalized_formula = "unit form / (π a²)"
    source = "a test"
    parameters = (Parameter("scale", "a", (0.01, 0.8), upper=0.85, upper_closed=True),)
    printed = Printed(printed, lambda scale: 1 / (np.pi * scale**2))
    operations = 9

    def _lobe(self, angles, parameter, out=None):
        square = angles.tangent_square
        value = np.square(1 + square) / (1 + square / (2 * parameter * parameter)) ** 3
        if out is None:
            return value
        out[...] = value
        return out

    def _at_normal(self, parameter):
        return 1 / (np.pi * parameter * parameter)

    def _lobe_and_log_slope(self, angles, parameter):
        x = np.square(angles.tangent / parameter) / 2
        return self._lobe(angles, parameter), 6 * x / (1 + x)

    def _log_slope_at_normal(self, parameter):
        return np.full_like(parameter, -2)

    def _cumulative(self, angles, parameter):
        x = np.square(angles.tangent / parameter) / 2
        return x * (2 + x) / np.square(1 + x), 1 / np.square(1 + x)


class PowerSlope(CubicSlope):
    """The same with a free power: D̄ = (1+t²)² (1 + t²/((k−1) a²))^(−k)."""

    name = "power-slope"
    operations = 27
    parameters = (
        # Up to here the maximum is at the normal, whatever the power.
        Parameter("alpha", "a", (0.01, 0.7), upper=0.7, upper_closed=True),
        Parameter("power", "k", (3.0, 9.0), 2.5, default=3.0, fit_range=(2.6, 40.0)),
    )

    def _x(self, angles, parameter):
        return np.square(angles.tangent / parameter) / (self.gamma - 1)

    def _lobe(self, angles, parameter, out=None):
        value = np.square(1 + angles.tangent_square)
        value = value * (1 + self._x(angles, parameter)) ** -self.gamma
        if out is None:
            return value
        out[...] = value
        return out

    def _lobe_and_log_slope(self, angles, parameter):
        x = self._x(angles, parameter)
        return self._lobe(angles, parameter), 2 * self.gamma * x / (1 + x)

    def _cumulative(self, angles, parameter):
        tail = (1 + self._x(angles, parameter)) ** (1 - self.gamma)
        return 1 - tail, tail

    printed = Printed(
        lambda beta, alpha, power: (
            (1 + np.tan(beta) ** 2) ** 2
            * (1 + np.tan(beta) ** 2 / ((power - 1) * alpha**2)) ** -power
        ),
        lambda alpha, power: 1 / (np.pi * alpha**2),
    )


class Root(Energy):
    """The light under a square root, as some cameras store it."""

    name = "root"
    keeps = "square root of the light"
    word = "root"
    purpose = "in between"
    quantity = "√(normalized D / max D of the reference)"

    def encode(self, value):
        return np.sqrt(value)

    def encode_slope(self, value):
        return 0.5 / np.sqrt(np.maximum(value, 1e-300))


register(CubicSlope())
register(PowerSlope())
register_metric(Root)
