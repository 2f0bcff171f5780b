"""From the numbers that a texture stores to those that it is to store, all of them answered."""

from __future__ import annotations

from enum import IntEnum
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from mdfconv.conversion.checks import check_covered
from mdfconv.conversion.endpoint import Endpoint, same_family
from mdfconv.conversion.registry import find_method
from mdfconv.distributions.evaluation import Array
from mdfconv.errors import MdfconvError
from mdfconv.fitting.metrics import metric as find_metric
from mdfconv.scene.texture_rule import TextureRule

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
    roughest values. Where the method has no answer, a surface rougher than it reaches takes the
    roughest answer that it has, one that is smoother is a mirror. Results are clamped to 0..1.
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
        self._method = find_method(rule.method)
        self._metric = find_metric(rule.metric, rule.exposure)
        self._same = same_family(self._source.distribution, self._target.distribution)
        if not self._same:
            check_covered(self._method, self._metric, self._source, self._target)
        self._smooth = _smooth_end(self._source), _smooth_end(self._target)

    @property
    def labels(self) -> tuple[str, str]:
        """Names of source and target, such as ``"ggx:roughness"``."""
        return self._source.label, self._target.label

    def __call__(self, stored: Array) -> tuple[Array, NDArray[np.uint8]]:
        """Convert stored values (float64, any shape).

        Returns
        -------
        values : numpy.ndarray
            Stored values of the target, from 0 to 1, or NaN.
        outcomes : numpy.ndarray of uint8
            What became of each, as `Outcome`.
        """
        given = np.clip(stored, 0, 1)
        result, legal = self._answers(given)
        answered = ~np.isnan(result)
        value = np.clip(result, 0, 1)
        outcome = np.full(given.shape, Outcome.ANSWERED, np.uint8)
        with np.errstate(invalid="ignore"):
            outcome[np.abs(result - value) > _ROUNDING] = Outcome.CLAMPED
        if not answered.all():
            smooth = (given < 0.5) == (self._smooth[0] == 0)
            ends = np.where(smooth, self._smooth[1], 1 - self._smooth[1])
            value = np.where(legal, value, ends)
            outcome[~legal] = np.where(smooth, Outcome.MIRROR, Outcome.UNIFORM)[~legal]
            missing = legal & ~answered
            if missing.any():
                value[missing] = self._nearest(given[missing])
                outcome[missing] = Outcome.UNANSWERED
        nan = np.isnan(stored)
        value[nan] = np.nan
        outcome[given != stored] = Outcome.OUTSIDE
        outcome[nan] = Outcome.NAN
        return value, outcome

    def _answers(self, given: Array) -> tuple[Array, NDArray[np.bool_]]:
        """Return the encoded answers, NaN where there is none, and which values are legal."""
        parameter = self._source.decode_legal(given)
        legal = ~np.isnan(parameter)
        kept = result = parameter[legal]
        pair = self._source.distribution, self._target.distribution
        with np.errstate(all="ignore"):
            if not self._same:
                result = np.asarray(self._method.convert(kept, *pair, self._metric))
                result = np.where(pair[1].parameter.accepts(result), result, np.nan)
            if self._target.encoding:
                result = self._target.encoding.encode(result)
        answers = np.full(given.shape, np.nan)
        answers[legal] = result
        return answers, legal

    def _nearest(self, given: Array) -> Array:
        """Return what legal values without an answer become."""
        roughest, answer = self._roughest
        rougher = self._roughness(given) > self._roughness(roughest)
        nearest: Array = np.where(rougher, answer, self._smooth[1])
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
        place = int(np.argmax(self._roughness(grid)))
        return grid[place], float(np.clip(answers[place], 0, 1))

    def _roughness(self, given: Array) -> Array:
        return given if self._smooth[0] == 0 else 1 - given


def _smooth_end(side: Endpoint) -> float:
    """Return which of 0 and 1 stands for the smoother surface."""
    first, last = side.distribution.peak_alpha(side.decode([0.25, 0.75]))
    return 0.0 if first < last else 1.0
