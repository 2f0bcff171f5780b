"""The generalized Trowbridge-Reitz distribution."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mdfconv.distributions.base import Distribution
from mdfconv.distributions.evaluation import Array, evaluate, inverse_square, tangent_square
from mdfconv.distributions.ggx import trowbridge_reitz
from mdfconv.distributions.parameter import Parameter
from mdfconv.errors import MdfconvError


class GTR(Distribution):
    """GGX with a free exponent γ: Burley 2012.

    Unit form, with x = sin²β (1−α²)/α²::

        D̄ = [α² / (α² + (1−α²) sin²β)]^γ = (1 + x)^(−γ).

    γ = 2 is GGX. D = k / (1+(α²−1) cos²β)^γ is normalized by::

        k = (γ−1) (α²−1) / (π (1 − α^(2(1−γ)))),   (α²−1) / (π ln α²) at γ = 1.

    The constant 1/π · α² printed in Sawicki 2021 (Table 1) is right at γ = 2 only.

    Parameters
    ----------
    gamma : float
        The exponent γ > 0 that applies where a call gives none.
    """

    name = "gtr"
    aliases = ("generalized-trowbridge-reitz",)
    unit_formula = "[α² / (α² + (1−α²) sin²β)]^γ"
    normalized_formula = "k / (1 + (α²−1) cos²β)^γ, k = (γ−1)(α²−1) / (π (1 − α^(2(1−γ))))"
    source = "Burley 2012"
    parameter = Parameter("alpha", "C_TR", upper=1.0, upper_closed=True, usual="0 < C_TR ≤ 1")
    operations = 24
    exponent = Parameter("gamma", "γ", usual="1.5 ≤ γ ≤ 3")

    def __init__(self, gamma: float = 2.0) -> None:
        self.gamma = self.exponent.check_one(gamma, self.name)

    def unit(
        self,
        beta: ArrayLike,
        parameter: Any,
        *,
        phi: ArrayLike | None = None,
        gamma: ArrayLike | None = None,
    ) -> Any:
        """Evaluate the unit form; as `Distribution.unit`, with the exponent γ > 0."""
        return self._evaluate_gamma(self._lobe_gamma, beta, parameter, phi, gamma)

    def normalized(
        self,
        beta: ArrayLike,
        parameter: Any,
        *,
        phi: ArrayLike | None = None,
        gamma: ArrayLike | None = None,
    ) -> Any:
        """Evaluate the normalized form, 1/sr; as `Distribution.normalized`, with γ > 0."""
        return self._evaluate_gamma(self._normalized_gamma, beta, parameter, phi, gamma)

    def _evaluate_gamma(
        self, kernel: Any, beta: ArrayLike, parameter: Any, phi: Any, gamma: ArrayLike | None
    ) -> Any:
        if phi is not None or isinstance(parameter, tuple):
            raise MdfconvError("gtr is isotropic: it takes one parameter and no azimuth")
        alpha = self.parameter.check(parameter, self.name)
        exponent = self.exponent.check(self.gamma if gamma is None else gamma, self.name)
        return evaluate(kernel, beta, alpha, exponent)

    def _lobe(self, beta: Array, parameter: Array, out: Array | None = None) -> Array:
        return self._lobe_gamma(beta, parameter, np.asarray(self.gamma), out)

    def _at_normal(self, parameter: Array) -> Array:
        return self._at_normal_gamma(parameter, self.gamma)

    def _lobe_gamma(
        self, beta: Array, alpha: Array, gamma: Array, out: Array | None = None
    ) -> Array:
        scale = inverse_square(alpha)
        if gamma.size == 1 and gamma == 2:
            return trowbridge_reitz(beta, scale, out)
        value = tangent_square(beta, out)
        value /= 1 + value
        value *= scale * ((1 - alpha) * (1 + alpha))
        np.log1p(value, out=value)
        value *= -gamma
        return np.exp(value, out=value)

    def _normalized_gamma(self, beta: Array, alpha: Array, gamma: Array, out: Array) -> None:
        self._lobe_gamma(beta, alpha, gamma, out)
        out *= self._at_normal_gamma(alpha, gamma)

    def _at_normal_gamma(self, alpha: Array, gamma: Array | float) -> Array:
        # k α^(−2γ) = (1−α²)/(L α²π) · y/(1−e^(−y)) with L = −ln α², y = (γ−1) L: each factor
        # tends to 1 (times 1/α²π) as α → 1 or γ → 1.
        log_square = -2 * np.log(alpha)
        first = _ratio((1 - alpha) * (1 + alpha), log_square)
        exponent = (gamma - 1) * log_square
        second = _ratio(exponent, -np.expm1(-exponent))
        return first * second * (1 / (np.pi * alpha * alpha))

    def _lobe_and_log_slope(self, beta: Array, parameter: Array) -> tuple[Array, Array]:
        ratio = np.square(np.sin(beta)) * inverse_square(parameter)
        x = ratio * ((1 - parameter) * (1 + parameter))
        return np.exp(-self.gamma * np.log1p(x)), 2 * self.gamma * ratio / (1 + x)

    def _log_slope_at_normal(self, parameter: Array) -> Array:
        log_square = -2 * np.log(parameter)
        square = np.square(parameter)
        # Both brackets are differences of poles: their limits as α → 1 and as y → 0.
        first = np.where(parameter > 1 - 1e-6, 1, 2 / log_square - 2 * square / (1 - square))
        y = (self.gamma - 1) * log_square
        return first - 2 * (self.gamma - 1) * _bernoulli(y) - 2

    def _half_tangent(self, parameter: Array) -> Array:
        excess = np.expm1(np.log(2) / self.gamma)
        return parameter * np.sqrt(excess / (1 - (1 + excess) * np.square(parameter)))

    def _from_half_tangent(self, tangent: Array) -> Array:
        excess = np.expm1(np.log(2) / self.gamma)
        return tangent / np.sqrt(excess + (1 + excess) * np.square(tangent))


def _bernoulli(y: Array) -> Array:
    """Return 1/y − 1/(e^y − 1), which is ½ − y/12 near 0."""
    small = np.abs(y) < 1e-4
    safe = np.where(small, 1, y)
    return np.where(small, 0.5 - y / 12, 1 / safe - 1 / np.expm1(safe))


def _ratio(numerator: Array, denominator: Array) -> Array:
    """Return numerator/denominator, 1 where both vanish."""
    at_limit = denominator == 0
    return np.where(at_limit, 1, numerator / np.where(at_limit, 1, denominator))


DISTRIBUTION = GTR()
