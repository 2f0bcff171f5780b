"""``mdfconv light``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from mdfconv.cli import process, tables
from mdfconv.cli.options import ForceOption, FormatOption, PngOption, argument, option
from mdfconv.cli.outputs import Outputs
from mdfconv.output.records import csv_text, json_text

_ROUGHNESSES = (0.05, 0.1, 0.2, 0.4)

_MAP = argument("MAP", "Environment map, linear, 2:1: OpenEXR, Radiance (.hdr, .pic) or others.")
_M_B = option("M", "Beckmann's m_B; repeatable; by default 0.05 to 0.4.")


def command(
    map_: Annotated[Path, _MAP],
    m_b: Annotated[list[float] | None, _M_B] = None,
    spectrum: Annotated[Path | None, option("FILE", "Write the spectrum as CSV.", "--csv")] = None,
    png: PngOption = None,
    force: ForceOption = False,
    format_: FormatOption = None,
) -> None:
    """Say what a light asks of a conversion: its spectrum, and the best GGX for Beckmann.

    Prints α under the light of an environment map beside that of --metric energy (a sun or a
    lamp), environment (natural light) and display (a screen). The exponent of the spectrum says
    how soft the light is. Any conversion under the light: --metric light:MAP.

    Examples:

    mdfconv light studio.exr

    mdfconv light studio.exr --png spectrum.png --csv spectrum.csv

    mdfconv convert --from beckmann --to ggx --metric light:studio.exr 0.2
    """
    from mdfconv.output.files import file_bytes
    from mdfconv.scene.light import draw_spectrum, light_report

    outputs = Outputs(png, spectrum, force=force, inputs=[map_])
    report = light_report(map_, m_b or _ROUGHNESSES)
    rows, degrees = report.conversions, report.spectrum_rows()
    contents: dict[Path, bytes] = {}
    if spectrum:
        contents[spectrum] = file_bytes(csv_text(list(degrees[0]), degrees))
    if png:
        contents[png] = draw_spectrum(report.spectrum, map_.name)
    outputs.write(contents)
    form = tables.form_of(format_)
    if form == "json":
        light = {"exponent": report.spectrum.exponent, "softness": report.softness}
        lists = {"conversions": rows, "spectrum": degrees}
        typer.echo(json_text({"map": str(map_), **light, **lists}))
        return
    tables.write_table(list(rows[0]), rows, form, title="α of the best GGX for Beckmann's m_B")
    say = tables.console().print if form == "table" else process.tell
    say(report.sentence)
