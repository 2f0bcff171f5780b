"""Smoothie's Fresnel term beside the exact curves: table, figure and page."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np

from mdfconv.brdf.fresnel import SMOOTHIE_FIT
from mdfconv.distributions.evaluation import Array
from mdfconv.output.figures import PAGE, encoded, new_figure
from mdfconv.output.records import csv_text, markdown_text, rounded_rows
from mdfconv.studies.fresnel import EDGES, FresnelFit, fit, grid, rescaled
from mdfconv.studies.pages import Contents, fill

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


def fresnel() -> Contents:
    """Return Smoothie's Fresnel term beside the exact curves."""
    fitted = fit()
    rows = error_rows(fitted)
    weighted = {row["curve"]: row["weighted_rms"] / rows[0]["weighted_rms"] for row in rows}
    constants = [
        {name: "" if row[name] is None else row[name] for name in COLUMNS[:4]}
        for row in rows[:: len(EDGES)]
    ]
    ranges: dict[str, dict[str, str]] = {}
    for row in rows:
        cells = ranges.setdefault(row["cosine"], {"l·H": row["cosine"]})
        cells[row["curve"]] = f"{row['max_error']:.3f} ({row['rms_error']:.3f})"
    gaussian, _ = fitted.errors(fitted.curves()["exp(-6x)"], EDGES[0], EDGES[-1])
    off = max(
        abs(ours / printed - 1)
        for ours, printed in zip((fitted.a, fitted.b), SMOOTHIE_FIT, strict=True)
    )
    figures = {"a": fitted.a, "b": fitted.b, "off": off}
    page = fill(
        "fresnel",
        ior=fitted.ior,
        weighted=weighted,
        least=2**fitted.a,
        gaussian=gaussian,
        constants=markdown_text(COLUMNS[:4], constants),
        ranges=markdown_text(["l·H", *_STYLES], list(ranges.values())),
        **figures,
    )
    cosine = np.linspace(0, 1, _POINTS)
    columns: dict[str, Array] = {"cosine": cosine}
    columns |= {f"exact {ior:g}": rescaled(cosine, ior) for ior in _DRAWN_IORS}
    columns |= {name: curve(cosine) for name, curve in fitted.curves().items()}
    table = csv_text(list(columns), rounded_rows(columns))
    return Contents([page, table, draw_fresnel(fitted)], figures)


def draw_fresnel(fitted: FresnelFit, dpi: int = 110) -> bytes:
    """Return a PNG: the curves of the article and the fit, and the errors of approximations."""
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
