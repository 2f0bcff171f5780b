"""Methods that consist of formulas between pairs of distributions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from mdfconv.conversion.method import Method
from mdfconv.distributions import Distribution
from mdfconv.distributions.evaluation import Array
from mdfconv.distributions.gtr import GTR
from mdfconv.distributions.smoothie import from_ggx, to_ggx
from mdfconv.fitting.metrics import Metric

Function: TypeAlias = Callable[[Array], Array]


@dataclass(frozen=True)
class Formula:
    """A formula from one distribution's parameter to another's.

    Parameters
    ----------
    text : str
        The formula as printed, with its place in the source.
    function : callable
        Elementwise on arrays.
    turns_at : float
        Where the formula stops being monotonic, if it does.
    """

    text: str
    function: Function
    turns_at: float = float("inf")


@dataclass(frozen=True)
class _Stand:
    """The distribution in whose parameter the formulas speak of another one."""

    name: str
    to: Formula | None = None
    back: Formula | None = None


class FormulaMethod(Method):
    """A method made of formulas, looked up by the names of source and target.

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
        return None if steps is None else tuple(step.text for step in steps)

    def convert(
        self, parameter: Array, source: Distribution, target: Distribution, metric: Metric
    ) -> Array:
        """Apply the formulas one after the other; NaN where one leaves the positive numbers."""
        steps = self._steps(source, target) or []
        for number, step in enumerate(steps):
            if number:
                parameter = np.where(parameter > 0, parameter, np.nan)
            parameter = step.function(parameter)
        return parameter

    def is_exact(self, source: Distribution, target: Distribution) -> bool:
        """Return whether both are one form in two parameters, such as smoothie and ggx."""
        one_form = _stand(source).name == _stand(target).name
        return one_form and "schlick" not in (source.name, target.name)

    def cautions(
        self, parameter: float, result: float, source: Distribution, target: Distribution
    ) -> list[str]:
        """Say where a formula is used beyond the point at which it turns around."""
        found = []
        value = np.asarray(parameter, dtype=float)
        for step in self._steps(source, target) or ():
            if value > step.turns_at:
                found.append(f"beyond {step.turns_at:.3g} the formula {step.text} turns around")
            value = np.asarray(step.function(value))
        return found

    def _steps(self, source: Distribution, target: Distribution) -> list[Formula] | None:
        first, last = _stand(source), _stand(target)
        middle = self._path(first.name, last.name)
        if middle is None:
            return None
        return [*([first.to] if first.to else []), *middle, *([last.back] if last.back else [])]

    def _path(self, source: str, target: str) -> list[Formula] | None:
        if source == target:
            return []
        if (source, target) in self._formulas:
            return [self._formulas[source, target]]
        for via in (self._through.get(source), self._through.get(target)):
            if via and {(source, via), (via, target)} <= self._formulas.keys():
                return [self._formulas[source, via], self._formulas[via, target]]
        return None


def _stand(distribution: Distribution) -> _Stand:
    """Return how the formulas see a distribution: some share another one's parameter."""
    if isinstance(distribution, GTR):
        same = "gtr with γ = 2 is ggx"
        is_ggx = distribution.gamma == 2
        step = Formula(same, _identity)
        return _Stand("ggx", step, step) if is_ggx else _Stand(distribution.name)
    return _STANDS.get(distribution.name, _Stand(distribution.name))


def _identity(parameter: Array) -> Array:
    return parameter


_SCHLICK = Formula("schlick has beckmann's m_B", _identity)
_STANDS = {
    "schlick": _Stand("beckmann", _SCHLICK, _SCHLICK),
    "ashikhmin-shirley": _Stand("blinn-phong"),
    "smoothie": _Stand(
        "ggx",
        Formula("α = α_s/√(4+α_s²), exact", to_ggx),
        Formula("α_s = 2α/√(1−α²), exact", from_ggx),
    ),
}
