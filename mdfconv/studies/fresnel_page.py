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
from mdfconv.studies.pages import PageFiles, fill, pivot

COLUMNS = ("curve", "a", "b", "weighted_rms", "cosine", "max_error", "rms_error")
_DRAWN_IORS = (1.33, 1.4, 1.5)  # water, the article's, glass
_EXACT_COLORS = ("#56B4E9", "#000000", "#0072B2", "#999999")
_STYLES: dict[str, dict[str, Any]] = {
    "fit": {"color": "#D55E00", "linestyle": "-"},
    "printed": {"color": "#E69F00", "linestyle": (0, (4, 3))},
    "(1-x)^5": {"color": "#009E73", "linestyle": (0, (6, 2, 1, 2))},
    "exp(-6x)": {"color": "#CC79A7", "linestyle": (0, (1, 1.2))},
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
    off = np.abs(np.divide((fitted.a, fitted.b), SMOOTHIE_FIT) - 1).max()
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
    cosine = np.linspace(0, 1, _POINTS)
    columns: dict[str, Array] = {"cosine": cosine}
    columns |= {f"exact {ior:g}": rescaled(cosine, ior) for ior in _DRAWN_IORS}
    columns |= {name: curve(cosine) for name, curve in fitted.curves().items()}
    table = csv_text(list(columns), rounded_rows(columns))
    return PageFiles([page, table, draw_fresnel(fitted)], figures)


def draw_fresnel(fitted: FresnelFit, dpi: int = 110) -> bytes:
    """Return a PNG: the curves of the article and the fit, and the errors of approximations."""
    figure = new_figure(PAGE[0] * 1.35, PAGE[1] * 0.85)
    left, right = figure.subplots(1, 2)
    cosine = grid()
    iors = dict.fromkeys([*_DRAWN_IORS, fitted.ior])
    for ior, color in zip(iors, _EXACT_COLORS, strict=False):
        curve = rescaled(cosine, ior)
        left.plot(cosine, curve, label=f"exact, IOR {ior:g}", color=color, linewidth=1.1)
    exact = rescaled(cosine, fitted.ior)
    constants = {"fit": (fitted.a, fitted.b), "printed": SMOOTHIE_FIT}
    for name, approximation in fitted.curves().items():
        a_b = constants.get(name)
        label = f"{name}, a = {a_b[0]:.4f}, b = {a_b[1]:.4f}" if a_b else name
        left.plot(cosine, approximation(cosine), label=label, linewidth=1.6, **_STYLES[name])
        right.plot(cosine, approximation(cosine) - exact, linewidth=1.6, **_STYLES[name])
    left.set(
        xlabel="l·H",
        ylabel="(F − F₀) / (1 − F₀)",
        title="Rescaled reflectance: grazing at 0, along the normal at 1",
        ylim=(-0.02, 1.02),
    )
    # The weight stands on the bottom of the axes, behind the errors, on a scale of its own.
    scale = right.twinx()
    scale.fill_between(cosine, fitted.weight(cosine), color="0.9", linewidth=0)
    scale.set(ylim=(0, 2.5), yticks=[], zorder=right.get_zorder() - 1)
    right.patch.set_visible(False)
    right.set(
        xlabel="l·H",
        ylabel="approximation − exact",
        title=f"Error at IOR {fitted.ior:g}; grey: the weight of the fit",
        ylim=(-0.12, 0.12),
    )
    figure.legend(loc="outside lower center", ncols=4)
    return encoded(figure, dpi=dpi)
