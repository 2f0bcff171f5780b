"""The pages on Sawicki 2021: its table, its formulas and its figures, recomputed."""

from __future__ import annotations

from typing import Any

from mdfconv.conversion import convert
from mdfconv.distributions.endpoint import endpoints
from mdfconv.fitting.metrics import list_metrics, metric_named
from mdfconv.output.records import csv_text, markdown_text
from mdfconv.render import comparison as spheres
from mdfconv.render.comparison_figure import draw_comparison
from mdfconv.render.page import filled, page_data
from mdfconv.scene.shininess import ROUGHNESS
from mdfconv.studies import table2 as paper_table
from mdfconv.studies.error_curves import Curves, curves, draw_errors
from mdfconv.studies.pages import PageFiles, fill, pivot, tracked

_UNIT = "unit"
# The paper states the largest error of Blinn/Phong for these exponents.
_STATED = (10, 40, 100, 1000)
# Small enough to be committed, large enough to see the difference.
_FIGURE_DPI, _PICTURE_SIZE = 110, 192


def table2() -> PageFiles:
    """Return Table 2 and the printed cells that do not come back."""
    rows = paper_table.fit_table(*paper_table.paper_sweep(), metric_named(_UNIT))
    cells = list(paper_table.printed_cells(rows))
    missed = [cell for cell in cells if not cell["agrees"]]
    columns = [name for name in cells[0] if name != "agrees"]
    figures = {"cells": len(cells), "missed": len(missed), "tolerance": paper_table.AGREEMENT}
    figures["agreeing"] = len(cells) - len(missed)
    table = markdown_text(paper_table.COLUMNS, rows)
    missed_table = markdown_text(columns, missed)
    page = fill("table2", table=table, missed_table=missed_table, **figures)
    return PageFiles([page, csv_text(paper_table.COLUMNS, rows)], figures)


def table2_by_metric() -> PageFiles:
    """Return the table for the metrics that the paper does not have."""
    files, links = [], []
    for name in list_metrics()[1:]:
        metric = metric_named(name)
        rows = paper_table.fit_table(*paper_table.paper_sweep(), metric)
        table, last = markdown_text(paper_table.COLUMNS, rows), rows[-1]
        smoothest, ratio = last["m_b"], last["c_tr"] / last["m_b"]
        figures = {"metric": name, "keeps": metric.keeps, "smoothest": smoothest, "ratio": ratio}
        page = fill("table2-metric", table=table, **figures)
        files += [page, csv_text(paper_table.COLUMNS, rows)]
        links.append(f"[table2-{name}.md](table2-{name}.md)")
    return PageFiles(files, {"links": ", ".join(links)})


def closed_forms() -> PageFiles:
    """Return the paper's coefficients beside refitted ones."""
    rows = paper_table.refit_rows([metric_named(name) for name in list_metrics()])
    coefficients = [(row["formula"], "a, b", row["printed"]) for row in rows]
    printed = [(row["formula"], row["metric"], f"{row['worst_printed']:.2%}") for row in rows]
    refitted = [
        (row["formula"], row["metric"], f"{row['refitted']} ({row['worst_refitted']:.2%})")
        for row in rows
    ]
    worst = {
        error: {
            metric: max(row[error] for row in rows if row["metric"] == metric)
            for metric in list_metrics()
        }
        for error in ("worst_printed", "worst_refitted")
    }
    printed_table = pivot("formula", coefficients + printed)
    refitted_table = pivot("formula", refitted)
    page = fill("closed-forms", printed=printed_table, refitted=refitted_table, **worst)
    shown = [row | {error: f"{row[error]:.4g}" for error in worst} for row in rows]
    return PageFiles([page, csv_text(list(shown[0]), shown)], worst)


def errors() -> PageFiles:
    """Return Figures 1 and 2, and their maxima beside the paper's prose."""
    drawn = {name: curves(parameters) for name, parameters in spheres.PAPER_SETS.items()}
    maxima = [{"figure": name} | row for name, each in drawn.items() for row in each.maxima()]
    first = spheres.REFERENCE
    pairs = {n: {first: convert(n, "blinn-phong", first), "blinn-phong": n} for n in _STATED}
    figures: dict[str, Any] = {name: _largest(each) for name, each in drawn.items()}
    figures["blinn_phong"] = {n: _largest(curves(pair))["blinn-phong"] for n, pair in pairs.items()}
    page = fill("errors", maxima=markdown_text(list(maxima[0]), maxima), **figures)
    files: list[str | bytes] = [page]
    for name, each in tracked(drawn.items()):
        files += [draw_errors(each, f"Sawicki 2021, {name}", dpi=_FIGURE_DPI), each.error_text()]
    return PageFiles(files, figures)


def _largest(drawn: Curves) -> dict[str, float]:
    """Return the largest error of each distribution, a share of the reference's peak."""
    return {row["distribution"]: row["max_error_percent"] / 100 for row in drawn.maxima()}


def pictures() -> PageFiles:
    """Return Figures 4 and 5: pictures, sections through the highlight, and their errors."""
    files: list[str | bytes] = []
    rows: list[dict[str, Any]] = []
    scene = spheres.Scene(size=_PICTURE_SIZE)
    rules = spheres.default_rules(scene.exposure)
    for name, m_b in tracked(spheres.PAPER_FIGURES.items()):
        comparison = spheres.compare(m_b, rules, scene)
        files += [draw_comparison(comparison, _FIGURE_DPI), csv_text(*comparison.section_rows())]
        rows += [{"figure": name} | row for row in comparison.table()]
    first = [row for row in rows if row["conversion"] == rules[0].label]
    figures = {
        name: {row["distribution"]: row for row in first if row["figure"] == name}
        for name in spheres.PAPER_FIGURES
    }
    columns = [name for name in rows[0] if not name.startswith("psnr")]
    page = fill("pictures", table=markdown_text(columns, rows), **figures)
    return PageFiles([page, *files], figures)


def comparison() -> PageFiles:
    """Return the page for a browser: the reference and what most renderers have, with sliders."""
    data = page_data(*endpoints(spheres.REFERENCE, ROUGHNESS))
    return PageFiles([filled(data)], {"interpolation": data["interpolation"]})
