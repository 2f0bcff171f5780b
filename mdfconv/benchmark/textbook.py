"""The unit forms as printed, written as one would in NumPy: what the kernels are held against.

They lose digits to cancellation and overflow; that is the point of them.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike


def textbook(name: str, beta: ArrayLike, parameter: ArrayLike, gamma: float = 2.0) -> Any:
    """Evaluate the printed unit form of a distribution.

    Parameters
    ----------
    name : str
        Proper name of the distribution.
    beta : array_like
        Angle between normal and half vector, radians, [0, π/2].
    parameter : array_like
        The parameter.
    gamma : float
        γ of GTR; the others ignore it.

    Returns
    -------
    numpy.ndarray or numpy scalar
        D(β)/D(0) as the expression gives it, in the type of the input: with every overflow,
        cancellation and NaN.
    """
    with np.errstate(all="ignore"):
        return _PRINTED[name](beta, parameter, gamma)


def _beckmann(beta: Any, m: Any, gamma: float) -> Any:
    return np.exp(-(np.tan(beta) ** 2) / m**2) / np.cos(beta) ** 4


def _gauss(beta: Any, m: Any, gamma: float) -> Any:
    return np.exp(-(beta**2) / m**2)


def _ggx(beta: Any, alpha: Any, gamma: float) -> Any:
    return (alpha**2 / (np.cos(beta) ** 2 * (alpha**2 - 1) + 1)) ** 2


def _gtr(beta: Any, alpha: Any, gamma: float) -> Any:
    return (alpha**2 / (np.cos(beta) ** 2 * (alpha**2 - 1) + 1)) ** gamma


def _blinn_phong(beta: Any, n: Any, gamma: float) -> Any:
    return np.cos(beta) ** n


def _schlick(beta: Any, m: Any, gamma: float) -> Any:
    c = np.cos(beta)
    x = c + m - 1
    return np.where(x > 0, m**5 * x / (c * (m * x**2 - x**2 + m**2) ** 2), 0)


def _sawicki(beta: Any, n: Any, gamma: float) -> Any:
    c = np.cos(beta)
    return 256 * c / ((1 - n) * c + n + 3) ** 4


def _smoothie(beta: Any, alpha: Any, gamma: float) -> Any:
    return (alpha**2 / (alpha**2 + 4 * np.sin(beta) ** 2)) ** 2


_PRINTED = {
    "beckmann": _beckmann,
    "gauss": _gauss,
    "ggx": _ggx,
    "gtr": _gtr,
    "blinn-phong": _blinn_phong,
    "ashikhmin-shirley": _blinn_phong,
    "schlick": _schlick,
    "sawicki": _sawicki,
    "smoothie": _smoothie,
}
