"""Smoothie's Fresnel term fitted anew: exp2(a + b (l·h)) to the exact curve, rescaled.

The article gives a and b for IOR 1.4 and a normal weight (μ = 0.55, σ = 0.12), and not the rest of
the protocol. Here the curve is (F − F₀)/(1 − F₀), the grid is uniform in l·H on [0, 1], and the
weight is a normal density in l·h = 2 (l·H)²: of the readings of the article's words the one that
returns the printed constants, within 0.6 %.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from mdfconv.brdf.fresnel import check_index, dielectric, normal_reflectance, smoothie_fresnel
from mdfconv.distributions.evaluation import Array
from mdfconv.errors import MdfconvError

ARTICLE_IOR, ARTICLE_MU, ARTICLE_SIGMA = 1.4, 0.55, 0.12
EDGES = (0.0, 0.2, 0.4, 0.6, 0.8, 1.0)
# No transparent medium lies beyond 4; nearer to 1 the curve is a spike at grazing angles, where
# the grid has no points and the weight no say.
_LARGEST_INDEX = 4.0
_SMALLEST_CONTRAST = 0.05
_POINTS = 2001
_FEWEST_POINTS = 10  # that carry the weight


@dataclass(frozen=True)
class Weight:
    """A normal density in l·h.

    Parameters
    ----------
    mu, sigma : float
        Mean and standard deviation; l·h runs from 0 to 2.
    """

    mu: float = ARTICLE_MU
    sigma: float = ARTICLE_SIGMA

    def __call__(self, cosine: Array) -> Array:
        """Return the density, relative to its maximum, at cosines l·H."""
        with np.errstate(over="ignore"):
            return np.exp(-0.5 * np.square((2 * np.square(cosine) - self.mu) / self.sigma))


@dataclass(frozen=True)
class FresnelFit:
    """The constants of exp2(a + b (l·h)) for an index and a weight.

    Parameters
    ----------
    ior : float
        Relative index of refraction.
    weight : Weight
        Which cosines count.
    a, b : float
        The constants.
    """

    ior: float
    weight: Weight
    a: float
    b: float

    def curves(self) -> dict[str, Callable[[Array], Array]]:
        """Return the approximations of the rescaled curve by name, functions of l·H."""
        return {
            "fit": lambda cosine: smoothie_fresnel(cosine, self.a, self.b),
            "printed": smoothie_fresnel,
            "(1-x)^5": lambda cosine: (1 - cosine) ** 5,
            "exp(-6x)": lambda cosine: np.exp(-6 * cosine),
        }

    def weighted_error(self, curve: Callable[[Array], Array]) -> float:
        """Return the root mean square error of an approximation under the weight."""
        cosine = grid()
        error = curve(cosine) - rescaled(cosine, self.ior)
        return float(np.sqrt(np.average(np.square(error), weights=self.weight(cosine))))

    def errors(self, curve: Callable[[Array], Array], low: float, high: float) -> tuple[float, ...]:
        """Return the maximum and the root mean square error on a range of l·H, unweighted."""
        cosine = np.linspace(low, high, _POINTS)
        error = np.abs(curve(cosine) - rescaled(cosine, self.ior))
        return float(error.max()), float(np.sqrt(np.mean(np.square(error))))


def grid() -> Array:
    """Return the cosines l·H of the fit, uniform on [0, 1]."""
    return np.linspace(0, 1, _POINTS)


def rescaled(cosine: Array, ior: float) -> Array:
    """Return the exact reflectance of a dielectric, mapped to [0, 1]: (F − F₀)/(1 − F₀)."""
    least = normal_reflectance(ior)
    return (dielectric(cosine, ior) - least) / (1 - least)


def fit(
    ior: float = ARTICLE_IOR, mu: float = ARTICLE_MU, sigma: float = ARTICLE_SIGMA
) -> FresnelFit:
    """Fit exp2(a + b (l·h)) to the exact curve by weighted least squares.

    Parameters
    ----------
    ior : float
        Relative index of refraction, 1/4 to 4, at least 0.05 away from 1.
    mu, sigma : float
        Mean (0 to 2) and standard deviation of the weight in l·h.

    Raises
    ------
    MdfconvError
        If the index or the weight makes no sense, or the weight leaves nothing to fit.
    """
    weight = _check(ior, mu, sigma)
    cosine = grid()
    counts = weight(cosine)
    # A weight between two points underflows to 0 everywhere.
    if not np.square(counts.sum()) >= _FEWEST_POINTS * np.square(counts).sum() > 0:
        raise MdfconvError(
            "the weight is narrower than the grid of the fit",
            "a larger σ covers it",
            argument="sigma",
        )
    target, root, path = rescaled(cosine, ior), np.sqrt(counts), 2 * np.square(cosine)
    # A residual has a scale of its own, which a small index contrast makes tiny.
    root /= np.linalg.norm(root * target)

    def residual(constants: Array) -> Array:
        return root * (smoothie_fresnel(cosine, *constants) - target)

    def jacobian(constants: Array) -> Array:
        slope = root * np.log(2) * smoothie_fresnel(cosine, *constants)
        return np.stack([slope, slope * path], axis=1)

    # The logarithm is linear in a and b; weighted by the curve it starts close to the answer.
    usable = target > 0
    strength = (root * target)[usable]
    b, a = np.polyfit(path[usable], np.log2(target[usable]), 1, w=strength)
    solution = least_squares(residual, [a, b], jacobian, xtol=1e-12, ftol=1e-14, gtol=1e-14)
    if not solution.success:
        raise MdfconvError(f"no fit converged for index {ior:g} under this weight")
    return FresnelFit(ior, weight, *map(float, solution.x))


def _check(ior: float, mu: float, sigma: float) -> Weight:
    inside = 1 / _LARGEST_INDEX <= check_index(ior) <= _LARGEST_INDEX
    if not (inside and abs(ior - 1) >= _SMALLEST_CONTRAST):
        raise MdfconvError(
            "the fit takes an index of refraction from 0.25 to 4, at least 0.05 away from 1, "
            f"not {ior:g}"
        )
    if not 0 <= mu <= 2:
        raise MdfconvError(f"the mean of the weight is an l·h, from 0 to 2, not {mu:g}")
    if not (np.isfinite(sigma) and sigma > 0):
        raise MdfconvError(f"the width of the weight is a positive number, not {sigma:g}")
    return Weight(mu, sigma)
