"""Roughness factors from one stored form to another, each with a result or a reason for none."""

from __future__ import annotations

from collections.abc import Collection

from mdfconv.conversion.arrays import warn_of
from mdfconv.distributions.endpoint import Endpoint, endpoints
from mdfconv.distributions.parameter import number_text
from mdfconv.errors import MdfconvError
from mdfconv.fitting.metrics import Metric
from mdfconv.scene.stored import ConvertedNumber, Outcome, StoredConverter

_KINDS = {Outcome.UNIFORM: "a uniform lobe", Outcome.MIRROR: "a mirror"}


def factor_endpoints(source: str | Endpoint, target: str | Endpoint) -> tuple[Endpoint, Endpoint]:
    """Return both ends of a conversion of factors, which are at most 1.

    Raises
    ------
    MdfconvError
        If a name is not known, or what it stands for is used beyond 1, as an exponent is.
    """
    ends = endpoints(source, target)
    for end in ends:
        if end.stored.typical[1] > 1:
            raise MdfconvError(
                f"a roughness factor is at most 1, {end.label} is more as a rule",
                "name what the program stores (mdfconv list --encodings)",
            )
    return ends


class FactorTable:
    """What becomes of factors from 0 to 1.

    A uniform lobe becomes the target's roughest number, a mirror its smoothest; what the source
    clamps, or does not store, has no result.
    """

    def __init__(
        self, factors: Collection[float], source: Endpoint, target: Endpoint, metric: Metric
    ) -> None:
        self._convert = StoredConverter(source, target, metric)
        self._numbers = self._convert.table(factors)
        converted = [each for each in self._numbers.values() if each.outcome is Outcome.CONVERTED]
        pair = [each.stored for each in converted], [each.result for each in converted]
        warn_of(self._convert.method, [pair], source, target, stacklevel=3)

    def __getitem__(self, factor: float) -> ConvertedNumber:
        return self._numbers[factor]

    def note(self, number: ConvertedNumber) -> str:
        """Return what a careful user must know of a number, "" for nothing."""
        kind = _KINDS.get(number.outcome)
        symbol = self._convert.source.stored.symbol
        text = f"{symbol} = {number_text(number.stored)} is {kind}: {number_text(number.result)}"
        return text if kind else ""

    def problem(self, number: ConvertedNumber) -> str:
        """Return why a number is left as it is, "" if it is not."""
        if number.outcome in _KINDS:
            return ""
        if number.outcome is not Outcome.CONVERTED:
            return self._convert.refusal(number)
        if number.result > 1:
            label = self._convert.target.label
            return f"{label} would be {number_text(number.result)}, above 1"
        return ""
