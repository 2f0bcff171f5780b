"""What a texture holds and what it is to hold, as a function of every stored value."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from mdfconv.distributions import Distribution, distribution
from mdfconv.distributions.base import same
from mdfconv.distributions.dialects import dialects_of
from mdfconv.distributions.endpoint import Endpoint, endpoint, endpoints, texels_of
from mdfconv.distributions.evaluation import Array, Mask
from mdfconv.distributions.parameter import ROUGHNESS, Encoding, Parameter
from mdfconv.errors import MdfconvError
from mdfconv.fitting.metrics import metric_named
from mdfconv.registry import unknown_name
from mdfconv.scene.stored import Outcome, StoredConverter, StoredResults

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
        Parameters that scenes use beyond 1, as exponents, need an encoding: with A, B for
        `exponent_min` and `exponent_max`, and a, k for `log2_offset` and `log2_scale`,
        ``"blinn-phong:exponent"`` has N = A + (B − A) v, ``"blinn-phong:log2"`` N = 2^(a + k v)
        and ``"blinn-phong:reflected-exponent"`` the exponent n = A + (B − A) v of the reflected
        ray, whose N is that of ``"blinn-phong:reflected"``. The name of a program's rule, such as
        ``"blinn-phong:blender-obj"``, stands for what the program has in textures, which may be
        another form; an `Endpoint` is what the texels are.
    method : str, optional
        As for `mdfconv.convert`: the fit under the metric if not given, as textures use the
        whole range, on which the closed forms turn around or turn negative.
    metric : str
        What the fit keeps, as for `mdfconv.convert`; the light of a natural environment by
        default.
    exponent_max : float
        The exponent of a texel at 1; above 0. 1000 is the end of MTL's range.
    log2_scale : float
        k of ``log2``, above 0 and at most 1000; 13, for N from 1 to 8192, is Lazarov's,
        Getting More Physical in Call of Duty: Black Ops II (SIGGRAPH 2013).
    gamma : float, optional
        The second parameter, for source and target that have one; its default if not given.
    factor : float
        What the program multiplies v by before it is read, as glTF's roughnessFactor: above 0 and
        at most 1.
    exponent_min : float
        The exponent of a texel at 0; from 0 to below `exponent_max`. The Source engine's maps of
        the reflected exponent go from 1 to 150.
    log2_offset : float
        a of ``log2``, from −1000 to 1000, as a + k is. Many shaders have 2^(10 v + 1).
    """

    source: str | Endpoint
    target: str | Endpoint
    method: str | None = None
    metric: str = "environment"
    exponent_max: float = EXPONENT_MAX
    log2_scale: float = LOG2_SCALE
    gamma: float | None = None
    factor: float = 1.0
    exponent_min: float = 0.0
    log2_offset: float = 0.0

    def endpoints(self) -> tuple[Endpoint, Endpoint]:
        """Return source and target, as `mdfconv.convert` takes them.

        Raises
        ------
        MdfconvError
            If a name is not known or does not say how a texture stores the parameter, if an
            end of the exponents, a constant of log2, the factor or γ is out of its range, if γ
            is none of either's, or if it is not known what a program has in textures.
        """
        if not 0 < self.exponent_max < np.inf:
            raise MdfconvError(f"the largest exponent is above 0, not {self.exponent_max:g}")
        if not 0 <= self.exponent_min < self.exponent_max:
            raise MdfconvError(
                f"the smallest exponent is from 0 to below the largest, {self.exponent_max:g}, "
                f"not {self.exponent_min:g}"
            )
        if not 0 < self.log2_scale <= _LARGEST_SCALE:
            raise MdfconvError(
                f"the scale of log2 is above 0 and at most {_LARGEST_SCALE:g}, "
                f"not {self.log2_scale:g}"
            )
        offset = self.log2_offset
        if not max(abs(offset), abs(offset + self.log2_scale)) <= _LARGEST_SCALE:
            raise MdfconvError(
                f"the offset of log2, and with the scale added, is from -{_LARGEST_SCALE:g} to "
                f"{_LARGEST_SCALE:g}, not {offset:g}"
            )
        if not 0 < self.factor <= 1:
            raise MdfconvError(f"a factor is above 0 and at most 1, not {self.factor:g}")
        return endpoints(self._endpoint(self.source), self._endpoint(self.target), self.gamma)

    def _endpoint(self, name: str | Endpoint) -> Endpoint:
        """Return what the texels are, of a program that stores numbers by a rule what it has."""
        if not isinstance(name, str):
            return endpoint(name)  # which says what a name is
        end = self._named(name)
        texels = texels_of(end)
        if not texels:
            raise MdfconvError(
                f"what the texels of {end.label} are is not known: programs copy textures as they "
                "are, or have another rule for them than for numbers",
                "say what they are, such as ggx:glossiness, blinn-phong:exponent or ggx:roughness",
            )
        return end if texels == end.label else self._named(texels)

    def _named(self, name: str) -> Endpoint:
        head, colon, tail = name.partition(":")
        owner = distribution(head)
        known = {encoding.name: encoding for encoding in self.encodings(owner)}
        if not known:
            return endpoint(name)
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

    def encodings(self, owner: Distribution) -> list[Encoding]:
        """Return how a texture stores a parameter that scenes use beyond 1; nothing of others."""
        parameter = owner.parameter
        # What a texture stores is at most 1.
        if parameter.typical[1] <= 1:
            return []
        # The parameter in another form, such as the exponent of the reflected ray.
        others = [
            self._between(form.stored, f"{form.name}-exponent", form) for form in owner.encodings
        ]
        return [self._between(parameter, "exponent"), self._logarithmic(parameter), *others]

    def _between(self, exponent: Parameter, name: str, form: Encoding | None = None) -> Encoding:
        """Return the encoding whose texels are shares of the way between two exponents.

        They are those of a parameter, or of a form of it.
        """
        low, high = self.exponent_min, self.exponent_max
        width = high - low
        # The roughest and the smoothest that fit: from 1 up.
        stored = replace(
            ROUGHNESS.stored,
            symbol="v",
            name="exponent",
            typical=(min(max(1 - low, 0) / width, 1.0), 1.0),
            lower_closed=low > exponent.lower or exponent.lower_closed,
            larger_is_smoother=exponent.larger_is_smoother,
        )
        decode, encode = (form.decode, form.encode) if form else (same, same)
        line = f"{exponent.symbol} = {f'{low:g} + ' if low else ''}{width:g} v"
        return Encoding(
            name,
            stored,
            lambda v: decode(low + width * v),
            lambda parameter: (encode(parameter) - low) / width,
            f"{line}, {form.formula}" if form else line,
        )

    def _logarithmic(self, parameter: Parameter) -> Encoding:
        """Return the encoding whose texels rise with the logarithm of the exponent."""
        scale, offset = self.log2_scale, self.log2_offset
        stored = replace(
            ROUGHNESS.stored,
            symbol="v",
            name="log2",
            typical=(0.0, 1.0),
            lower_closed=True,
            larger_is_smoother=parameter.larger_is_smoother,
        )
        start = f"{offset:g} + " if offset else ""
        return Encoding(
            "log2",
            stored,
            lambda v: np.exp2(offset + scale * v),
            lambda exponent: (_log2(exponent) - offset) / scale,
            f"{parameter.symbol} = 2^({start}{scale:g} v)",
        )


def _log2(exponent: Array) -> Array:
    # N = 0, a uniform lobe, is −∞: below every texel.
    with np.errstate(divide="ignore"):
        logarithm: Array = np.log2(exponent)
    return logarithm


# Texels among which the roughest with a result is looked for: those of sixteen bits.
_GRID = 65536
# Texels of which the legal ones are looked at, one half among them.
_EIGHT_BIT_GRID, _HALF = 257, 0.5
# Beyond 0..1 by less is rounding; a sixteen-bit texel is 1.5e-5.
_ROUNDING = 1e-9


class ValueConverter:
    """A rule as a function of stored values, which has an answer for every number.

    A value outside 0..1 is clamped into it first. The ends that are no legal parameter, the
    perfect mirror (α = 0) and the uniform lobe (N = 0), become the target's smoothest and
    roughest values. Where the method has no answer, a surface rougher than any that has one takes
    the answer of the roughest, one that is smoother is a mirror. Results are clamped to 0..1.
    NaN stays NaN.
    """

    def __init__(self, rule: TextureRule) -> None:
        source, target = rule.endpoints()
        metric = metric_named(rule.metric)
        # Texels are exact down to the smallest exponent.
        tiny = np.finfo(float).tiny
        self._convert = StoredConverter(source, target, metric, rule.method, uniform_below=tiny)
        self._factor = rule.factor
        scale = f"{' of' if source.encoding else ':'} {rule.factor:g} v" if rule.factor != 1 else ""
        self.labels = source.label + scale, target.label
        self.keeps = self._convert.keeps

    def __call__(self, texels: Array) -> tuple[Array, NDArray[np.uint8]]:
        """Return stored values of the target, from 0 to 1 or NaN, and what became of each.

        `Outcome.BEYOND` is what was clamped to 0..1.
        """
        clipped = np.clip(texels, 0, 1)
        parameter, result, outcome = self._converted(clipped)
        value = np.clip(result, 0, 1)
        outcome[outcome == Outcome.BEYOND] = Outcome.CONVERTED
        with np.errstate(invalid="ignore"):
            outcome[np.abs(result - value) > _ROUNDING] = Outcome.BEYOND
        if outcome.any():
            self._complete(clipped, np.isnan(parameter), value, outcome)
        outcome[clipped != texels] = Outcome.OUTSIDE
        nan = np.isnan(texels)
        value[nan] = np.nan
        outcome[nan] = Outcome.NAN
        return value, outcome

    def _converted(self, texels: Array) -> StoredResults:
        return self._convert(texels if self._factor == 1 else texels * self._factor)

    def _complete(
        self, texels: Array, illegal: Mask, value: Array, outcome: NDArray[np.uint8]
    ) -> None:
        """Give what has no result the nearest there is."""
        smoothest = self._convert.smoothest_result
        if illegal.any():
            with np.errstate(invalid="ignore"):
                smooth = self._roughness(texels[illegal]) < self._middle
            value[illegal] = np.where(smooth, smoothest, 1 - smoothest)
            outcome[illegal] = np.where(smooth, Outcome.MIRROR, Outcome.UNIFORM)
        missing = outcome == Outcome.UNANSWERED
        if missing.any():
            roughest, result = self._roughest
            rougher = self._roughness(texels[missing]) > self._roughness(roughest)
            value[missing] = np.where(rougher, result, smoothest)

    @cached_property
    def _roughest(self) -> tuple[Array, float]:
        """The roughest of 65536 texels for which there is a result, and that result."""
        texels = np.linspace(0, 1, _GRID)
        parameter, result, _ = self._converted(texels)
        converted = ~np.isnan(parameter) & ~np.isnan(result)
        if not converted.any():
            raise MdfconvError(
                f"{self._convert.method.name} has no answer for any texel from {self.labels[0]} "
                f"to {self.labels[1]}"
            )
        texels, result = texels[converted], result[converted]
        index = int(np.argmax(self._roughness(texels)))
        return texels[index], float(np.clip(result[index], 0, 1))

    @cached_property
    def _middle(self) -> float:
        """A roughness in the middle of those that the source takes."""
        rough = self._roughness(self._legal(_GRID))
        return 0.5 * float(rough.min() + rough.max()) if rough.size else 0.5

    def takes_ends(self) -> bool:
        """Return whether illegal texels are at the end for which a texel below or above ½ is."""
        legal = self._legal(_EIGHT_BIT_GRID)
        return legal.size > 0 and bool(legal[0] <= _HALF <= legal[-1])

    def _legal(self, size: int) -> Array:
        """Return those of so many texels from 0 to 1 that the source takes."""
        texels = np.linspace(0, 1, size)
        return texels[~np.isnan(self._convert.source.decode_legal(texels * self._factor))]

    def _roughness(self, texels: Array) -> Array:
        """Return numbers that rise with the roughness."""
        return texels if self._convert.smoothest == 0 else 1 - texels
