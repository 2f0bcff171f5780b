"""The energy response of the Smoothie article, as it is and as printed.

The article's BRDFs are `mdfconv.brdf.reflection.smoothie` and `smoothie_approx`.
"""

from __future__ import annotations

import numpy as np


def energy_response(alpha: float) -> float:
    """Return ∫∫ sin θ cos θ D(θ/2) dθ dφ = 2π (½ + ½α² ln α − ¼α² ln(α²+2)).

    D is the article's, (α + 4 sin²β/α)^(−2), which is not normalized. The article prints
    ½ + α² ln α − ½α² ln(1+α²), which is not this integral.
    """
    square = alpha * alpha
    logarithms = 0.5 * np.log(alpha) - 0.25 * np.log(square + 2)
    return float(2 * np.pi * (0.5 + square * logarithms))


def printed_energy_response(alpha: float) -> float:
    """Return the article's expression for the energy response, as printed."""
    square = alpha * alpha
    return float(0.5 + square * np.log(alpha) - 0.5 * square * np.log1p(square))
