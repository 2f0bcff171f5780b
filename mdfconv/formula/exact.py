"""Formulas between stored forms of one lobe: no search, for the conversion is a formula itself."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from mdfconv.distributions.endpoint import Endpoint, Steps, exact_route, follow
from mdfconv.distributions.parameter import Parameter
from mdfconv.errors import MdfconvError
from mdfconv.formula.algebra import simplified
from mdfconv.formula.expression import Expression, as_expression, variable


@dataclass(frozen=True)
class StoredNumber:
    """A number that an end stores: its name, its symbol, and its range."""

    name: str
    symbol: str
    parameter: Parameter


@dataclass(frozen=True)
class ExactRelation:
    """What the target stores as expressions of what the source stores, for the same lobe.

    Parameters
    ----------
    source, target : Endpoint
        Both ends.
    steps : sequence of ParameterMap
        From the parameter of the source to that of the target.
    """

    source: Endpoint
    target: Endpoint
    steps: Steps

    @property
    def is_pair(self) -> bool:
        """Whether an end stores the two axes of a surface in its own way, and both have two."""
        ends = self.source, self.target
        paired = any(end.pairing for end in ends)
        return paired and all(end.distribution.anisotropic for end in ends)

    def stored(self, end: Endpoint) -> list[StoredNumber]:
        """Return what an end stores: one number, or the two of a pair."""
        own = end.stored
        if not self.is_pair:
            return [StoredNumber(own.name, own.symbol, own)]
        if end.pairing:
            both = own, end.pairing.second
            return [StoredNumber(one.name, one.symbol, one) for one in both]
        return [StoredNumber(f"{own.name}_{axis}", f"{own.symbol}_{axis}", own) for axis in "xy"]

    def expressions(self, names: Sequence[str]) -> list[Expression]:
        """Return what the target stores, of variables with names for what the source stores.

        Raises
        ------
        MdfconvError
            If a rule is not made of operations that can be written.
        """
        given = [
            variable(name, (one.parameter.lower, one.parameter.upper))
            for name, one in zip(names, self.stored(self.source), strict=True)
        ]
        try:
            return simplified(*map(as_expression, self._converted(given)))
        except (TypeError, AttributeError, NotImplementedError):
            ends = f"{self.source.label} to {self.target.label}"
            raise MdfconvError(
                f"{ends} has no formula: the rule of one is computed step by step",
                "convert computes the numbers",
            ) from None

    # Rules are functions of arrays, which expressions stand for.
    def _converted(self, given: list[Any]) -> list[Any]:
        source, target = self.source.pairing, self.target.pairing
        axes = source.axes(*given) if self.is_pair and source else given
        stored = [self._converted_axis(axis) for axis in axes]
        return [*target.pair(*stored)] if self.is_pair and target else stored

    def _converted_axis(self, stored: Any) -> Any:
        first, last = self.source.encoding, self.target.encoding
        parameter = follow(self.steps, first.decode(stored) if first else stored)
        return last.encode(parameter) if last else parameter


def exact_relation(source: Endpoint, target: Endpoint) -> ExactRelation | None:
    """Return the relation between two ends of the same lobes; None for those of different ones.

    Raises
    ------
    MdfconvError
        If both are the same form.
    """
    steps = exact_route(source.distribution, target.distribution)
    if steps is None:
        return None
    if source.distribution.is_same(target.distribution) and source.label == target.label:
        raise MdfconvError("a formula needs two distributions, or two stored forms of one")
    return ExactRelation(source, target, steps)
