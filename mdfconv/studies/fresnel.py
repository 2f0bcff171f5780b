"""Smoothie's Fresnel term fitted anew: exp2(a + b (l·h)) to the exact curve, rescaled; its page.

The article gives a and b for IOR 1.4 and a normal weight (μ = 0.55, σ = 0.12), and not the rest of
the protocol. Here the curve is (F − F₀)/(1 − F₀), the grid is uniform in l·H on [0, 1], and the
weight is a normal density in l·h = 2 (l·H)²: of the readings of the article's words the one that
returns the printed constants, within 0.6 %.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from mdfconv.brdf import fresnel as terms
from mdfconv.distributions.evaluation import Array
from mdfconv.errors import MdfconvError
from mdfconv.output.figures import PAGE, encoded, new_figure
from mdfconv.output.records import csv_text, markdown_text, rounded_rows
from mdfconv.studies.pages import PageFiles, fill, pivot

ARTICLE_IOR, ARTICLE_MU, ARTICLE_SIGMA = 1.4, 0.55, 0.12
EDGES = (0.0, 0.2, 0.4, 0.6, 0.8, 1.0)
COLUMNS = ("curve", "a", "b", "weighted_rms", "cosine", "max_error", "rms_error")
_DRAWN_IORS = (1.33, 1.4, 1.5)  # water, the article's, glass
_EXACT_COLORS = ("#56B4E9", "#000000", "#0072B2", "#999999")
_STYLES: dict[str, dict[str, Any]] = {
    "fit": {"color": "#D55E00", "linestyle": "-"},
    "printed": {"color": "#E69F00", "linestyle": (0, (4, 3))},
    "(1-x)^5": {"color": "#009E73", "linestyle": (0, (6, 2, 1, 2))},
    "exp(-6x)": {"color": "#CC79A7", "linestyle": (0, (1, 1.2))},
}
# No transparent medium lies beyond 4; nearer to 1 the curve is a spike at grazing angles, where
# the grid has no points and the weight no say.
_LARGEST_INDEX = 4.0
_SMALLEST_CONTRAST = 0.05
_POINTS = 2001
_TABLE_POINTS = 101
_FEWEST_POINTS = 10  # that carry the weight


def normal_weight(cosine: Array, mu: float, sigma: float) -> Array:
    """Return a normal density in l·h = 2 (l·H)², relative to its maximum, at cosines l·H."""
    with np.errstate(over="ignore"):
        return np.exp(-0.5 * np.square((2 * np.square(cosine) - mu) / sigma))


@dataclass(frozen=True)
class FresnelFit:
    """The constants of exp2(a + b (l·h)) for an index and a weight, a function of l·H."""

    ior: float
    weight: Callable[[Array], Array]
    a: float
    b: float

    @property
    def constants(self) -> dict[str, tuple[float, float]]:
        """The constants of the approximations that have some."""
        return {"fit": (self.a, self.b), "printed": terms.SMOOTHIE_FIT}

    def curves(self) -> dict[str, Callable[[Array], Array]]:
        """Return the approximations of the rescaled curve by name, functions of l·H."""
        return {
            "fit": lambda cosine: terms.smoothie_fresnel(cosine, self.a, self.b),
            "printed": terms.smoothie_fresnel,
            "(1-x)^5": lambda cosine: (1 - cosine) ** 5,
            "exp(-6x)": lambda cosine: np.exp(-6 * cosine),
        }

    def error(self, curve: Callable[[Array], Array], cosine: Array) -> Array:
        """Return an approximation less the exact curve."""
        return curve(cosine) - rescaled(cosine, self.ior)

    def weighted_error(self, curve: Callable[[Array], Array]) -> float:
        """Return the root mean square error of an approximation under the weight."""
        squares = np.square(self.error(curve, grid()))
        return float(np.sqrt(np.average(squares, weights=self.weight(grid()))))


def grid() -> Array:
    """Return the cosines l·H of the fit, uniform on [0, 1]."""
    return np.linspace(0, 1, _POINTS)


def rescaled(cosine: Array, ior: float) -> Array:
    """Return the exact reflectance of a dielectric, mapped to [0, 1]: (F − F₀)/(1 − F₀)."""
    least = terms.normal_reflectance(ior)
    return (terms.dielectric(cosine, ior) - least) / (1 - least)


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
    _check(ior, mu, sigma)
    weight = partial(normal_weight, mu=mu, sigma=sigma)
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
        return root * (terms.smoothie_fresnel(cosine, *constants) - target)

    def jacobian(constants: Array) -> Array:
        slope = root * np.log(2) * terms.smoothie_fresnel(cosine, *constants)
        return np.stack([slope, slope * path], axis=1)

    # The logarithm is linear in a and b; weighted by the curve it starts close to the answer.
    usable = target > 0
    strength = (root * target)[usable]
    b, a = np.polyfit(path[usable], np.log2(target[usable]), 1, w=strength)
    solution = least_squares(residual, [a, b], jacobian, xtol=1e-12, ftol=1e-14, gtol=1e-14)
    if not solution.success:
        raise MdfconvError(f"no fit converged for index {ior:g} under this weight")
    return FresnelFit(ior, weight, *map(float, solution.x))


def _check(ior: float, mu: float, sigma: float) -> None:
    inside = 1 / _LARGEST_INDEX <= terms.check_index(ior) <= _LARGEST_INDEX
    if not (inside and abs(ior - 1) >= _SMALLEST_CONTRAST):
        raise MdfconvError(
            "the fit takes an index of refraction from 0.25 to 4, at least 0.05 away from 1, "
            f"not {ior:g}"
        )
    if not 0 <= mu <= 2:
        raise MdfconvError(f"the mean of the weight is an l·h, from 0 to 2, not {mu:g}")
    if not (np.isfinite(sigma) and sigma > 0):
        raise MdfconvError(f"the width of the weight is a positive number, not {sigma:g}")


def error_rows(fitted: FresnelFit) -> list[dict[str, Any]]:
    """Return a row for each approximation and range of the cosine l·H; the last one is all.

    ``a`` and ``b`` are None for the approximations that have none.
    """
    rows = []
    for name, curve in fitted.curves().items():
        a, b = fitted.constants.get(name, (None, None))
        weighted = fitted.weighted_error(curve)
        for low, high in [*pairwise(EDGES), (EDGES[0], EDGES[-1])]:
            error = np.abs(fitted.error(curve, np.linspace(low, high, _POINTS)))
            unweighted = float(error.max()), float(np.sqrt(np.mean(np.square(error))))
            values = name, a, b, weighted, f"{low:g} to {high:g}", *unweighted
            rows.append(dict(zip(COLUMNS, values, strict=True)))
    return rows


def fresnel() -> PageFiles:
    """Return Smoothie's Fresnel term beside the exact curves."""
    fitted = fit()
    rows = error_rows(fitted)
    weighted = {row["curve"]: row["weighted_rms"] / rows[0]["weighted_rms"] for row in rows}
    constants = [
        {name: "" if row[name] is None else row[name] for name in COLUMNS[:4]}
        for row in rows[:: len(EDGES)]
    ]
    ranges = [
        (row["cosine"], row["curve"], f"{row['max_error']:.3f} ({row['rms_error']:.3f})")
        for row in rows
    ]
    off = np.abs(np.divide((fitted.a, fitted.b), terms.SMOOTHIE_FIT) - 1).max()
    figures = {"a": fitted.a, "b": fitted.b, "off": float(off)}
    page = fill(
        "fresnel",
        ior=fitted.ior,
        weighted=weighted,
        least=2**fitted.a,
        gaussian=rows[-1]["max_error"],
        constants=markdown_text(COLUMNS[:4], constants),
        ranges=pivot("l·H", ranges),
        **figures,
    )
    cosine = np.linspace(0, 1, _TABLE_POINTS)
    columns: dict[str, Array] = {"cosine": cosine}
    columns |= {f"exact {ior:g}": rescaled(cosine, ior) for ior in _DRAWN_IORS}
    columns |= {name: curve(cosine) for name, curve in fitted.curves().items()}
    table = csv_text(list(columns), rounded_rows(columns))
    return PageFiles([page, table, draw_fresnel(fitted)], figures)


def draw_fresnel(fitted: FresnelFit) -> bytes:
    """Return a PNG: the curves of the article and the fit, and the errors of approximations."""
    figure = new_figure(PAGE[0] * 1.35, PAGE[1] * 0.85)
    left, right = figure.subplots(1, 2)
    cosine = grid()
    iors = dict.fromkeys([*_DRAWN_IORS, fitted.ior])
    for ior, color in zip(iors, _EXACT_COLORS, strict=False):
        curve = rescaled(cosine, ior)
        left.plot(cosine, curve, label=f"exact, IOR {ior:g}", color=color, linewidth=1.1)
    for name, approximation in fitted.curves().items():
        a_b = fitted.constants.get(name)
        label = f"{name}, a = {a_b[0]:.4f}, b = {a_b[1]:.4f}" if a_b else name
        left.plot(cosine, approximation(cosine), label=label, linewidth=1.6, **_STYLES[name])
        right.plot(cosine, fitted.error(approximation, cosine), linewidth=1.6, **_STYLES[name])
    left.set(xlabel="l·H", ylabel="(F − F₀) / (1 − F₀)", ylim=(-0.02, 1.02))
    left.set_title("Rescaled reflectance: grazing at 0, along the normal at 1")
    # The weight stands on the bottom of the axes, behind the errors, on a scale of its own.
    scale = right.twinx()
    scale.fill_between(cosine, fitted.weight(cosine), color="0.9", linewidth=0)
    scale.set(ylim=(0, 2.5), yticks=[], zorder=right.get_zorder() - 1)
    right.patch.set_visible(False)
    right.set(xlabel="l·H", ylabel="approximation − exact", ylim=(-0.12, 0.12))
    right.set_title(f"Error at IOR {fitted.ior:g}; grey: the weight of the fit")
    figure.legend(loc="outside lower center", ncols=4)
    return encoded(figure, dpi=110)
