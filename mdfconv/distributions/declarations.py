"""What a distribution declares about itself beyond its kernels."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from mdfconv.distributions.evaluation import Array


def _identity(parameter: Array) -> Array:
    return parameter


@dataclass(frozen=True)
class Equivalent:
    """Another distribution, in whose parameter this one can be expressed.

    Parameters
    ----------
    name : str
        The other distribution.
    same_lobe : bool
        Whether the two are the same function of β. If not, the sources only let one number
        stand for both, as Schlick's and Beckmann's m.
    forward, backward : callable
        This parameter to the other's, and back; elementwise on arrays.
    forward_text, backward_text : str
        The relations in words; "" where there is nothing to say.
    """

    name: str
    same_lobe: bool = True
    forward: Callable[[Array], Array] = _identity
    backward: Callable[[Array], Array] = _identity
    forward_text: str = ""
    backward_text: str = ""

    @property
    def same_parameter(self) -> bool:
        """Whether the two parameters are the same number."""
        return self.forward is _identity


@dataclass(frozen=True)
class MapVariables:
    """The variables in which the stored maps of a conversion are smooth functions.

    Parameters
    ----------
    width : callable
        x for a parameter: the roughness of a smooth surface, at most 1.
    from_width : callable
        The parameter for x.
    concentration : callable
        κ for a parameter: 1/x² for a smooth surface, 0 for a uniform lobe.
    from_map : callable
        The parameter for x of the source and the product x² κ.
    """

    width: Callable[[Array], Array]
    from_width: Callable[[Array], Array]
    concentration: Callable[[Array], Array]
    from_map: Callable[[Array, Array], Array]


@dataclass(frozen=True)
class Printed:
    """The expressions as their sources print them, written as one would in NumPy.

    They lose digits to cancellation and overflow: that is what the audit and the benchmark hold
    the kernels against. Every function takes the parameter, and γ after it if there is one, and
    computes in the type of its arguments.

    Parameters
    ----------
    unit : callable
        D̄ of (β, parameter).
    at_normal : callable
        D(0) of the normalized form.
    cosine : callable, optional
        cos β_half.
    from_cosine : callable, optional
        The parameter for cos β_half.
    peak_alpha : callable, optional
        The α for which D(0) = 1/(π α²).
    from_peak_alpha : callable, optional
        The parameter for that α.
    """

    unit: Callable[..., Any]
    at_normal: Callable[..., Any]
    cosine: Callable[..., Any] | None = None
    from_cosine: Callable[..., Any] | None = None
    peak_alpha: Callable[..., Any] | None = None
    from_peak_alpha: Callable[..., Any] | None = None


def same(parameter: Any, *gamma: Any) -> Any:
    """Return the parameter: the printed relation of those for which D(0) = 1/(π α²)."""
    return parameter


def inverse_square_over_pi(parameter: Any, *gamma: Any) -> Any:
    """Return 1/(π α²) as printed."""
    return 1 / (np.pi * parameter**2)
