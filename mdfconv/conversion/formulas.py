"""Methods that consist of formulas between pairs of distributions."""

from __future__ import annotations

import numpy as np

from mdfconv.conversion.method import Method
from mdfconv.distributions import Distribution
from mdfconv.distributions.equivalence import Formula, from_root, to_root
from mdfconv.distributions.evaluation import Array, Mask
from mdfconv.fitting.metrics import Metric


class FormulaMethod(Method):
    """A method made of formulas, looked up by the names of source and target.

    A distribution that is another one in another parameter goes through that one's formulas.

    Parameters
    ----------
    formulas : dict
        From (source, target) to the formula.
    through : dict
        From the name of a distribution to that of the one all its formulas lead through.
    """

    def __init__(
        self, formulas: dict[tuple[str, str], Formula], through: dict[str, str] | None = None
    ) -> None:
        self._formulas = formulas
        self._through = through or {}

    def route(self, source: Distribution, target: Distribution) -> tuple[str, ...] | None:
        """Return the formulas of the conversion; None if the pair is not covered."""
        steps = self._steps(source, target)
        return None if steps is None else tuple(step.text for step in steps if step.text)

    def convert(
        self, parameter: Array, source: Distribution, target: Distribution, metric: Metric
    ) -> Array:
        """Apply the formulas one after the other; NaN where one leaves the positive numbers."""
        for number, step in enumerate(self._steps(source, target) or ()):
            if number:
                parameter = np.where(parameter > 0, parameter, np.nan)
            parameter = step.function(parameter)
        return parameter

    def cautions(
        self, parameter: Array, result: Array, source: Distribution, target: Distribution
    ) -> dict[str, Mask]:
        """Say where a formula is used beyond the point at which it turns around."""
        cautions = {}
        for step in self._steps(source, target) or ():
            sentence = f"beyond {step.turns_at:.3g} the formula {step.text} turns around"
            cautions[sentence] = parameter > step.turns_at
            parameter = step.function(parameter)
        return cautions

    def _steps(self, source: Distribution, target: Distribution) -> list[Formula] | None:
        first, forward = to_root(source, same_lobe=False)
        last, _ = to_root(target, same_lobe=False)
        path = self._path(first, last)
        return None if path is None else [*forward, *path, *from_root(target, same_lobe=False)]

    def _path(self, source: Distribution, target: Distribution) -> list[Formula] | None:
        # Formulas speak of the distributions as they stand in the registry.
        if source.is_same(target):
            return []
        if source.second_parameter or target.second_parameter:
            return None
        names = source.name, target.name
        if names in self._formulas:
            return [self._formulas[names]]
        for via in (self._through.get(name) for name in names):
            if via and {(names[0], via), (via, names[1])} <= self._formulas.keys():
                return [self._formulas[names[0], via], self._formulas[via, names[1]]]
        return None
