"""What importers make of a Wavefront exponent, and what it should be."""

from __future__ import annotations

from typing import Any

import numpy as np

from mdfconv.distributions.evaluation import Array
from mdfconv.fitting.metrics import metric
from mdfconv.reports.figures import PAGE, encoded, pyplot
from mdfconv.reports.text import csv_text, file_bytes, markdown_text, rounded_rows
from mdfconv.scene.shininess import IMPORTER_RULES, error_of, importer_roughness, roughness_of

_EXPONENTS = np.geomspace(1, 1e4, 81)
_SHOWN = np.array([1.0, 3, 10, 30, 100, 300, 1000, 3000, 10000])
_OURS = "energy", "display"
_STYLES = {
    "1 - Ns/1000": ("#0072B2", "-."),
    "1 - sqrt(Ns/1000)": ("#E69F00", (0, (4, 2))),
    "1 - sqrt(Ns)/10": ("#CC79A7", ":"),
    "energy": ("#000000", "-"),
    "display": ("#009E73", (0, (8, 2))),
}


def importer_page() -> tuple[dict[str, bytes], str]:
    """Return the files of the page by name, and its result in a line."""
    curves = _columns(_EXPONENTS)
    rows = [_shown(row) for row in rounded_rows(_columns(_SHOWN))]
    files = {
        "importers.csv": file_bytes(csv_text(list(curves), rounded_rows(curves))),
        "importers.md": file_bytes(f"{_PROSE}\n\n{markdown_text(list(rows[0]), rows)}"),
        "importers.png": _draw(curves),
    }
    at = int(np.flatnonzero(_SHOWN == 100)[0])
    given = [f"{rows[at][name]:g}" for name in (*IMPORTER_RULES, "energy")]
    summary = f"at Ns = 100 the rules give roughness {', '.join(given[:3])}; the light asks for "
    return files, summary + given[3]


def _columns(exponents: Array) -> dict[str, Array]:
    """Return Ns, the roughness by each rule and by ours, and the RMSE of each for the light."""
    found = {"Ns": exponents}
    found |= {rule: importer_roughness(rule, exponents) for rule in IMPORTER_RULES}
    found |= {name: roughness_of(exponents, metric(name)) for name in _OURS}
    names = [name for name in found if name not in ("Ns", "display")]
    measure = metric("energy")
    return found | {f"RMSE {name}": error_of(exponents, found[name], measure) for name in names}


def _shown(row: dict[str, float]) -> dict[str, Any]:
    """Return a row for people: three digits, and a word for a perfect mirror's error."""
    return {
        name: float(f"{value:.3g}") if np.isfinite(value) else "mirror"
        for name, value in row.items()
    }


def _draw(curves: dict[str, Array]) -> bytes:
    plt = pyplot()
    figure, (left, right) = plt.subplots(1, 2, figsize=(PAGE[0] * 1.35, PAGE[1] * 0.85))
    for name, (color, dashes) in _STYLES.items():
        label = name if name in IMPORTER_RULES else f"mdfconv, {name}"
        style = {"color": color, "linestyle": dashes, "linewidth": 1.4}
        left.plot(curves["Ns"], curves[name], label=label, **style)
        if f"RMSE {name}" in curves:
            errors = curves[f"RMSE {name}"]
            there = np.isfinite(errors)
            right.plot(curves["Ns"][there], errors[there], **style)
    left.set(xscale="log", xlabel="Ns", ylabel="roughness Pr", title="What becomes of an exponent")
    right.set(
        xscale="log",
        yscale="log",
        xlabel="Ns",
        ylabel="RMSE of D / max D of Blinn/Phong",
        title="Error of the light, up to where a rule makes a mirror",
    )
    figure.legend(loc="outside lower center", ncols=5)
    return encoded(figure, dpi=110)


_PROSE = """\
# What importers make of Ns

![Roughness and error over Ns](importers.png)

Importers in wide use map a Wavefront exponent to the roughness of GGX (α = Pr²) by 1 − Ns/1000,
1 − √(Ns/1000) or 1 − √Ns/10, clipped to [0, 1]. `energy` is the roughness whose light is nearest to
that of Blinn/Phong (`mdfconv mtl`), `display` the one whose picture on a screen is. RMSE: of the
normalized distributions, relative to Blinn/Phong's peak, on β from 0 to 4.8 β_half; `mirror` is a
roughness of 0, which has no highlight to compare.

The answer is a power: Pr ≈ (0.589 Ns + 1.11)^(−1/4) is right within 0.2 % from Ns 1 to 10000
(`mdfconv formula --from blinn-phong --to ggx:roughness --metric energy`). The rules end at Ns = 100
or 1000, from where on they make a perfect mirror of everything; before, they are far too rough, but
for the third between Ns = 10 and 40, where it crosses the answer. What is left of the error of
`energy` is the difference between the two distributions, which no roughness mends."""
