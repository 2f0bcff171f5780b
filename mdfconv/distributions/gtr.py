"""The generalized Trowbridge-Reitz distribution."""

from __future__ import annotations

from typing import Any

import numpy as np

from mdfconv.distributions import ggx
from mdfconv.distributions.angles import Angles
from mdfconv.distributions.base import Distribution, Equivalent, Printed, gamma_parameter
from mdfconv.distributions.elementary import exp_of_product, log1p
from mdfconv.distributions.evaluation import Array, inverse_square
from mdfconv.distributions.parameter import Parameter


def _printed_constant(alpha: Any, gamma: Any) -> Any:
    k = (gamma - 1) * (alpha**2 - 1) / (np.pi * (1 - alpha ** (2 * (1 - gamma))))
    return k / alpha ** (2 * gamma)


class GTR(Distribution):
    """GGX with a free exponent γ: Burley 2012.

    Unit form, with x = sin²β (1−α²)/α²::

        D̄ = [α² / (α² + (1−α²) sin²β)]^γ = (1 + x)^(−γ).

    γ = 2 is GGX. D = k / (1+(α²−1) cos²β)^γ is normalized by::

        k = (γ−1) (α²−1) / (π (1 − α^(2(1−γ)))),   (α²−1) / (π ln α²) at γ = 1.

    The constant 1/π · α² printed in Sawicki 2021 (Table 1) is right at γ = 2 only. With
    X = (1−α²)/α² the cumulative distribution is
    F = [1 − (1+x)^(1−γ)] / [1 − (1+X)^(1−γ)], ln(1+x)/ln(1+X) at γ = 1.
    """

    name = "gtr"
    aliases = ("generalized-trowbridge-reitz",)
    unit_formula = "[α² / (α² + (1−α²) sin²β)]^γ"
    normalized_formula = "k / (1 + (α²−1) cos²β)^γ, k = (γ−1)(α²−1) / (π (1 − α^(2(1−γ))))"
    source = "Burley 2012"
    parameters = (
        Parameter("alpha", "C_TR", (0.01, 0.8), upper=1.0, upper_closed=True),
        # Towards γ → ∞ it becomes a Gaussian in sin β: α and γ can no longer be told apart.
        # Towards 0 it becomes uniform. Beyond either end 1 − γ and the constants lose their digits.
        gamma_parameter(typical=(1.5, 3.0), limits=(1e-6, 1e6), fitted=(0.25, 64.0)),
    )
    operations = 24
    printed = Printed(
        lambda beta, alpha, gamma: (alpha**2 / (np.cos(beta) ** 2 * (alpha**2 - 1) + 1)) ** gamma,
        _printed_constant,
        cosine=ggx.printed_cosine,
        from_cosine=ggx.printed_from_cosine,
        peak_alpha=lambda alpha, gamma: 1 / np.sqrt(np.pi * _printed_constant(alpha, gamma)),
    )

    @property
    def equivalent(self) -> Equivalent | None:
        """GGX at γ = 2."""
        return ggx.ggx_at_two(self)

    def _lobe(self, angles: Angles, parameter: Array, out: Array | None = None) -> Array:
        scale = inverse_square(parameter)
        if np.size(self.gamma) == 1 and self.gamma == 2:
            return ggx.trowbridge_reitz(angles, scale, out)
        # exp(−γ ln(1 + x)), x = sin²β (1−α²)/α²
        x = angles.sine_square * (scale * ((1 - parameter) * (1 + parameter)))
        return exp_of_product(log1p(x), -self.gamma, out)

    def _at_normal(self, parameter: Array) -> Array:
        # k α^(−2γ) = (1−α²)/(L α²π) · 1/φ(y L) with L = −ln α², y = γ−1: each factor tends to 1
        # (times 1/α²π) as α → 1 or γ → 1.
        log_square = -2 * np.log(parameter)
        first = _ratio((1 - parameter) * (1 + parameter), log_square)
        return first / _phi((self.gamma - 1) * log_square) / (np.pi * parameter * parameter)

    def _lobe_and_log_slope(self, angles: Angles, parameter: Array) -> tuple[Array, Array]:
        ratio = angles.sine_square * inverse_square(parameter)
        x = ratio * ((1 - parameter) * (1 + parameter))
        value = exp_of_product(log1p(x), -self.gamma)
        return value, 2 * self.gamma * ratio / (1 + x)

    def _log_slope_at_normal(self, parameter: Array) -> Array:
        log_square = -2 * np.log(parameter)
        square = np.square(parameter)
        # Both brackets are differences of poles: their limits as α → 1 and as y → 0.
        first = np.where(parameter > 1 - 1e-6, 1, 2 / log_square - 2 * square / (1 - square))
        y = (self.gamma - 1) * log_square
        return first - 2 * (self.gamma - 1) * _bernoulli(y) - 2

    def _cumulative(self, angles: Angles, parameter: Array) -> tuple[Array, Array]:
        # With z = ln(1+x), Z = ln(1+X), y = γ−1 and φ(u) = (1 − e^(−u))/u:
        # F = z φ(yz) / (Z φ(yZ)), 1 − F = e^(−yz) (Z−z) φ(y (Z−z)) / (Z φ(yZ)).
        square = angles.tangent_square
        cosine_square = 1 / (1 + square)
        largest = ((1 - parameter) * (1 + parameter)) * inverse_square(parameter)
        x = square * cosine_square * largest
        z, whole = np.log1p(x), np.log1p(largest)
        rest = np.log1p(largest * cosine_square / (1 + x))
        y = self.gamma - 1
        scale = _phi(y * whole)
        # At α = 1 the lobe is uniform: the shares are sin²β and cos²β.
        uniform = largest == 0
        safe = np.where(uniform, 1, whole)
        lobe = np.where(uniform, square * cosine_square, z / safe) * _phi(y * z) / scale
        tail = np.where(uniform, cosine_square, rest / safe) * _phi(y * rest) / scale
        return lobe, tail * np.exp(-y * z)

    def _quantile(self, lobe: Array, tail: Array, parameter: Array) -> Array:
        # (1+x)^(−y) = 1 − F (1 − (1+X)^(−y)); ln(1+x) = F ln(1+X) at γ = 1.
        largest = ((1 - parameter) * (1 + parameter)) * inverse_square(parameter)
        whole, y = np.log1p(largest), self.gamma - 1
        span = -np.expm1(-y * whole)
        if y == 0:
            z, rest = lobe * whole, tail * whole
        else:
            # From the horizon inwards: (1+x)^(−y) = (1+X)^(−y) + (1 − F) (1 − (1+X)^(−y)), whose
            # logarithm has no digits where all of it is nearly 1.
            near = (lobe < tail) | (y * whole < 1)
            inwards = np.log(np.where(near, 1, np.exp(-y * whole) + tail * span))
            z = -np.where(near, np.log1p(-np.where(near, lobe, 0) * span), inwards) / y
            rest = np.log1p(tail * np.expm1(y * whole)) / y
        uniform = largest == 0
        scale = np.where(uniform, 1, largest)
        sine_square = np.where(uniform, lobe, np.expm1(z) / scale)
        cosine_square = np.where(uniform, tail, np.expm1(rest) * np.exp(z) / scale)
        # The larger of the two is what the smaller one leaves.
        low = sine_square < 0.5
        cosine_square = np.where(low, 1 - sine_square, cosine_square)
        sine_square = np.where(low, sine_square, 1 - cosine_square)
        return np.arctan2(np.sqrt(sine_square), np.sqrt(cosine_square))

    def smith_lambda(self, tangent: Array, parameter: float | Array) -> Array:
        """Return Λ, that of GGX at γ = 2."""
        if self.equivalent:
            return ggx.trowbridge_reitz_lambda(parameter * tangent)
        return super().smith_lambda(tangent, parameter)

    def _half_tangent(self, parameter: Array) -> Array:
        # t² = e α² / (1 − (1+e) α²), e = 2^(1/γ) − 1
        excess = np.expm1(np.log(2) / self.gamma)
        return parameter * np.sqrt(excess / (1 - (1 + excess) * np.square(parameter)))

    def _from_half_tangent(self, tangent: Array) -> Array:
        excess = np.expm1(np.log(2) / self.gamma)
        return tangent / np.sqrt(excess + (1 + excess) * np.square(tangent))


def _phi(u: Array) -> Array:
    """Return (1 − e^(−u))/u, 1 at 0."""
    return _ratio(-np.expm1(-u), np.asarray(u))


def _bernoulli(y: Array) -> Array:
    """Return 1/y − 1/(e^y − 1), which is ½ − y/12 near 0."""
    small = np.abs(y) < 1e-4
    safe = np.where(small, 1, y)
    return np.where(small, 0.5 - y / 12, 1 / safe - 1 / np.expm1(safe))


def _ratio(numerator: Array, denominator: Array) -> Array:
    """Return numerator/denominator, 1 where both vanish."""
    at_limit = denominator == 0
    return np.where(at_limit, 1, numerator / np.where(at_limit, 1, denominator))


DISTRIBUTIONS = (GTR(),)
