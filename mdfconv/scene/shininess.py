"""Wavefront's exponent Ns and the roughness of physically based renderers, both ways.

Ns is Blinn/Phong's exponent, Pr the roughness of GGX with α = Pr². Ns 0 is the uniform lobe, which
GGX has at Pr 1; Pr 0 is a mirror, which no exponent reaches.
"""

from __future__ import annotations

import numpy as np

from mdfconv.conversion import convert
from mdfconv.conversion.residual import residual
from mdfconv.distributions import distribution
from mdfconv.distributions.evaluation import Array
from mdfconv.fitting.metrics import Metric

_SOURCE, _TARGET = "blinn-phong", "ggx:roughness"
# From here on the stored polynomials answer.
_LEAST_STORED = 0.1
_LEAST, _MOST = 1e-6, 1e18
_BISECTIONS = 70


def roughness_of(exponent: Array, metric: Metric) -> Array:
    """Return the roughness of the GGX that fits Blinn/Phong best.

    Parameters
    ----------
    exponent : numpy.ndarray, shape (n,)
        Ns ≥ 0.
    metric : Metric
        What the fit keeps; display at exposure 1.

    Returns
    -------
    numpy.ndarray, shape (n,)
        Pr from 0 to 1; 1 for Ns 0, which is uniform.
    """
    found = np.ones_like(exponent)
    stored = exponent >= _LEAST_STORED
    found[stored] = convert(exponent[stored], _SOURCE, _TARGET, "fast", metric=metric)
    rest = (exponent >= _LEAST) & ~stored
    found[rest] = convert(exponent[rest], _SOURCE, _TARGET, "fit", metric=metric)
    return found


def exponent_of(roughness: Array, metric: Metric) -> Array:
    """Return the exponent whose best GGX has a roughness: the inverse of `roughness_of`.

    Parameters
    ----------
    roughness : numpy.ndarray, shape (n,)
        0 < Pr ≤ 1.
    metric : Metric
        What the fit keeps.

    Returns
    -------
    numpy.ndarray, shape (n,)
        Ns ≥ 0.
    """
    low, high = np.full(roughness.shape, np.log(_LEAST)), np.full(roughness.shape, np.log(_MOST))
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        too_rough = roughness_of(np.exp(middle), metric) > roughness
        low, high = np.where(too_rough, middle, low), np.where(too_rough, high, middle)
    return np.where(roughness < 1, np.exp(0.5 * (low + high)), 0.0)


def error_of(exponent: Array, roughness: Array, metric: Metric) -> Array:
    """Return the RMSE of GGX in Blinn/Phong's place, relative to the latter's peak.

    Parameters
    ----------
    exponent, roughness : numpy.ndarray, shape (n,)
        Ns ≥ 0 and Pr from 0 to 1.
    metric : Metric
        Under which the error is taken, on β from 0 to 4.8 β_half of Blinn/Phong.

    Returns
    -------
    numpy.ndarray, shape (n,)
        RMSE; infinite for a mirror (Pr 0).
    """
    sides = distribution("blinn-phong"), distribution("ggx")
    there = roughness > 0
    given = np.maximum(exponent[there], _LEAST)
    found = np.full_like(roughness, np.inf)
    found[there] = residual(sides[0], given, sides[1], np.square(roughness[there]), metric)[0]
    return found


# What importers in wide use make of Ns; beyond the ends of [0, 1] they clip.
IMPORTER_RULES = {
    "1 - Ns/1000": lambda exponent: 1 - exponent / 1000,
    "1 - sqrt(Ns/1000)": lambda exponent: 1 - np.sqrt(exponent / 1000),
    "1 - sqrt(Ns)/10": lambda exponent: 1 - np.sqrt(exponent) / 10,
}


def importer_roughness(rule: str, exponent: Array) -> Array:
    """Return the roughness that one of `IMPORTER_RULES` gives for an exponent."""
    clipped: Array = np.clip(IMPORTER_RULES[rule](exponent), 0, 1)
    return clipped
