"""GGX in Beckmann's place under light whose angular power is a power law, smooth surfaces.

A lobe D blurs an environment: seen along the normal, it is a kernel D(θ/2)/4 over the incident
directions θ = 2β, which multiplies degree l of the environment's spherical harmonics by a factor
k_l (Ramamoorthi & Hanrahan 2001). Of a smooth surface that is a Hankel transform::

    k_l = 2π ∫ D(β) J₀(2lβ) β dβ

With D = exp(−β²/m²)/(π m²), Beckmann's, it is exp(−(ml)²); with D = 1/(π α² (1 + β²/α²)²), that of
GGX, it is x K₁(x) for x = 2αl. The squared error Σ (2l+1) l^−p (Δk_l)² becomes an integral over l,
and its minimum over the ratio α/m, as d(x K₁)/dα = −x² K₀/α, the zero of::

    ∫ l^(1−p) (x K₁(x) − exp(−l²)) x² K₀(x) dl,   m = 1

At p = 0 that is the energy metric and at p = 2 the environment metric.
"""

from __future__ import annotations

import numpy as np

# Every p, and around the ratios of all of them. Beyond 4 rounding errors of Δk at l → 0 count.
_RATIOS, _EXPONENTS = (0.3, 1.2), (-1.0, 4.0)
_TOLERANCE = 1e-12


def best_ratio(exponent: float) -> float:
    """Return the α/m_B of least error under light of angular power l^−p.

    Parameters
    ----------
    exponent : float
        p, from −1 to 4.
    """
    from scipy.optimize import brentq

    return float(brentq(_slope, *_RATIOS, args=(exponent,), xtol=_TOLERANCE))


def equivalent_exponent(ratio: float) -> float:
    """Return the exponent p, from −1 to 4, whose power law has a given α/m_B as its best."""
    from scipy.optimize import brentq

    return float(brentq(lambda exponent: _slope(ratio, exponent), *_EXPONENTS, xtol=_TOLERANCE))


def _slope(ratio: float, exponent: float) -> float:
    """Return the slope of the squared error over the ratio, but for a negative factor."""
    from scipy.integrate import quad
    from scipy.special import k0, k1

    def integrand(degree: float) -> float:
        x = 2 * ratio * degree
        difference = x * k1(x) - np.exp(-(degree**2))
        return float(degree ** (1 - exponent) * difference * x * x * k0(x))

    return float(quad(integrand, 0, np.inf, epsabs=_TOLERANCE, epsrel=0)[0])
