"""Files of any kind inspected: each is known by its content, and asked by its converter.

A converter's records are kept and its result is dropped: nothing is written.
"""

from __future__ import annotations

import glob
import re
import stat
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from mdfconv.errors import MdfconvError
from mdfconv.light.radiance import SIGNATURE
from mdfconv.measured.readers import READERS, read
from mdfconv.measured.readers.base import decode_head
from mdfconv.measured.readers.tables import parse_table
from mdfconv.measured.samples import Measurements, Samples
from mdfconv.output.files import find_files
from mdfconv.output.kinds import foreign
from mdfconv.scene.gltf.document import is_glb
from mdfconv.scene.inspection.gltf import inspect_gltf
from mdfconv.scene.inspection.materials import inspect_library, inspect_scene
from mdfconv.scene.inspection.pictures import inspect_light, inspect_picture
from mdfconv.scene.inspection.records import FileInspection, NextStep, unread
from mdfconv.scene.texture import images

# So much of a file says of which kind it is.
_HEAD_BYTES = 65536


def inspect_files(patterns: Sequence[str]) -> list[FileInspection]:
    """Return what the files are that names and glob patterns stand for, each once.

    Parameters
    ----------
    patterns : sequence of str
        Names and patterns. One that stands for no file has a result, too.
    """
    results: dict[Path, FileInspection] = {}
    for pattern in patterns:
        try:
            files = _files_of(pattern)
        except MdfconvError as error:
            results[Path(pattern)] = unread(Path(pattern), "no file", error)
            continue
        for file in files:
            if file not in results:
                results[file] = inspect_file(file)
    return list(results.values())


def _files_of(pattern: str) -> list[Path]:
    """Return the files that a name or a pattern stands for, without folders among them."""
    names = [] if Path(pattern).exists() else sorted(glob.glob(pattern, recursive=True))
    return [Path(name) for name in names if not Path(name).is_dir()] or find_files([pattern])


def inspect_file(path: Path) -> FileInspection:
    """Return what a file is, whatever it holds.

    Parameters
    ----------
    path : Path
        The file. It is only read.
    """
    try:
        if not stat.S_ISREG(path.stat().st_mode):
            raise MdfconvError("it is a device, a pipe or a folder, and no file")
        with path.open("rb") as file:
            head = file.read(_HEAD_BYTES)
    except (OSError, ValueError) as error:
        return unread(path, "no file", error)
    if not head:
        return unread(path, "empty", MdfconvError("it has no bytes"))
    kind = _kind_of(path, head)
    if kind is None:
        other = foreign(head)
        if other:
            return FileInspection(file=path, kind=other.name, is_read=False, remedy=other.way_out)
        return unread(path, "unknown", MdfconvError(f"it is none of: {', '.join(list_kinds())}"))
    try:
        result = kind.inspect(path)
    except (MdfconvError, OSError) as error:
        return unread(path, kind.name, error)
    backup = path.with_name(f"{path.name}.bak")
    if not result.repaired and backup.is_file():
        return replace(result, repaired=f"{backup.name}, an original, is beside it")
    return result


@dataclass(frozen=True)
class _Kind:
    """A kind of file that is read, and what is asked about it.

    It is known by its first bytes, or by the ending of its name where those tell nothing.
    """

    name: str
    inspect: Callable[[Path], FileInspection]
    recognizes: Callable[[str, bytes], bool]
    endings: tuple[str, ...] = ()


def list_kinds() -> list[str]:
    """Return what the kinds of files are called that are read."""
    return list(dict.fromkeys(kind.name for kind in _KINDS))


def _kind_of(path: Path, head: bytes) -> _Kind | None:
    """Return of which kind a file is by its content, or else by its name."""
    for kind in _KINDS:
        if kind.recognizes(path.name, head):
            return kind
    if foreign(head):
        return None
    suffix = path.suffix.lower()
    return next((kind for kind in _KINDS if suffix in kind.endings), None)


def _by_text(pattern: str) -> Callable[[str, bytes], bool]:
    """Return what recognizes a file by a pattern in its beginning."""
    expression = re.compile(pattern, re.MULTILINE)
    return lambda name, head: bool(expression.search(decode_head(head)))


def _is_measured(name: str, head: bytes) -> bool:
    """Return whether a reader knows a file by more than that it is text, or reads it as a table."""
    return not foreign(head) and any(reader.recognizes(name, head) for reader in READERS[:-1])


def _is_table(name: str, head: bytes) -> bool:
    """Return whether the beginning of a file is a table of numbers."""
    if foreign(head):
        return False
    lines = decode_head(head).splitlines()
    try:
        parse_table(Path(name), lines[:-1] if len(head) == _HEAD_BYTES else lines)
    except MdfconvError:
        return False
    return True


def _is_gltf(name: str, head: bytes) -> bool:
    """Return whether a file is a GLB, or JSON with what every glTF has."""
    return is_glb(head) or (head.lstrip(b"\xef\xbb\xbf \t\r\n")[:1] == b"{" and b'"asset"' in head)


def _inspect_measurements(path: Path) -> FileInspection:
    """Return what a file of measurements is."""
    with path.open("rb") as file:
        head = file.read(_HEAD_BYTES)
    reader = next(reader for reader in READERS if reader.recognizes(path.name, head))
    kind = f"measurements ({reader.name})"
    try:
        samples = read(path)
    except MdfconvError as error:
        if not error.argument:
            return unread(path, kind, error)
        # It is for the user to say what a column is.
        return replace(
            unread(path, kind, error),
            is_read=True,
            next_step=NextStep("fit", {error.argument: None}),
        )
    return FileInspection(
        file=path,
        kind=kind,
        facts=_facts_of(samples),
        notes=samples.notes,
        next_step=NextStep("fit"),
    )


_QUANTITIES = {"ndf": "a distribution of normals", "brdf": "a BRDF at θ_d ≈ 0"}


def _facts_of(samples: Measurements) -> dict[str, str]:
    if isinstance(samples, Samples):
        least, largest = np.degrees(samples.beta[[0, -1]])
        angles = f"of the half vector, {least:.4g}° to {largest:.4g}°"
        quantity = _QUANTITIES.get(samples.quantity, samples.quantity)
        count = samples.beta.size
    else:
        theta = np.degrees(np.arccos(np.clip(samples.incident[:, 2], -1, 1)))
        angles = f"of two directions, light at {theta.min():.4g}° to {theta.max():.4g}°"
        quantity, count = "a BRDF", len(samples.incident)
    return {
        "quantity": quantity,
        "angles": angles,
        "samples": str(count),
        "channels": ", ".join(samples.channels),
    }


# In the order in which they are asked.
_KINDS = (
    _Kind(
        "environment map",
        inspect_light,
        lambda name, head: head.startswith(SIGNATURE),
        (".hdr", ".pic", ".rgbe"),
    ),
    _Kind(
        "picture",
        inspect_picture,
        lambda name, head: any(head.startswith(form.signatures) for form in images.FORMS),
        tuple(ending for form in images.FORMS for ending in form.endings),
    ),
    _Kind("glTF", inspect_gltf, _is_gltf, (".gltf", ".glb")),
    _Kind("Mitsuba scene", inspect_scene, _by_text(r"<scene[\s>]"), (".xml",)),
    _Kind("measurements", _inspect_measurements, _is_measured),
    _Kind(
        "Wavefront material library",
        inspect_library,
        _by_text(r"^[ \t]*((newmtl|mtllib|map_Ns|map_Pr)[ \t]+\S|(Ns|Pr)[ \t]+[-+.\d])"),
        (".mtl",),
    ),
    _Kind(
        "measurements",
        _inspect_measurements,
        _is_table,
        (".csv", ".tsv", ".astm", ".bsdf", ".binary"),
    ),
)
