"""Smith's Λ of any distribution, from its lobe alone.

With t = tan β, w = t tan θ and F the cumulative distribution, Λ is the area of the facets that a
direction sees from behind over the projected area of all it sees (Heitz 2014, eqs. 17 and 43)::

    Λ(θ) = 1/cos θ ∫ max(−ω·m, 0) D dm = 1/π ∫ g(w) dF,
    g(w) = √(w² − 1) − arccos(1/w) where w > 1, else 0.

Over u = ln t that is a convolution with a function of ln tan θ. On panels of one length, on each of
which dF/du is a polynomial, it is a product with a matrix that serves every distribution, and the
result a polynomial on the same panels.
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from mdfconv.distributions.angles import Angles
from mdfconv.distributions.evaluation import Array, Kernel, by_blocks, gauss_legendre

# The length of a panel in u, and the nodes on it.
_PANEL, _NODES = 0.45, 10
# ln t over the width of the lobe, below which D is that at the normal, and over the larger of that
# width and 1, above which dF/du is a power of t.
_CORE, _HORIZON = -7.0, 13.0
# They reach down to widths of 1e-30.
_MOST_PANELS = 200
# Nodes of the integrals over a panel; directions that are interpolated at a time, in the cache.
_ORDER, _BLOCK = 24, 8192


class SmithTable(NamedTuple):
    """Λ as polynomials on panels of ln cot θ, which lead down from `top`.

    Towards grazing follows linear tan θ − ½ + inverse / tan θ, towards the normal `at_top` times
    a power of tan θ.
    """

    top: float
    coefficients: Array
    linear: float
    inverse: float
    at_top: float
    power: float

    def __call__(self, tangent: Array) -> Array:
        """Return Λ for tan θ ≥ 0."""
        with np.errstate(all="ignore"):
            return by_blocks(self._block, tangent, _BLOCK)

    def _block(self, tangent: Array) -> Array:
        place = (np.log(tangent) + self.top) * (1 / _PANEL)
        panels = self.coefficients.shape[1]
        index = np.clip(place, 0, panels - 1).astype(np.intp)
        within = 2 * (place - index) - 1
        highest, *rest = self.coefficients
        value = highest.take(index, mode="clip")
        for row in rest:
            value *= within
            value += row.take(index, mode="clip")
        np.maximum(value, 0, out=value)
        if not (place.min() >= 0 and place.max() < panels):
            grazing = self.linear * tangent - 0.5 + self.inverse / tangent
            value = np.where(place < panels, value, grazing)
            steep = self.at_top * np.exp(self.power * _PANEL * place)
            value = np.where(place < 0, steep, value)
        return value


def smith_table(lobe: Kernel, width: float, edge: float | None) -> SmithTable:
    """Return Λ of a lobe.

    Parameters
    ----------
    lobe : callable
        D(β)/D(0) for `Angles`.
    width : float
        The α for which D(0) of the normalized form is 1/(π α²).
    edge : float or None
        The angle beyond which D is 0, radians; None if there is none.
    """
    scale = np.log(width)
    horizon = max(scale, 0.0) + _HORIZON
    # Rounded, an edge at π/2 is beyond it.
    top = horizon if edge is None else np.log(np.tan(min(edge, np.pi / 2)))
    panels = min(int(np.ceil((top - scale - _CORE) / _PANEL)), _MOST_PANELS)
    x, weight, to_coefficients = _panel_nodes()
    u = top - _PANEL * (np.arange(panels)[:, None] + x)
    tangent = np.exp(u)
    square = np.square(tangent)
    # dF/du = 2π D sin β cos β dβ/du
    density = 2 * lobe(Angles(tangent=tangent.ravel())).reshape(u.shape)
    density *= np.exp(2 * (u - scale)) / np.square(1 + square)
    mass = density * weight
    # Below the last panel dF/du is 2 t²/α².
    least = np.exp(top - _PANEL * panels)
    below = np.square(least / width) * least
    linear = (np.sum(mass * tangent) + 2 / 3 * below) / np.pi
    inverse = (np.sum(mass / tangent) + 2 * below / np.square(least)) / (2 * np.pi)
    padded = np.concatenate([np.zeros((panels - 1, _NODES)), density]).ravel()
    length = panels * _NODES
    seen = np.ascontiguousarray(sliding_window_view(padded, length)[::_NODES])
    value = seen @ _convolution()[-length:]
    power, beyond = 2.0, 0.0
    if edge is None and density[0, 0] > 0:
        power = np.log(density[0, -1] / density[0, 0]) / (_PANEL * (x[-1] - x[0]))
        beyond = density[0, 0] * np.exp(-power * _PANEL * x[0]) / np.pi
    # ∫ g of the power law, with g = w − π/2 + 1/2w.
    w = np.exp(_PANEL * (np.arange(panels)[:, None] + x))
    parts = beyond / (power - 1), beyond * np.pi / (2 * power), beyond / (2 * power + 2)
    value += parts[0] * w - parts[1] + parts[2] / w
    linear += parts[0] * np.exp(top)
    at_top = max(parts[0] - parts[1] + parts[2], 0.0)
    return SmithTable(top, (value @ to_coefficients).T.copy(), linear, inverse, at_top, power)


@cache
def _panel_nodes() -> tuple[Array, Array, Array]:
    """Return nodes on (0, 1), weights over a panel, and from values to coefficients.

    The coefficients, highest power first, are those of 2x − 1.
    """
    z, weight = gauss_legendre(_NODES)
    return 0.5 * (1 + z), 0.5 * _PANEL * weight, np.linalg.inv(np.vander(z)).T


@cache
def _convolution() -> Array:
    """Return 1/π ∫ of each node's Lagrange polynomial times g, for each node of a direction.

    Shape (panels * nodes, nodes): the panel of the direction comes last.
    """
    x, _, to_coefficients = _panel_nodes()
    z, weight = gauss_legendre(_ORDER)
    above = np.arange(_MOST_PANELS)[::-1, None] + x
    # d = u + ln tan θ on a panel from its lower end, but not below 0; over √d it is smooth.
    low, high = (np.sqrt(_PANEL * np.maximum(above - end, 0))[..., None] for end in (1, 0))
    root = low + 0.5 * (high - low) * (1 + z)
    r = np.sqrt(np.expm1(2 * np.square(root)))
    mass = (r - np.arctan(r)) * root * (high - low) * weight / np.pi
    place = 2 * (above[..., None] - np.square(root) / _PANEL) - 1
    # The polynomial of a node has its row of the inverse as coefficients.
    lagrange = np.polynomial.polynomial.polyval(place, to_coefficients[:, ::-1].T)
    return np.einsum("akjq,kjq->kaj", lagrange, mass).reshape(-1, _NODES)
