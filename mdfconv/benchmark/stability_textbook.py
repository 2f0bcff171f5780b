"""The printed constants and conversions, written as one would in NumPy.

As in `mdfconv.benchmark.textbook`, losing digits is the point. Everything is computed in the type
of the arguments.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np

from mdfconv.benchmark.textbook import textbook

Function: TypeAlias = Callable[..., Any]

_LN2 = float(np.log(2))


def printed_kernel(name: str, form: str, beta: Any, parameter: Any, gamma: Any) -> Any:
    """Return the unit or the normalized form.

    Parameters
    ----------
    name : str
        Proper name of the distribution.
    form : str
        ``"unit"`` or ``"normalized"``.
    beta, parameter, gamma : numpy.ndarray or numpy scalar
        Angle (radians), parameter and, for GTR, exponent, all of one type.
    """
    with np.errstate(all="ignore"):
        value = textbook(name, beta, parameter, gamma)
        if form == "normalized":
            return value * _CONSTANTS[name](parameter, gamma)
        if name == "beckmann" and 2 * parameter**2 > 1:
            return value / (4 * parameter**4 * np.exp(1 / parameter**2 - 2))
        return value


def printed_conversion(method: str, source: str, target: str, value: Any, gamma: Any) -> Any:
    """Return the parameter of the target by the printed formulas; None if none is printed.

    Parameters
    ----------
    method : str
        ``"half-angle"`` (Sawicki 2021, eqs (3)-(10)) or ``"peak"``.
    source, target : str
        Proper names.
    value, gamma : numpy.ndarray
        Parameters of the source and γ of GTR, of one type.
    """
    there, back = _CONVERSIONS.get(method, ({}, {}))
    if source not in there or target not in back:
        return None
    with np.errstate(all="ignore"):
        return np.asarray(back[target](there[source](value, gamma), gamma)).astype(value.dtype)


def _inverse_square(parameter: Any, gamma: Any) -> Any:
    return 1 / (np.pi * parameter**2)


def _gtr_constant(alpha: Any, gamma: Any) -> Any:
    k = (gamma - 1) * (alpha**2 - 1) / (np.pi * (1 - alpha ** (2 * (1 - gamma))))
    return k / alpha ** (2 * gamma)


def _gauss_constant(m: Any, gamma: Any) -> Any:
    log_cosine = np.log(np.cos(m * np.sqrt(_LN2).astype(m.dtype)))
    return (2 * log_cosine - _LN2) / (2 * np.pi * log_cosine)


def _power_constant(n: Any, gamma: Any) -> Any:
    return (n + 2) / (2 * np.pi)


# D(0) of the normalized forms.
_CONSTANTS: dict[str, Function] = {
    "beckmann": _inverse_square,
    "gauss": _gauss_constant,
    "ggx": _inverse_square,
    "gtr": _gtr_constant,
    "blinn-phong": _power_constant,
    "ashikhmin-shirley": _power_constant,
    "schlick": _inverse_square,
    "sawicki": lambda n, gamma: 96 * (3 + n) / (256 * np.pi),
    "smoothie": lambda a, gamma: (a**2 + 4) / (np.pi * a**2),
}


def _beckmann_cosine(m: Any, gamma: Any) -> Any:
    # u² e^(−(u−1)/m²) = ½ for u = 1/cos²β_half.
    from scipy.special import lambertw

    argument = -np.exp(-1 / (2 * m**2)) / (2 * np.sqrt(2).astype(m.dtype) * m**2)
    return 1 / np.sqrt(-2 * m**2 * lambertw(argument, -1).real)


def _gtr_cosine(alpha: Any, gamma: Any) -> Any:
    return np.sqrt((2 ** (1 / gamma) * alpha**2 - 1) / (alpha**2 - 1))


def _gtr_from_cosine(c: Any, gamma: Any) -> Any:
    return np.sqrt((c**2 - 1) / (c**2 - 2 ** (1 / gamma)))


def _to_ggx(alpha: Any) -> Any:
    return alpha / np.sqrt(4 + alpha**2)


def _from_ggx(alpha: Any) -> Any:
    return 2 * alpha / np.sqrt(1 - alpha**2)


def _two(gamma: Any) -> Any:
    return np.full_like(gamma, 2)


# From the parameter to cos β_half, and back.
_COSINES: dict[str, Function] = {
    "beckmann": _beckmann_cosine,
    "gauss": lambda m, gamma: np.cos(m * np.sqrt(_LN2).astype(m.dtype)),
    "ggx": lambda alpha, gamma: _gtr_cosine(alpha, _two(gamma)),
    "gtr": _gtr_cosine,
    "blinn-phong": lambda n, gamma: 2 ** (-1 / n),
    "smoothie": lambda alpha, gamma: _gtr_cosine(_to_ggx(alpha), _two(gamma)),
}
_FROM_COSINES: dict[str, Function] = {
    "beckmann": lambda c, gamma: np.tan(np.arccos(c)) / np.sqrt(_LN2 - 4 * np.log(c)),
    "gauss": lambda c, gamma: np.arccos(c) / np.sqrt(_LN2).astype(c.dtype),
    "ggx": lambda c, gamma: _gtr_from_cosine(c, _two(gamma)),
    "gtr": _gtr_from_cosine,
    "blinn-phong": lambda c, gamma: -_LN2 / np.log(c),
    "sawicki": lambda c, gamma: (c + 3 - 4 * (2 * c) ** 0.25) / (c - 1),
    "smoothie": lambda c, gamma: _from_ggx(_gtr_from_cosine(c, _two(gamma))),
}


def _same(parameter: Any, gamma: Any) -> Any:
    return parameter


# From the parameter to the α with D(0) = 1/(π α²), and back.
_PEAKS: dict[str, Function] = {
    "beckmann": _same,
    "ggx": _same,
    "schlick": _same,
    "gauss": lambda m, gamma: 1 / np.sqrt(np.pi * _gauss_constant(m, gamma)),
    "gtr": lambda alpha, gamma: 1 / np.sqrt(np.pi * _gtr_constant(alpha, gamma)),
    "blinn-phong": lambda n, gamma: np.sqrt(2 / (n + 2)),
    "sawicki": lambda n, gamma: np.sqrt(8 / (3 * (n + 3))),
    "smoothie": lambda alpha, gamma: _to_ggx(alpha),
}
_FROM_PEAKS: dict[str, Function] = {
    "beckmann": _same,
    "ggx": _same,
    "schlick": _same,
    "blinn-phong": lambda alpha, gamma: 2 / alpha**2 - 2,
    "sawicki": lambda alpha, gamma: 8 / (3 * alpha**2) - 3,
    "smoothie": lambda alpha, gamma: _from_ggx(alpha),
}
_CONVERSIONS = {"half-angle": (_COSINES, _FROM_COSINES), "peak": (_PEAKS, _FROM_PEAKS)}
