"""``mdfconv texture``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from mdfconv.cli import completion, options, process, tables
from mdfconv.cli.options import argument, flag, option
from mdfconv.cli.outputs import Outputs

_SOURCE = option(
    "MDF:ENCODING",
    "What the texels are: ggx:alpha, ggx:roughness, ggx:glossiness, likewise "
    "beckmann; blinn-phong:exponent (N / --exponent-max), blinn-phong:log2 (N = 2^(k v)).",
    "--from",
    words=completion.texels,
)
_TARGET = option(
    "MDF:ENCODING", "What they become, as for --from.", "--to", words=completion.texels
)
_CHANNEL = option(
    "C",
    "r, g, b, a or l (grey), in OpenEXR its name; several as rgb or r,g. Needed if "
    "there are several.",
)
_EXPONENT_MAX = option("N", "Exponent of the brightest texel, for exponent.")
_LOSSY = flag("--lossy", "Take a JPEG, although it has altered the values.")
_MAX_PIXELS = option("N", "Largest picture to decode; default 134217728.", min=1)


def command(
    context: typer.Context,
    source_file: Annotated[Path, argument("IN", "Texture: PNG, TIFF, TGA or OpenEXR.")],
    output: Annotated[Path, option("OUT", "File to write; not IN.", "--output", "-o")],
    source: Annotated[str, _SOURCE],
    target: Annotated[str, _TARGET],
    channel: Annotated[str | None, _CHANNEL] = None,
    method: options.MethodOption = None,
    metric: options.MetricOption = "environment",
    exposure: options.ExposureOption = None,
    gamma: options.FixedGammaOption = None,
    specular: options.SpecularOption = None,
    exponent_max: Annotated[float, _EXPONENT_MAX] = 1000.0,
    log2_scale: Annotated[float, option("K", "k of log2; 13 is for exponents up to 8192.")] = 13.0,
    depth: Annotated[Literal["keep", "8", "16"], typer.Option(help="Bits of the result.")] = "keep",
    dither: Annotated[bool, flag("--dither", "Diffuse the errors of rounding to 8 bits.")] = False,
    lossy: Annotated[bool, _LOSSY] = False,
    max_pixels: Annotated[int | None, _MAX_PIXELS] = None,
    png: options.PngOption = None,
    force: options.ForceOption = False,
) -> None:
    """Convert a roughness texture, texel by texel.

    Keeps the light of a natural environment, unless --metric or --method says otherwise. Other
    channels, ICC profile, resolution and orientation are kept. Says on standard error how many
    texels had no answer and took the nearest: a black texel of an exponent is the roughest
    surface, one of an alpha or a roughness a perfect mirror.

    Examples:

    mdfconv texture gloss.png -o rough.png --from blinn-phong:exponent --to ggx:roughness

    mdfconv texture rough.tif -o gloss.tif --from ggx:roughness --to beckmann:glossiness

    mdfconv texture wrong.png -o right.png --from blinn-phong:obj2gltf --to ggx:roughness

    mdfconv texture orm.png -o new.png --channel g --from ggx:roughness --to ggx:alpha --depth 8
    """
    from mdfconv.distributions.endpoint import with_specular
    from mdfconv.scene.texture.convert import convert_texture_file
    from mdfconv.scene.texture.rule import TextureRule

    _check_given(context, source, target)
    options.refuse_idle_metric(context, method)
    chosen = options.chosen_metric(metric, exposure)
    outputs = Outputs(output, png, force=force, inputs=[source_file, *chosen.inputs])
    ends, fixed = with_specular(source, target, specular), options.fixed_gamma(gamma)
    rule = TextureRule(*ends, method, str(chosen), exponent_max, log2_scale, fixed)
    with outputs.staged() as files:
        report = convert_texture_file(
            source_file,
            output,
            rule,
            channel=channel,
            depth=None if depth == "keep" else int(depth),
            dither=dither,
            lossy=lossy,
            max_pixels=max_pixels,
            progress=tables.progress,
            fill=files.fill,
        )
        if png:
            from mdfconv.scene.texture.texel_map import draw_histograms

            files.add(png, draw_histograms(report, f"{source_file.name} → {output.name}"))
    for note in report.notes():
        process.tell(f"note: {note}")
    keeps = f"keeps the {report.keeps}" if report.keeps else "the same lobes"
    process.tell(f"wrote {output}: {report.target}, {keeps}")
    if png:
        process.tell(f"wrote {png}")


def _check_given(context: typer.Context, *names: str) -> None:
    """Refuse what says nothing about these names."""
    encodings = [name.partition(":")[2].strip().lower() for name in names]
    for name, encoding in (("exponent_max", "exponent"), ("log2_scale", "log2")):
        if encoding not in encodings:
            options.refuse_given(context, [name], f"goes with blinn-phong:{encoding}")
