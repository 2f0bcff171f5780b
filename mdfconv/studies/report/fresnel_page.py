"""Smoothie's Fresnel term beside the exact curves: table, figure and page."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np

from mdfconv.brdf.fresnel import SMOOTHIE_FIT
from mdfconv.distributions.evaluation import Array
from mdfconv.output.figures import PAGE, encoded, new_figure
from mdfconv.output.files import file_bytes
from mdfconv.output.records import csv_text, markdown_text, rounded_rows
from mdfconv.studies.fresnel import EDGES, FresnelFit, fit, grid, rescaled
from mdfconv.studies.report.artefact import Artefact

COLUMNS = ("curve", "a", "b", "weighted_rms", "cosine", "max_error", "rms_error")
_DRAWN_IORS = (1.33, 1.4, 1.5)  # water, the article's, glass
_EXACT_STYLES: tuple[tuple[str, Any], ...] = (
    ("#56B4E9", "-"),
    ("#000000", "-"),
    ("#0072B2", "-"),
    ("#999999", "-"),
)
_STYLES: dict[str, tuple[str, Any]] = {
    "fit": ("#D55E00", "-"),
    "printed": ("#E69F00", (0, (4, 3))),
    "(1-x)^5": ("#009E73", (0, (6, 2, 1, 2))),
    "exp(-6x)": ("#CC79A7", (0, (1, 1.2))),
}
_POINTS = 101


def error_rows(fitted: FresnelFit) -> list[dict[str, Any]]:
    """Return a row for each approximation and range of the cosine l·H; the last one is all.

    ``a`` and ``b`` are None for the approximations that have none.
    """
    constants = {"fit": (fitted.a, fitted.b), "printed": SMOOTHIE_FIT}
    rows = []
    for name, curve in fitted.curves().items():
        a, b = constants.get(name, (None, None))
        weighted = fitted.weighted_error(curve)
        for low, high in [*pairwise(EDGES), (EDGES[0], EDGES[-1])]:
            largest, rms = fitted.errors(curve, low, high)
            values = name, a, b, weighted, f"{low:g} to {high:g}", largest, rms
            rows.append(dict(zip(COLUMNS, values, strict=True)))
    return rows


def fresnel_page() -> Artefact:
    """Return Smoothie's Fresnel term beside the exact curves."""
    fitted = fit()
    rows = error_rows(fitted)
    text = [_prose(rows), _constants_table(rows), _range_prose(fitted), _range_table(rows)]
    files = {
        "fresnel.csv": file_bytes(_csv(fitted)),
        "fresnel.md": file_bytes("\n\n".join(text)),
        "fresnel.png": draw_fresnel(fitted),
    }
    off = max(abs(fitted.a / SMOOTHIE_FIT[0] - 1), abs(fitted.b / SMOOTHIE_FIT[1] - 1))
    constants = f"a = {fitted.a:.4f}, b = {fitted.b:.4f}"
    return Artefact(
        files,
        "Smoothie, the fit of the Fresnel term",
        f"{constants}: within {math.ceil(1000 * off) / 10:g} % of the printed ones",
        "mdfconv fresnel",
    )


def _constants_table(rows: list[dict[str, Any]]) -> str:
    shown = [
        {name: "" if row[name] is None else row[name] for name in COLUMNS[:4]}
        for row in rows[:: len(EDGES)]
    ]
    return markdown_text(COLUMNS[:4], shown)


def _range_table(rows: list[dict[str, Any]]) -> str:
    """Return the errors with a row for each range and a column for each approximation."""
    names = list(_STYLES)
    shown: dict[str, dict[str, Any]] = {}
    for row in rows:
        cell = f"{row['max_error']:.3f} ({row['rms_error']:.3f})"
        shown.setdefault(row["cosine"], {"l·H": row["cosine"]})[row["curve"]] = cell
    return markdown_text(["l·H", *names], list(shown.values()))


def _csv(fitted: FresnelFit) -> str:
    cosine = np.linspace(0, 1, _POINTS)
    columns: dict[str, Array] = {"cosine": cosine}
    columns |= {f"exact {ior:g}": rescaled(cosine, ior) for ior in _DRAWN_IORS}
    columns |= {name: curve(cosine) for name, curve in fitted.curves().items()}
    return csv_text(list(columns), rounded_rows(columns))


def draw_fresnel(fitted: FresnelFit, dpi: int = 110) -> bytes:
    """Return a PNG: the article's curves, and the errors of the approximations.

    Parameters
    ----------
    fitted : FresnelFit
        The fit; its index of refraction is drawn beside the article's three.
    dpi : int
        Resolution.
    """
    figure = new_figure(PAGE[0] * 1.35, PAGE[1] * 0.85)
    left, right = figure.subplots(1, 2)
    cosine = grid()
    iors = dict.fromkeys([*_DRAWN_IORS, fitted.ior])
    for ior, drawn in zip(iors, _EXACT_STYLES, strict=False):
        style = _line(drawn, 1.1)
        left.plot(cosine, rescaled(cosine, ior), label=f"exact, IOR {ior:g}", **style)
    exact = rescaled(cosine, fitted.ior)
    for name, curve in fitted.curves().items():
        style = _line(_STYLES[name], 1.6)
        left.plot(cosine, curve(cosine), label=_label(name, fitted), **style)
        right.plot(cosine, curve(cosine) - exact, **style)
    left.set(
        xlabel="l·H",
        ylabel="(F − F₀) / (1 − F₀)",
        title="Rescaled reflectance: grazing at 0, along the normal at 1",
        ylim=(-0.02, 1.02),
    )
    _draw_weight(right, cosine, fitted)
    right.set(
        xlabel="l·H",
        ylabel="approximation − exact",
        title=f"Error at IOR {fitted.ior:g}; grey: the weight of the fit",
        ylim=(-0.12, 0.12),
    )
    figure.legend(loc="outside lower center", ncols=4)
    return encoded(figure, dpi=dpi)


def _draw_weight(axes: Any, cosine: Array, fitted: FresnelFit) -> None:
    """Shade the weight from the bottom of the axes, on a scale of its own."""
    scale = axes.twinx()
    scale.fill_between(cosine, fitted.weight(cosine), color="0.9", linewidth=0)
    scale.set(ylim=(0, 2.5), yticks=[])
    scale.set_zorder(axes.get_zorder() - 1)
    axes.patch.set_visible(False)


def _line(style: tuple[str, Any], width: float) -> dict[str, Any]:
    return {"color": style[0], "linestyle": style[1], "linewidth": width}


def _label(name: str, fitted: FresnelFit) -> str:
    constants = {"fit": (fitted.a, fitted.b), "printed": SMOOTHIE_FIT}
    if name not in constants:
        return name
    a, b = constants[name]
    return f"{name}, a = {a:.4f}, b = {b:.4f}"


def _prose(rows: list[dict[str, Any]]) -> str:
    weighted = {row["curve"]: row["weighted_rms"] for row in rows}
    schlick, gaussian = (weighted[name] / weighted["fit"] for name in ("(1-x)^5", "exp(-6x)"))
    return f"""\
# Smoothie's Fresnel term, fitted anew

![Fresnel curves and the errors of their approximations](fresnel.png)

The article replaces Schlick's (1 − x)⁵, x = l·H, by exp2(a + b (l·h)), h = l + v not normalized, so
that l·h = 2x². Its a and b were fitted to the exact reflectance at IOR 1.4, mapped to [0, 1] by
(F − F₀)/(1 − F₀), with a normal weight (μ = 0.55, σ = 0.12). The printed constants come back if the
weight is read as one in l·h and the grid as uniform in l·H; a weight in l·H gives others. Of the
last half per cent the article says nothing.

`weighted_rms` is what the fit minimizes: under the weight that of Schlick's term is {schlick:.2g}
times that of the fit, that of the spherical Gaussian exp(−6x) {gaussian:.2g} times.
`mdfconv fresnel --ior 1.5 --mu 1 --sigma 0.5` fits another medium or another range."""


def _range_prose(fitted: FresnelFit) -> str:
    gaussian, _ = fitted.errors(fitted.curves()["exp(-6x)"], EDGES[0], EDGES[-1])
    return f"""\
## Error by range of l·H, at IOR {fitted.ior:g}: maximum (root mean square)

From l·H = 0.4 up the term is the best of the four. Below 0.2 it stops at 2^a =
{2**fitted.a:.1f} and misses the rise to 1, as the article says: such angles are rare under direct
light, and common under environment maps. There exp(−6x), which the article sets aside, is the one
to take: at this index it stays within {gaussian:.1g} of the exact curve everywhere."""
