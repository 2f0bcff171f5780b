"""Sawicki's rational distribution."""

from __future__ import annotations

from functools import cache

import numpy as np

from mdfconv.distributions import base
from mdfconv.distributions.angles import Angles
from mdfconv.distributions.evaluation import Array
from mdfconv.distributions.parameter import Parameter
from mdfconv.distributions.table import TO_ROUNDING, PolynomialTable, filled

_NEWTON_STEPS = 12


class Sawicki(base.Distribution):
    """A Padé-like stand-in for the power of the cosine: Sawicki 2006.

    Unit form, with c = cos β and v = 1 − c::

        D̄ = 256 c / ((1−N) c + N + 3)⁴ = c / (1 + ¼ (N−1) v)⁴.

    Normalized by 96 (3+N) / (256 π); F = 1 − [c / (1 + ¼ (N−1) v)]³. The second form has no
    difference of large numbers.
    """

    name = "sawicki"
    unit_formula = "256 cos β / ((1−N) cos β + N + 3)⁴"
    normalized_formula = "96 (3+N) cos β / (π ((1−N) cos β + N + 3)⁴)"
    source = "Sawicki 2006"
    parameters = (Parameter("exponent", "N_DS", (1.0, 1e4), larger_is_smoother=True),)
    operations = 6
    map_variables = base.MapVariables(
        width=lambda n: np.sqrt(8 / (3 * n + 9)),
        from_width=lambda x: 8 / (3 * x * x) - 3,
        concentration=base.same,
        from_map=lambda x, product: product / (x * x),
        scale=lambda x: 1 / (x * x),
    )
    printed = base.Printed(
        lambda beta, n: 256 * np.cos(beta) / ((1 - n) * np.cos(beta) + n + 3) ** 4,
        lambda n: 96 * (3 + n) / (256 * np.pi),
        from_cosine=lambda c: (c + 3 - 4 * (2 * c) ** 0.25) / (c - 1),
        peak_alpha=lambda n: np.sqrt(8 / (3 * (n + 3))),
        from_peak_alpha=lambda alpha: 8 / (3 * alpha**2) - 3,
    )

    def _lobe(self, angles: Angles, parameter: Array, out: Array | None = None) -> Array:
        value = np.multiply(angles.versine, 0.25 * (parameter - 1), out=out)
        value += 1
        np.square(value, out=value)
        np.square(value, out=value)
        return np.divide(angles.cosine, value, out=value)

    def _at_normal(self, parameter: Array) -> Array:
        return 3 * (3 + parameter) / (8 * np.pi)

    def _lobe_and_log_slope(self, angles: Angles, parameter: Array) -> tuple[Array, Array]:
        fall = angles.versine * (0.25 * (parameter - 1))
        fall += 1
        slope = angles.versine * -parameter
        slope /= fall
        np.square(fall, out=fall)
        np.square(fall, out=fall)
        return np.divide(angles.cosine, fall, out=fall), slope

    def _log_slope_at_normal(self, parameter: Array) -> Array:
        return parameter / (parameter + 3)

    def _cumulative(self, angles: Angles, parameter: Array) -> tuple[Array, Array]:
        drop = angles.versine
        k = 0.25 * (parameter - 1)
        # With q = 1 − c/(1+kv) both are sums of positive terms.
        ratio = angles.cosine / (1 + k * drop)
        q = (1 + k) * drop / (1 + k * drop)
        return q * (3 * ratio + q * q), ratio**3

    def cumulative_with_slope(self, angles: Angles, parameter: Array) -> tuple[Array, Array]:
        """Return F and ∂F/∂ ln N_DS, as in the base class."""
        share, tail = self._cumulative(angles, parameter)
        drop = angles.versine
        return share, 0.75 * parameter * tail * drop / (1 + 0.25 * (parameter - 1) * drop)

    def _quantile(self, lobe: Array, tail: Array, parameter: Array) -> Array:
        # 1 − q for q³ of the tail, from the side that has the digits.
        q = -np.expm1(-base.negative_log_tail(lobe, tail) / 3)
        k = 0.25 * (parameter - 1)
        drop = q / (1 + k * (1 - q))
        return 2 * np.arcsin(np.sqrt(0.5 * drop))

    def _half_tangent(self, parameter: Array) -> Array:
        h = 4 / (parameter + 3)
        ratio = _half_ratios()(0.75 * h)
        return np.sqrt(h) * filled(ratio, lambda rows: _half_ratio(h[rows]))

    def _from_half_tangent(self, tangent: Array) -> Array:
        # Sawicki 2021, eq. (10), as 1 + 4 ((2c)^¼ − 1)/(1 − c), which stays accurate as c → 1.
        secant = np.sqrt(1 + np.square(tangent))
        drop = np.square(tangent) / (secant * (1 + secant))
        return 1 + 4 * (np.sqrt(np.sqrt(2 / secant)) - 1) / drop

    def _peak_alpha(self, parameter: Array) -> Array:
        return np.sqrt(8 / (3 * (3 + parameter)))

    def _from_peak_alpha(self, alpha: Array) -> Array:
        return 8 / (3 * np.square(alpha)) - 3


def _half_ratio(h: Array) -> Array:
    """Return tan β_half/√h for h = 4/(N+3)."""
    # v = 1 − cos β_half = h g solves ½ (1 + (1−h) g)⁴ = 1 − h g. The difference is convex and rises
    # in g, so Newton steps from 1, right of the root, close in on it.
    g = np.ones_like(h)
    for _ in range(_NEWTON_STEPS):
        base = 1 + (1 - h) * g
        g = g - (0.5 * base**4 - 1 + h * g) / (2 * (1 - h) * base**3 + h)
    return np.sqrt(g * (2 - h * g)) / (1 - h * g)


@cache
def _half_ratios() -> PolynomialTable:
    """Return tan β_half/√h as a function of ¾ h."""
    return PolynomialTable(lambda x: _half_ratio(x / 0.75), *TO_ROUNDING)


DISTRIBUTIONS = (Sawicki(),)
