"""The two forms of a glTF file: JSON alone, or a GLB, which has it in the first of its chunks."""

from __future__ import annotations

import struct
from dataclasses import dataclass

from mdfconv.errors import MdfconvError

_MAGIC, _VERSION = b"glTF", 2
_HEADER, _CHUNK_HEAD = struct.Struct("<4sII"), struct.Struct("<I4s")
_JSON, _BINARY = b"JSON", b"BIN\0"
_ALIGNMENT = 4
_LARGEST = 2**32 - 1


@dataclass(frozen=True)
class Container:
    """A glTF file in pieces.

    Parameters
    ----------
    json : bytes
        Its JSON; of a GLB without the padding.
    chunks : tuple of (bytes, memoryview) or None
        The types and contents of the chunks behind the JSON, which are not copied; None if the
        file is JSON alone.
    """

    json: bytes
    chunks: tuple[tuple[bytes, memoryview], ...] | None = None

    @property
    def binary(self) -> memoryview | None:
        """The content of the binary chunk, with its padding; None if there is none."""
        kind, content = self.chunks[0] if self.chunks else (b"", memoryview(b""))
        return content if kind == _BINARY else None

    def with_json(self, json: bytes, appended: bytes = b"") -> bytes:
        """Return the file with another JSON, every other chunk as it is.

        Parameters
        ----------
        json : bytes
            The new JSON.
        appended : bytes
            What is added to the binary chunk, at the next multiple of four.

        Raises
        ------
        MdfconvError
            If it no longer fits into a GLB.
        """
        if self.chunks is None:
            return json
        chunks: list[tuple[bytes, list[bytes | memoryview]]]
        chunks = [(_JSON, [json, b" " * _padding(len(json))])]
        for number, (kind, content) in enumerate(self.chunks):
            pieces: list[bytes | memoryview] = [content]
            if number == 0 and appended:
                pieces += [bytes(_padding(len(content))), appended, bytes(_padding(len(appended)))]
            chunks.append((kind, pieces))
        sizes = [sum(map(len, pieces)) for _, pieces in chunks]
        total = _HEADER.size + sum(size + _CHUNK_HEAD.size for size in sizes)
        if total > _LARGEST:
            raise MdfconvError("would no longer fit into a GLB, which ends at 4 GiB")
        parts: list[bytes | memoryview] = [_HEADER.pack(_MAGIC, _VERSION, total)]
        for size, (kind, pieces) in zip(sizes, chunks, strict=True):
            parts += [_CHUNK_HEAD.pack(size, kind), *pieces]
        return b"".join(parts)


def aligned(size: int) -> int:
    """Return the next multiple of four, where the parts of a GLB start."""
    return size + _padding(size)


def _padding(size: int) -> int:
    return -size % _ALIGNMENT


def is_glb(data: bytes) -> bool:
    """Return whether a file is a GLB by its first bytes."""
    return data.startswith(_MAGIC)


def read_container(data: bytes) -> Container:
    """Return the pieces of a glTF file.

    Raises
    ------
    MdfconvError
        If it is a GLB that is incomplete or of another version.
    """
    if not is_glb(data):
        return Container(data)
    if len(data) < _HEADER.size:
        raise MdfconvError(f"is a GLB of {len(data)} bytes, less than its header")
    _, version, length = _HEADER.unpack_from(data)
    if version != _VERSION:
        raise MdfconvError(f"is a GLB of version {version}, not {_VERSION}")
    if length != len(data):
        raise MdfconvError(f"is a GLB of {length} bytes by its header, but has {len(data)}")
    chunks = _chunks(memoryview(data))
    if not chunks or chunks[0][0] != _JSON:
        raise MdfconvError("is a GLB whose first chunk is no JSON")
    return Container(_unpadded(bytes(chunks[0][1])), tuple(chunks[1:]))


def _chunks(data: memoryview) -> list[tuple[bytes, memoryview]]:
    chunks: list[tuple[bytes, memoryview]] = []
    position = _HEADER.size
    while position < len(data):
        start = position + _CHUNK_HEAD.size
        if start > len(data):
            raise MdfconvError(f"is a GLB that ends within the head of chunk {len(chunks)}")
        size, kind = _CHUNK_HEAD.unpack_from(data, position)
        position = start + size
        if position > len(data):
            raise MdfconvError(
                f"is a GLB whose chunk {len(chunks)} of {size} bytes is larger than what is left "
                f"of the file, {len(data) - start}"
            )
        chunks.append((kind, data[start:position]))
    return chunks


def _unpadded(json: bytes) -> bytes:
    """Return the content of a JSON chunk without what fills it up: blanks, or zeros of some."""
    end = len(json)
    while end > max(0, len(json) - _ALIGNMENT + 1) and json[end - 1] in b" \0":
        end -= 1
    return json[:end]
