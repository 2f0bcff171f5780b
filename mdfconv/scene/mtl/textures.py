"""Exponent textures of a material library: converted to roughness, to stand beside it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from mdfconv.errors import MdfconvError
from mdfconv.fitting.metrics import Metric
from mdfconv.scene.material_files import free_name, read_file
from mdfconv.scene.mtl.library import TextureStatement
from mdfconv.scene.shininess import ROUGHNESS, SHININESS
from mdfconv.scene.stored import MaterialProblem
from mdfconv.scene.texture.convert import convert_texture_bytes
from mdfconv.scene.texture.rule import TextureRule


@dataclass
class MtlTextures:
    """What became of the textures of a library.

    Parameters
    ----------
    names : dict
        From the files named to the new ones: ``wood.png`` becomes ``wood_Pr.png``, another of that
        name ``wood_Pr_2.png``.
    files : dict
        The new files.
    inputs : tuple of Path
        The files that those were made from.
    problems : list of MaterialProblem
        For each texture that cannot be converted its line and the reason.
    """

    names: dict[str, str] = field(default_factory=dict)
    files: dict[Path, bytes] = field(default_factory=dict)
    inputs: tuple[Path, ...] = ()
    problems: list[MaterialProblem] = field(default_factory=list)


def convert_textures(
    textures: Sequence[TextureStatement],
    library: Path,
    output: Path,
    metric: str | Metric,
    exponent_max: float,
    advance: Callable[[int], None],
) -> MtlTextures:
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

    """
    rule = TextureRule(
        f"{SHININESS}:exponent",
        ROUGHNESS,
        metric=str(metric),
        exponent_max=exponent_max,
    )
    rule.endpoints()
    found = MtlTextures()
    done: dict[Path, Path] = {}
    for texture in textures:
        # Libraries from Windows separate folders by backslashes.
        source = library.parent / texture.file.replace("\\", "/")
        try:
            if source not in done:
                target = free_name(output.parent, f"{source.stem}_Pr", source.suffix, found.files)
                found.files[target], _ = convert_texture_bytes(
                    read_file(source), source.suffix, rule
                )
                done[source] = target
            found.names[texture.file] = done[source].name
        except MdfconvError as error:
            found.problems.append(MaterialProblem(texture.line, str(error)))
        advance(1)
    found.inputs = tuple(done)
    return found
