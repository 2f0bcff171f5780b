"""Files of materials: where their conversions go, and that nothing is lost on the way."""

from __future__ import annotations

import os
from collections.abc import Container, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import chain, count
from operator import itemgetter
from pathlib import Path
from typing import Any, AnyStr

from mdfconv.errors import MdfconvError
from mdfconv.output.files import is_stream, write_files
from mdfconv.scene.stored import MaterialProblem
from mdfconv.scene.texture.convert import convert_texture_bytes
from mdfconv.scene.texture.rule import TextureRule


@dataclass(frozen=True)
class Destination:
    """A file and where its conversion goes.

    Parameters
    ----------
    source, output : Path
        The two files; the same for a conversion in place.
    backup : Path or None
        Where the original is kept; None unless in place.
    """

    source: Path
    output: Path
    backup: Path | None = None


def choose_outputs(files: Sequence[Path], output: str | None) -> list[Destination]:
    """Return where conversions go: into a file or a folder, or without either in place.

    Raises
    ------
    MdfconvError
        If several files have no folder to go to, or one is to go to standard output.
    """
    if output is None:
        real = dict.fromkeys(file.resolve() for file in files)
        return [Destination(file, file, _free_backup(file)) for file in real]
    path = Path(output)
    if is_folder(output):
        return [Destination(file, path / file.name) for file in files]
    if len(files) > 1:
        raise MdfconvError(f"{len(files)} files need a folder: {output} is not one")
    if output == "-":
        raise MdfconvError(f"cannot write {output}: it is not a file or an existing folder")
    return [Destination(files[0], path)]


def is_folder(output: str) -> bool:
    """Return whether a name is that of a folder: one that is there, or with a slash at its end."""
    return output.endswith(("/", os.sep)) or Path(output).is_dir()


def free_name(folder: Path, stem: str, suffix: str, taken: Container[Path]) -> Path:
    """Return a path in a folder that is none of those taken: of ``wood`` also ``wood_2``."""
    endings = chain([""], (f"_{number}" for number in count(2)))
    paths = (folder / f"{stem}{ending}{suffix}" for ending in endings)
    return next(path for path in paths if path not in taken)


def _free_backup(file: Path) -> Path:
    """Return a name for the backup that no file has."""
    backups = (file.with_name(f"{file.name}.bak{number}") for number in chain([""], count(2)))
    return next(backup for backup in backups if not backup.exists())


def spliced(text: AnyStr, edits: Iterable[tuple[int, int, AnyStr]]) -> AnyStr:
    """Return a text with pieces replaced, each from its start to its end, of which none overlap."""
    pieces: list[AnyStr] = []
    position = 0
    for start, end, new in sorted(edits, key=itemgetter(0, 1)):
        pieces += [text[position:start], new]
        position = end
    return text[:0].join(pieces) + text[position:]


class TextureFolder:
    """Textures that a file of materials names, converted to stand beside its conversion.

    Parameters
    ----------
    source, output : Path
        The file, from whose folder it names them, and its conversion.
    """

    def __init__(self, source: Path, output: Path) -> None:
        self._source, self._output = source.parent, output.parent
        self._converted: dict[tuple[Path, TextureRule], Path] = {}
        # The new files.
        self.files: dict[Path, bytes] = {}

    def convert(self, file: str, rule: TextureRule, suffix: str) -> str:
        """Return the name of a converted texture: for ``wood.png`` it is ``wood_Pr.png``.

        Of another file of that name it is ``wood_Pr_2.png``.

        Raises
        ------
        MdfconvError
            If it cannot be read or converted.
        """
        # Files from Windows separate folders by backslashes.
        source = self._source / file.replace("\\", "/")
        if (source, rule) not in self._converted:
            stem = f"{source.stem}_{suffix}"
            output = free_name(self._output, stem, source.suffix, self.files)
            content, _ = convert_texture_bytes(read_file(source), source.suffix, rule)
            self.files[output] = content
            self._converted[source, rule] = output
        return self._converted[source, rule].name

    @property
    def inputs(self) -> tuple[Path, ...]:
        """The textures that were converted."""
        return tuple(source for source, _ in self._converted)


@dataclass(frozen=True, kw_only=True)
class FileConversion:
    """A converted file of materials.

    Parameters
    ----------
    data : bytes
        Its bytes.
    materials : sequence
        What was converted: records with ``notes``, and fields of their own.
    problems : tuple of MaterialProblem
        What is left as it is.
    notes : tuple of (int, str)
        What a careful user must know, and the line that it is about.
    files : mapping of Path to bytes
        What goes beside the result, such as textures.
    inputs : sequence of Path
        The files that those were made from.
    named : sequence of str
        The other files that it names, by paths relative to it.
    """

    data: bytes
    materials: Sequence[Any]
    problems: tuple[MaterialProblem, ...] = ()
    notes: tuple[tuple[int, str], ...] = ()
    files: Mapping[Path, bytes] = field(default_factory=dict)
    inputs: Sequence[Path] = ()
    named: Sequence[str] = ()


def read_file(path: Path) -> bytes:
    """Return the bytes of a file; raise `MdfconvError` if it cannot be read."""
    try:
        return path.read_bytes()
    except OSError as error:
        raise MdfconvError(f"cannot read {path}: {error.strerror}") from None


def _is_done(destination: Destination, original: bytes, conversion: FileConversion) -> bool:
    """Return whether a file that is converted in place is already what it becomes."""
    return destination.backup is not None and conversion.data == original


def _backups(
    changed: Sequence[tuple[Destination, bytes, FileConversion]],
) -> tuple[dict[Path, bytes], dict[Path, Path]]:
    """Return the originals of what changes in place, by their new names, and their files."""
    contents: dict[Path, bytes] = {}
    backups: dict[Path, Path] = {}
    for destination, original, conversion in changed:
        if destination.backup and not _is_done(destination, original, conversion):
            if read_file(destination.source) != original:
                raise MdfconvError(
                    f"will not change {destination.source}: it has changed since it was read"
                )
            contents[destination.backup] = original
            backups[destination.backup] = destination.source
    return contents, backups


def write_conversions(
    converted: Sequence[tuple[Destination, bytes, FileConversion]],
    *,
    force: bool = False,
    dry_run: bool = False,
) -> list[Destination]:
    """Write all conversions and what goes beside them, backups first, or nothing.

    Each has its destination and its original. What a conversion in place does not change is not
    written; `force` replaces files that exist, but no backups. Returns what was written, or would
    be in a dry run.

    Raises
    ------
    MdfconvError
        If a file cannot be written, or two differ and have one name; nothing is then changed.
    """
    changed = [each for each in converted if not _is_done(*each) or each[2].files]
    contents, backups = _backups(changed)
    new = set(backups)
    for destination, original, conversion in changed:
        if conversion.files and is_stream(destination.output):
            raise MdfconvError(f"no texture can stand beside {destination.output}: it is no file")
        results = dict(conversion.files)
        if not _is_done(destination, original, conversion):
            results[destination.output] = conversion.data
        for path, data in results.items():
            if contents.setdefault(path, data) != data:
                raise MdfconvError(f"two results would both be written to {path}")
        if not force:
            new |= conversion.files.keys() if destination.backup else results.keys()
    if not dry_run:
        write_files(contents, new=new, like=backups)
    return [destination for destination, *_ in changed]
