"""Wavefront's exponent Ns and the roughness of physically based renderers, both ways.

Ns is Blinn/Phong's exponent, Pr the roughness of GGX with α = Pr². Ns 0 is the uniform lobe, which
GGX has at Pr 1; Pr 0 is a mirror, which no exponent reaches.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mdfconv.conversion import convert
from mdfconv.conversion.explanation import remaining_error
from mdfconv.distributions.dialects import DIALECTS
from mdfconv.distributions.endpoint import endpoints
from mdfconv.distributions.evaluation import Array
from mdfconv.fitting.metrics import Metric
from mdfconv.fitting.solve import errors_of_many

SHININESS, ROUGHNESS = "blinn-phong", "ggx:roughness"
# Pr at these is 1 − 2e-7 and 4e-5: no library means anything beyond.
_LEAST, _MOST = 1e-6, 1e18


def roughness_of(exponent: Array, metric: Metric) -> Array:
    """Return the roughness of the GGX that fits Blinn/Phong best.

    Parameters
    ----------
    exponent : numpy.ndarray, shape (n,)
        Ns ≥ 0.
    metric : Metric
        What the fit keeps.

    Returns
    -------
    numpy.ndarray, shape (n,)
        Pr from 0 to 1; 1 for Ns 0, which is uniform.
    """
    roughness = np.ones_like(exponent)
    lobes = exponent >= _LEAST
    roughness[lobes] = convert(exponent[lobes], SHININESS, ROUGHNESS, metric=metric)
    return roughness


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
        Ns, 0 for Pr 1 and otherwise from 1e-6 to 1e18.
    """
    from scipy.optimize import elementwise

    def difference(log_exponent: Array, roughness: Array) -> Array:
        return roughness_of(np.exp(log_exponent), metric) - roughness

    ends = np.log([_LEAST, _MOST])
    roughest, smoothest = roughness_of(np.exp(ends), metric)
    bracket = tuple(np.full(roughness.shape, end) for end in ends)
    root = elementwise.find_root(
        difference, bracket, args=(np.clip(roughness, smoothest, roughest),)
    )
    return np.where(roughness < 1, np.exp(root.x), 0.0)


def error_of(exponent: Array, roughness: Array, metric: Metric) -> Array:
    """Return the error of GGX in Blinn/Phong's place.

    Parameters
    ----------
    exponent, roughness : numpy.ndarray, shape (n,)
        Ns ≥ 0 and Pr from 0 to 1.
    metric : Metric
        Under which the error is taken.

    Returns
    -------
    numpy.ndarray, shape (n,)
        The relative root mean square of `remaining_error`; infinite for a mirror (Pr 0).
    """
    source, target = endpoints(SHININESS, ROUGHNESS)
    lobes = roughness > 0
    rmse = np.full_like(roughness, np.inf)
    rmse[lobes], _ = remaining_error(
        source.distribution,
        np.maximum(exponent[lobes], _LEAST),
        target.distribution,
        target.decode(roughness[lobes]),
        metric,
    )
    # Both are the uniform lobe, whose signal may be nothing that an error is relative to.
    rmse[(exponent < _LEAST) & (roughness == 1)] = 0.0
    return rmse


def fit_error(exponent: Array, metric: Metric) -> Array:
    """Return `error_of` the roughness that fits best, shape (n,); of many to 1e-4."""

    def error(exponent: Array) -> Array:
        return error_of(exponent, roughness_of(exponent, metric), metric)

    errors = errors_of_many(error, np.maximum(exponent, _LEAST))
    return np.where(exponent < _LEAST, 0.0, errors)


# The programs that store a roughness for an exponent, and render it with GGX.
IMPORTERS = {dialect.name: dialect for dialect in DIALECTS if dialect.roughness}
# The specular weight for those whose rule depends on it.
_FULL_WEIGHT = 1.0


def importer_roughness(importer: str, exponent: Array) -> Array:
    """Return the roughness that one of `IMPORTERS` makes of exponents, from 0 to 1.

    A rule that depends on the specular weight is given 1.
    """
    dialect = IMPORTERS[importer]
    assert dialect.roughness is not None
    with np.errstate(divide="ignore"):
        stored = dialect.encode(exponent, _FULL_WEIGHT)
    clipped: Array = np.clip(dialect.roughness(stored), 0, 1)
    return clipped


@dataclass(frozen=True)
class ImporterResult:
    """What an importer makes of an exponent.

    Parameters
    ----------
    importer : str
        One of `IMPORTERS`.
    roughness : float
        The roughness by its rule.
    rmse : float
        The error that it leaves, as `error_of`; infinite for a mirror.
    """

    importer: str
    roughness: float
    rmse: float


def importer_results(exponent: Array, metric: Metric) -> list[tuple[ImporterResult, ...]]:
    """Return what each of `IMPORTERS` makes of each exponent, shape (n,)."""
    by_rule = []
    for importer in IMPORTERS:
        roughness = importer_roughness(importer, exponent)
        rmse = error_of(exponent, roughness, metric)
        pairs = zip(roughness.tolist(), rmse.tolist(), strict=True)
        by_rule.append([ImporterResult(importer, *pair) for pair in pairs])
    return list(zip(*by_rule, strict=True))
