"""From the numbers that a texture stores to those that it is to store, all of them answered."""

from __future__ import annotations

from enum import IntEnum
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from mdfconv.conversion.methods import check_covered, default_method, method_named
from mdfconv.distributions.endpoint import exact_route, follow
from mdfconv.distributions.evaluation import Array
from mdfconv.errors import MdfconvError
from mdfconv.fitting.metrics import metric_named
from mdfconv.scene.texture.rule import TextureRule

# Source values among which the roughest with an answer is looked for: those of sixteen bits.
_GRID = 65536
# Beyond 0..1 by less is rounding; a sixteen-bit texel is 1.5e-5.
_ROUNDING = 1e-9


class Outcome(IntEnum):
    """What became of a texel."""

    ANSWERED = 0
    MIRROR = 1
    UNIFORM = 2
    UNANSWERED = 3
    CLAMPED = 4
    OUTSIDE = 5
    NAN = 6


class ValueConverter:
    """A rule as a function of stored values, which has an answer for every number.

    A value outside 0..1 is clamped into it first. The ends that are no legal parameter, the
    perfect mirror (α = 0) and the uniform lobe (N = 0), become the target's smoothest and
    roughest values. Where the method has no answer, a surface rougher than any that has one takes
    the answer of the roughest, one that is smoother is a mirror. Results are clamped to 0..1.
    NaN stays NaN.

    Parameters
    ----------
    rule : TextureRule
        What to convert, and how.

    Raises
    ------
    MdfconvError
        If a name is unknown, or the method does not cover the pair or the metric.
    """

    def __init__(self, rule: TextureRule) -> None:
        self._source, self._target = rule.endpoints()
        self._metric = metric_named(rule.metric)
        pair = self._source.distribution, self._target.distribution
        self._method = default_method(*pair) if rule.method is None else method_named(rule.method)
        self._exact = exact_route(*pair)
        if self._exact is None:
            check_covered(self._method, self._metric, self._source, self._target)
        # Which of 0 and 1 stands for the smoothest surface.
        self._smoothest, self._smoothest_answer = (
            float(end.stored.larger_is_smoother) for end in (self._source, self._target)
        )

    @property
    def labels(self) -> tuple[str, str]:
        """Names of source and target, such as ``"ggx:roughness"``."""
        return self._source.label, self._target.label

    @property
    def keeps(self) -> str:
        """What the conversion keeps, in words; "" if the two are the same lobes."""
        return self._method.keeps(self._metric) if self._exact is None else ""

    def __call__(self, stored: Array) -> tuple[Array, NDArray[np.uint8]]:
        """Convert stored values (float64, any shape).

        Returns
        -------
        values : numpy.ndarray
            Stored values of the target, from 0 to 1, or NaN.
        outcomes : numpy.ndarray of uint8
            What became of each, as `Outcome`.
        """
        clipped = np.clip(stored, 0, 1)
        result, legal = self._answers(clipped)
        answered = ~np.isnan(result)
        value = np.clip(result, 0, 1)
        outcome = np.full(clipped.shape, Outcome.ANSWERED, np.uint8)
        with np.errstate(invalid="ignore"):
            outcome[np.abs(result - value) > _ROUNDING] = Outcome.CLAMPED
        if not answered.all():
            with np.errstate(invalid="ignore"):
                smooth = self._roughness(clipped) < self._middle
            ends = np.where(smooth, self._smoothest_answer, 1 - self._smoothest_answer)
            value = np.where(legal, value, ends)
            outcome[~legal] = np.where(smooth, Outcome.MIRROR, Outcome.UNIFORM)[~legal]
            missing = legal & ~answered
            if missing.any():
                value[missing] = self._nearest(clipped[missing])
                outcome[missing] = Outcome.UNANSWERED
        nan = np.isnan(stored)
        value[nan] = np.nan
        outcome[clipped != stored] = Outcome.OUTSIDE
        outcome[nan] = Outcome.NAN
        return value, outcome

    def _answers(self, stored: Array) -> tuple[Array, NDArray[np.bool_]]:
        """Return the encoded answers, NaN where there is none, and which values are legal."""
        parameter = self._source.decode_legal(stored)
        legal = ~np.isnan(parameter)
        pair = self._source.distribution, self._target.distribution
        with np.errstate(all="ignore"):
            if self._exact is None:
                result = np.asarray(self._method.convert(parameter[legal], *pair, self._metric))
            else:
                result = follow(self._exact, parameter[legal])
            result = np.where(pair[1].parameter.accepts(result), result, np.nan)
            # Not `Endpoint.encode`: what cannot be stored is to be clamped.
            if self._target.encoding:
                result = self._target.encoding.encode(result)
        answers = np.full(stored.shape, np.nan)
        answers[legal] = result
        return answers, legal

    def _nearest(self, stored: Array) -> Array:
        """Return what legal values without an answer become."""
        roughest, answer = self._roughest
        rougher = self._roughness(stored) > self._roughness(roughest)
        nearest: Array = np.where(rougher, answer, self._smoothest_answer)
        return nearest

    @cached_property
    def _roughest(self) -> tuple[Array, float]:
        """The roughest of 65536 source values for which there is an answer, and that answer."""
        grid = np.linspace(0, 1, _GRID)
        answers, _ = self._answers(grid)
        answered = ~np.isnan(answers)
        if not answered.any():
            raise MdfconvError(
                f"{self._method.name} has no answer for any texel from {self._source.label} "
                f"to {self._target.label}"
            )
        grid, answers = grid[answered], answers[answered]
        index = int(np.argmax(self._roughness(grid)))
        return grid[index], float(np.clip(answers[index], 0, 1))

    @cached_property
    def _middle(self) -> float:
        """A roughness in the middle of those that the source takes."""
        grid = np.linspace(0, 1, _GRID)
        rough = self._roughness(grid[~np.isnan(self._source.decode_legal(grid))])
        return 0.5 * float(rough.min() + rough.max()) if rough.size else 0.5

    def _roughness(self, stored: Array) -> Array:
        """Return numbers that rise with the roughness."""
        return stored if self._smoothest == 0 else 1 - stored
