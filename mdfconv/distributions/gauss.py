"""The Gaussian distribution of angles."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial
from typing import Any

import numpy as np

from mdfconv.distributions.angles import Angles
from mdfconv.distributions.base import Distribution, MapVariables, Printed
from mdfconv.distributions.elementary import exp_of_product
from mdfconv.distributions.evaluation import Array, gauss_legendre, inverse_square
from mdfconv.distributions.parameter import Parameter
from mdfconv.distributions.table import TO_ROUNDING, PolynomialTable, filled

_NODES = 80
# π/2 is this beyond its double.
_HALF_PI_REST = 6.123233995736766e-17
# From this m on a lobe is nearly uniform, and a few nodes integrate it exactly.
_WIDE, _WIDE_NODES = 4.0, 16
# Below this square of m a lobe is as one that has it.
_LEAST_SQUARE = 1e-16
# Nodes for e^(−v) times a smooth function up to v = 50, from where on it is nothing.
_LONGEST, _CUMULATIVE_NODES = 50.0, 64


def _printed_constant(m: Any) -> Any:
    log_cosine = np.log(np.cos(m * np.sqrt(np.log(2)).astype(m.dtype)))
    return (2 * log_cosine - float(np.log(2))) / (2 * np.pi * log_cosine)


class Gauss(Distribution):
    """A Gaussian in the angle itself: Torrance & Sparrow 1967.

    Unit form::

        D̄ = e^(−β²/m²),   C_TS = 1/m.

    Normalized by 1/(π Z), Z = ∫ e^(−β²/m²) sin 2β dβ over [0, π/2]. Completing the square gives Z
    and the cumulative distribution through the Faddeeva function, but the latter as a difference;
    here F and 1 − F are integrals of e^(−u/m²) sin(2√u)/(2√u) over u = β², which have positive
    terms only.

    Sawicki 2021 (Table 1) uses another constant, borrowed from Blinn/Phong at equal half angle:
    with it ∫ D cos β dω is 1.0005 at m_G = 0.05, 1.008 at 0.2, 1.027 at 0.4, 1.045 at 0.7.
    """

    name = "gauss"
    aliases = ("torrance-sparrow",)
    unit_formula = "exp(−β²/m²)"
    normalized_formula = "exp(−β²/m²) / (π ∫ exp(−β²/m²) sin 2β dβ)"
    source = "Torrance & Sparrow 1967"
    parameters = (Parameter("width", "m_G", (0.01, 0.8)),)
    operations = 23
    map_variables = MapVariables(
        concentration=lambda m: 1 / (m * m),
        from_map=lambda x, product: x / np.sqrt(product),
    )
    printed = Printed(
        lambda beta, m: np.exp(-(beta**2) / m**2),
        _printed_constant,
        cosine=lambda m: np.cos(m * np.sqrt(np.log(2)).astype(m.dtype)),
        from_cosine=lambda c: np.arccos(c) / np.sqrt(np.log(2)).astype(c.dtype),
        peak_alpha=lambda m: 1 / np.sqrt(np.pi * _printed_constant(m)),
    )

    def _lobe(self, angles: Angles, parameter: Array, out: Array | None = None) -> Array:
        return exp_of_product(angles.beta_square, -inverse_square(parameter), out)

    def _at_normal(self, parameter: Array) -> Array:
        return 1 / (np.pi * _sine_integral(parameter))

    def _lobe_and_log_slope(self, angles: Angles, parameter: Array) -> tuple[Array, Array]:
        scale = inverse_square(parameter)
        return exp_of_product(angles.beta_square, -scale), angles.beta_square * (2 * scale)

    def _log_slope_at_normal(self, parameter: Array) -> Array:
        # −∂ ln Z/∂ ln m as a mean: differences of Faddeeva functions cancel for large m.
        return -2 * _of_square(_mean_square, parameter, scaled=False) / (1 + np.square(parameter))

    def _cumulative(self, angles: Angles, parameter: Array) -> tuple[Array, Array]:
        # The whole integral is the longer of the two parts plus the other.
        angle, m = np.broadcast_arrays(angles.beta, parameter)
        to_horizon = (0.5 * np.pi - angle) + _HALF_PI_REST
        below = _slab_integral(np.zeros_like(angle), angle, 0.5 * np.pi + 0 * angle, m)
        above = _slab_integral(angle, to_horizon, to_horizon, m)
        whole = below + above
        return below / whole, above / whole

    def cumulative_with_slope(self, angles: Angles, parameter: Array) -> tuple[Array, Array]:
        """Return F and ∂F/∂ ln m, as in the base class, to 1e-15 of the whole.

        The completed square is quick, and a fit asks for no digits of the tail.
        """
        from scipy.special import wofz

        def primitive(angle: Array) -> tuple[Array, Array]:
            # Im[w(m) − e^(−b²/m²) e^(2ib) w(m + ib/m)] over Im[…] at π/2, and its slope with
            # w′ = −2zw + 2i/√π.
            z = parameter + 1j * angle / parameter
            w = wofz(z)
            factor = np.exp(-np.square(angle / parameter) + 2j * angle)
            turned = z.conjugate() * (2j / np.sqrt(np.pi) - 2 * z * w)
            slope = 2 * np.square(angle / parameter) * w + turned
            return (factor * w).imag, (factor * slope).imag

        beta, horizon = angles.beta, np.full_like(parameter, 0.5 * np.pi)
        start, middle, end = (primitive(b) for b in (0 * horizon, beta, horizon))
        whole, whole_slope = start[0] - end[0], start[1] - end[1]
        share = (start[0] - middle[0]) / whole
        slope = (start[1] - middle[1] - share * whole_slope) / whole
        wide = parameter[..., 0] > _WIDE
        if wide.any():
            beta = np.broadcast_to(beta, slope.shape)
            slope[wide] = self._wide_slope(beta[wide], parameter[wide])
        return share, slope

    def _wide_slope(self, beta: Array, parameter: Array) -> Array:
        """Return ∂F/∂ ln m of nearly uniform lobes, where the differences above cancel."""
        x, weight = gauss_legendre(_WIDE_NODES)
        b = 0.5 * beta[..., None] * (1 + x)
        excess = np.square(b) - _mean_square(parameter)[..., None]
        mass = np.exp(-np.square(b / parameter[..., None])) * np.sin(2 * b) * excess
        integral = 0.5 * beta * (mass @ weight)
        return 2 * np.pi * self._at_normal(parameter) * integral / np.square(parameter)

    def _half_tangent(self, parameter: Array) -> Array:
        beta_half = parameter * np.sqrt(np.log(2))
        return np.tan(np.where(beta_half <= np.pi / 2, beta_half, np.nan))

    def _from_half_tangent(self, tangent: Array) -> Array:
        return np.arctan(tangent) / np.sqrt(np.log(2))

    def _peak_alpha(self, parameter: Array) -> Array:
        return np.sqrt(_sine_integral(parameter))


def _sine_integral(parameter: Array) -> Array:
    """Return ∫ e^(−β²/m²) sin 2β dβ over [0, π/2]."""
    return _of_square(_mass, parameter, scaled=True)


def _of_square(function: Callable[[Array], Array], parameter: Array, *, scaled: bool) -> Array:
    """Return a function of m that is about m² for a smooth lobe; or that over x = m²/(1 + m²)."""
    with np.errstate(all="ignore"):
        x = np.ravel(1 / (1 + 1 / np.square(np.asarray(parameter, dtype=float))))
        ratio = filled(_table(function)(x), lambda rows: _ratio(function, x[rows]))
        value = ratio * x if scaled else ratio
    return value.astype(parameter.dtype).reshape(parameter.shape)[()]


@cache
def _table(function: Callable[[Array], Array]) -> PolynomialTable:
    """Return a function of m over x = m²/(1 + m²), as a function of x."""
    return PolynomialTable(partial(_ratio, function), *TO_ROUNDING)


def _ratio(function: Callable[[Array], Array], x: Array) -> Array:
    x = np.maximum(x, _LEAST_SQUARE)
    return function(np.sqrt(x / (1 - x))) / x


def _slab_integral(start: Array, length: Array, to_horizon: Array, m: Array) -> Array:
    """Return ∫ e^(−b²/m²) sin 2b db from an angle on, over a length.

    `to_horizon` is π/2 − start, which near the horizon keeps the digits of sin 2b.
    """
    x, weight = gauss_legendre(_CUMULATIVE_NODES)
    # Over u = b²: b² − start² = (b − start)(b + start).
    span = np.minimum(length * (2 * start + length), _LONGEST * np.square(m))[..., None]
    step = 0.5 * span * (1 + x)
    # An angle whose square underflows is as good as this one.
    b = np.sqrt(np.maximum(np.square(start)[..., None] + step, 1e-300))
    advance = step / (b + start[..., None])
    to_zero = np.minimum(b, to_horizon[..., None] - advance)
    mass = np.exp(-step / np.square(m)[..., None]) * np.sin(2 * to_zero) / (2 * b)
    return np.exp(-np.square(start / m)) * np.sum(span * weight * mass, axis=-1)


def _mass(parameter: Array) -> Array:
    """Return ∫ e^(−β²/m²) sin 2β dβ over [0, π/2]."""
    return _weighted(parameter)[0]


def _mean_square(parameter: Array) -> Array:
    """Return the mean of β² under the weight e^(−β²/m²) sin 2β on [0, π/2]."""
    mass, moment = _weighted(parameter)
    return moment / mass


def _weighted(parameter: Array) -> tuple[Array, Array]:
    """Return ∫ of the weight e^(−β²/m²) sin 2β over [0, π/2], and of β² times it."""
    x, weight = gauss_legendre(_NODES)
    # Beyond 12 m, or π/2, the weight is nothing.
    reach = np.minimum(12 * parameter[..., None], 0.5 * np.pi)
    beta = 0.5 * reach * (1 + x)
    mass = np.sin(2 * beta) * np.exp(-np.square(beta / parameter[..., None]))
    mass *= 0.5 * reach * weight
    return np.sum(mass, axis=-1), np.sum(mass * np.square(beta), axis=-1)


DISTRIBUTIONS = (Gauss(),)
