"""``mdfconv compare``."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from mdfconv.cli import completion, options, process, tables
from mdfconv.cli.options import argument, option
from mdfconv.cli.outputs import Outputs, check_folder, value_name
from mdfconv.distributions import one_parameter_distributions
from mdfconv.distributions.endpoint import Endpoint, one_parameter_endpoint
from mdfconv.errors import MdfconvError
from mdfconv.fitting.metrics import metric_named
from mdfconv.output.files import file_bytes
from mdfconv.output.records import csv_text
from mdfconv.registry import ALL

if TYPE_CHECKING:
    from mdfconv.render.comparison import PictureRule, Scene

_COLUMNS = (
    "figure", "conversion", "distribution", "parameter", "rmse_linear", "psnr_linear",
    "rmse_displayed", "psnr_displayed", "peak_ratio", "energy_ratio",
)  # fmt: skip


# As `mdfconv.render.comparison` has it, which takes long to import.
_REFERENCE = "beckmann"
# What the page shows if nothing is said.
_ON_PAGE = "ggx"


# The BRDFs into which a distribution can be put.
_Brdf = Literal[
    "ashikhmin-shirley", "cook-torrance", "smoothie", "smoothie-approx", "modified-phong"
]

_VALUES = argument(
    "[VALUE]...", "Parameters of the source; of beckmann 0.4 and 0.04464 if not given."
)
_TARGETS = option(
    "MDF",
    "What takes its place, as for --from; repeatable; the paper's if not given.",
    "--to",
    words=completion.targets,
)
_METRIC = option("METRIC", "What --method fit keeps.", words=completion.metrics)
_EXPOSURE = option(
    "E", "Exposure: 1 displays the source's peak, or its brightest channel, as white."
)
_LIGHT = typer.Option(help="A directional light or a square one.")
_BRDF = typer.Option(help="The BRDF into which the distribution is put.")
_MATERIAL = option(
    "NAME",
    "What is reflected: gold, silver, copper, nickel, iron or chrome, in colour; "
    "acrylic, polycarbonate, polystyrene, polyethylene, polypropylene or pvc.",
    words=completion.materials,
)
_HTML = option(
    "FILE",
    "Write a page with sliders instead, from the first VALUE and for the first --to. "
    "Pictures, too, only with --output.",
)


def command(
    context: typer.Context,
    values: Annotated[list[float] | None, _VALUES] = None,
    source: options.FromOption = _REFERENCE,
    targets: Annotated[list[str] | None, _TARGETS] = None,
    method: options.MethodOption = None,
    metric: Annotated[str | None, _METRIC] = None,
    exposure: Annotated[float, _EXPOSURE] = 1.0,
    light: Annotated[Literal["directional", "area"], _LIGHT] = "directional",
    brdf: Annotated[_Brdf, _BRDF] = "ashikhmin-shirley",
    material: Annotated[str | None, _MATERIAL] = None,
    normalized: Annotated[bool, typer.Option("--normalized/--unit", help="The form of D.")] = True,
    size: Annotated[int, option("N", "Pixels a side of a picture.")] = 256,
    html: Annotated[Path | None, _HTML] = None,
    dpi: options.DpiOption = 120,
    output: options.FolderOption = None,
    force: options.ForceOption = False,
    format_: options.FormatOption = None,
) -> None:
    """Render a sphere with one distribution put in another's place: Figures 3 to 5.

    Writes a contact sheet (fig4.png, fig5.png) and the luminance through the highlight (CSV): the
    pictures, enlarged where the highlight is small, and how much brighter or darker each is
    displayed. Names say what differs from the paper's figures, such as fig4-gold.png. Prints RMSE
    and PSNR against the source, in linear light and as displayed, and the ratios of peak and total
    energy; of a metal over all three channels, and the luminance is that of its colour. Without
    --material F is Schlick's for a grey dielectric of index 1.5. A distant light meets the whole
    sphere with one F, but for modified-phong, which takes it at the viewer's angle: there and
    under an area light plastics differ, metals everywhere.

    The distribution goes into the Smoothie article's exact form (smoothie, D F/(h.h)), its
    approximate one (smoothie-approx, half angle by the length of h in the surface, no G), or
    around the mirror direction (modified-phong, which is Phong's for blinn-phong).

    With --html one file for a browser, which needs no other: both on one sphere, their lobes, and
    the converted number, while the parameter, the metric, the light and the stored form change.

    Examples:

    mdfconv compare

    mdfconv compare --from blinn-phong --to ggx 100

    mdfconv compare --to ggx:roughness --light area --exposure 4 0.2

    mdfconv compare --from ggx:roughness --method fit --metric display --size 512 0.3

    mdfconv compare 0.3 --material gold --brdf smoothie

    mdfconv compare --from blinn-phong --to ggx:roughness --html page.html
    """
    from mdfconv.render.comparison import Scene, compare
    from mdfconv.render.comparison_figure import draw_comparison
    from mdfconv.render.page import comparison_page

    outputs = Outputs(html, force=force)
    names = targets or []
    end = options.asked_endpoint(source)
    every = any(name.strip().lower() == ALL for name in names)
    ends = _targets(end, names, every=every)
    contents: dict[Path, bytes] = {}
    if html is not None:
        usual = [target for target in ends if target.label == _ON_PAGE and not names]
        shown = (usual or ends)[0]
        contents[html] = comparison_page(end, shown, values[0] if values else None)
        if output is None:
            outputs.write(contents)
            return
    options.refuse_idle_metric(context, method)
    rules = _rules(method, metric, exposure)
    surfaces = _surfaces(end, values)
    if every:
        ends = _answering(surfaces.values(), rules, end, ends)
    scene = Scene(brdf, light, normalized, exposure, size, material)
    words = _words(scene, rules, names)
    figures = {_file_name([start, *words]): value for start, value in surfaces.items()}
    folder = check_folder(context, output)
    outputs.check(*(folder / f"{name}.{kind}" for name in figures for kind in ("csv", "png")))
    rows: list[dict[str, Any]] = []
    for name, value in figures.items():
        comparison = compare(value, rules, scene, end, ends)
        rows += [{"figure": name} | row for row in comparison.table()]
        columns, section = comparison.section_rows()
        contents[folder / f"{name}.csv"] = file_bytes(csv_text(columns, section))
        contents[folder / f"{name}.png"] = draw_comparison(comparison, dpi)
    outputs.write(contents)
    form = tables.form_of(format_)
    if form == "table":
        # People read parameters with their symbols.
        texts = {target.label: target.text for target in ends}
        for row in rows:
            row["parameter"] = texts[row["distribution"]](row["parameter"])
    compared = " and ".join(map(end.text, surfaces.values()))
    title = f"Pictures against those of {end.label}, {compared}"
    tables.write_table(_COLUMNS, rows, form, title=title)


def _words(scene: Scene, rules: Sequence[PictureRule], targets: Sequence[str]) -> list[str]:
    """Return words for names of files: for all that is not as usual but the number of pixels."""
    from mdfconv.conversion import method_named
    from mdfconv.render.comparison import Scene, default_rules

    words = list(targets)
    if [rule.label for rule in rules] != [rule.label for rule in default_rules(scene.exposure)]:
        for rule in rules:
            words.append(rule.method)
            if method_named(rule.method).follows_metric:
                words.append(str(rule.metric))
    usual = Scene()
    of_scene = {
        "brdf": scene.brdf,
        "light": scene.light,
        "normalized": "unit-form",
        "exposure": f"exposure-{value_name(scene.exposure)}",
        "material": str(scene.material),
    }
    unusual = [name for name in of_scene if getattr(scene, name) != getattr(usual, name)]
    return words + [of_scene[name] for name in unusual]


def _file_name(words: Sequence[str]) -> str:
    """Return words as a name: a metric can have that of a file in a folder, a form has a colon."""
    return re.sub(r"[^\w.+-]+", "-", "-".join(words))


def _targets(source: Endpoint, names: Sequence[str], *, every: bool) -> list[Endpoint]:
    """Return what takes the source's place: what is named, or the paper's other distributions."""
    from mdfconv.render.comparison import PAPER_SETS

    if names and not every:
        ends = [options.asked_endpoint(name) for name in names]
        return list({end.label: end for end in ends}.values())
    others = [mdf.name for mdf in one_parameter_distributions()] if every else PAPER_SETS["fig1"]
    return [one_parameter_endpoint(name) for name in others if name != source.distribution.name]


def _answering(
    values: Iterable[float], rules: Sequence[PictureRule], source: Endpoint, ends: list[Endpoint]
) -> list[Endpoint]:
    """Return the targets to which all values can be converted; say why the others are left out."""
    from mdfconv.conversion import convert

    refusals: dict[str, MdfconvError] = {}
    for end in ends:
        try:
            for value, rule in product(values, rules):
                end.decode_one(convert(value, source, end, rule.method, metric=rule.metric))
        except MdfconvError as error:
            refusals[end.label] = error
    if len(refusals) == len(ends):
        raise next(iter(refusals.values()))
    for refusal in refusals.values():
        process.tell(f"left out: {refusal}")
    return [end for end in ends if end.label not in refusals]


def _surfaces(source: Endpoint, values: list[float] | None) -> Mapping[str, float]:
    """Return the surfaces by what their files' names begin with: the paper's if none is given."""
    from mdfconv.render.comparison import PAPER_FIGURES

    if values:
        return {f"compare-{source.label}-{value_name(value)}": value for value in values}
    if source.label != _REFERENCE:
        missing = f"the {source.stored.name} {source.stored.symbol} of {source.label}"
        raise MdfconvError(f"{missing} is missing", "give it as VALUE")
    return PAPER_FIGURES


def _rules(method: str | None, metric: str | None, exposure: float) -> list[PictureRule]:
    from mdfconv.conversion import method_named
    from mdfconv.render.comparison import PictureRule, default_rules

    if method is None and metric is None:
        return default_rules(exposure)
    chosen = metric_named(metric or "unit")
    if chosen.setting == "exposure":
        # A screen's picture is exposed as the scene is.
        chosen = options.chosen_metric(chosen.name, exposure)
    return [PictureRule(method_named(method or "fit").name, chosen)]
