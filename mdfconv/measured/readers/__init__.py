"""The files that measurements come in, each known by its content.

A new format is a module that defines ``READER``, and one line in `_MODULES`.
"""

from __future__ import annotations

from dataclasses import replace
from importlib import import_module
from pathlib import Path

import numpy as np

from mdfconv.errors import MdfconvError
from mdfconv.measured.readers.base import Reader, ReadOptions, Source, open_source
from mdfconv.measured.samples import Measurements
from mdfconv.output.kinds import AS_TABLE, FOREIGN, Foreign, refuse_foreign
from mdfconv.registry import unknown_name

__all__ = ["READERS", "ReadOptions", "Reader", "Source", "list_readers", "read"]

# In the order in which they are asked: text reads what no other one knows.
_MODULES = ("merl", "rgl", "alta", "zemax", "fred", "klems", "astm", "text")

# What other commands read, or what no reader can know the meaning of.
_NO_MEASUREMENTS = (
    *FOREIGN,
    Foreign("a JSON file", AS_TABLE, r"(?:\xef\xbb\xbf)?\s*(?:\{|\[\s*[\[{\"])"),
    Foreign("an XML file", AS_TABLE, r"(?:\xef\xbb\xbf)?\s*<\?xml\s(?!.*<WindowElement[\s>])"),
    Foreign("a picture, not measurements", AS_TABLE, r"\x89PNG|\xff\xd8\xff|II\*\0|MM\0\*|v/1\x01"),
)

# What values are: f_r, or π f_r.
_VALUES = (_BRDF, _FACTOR) = "brdf", "factor"
# The format whose cells can be chosen.
_WITH_CELLS = "MERL"

READERS: tuple[Reader, ...] = tuple(
    import_module(f"{__name__}.{module}").READER for module in _MODULES
)


def list_readers() -> list[str]:
    """Return the names of the formats, in the order in which a file is tried."""
    return [reader.name for reader in READERS]


def read(path: Path | str, options: ReadOptions | None = None) -> Measurements:
    """Read measurements, whatever format they are in.

    Parameters
    ----------
    path : Path or str
        The file; ``"-"`` is standard input.
    options : ReadOptions, optional
        Which columns of a table hold what, and in which unit.

    Returns
    -------
    Samples or DirectionalSamples
        Against one angle, or against two directions, as the file has them.

    Raises
    ------
    MdfconvError
        If the file cannot be read, is damaged, or leaves open what its numbers mean.

    Examples
    --------
    >>> from mdfconv.measured import ReadOptions, read
    >>> samples = read("scan.csv", ReadOptions(theta_i="2", unit="degrees"))  # doctest: +SKIP
    """
    try:
        source = open_source(path)
    except OSError as error:
        raise MdfconvError(f"cannot read {path}: {error.strerror}") from None
    refuse_foreign(source.path, source.head, _NO_MEASUREMENTS)
    options = options or ReadOptions()
    if options.values_are not in (None, *_VALUES):
        raise unknown_name("kind of values", options.values_are, list(_VALUES))
    reader = next(reader for reader in READERS if reader.recognizes(source.path.name, source.head))
    if options.cells is not None and reader.name != _WITH_CELLS:
        raise MdfconvError(f"{source.path}: cells are those of a {_WITH_CELLS} file")
    measured = reader.samples(source, options)
    return _as_brdf(measured) if options.values_are == _FACTOR else measured


def _as_brdf(measured: Measurements) -> Measurements:
    """Return samples whose values are reflectance factors as those of f_r."""
    uncertainty = measured.uncertainty
    return replace(
        measured,
        values=measured.values / np.pi,
        uncertainty=None if uncertainty is None else uncertainty / np.pi,
        notes=(*measured.notes, "the values are reflectance factors, π f_r, and divided by π"),
    )
