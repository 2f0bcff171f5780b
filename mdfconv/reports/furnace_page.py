"""The white furnace of the BRDFs: who loses energy, and who makes some."""

from __future__ import annotations

from typing import Any

import numpy as np

from mdfconv.brdf.furnace import directional_albedo
from mdfconv.brdf.models import furnace_model
from mdfconv.brdf.smoothie import energy_response, printed_energy_response
from mdfconv.distributions.evaluation import Array
from mdfconv.reports.furnace_figure import draw_albedo
from mdfconv.reports.text import csv_text, file_bytes, markdown_text

_COSINES = np.linspace(0, 1, 21)
_GAMMA, _ALPHA = 20.0, 0.5
# Panels of the figure: title, and for each curve a label and its model.
_PANELS: dict[str, dict[str, tuple[str, float, dict[str, str]]]] = {
    f"Phong, γ = {_GAMMA:g}": {
        "original": ("phong", _GAMMA, {}),
        "modified, usual": ("modified-phong", _GAMMA, {"normalizer": "usual"}),
        "modified, Arvo": ("modified-phong", _GAMMA, {"normalizer": "arvo"}),
        "modified, Mallett & Yuksel": ("modified-phong", _GAMMA, {"normalizer": "mallett-yuksel"}),
    },
    f"GGX, α = {_ALPHA:g}, by masking": {
        name: ("ggx", _ALPHA, {"masking": name})
        for name in ("correlated", "separable", "v-cavity", "ksk", "none")
    },
    "GGX and Beckmann, correlated": {
        f"{name} {alpha:g}": (name, alpha, {}) for name in ("ggx", "beckmann") for alpha in (0.1, 1)
    },
    "Smoothie": {
        f"{name} {alpha:g}": (name, alpha, {})
        for name in ("smoothie", "smoothie-approx")
        for alpha in (0.1, 1.0)
    },
}
_SHOWN = (0, 2, 10, 20)


def furnace_page() -> tuple[dict[str, bytes], str]:
    """Return the files of the page by name, and its result in a line."""
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
        | {name: _rounded(albedo[place]) for name, albedo in columns.items()}
        for place, cosine in enumerate(_COSINES)
    ]
    page = "\n".join(
        [_PROSE, "", _albedo_table(columns), "", _RESPONSE_PROSE, "", _response_table()]
    )
    drawn = {title: {k: v.tolist() for k, v in group.items()} for title, group in curves.items()}
    files = {
        "furnace.csv": file_bytes(csv_text(list(rows[0]), rows)),
        "furnace.md": file_bytes(page),
        "furnace.png": draw_albedo(_COSINES.tolist(), drawn),
    }
    exact = max(
        float(np.max(np.abs(v - 1))) for k, v in columns.items() if "Yuksel" in k or "Arvo" in k
    )
    return files, f"Arvo's and Mallett & Yuksel's normalizers return 1 within {exact:.0e}"


def _albedo(name: str, parameter: float, options: dict[str, str]) -> Array:
    return directional_albedo(furnace_model(name, parameter, **options), _COSINES)


def _rounded(value: float) -> float:
    return float(f"{value:.8g}")


def _albedo_table(columns: dict[str, Array]) -> str:
    rows: list[dict[str, Any]] = [
        {"BRDF": name}
        | {f"cos θ = {_COSINES[place]:g}": f"{albedo[place]:.4g}" for place in _SHOWN}
        for name, albedo in columns.items()
    ]
    return markdown_text(list(rows[0]), rows)


def _response_table() -> str:
    rows = []
    for alpha in (0.01, 0.1, 0.25, 0.5, 1.0):
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
    x, w = np.polynomial.legendre.leggauss(16)
    edges = np.concatenate([[0.0], np.geomspace(1e-4, 0.5 / alpha**2, 60)])
    half = 0.5 * np.diff(edges)[:, None]
    u = edges[:-1, None] + half * (1 + x)
    sine_square = u * alpha * alpha
    # sin θ dθ = 2 d(sin²(θ/2)), cos θ = 1 − 2 sin²(θ/2), D = (α + 4 sin²(θ/2)/α)^(−2)
    value = (1 - 2 * sine_square) / np.square(1 + 4 * u)
    return float(2 * np.pi * np.sum(half * w * 2 * value))


_PROSE = """\
# The white furnace

![Directional albedo over the viewer's cosine](furnace.png)

A surface that absorbs nothing, in light from everywhere alike, should return all of it: a
directional albedo of 1. Below 1 a BRDF loses energy, as every single-scattering microfacet model
does where it is rough; above 1 it makes light from nothing. `mdfconv furnace` computes any of these
curves.

- Phong: with the usual constant (γ+2)/2π modified Phong is right for a viewer along the normal and
  loses most of the light at grazing angles; Arvo's and Mallett & Yuksel's normalizers return 1 at
  every angle. Arvo's takes integer exponents and time in proportion to them, the other any exponent
  at one price: up to a few hundred Arvo's is the quicker (`mdfconv furnace --brdf modified-phong
  --speed 100`).
- Masking: without it GGX returns far more than 1 at grazing angles. Height-correlated masking loses
  less than separable; V-cavities lose less still, the term of Kelemen and Szirmay-Kalos more.
- Smoothie: the exact form loses a fifth of the light and more even where it is smooth (π/4 at the
  normal), because its D is not normalized: multiply by (4+α²)/π. The approximate form, with the 1/π
  that the article leaves to the light, returns 1/(1+α²) to a viewer along the normal and loses half
  of that and more at grazing angles. Both conserve energy: neither makes light."""

_RESPONSE_PROSE = """\
## Smoothie's energy response

The article prints ½ + α² ln α − ½α² ln(1+α²) for ∫∫ sin θ cos θ D(θ/2) dθ dφ. Quadrature disagrees:
the integral is 2π (½ + ½α² ln α − ¼α² ln(α²+2)). The printed expression is half the integral over
θ alone with 2 sin² in the place of 4 sin², and lacks the factor 2π."""
