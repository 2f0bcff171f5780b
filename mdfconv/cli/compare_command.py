"""``mdfconv compare``."""

from __future__ import annotations

import re
from collections.abc import Sequence
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mdfconv.cli import completion
from mdfconv.cli.options import (
    DpiOption,
    FolderOption,
    ForceOption,
    FormatOption,
    MdfOption,
    MethodOption,
    chosen_metric,
)
from mdfconv.cli.outputs import Outputs, check_folder, value_name
from mdfconv.cli.tables import write_table
from mdfconv.distributions import one_parameter_distribution
from mdfconv.errors import MdfconvError
from mdfconv.output.files import file_bytes
from mdfconv.output.records import csv_text

if TYPE_CHECKING:
    from mdfconv.render.comparison import Rule, Scene

_COLUMNS = (
    "figure", "conversion", "distribution", "parameter", "rmse_linear", "psnr_linear",
    "rmse_displayed", "psnr_displayed", "peak_ratio", "energy_ratio",
)  # fmt: skip


# As `mdfconv.render.comparison` has it, which takes long to import.
_REFERENCE = "beckmann"


class Light(StrEnum):
    """The lights of the scene."""

    directional = "directional"
    area = "area"


class Brdf(StrEnum):
    """The BRDFs into which a distribution can be put."""

    ashikhmin_shirley = "ashikhmin-shirley"
    cook_torrance = "cook-torrance"
    smoothie = "smoothie"
    smoothie_approx = "smoothie-approx"
    modified_phong = "modified-phong"


def command(
    m_b: Annotated[
        list[float] | None,
        typer.Option(
            "--m-b", metavar="M", help="Beckmann's m_B; repeatable; default 0.4 and 0.04464."
        ),
    ] = None,
    mdf: MdfOption = None,
    method: MethodOption = None,
    metric: Annotated[
        str | None,
        typer.Option(
            metavar="METRIC", autocompletion=completion.metrics, help="What --method fit keeps."
        ),
    ] = None,
    exposure: Annotated[
        float,
        typer.Option(
            metavar="E",
            help="Exposure: 1 displays the peak of Beckmann, or its brightest channel, as white.",
        ),
    ] = 1.0,
    light: Annotated[Light, typer.Option(help="A directional light or a square one.")] = (
        Light.directional
    ),
    brdf: Annotated[
        Brdf, typer.Option(help="The BRDF into which the distribution is put.")
    ] = Brdf.ashikhmin_shirley,
    material: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            autocompletion=completion.materials,
            help="What is reflected: gold, silver, copper, nickel, iron or chrome, in colour; "
            "acrylic, polycarbonate, polystyrene, polyethylene, polypropylene or pvc.",
        ),
    ] = None,
    normalized: Annotated[bool, typer.Option("--normalized/--unit", help="The form of D.")] = True,
    size: Annotated[int, typer.Option(metavar="N", help="Pixels a side of a picture.")] = 256,
    html: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Write a page with sliders instead, for the first --mdf, which may be a stored "
            "form; ggx if not given. Pictures, too, only with --output.",
        ),
    ] = None,
    source: Annotated[
        str,
        typer.Option(
            "--from",
            metavar="MDF",
            autocompletion=completion.endpoints,
            help="What the page converts from.",
        ),
    ] = _REFERENCE,
    dpi: DpiOption = 120,
    output: FolderOption = None,
    force: ForceOption = False,
    format_: FormatOption = None,
) -> None:
    """Render a sphere with one distribution put in another's place: Figures 3 to 5.

    Writes a contact sheet (fig4.png, fig5.png) and the luminance through the highlight (CSV);
    names say what differs from the paper's figures, such as fig4-gold.png.
    Prints RMSE and PSNR against Beckmann, in linear light and as displayed, and the ratios of
    peak and total energy; of a metal over all three channels, and the luminance is that of its
    colour. Without --material F is Schlick's for a grey dielectric of index 1.5. A distant light
    meets the whole sphere with one F, but for modified-phong, which takes it at the viewer's
    angle: there and under an area light plastics differ, metals everywhere.

    The distribution goes into the Smoothie article's exact form (smoothie, D F/(h.h)), its
    approximate one (smoothie-approx, half angle by the length of h in the surface, no G), or
    around the mirror direction (modified-phong, which is Phong's for blinn-phong).

    With --html one file for a browser, which needs no other: both on one sphere, their lobes, and
    the converted number, while the parameter, the metric, the light and the stored form change.

    Examples:

    mdfconv compare

    mdfconv compare --m-b 0.2 --mdf ggx --light area --exposure 4

    mdfconv compare --m-b 0.1 --method fit --metric display --brdf cook-torrance --size 512

    mdfconv compare --m-b 0.3 --material gold --brdf smoothie

    mdfconv compare --from blinn-phong --mdf ggx:roughness --html page.html
    """
    outputs = Outputs(html, force=force)
    page = partial(_page, source, (mdf or ["ggx"])[0], m_b)
    if html is not None and output is None:
        outputs.write({html: page()})
        return
    from mdfconv.paper.error_curves import DRAWN
    from mdfconv.render.comparison import PAPER_FIGURES, Scene, compare
    from mdfconv.render.comparison_figure import draw_comparison

    if html is None and source != _REFERENCE:
        raise MdfconvError(f"pictures are compared with {_REFERENCE}", "--from goes with --html")
    rules = _rules(method, metric, exposure)
    names = list(dict.fromkeys(one_parameter_distribution(name).name for name in mdf or DRAWN))
    scene = Scene(brdf.value, light.value, normalized, exposure, size, material)
    given = {f"compare-m_b-{value_name(value)}": value for value in m_b or ()}
    figures = {
        _figure_name(start, scene, rules, names): value
        for start, value in (given or PAPER_FIGURES).items()
    }
    folder = check_folder(output)
    outputs.check(*(folder / f"{name}.{end}" for name in figures for end in ("csv", "png")))
    rows: list[dict[str, Any]] = []
    contents = {html: page()} if html else {}
    for name, value in figures.items():
        comparison = compare(value, rules, scene, names)
        rows += [{"figure": name} | row for row in comparison.table()]
        columns, section = comparison.section_rows()
        contents[folder / f"{name}.csv"] = file_bytes(csv_text(columns, section))
        contents[folder / f"{name}.png"] = draw_comparison(comparison, dpi)
    outputs.write(contents)
    write_table(_COLUMNS, rows, format_, title="Pictures against Beckmann's")


def _figure_name(start: str, scene: Scene, rules: Sequence[Rule], names: Sequence[str]) -> str:
    """Return the name of a figure: a word for all that is not as usual but the number of pixels."""
    from mdfconv.conversion import method_named
    from mdfconv.paper.error_curves import DRAWN
    from mdfconv.render.comparison import Scene, default_rules

    usual, words = Scene(), [start]
    if tuple(names) != DRAWN:
        words += names
    if [rule.label for rule in rules] != [rule.label for rule in default_rules(scene.exposure)]:
        for rule in rules:
            kept = [str(rule.metric)] if method_named(rule.method).follows_metric else []
            words += [rule.method, *kept]
    words += [
        word
        for word, differs in (
            (scene.brdf, scene.brdf != usual.brdf),
            (scene.light, scene.light != usual.light),
            ("unit-form", scene.normalized != usual.normalized),
            (f"exposure-{value_name(scene.exposure)}", scene.exposure != usual.exposure),
            (scene.material or "", scene.material != usual.material),
        )
        if differs
    ]
    # A metric can name a file, which may stand in a folder.
    return re.sub(r"[^\w.+-]+", "-", "-".join(words))


def _page(source: str, target: str, m_b: list[float] | None) -> bytes:
    from mdfconv.conversion.endpoint import endpoint
    from mdfconv.render.page import comparison_page

    ends = endpoint(source), endpoint(target)
    if m_b and ends[0].distribution.name != _REFERENCE:
        raise MdfconvError(f"--m-b is the parameter of {_REFERENCE}, not of {ends[0].label}")
    return comparison_page(*ends, m_b[0] if m_b else None)


def _rules(method: str | None, metric: str | None, exposure: float) -> list[Rule]:
    from mdfconv.conversion import method_named
    from mdfconv.fitting.metrics import metric_named
    from mdfconv.render.comparison import Rule, default_rules

    if method is None and metric is None:
        return default_rules(exposure)
    if metric is not None and method is not None and not method_named(method).follows_metric:
        raise MdfconvError(f"--metric goes with a fit, not with --method {method}")
    kept = metric_named(metric or "unit")
    # A screen's picture is exposed as the scene is.
    kept = chosen_metric(kept.name, exposure) if kept.setting == "exposure" else kept
    return [Rule(method_named(method or "fit").name, kept)]
