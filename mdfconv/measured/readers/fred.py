"""FRED's tabulated BSDF: lines ``θ φ`` of an incidence, each followed by rows ``θ φ value``.

The azimuth of incidence is that of the light's travel: the specular direction has the same one.
"""

from __future__ import annotations

import re

import numpy as np

from mdfconv.measured.readers.base import Reader, ReadOptions, Source, known_by
from mdfconv.measured.readers.tables import number
from mdfconv.measured.samples import DirectionalSamples, about_of, directional_samples

_KNOWN_BY = re.compile(r"^\s*type\s+bsdf_data\b", re.M | re.I)
_SETTING = re.compile(r"(\w+)\s*=\s*(\S+)")
_COMMENTS = ("!", "#", "//")


def _read(source: Source, options: ReadOptions) -> DirectionalSamples:
    options.refuse(source.path, "the header of FRED's format says what its numbers are")
    scale, to_radians = 1.0, np.pi / 180
    incidence: list[float] = []
    rows: list[list[float]] = []
    lines = source.lines()
    for place, line in enumerate(lines, start=1):
        words = line.split()
        if not words or line.lstrip().startswith(_COMMENTS) or words[0].lower() == "type":
            continue
        if words[0].lower() == "format":
            scale, to_radians = _format(source, place, line)
            continue
        numbers = _numbers(source, place, line)
        if len(numbers) == 2:
            incidence = numbers
        elif len(numbers) == 3 and incidence:
            rows.append([*incidence, *numbers])
        else:
            reason = f"{len(numbers)} numbers" + ("" if incidence else " before an incidence")
            hint = "two are an incidence (θ φ), three a row (θ φ value)"
            raise source.error(reason, hint, line=place)
    if not rows:
        raise source.error("no rows θ φ value")
    table = np.array(rows)
    theta_i, phi_i, theta_o, phi_o = table[:, :4].T * to_radians
    with np.errstate(over="ignore"):
        values = table[:, 4:] * scale
    about = about_of(line.strip(" \t!#/") for line in lines if line.lstrip().startswith(_COMMENTS))
    angles = theta_i, phi_i + np.pi, theta_o, phi_o
    return directional_samples(source.path, *angles, values, ("value",), (), about)


def _format(source: Source, place: int, line: str) -> tuple[float, float]:
    """Return the scale of the values and the factor to radians that a line of settings gives."""
    settings = {key.lower(): value for key, value in _SETTING.findall(line)}
    angles = settings.get("angles", "deg").lower()
    if angles not in ("deg", "rad") or settings.get("bsdf", "value").lower() != "value":
        hint = "angles=deg or angles=rad, and bsdf=value are read"
        raise source.error(line.strip()[:60], hint, line=place)
    (scale,) = _numbers(source, place, settings.get("scale", "1"))
    return scale, np.pi / 180 if angles == "deg" else 1.0


def _numbers(source: Source, place: int, line: str) -> list[float]:
    try:
        return [number(word) for word in line.replace(",", " ").split()]
    except ValueError:
        raise source.error(f"not numbers: {line.strip()[:60]}", line=place) from None


READER = Reader("FRED", known_by(_KNOWN_BY), _read)
