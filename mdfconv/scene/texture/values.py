"""From the numbers that a texture stores to those that it is to store, all of them answered."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from mdfconv.conversion.methods import method_named
from mdfconv.distributions.evaluation import Array
from mdfconv.errors import MdfconvError
from mdfconv.fitting.metrics import metric_named
from mdfconv.scene.stored import Outcome, StoredConverter
from mdfconv.scene.texture.rule import TextureRule

# Source values among which the roughest with an answer is looked for: those of sixteen bits.
_GRID = 65536
# Beyond 0..1 by less is rounding; a sixteen-bit texel is 1.5e-5.
_ROUNDING = 1e-9


class ValueConverter:
    """A rule as a function of stored values, which has an answer for every number.

    A value outside 0..1 is clamped into it first. The ends that are no legal parameter, the
    perfect mirror (α = 0) and the uniform lobe (N = 0), become the target's smoothest and
    roughest values. Where the method has no answer, a surface rougher than any that has one takes
    the answer of the roughest, one that is smoother is a mirror. Results are clamped to 0..1.
    NaN stays NaN.

    Raises
    ------
    MdfconvError
        If a name is unknown, or the method does not cover the pair or the metric.
    """

    def __init__(self, rule: TextureRule) -> None:
        method = None if rule.method is None else method_named(rule.method)
        ends = rule.endpoints()
        # Texels are exact down to the smallest exponent.
        self._convert = StoredConverter(
            *ends, metric_named(rule.metric), method, uniform_below=np.finfo(float).tiny
        )
        self.labels = ends[0].label, ends[1].label
        self.keeps = self._convert.keeps

    def __call__(self, stored: Array) -> tuple[Array, NDArray[np.uint8]]:
        """Return stored values of the target, from 0 to 1 or NaN, and what became of each.

        `Outcome.BEYOND` is what was clamped to 0..1.
        """
        clipped = np.clip(stored, 0, 1)
        parameter, result, outcome = self._convert(clipped)
        value = np.clip(result, 0, 1)
        outcome[outcome == Outcome.BEYOND] = Outcome.CONVERTED
        with np.errstate(invalid="ignore"):
            outcome[np.abs(result - value) > _ROUNDING] = Outcome.BEYOND
        if outcome.any():
            self._answer_all(clipped, np.isnan(parameter), value, outcome)
        outcome[clipped != stored] = Outcome.OUTSIDE
        nan = np.isnan(stored)
        value[nan] = np.nan
        outcome[nan] = Outcome.NAN
        return value, outcome

    def _answer_all(
        self, stored: Array, illegal: Array, value: Array, outcome: NDArray[np.uint8]
    ) -> None:
        """Set what has no answer to the nearest there is."""
        smoothest = self._convert.smoothest_result
        if illegal.any():
            with np.errstate(invalid="ignore"):
                smooth = self._roughness(stored[illegal]) < self._middle
            value[illegal] = np.where(smooth, smoothest, 1 - smoothest)
            outcome[illegal] = np.where(smooth, Outcome.MIRROR, Outcome.UNIFORM)
        missing = outcome == Outcome.UNANSWERED
        if missing.any():
            roughest, result = self._roughest
            rougher = self._roughness(stored[missing]) > self._roughness(roughest)
            value[missing] = np.where(rougher, result, smoothest)

    @cached_property
    def _roughest(self) -> tuple[Array, float]:
        """The roughest of 65536 source values for which there is an answer, and that answer."""
        grid = np.linspace(0, 1, _GRID)
        parameter, result, _ = self._convert(grid)
        answered = ~np.isnan(parameter) & ~np.isnan(result)
        if not answered.any():
            raise MdfconvError(
                f"{self._convert.method.name} has no answer for any texel from {self.labels[0]} "
                f"to {self.labels[1]}"
            )
        grid, result = grid[answered], result[answered]
        index = int(np.argmax(self._roughness(grid)))
        return grid[index], float(np.clip(result[index], 0, 1))

    @cached_property
    def _middle(self) -> float:
        """A roughness in the middle of those that the source takes."""
        grid = np.linspace(0, 1, _GRID)
        rough = self._roughness(grid[~np.isnan(self._convert.source.decode_legal(grid))])
        return 0.5 * float(rough.min() + rough.max()) if rough.size else 0.5

    def _roughness(self, stored: Array) -> Array:
        """Return numbers that rise with the roughness."""
        return stored if self._convert.smoothest == 0 else 1 - stored
