"""The Blinn/Phong distribution, and Ashikhmin/Shirley's with an exponent for each axis."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from mdfconv.distributions import base
from mdfconv.distributions.angles import Angles
from mdfconv.distributions.elementary import exp_of_product, log1p, one_minus_exp_of_product
from mdfconv.distributions.evaluation import Array
from mdfconv.distributions.parameter import REFLECTED, Parameter


class BlinnPhong(base.Distribution):
    """A power of the cosine: Phong 1975; Blinn 1977.

    Unit form::

        D̄ = cos^N β = exp(N ln cos β).

    Normalized by (N+2)/(2π); F = 1 − cos^(N+2) β. Near β = 0 the digits of ln cos β are those of
    1 − cos β, which the cosine has lost.
    """

    name = "blinn-phong"
    aliases = ("phong", "blinn")
    ambiguous: ClassVar = {
        "phong": "phong is taken for Blinn's exponent, of the half vector; that of the reflected "
        "ray, about a quarter, is blinn-phong:reflected"
    }
    meant_by: ClassVar = {
        **dict.fromkeys(("shininess", "specular-exponent", "exponent", "ns"), "blinn-phong"),
        **dict.fromkeys(("reflected", "phong-size", "cosine-power"), "blinn-phong:reflected"),
        **dict.fromkeys(("source-engine", "valve"), "blinn-phong:source-phong"),
        **dict.fromkeys(("pov-ray", "pov"), "blinn-phong:povray"),
        "nif": "blinn-phong:niftools",
    }
    unit_formula = "cos^N β"
    normalized_formula = "(N+2)/(2π) cos^N β"
    source = "Phong 1975; Blinn 1977; Lewis 1994"
    parameters = (Parameter("exponent", "N", (1.0, 1e4), larger_is_smoother=True),)
    encodings = (REFLECTED,)
    operations = 20
    map_variables = base.MapVariables(
        width=lambda n: np.sqrt(2 / (n + 2)),
        from_width=lambda x: 2 * (1 - x) * (1 + x) / (x * x),
        concentration=base.same,
        from_map=lambda x, product: product / (x * x),
        scale=lambda x: 1 / (x * x),
    )
    printed = base.Printed(
        lambda beta, n: np.cos(beta) ** n,
        lambda n: (n + 2) / (2 * np.pi),
        cosine=lambda n: 2 ** (-1 / n),
        from_cosine=lambda c: -float(np.log(2)) / np.log(c),
        peak_alpha=lambda n: np.sqrt(2 / (n + 2)),
        from_peak_alpha=lambda alpha: 2 / alpha**2 - 2,
    )

    def _lobe(self, angles: Angles, parameter: Array, out: Array | None = None) -> Array:
        return exp_of_product(angles.log_secant, -parameter, out)

    def _at_normal(self, parameter: Array) -> Array:
        return (parameter + 2) / (2 * np.pi)

    def _lobe_and_log_slope(self, angles: Angles, parameter: Array) -> tuple[Array, Array]:
        return self._lobe(angles, parameter), angles.log_secant * -parameter

    def _log_slope_at_normal(self, parameter: Array) -> Array:
        return parameter / (parameter + 2)

    def _cumulative(self, angles: Angles, parameter: Array) -> tuple[Array, Array]:
        arguments = angles.log_secant, -(parameter + 2)
        return one_minus_exp_of_product(*arguments), exp_of_product(*arguments)

    def cumulative_with_slope(self, angles: Angles, parameter: Array) -> tuple[Array, Array]:
        """Return F and ∂F/∂ ln N, as in the base class."""
        share = one_minus_exp_of_product(angles.log_secant, -(parameter + 2))
        return share, parameter * angles.log_secant * (1 - share)

    def _quantile(self, lobe: Array, tail: Array, parameter: Array) -> Array:
        exponent = 2 * base.negative_log_tail(lobe, tail) / (parameter + 2)
        return np.arctan(np.sqrt(np.expm1(exponent)))

    def _half_tangent(self, parameter: Array) -> Array:
        return np.sqrt(np.expm1(2 * np.log(2) / parameter))

    def _from_half_tangent(self, tangent: Array) -> Array:
        # Sawicki 2021, eq. (3): N = −ln 2 / ln cos β_half.
        return 2 * np.log(2) / log1p(np.square(tangent))

    def _peak_alpha(self, parameter: Array) -> Array:
        return np.sqrt(2 / (parameter + 2))

    def _from_peak_alpha(self, alpha: Array) -> Array:
        return 2 * (1 - alpha) * (1 + alpha) / np.square(alpha)


class AshikhminShirley(BlinnPhong, base.AnisotropicDistribution):
    """Blinn/Phong with an exponent for each axis: Ashikhmin & Shirley 2000.

    Unit form::

        D̄ = cos^p β,   p = N_x cos²φ + N_y sin²φ.

    Normalized by √((N_x+2)(N_y+2)) / 2π (Pharr et al. 2016). With one exponent it is
    Blinn/Phong.
    """

    name = "ashikhmin-shirley"
    aliases = ("anisotropic-blinn-phong", "anisotropic-phong")
    unit_formula = "cos^p β, p = N_x cos²φ + N_y sin²φ"
    normalized_formula = "√((N_x+2)(N_y+2))/(2π) cos^p β"
    source = "Ashikhmin & Shirley 2000; Pharr, Jakob & Humphreys 2016"
    parameters = (Parameter("exponents", "N", (1.0, 1e4), larger_is_smoother=True),)
    equivalent = base.Equivalent("blinn-phong")

    def _lobe_pair(self, angles: Angles, x: Array, y: Array, phi: Array, out: Array) -> None:
        self._lobe(angles, x * np.square(np.cos(phi)) + y * np.square(np.sin(phi)), out)

    def _at_normal_pair(self, x: Array, y: Array) -> Array:
        return np.sqrt(x + 2) * np.sqrt(y + 2) / (2 * np.pi)


DISTRIBUTIONS = (BlinnPhong(), AshikhminShirley())
