"""The ALTA library's data files, text or binary, in several of its parametrizations.

Written after ``core/data.cpp`` and ``core/params.cpp`` of the library. V is the view, L the
light; both point away from the surface.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from mdfconv.brdf.microfacet import direction
from mdfconv.distributions.evaluation import Array
from mdfconv.measured.readers import base
from mdfconv.measured.readers.base import Reader, ReadOptions, Source
from mdfconv.measured.readers.tables import parse_table
from mdfconv.measured.samples import Measurements, about_of, samples

_TAG = re.compile(r"^#[ \t]*([A-Z_]+)[ \t]+([^\n]*?)\s*$", re.M)
_DIMENSIONS = re.compile(r"^#\s*DIM\s+\S", re.M)
_BEGIN = b"#BEGIN_STREAM"
# Against the angle of the half vector alone, in this unit.
_ONE_ANGLE = {"COS_TH": "cosine", "COS_TH_H": "cosine", "TH": "radians", "TH_H": "radians"}
_WEIGHTED = "INV_STERADIAN_COSINE_FACTOR"
_PLAIN = ("INV_STERADIAN", "RGB_COLOR")


def _half_and_difference(*angles: Array) -> tuple[Array, Array]:
    view, light = base.from_half_and_difference(*angles)
    return light, view


# How many inputs there are, and light and view of them.
_TWO_DIRECTIONS: dict[str, tuple[int, Callable[..., tuple[Array, Array]]]] = {
    "ISOTROPIC_TL_TV_PROJ_DPHI": (
        3,
        lambda tl, x, y: (direction(tl), direction(np.hypot(x, y), np.arctan2(y, x))),
    ),
    "ISOTROPIC_TV_TL_DPHI": (3, lambda tv, tl, dphi: (direction(tl, dphi), direction(tv))),
    "SPHERICAL_TL_PL_TV_PV": (4, lambda tl, pl, tv, pv: (direction(tl, pl), direction(tv, pv))),
    "RUSIN_TH_TD_PD": (3, lambda th, td, pd: _half_and_difference(th, 0 * th, td, pd)),
    "RUSIN_TH_PH_TD_PD": (4, _half_and_difference),
    "CARTESIAN": (6, lambda *xyz: (np.stack(xyz[3:], -1), np.stack(xyz[:3], -1))),
}


def _read(source: Source, options: ReadOptions) -> Measurements:
    path = source.path
    options.refuse(path, "ALTA's header names its columns")
    head = base.decode_head(source.head).splitlines()
    tags = dict(_TAG.findall("\n".join(head)))
    about = about_of(_comments(head))
    parametrization = tags.get("PARAM_IN", "").upper()
    inputs, outputs = _dimensions(source, tags.get("DIM", ""), parametrization)
    numbers = _numbers(source, tags, inputs, outputs)
    x, values = numbers[:, :inputs], numbers[:, inputs : inputs + outputs]
    names = ("R", "G", "B") if outputs == 3 else tuple(str(n + 1) for n in range(outputs))
    kind = tags.get("PARAM_OUT", "UNKNOWN_OUTPUT").upper()
    notes: tuple[str, ...] = ()
    if kind not in (*_PLAIN, _WEIGHTED):
        notes = (f"{kind} is read as values of f_r",)
    if parametrization in _ONE_ANGLE:
        unit = _ONE_ANGLE[parametrization]
        return samples(path, x[:, 0], unit, values, names, "brdf", notes, about)
    whole = np.isfinite(numbers).all(axis=1, keepdims=True)
    x, values = np.where(whole, x, 0.0), np.where(whole, values, np.nan)
    with np.errstate(all="ignore"):
        light, view = _TWO_DIRECTIONS[parametrization][1](*x.T)
        if kind == _WEIGHTED:
            values = values / np.where(view[:, 2:] > 0, view[:, 2:], np.nan)
            notes += ("the values hold the cosine of the view, by which they are divided",)
        return base.samples_of_vectors(path, light, view, values, names, notes, about)


def _comments(head: Sequence[str]) -> Iterator[str]:
    """Yield the comments above the numbers that are none of ALTA's."""
    for line in head:
        if not line.startswith("#") or line.startswith(_BEGIN.decode()):
            return
        if not _TAG.match(line):
            yield line.strip("# \t")


def _dimensions(source: Source, text: str, parametrization: str) -> tuple[int, int]:
    """Return how many inputs and outputs there are, if they go with the parametrization."""
    words = text.split()
    if len(words) < 2 or not all(re.fullmatch("[0-9]{1,3}", word) for word in words[:2]):
        raise source.error(f"ALTA data of dimension '{text}'", "two whole numbers go there")
    inputs, outputs = map(int, words[:2])
    sizes = {name: size for name, (size, _) in _TWO_DIRECTIONS.items()}
    known = dict.fromkeys(_ONE_ANGLE, 1) | sizes
    if parametrization not in known:
        reason = f"ALTA input parametrization '{parametrization}'"
        raise source.error(reason, f"known: {', '.join(known)}")
    if inputs != known[parametrization]:
        takes = known[parametrization]
        raise source.error(f"ALTA data of {inputs} inputs, where {parametrization} has {takes}")
    return inputs, outputs


def _numbers(source: Source, tags: dict[str, str], inputs: int, outputs: int) -> Array:
    """Return the rows of the file, the inputs first."""
    if tags.get("FORMAT", "text").lower() == "binary":
        return _binary(source, tags, inputs + outputs)
    numbers = parse_table(source.path, source.lines()).numbers
    if not 1 <= outputs <= numbers.shape[1] - inputs:
        width = numbers.shape[1]
        raise source.error(f"{width} columns do not hold {inputs} + {outputs} dimensions")
    return numbers


def _binary(source: Source, tags: dict[str, str], width: int) -> Array:
    content = source.content
    if tags.get("PRECISION", "") != "ieee754-double" or tags.get("VERSION", "") != "0":
        raise source.error("ALTA binary data", "only version 0 of ieee754-double is read")
    count = tags.get("SAMPLE_COUNT", "")
    if not re.fullmatch("[0-9]{1,12}", count):
        raise source.error("ALTA binary data without a count of samples")
    order = ">" if tags.get("ENDIAN", "little").lower() == "big" else "<"
    start = content.find(b"\n", content.find(_BEGIN)) + 1 if _BEGIN in source.head else 0
    size = int(count) * width
    if not start or len(content) - start < 8 * size:
        rest = len(content) - start
        raise source.error(f"truncated: {rest} bytes where {count} samples take {8 * size}")
    if not size:
        raise source.error("no samples")
    return np.frombuffer(content, f"{order}f8", size, start).astype(float).reshape(-1, width)


READER = Reader("ALTA", base.known_by(_DIMENSIONS), _read)
