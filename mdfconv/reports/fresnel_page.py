"""Smoothie's Fresnel term beside the exact curves: table, figure and page."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np

from mdfconv.brdf.fresnel import SMOOTHIE_FIT
from mdfconv.brdf.fresnel_fit import EDGES, FresnelFit, fit, rescaled
from mdfconv.brdf.fresnel_fit import grid as fine_grid
from mdfconv.distributions.evaluation import Array
from mdfconv.reports.figures import PAGE, encoded, pyplot
from mdfconv.reports.text import csv_text, file_bytes, markdown_text, rounded_rows

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


def error_rows(found: FresnelFit) -> list[dict[str, Any]]:
    """Return a row for each approximation and range of the cosine l·H; the last one is all.

    ``a`` and ``b`` are None for the approximations that have none.
    """
    constants = {"fit": (found.a, found.b), "printed": SMOOTHIE_FIT}
    rows = []
    for name, curve in found.curves().items():
        a, b = constants.get(name, (None, None))
        weighted = found.weighted_error(curve)
        for low, high in [*pairwise(EDGES), (EDGES[0], EDGES[-1])]:
            largest, rms = found.errors(curve, low, high)
            values = name, a, b, weighted, f"{low:g} to {high:g}", largest, rms
            rows.append(dict(zip(COLUMNS, values, strict=True)))
    return rows


def fresnel_page() -> tuple[dict[str, bytes], str]:
    """Return the files of the page by name, and its result in a line."""
    found = fit()
    rows = error_rows(found)
    tables = _constants_table(rows), _range_table(rows)
    files = {
        "fresnel.csv": file_bytes(_csv(found)),
        "fresnel.md": file_bytes("\n\n".join([_PROSE, tables[0], _RANGES, tables[1]])),
        "fresnel.png": draw_fresnel(found),
    }
    off = max(abs(found.a / SMOOTHIE_FIT[0] - 1), abs(found.b / SMOOTHIE_FIT[1] - 1))
    summary = f"a = {found.a:.4f}, b = {found.b:.4f}: within {100 * off:.1f} % of the printed ones"
    return files, summary


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


def _csv(found: FresnelFit) -> str:
    cosine = np.linspace(0, 1, _POINTS)
    columns: dict[str, Array] = {"cosine": cosine}
    columns |= {f"exact {ior:g}": rescaled(cosine, ior) for ior in _DRAWN_IORS}
    columns |= {name: curve(cosine) for name, curve in found.curves().items()}
    return csv_text(list(columns), rounded_rows(columns))


def draw_fresnel(found: FresnelFit, dpi: int = 110) -> bytes:
    """Return a PNG: the article's curves, and the errors of the approximations.

    Parameters
    ----------
    found : FresnelFit
        The fit; its index of refraction is drawn beside the article's three.
    dpi : int
        Resolution.
    """
    figure, (left, right) = pyplot().subplots(1, 2, figsize=(PAGE[0] * 1.35, PAGE[1] * 0.85))
    cosine = fine_grid()
    iors = dict.fromkeys([*_DRAWN_IORS, found.ior])
    for ior, drawn in zip(iors, _EXACT_STYLES, strict=False):
        style = _line(drawn, 1.1)
        left.plot(cosine, rescaled(cosine, ior), label=f"exact, IOR {ior:g}", **style)
    exact = rescaled(cosine, found.ior)
    for name, curve in found.curves().items():
        style = _line(_STYLES[name], 1.6)
        left.plot(cosine, curve(cosine), label=_label(name, found), **style)
        right.plot(cosine, curve(cosine) - exact, **style)
    left.set(
        xlabel="l·H",
        ylabel="(F − F₀) / (1 − F₀)",
        title="Rescaled reflectance: grazing at 0, along the normal at 1",
        ylim=(-0.02, 1.02),
    )
    _draw_weight(right, cosine, found)
    right.set(
        xlabel="l·H",
        ylabel="approximation − exact",
        title=f"Error at IOR {found.ior:g}; grey: the weight of the fit",
        ylim=(-0.12, 0.12),
    )
    figure.legend(loc="outside lower center", ncols=4)
    return encoded(figure, dpi=dpi)


def _draw_weight(axes: Any, cosine: Array, found: FresnelFit) -> None:
    """Shade the weight from the bottom of the axes, on a scale of its own."""
    scale = axes.twinx()
    scale.fill_between(cosine, found.weight(cosine), color="0.9", linewidth=0)
    scale.set(ylim=(0, 2.5), yticks=[])
    scale.set_zorder(axes.get_zorder() - 1)
    axes.patch.set_visible(False)


def _line(style: tuple[str, Any], width: float) -> dict[str, Any]:
    return {"color": style[0], "linestyle": style[1], "linewidth": width}


def _label(name: str, found: FresnelFit) -> str:
    constants = {"fit": (found.a, found.b), "printed": SMOOTHIE_FIT}
    if name not in constants:
        return name
    a, b = constants[name]
    return f"{name}, a = {a:.4f}, b = {b:.4f}"


_PROSE = """\
# Smoothie's Fresnel term, fitted anew

![Fresnel curves and the errors of their approximations](fresnel.png)

The article replaces Schlick's (1 − x)⁵, x = l·H, by exp2(a + b (l·h)), h = l + v not normalized, so
that l·h = 2x². Its a and b were fitted to the exact reflectance at IOR 1.4, mapped to [0, 1] by
(F − F₀)/(1 − F₀), with a normal weight (μ = 0.55, σ = 0.12). The printed constants come back if the
weight is read as one in l·h and the grid as uniform in l·H; a weight in l·H gives others. Of the
last half per cent the article says nothing.

`weighted_rms` is what the fit minimizes: under the weight the term is four times nearer to the
exact curve than Schlick's, and a quarter nearer than the spherical Gaussian exp(−6x).
`mdfconv fresnel --ior 1.5 --mu 1 --sigma 0.5` fits another medium or another range."""
_RANGES = """\
## Error by range of l·H, at IOR 1.4: maximum (root mean square)

From l·H = 0.4 up the term is the best of the four. Below 0.2 it stops at 2^a = 0.3 and misses the
rise to 1, as the article says: such angles are rare under direct light, and common under
environment maps. There exp(−6x), which the article sets aside, is the one to take: at this index it
stays within 0.006 of the exact curve everywhere."""
