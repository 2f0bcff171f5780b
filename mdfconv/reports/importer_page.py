"""What importers make of a Wavefront exponent, and what it should be."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np

from mdfconv.conversion.endpoint import endpoints
from mdfconv.distributions.evaluation import Array
from mdfconv.fitting.metrics import metric_named
from mdfconv.formula import Problem, cheapest
from mdfconv.output.figures import PAGE, encoded, new_figure
from mdfconv.output.files import file_bytes
from mdfconv.output.records import csv_text, markdown_text, rounded_rows
from mdfconv.reports.artefact import Artefact
from mdfconv.scene.shininess import (
    IMPORTER_RULES,
    ROUGHNESS,
    SHININESS,
    error_of,
    importer_roughness,
    roughness_of,
)

_EXPONENTS = np.geomspace(1, 1e4, 81)
_SHOWN = np.array([1.0, 3, 10, 30, 100, 300, 1000, 3000, 10000])
_LIGHT = "environment"
_OURS = _LIGHT, "energy", "display"
_STYLES = {
    "1 - Ns/1000": ("#0072B2", "-."),
    "1 - sqrt(Ns/1000)": ("#E69F00", (0, (4, 2))),
    "1 - sqrt(Ns)/10": ("#CC79A7", ":"),
    "environment": ("#000000", "-"),
    "energy": ("#999999", (0, (5, 1))),
    "display": ("#009E73", (0, (8, 2))),
}


def importer_page() -> Artefact:
    """Return what importers make of a Wavefront exponent, beside the best fit."""
    curves = _columns(_EXPONENTS)
    rows = [_shown(row) for row in rounded_rows(_columns(_SHOWN))]
    prose = _PROSE.format(**_answer(), **_failures(curves))
    files = {
        "importers.csv": file_bytes(csv_text(list(curves), rounded_rows(curves))),
        "importers.md": file_bytes(f"{prose}\n\n{markdown_text(list(rows[0]), rows)}"),
        "importers.png": _draw(curves),
    }
    at_100 = rows[int(np.flatnonzero(_SHOWN == 100)[0])]
    by_rule = ", ".join(f"{at_100[rule]:g}" for rule in IMPORTER_RULES)
    summary = f"at Ns = 100 the rules give roughness {by_rule}; natural light asks for "
    return Artefact(
        files,
        "what becomes of Ns in a renderer with roughness",
        f"{summary}{at_100[_LIGHT]:g}",
        "mdfconv mtl --compare",
    )


def _columns(exponents: Array) -> dict[str, Array]:
    """Return Ns, the roughness by each rule and by ours, and the RMSE of each for the light."""
    roughness = {rule: importer_roughness(rule, exponents) for rule in IMPORTER_RULES}
    roughness |= {name: roughness_of(exponents, metric_named(name)) for name in _OURS}
    light = metric_named(_LIGHT)
    errors = {
        f"RMSE {name}": error_of(exponents, roughness[name], light)
        for name in (*IMPORTER_RULES, _LIGHT)
    }
    return {"Ns": exponents} | roughness | errors


def _answer() -> dict[str, str]:
    """Return the short formula for the light's answer, and its error, for the prose."""
    low, high = float(_EXPONENTS[0]), float(_EXPONENTS[-1])
    problem = Problem(*endpoints(SHININESS, ROUGHNESS), metric_named(_LIGHT), low, high)
    formula = cheapest(problem, 0.01)
    constant, slope = formula.numerator
    return {
        "formula": f"({slope:.3g} Ns + {constant:.3g})^(−{Fraction(-formula.shape.outer)})",
        "formula_error": f"{100 * formula.error:.1g} %",
        "range": f"{low:g} to {high:g}",
    }


def _failures(curves: dict[str, Array]) -> dict[str, str]:
    """Return how far too rough the rules get, and from which Ns on they are too smooth or 0."""
    ratios = [curves[rule] / curves[_LIGHT] for rule in IMPORTER_RULES]
    numbers = {
        "times": [f"{ratio.max():.1f}" for ratio in ratios],
        "smooth": [f"{curves['Ns'][np.argmax(ratio < 1)]:.0f}" for ratio in ratios],
        # 1 − 1000/1000 is rounded.
        "mirror": [f"{curves['Ns'][np.argmax(ratio < 1e-9)]:.0f}" for ratio in ratios],
    }
    return {name: f"{', '.join(texts[:-1])} and {texts[-1]}" for name, texts in numbers.items()}


def _shown(row: dict[str, float]) -> dict[str, Any]:
    """Return a row for people: three digits, and a word for a perfect mirror's error."""
    return {
        name: float(f"{value:.3g}") if np.isfinite(value) else "mirror"
        for name, value in row.items()
    }


def _draw(curves: dict[str, Array]) -> bytes:
    figure = new_figure(PAGE[0] * 1.35, PAGE[1] * 0.85)
    left, right = figure.subplots(1, 2)
    for name, (color, dashes) in _STYLES.items():
        label = name if name in IMPORTER_RULES else f"mdfconv, {name}"
        style = {"color": color, "linestyle": dashes, "linewidth": 1.4}
        left.plot(curves["Ns"], curves[name], label=label, **style)
        if f"RMSE {name}" in curves:
            errors = curves[f"RMSE {name}"]
            finite = np.isfinite(errors)
            right.plot(curves["Ns"][finite], errors[finite], **style)
    left.set(xscale="log", xlabel="Ns", ylabel="roughness Pr", title="What becomes of an exponent")
    right.set(
        xscale="log",
        yscale="log",
        xlabel="Ns",
        ylabel="relative RMSE under environment",
        title="Error, up to where a rule makes a mirror",
    )
    figure.legend(loc="outside lower center", ncols=5)
    return encoded(figure, dpi=110)


_PROSE = """\
# What importers make of Ns

![Roughness and error over Ns](importers.png)

Importers in wide use map a Wavefront exponent to the roughness of GGX (α = Pr²) by 1 − Ns/1000,
1 − √(Ns/1000) or 1 − √Ns/10, clipped to [0, 1]. `environment` is the roughness that keeps the light
of a natural environment (`mdfconv mtl`), `energy` that of the sun or a lamp, `display` the picture
on a screen. RMSE: relative, under the environment metric; `mirror` is a roughness of 0, which has
no highlight to compare.

The answer is a power: Pr ≈ {formula} is right within {formula_error} from Ns {range}
(`mdfconv formula --from blinn-phong --to ggx:roughness`). The rules are too rough,
by up to {times} times, then too smooth, from Ns = {smooth} on, and end at
Ns = {mirror}, from where on they make a perfect mirror of everything. What remains of
the error of `environment` is the difference between the two distributions, which no roughness
mends."""
