"""What a texture holds, and what it is to hold."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from mdfconv.distributions import distribution
from mdfconv.distributions.dialects import dialects_of
from mdfconv.distributions.endpoint import Endpoint, endpoint, endpoints
from mdfconv.distributions.evaluation import Array
from mdfconv.distributions.parameter import Encoding, Parameter
from mdfconv.errors import MdfconvError
from mdfconv.registry import unknown_name

# MTL's shininess runs to 1000; 2^13 is the scale of Lazarov 2013.
EXPONENT_MAX = 1000.0
LOG2_SCALE = 13.0
_LARGEST_SCALE = 1000.0  # 2^1000 is still a double


@dataclass(frozen=True)
class TextureRule:
    """How the texels of a roughness texture are converted.

    A texel is a number v from 0 to 1, in an integer texture its share of the largest integer.

    Parameters
    ----------
    source, target : str or Endpoint
        Distribution and encoding. ``"ggx"`` and ``"ggx:alpha"`` store α itself,
        ``"ggx:roughness"`` r with α = r², ``"ggx:glossiness"`` g with α = (1−g)², and likewise
        for Beckmann; other distributions of a roughness store their parameter as it is.
        Parameters that scenes use beyond 1, as exponents, need an encoding:
        ``"blinn-phong:exponent"`` stores N / `exponent_max`, ``"blinn-phong:log2"`` v with
        N = 2^(k v).
    method : str, optional
        As for `mdfconv.convert`: the fit under the metric if not given, as textures use the
        whole range, on which the closed forms turn around or turn negative.
    metric : str
        What the fit keeps, as for `mdfconv.convert`; the light of a natural environment by
        default.
    exponent_max : float
        N of a texel at 1 under ``exponent``; above 0. 1000 is the end of MTL's range.
    log2_scale : float
        k of ``log2``, above 0 and at most 1000; 13, for N from 1 to 8192, is Lazarov's,
        Getting More Physical in Call of Duty: Black Ops II (SIGGRAPH 2013).
    gamma : float, optional
        The second parameter, for source and target that have one; its default if not given.
    """

    source: str | Endpoint
    target: str | Endpoint
    method: str | None = None
    metric: str = "environment"
    exponent_max: float = EXPONENT_MAX
    log2_scale: float = LOG2_SCALE
    gamma: float | None = None

    def endpoints(self) -> tuple[Endpoint, Endpoint]:
        """Return source and target, as `mdfconv.convert` takes them.

        Raises
        ------
        MdfconvError
            If a name is not known or does not say how a texture stores the parameter, if
            `exponent_max`, `log2_scale` or γ is out of its range, or if γ is none of either's.
        """
        if not 0 < self.exponent_max < np.inf:
            raise MdfconvError(f"the largest exponent is above 0, not {self.exponent_max:g}")
        if not 0 < self.log2_scale <= _LARGEST_SCALE:
            raise MdfconvError(
                f"the scale of log2 is above 0 and at most {_LARGEST_SCALE:g}, "
                f"not {self.log2_scale:g}"
            )
        return endpoints(self._endpoint(self.source), self._endpoint(self.target), self.gamma)

    def _endpoint(self, name: str | Endpoint) -> Endpoint:
        if not isinstance(name, str):
            return endpoint(name)  # which says what a name is
        head, colon, tail = name.partition(":")
        owner = distribution(head)
        # What a texture stores is at most 1.
        if owner.parameter.typical[1] <= 1:
            return endpoint(name)
        known = {encoding.name: encoding for encoding in self._encodings(owner.parameter)}
        if not colon:
            choices = " or ".join(f"{owner.name}:{encoding}" for encoding in known)
            raise MdfconvError(f"a texture of {owner.name} needs an encoding", choices)
        key = tail.strip().lower()
        if key in known:
            return Endpoint(owner, known[key])
        dialects = list(dialects_of(owner.name))
        if key.partition(":")[0] in dialects:
            return endpoint(name)
        raise unknown_name(f"encoding of {owner.name} in a texture", tail, [*known, *dialects])

    def _encodings(self, parameter: Parameter) -> tuple[Encoding, Encoding]:
        """Return how a texture stores a parameter that scenes use beyond 1."""
        largest, scale, symbol = self.exponent_max, self.log2_scale, parameter.symbol
        # The roughest and the smoothest that fit: N from 1 up.
        linear = Parameter(
            "exponent",
            "v",
            (min(1 / largest, 1.0), 1.0),
            0.0,
            1.0,
            upper_closed=True,
            larger_is_smoother=parameter.larger_is_smoother,
        )
        logarithmic = replace(linear, name="log2", typical=(0.0, 1.0), lower_closed=True)
        return (
            Encoding(
                "exponent",
                linear,
                lambda stored: stored * largest,
                lambda exponent: exponent / largest,
                f"{symbol} = {largest:g} v",
            ),
            Encoding(
                "log2",
                logarithmic,
                lambda stored: np.exp2(scale * stored),
                lambda exponent: _log2(exponent) / scale,
                f"{symbol} = 2^({scale:g} v)",
            ),
        )


def _log2(exponent: Array) -> Array:
    # N = 0, a uniform lobe, is −∞: below every texel.
    with np.errstate(divide="ignore"):
        logarithm: Array = np.log2(exponent)
    return logarithm
