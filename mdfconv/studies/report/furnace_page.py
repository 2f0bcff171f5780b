"""The white furnace of the BRDFs: who loses energy, and who makes some."""

from __future__ import annotations

from collections.abc import Mapping
from textwrap import fill
from typing import Any

import numpy as np

from mdfconv.brdf.microfacet import MASKINGS
from mdfconv.distributions.evaluation import Array, gauss_legendre
from mdfconv.output.files import file_bytes
from mdfconv.output.records import csv_text, markdown_text
from mdfconv.studies.furnace import (
    directional_albedo,
    energy_response,
    furnace_model,
    printed_energy_response,
)
from mdfconv.studies.report.artefact import Artefact
from mdfconv.studies.report.furnace_figure import draw_albedo

_COSINES = np.linspace(0, 1, 21)
_GRAZING, _NEARLY_GRAZING, _OBLIQUE, _NORMAL = 0, 2, 10, 20  # in _COSINES: 0, 0.1, 0.5 and 1
_GAMMA, _ALPHA = 20.0, 0.5
_EXACT = ("Arvo", "Mallett & Yuksel")
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


def furnace_page() -> Artefact:
    """Return the white furnace of the BRDFs."""
    curves = {
        title: {label: _albedo(*model) for label, model in models.items()}
        for title, models in _PANELS.items()
    }
    columns = {
        f"{title.split(',')[0]}: {label}": albedo
        for title, group in curves.items()
        for label, albedo in group.items()
    }
    rows = [
        {"cos_theta": float(cosine)}
        | {name: float(f"{albedo[row]:.8g}") for name, albedo in columns.items()}
        for row, cosine in enumerate(_COSINES)
    ]
    page = "\n".join(
        [_prose(columns), "", _albedo_table(columns), "", _RESPONSE_PROSE, "", _response_table()]
    )
    drawn = {title: {k: v.tolist() for k, v in group.items()} for title, group in curves.items()}
    files = {
        "furnace.csv": file_bytes(csv_text(list(rows[0]), rows)),
        "furnace.md": file_bytes(page),
        "furnace.png": draw_albedo(_COSINES.tolist(), drawn),
    }
    error = max(float(np.max(np.abs(columns[f"Phong: modified, {name}"] - 1))) for name in _EXACT)
    return Artefact(
        files,
        "the lecture's claim on normalizers; who loses energy, and who makes some",
        f"Arvo's and Mallett & Yuksel's normalizers return 1 within {error:.0e}",
        "mdfconv furnace",
    )


def _albedo(name: str, parameter: float, options: dict[str, str]) -> Array:
    return directional_albedo(furnace_model(name, parameter, **options), _COSINES)


def _albedo_table(columns: Mapping[str, Array]) -> str:
    shown = (_GRAZING, _NEARLY_GRAZING, _OBLIQUE, _NORMAL)
    rows: list[dict[str, Any]] = [
        {"BRDF": name} | {f"cos θ = {_COSINES[row]:g}": f"{albedo[row]:.4g}" for row in shown}
        for name, albedo in columns.items()
    ]
    return markdown_text(list(rows[0]), rows)


def _response_table() -> str:
    rows = []
    for alpha in _RESPONSE_ALPHAS:
        exact, printed = energy_response(alpha), printed_energy_response(alpha)
        rows.append(
            {
                "α": alpha,
                "integral": f"{_response(alpha):.6g}",
                "2π(½ + ½α² ln α − ¼α² ln(α²+2))": f"{exact:.6g}",
                "printed": f"{printed:.6g}",
                "printed / integral": f"{printed / exact:.4g}",
            }
        )
    return markdown_text(list(rows[0]), rows)


def _response(alpha: float) -> float:
    """Return ∫∫ sin θ cos θ D(θ/2) dθ dφ by quadrature, in u = sin²(θ/2)/α²."""
    x, w = gauss_legendre(16)
    edges = np.concatenate([[0.0], np.geomspace(1e-4, 0.5 / alpha**2, 60)])
    half = 0.5 * np.diff(edges)[:, None]
    u = edges[:-1, None] + half * (1 + x)
    sine_square = u * alpha * alpha
    # sin θ dθ = 2 d(sin²(θ/2)), cos θ = 1 − 2 sin²(θ/2), D = (α + 4 sin²(θ/2)/α)^(−2)
    value = (1 - 2 * sine_square) / np.square(1 + 4 * u)
    return float(2 * np.pi * np.sum(half * w * 2 * value))


def _prose(columns: Mapping[str, Array]) -> str:
    """Return the page's text with the figures that it states."""
    bullets = (_on_phong(columns), _on_masking(columns), _on_smoothie(columns))
    lines = [fill(f"- {text}", 100, subsequent_indent="  ", **_WRAP) for text in bullets]
    return "\n".join([_INTRODUCTION, *lines])


def _on_phong(columns: Mapping[str, Array]) -> str:
    usual = columns["Phong: modified, usual"]
    return (
        f"Phong: with the usual constant (γ+2)/2π modified Phong returns {usual[_NORMAL]:.4g} for "
        f"a viewer along the normal and {usual[_GRAZING]:.2g} at grazing; Arvo's and Mallett & "
        "Yuksel's normalizers return 1 at every angle. Arvo's takes integer exponents and time in "
        "proportion to them, the other any exponent at one price: "
        f"`mdfconv furnace --brdf modified-phong --speed {_GAMMA:g}` times both."
    )


def _on_masking(columns: Mapping[str, Array]) -> str:
    oblique = {name: f"{columns[f'GGX: {name}'][_OBLIQUE]:.3g}" for name in MASKINGS.names}
    return (
        f"Masking: at cos θ = {_COSINES[_NEARLY_GRAZING]:g} GGX without it returns "
        f"{columns['GGX: none'][_NEARLY_GRAZING]:.2g}, and ever more towards grazing. At cos θ = "
        f"{_COSINES[_OBLIQUE]:g} it returns {oblique['correlated']} with height-correlated "
        f"masking, {oblique['separable']} with separable, {oblique['v-cavity']} with V-cavities "
        f"and {oblique['ksk']} with the term of Kelemen and Szirmay-Kalos."
    )


def _on_smoothie(columns: Mapping[str, Array]) -> str:
    exact = columns[f"Smoothie: smoothie {_SMOOTH:g}"][_NORMAL]
    # ∫ D cos β dω of the article's D
    printed = np.pi / (4 + _SMOOTH**2)
    approximate = columns[f"Smoothie: smoothie-approx {_SMOOTH:g}"]
    largest = max(albedo.max() for name, albedo in columns.items() if name.startswith("Smoothie"))
    return (
        "Smoothie: with D normalized, as everywhere in mdfconv, the exact form returns "
        f"{exact:.3g} to a viewer along the normal for α = {_SMOOTH:g}. The article's D lacks the "
        "factor (4+α²)/π: its exact form returns π/(4+α²) of what is shown, here "
        f"{printed * exact:.3g}, and loses {1 - np.pi / 4:.0%} of the light and more even where "
        "it is smooth. The approximate form returns (4+α²)/(4+4α²) to a viewer along the normal, "
        f"and at grazing {approximate[_GRAZING] / approximate[_NORMAL]:.2g} of that for α = "
        f"{_SMOOTH:g}; the article's, with the 1/π that it leaves to the light, returns 4/(4+α²) "
        f"of what is shown. Neither makes light: the largest albedo is {largest:.4g}."
    )


_WRAP: dict[str, Any] = {"break_long_words": False, "break_on_hyphens": False}
_INTRODUCTION = """\
# The white furnace

![Directional albedo over the viewer's cosine](furnace.png)

A surface that absorbs nothing, in light from everywhere alike, should return all of it: a
directional albedo of 1. Below 1 a BRDF loses energy, as every single-scattering microfacet model
does where it is rough; above 1 it makes light from nothing. `mdfconv furnace` computes any of these
curves.
"""

_RESPONSE_PROSE = """\
## Smoothie's energy response

The article prints ½ + α² ln α − ½α² ln(1+α²) for ∫∫ sin θ cos θ D(θ/2) dθ dφ, D its own. Quadrature
disagrees: the integral is 2π (½ + ½α² ln α − ¼α² ln(α²+2)). The printed expression is half the
integral over θ alone with 2 sin² in the place of 4 sin², and lacks the factor 2π."""
