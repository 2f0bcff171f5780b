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
from mdfconv.studies.pages import PageFiles, fill, pivot

_COSINES = np.linspace(0, 1, 21)
# The rows of the cosines that the page shows: 0, 0.1, 0.5 and 1.
_SHOWN = {"grazing": 0, "nearly_grazing": 2, "oblique": 10, "normal": 20}
_GAMMA, _ALPHA = 20.0, 0.5
_EXACT = ("Phong: modified, Arvo", "Phong: modified, Mallett & Yuksel")
_Models = dict[str, tuple[str, float, dict[str, str]]]


def _smooth_and_rough(*names: str) -> _Models:
    return {f"{name} {alpha:g}": (name, alpha, {}) for name in names for alpha in (0.1, 1.0)}


# Panels of the figure by name: the title, and for each curve a label and its model.
_PANELS: dict[str, tuple[str, _Models]] = {
    "Phong": (
        f"Phong, γ = {_GAMMA:g}",
        {
            "original": ("phong", _GAMMA, {}),
            "modified, usual": ("modified-phong", _GAMMA, {"normalizer": "usual"}),
            "modified, Arvo": ("modified-phong", _GAMMA, {"normalizer": "arvo"}),
            "modified, Mallett & Yuksel": (
                "modified-phong",
                _GAMMA,
                {"normalizer": "mallett-yuksel"},
            ),
        },
    ),
    "GGX": (
        f"GGX, α = {_ALPHA:g}, by masking",
        {name: ("ggx", _ALPHA, {"masking": name}) for name in MASKINGS.names},
    ),
    "GGX and Beckmann": ("GGX and Beckmann, correlated", _smooth_and_rough("ggx", "beckmann")),
    "Smoothie": ("Smoothie", _smooth_and_rough("smoothie", "smoothie-approx")),
}
_RESPONSE_ALPHAS = (0.01, 0.1, 0.25, 0.5, 1.0)


def furnace() -> PageFiles:
    """Return the white furnace of the BRDFs."""
    albedos = {
        panel: {
            label: directional_albedo(furnace_model(name, parameter, **options), _COSINES).tolist()
            for label, (name, parameter, options) in models.items()
        }
        for panel, (_, models) in _PANELS.items()
    }
    columns = {
        f"{panel}: {label}": values
        for panel, curves in albedos.items()
        for label, values in curves.items()
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
        largest=max(map(max, albedos["Smoothie"].values())),
        albedos=pivot("BRDF", shown),
        responses=markdown_text(list(responses[0]), responses),
        **{
            angle: {name: values[row] for name, values in columns.items()}
            for angle, row in _SHOWN.items()
        },
    )
    rows = [
        {"cos_theta": float(cosine)}
        | {name: float(f"{values[row]:.8g}") for name, values in columns.items()}
        for row, cosine in enumerate(_COSINES)
    ]
    error = max(abs(albedo - 1) for name in _EXACT for albedo in columns[name])
    titled = {title: albedos[panel] for panel, (title, _) in _PANELS.items()}
    picture = draw_albedo(_COSINES.tolist(), titled)
    return PageFiles([page, csv_text(list(rows[0]), rows), picture], {"error": error})


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
