"""What importers make of a Wavefront exponent, and what it should be."""

from __future__ import annotations

from itertools import cycle
from typing import Any

import numpy as np
from matplotlib import colormaps

from mdfconv.distributions.endpoint import endpoints
from mdfconv.distributions.evaluation import Array
from mdfconv.fitting.metrics import metric_named
from mdfconv.formula import SearchProblem, cheapest
from mdfconv.output.figures import PAGE, encoded, new_figure
from mdfconv.output.records import csv_text, markdown_text, rounded_rows
from mdfconv.scene import shininess
from mdfconv.scene.shininess import EXPONENTS, IMPORTERS, roughness_of
from mdfconv.studies.pages import PageFiles, fill, pivot

_EXPONENTS = np.geomspace(1, 1e4, 81)
# Of the roughness that is asked for.
_ABOUT_RIGHT = 0.1
_MIRROR = 1e-9
_LIGHT = "environment"
# Our metrics above the rules, in black and grey.
_OUR_STYLES = {
    "environment": ("#000000", "-"),
    "energy": ("#666666", (0, (5, 1))),
    "display": ("#666666", ":"),
}
_DASHES = ("-", (0, (6, 2)), (0, (2, 1)), "-.")


def importers() -> PageFiles:
    """Return what importers make of a Wavefront exponent, beside the best fit."""
    curves, rules = _curves(), _rules()
    low, high = float(_EXPONENTS[0]), float(_EXPONENTS[-1])
    light = metric_named(_LIGHT)
    pair = endpoints(shininess.SHININESS, shininess.ROUGHNESS)
    formula = cheapest(SearchProblem(*pair, light, low, high), 0.01)
    at_100 = [rule["roughness_100"] for rule in rules]
    right = float(roughness_of(np.array([100.0]), light)[0])
    figures = {"rules": len(rules), "lowest": min(at_100), "highest": max(at_100), "right": right}
    answers = [
        (f"{n:g}", name, f"{roughness_of(np.array([n]), metric_named(name))[0]:.4g}")
        for n in map(float, (1, *EXPONENTS, 10000))
        for name in _OUR_STYLES
    ]
    page = fill(
        "importers",
        constant=formula.numerator[0],
        slope=formula.numerator[1],
        root=-1 / formula.shape.outer,
        formula_error=formula.error,
        low=low,
        high=high,
        about_right=sum(abs(value / right - 1) < _ABOUT_RIGHT for value in at_100),
        tolerance=_ABOUT_RIGHT,
        mirrors=sum(bool((curves[rule] < _MIRROR).any()) for rule in IMPORTERS),
        rule_table=markdown_text(list(rules[0]), rules),
        answers=pivot("Ns", answers),
        **figures,
    )
    return PageFiles([page, csv_text(list(curves), rounded_rows(curves)), _draw(curves)], figures)


def _curves() -> dict[str, Array]:
    """Return Ns, the roughness by each rule and by ours, and the RMSE of each for the light."""
    roughness = {rule: shininess.importer_roughness(rule, _EXPONENTS) for rule in IMPORTERS}
    roughness |= {name: roughness_of(_EXPONENTS, metric_named(name)) for name in _OUR_STYLES}
    light = metric_named(_LIGHT)
    errors = {
        f"RMSE {name}": shininess.error_of(_EXPONENTS, roughness[name], light)
        for name in (*IMPORTERS, _LIGHT)
    }
    return {"Ns": _EXPONENTS} | roughness | errors


def _rules() -> list[dict[str, Any]]:
    """Return each rule with the roughness and the error that it leaves."""
    rules = []
    for record in shininess.encoding_records(metric_named(_LIGHT)):
        name = record["encoding"].partition(":")[2]
        if name in IMPORTERS:
            row = {"importer": name, "programs": record["programs"], "rule": record["formula"]}
            keys = [f"roughness_{n}" for n in EXPONENTS]
            row |= {key: float(f"{record[key]:.3g}") for key in keys}
            rmse = {key: record[key] for key in (f"rmse_{n}" for n in EXPONENTS)}
            row |= {key: f"{e:.2g}" if np.isfinite(e) else "mirror" for key, e in rmse.items()}
            rules.append(row)
    return rules


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
    styles = dict(zip(labels, zip(cycle(colors), cycle(_DASHES), strict=False), strict=False))
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
    right.set(xscale="log", yscale="log", xlabel="Ns", ylabel="relative RMSE under environment")
    right.set_title("Error, up to where a rule makes a mirror")
    figure.legend(loc="outside lower center", ncols=5)
    return encoded(figure, dpi=110)
