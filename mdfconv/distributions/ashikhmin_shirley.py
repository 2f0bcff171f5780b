"""The Ashikhmin-Shirley distribution."""

from __future__ import annotations

import numpy as np

from mdfconv.distributions.base import AnisotropicDistribution, Equivalent
from mdfconv.distributions.blinn_phong import BlinnPhong
from mdfconv.distributions.evaluation import Array
from mdfconv.distributions.parameter import Parameter


class AshikhminShirley(BlinnPhong, AnisotropicDistribution):
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
    equivalent = Equivalent("blinn-phong")

    def _lobe_pair(self, beta: Array, x: Array, y: Array, phi: Array, out: Array) -> None:
        self._lobe(beta, x * np.square(np.cos(phi)) + y * np.square(np.sin(phi)), out)

    def _at_normal_pair(self, x: Array, y: Array) -> Array:
        return np.sqrt(x + 2) * np.sqrt(y + 2) / (2 * np.pi)


DISTRIBUTION = AshikhminShirley()
