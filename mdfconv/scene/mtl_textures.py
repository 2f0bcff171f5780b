"""Exponent textures of a material library: converted to roughness, to stand beside it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from mdfconv.errors import MdfconvError
from mdfconv.fitting.metrics import Metric
from mdfconv.scene.material_files import read_file
from mdfconv.scene.mtl import TextureStatement
from mdfconv.scene.shininess import ROUGHNESS, SHININESS
from mdfconv.scene.texture_bytes import convert_texture_bytes
from mdfconv.scene.texture_rule import TextureRule


def convert_textures(
    textures: Sequence[TextureStatement],
    library: Path,
    output: Path,
    metric: str | Metric,
    exponent_max: float,
    advance: Callable[[int], None],
) -> tuple[dict[str, str], dict[Path, bytes], list[tuple[int, str]]]:
    """Convert the textures that a library names, for the folder of its conversion.

    Parameters
    ----------
    textures : sequence of TextureStatement
        The ``map_Ns`` statements.
    library, output : Path
        The library, which the files are named relative to, and its conversion.
    metric : str or Metric
        What the fit keeps.
    exponent_max : float
        Exponent of a white texel.
    advance : callable
        Called with 1 after each statement.

    Returns
    -------
    names : dict
        From the files named to the new ones: ``wood.png`` becomes ``wood_Pr.png``.
    files : dict
        The new files.
    problems : list of (int, str)
        For each texture that cannot be converted its line and the reason.
    """
    rule = TextureRule(
        f"{SHININESS}:exponent",
        ROUGHNESS,
        metric=str(metric),
        exponent_max=exponent_max,
    )
    rule.endpoints()
    names: dict[str, str] = {}
    done: dict[Path, str] = {}
    files: dict[Path, bytes] = {}
    problems = []
    for texture in textures:
        # Libraries from Windows separate folders by backslashes.
        source = library.parent / texture.file.replace("\\", "/")
        target = output.parent / f"{source.stem}_Pr{source.suffix}"
        try:
            if source not in done:
                if target.exists():
                    raise MdfconvError(f"will not write {target}: it exists")
                files[target] = convert_texture_bytes(read_file(source), source.suffix, rule)
                done[source] = target.name
            names[texture.file] = done[source]
        except MdfconvError as error:
            problems.append((texture.line, str(error)))
        advance(1)
    return names, files, problems
