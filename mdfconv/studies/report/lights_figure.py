"""The best ratio over the light: theory, and what was rendered."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from mdfconv.distributions.evaluation import Array
from mdfconv.output.figures import PAGE, encoded, new_figure
from mdfconv.studies.report.power_law import best_ratio
from mdfconv.studies.report.renders import FLIP, LINEAR, Renders

_EXPONENTS = np.linspace(0, 3.3, 34)
_METRIC_STYLES = {
    "energy": ("#D55E00", (0, (6, 2))),
    "environment": ("#0072B2", (0, (6, 2, 1, 2))),
    "display": ("#009E73", (0, (2, 2))),
}
_MARKERS = ("o", "s", "^")
_MARK: dict[str, Any] = {"linestyle": "", "markersize": 5}
_LINEAR_STYLE = _MARK | {"color": "#56B4E9", "markeredgecolor": "#000000", "markeredgewidth": 0.6}
_FLIP_STYLE = _MARK | {"color": "none", "markeredgecolor": "#CC79A7", "markeredgewidth": 0.9}
_DIAGONAL = (0.58, 0.96)


def draw_lights(
    renders: Renders, exponents: Array, metrics: Mapping[str, float], dpi: int = 110
) -> bytes:
    """Return a PNG: best ratios over the exponent of the light, and predicted against rendered.

    Parameters
    ----------
    renders : Renders
        The n rendered cases.
    exponents : numpy.ndarray, shape (n,)
        The exponent of the power law that has the predicted ratio of each case.
    metrics : dict
        From names of metrics to their ratios for smooth surfaces.
    dpi : int
        Resolution.
    """
    figure = new_figure(PAGE[0] * 1.5, PAGE[1] * 0.95)
    left, right = figure.subplots(1, 2)
    curve = [best_ratio(exponent) for exponent in _EXPONENTS]
    handles = left.plot(_EXPONENTS, curve, color="#000000", label="pure power law, smooth surface")
    for name, ratio in metrics.items():
        color, dashes = _METRIC_STYLES[name]
        left.axhline(ratio, color=color, linestyle=dashes, linewidth=1.3)
    names = [f"{name}\n{ratio:.3f}" for name, ratio in metrics.items()]
    left.secondary_yaxis("right").set_yticks(list(metrics.values()), names)
    handles += right.plot(_DIAGONAL, _DIAGONAL, color="#999999", label="rendered as predicted")
    linear, flip = renders.best[LINEAR], renders.best[FLIP]
    for m_b, marker in zip(np.unique(renders.m_b), _MARKERS, strict=True):
        case = renders.m_b == m_b
        styles = [style | {"marker": marker} for style in (_LINEAR_STYLE, _FLIP_STYLE)]
        for (name, best), style in zip(((LINEAR, linear), (FLIP, flip)), styles, strict=True):
            label = f"least {name}, m_B = {m_b:g}"
            handles += left.plot(exponents[case], best[case], label=label, **style)
        right.plot(renders.predicted[case], linear[case], **styles[0])
    left.set(
        xlabel="exponent p of the power law that has the predicted ratio",
        ylabel="best α / m_B",
        title="GGX in Beckmann's place, over the light",
    )
    right.set(
        xlabel="α / m_B predicted from the light's own spectrum",
        ylabel=f"α / m_B of least {LINEAR}, rendered",
        title="Predicted and rendered",
        xlim=_DIAGONAL,
        ylim=_DIAGONAL,
        aspect="equal",
    )
    figure.legend(handles=handles, loc="outside lower center", ncols=4)
    return encoded(figure, dpi=dpi)
