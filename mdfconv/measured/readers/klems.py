"""The BSDF of a window layer, XML of LBNL's WINDOW and of Radiance: a matrix over patches (Klems).

A basis of angles has rings of patches, each of as many azimuths: patch k of n lies about k/n of a
turn. A matrix has a row for each outgoing patch, in it a number, 1/sr, for each incident one.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import product
from xml.etree import ElementTree

import numpy as np

from mdfconv.distributions.evaluation import Array
from mdfconv.measured.readers.base import Reader, ReadOptions, Source, known_by
from mdfconv.measured.readers.text import oriented
from mdfconv.measured.samples import DirectionalSamples, about_of, directional_samples

_KNOWN_BY = re.compile(r"\A\ufeff?\s*<(?:.*<)?WindowElement[\s>]", re.DOTALL)
# Of several blocks the first of these is read.
_DIRECTIONS = ("reflection front", "reflection back")
_WAVELENGTHS = ("visible", "solar")
# A ring of the whole basis has 24 at most.
_MOST_AZIMUTHS = 1000
_DESCRIBING = ("Name", "Manufacturer", "SourceSpectrum", "DetectorSpectrum")


def _read(source: Source, options: ReadOptions) -> DirectionalSamples:
    options.refuse(source.path, "its XML says what its numbers are")
    root = _parsed(source)
    structure = " ".join(root.findtext(".//{*}IncidentDataStructure", "").split())
    if structure != "Columns":
        reason = f"a BSDF whose IncidentDataStructure is '{structure[:30]}'"
        raise source.error(reason, "only Columns, a matrix over patches, is read")
    names, block = _block(source, root)
    light, view = (
        _patches(source, root, block.findtext(f"{{*}}{side}AngleBasis", "").strip())
        for side in ("Column", "Row")
    )
    numbers = np.array(block.findtext("{*}ScatteringData", "").replace(",", " ").split(), float)
    if numbers.size != len(light) * len(view):
        size = f"{len(light)} × {len(view)} patches"
        raise source.error(f"{numbers.size} numbers of ScatteringData where {size} are")
    theta_o, phi_o = np.repeat(view, len(light), axis=0).T
    theta_i, phi_i = np.tile(light, (len(view), 1)).T
    angles = theta_i, phi_i, theta_o, phi_o
    notes = (f"{', '.join(names)} is read, at the centres of the patches",)
    about = about_of(f"{element.tag.split('}')[-1]}: {element.text}" for element in _told(root))
    values = numbers[:, None]
    return oriented(directional_samples(source.path, *angles, values, ("value",), notes, about))


def _parsed(source: Source) -> ElementTree.Element:
    """Return the root of the XML; without a document type no entity can stand for a huge text."""
    content = source.content[:]
    if b"\0" in content[:4] or b"<!DOCTYPE" in content:
        raise source.error("XML of another encoding than UTF-8, or with a document type")
    try:
        return ElementTree.fromstring(content)
    except ElementTree.ParseError as error:
        raise source.error(f"not well-formed XML: {error}") from None


def _block(source: Source, root: ElementTree.Element) -> tuple[list[str], ElementTree.Element]:
    """Return what the block of data is called that is read, and that block."""
    blocks: dict[tuple[str, str], tuple[str, str, ElementTree.Element]] = {}
    for data in root.iterfind(".//{*}WavelengthData"):
        wavelength = " ".join(data.findtext("{*}Wavelength", "").split())
        for block in data.iterfind("{*}WavelengthDataBlock"):
            direction = " ".join(block.findtext("{*}WavelengthDataDirection", "").split())
            key = direction.lower(), wavelength.lower()
            blocks.setdefault(key, (direction, wavelength, block))
    known = [wavelength for _, wavelength in blocks]
    for key in product(_DIRECTIONS, (*_WAVELENGTHS, *known)):
        if key in blocks:
            direction, wavelength, block = blocks[key]
            return [name for name in (direction, wavelength) if name], block
    there = ", ".join(dict.fromkeys(direction for direction, *_ in blocks.values())) or "nothing"
    raise source.error("no block of reflection", f"it has {there[:80]}")


def _patches(source: Source, root: ElementTree.Element, name: str) -> Array:
    """Return zenith and azimuth of the centres of a basis, radians, shape (patches, 2)."""
    bases = root.iterfind(".//{*}AngleBasis")
    basis = next((b for b in bases if b.findtext("{*}AngleBasisName", "").strip() == name), None)
    if basis is None:
        raise source.error(f"no basis of angles '{name[:40]}'")
    angles = []
    for ring in basis.iterfind("{*}AngleBasisBlock"):
        theta, count = float(ring.findtext("{*}Theta", "")), int(ring.findtext("{*}nPhis", ""))
        if not (0 <= theta <= 90 and 0 < count <= _MOST_AZIMUTHS):
            raise source.error(f"a ring of {count} patches at {theta:g}°")
        angles += [(theta, 360 * patch / count) for patch in range(count)]
    if not angles:
        raise source.error(f"the basis '{name[:40]}' has no patches")
    return np.radians(np.array(angles))


def _told(root: ElementTree.Element) -> Iterator[ElementTree.Element]:
    """Yield what describes the layer."""
    for name in _DESCRIBING:
        yield from (element for element in root.iterfind(f".//{{*}}{name}") if element.text)


READER = Reader("Klems", known_by(_KNOWN_BY), _read)
