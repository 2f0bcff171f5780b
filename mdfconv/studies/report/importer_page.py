"""What importers make of a Wavefront exponent, and what it should be."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
from matplotlib import colormaps

from mdfconv.distributions.endpoint import endpoints
from mdfconv.distributions.evaluation import Array
from mdfconv.fitting.metrics import metric_named
from mdfconv.formula import SearchProblem, cheapest
from mdfconv.output.figures import PAGE, encoded, new_figure
from mdfconv.output.files import file_bytes
from mdfconv.output.records import csv_text, markdown_text, rounded_rows
from mdfconv.scene.shininess import (
    EXPONENTS,
    IMPORTERS,
    ROUGHNESS,
    SHININESS,
    encoding_records,
    error_of,
    importer_roughness,
    roughness_of,
)
from mdfconv.studies.report.artefact import Artefact

_EXPONENTS = np.geomspace(1, 1e4, 81)
# Of the roughness that is asked for.
_ABOUT_RIGHT = 0.1
_LIGHT = "environment"
_OURS = _LIGHT, "energy", "display"
# Above the rules, in black and grey.
_OUR_STYLES = {
    "environment": ("#000000", "-"),
    "energy": ("#666666", (0, (5, 1))),
    "display": ("#666666", ":"),
}
_DASHES = ("-", (0, (6, 2)), (0, (2, 1)), "-.")


def importer_page() -> Artefact:
    """Return what importers make of a Wavefront exponent, beside the best fit."""
    curves = _columns(_EXPONENTS)
    ours, rules = _tables()
    prose = _PROSE.format(**_answer(), **_failures(curves))
    tables = [f"## Every rule\n\n{_RULES}\n\n{markdown_text(list(rules[0]), rules)}"]
    tables.append(f"## The answer\n\n{markdown_text(list(ours[0]), ours)}")
    files = {
        "importers.csv": file_bytes(csv_text(list(curves), rounded_rows(curves))),
        "importers.md": file_bytes("\n\n".join([prose, *tables])),
        "importers.png": _draw(curves),
    }
    at_100 = [rule["r at 100"] for rule in rules]
    answer = float(roughness_of(np.array([100.0]), metric_named(_LIGHT))[0])
    return Artefact(
        files,
        "what becomes of Ns in a renderer with roughness",
        f"at Ns = 100 the rules of {len(rules)} importers give roughness {min(at_100):g} to "
        f"{max(at_100):g}; natural light asks for {answer:.3g}",
        "mdfconv list --encodings",
    )


def _columns(exponents: Array) -> dict[str, Array]:
    """Return Ns, the roughness by each rule and by ours, and the RMSE of each for the light."""
    roughness = {rule: importer_roughness(rule, exponents) for rule in IMPORTERS}
    roughness |= {name: roughness_of(exponents, metric_named(name)) for name in _OURS}
    light = metric_named(_LIGHT)
    errors = {
        f"RMSE {name}": error_of(exponents, roughness[name], light) for name in (*IMPORTERS, _LIGHT)
    }
    return {"Ns": exponents} | roughness | errors


def _answer() -> dict[str, str]:
    """Return the short formula for the light's answer, and its error, for the prose."""
    low, high = float(_EXPONENTS[0]), float(_EXPONENTS[-1])
    problem = SearchProblem(*endpoints(SHININESS, ROUGHNESS), metric_named(_LIGHT), low, high)
    formula = cheapest(problem, 0.01)
    constant, slope = formula.numerator
    return {
        "formula": f"({slope:.3g} Ns + {constant:.3g})^(−{Fraction(-formula.shape.outer)})",
        "formula_error": f"{100 * formula.error:.1g} %",
        "range": f"{low:g} to {high:g}",
    }


def _failures(curves: dict[str, Array]) -> dict[str, str]:
    """Return how far off the rules are at Ns 100, and how many end at a mirror, for the prose."""
    index = int(np.argmin(np.abs(curves["Ns"] - 100)))
    ratios = np.array([curves[rule][index] / curves[_LIGHT][index] for rule in IMPORTERS])
    mirrors = sum(bool((curves[rule] < 1e-9).any()) for rule in IMPORTERS)
    return {
        "rules": str(len(IMPORTERS)),
        "right": str((np.abs(ratios - 1) < _ABOUT_RIGHT).sum() or "none"),
        "about": f"{100 * _ABOUT_RIGHT:g} %",
        "rougher": f"{ratios.max():.1f}",
        "mirrors": str(mirrors),
    }


def _tables() -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Return the answer under the metrics, and each rule with what it leaves."""
    shown = np.array([1.0, *EXPONENTS, 10000])
    answers = {name: roughness_of(shown, metric_named(name)) for name in _OURS}
    ours = [
        {"Ns": f"{n:g}"} | {name: f"{answers[name][row]:.4g}" for name in _OURS}
        for row, n in enumerate(shown)
    ]
    rules = []
    for record in encoding_records(metric_named(_LIGHT)):
        name = record["encoding"].partition(":")[2]
        if name in IMPORTERS:
            row = {"importer": name, "programs": record["programs"], "rule": record["formula"]}
            for n in EXPONENTS:
                row[f"r at {n}"] = float(f"{record[f'roughness_{n}']:.3g}")
            for n in EXPONENTS:
                rmse = record[f"rmse_{n}"]
                row[f"RMSE at {n}"] = f"{rmse:.2g}" if np.isfinite(rmse) else "mirror"
            rules.append(row)
    return ours, rules


def _labels(curves: dict[str, Array]) -> dict[str, str]:
    """Return the first of each group of importers that have one curve, and all their names."""
    groups: dict[str, list[str]] = {}
    for name in IMPORTERS:
        same = (first for first in groups if np.allclose(curves[first], curves[name]))
        groups.setdefault(next(same, name), []).append(name)
    return {first: ", ".join(names) for first, names in groups.items()}


def _draw(curves: dict[str, Array]) -> bytes:
    figure = new_figure(PAGE[0] * 1.35, PAGE[1] * 1.05)
    left, right = figure.subplots(1, 2)
    colors = colormaps["tab10"](range(10)).tolist()
    labels = _labels(curves)
    styles = {
        name: (colors[number % len(colors)], _DASHES[number % len(_DASHES)])
        for number, name in enumerate(labels)
    }
    for name, (color, dashes) in (styles | _OUR_STYLES).items():
        label = labels.get(name, f"mdfconv, {name}")
        width = 2.0 if name == _LIGHT else 1.1
        style = {"color": color, "linestyle": dashes, "linewidth": width}
        left.plot(curves["Ns"], curves[name], label=label, **style)
        if f"RMSE {name}" in curves:
            errors = curves[f"RMSE {name}"]
            finite = np.isfinite(errors)
            right.plot(curves["Ns"][finite], errors[finite], **style)
    left.set(xscale="log", xlabel="Ns", ylabel="roughness", title="What becomes of an exponent")
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

{rules} importers and exporters in wide use map a Wavefront exponent to the roughness of GGX
(α = r²) by as many rules, read in their sources. `environment` is the roughness that keeps the
light of a natural environment (`mdfconv mtl`), `energy` that of the sun or a lamp, `display` the
picture on a screen.

The answer is a power: Pr ≈ {formula} is right within {formula_error} from Ns {range}
(`mdfconv formula --from blinn-phong --to ggx:roughness`). At Ns = 100 {right} of the {rules} rules
come within {about} of it, the farthest is {rougher} times as rough, and {mirrors} make a perfect
mirror of everything from some exponent on. The commonest mistake is a missing square root: α stored
as roughness. What remains of the error of `environment` is the difference between the two
distributions, which no roughness mends.

A file that one of these programs made is repaired by naming it:
`mdfconv convert --from blinn-phong:obj2gltf --to ggx:roughness 0.9` is what an exponent of 100
should have become."""

_RULES = """\
N: the exponent. r: the roughness stored. L: luminance of Ks or weight of the specular lobe, 1 in
these numbers. s: smoothness, 1 − r. RMSE: relative, under the environment metric; `mirror` is a
roughness of 0, which has no highlight to compare. The rule's exact inverse, where it has one, is
the encoding `blinn-phong:` with the importer's name."""
