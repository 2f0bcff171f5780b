"""What is known of a file: its numbers, its textures, and the command that converts it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeAlias

from mdfconv.distributions.endpoint import endpoint
from mdfconv.errors import MdfconvError
from mdfconv.scene.shininess import ROUGHNESS
from mdfconv.scene.stored import MaterialProblem

# The distribution that files are converted to.
TARGET = endpoint(ROUGHNESS).distribution

Value: TypeAlias = float | tuple[float, ...]
# What a command takes by the names of its arguments.
Arguments: TypeAlias = dict[str, str | bool | None]


@dataclass(frozen=True)
class InspectedNumber:
    """A stored number, and what it means.

    Parameters
    ----------
    name : str
        Whose it is, such as a material.
    place : int or str
        Where it stands, a line or a path within the file.
    quantity : str
        What the file calls it, such as ``"alpha"``.
    stored : float or tuple of two floats
        The number as the file has it, of both axes if there are two.
    taken_for : str
        What it was taken for, such as ``"beckmann"`` or ``"blinn-phong:obj2gltf"``.
    exponent : float or tuple of two floats
        The exponent N that it stands for; NaN if it stands for none.
    alpha, roughness : float or tuple of two floats
        α of the nearest GGX, and r with α = r².
    notes : tuple of str
        What a careful user must know.
    """

    name: str
    place: int | str
    quantity: str
    stored: Value
    taken_for: str
    exponent: Value
    alpha: Value
    roughness: Value
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class InspectedTexture:
    """A picture of roughness.

    Parameters
    ----------
    file : str
        Its name, as the file that uses it has it.
    place : int or str
        Where that file names it; "" of a picture by itself.
    form : str
        The form of its file, such as ``"PNG"``.
    width, height : int
        Its size, texels.
    depth : str
        The type of a texel, such as ``"8 bits"``.
    channels : str
        Its channels, with blanks between them.
    channel : str
        The one that is read; "" if that is to be chosen.
    taken_for : str
        What its texels are taken for; "" if that is to be said.
    lossy : bool
        Whether its compression has altered the texels.
    """

    file: str
    place: int | str
    form: str
    width: int
    height: int
    depth: str
    channels: str
    channel: str = ""
    taken_for: str = ""
    lossy: bool = False


@dataclass(frozen=True)
class NextStep:
    """A command that converts a file, or says more of it.

    Parameters
    ----------
    command : str
        Its name.
    arguments : mapping of str to str, True or None
        What it takes by its names of arguments; True of a switch, None of what the user must say.
    output : Path or None
        Where the result would go, if there is one.
    """

    command: str
    arguments: Arguments = field(default_factory=dict)
    output: Path | None = None


@dataclass(frozen=True, kw_only=True)
class FileInspection:
    """What a file is.

    Parameters
    ----------
    file : Path
        The file.
    kind : str
        What it is, in words.
    is_read : bool
        Whether there is something that reads it.
    writer : str
        Who wrote it; "" if it does not say.
    taken_for : str
        What its numbers were taken for, and why; "" if each says so.
    facts : mapping of str to str
        What else it says, by headings.
    numbers : sequence of InspectedNumber
        Its numbers.
    textures : sequence of InspectedTexture
        Its textures.
    problems : sequence of MaterialProblem
        What has no conversion, or why the file is not read.
    remedy : str
        What its owner can do about that; "" if it is not known.
    notes : sequence of str
        What a careful user must know.
    repaired : str
        By what it looks as if it had been converted; "" if it does not.
    next_step : NextStep or None
        What converts it; None if nothing has to.
    """

    file: Path
    kind: str
    is_read: bool = True
    writer: str = ""
    taken_for: str = ""
    facts: Mapping[str, str] = field(default_factory=dict)
    numbers: Sequence[InspectedNumber] = ()
    textures: Sequence[InspectedTexture] = ()
    problems: Sequence[MaterialProblem] = ()
    remedy: str = ""
    notes: Sequence[str] = ()
    repaired: str = ""
    next_step: NextStep | None = None


def unread(path: Path, kind: str, error: Exception) -> FileInspection:
    """Return what is known of a file that is not read: why."""
    reason, remedy = getattr(error, "strerror", None) or str(error), ""
    if isinstance(error, MdfconvError):
        reason, remedy = error.reason, error.hint
    problem = MaterialProblem("", _without_name(reason, path))
    return FileInspection(file=path, kind=kind, is_read=False, problems=[problem], remedy=remedy)


def _without_name(text: str, path: Path) -> str:
    """Return a message without the name of the file before it."""
    for start in (f"{path}: ", f"{path}, ", f"cannot read {path}: "):
        text = text.removeprefix(start)
    return text


def result_path(path: Path) -> Path:
    """Return a name for the conversion of a file."""
    return path.with_name(f"{path.stem}-{TARGET.name}{path.suffix}")
