"""Textures that do not stand in a file of their own, or do not yet."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

from mdfconv.scene.texture import convert_texture_file
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
    with TemporaryDirectory() as folder:
        source, target = (Path(folder) / f"{name}{suffix}" for name in ("texture", "converted"))
        source.write_bytes(data)
        convert_texture_file(source, target, rule, channel=channel)
        return target.read_bytes()
