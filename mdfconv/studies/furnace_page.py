"""The white furnace of the BRDFs: who loses energy, and who makes some."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from mdfconv.brdf.microfacet import MASKINGS
from mdfconv.output.figures import PAGE, encoded, new_figure
from mdfconv.output.records import csv_text, markdown_text
from mdfconv.studies.furnace import (
    directional_albedo,
    energy_response,
    furnace_model,
    printed_energy_response,
)
from mdfconv.studies.pages import Contents, fill, pivot

_COSINES = np.linspace(0, 1, 21)
# The rows of the cosines that the page shows: 0, 0.1, 0.5 and 1.
_SHOWN = {"grazing": 0, "nearly_grazing": 2, "oblique": 10, "normal": 20}
_GAMMA, _ALPHA = 20.0, 0.5
_EXACT = ("modified, Arvo", "modified, Mallett & Yuksel")
_SMOOTH, _ROUGH = 0.1, 1.0
# Panels of the figure: title, and for each curve a label and its model.
_PANELS: dict[str, dict[str, tuple[str, float, dict[str, str]]]] = {
    f"Phong, γ = {_GAMMA:g}": {
        "original": ("phong", _GAMMA, {}),
        "modified, usual": ("modified-phong", _GAMMA, {"normalizer": "usual"}),
        "modified, Arvo": ("modified-phong", _GAMMA, {"normalizer": "arvo"}),
        "modified, Mallett & Yuksel": ("modified-phong", _GAMMA, {"normalizer": "mallett-yuksel"}),
    },
    f"GGX, α = {_ALPHA:g}, by masking": {
        name: ("ggx", _ALPHA, {"masking": name}) for name in MASKINGS.names
    },
    "GGX and Beckmann, correlated": {
        f"{name} {alpha:g}": (name, alpha, {})
        for name in ("ggx", "beckmann")
        for alpha in (_SMOOTH, _ROUGH)
    },
    "Smoothie": {
        f"{name} {alpha:g}": (name, alpha, {})
        for name in ("smoothie", "smoothie-approx")
        for alpha in (_SMOOTH, _ROUGH)
    },
}
_RESPONSE_ALPHAS = (0.01, 0.1, 0.25, 0.5, 1.0)


def furnace() -> Contents:
    """Return the white furnace of the BRDFs."""
    panels = {
        title: {
            label: directional_albedo(furnace_model(name, parameter, **options), _COSINES).tolist()
            for label, (name, parameter, options) in models.items()
        }
        for title, models in _PANELS.items()
    }
    albedos = {label: values for group in panels.values() for label, values in group.items()}
    columns = {
        f"{title.split(',')[0]}: {label}": values
        for title, group in panels.items()
        for label, values in group.items()
    }
    shown = [
        (name, f"cos θ = {_COSINES[row]:g}", f"{values[row]:.4g}")
        for name, values in columns.items()
        for row in _SHOWN.values()
    ]
    responses = [
        {"α": alpha, "integral": energy_response(alpha), "printed": printed_energy_response(alpha)}
        for alpha in _RESPONSE_ALPHAS
    ]
    page = fill(
        "furnace",
        largest=max(max(values) for name, values in columns.items() if name.startswith("Smoothie")),
        albedos=pivot("BRDF", shown),
        responses=markdown_text(list(responses[0]), responses),
        **{
            angle: {label: values[row] for label, values in albedos.items()}
            for angle, row in _SHOWN.items()
        },
    )
    rows = [
        {"cos_theta": float(cosine)}
        | {name: float(f"{values[row]:.8g}") for name, values in columns.items()}
        for row, cosine in enumerate(_COSINES)
    ]
    error = max(abs(albedo - 1) for label in _EXACT for albedo in albedos[label])
    picture = draw_albedo(_COSINES.tolist(), panels)
    return Contents([page, csv_text(list(rows[0]), rows), picture], {"error": error})


def draw_albedo(
    cosine: Sequence[float], panels: Mapping[str, Mapping[str, Sequence[float]]], dpi: int = 110
) -> bytes:
    """Return a figure of albedos over the viewer's cosine: by panel and label."""
    rows = (len(panels) + 1) // 2
    columns = min(2, len(panels))
    width = PAGE[0] * (1.45 if columns > 1 else 1)
    figure = new_figure(width, PAGE[1] * 0.72 * rows + 0.6)
    axes = figure.subplots(rows, columns, squeeze=False)
    dashes = ["-", (0, (5, 2)), (0, (5, 2, 1, 2)), (0, (1, 1.5)), (0, (8, 2)), (0, (3, 3))]
    for axis, (title, curves) in zip(axes.flat, panels.items(), strict=True):
        for number, (label, albedo) in enumerate(curves.items()):
            style = {"color": f"C{number}", "linestyle": dashes[number % len(dashes)]}
            axis.plot(cosine, albedo, label=label, linewidth=1.5, **style)
        highest = max(max(albedo) for albedo in curves.values())
        axis.set(xlabel="cos θ of the viewer", ylabel="directional albedo", title=title)
        axis.set(xlim=(0, 1), ylim=(0, min(max(1.05, 1.05 * highest), 1.6)))
        axis.legend(loc="best")
    return encoded(figure, dpi=dpi)
