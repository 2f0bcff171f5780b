"""The report folder: every table and figure of the project, and the index to them.

A new artefact is a function that returns an `Artefact`, and one entry in `_ARTEFACTS`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

from mdfconv.conversion import convert
from mdfconv.errors import MdfconvError
from mdfconv.fitting.metrics import list_metrics, metric
from mdfconv.reports.closed_forms import refit
from mdfconv.reports.comparison import PAPER_FIGURES, Scene, default_rules
from mdfconv.reports.comparison import compare as compare_pictures
from mdfconv.reports.comparison_figure import draw_comparison
from mdfconv.reports.error_curves import PAPER_SETS, curves
from mdfconv.reports.error_figure import draw_errors
from mdfconv.reports.fresnel_page import fresnel_page
from mdfconv.reports.furnace_page import furnace_page
from mdfconv.reports.importer_page import importer_page
from mdfconv.reports.method_page import method_page
from mdfconv.reports.stability_page import stability_page
from mdfconv.reports.table2 import COLUMNS, compare, fit_table, paper_sweep
from mdfconv.reports.text import csv_text, file_bytes, markdown_text, write_files

Files = dict[str, bytes]


@dataclass(frozen=True)
class Artefact:
    """Files of the report, and what the index says of them.

    Parameters
    ----------
    files : dict
        From file names to contents.
    reproduces : str
        Which table or figure of which source, or what question is answered.
    agreement : str
        How well, in figures.
    command : str
        The command that makes it.
    """

    files: Files
    reproduces: str
    agreement: str
    command: str


def table2() -> Artefact:
    """Return Table 2 and the comparison with the printed one."""
    rows = fit_table(*paper_sweep(), metric("unit"))
    cells = [asdict(cell) for cell in compare(rows)]
    agreeing = sum(cell["agrees"] for cell in cells)
    columns = list(cells[0])
    page = "\n".join(
        [
            "# Table 2 of Sawicki 2021, recomputed",
            "",
            "Beckmann fitted by the others, least squares on unit forms; root mean square errors "
            "beside the parameters. `n_eq11` is N by m_B² N = 2.",
            "",
            markdown_text(COLUMNS, rows),
            "",
            f"## The {len(cells) - agreeing} printed cells that do not come back",
            "",
            "`units`: our difference in units of the last printed digit.",
            "",
            markdown_text(columns, [cell for cell in cells if not cell["agrees"]]),
        ]
    )
    return Artefact(
        {"table2.csv": file_bytes(csv_text(COLUMNS, rows)), "table2.md": file_bytes(page)},
        "Sawicki 2021, Table 2",
        f"{agreeing} of {len(cells)} cells within 4e-4 relative; the others are explained",
        "mdfconv fit-table --compare",
    )


def other_metrics() -> Artefact:
    """Return the table for the metrics that the paper does not have."""
    files: Files = {}
    for name in list_metrics()[1:]:
        rows = fit_table(*paper_sweep(), metric(name))
        files[f"table2-{name}.csv"] = file_bytes(csv_text(COLUMNS, rows))
        page = f"# Table 2 under the {name} metric\n\n{markdown_text(COLUMNS, rows)}"
        files[f"table2-{name}.md"] = file_bytes(page)
    return Artefact(
        files,
        "Table 2 for those who keep the light (energy) or the picture (display, exposure 1)",
        "no printed counterpart",
        "mdfconv fit-table --metric energy",
    )


def closed_forms() -> Artefact:
    """Return the paper's coefficients beside refitted ones."""
    rows = [
        {
            "from": found.form.source,
            "to": found.form.target,
            "formula": found.form.text,
            "metric": found.metric,
            "printed": " ".join(f"{value:.6g}" for value in found.form.printed),
            "worst_printed": f"{found.printed_error:.4g}",
            "refitted": " ".join(f"{value:.6g}" for value in found.coefficients),
            "worst_refitted": f"{found.error:.4g}",
        }
        for name in list_metrics()
        for found in refit(metric(name))
    ]
    columns = list(rows[0])
    unit = [row for row in rows if row["metric"] == "unit"]
    worst = max(float(row["worst_printed"]) for row in unit)
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


# The paper's prose: from N to the largest error of Blinn/Phong in per cent.
_PROSE = {10: 3.5, 40: 1.0, 100: 0.4, 1000: 0.03}
_FIGURE_DPI = 110
_PICTURE_SIZE = 192


def error_figures() -> Artefact:
    """Return Figures 1 and 2, and their maxima beside the paper's prose."""
    files: Files = {}
    rows: list[dict[str, object]] = []
    for name, given in PAPER_SETS.items():
        found = curves(given, "beckmann", metric("unit"), 1001)
        files[f"{name}.png"] = draw_errors(found, f"Sawicki 2021, {name}", dpi=_FIGURE_DPI)
        files[f"{name}b.csv"] = file_bytes(found.error_text())
        rows += [{"figure": name} | row for row in found.maxima()]
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
                markdown_text(["claim", "printed", "computed"], _prose(rows)),
            ]
        )
    )
    return Artefact(
        files,
        "Sawicki 2021, Figures 1 and 2: (a) unit forms, (b) error against Beckmann",
        "the prose's maxima come back at N = 10 and 1000 and for Sawicki; Blinn/Phong at N = 40 "
        "and 100 is better than printed (0.74 % and 0.30 %, printed 1 % and 0.4 %), Schlick's "
        "smaller one is 12.4 %, printed 13 %",
        "mdfconv plot-error",
    )


def _prose(rows: list[dict[str, object]]) -> list[dict[str, str]]:
    """Return the paper's claims in words beside what the curves say."""
    claims = []
    for exponent, printed in _PROSE.items():
        m_b = convert(exponent, "blinn-phong", "beckmann")
        pair = {"beckmann": m_b, "blinn-phong": exponent}
        largest = curves(pair, "beckmann", metric("unit"), 1001).maxima()[0]["max_error_percent"]
        claims.append(
            {
                "claim": f"blinn-phong, N = {exponent}",
                "printed": f"{printed:g} %",
                "computed": f"{largest:.3g} %",
            }
        )
    for name, words in (("schlick", "13-15 %"), ("sawicki", "3-7 %")):
        both = [row["max_error_percent"] for row in rows if row["distribution"] == name]
        computed = " and ".join(f"{value:.3g} %" for value in both)
        claims.append({"claim": f"{name}, Figures 1 and 2", "printed": words, "computed": computed})
    return claims


def pictures() -> Artefact:
    """Return Figures 4 and 5: pictures, sections through the highlight, and their errors."""
    files: Files = {}
    rows: list[dict[str, object]] = []
    scene = Scene(size=_PICTURE_SIZE)
    for name, m_b in PAPER_FIGURES.items():
        found = compare_pictures(m_b, default_rules(scene.exposure), scene)
        columns, section = found.section_rows()
        files[f"{name}.png"] = draw_comparison(found, _FIGURE_DPI)
        files[f"{name}.csv"] = file_bytes(csv_text(columns, section))
        rows += [{"figure": name} | row for row in found.table()]
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


def methods() -> Artefact:
    """Return the methods beside the best fit: the figures for the choice of a default."""
    files, summary = method_page()
    question = "which method should be the default"
    return Artefact(files, question, summary, "mdfconv report")


def importers() -> Artefact:
    """Return what importers make of a Wavefront exponent, beside the best fit."""
    files, summary = importer_page()
    question = "what becomes of Ns in a renderer with roughness"
    return Artefact(files, question, summary, "mdfconv mtl --compare")


def furnace() -> Artefact:
    """Return the white furnace of the BRDFs."""
    files, summary = furnace_page()
    question = "the lecture's claim on normalizers; who loses energy, and who makes some"
    return Artefact(files, question, summary, "mdfconv furnace")


def fresnel() -> Artefact:
    """Return Smoothie's Fresnel term beside the exact curves."""
    files, summary = fresnel_page()
    return Artefact(files, "Smoothie, the fit of the Fresnel term", summary, "mdfconv fresnel")


def stability() -> Artefact:
    """Return the audit of hard cases."""
    files, summary = stability_page()
    question = "how accurate the forms are where formulas lose their digits"
    return Artefact(files, question, summary, "mdfconv stability")


# Times cannot be reproduced: these are made by `mdfconv bench`, and only listed here.
MEASURED = ("speed-error.md", "speed-error.csv", "speed-error.png")
_ARTEFACTS: tuple[Callable[[], Artefact], ...] = (
    table2,
    other_metrics,
    closed_forms,
    error_figures,
    pictures,
    methods,
    importers,
    furnace,
    fresnel,
    stability,
)
COUNT = len(_ARTEFACTS)


def build(folder: Path) -> Iterator[Artefact]:
    """Write the report into a folder, yielding each artefact as it is written.

    Parameters
    ----------
    folder : Path
        Created if its parent exists.

    Raises
    ------
    MdfconvError
        If the folder cannot be written.
    """
    try:
        folder.mkdir(exist_ok=True)
    except OSError as error:
        raise MdfconvError(f"cannot create {folder}: {error.strerror}") from None
    done = []
    for make in _ARTEFACTS:
        artefact = make()
        write_files({folder / name: content for name, content in artefact.files.items()})
        done.append(artefact)
        yield artefact
    measured = [name for name in MEASURED if (folder / name).exists()]
    write_files({folder / "README.md": file_bytes(_index(done, measured))})


def _index(artefacts: list[Artefact], measured: list[str]) -> str:
    """Return the index; `measured` are files in the folder that another command made."""
    rows = [
        {
            "files": ", ".join(f"[{name}]({name})" for name in artefact.files),
            "reproduces": artefact.reproduces,
            "agreement": artefact.agreement,
            "command": f"`{artefact.command}`",
        }
        for artefact in artefacts
    ]
    if measured:
        rows.append(
            {
                "files": ", ".join(f"[{name}]({name})" for name in measured),
                "reproduces": "speed against error: what the choices cost",
                "agreement": "measured on one machine; other machines give other times",
                "command": "`mdfconv bench`",
            }
        )
    return "\n".join(
        [
            "# Report",
            "",
            "Everything that mdfconv reproduces or shows, made by `mdfconv report`.",
            "",
            markdown_text(["files", "reproduces", "agreement", "command"], rows),
        ]
    )
