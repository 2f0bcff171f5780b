"""The pages on Sawicki 2021: its table, its formulas and its figures, recomputed."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from mdfconv.conversion import convert
from mdfconv.fitting.metrics import list_metrics, metric_named
from mdfconv.output.files import file_bytes
from mdfconv.output.records import csv_text, markdown_text
from mdfconv.render.comparison import PAPER_FIGURES, PAPER_SETS, Scene, default_rules
from mdfconv.render.comparison import compare as compare_pictures
from mdfconv.render.comparison_figure import draw_comparison
from mdfconv.studies.closed_forms import refit_rows
from mdfconv.studies.error_curves import curves, draw_errors
from mdfconv.studies.report.artefact import Artefact
from mdfconv.studies.table2 import AGREEMENT, COLUMNS, compare, fit_table, paper_sweep

_UNIT = "unit"
_POINTS = 1001
# The paper's prose: from N to the largest error of Blinn/Phong in per cent.
_BLINN_PHONG_CLAIMS = {10: 3.5, 40: 1.0, 100: 0.4, 1000: 0.03}
_OTHER_CLAIMS = {"schlick": "13-15 %", "sawicki": "3-7 %"}
# Small enough to be committed, large enough to see the difference.
_FIGURE_DPI, _PICTURE_SIZE = 110, 192


def table2() -> Artefact:
    """Return Table 2 and the comparison with the printed one."""
    rows = fit_table(*paper_sweep(), metric_named(_UNIT))
    cells = [asdict(cell) for cell in compare(rows)]
    missed = [cell for cell in cells if not cell["agrees"]]
    page = "\n".join(
        [
            "# Table 2 of Sawicki 2021, recomputed",
            "",
            "Beckmann fitted by the others, least squares on unit forms; root mean square errors "
            "beside the parameters. `n_eq11` is N by m_B² N = 2.",
            "",
            markdown_text(COLUMNS, rows),
            "",
            f"## The {len(missed)} printed cells that do not come back",
            "",
            "`units`: our difference in units of the last printed digit.",
            "",
            markdown_text(list(cells[0]), missed),
        ]
    )
    agreeing = f"{len(cells) - len(missed)} of {len(cells)} cells within {AGREEMENT:.0e}"
    return Artefact(
        {"table2.csv": file_bytes(csv_text(COLUMNS, rows)), "table2.md": file_bytes(page)},
        "Sawicki 2021, Table 2",
        f"{agreeing.replace('e-0', 'e-')} relative; the others are explained",
        "mdfconv fit-table --compare",
    )


def other_metrics() -> Artefact:
    """Return the table for the metrics that the paper does not have."""
    files: dict[str, bytes] = {}
    metrics = [metric_named(name) for name in list_metrics() if name != _UNIT]
    for metric in metrics:
        rows = fit_table(*paper_sweep(), metric)
        files[f"table2-{metric}.csv"] = file_bytes(csv_text(COLUMNS, rows))
        page = f"# Table 2 under the {metric} metric\n\n{markdown_text(COLUMNS, rows)}"
        files[f"table2-{metric}.md"] = file_bytes(page)
    kept = " or ".join(f"the {metric.keeps} ({metric})" for metric in metrics)
    return Artefact(
        files,
        f"Table 2 for those who keep {kept}",
        "no printed counterpart",
        f"mdfconv fit-table --metric {metrics[0]}",
    )


def closed_forms() -> Artefact:
    """Return the paper's coefficients beside refitted ones."""
    exact = refit_rows([metric_named(name) for name in list_metrics()])
    errors = ("worst_printed", "worst_refitted")
    rows = [row | {name: f"{row[name]:.4g}" for name in errors} for row in exact]
    columns = list(rows[0])
    worst = max(row["worst_printed"] for row in exact if row["metric"] == _UNIT)
    page = "\n".join(
        [
            "# The closed forms of Sawicki 2021, refitted",
            "",
            "Coefficients a, b of the printed shapes, and the worst relative error of each over "
            "the 17 rows of Table 2 under every metric. The printed ones were fitted to unit "
            "forms; where the light or the picture is to be kept, the refitted ones are right.",
            "",
            markdown_text(columns, rows),
        ]
    )
    return Artefact(
        {
            "closed-forms.csv": file_bytes(csv_text(columns, rows)),
            "closed-forms.md": file_bytes(page),
        },
        "Sawicki 2021, equations (12)-(15), Tables 3 and 4",
        f"the printed coefficients are within {100 * worst:.2g} % of the unit table",
        "mdfconv fit-table --closed-forms",
    )


def error_figures() -> Artefact:
    """Return Figures 1 and 2, and their maxima beside the paper's prose."""
    files: dict[str, bytes] = {}
    rows: list[dict[str, Any]] = []
    for name, parameters in PAPER_SETS.items():
        drawn = curves(parameters, "beckmann", metric_named(_UNIT), _POINTS)
        files[f"{name}.png"] = draw_errors(drawn, f"Sawicki 2021, {name}", dpi=_FIGURE_DPI)
        files[f"{name}b.csv"] = file_bytes(drawn.error_text())
        rows += [{"figure": name} | row for row in drawn.maxima()]
    blinn_phong = {exponent: _largest_error(exponent) for exponent in _BLINN_PHONG_CLAIMS}
    others = {
        name: [row["max_error_percent"] for row in rows if row["distribution"] == name]
        for name in _OTHER_CLAIMS
    }
    files["errors.md"] = file_bytes(
        "\n".join(
            [
                "# Largest errors in Figures 1 and 2 of Sawicki 2021",
                "",
                "(D̄ − D̄_Beckmann)/max D̄_Beckmann, in per cent, and where it occurs.",
                "",
                markdown_text(list(rows[0]), rows),
                "",
                "## The paper's prose",
                "",
                markdown_text(["claim", "printed", "computed"], _claims(blinn_phong, others)),
            ]
        )
    )
    return Artefact(
        files,
        "Sawicki 2021, Figures 1 and 2: (a) unit forms, (b) error against Beckmann",
        "the prose's maxima come back at N = 10 and 1000 and for Sawicki; Blinn/Phong at N = 40 "
        f"and 100 is better than printed ({blinn_phong[40]:.2f} % and {blinn_phong[100]:.2f} %, "
        f"printed 1 % and 0.4 %), Schlick's smaller one is {min(others['schlick']):.3g} %, "
        "printed 13 %",
        "mdfconv plot-error",
    )


def _largest_error(exponent: float) -> float:
    """Return the largest error of a Blinn/Phong against the Beckmann it stands for, per cent."""
    m_b = convert(exponent, "blinn-phong", "beckmann")
    pair = {"beckmann": m_b, "blinn-phong": exponent}
    (row,) = curves(pair, "beckmann", metric_named(_UNIT), _POINTS).maxima()
    return float(row["max_error_percent"])


def _claims(blinn_phong: dict[int, float], others: dict[str, list[float]]) -> list[dict[str, str]]:
    """Return the paper's claims in words beside what the curves say."""
    claims = [
        {
            "claim": f"blinn-phong, N = {exponent}",
            "printed": f"{printed:g} %",
            "computed": f"{blinn_phong[exponent]:.3g} %",
        }
        for exponent, printed in _BLINN_PHONG_CLAIMS.items()
    ]
    return claims + [
        {
            "claim": f"{name}, Figures 1 and 2",
            "printed": printed,
            "computed": " and ".join(f"{value:.3g} %" for value in others[name]),
        }
        for name, printed in _OTHER_CLAIMS.items()
    ]


def pictures() -> Artefact:
    """Return Figures 4 and 5: pictures, sections through the highlight, and their errors."""
    files: dict[str, bytes] = {}
    rows: list[dict[str, Any]] = []
    scene = Scene(size=_PICTURE_SIZE)
    for name, m_b in PAPER_FIGURES.items():
        comparison = compare_pictures(m_b, default_rules(scene.exposure), scene)
        columns, section = comparison.section_rows()
        files[f"{name}.png"] = draw_comparison(comparison, _FIGURE_DPI)
        files[f"{name}.csv"] = file_bytes(csv_text(columns, section))
        rows += [{"figure": name} | row for row in comparison.table()]
    page = "\n".join(
        [
            "# Figures 3 to 5 of Sawicki 2021, and what a conversion keeps",
            "",
            "A sphere lit from above left; each picture against Beckmann's. Linear: light, "
            "relative to the peak of Beckmann. Displayed: sRGB-encoded, clipped at white, "
            "exposure 1. For each distribution the fit for the light has the smallest linear "
            "error and the fit for the picture the smallest displayed one; the paper's closed "
            "form keeps the shape and has neither.",
            "",
            markdown_text(list(rows[0]), rows),
        ]
    )
    files["pictures.md"] = file_bytes(page)
    return Artefact(
        files,
        "Sawicki 2021, Figures 3 to 5: one sphere, the distributions exchanged",
        "Blinn/Phong and Gauss cannot be told from Beckmann, GGX has the gentler edges, as the "
        "paper says",
        "mdfconv compare --size 192",
    )
