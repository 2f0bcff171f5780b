"""Textures that do not stand in a file of their own, or do not yet."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

from mdfconv.errors import MdfconvError
from mdfconv.scene.texture import convert_texture_file
from mdfconv.scene.texture_map import TextureReport
from mdfconv.scene.texture_rule import TextureRule


def convert_texture_bytes(
    data: bytes, suffix: str, rule: TextureRule, channel: str | None = None
) -> bytes:
    """Convert the content of a picture file.

    Parameters
    ----------
    data : bytes
        The content.
    suffix : str
        What the file's name ends in, such as ``".png"``.
    rule, channel
        As for `convert_texture_file`.

    Returns
    -------
    bytes
        The content of the converted file.

    Raises
    ------
    MdfconvError
        As `convert_texture_file`.
    """
    return converted_and_report(data, suffix, rule, channel)[0]


def converted_and_report(
    data: bytes, suffix: str, rule: TextureRule, channel: str | None = None, *, lossy: bool = False
) -> tuple[bytes, TextureReport]:
    """Convert the content of a picture file as `convert_texture_bytes`, and say what was done.

    With `lossy` a JPEG is taken, too, and becomes a PNG.
    """
    with TemporaryDirectory() as folder:
        source = Path(folder) / f"texture{suffix}"
        target = Path(folder) / f"converted{'.png' if lossy else suffix}"
        source.write_bytes(data)
        try:
            report = convert_texture_file(source, target, rule, channel=channel, lossy=lossy)
        except MdfconvError as error:
            # The temporary file's name says nothing.
            reason, hint = (
                text.replace(str(source), "the texture").replace(str(target), "the result")
                for text in (error.reason, error.hint)
            )
            raise MdfconvError(reason, hint, argument=error.argument) from None
        return target.read_bytes(), report
