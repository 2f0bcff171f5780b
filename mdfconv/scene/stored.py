"""Stored numbers converted, each to another or to the reason why not: one rule for all files."""

from __future__ import annotations

from collections.abc import Iterable
from enum import Enum, IntEnum, auto
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mdfconv.conversion.explanation import remaining_error
from mdfconv.conversion.methods import check_covered
from mdfconv.conversion.values import ConversionRule
from mdfconv.distributions.endpoint import Endpoint
from mdfconv.distributions.evaluation import Array, Mask
from mdfconv.distributions.parameter import number_text
from mdfconv.errors import MdfconvError
from mdfconv.fitting.metrics import Metric
from mdfconv.fitting.solve import errors_of_many

# An exponent below this is that of a uniform lobe: the best roughness is 1 − 2e-7.
UNIFORM_BELOW = 1e-6


class Outcome(IntEnum):
    """What became of a stored number."""

    CONVERTED = 0
    # The smoothest number, which is no lobe: it becomes the target's smoothest.
    MIRROR = 1
    # An exponent of 0: it becomes the target's roughest number.
    UNIFORM = 2
    # The method has no legal parameter for it.
    UNANSWERED = 3
    # The target does not store the number that it would become, or that is too large.
    BEYOND = 4
    # It is outside 0..1 in a texture.
    OUTSIDE = 5
    NAN = 6
    # The source does not store it, or it stands for many parameters.
    ILLEGAL = 7


class StoredResults(NamedTuple):
    """Conversions of stored numbers, all in the same shape."""

    # What the source means by each; NaN where it means none.
    parameter: Array
    # What the target stores, or would where the outcome is BEYOND; NaN where there is nothing.
    result: Array
    # As `Outcome`.
    outcome: NDArray[np.uint8]


class ConvertedNumber(NamedTuple):
    """A stored number and its conversion, as `StoredResults`."""

    stored: float
    parameter: float
    result: float
    outcome: Outcome
    # The relative root mean square of `remaining_error`; 0 of a mirror, NaN where there is no
    # result and of a uniform lobe, of which there is no relative error.
    rmse: float


class StoredConverter:
    """A conversion of the numbers that files store.

    The method is the fit if none is given, the metric also that of the errors. Exponents below a
    limit are those of a uniform lobe, as 0 is; results above the largest are `Outcome.BEYOND`.
    """

    def __init__(
        self,
        source: Endpoint,
        target: Endpoint,
        metric: Metric,
        method: str | None = None,
        *,
        uniform_below: float = UNIFORM_BELOW,
        largest: float = np.inf,
    ) -> None:
        self.source, self.target, self.metric = source, target, metric
        self._pair = source.distribution, target.distribution
        self.rule = ConversionRule(source, target, method, metric)
        self.method = self.rule.method
        self._uniform_below, self._largest = uniform_below, largest
        if self.rule.exact is None:
            check_covered(self.method, metric, source, target)
        # Which of 0 and 1 stands for the smoothest surface.
        self.smoothest = float(source.stored.larger_is_smoother)
        self.smoothest_result = float(target.stored.larger_is_smoother)

    @property
    def keeps(self) -> str:
        """What the conversion keeps, in words; "" if the two are the same lobes."""
        return self.method.keeps(self.metric) if self.rule.exact is None else ""

    def __call__(self, stored: Array) -> StoredResults:
        """Convert stored numbers (float64, any shape)."""
        parameter = self.source.decode_legal(stored)
        outcome = np.full(stored.shape, Outcome.CONVERTED, np.uint8)
        result = np.full(stored.shape, np.nan)
        legal = ~np.isnan(parameter)
        result[legal] = self._encoded(parameter[legal])
        outcome[~self._storable(result)] = Outcome.BEYOND
        outcome[np.isnan(result)] = Outcome.UNANSWERED
        if not legal.all():
            outcome[~legal] = self._outcome_of_illegal(stored[~legal])
        if self._pair[0].parameter.larger_is_smoother:
            outcome[legal & (parameter < self._uniform_below)] = Outcome.UNIFORM
        result[outcome == Outcome.MIRROR] = self.smoothest_result
        result[outcome == Outcome.UNIFORM] = 1 - self.smoothest_result
        return StoredResults(parameter, result, outcome)

    def table(self, numbers: Iterable[float]) -> dict[float, ConvertedNumber]:
        """Return the conversions of numbers, which files repeat, with their errors."""
        stored = np.unique(np.fromiter(numbers, np.float64))
        parameter, result, outcome = self(stored)
        rmse = np.where(outcome == Outcome.MIRROR, 0, np.nan)
        converted = outcome == Outcome.CONVERTED
        rmse[converted] = self.errors(stored[converted])
        parameter[outcome == Outcome.UNIFORM] = 0
        columns = stored.tolist(), parameter.tolist(), result.tolist()
        outcomes = map(list(Outcome).__getitem__, outcome.tolist())
        rows = zip(*columns, outcomes, rmse.tolist(), strict=True)
        return {row[0]: ConvertedNumber(*row) for row in rows}

    def errors(self, stored: Array) -> Array:
        """Return the errors that remain of stored numbers, shape (n,); of many to 1e-4."""

        def errors(stored: Array) -> Array:
            parameter, result, outcome = self(stored)
            result[outcome != Outcome.CONVERTED] = np.nan
            return self.remaining(parameter, result)

        return errors_of_many(errors, stored) if stored.min(initial=1) > 0 else errors(stored)

    def remaining(self, parameter: Array, result: Array) -> Array:
        """Return the errors of some results, shape (n,); NaN where either is no lobe."""
        lobes = self.target.decode_legal(result)
        both = ~np.isnan(parameter) & ~np.isnan(lobes)
        rmse = np.full(lobes.shape, np.nan)
        source, target = self._pair
        rmse[both], _ = remaining_error(source, parameter[both], target, lobes[both], self.metric)
        return rmse

    def refusal(self, number: ConvertedNumber) -> str:
        """Return why a number has no conversion, in words."""
        try:
            parameter = self.source.decode([number.stored])
        except MdfconvError as error:
            return str(error)
        if self.target.stored.accepts(np.asarray(number.result)):
            result, limit = number_text(number.result), number_text(self._largest)
            return f"{self.target.label} would be {result}, above {limit}"
        solved = self._parameters(parameter)
        return self.rule.refusal(float(parameter[0]), float(solved[0])).reason

    def _outcome_of_illegal(self, stored: Array) -> NDArray[np.uint8]:
        """Return what becomes of numbers that are no legal parameter."""
        limits, encoding = self.source.stored, self.source.encoding
        decoded, free = stored, np.ones(stored.shape, bool)
        if encoding:
            with np.errstate(all="ignore"):
                decoded = encoding.decode(stored)
            # A number that is clamped is no particular lobe.
            free = ~encoding.clamped(stored)
        outcome = np.where(np.isnan(stored), Outcome.NAN, Outcome.ILLEGAL).astype(np.uint8)
        end = limits.upper if limits.larger_is_smoother else limits.lower
        if end == self.smoothest:
            outcome[free & (stored == end) & ~limits.accepts(stored)] = Outcome.MIRROR
        if self._pair[0].parameter.larger_is_smoother:
            outcome[free & (np.abs(decoded) < self._uniform_below)] = Outcome.UNIFORM
        return outcome

    def _encoded(self, parameter: Array) -> Array:
        """Return what the target would store for parameters, NaN where they have no answer."""
        results = self._parameters(parameter)
        results = np.where(self._pair[1].parameter.accepts(results), results, np.nan)
        if not self.target.encoding:
            return results
        with np.errstate(all="ignore"):
            # Not `Endpoint.encode`: what cannot be stored may be clamped.
            return self.target.encoding.encode(results)

    def _parameters(self, parameter: Array) -> Array:
        """Return what the method makes of legal parameters."""
        with np.errstate(all="ignore"):
            return self.rule.solver.solve(self.rule.task(parameter)).parameter

    def _storable(self, result: Array) -> Mask:
        with np.errstate(invalid="ignore"):
            storable: Mask = self.target.stored.accepts(result)
        if self.target.encoding:
            storable |= self.target.encoding.clamped(result)
        return storable & (result <= self._largest)


class ProblemKind(Enum):
    """Which option helps a material that was left as it is, if one does."""

    # It has a texture, which was not to be converted.
    TEXTURE = auto()
    # Its texture has losses, which were not accepted.
    LOSSY = auto()
    # It has a roughness by its author, which was not to be overwritten.
    AUTHORED = auto()
    # What its texels are is not known.
    TEXELS = auto()
    # The rule depends on a specular weight that is not known.
    SPECULAR = auto()
    OTHER = auto()


class MaterialProblem(NamedTuple):
    """What is left as it is in a file of materials.

    Parameters
    ----------
    place : int or str
        Where it stands, a line or a path within the file.
    text : str
        What is wrong with it.
    kind : ProblemKind
        What would help.
    """

    place: int | str
    text: str
    kind: ProblemKind = ProblemKind.OTHER
