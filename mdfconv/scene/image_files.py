"""Image files: known by their content, opened by the library that holds them, written whole."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import NamedTemporaryFile
from typing import Any

import numpy as np

from mdfconv.errors import MdfconvError
from mdfconv.scene.image_picture import ACCEPT_LOSSES, Form, Picture, reading

_SIGNATURES = {
    b"\x89PNG\r\n\x1a\n": Form.png,
    b"II*\0": Form.tiff,
    b"MM\0*": Form.tiff,
    b"II+\0": Form.tiff,  # BigTIFF
    b"MM\0+": Form.tiff,
    b"\x76\x2f\x31\x01": Form.exr,
    b"\xff\xd8\xff": Form.jpeg,
}
_ENDINGS = {
    ".png": Form.png,
    ".tif": Form.tiff,
    ".tiff": Form.tiff,
    ".exr": Form.exr,
    ".jpg": Form.jpeg,
    ".jpeg": Form.jpeg,
}


def check_files(source: Path, output: Path, *, lossy: bool = False) -> tuple[Form, Form]:
    """Return the forms of two files, if a texture can go from one to the other.

    Raises
    ------
    MdfconvError
        If the source is not what its name says or no texture, if the output's name is of a form
        that cannot hold it, or if both are the same file.
    """
    source_form = _form_of(source)
    output_form = _ENDINGS.get(output.suffix.lower())
    if source_form is Form.jpeg and not lossy:
        raise MdfconvError(
            f"{source} is a JPEG, which has altered the values (8-bit blocks with losses, made "
            "for gamma-encoded pictures)",
            ACCEPT_LOSSES,
            argument="lossy",
        )
    if output_form is Form.jpeg:
        raise MdfconvError(f"{output}: a JPEG would alter the values", "write .png or .tif")
    if output_form is None:
        raise MdfconvError(f"{output} does not end in .png, .tif, .tiff or .exr")
    if (source_form is Form.exr) != (output_form is Form.exr):
        endings = ".exr" if source_form is Form.exr else ".png or .tif"
        kind = "floats" if source_form is Form.exr else "integers"
        raise MdfconvError(
            f"{source} holds {kind}, which {output_form} does not", f"write {endings}"
        )
    check_output(output, source)
    return source_form, output_form


def check_output(output: Path, *others: Path) -> None:
    """Refuse, before any work, an output that is one of the other files or no file at all.

    Raises
    ------
    MdfconvError
        If the output is a directory, or one of the others by this or another name.
    """
    for other in others:
        if output == other or (output.exists() and other.exists() and output.samefile(other)):
            raise MdfconvError(f"{output} is the same file as {other}", "write to another one")
    if output.is_dir():
        raise MdfconvError(f"cannot write {output}: Is a directory")


def _form_of(source: Path) -> Form:
    """Return the form of a file's content, if its name does not say another."""
    with reading(source), source.open("rb") as file:
        start = file.read(8)
    form = next((form for key, form in _SIGNATURES.items() if start.startswith(key)), None)
    named = _ENDINGS.get(source.suffix.lower())
    if form is None:
        raise MdfconvError(f"{source} is no PNG, TIFF or OpenEXR file")
    if named not in (None, form):
        raise MdfconvError(f"{source} holds {form}, not what its name says")
    return form


def open_picture(
    source: Path, form: Form, channel: str | None, *, lossy: bool, max_pixels: int | None
) -> Picture:
    """Decode a picture.

    Raises
    ------
    MdfconvError
        If it is damaged, too large, of a kind whose values are no roughness, or has no such
        channel.
    """
    if form is Form.exr:
        from mdfconv.scene.exr import read_exr

        return read_exr(source, channel, max_pixels)
    from mdfconv.scene.image_pillow import decode

    with reading(source), source.open("rb") as file:
        return decode(file, source, form, channel, lossy=lossy, max_pixels=max_pixels)


def blank(picture: Picture, dtype: np.dtype[Any]) -> Picture:
    """Return an empty picture like another one, of another depth."""
    if dtype == np.uint16 and len(picture.bands) > 1:
        from mdfconv.scene.image_vips import blank_deep

        return blank_deep(picture)
    from mdfconv.scene.image_pillow import blank_pillow

    return blank_pillow(picture, dtype)


@contextmanager
def staged(output: Path) -> Iterator[Path]:
    """Give a file beside the output, and rename it to it when all went well.

    Raises
    ------
    MdfconvError
        If it cannot be written; the output is then as it was.
    """
    mask = os.umask(0)
    os.umask(mask)
    beside = None
    try:
        with NamedTemporaryFile(dir=output.parent, prefix=".mdfconv-", delete=False) as file:
            beside = Path(file.name)
        yield beside
        # A temporary file is private; give it the permissions of any other new file.
        beside.chmod(0o666 & ~mask)
        beside.replace(output)
    except OSError as error:
        reason = error.strerror or error
        raise MdfconvError(f"cannot write {output}: {reason}") from None
    finally:
        if beside:
            beside.unlink(missing_ok=True)
