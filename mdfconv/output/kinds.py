"""Kinds of files that mdfconv does not read: what each is known by, and what its owner can do."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from mdfconv.errors import MdfconvError

# A kind is known within so many bytes.
HEAD_BYTES = 4096

# What the owner of numbers in any form can do.
AS_TABLE = "save its numbers as CSV: a column for each angle and each value"
_PICTURE = "save it as PNG, TIFF or OpenEXR"
_SCENE = "export it as glTF"
_UNPACK = "unpack it first"
_DOWNLOAD = "download the file itself, not the page about it"


@dataclass(frozen=True)
class Foreign:
    """A kind of file that is not read.

    Parameters
    ----------
    name : str
        What such a file is, with its article.
    way_out : str
        What its owner can do.
    pattern : str
        A regular expression of its first bytes, as Latin-1.
    """

    name: str
    way_out: str
    pattern: str

    def matches(self, head: bytes) -> bool:
        """Return whether a file that starts so is of this kind."""
        return bool(re.match(self.pattern.encode("latin-1"), head, re.DOTALL))


# The beginning of texts: a byte order mark, blanks, the declaration of XML.
_TEXT = r"(?:\xef\xbb\xbf)?\s*(?:<\?xml[^>]*>\s*)?"
# The beginning of a ZIP archive up to the name of the first file in it.
_ZIP = r"PK\x03\x04.{26}"
_HTML = r"(?i:<!doctype\s+html|<html)[\s>]"

# The first that matches counts.
FOREIGN = (
    Foreign(
        "a Git LFS pointer, not the file itself",
        "fetch the file: git lfs pull",
        "version https://git-lfs.github.com/spec/",
    ),
    Foreign("a git-annex pointer, not the file itself", "fetch it: git annex get", "/annex/obj"),
    Foreign("a web page", _DOWNLOAD, _TEXT + _HTML),
    Foreign("the error message of a download", _DOWNLOAD, r"40[0-9]:? [A-Z][\w ]{4,20}\s*\Z"),
    Foreign("an Excel workbook", AS_TABLE, r"PK\x03\x04.*?xl/"),
    Foreign(
        "an OpenDocument spreadsheet",
        AS_TABLE,
        _ZIP + r"mimetypeapplication/vnd\.oasis\.opendocument\.spreadsheet",
    ),
    Foreign("an OLE file, as Excel 97's (.xls)", AS_TABLE, r"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"),
    Foreign("a NumPy array (.npy)", AS_TABLE, r"\x93NUMPY"),
    Foreign("an archive of NumPy arrays (.npz)", AS_TABLE, _ZIP + r"[^/]{1,80}?\.npy"),
    Foreign("a MATLAB file", AS_TABLE, r"MATLAB [57]\.\d MAT-file"),
    Foreign("an HDF5 file", AS_TABLE, r"\x89HDF\r\n\x1a\n"),
    Foreign("a Parquet file", AS_TABLE, "PAR1"),
    Foreign("a surface file of Speos (OPTIS)", AS_TABLE, _TEXT + "OPTIS - "),
    Foreign("a PDF document", AS_TABLE, "%PDF-"),
    Foreign("a USDZ archive", _SCENE, _ZIP + r"[^/]{1,80}?\.usd"),
    Foreign("a USD file", _SCENE, "PXR-USDC|#usda "),
    Foreign("an FBX file", _SCENE, "Kaydara FBX Binary|; FBX "),
    Foreign("a Blender file", _SCENE, "BLENDER[-_v0-9]"),
    Foreign("a Collada file", _SCENE, _TEXT + r"<COLLADA[\s>]"),
    Foreign("a DDS texture", _PICTURE, r"DDS \x7c\0\0\0"),
    Foreign("a KTX texture", _PICTURE, r"\xabKTX \d\d\xbb\r\n\x1a\n"),
    Foreign("a Basis texture", _PICTURE, r"sB..\x4d\x00"),
    Foreign("a WebP picture", _PICTURE, "RIFF.{4}WEBP"),
    Foreign("an AVIF or HEIF picture", _PICTURE, ".{4}ftyp(?:avi[fs]|hei[cfsx]|mif1|msf1)"),
    Foreign("a JPEG XL picture", _PICTURE, r"\0\0\0\x0cJXL \r\n\x87\n"),
    Foreign("a JPEG 2000 picture", _PICTURE, r"\0\0\0\x0cjP  \r\n\x87\n|\xff\x4f\xff\x51"),
    Foreign("a GIF picture", _PICTURE, "GIF8[79]a"),
    Foreign("a BMP picture", _PICTURE, r"BM.{4}\0{4}.{3}\0"),
    Foreign("a Photoshop document", _PICTURE, r"8BPS\0[\x01\x02]"),
    Foreign("a Radiance picture", _PICTURE, r"#\?(?:RADIANCE|RGBE)\s"),
    Foreign("a ZIP archive", _UNPACK, r"PK\x03\x04"),
    Foreign("compressed by gzip", _UNPACK, r"\x1f\x8b\x08"),
    Foreign("compressed by bzip2", _UNPACK, "BZh[1-9]1AY&SY"),
    Foreign("compressed by xz", _UNPACK, r"\xfd7zXZ\0"),
    Foreign("compressed by Zstandard", _UNPACK, r"\x28\xb5\x2f\xfd"),
    Foreign("a 7-Zip archive", _UNPACK, r"7z\xbc\xaf\x27\x1c"),
    Foreign("a RAR archive", _UNPACK, r"Rar!\x1a\x07"),
    Foreign("a tar archive", _UNPACK, ".{257}ustar"),
)


def foreign(head: bytes, kinds: Sequence[Foreign] = FOREIGN) -> Foreign | None:
    """Return what kind of file starts with some bytes, if it is one that is not read.

    Parameters
    ----------
    head : bytes
        The first bytes of a file, of which `HEAD_BYTES` count.
    kinds : sequence of Foreign
        Those that are not read.
    """
    start = bytes(head[:HEAD_BYTES])
    return next((kind for kind in kinds if kind.matches(start)), None)


def refuse_foreign(name: object, head: bytes, kinds: Sequence[Foreign] = FOREIGN) -> None:
    """Raise `MdfconvError`, with the way out, if a file is of a `foreign` kind.

    Its name stands first; it is empty where who asks says of which file the error is.
    """
    kind = foreign(head, kinds)
    if kind:
        raise MdfconvError(f"{name} is {kind.name}".lstrip(), kind.way_out)
