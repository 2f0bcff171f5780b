"""``mdfconv furnace``."""

from __future__ import annotations

from typing import Annotated

import typer

from mdfconv.cli import completion, options, tables
from mdfconv.cli.options import argument, option
from mdfconv.cli.outputs import Outputs
from mdfconv.errors import MdfconvError

_MOST_POINTS = 1001
_MOST_SAMPLES = 10_000_000
# Samples at all points together: some seconds.
_MOST_DIRECTIONS = 100_000_000

_PARAMETER = argument("PARAMETER", "Exponent of the Phong BRDFs, the distribution's of the others.")
_BRDF = option(
    "BRDF",
    "ggx, beckmann, gauss, schlick, sawicki, blinn-phong, phong, modified-phong, smoothie, "
    "smoothie-approx or ashikhmin-shirley; ggx:roughness takes PARAMETER for a stored form of α.",
    words=completion.furnace_brdfs,
)
_NORMALIZER = option(
    "NAME",
    "Of modified-phong: usual (the default), arvo (integer exponents) or mallett-yuksel.",
    words=completion.normalizers,
)
_MASKING = option(
    "G",
    "Of ggx to blinn-phong: correlated (the default), separable, v-cavity, ksk or none.",
    "--g",
    words=completion.maskings,
)
_SAMPLES = option("N", "Estimate by N random directions a cosine, too.", "--mc")


def command(
    context: typer.Context,
    parameter: Annotated[float, _PARAMETER],
    brdf: Annotated[str, _BRDF] = "ggx",
    normalizer: Annotated[str | None, _NORMALIZER] = None,
    masking: Annotated[str | None, _MASKING] = None,
    points: Annotated[int, option("N", "Cosines of the viewer, from 0 to 1.")] = 21,
    samples: Annotated[int | None, _SAMPLES] = None,
    seed: Annotated[int, option("S", "Of the random numbers.")] = 0,
    png: options.PngOption = None,
    format_: options.FormatOption = None,
    output: options.OutputOption = None,
    force: options.ForceOption = False,
) -> None:
    """Put a BRDF that absorbs nothing into a white furnace: how much light comes back.

    Prints the directional albedo, which is 1 if no energy is lost or made, over the cosine of
    the viewer with the normal; the Fresnel term is 1. By quadrature, with --mc also by sampling.
    At cos θ = 0 it is taken at 1e-8.

    Examples:

    mdfconv furnace --brdf ggx 0.5

    mdfconv furnace --brdf modified-phong --normalizer arvo 100 --format csv

    mdfconv furnace --brdf beckmann --g v-cavity 0.3 --mc 10000 --png furnace.png
    """
    import numpy as np

    from mdfconv.output.records import rounded_rows
    from mdfconv.studies import furnace

    if samples is None:
        options.refuse_given(context, ["seed"], "goes with --mc")
    if not 2 <= points <= _MOST_POINTS:
        raise MdfconvError(f"--points is from 2 to {_MOST_POINTS}")
    if samples is not None and not 2 <= samples <= _MOST_SAMPLES:
        raise MdfconvError(f"--mc needs 2 samples or more, at most {_MOST_SAMPLES}")
    if samples is not None and samples * points > _MOST_DIRECTIONS:
        raise MdfconvError(
            f"--mc {samples} at {points} --points are more than {_MOST_DIRECTIONS} directions"
        )
    if seed < 0:
        raise MdfconvError(f"--seed is at least 0, not {seed}")
    outputs = Outputs(png, table=output, force=force)
    name, decoded = _decoded(brdf, parameter)
    model = furnace.furnace_model(name, decoded, normalizer=normalizer, masking=masking)
    cosine = np.linspace(0, 1, points)
    columns = {"cos_theta": cosine, "albedo": furnace.directional_albedo(model, cosine)}
    if samples:
        columns["sampled"], columns["standard_error"] = furnace.sampled_albedo(
            model, cosine, samples, seed
        )
    rows = rounded_rows(columns)
    label = f"{brdf} {parameter:g}"
    picture = {}
    if png:
        from mdfconv.studies.furnace import draw_albedo

        curve = {label: [row["albedo"] for row in rows]}
        picture[png] = draw_albedo([row["cos_theta"] for row in rows], {"": curve})
    title = f"White furnace: {label}"
    tables.write_table(list(rows[0]), rows, format_, outputs, beside=picture, title=title)


def _decoded(brdf: str, value: float) -> tuple[str, float]:
    """Return the name of a BRDF and its parameter, for one in a stored form, too."""
    from mdfconv.distributions.endpoint import endpoint
    from mdfconv.studies.furnace import model_distribution

    name, colon, form = brdf.partition(":")
    if not colon:
        return brdf, value
    owner = model_distribution(name)
    if not owner:
        raise MdfconvError(f"the exponent of {name} has no stored form", f"did you mean {name}?")
    return name, endpoint(f"{owner}:{form}").decode_one(value)
