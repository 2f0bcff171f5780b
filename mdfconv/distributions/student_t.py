"""The Student-t distribution of slopes."""

from __future__ import annotations

from typing import Any

import numpy as np

from mdfconv.distributions import base
from mdfconv.distributions.angles import Angles
from mdfconv.distributions.elementary import exp_of_product, log1p, one_minus_exp_of_product
from mdfconv.distributions.evaluation import Array, inverse_square
from mdfconv.distributions.ggx import ggx_at_two, trowbridge_reitz_lambda
from mdfconv.distributions.parameter import Parameter

# tan²β of an angle that no double tells from π/2.
_LARGEST_SQUARE = 1e34
# Of a search for β_half: its steps, and how short the last one is, whose square is left.
_MOST_STEPS, _LAST_STEP = 64, 1e-9


def _printed_unit(beta: Any, alpha: Any, gamma: Any) -> Any:
    square = np.tan(beta) ** 2
    value = (gamma - 1) ** gamma * alpha ** (2 * gamma)
    value = value / (np.cos(beta) ** 4 * ((gamma - 1) * alpha**2 + square) ** gamma)
    off_axis = 2 * (gamma - 1) * alpha**2 > gamma
    top = np.where(off_axis, (2 * (gamma - 1) * alpha**2 - gamma) / (gamma - 2), 0)
    maximum = (1 + top) ** 2 * (1 + top / ((gamma - 1) * alpha**2)) ** -gamma
    return np.where(off_axis, value / maximum, value)


class StudentT(base.AlphaDistribution):
    """Slopes with the tails of a Student-t distribution: Ribardière et al. 2017.

    With t = tan β and x = t²/((γ−1) α²)::

        D̄ = (1+t²)² (1 + x)^(−γ),   F = 1 − (1 + x)^(1−γ),

    the unit form divided by its maximum where α² > γ/(2(γ−1)), from where on that lies at
    t² = (2(γ−1)α² − γ)/(γ−2). Normalized by 1/(π α²). γ = 2 is GGX and γ → ∞ Beckmann; below 2
    D is unbounded at grazing. The printed (γ−1)^γ α^(2γ−2) / (π cos⁴β ((γ−1) α² + t²)^γ)
    overflows where γ is large; here only ln(1+x) is multiplied by γ.
    """

    name = "student-t"
    aliases = ("t-distribution",)
    unit_formula = "(1+tan²β)² (1 + tan²β/((γ−1)α²))^(−γ), over its maximum where α² > γ/(2(γ−1))"
    normalized_formula = "(γ−1)^γ α^(2γ−2) / (π cos⁴β ((γ−1)α² + tan²β)^γ)"
    source = "Ribardière et al. 2017"
    parameters = (
        Parameter("alpha", "α", (0.01, 0.8)),
        # Towards γ → ∞ it becomes Beckmann: the tails no longer tell γ, and 1/γ loses its digits.
        base.gamma_parameter(typical=(2.0, 10.0), limits=(2.0, 1e6), fitted=(2.0, 512.0)),
    )
    operations = 26
    scales_with_slope = True
    printed = base.Printed.of_alpha(
        _printed_unit,
        from_cosine=lambda c, gamma: (
            np.tan(np.arccos(c)) / np.sqrt((gamma - 1) * ((2 / c**4) ** (1 / gamma) - 1))
        ),
    )

    @property
    def equivalent(self) -> base.Equivalent | None:
        """GGX at γ = 2."""
        return ggx_at_two(self)

    def _lobe(self, angles: Angles, parameter: Array, out: Array | None = None) -> Array:
        # [(1+t²)/(1+x) · (1+x)^(1−½γ)]²: an exponential multiplies the rounding of its exponent, so
        # that what cancels does so before it; the whole power would underflow at grazing.
        x = self._x(angles, parameter)
        value = np.divide(1 + angles.tangent_square, 1 + x, out=out)
        if np.size(self.gamma) > 1 or self.gamma != 2:
            power = log1p(x)
            value *= exp_of_product(power, 1 - 0.5 * self.gamma, power)
        return np.square(value, out=value)

    def _lobe_and_log_slope(self, angles: Angles, parameter: Array) -> tuple[Array, Array]:
        x = self._x(angles, parameter)
        power = exp_of_product(log1p(x), -0.5 * self.gamma)
        value = np.square((1 + angles.tangent_square) * power)
        return value, 2 * self.gamma * x / (1 + x)

    def _cumulative(self, angles: Angles, parameter: Array) -> tuple[Array, Array]:
        x = self._x(angles, parameter)
        arguments = log1p(x), 1 - self.gamma
        return one_minus_exp_of_product(*arguments), exp_of_product(*arguments)

    def _x(self, angles: Angles, parameter: Array) -> Array:
        """Return t²/((γ−1) α²), finite, so that 0 times its logarithm is 0."""
        x = angles.tangent_square * (inverse_square(parameter) / (self.gamma - 1))
        return np.minimum(x, np.finfo(x.dtype).max, out=x)

    def _quantile(self, lobe: Array, tail: Array, parameter: Array) -> Array:
        x = np.expm1(base.negative_log_tail(lobe, tail) / (self.gamma - 1))
        return np.arctan(parameter * np.sqrt((self.gamma - 1) * x))

    def smith_lambda(self, tangent: Array, parameter: float | Array) -> Array:
        """Return Λ, that of GGX at γ = 2."""
        if self.equivalent:
            return trowbridge_reitz_lambda(parameter * tangent)
        return super().smith_lambda(tangent, parameter)

    def mode(self, parameter: Array) -> Array:
        """Return the angle of the maximum, 0 while α² ≤ γ/(2(γ−1))."""
        return np.arctan(np.sqrt(self._mode_square(parameter)))

    def _mode_square(self, parameter: Array) -> Array:
        """Return tan²β of the maximum."""
        with np.errstate(all="ignore"):
            top = 2 * (self.gamma - 1) * np.square(parameter) - self.gamma
            square = np.where(top > 0, top / (self.gamma - 2), 0)
        return np.minimum(square, _LARGEST_SQUARE)

    def _off_axis_maximum(self, parameter: Array) -> Array | None:
        off_axis = self._mode_square(parameter) > 0
        if not off_axis.any():
            return None
        # With q = (γ−1)α² − 1 the two powers at t² become
        # (2 (q+1)/γ)² [(γ−2)(q+1)/(γ q)]^(γ−2), which is α⁴ at γ = 2.
        power = self.gamma - 2
        q = np.where(off_axis, (self.gamma - 1) * np.square(parameter) - 1, 1)
        ratio = np.maximum((power - 2 * q) / (self.gamma * q), -1)
        second = np.where(power > 0, power * np.log1p(np.where(power > 0, ratio, 0)), 0)
        maximum = np.square(2 * (q + 1) / self.gamma) * np.exp(second)
        return np.where(off_axis, maximum, 1)

    def _log_slope_off_axis(self, parameter: Array) -> Array:
        x = self._mode_square(parameter) * (inverse_square(parameter) / (self.gamma - 1))
        return 2 * self.gamma * x / (1 + x)

    def _half_tangent(self, parameter: Array) -> Array:
        # (1+x)^γ = 2 (1+t²)² in y = ln(1+x): γ y = ln 2 + 2 ln(1 + k (e^y − 1)), k = (γ−1) α².
        # For k ≤ 1 the difference is concave and rises: Newton steps from 0 close in from below.
        # For more it is convex, and they do from above: from where it were 0 for k e^y in the place
        # of 1 + k (e^y − 1).
        k = (self.gamma - 1) * np.square(parameter)
        y = np.where(k > 1, (np.log(2) + 2 * np.log(k)) / (self.gamma - 2), 0)
        for _ in range(_MOST_STEPS):
            rise = k * np.expm1(y)
            slope = self.gamma - 2 * (rise + k) / (1 + rise)
            step = (np.log(2) + 2 * np.log(1 + rise) - self.gamma * y) / slope
            y = y + step
            arrived = np.abs(step) <= _LAST_STEP * y
            if arrived.all():
                break
        tangent = np.sqrt(k * np.expm1(y))
        return np.where(arrived & (tangent < np.inf), tangent, np.nan)

    def _from_half_tangent(self, tangent: Array) -> Array:
        # (1+x)^γ = 2 (1+t²)²
        square = np.square(tangent)
        x = np.expm1((np.log(2) + 2 * np.log(1 + square)) / self.gamma)
        return tangent / np.sqrt((self.gamma - 1) * x)


DISTRIBUTIONS = (StudentT(),)
