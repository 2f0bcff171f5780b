"""What the name of a column says that it holds."""

from __future__ import annotations

import re
from enum import StrEnum

import numpy as np

from mdfconv.distributions.evaluation import Array


class Role(StrEnum):
    """What a column of angles can hold."""

    theta_i = "zenith of the incident direction"
    phi_i = "azimuth of the incident direction"
    theta_o = "zenith of the outgoing direction"
    phi_o = "azimuth of the outgoing direction"
    phi = "difference of the azimuths"
    angle = "angle"


_LETTERS = {"θ": "theta", "ϑ": "theta", "φ": "phi", "ϕ": "phi", "Δ": " delta ", "δ": " delta "}
_ZENITH = {"theta", "zenith", "polar", "colatitude", "th"}
_AZIMUTH = {"phi", "azimuth", "azimuthal", "azi", "az", "ph"}
_ANGLE = {"angle", "beta", "alpha"}
_INCIDENT = {
    "i", "in", "inc", "incident", "incidence", "incoming", "ingoing", "input", "light", "l",
    "source", "src", "illumination", "aoi",
}  # fmt: skip
_OUTGOING = {
    "o", "out", "outgoing", "output", "r", "refl", "reflected", "reflection", "s", "scat",
    "scatter", "scattered", "scattering", "v", "view", "viewing", "viewer", "detector", "det",
    "observer", "observation", "e", "exit", "emergent", "emission", "exitant",
}  # fmt: skip
_DIFFERENCE = {"delta", "relative", "rel", "diff", "difference"}
_HALF = {"h", "half", "halfway"}
_OF_HALF = _HALF | {"beta"}
_UNITS = {"deg", "degree", "degrees", "rad", "radian", "radians", "cos", "cosine"}
_FILLERS = {"of", "the", "direction", "dir", "vector", "normal", "w", "omega"}
_JOINED = re.compile(r"(delta|d)?(theta|phi|zenith|azimuth)(\w*)")
_VALUES = {
    "brdf", "bsdf", "f", "fr", "value", "values", "val", "r", "g", "b", "red", "green", "blue",
    "x", "y", "z", "luminance", "ndf", "d", "reflectance",
}  # fmt: skip
_WAVELENGTH = re.compile(r"(lambda|wl|brdf|bsdf|r)?\s*_?\d{3,4}(\.\d+)?\s*(nm)?", re.I)
_INDEX = {"", "index", "idx", "no", "nr", "n", "id", "row", "sample", "point", "num", "number", "i"}


def role_of(name: str) -> Role | None:
    """Return what kind of angle a name speaks of; None if of none, or of another coordinate."""
    words = _words(name)
    kinds = set(words)
    sides = kinds - _ZENITH - _AZIMUTH - _ANGLE - _UNITS
    incident, outgoing = bool(sides & _INCIDENT), bool(sides & _OUTGOING)
    if kinds & _AZIMUTH:
        if sides & _DIFFERENCE or not sides - _FILLERS:
            return Role.phi
        if incident != outgoing:
            return Role.phi_i if incident else Role.phi_o
        return None
    if kinds & (_ZENITH | _ANGLE) or "aoi" in kinds:
        if sides & _HALF or not sides - _FILLERS:
            return Role.angle
        return _side(incident, outgoing)
    return Role.angle if kinds & _UNITS and not kinds - _UNITS else None


def _side(incident: bool, outgoing: bool) -> Role | None:
    if incident == outgoing:
        return None
    return Role.theta_i if incident else Role.theta_o


def is_half(name: str) -> bool:
    """Return whether a name is one of the angle of half vectors."""
    return bool(set(_words(name)) & _OF_HALF)


def is_angle(name: str) -> bool:
    """Return whether a name is one of an angle, be it of coordinates that are not read."""
    return bool(set(_words(name)) & (_ZENITH | _AZIMUTH | _ANGLE)) or role_of(name) is not None


def is_value(name: str) -> bool:
    """Return whether a name is one of values: of a BRDF, a channel or a wavelength."""
    bare = _bare(name)
    joined = re.sub(r"[^a-z0-9]", "", bare)
    return joined in _VALUES or bool(_WAVELENGTH.fullmatch(bare.strip()))


def is_wavelength(name: str) -> bool:
    """Return whether a name is that of a column of wavelengths."""
    return re.sub(r"[^a-zλ]", "", _bare(name)) in {"wavelength", "lambda", "λ", "wavelengthnm"}


def counts_rows(name: str, numbers: Array) -> bool:
    """Return whether a column is called an index and counts, from 0 or 1."""
    called = re.sub(r"[^a-z]|unnamed", "", name.lower()) in _INDEX and role_of(name) is None
    return called and is_counting(numbers)


def is_counting(numbers: Array) -> bool:
    """Return whether numbers count, from 0 or 1."""
    first = numbers[0]
    return (
        numbers.size > 2
        and first in (0, 1)
        and bool(np.array_equal(numbers, first + np.arange(numbers.size)))
    )


def _bare(name: str) -> str:
    """Return a name in small letters, without what stands in brackets."""
    return re.sub(r"[\[({].*?[\])}]", " ", name).lower()


def _words(name: str) -> list[str]:
    """Return the words of a name: thetaIn, theta_in and θ in are theta and in."""
    text = name.replace("°", " deg ")
    for letter, word in _LETTERS.items():
        text = text.replace(letter, word)
    text = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", text)
    words = []
    for word in re.findall(r"[a-z]+", text.lower()):
        joined = _JOINED.fullmatch(word)
        if joined:
            difference, kind, side = joined.groups()
            words += ["delta"] * bool(difference) + [kind] + [side] * bool(side)
        else:
            words.append(word)
    return words
