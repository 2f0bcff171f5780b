"""What a texture holds, and what it is to hold."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mdfconv.conversion.endpoint import Endpoint, endpoint
from mdfconv.distributions import Distribution, distribution
from mdfconv.distributions.evaluation import Array
from mdfconv.distributions.parameter import Encoding, Parameter
from mdfconv.errors import MdfconvError, check_name, unknown_name

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
    source, target : str
        Distribution and encoding. ``"ggx"`` and ``"ggx:alpha"`` store α itself,
        ``"ggx:roughness"`` r with α = r², ``"ggx:glossiness"`` g with α = (1−g)², and likewise
        for Beckmann; other distributions of a roughness store their parameter as it is.
        Exponents need an encoding: ``"blinn-phong:exponent"`` stores N / `exponent_max`,
        ``"blinn-phong:log2"`` v with N = 2^(k v).
    method : str
        As for `mdfconv.convert`. The default is ``"fast"``: textures use the whole range, on
        which the closed forms turn around or turn negative, and it is the fit in milliseconds.
    metric : str
        What the fit keeps: ``"unit"``, ``"energy"`` or ``"display"``.
    exposure : float
        Exposure of the display metric.
    exponent_max : float
        N of a texel at 1 under ``exponent``; above 0. 1000 is the end of MTL's range.
    log2_scale : float
        k of ``log2``, above 0 and at most 1000; 13, for N from 1 to 8192, is Lazarov's,
        Getting More Physical in Call of Duty: Black Ops II (SIGGRAPH 2013).
    """

    source: str
    target: str
    method: str = "fast"
    metric: str = "unit"
    exposure: float = 1.0
    exponent_max: float = EXPONENT_MAX
    log2_scale: float = LOG2_SCALE

    def endpoints(self) -> tuple[Endpoint, Endpoint]:
        """Return source and target, as `mdfconv.convert` takes them.

        Raises
        ------
        MdfconvError
            If a name is not known or does not say how a texture stores the parameter, or if
            `exponent_max` or `log2_scale` is out of its range.
        """
        if not 0 < self.exponent_max < np.inf:
            raise MdfconvError(f"the largest exponent is above 0, not {self.exponent_max:g}")
        if not 0 < self.log2_scale <= _LARGEST_SCALE:
            raise MdfconvError(
                f"the scale of log2 is above 0 and at most {_LARGEST_SCALE:g}, "
                f"not {self.log2_scale:g}"
            )
        return self._endpoint(self.source), self._endpoint(self.target)

    def _endpoint(self, name: str) -> Endpoint:
        head, colon, tail = check_name("distribution", name).partition(":")
        found = distribution(head)
        if not _has_exponent(found):
            return endpoint(name)
        known = {entry.name: entry for entry in self._exponent_encodings()}
        if not colon:
            choices = " or ".join(f"{found.name}:{encoding}" for encoding in known)
            raise MdfconvError(f"a texture of {found.name} needs an encoding: {choices}")
        key = tail.strip().lower()
        if key not in known:
            raise unknown_name(f"encoding of {found.name} in a texture", tail, list(known))
        return Endpoint(found, known[key])

    def _exponent_encodings(self) -> tuple[Encoding, Encoding]:
        largest, scale = self.exponent_max, self.log2_scale
        return (
            Encoding(
                "exponent",
                Parameter("exponent", "v", 0.0, 1.0, upper_closed=True),
                lambda stored: stored * largest,
                lambda exponent: exponent / largest,
                f"N = {largest:g} v",
            ),
            Encoding(
                "log2",
                Parameter("log2", "v", 0.0, 1.0, lower_closed=True, upper_closed=True),
                lambda stored: np.exp2(scale * stored),
                lambda exponent: _log2(exponent) / scale,
                f"N = 2^({scale:g} v)",
            ),
        )


def _has_exponent(entry: Distribution) -> bool:
    return entry.parameter.name in ("exponent", "exponents")


def _log2(exponent: Array) -> Array:
    # N = 0, a uniform lobe, is −∞: below every texel.
    with np.errstate(divide="ignore"):
        logarithm: Array = np.log2(exponent)
    return logarithm
