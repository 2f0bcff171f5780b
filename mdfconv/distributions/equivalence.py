"""Conversions between distributions that are one function in two parameters."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from mdfconv.distributions import Distribution, distribution
from mdfconv.distributions.evaluation import Array

Function: TypeAlias = Callable[[Array], Array]


@dataclass(frozen=True)
class ParameterMap:
    """A formula from one distribution's parameter to another's.

    Parameters
    ----------
    text : str
        The formula as printed, with its place in the source; "" where there is nothing to say.
    function : callable
        Elementwise on arrays.
    turns_at : float
        Where the formula stops being monotonic, if it does.
    """

    text: str
    function: Function
    turns_at: float = float("inf")


def to_root(mdf: Distribution, *, same_lobe: bool) -> tuple[Distribution, Sequence[ParameterMap]]:
    """Return the distribution in whose parameter another one can be expressed, and how.

    Parameters
    ----------
    mdf : Distribution
        The other one; it is its own root unless it declares an equivalent.
    same_lobe : bool
        Whether the two must be the same function of β.

    Returns
    -------
    root : Distribution
    steps : sequence of Formula
        From the parameter of the other one to that of the root.
    """
    equal = mdf.equivalent
    if equal is None or (same_lobe and not equal.same_lobe):
        return mdf, ()
    return distribution(equal.name), (ParameterMap(equal.forward_text, equal.forward),)


def from_root(mdf: Distribution, *, same_lobe: bool) -> Sequence[ParameterMap]:
    """Return the steps from the root's parameter back, as for `to_root`."""
    equal = mdf.equivalent
    if equal is None or (same_lobe and not equal.same_lobe):
        return ()
    return (ParameterMap(equal.backward_text, equal.backward),)


def exact_route(source: Distribution, target: Distribution) -> Sequence[ParameterMap] | None:
    """Return the steps between two distributions that have the same lobes; None for others."""
    if source.is_same(target):
        return ()
    first, forward = to_root(source, same_lobe=True)
    last, _ = to_root(target, same_lobe=True)
    if not first.is_same(last):
        return None
    return (*forward, *from_root(target, same_lobe=True))


def follow(steps: Sequence[ParameterMap], parameter: Array) -> Array:
    """Return what the steps make of parameters, one after the other; infinite at an end of both."""
    with np.errstate(all="ignore"):
        for step in steps:
            parameter = step.function(parameter)
    return parameter
