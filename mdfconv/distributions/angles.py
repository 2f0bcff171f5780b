"""Angles of half vectors, in the variable that is at hand."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property
from typing import Any, Self

import numpy as np

from mdfconv.distributions.elementary import log1p, tangent_square, versine
from mdfconv.distributions.evaluation import Array, Indices, Mask

# (1 + tan²β)² stays finite.
_LARGEST_SQUARE = {np.dtype(np.float32): 1e18, np.dtype(np.float64): 1e150}


class Angles:
    """Angles β between half vector and surface normal, and functions of them.

    A kernel takes the functions that it needs. Each is computed from what is given when a kernel
    first asks for it, and kept, so that all lobes that are evaluated at the same angles share it.
    The arrays must not be written to.

    Parameters
    ----------
    beta : numpy.ndarray, optional
        β, radians, [0, π/2].
    tangent : numpy.ndarray, optional
        tan β in the place of β, from 0, finite.

    Attributes
    ----------
    beyond : numpy.ndarray of bool or None
        Where facets face away from the surface, so that D is 0; None for nowhere.
    """

    beyond: Mask | None = None

    def __init__(self, beta: Array | None = None, *, tangent: Array | None = None) -> None:
        given = {"beta": beta, "tangent": tangent}
        # These take the place of the properties.
        self.__dict__ |= {name: array for name, array in given.items() if array is not None}

    @classmethod
    def of_angle(cls, beta: Array) -> Self:
        """Return those of any β, radians: the functions are even, and D is 0 beyond π/2."""
        # Read as integers, floats from 0 to π/2 keep their order and all others (negative, NaN)
        # are larger: one reduction shows that nothing needs a closer look.
        horizon = beta.dtype.type(np.pi / 2)
        bits = np.dtype(f"u{horizon.itemsize}")
        if not beta.size or beta.view(bits).max() <= horizon.view(bits):
            return cls(beta)
        magnitude = np.abs(beta)
        angles = cls(magnitude)
        angles.beyond = magnitude > horizon
        return angles

    @classmethod
    def of_cosine(cls, cosine: Array) -> Self:
        """Return those of any cos β, of which 1 may be exceeded by rounding; D is 0 below 0."""
        cosine = np.minimum(cosine, 1)
        angles = cls()
        square = (1 - cosine) * (1 + cosine) / np.square(cosine)
        angles.__dict__ |= {"tangent_square": _bounded(square), "versine": 1 - cosine}
        if not cosine.min(initial=0) >= 0:
            angles.beyond = cosine < 0
        return angles

    @classmethod
    def of_slope(cls, slope: Array) -> Self:
        """Return those of any tan β, which is taken as even; infinite at π/2."""
        angles = cls(tangent=np.abs(slope))
        angles.__dict__["tangent_square"] = _bounded(np.square(slope))
        return angles

    def __getitem__(self, index: Indices | Mask | tuple[Any, ...]) -> Angles:
        """Return some of the angles."""
        part = Angles()
        part.__dict__ |= {name: array[index] for name, array in self.__dict__.items()}
        return part

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape of the arrays."""
        return next(iter(self.__dict__.values())).shape

    @cached_property
    def beta(self) -> Array:
        """Return β, radians."""
        return np.arctan(self.tangent)

    @cached_property
    def tangent(self) -> Array:
        """Return tan β."""
        return np.sqrt(self.tangent_square)

    @cached_property
    def tangent_square(self) -> Array:
        """Return tan²β, the variable in which most lobes keep their digits up to π/2."""
        return np.square(self.tangent) if "tangent" in self.__dict__ else tangent_square(self.beta)

    @cached_property
    def sine_square(self) -> Array:
        """Return sin²β."""
        return self.tangent_square / (1 + self.tangent_square)

    @cached_property
    def versine(self) -> Array:
        """Return 1 − cos β."""
        if "beta" in self.__dict__:
            return versine(self.beta)
        square = 1 + self.tangent_square
        return self.tangent_square / (square + np.sqrt(square))

    @cached_property
    def log_secant_square(self) -> Array:
        """Return −2 ln cos β."""
        return log1p(self.tangent_square)


def _bounded(square: Array) -> Array:
    """Return tan²β, of angles nearly π/2 that of one with which kernels can compute."""
    return np.minimum(square, _LARGEST_SQUARE[square.dtype])


# What angles may be given as.
VARIABLES: Mapping[str, Callable[[Array], Angles]] = {
    "angle": Angles.of_angle,
    "cosine": Angles.of_cosine,
    "slope": Angles.of_slope,
}
