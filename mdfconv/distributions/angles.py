"""Angles of half vectors, in the variable that is at hand."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property
from typing import Any, Self

import numpy as np

from mdfconv.distributions import elementary
from mdfconv.distributions.evaluation import Array, Indices, Mask

# (1 + tan²β)² stays finite.
_LARGEST_SQUARE: Mapping[Any, float] = {np.dtype(np.float32): 1e18, np.dtype(np.float64): 1e150}
# Up to here cos β is more than ¼.
_FAR_SQUARE = 1.7
_HORIZON_SQUARE = {dtype: np.square(dtype.type(0.5 * np.pi)) for dtype in _LARGEST_SQUARE}


class Angles:
    """Angles β between half vector and surface normal, and functions of them.

    A kernel takes the functions that it needs. Each is computed from what is given when a kernel
    first asks for it, and kept, so that all lobes that are evaluated at the same angles share it.
    The arrays must not be written to.

    Parameters
    ----------
    beta : numpy.ndarray, optional
        β, radians. All functions are even.
    tangent : numpy.ndarray, optional
        tan β in the place of β, from 0, finite.
    """

    def __init__(self, beta: Array | None = None, *, tangent: Array | None = None) -> None:
        given = {"beta": beta, "tangent": tangent}
        # These take the place of the properties.
        self.__dict__ |= {name: array for name, array in given.items() if array is not None}

    @classmethod
    def of_cosine(cls, cosine: Array) -> Self:
        """Return the angles of any cos β; what rounding makes larger than 1 is taken as 1."""
        angles, bounded = cls(), np.minimum(cosine, 1)
        square = (1 - bounded) * (1 + bounded) / np.square(bounded)
        angles.__dict__ |= {"tangent_square": _bounded(square), "versine": 1 - bounded}
        angles.__dict__["beyond"] = None if cosine.min(initial=0) >= 0 else cosine < 0
        return angles

    @classmethod
    def of_slope(cls, slope: Array) -> Self:
        """Return the angles of any tan β, which is infinite at π/2."""
        angles = cls(tangent=np.abs(slope))
        angles.__dict__["tangent_square"] = _bounded(np.square(slope))
        return angles

    def __getitem__(self, index: Indices | Mask | tuple[Any, ...]) -> Angles:
        """Return some of the angles."""
        part = Angles()
        part.__dict__ |= {
            name: array[index]
            for name, array in self.__dict__.items()
            if isinstance(array, np.ndarray)
        }
        return part

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape of the arrays."""
        return next(iter(self.__dict__.values())).shape

    @cached_property
    def beyond(self) -> Mask | None:
        """Where |β| exceeds π/2: the facet faces away, and D is 0. None for nowhere."""
        if "beta" not in self.__dict__:
            return None
        horizon = _HORIZON_SQUARE[self.beta.dtype]
        # Of NaN it is not known.
        return None if self._largest <= horizon else self.beta_square > horizon

    @cached_property
    def _largest(self) -> Any:
        """Return the largest β², a number."""
        return self.beta_square.max(initial=0)

    @cached_property
    def beta(self) -> Array:
        """Return β, radians."""
        return np.arctan(self.tangent)

    @cached_property
    def beta_square(self) -> Array:
        """Return β²."""
        return np.square(self.beta)

    @cached_property
    def tangent(self) -> Array:
        """Return |tan β|."""
        return np.sqrt(self.tangent_square)

    @cached_property
    def tangent_square(self) -> Array:
        """Return tan²β, which has all digits at 0 and at π/2."""
        if "tangent" in self.__dict__:
            return np.square(self.tangent)
        return elementary.tangent_square(self.beta, self.beta_square)

    @cached_property
    def sine_square(self) -> Array:
        """Return sin²β."""
        if "beta" in self.__dict__:
            return elementary.sine_square(self.beta_square)
        return self.tangent_square / (1 + self.tangent_square)

    @cached_property
    def versine(self) -> Array:
        """Return 1 − cos β."""
        if "beta" in self.__dict__:
            return elementary.versine(self.beta_square)
        square = 1 + self.tangent_square
        return self.tangent_square / (square + np.sqrt(square))

    @cached_property
    def cosine(self) -> Array:
        """Return |cos β|, which has all digits at π/2."""
        if "beta" in self.__dict__:
            return self._cosine_and_near[0]
        return 1 / np.sqrt(1 + self.tangent_square)

    @cached_property
    def _cosine_and_near(self) -> tuple[Array, Mask | None]:
        if self._largest <= _FAR_SQUARE:
            return 1 - self.versine, None
        return elementary.cosine(self.beta, self.versine)

    @cached_property
    def cosine_square(self) -> Array:
        """Return cos²β."""
        if "beta" in self.__dict__:
            return np.square(self.cosine)
        return 1 / (1 + self.tangent_square)

    @cached_property
    def log_secant(self) -> Array:
        """Return −ln cos β, which has all digits at 0 and at π/2."""
        if "beta" in self.__dict__:
            cosine, near = self._cosine_and_near
            return elementary.minus_log_of_difference(cosine, self.versine, near)
        return 0.5 * elementary.log1p(self.tangent_square)


def _bounded(square: Array) -> Array:
    """Return tan²β, of angles nearly π/2 that of one with which kernels can compute."""
    return np.minimum(square, _LARGEST_SQUARE[square.dtype])


# What angles may be given as.
VARIABLES: Mapping[str, Callable[[Array], Angles]] = {
    "angle": Angles,
    "cosine": Angles.of_cosine,
    "slope": Angles.of_slope,
}
