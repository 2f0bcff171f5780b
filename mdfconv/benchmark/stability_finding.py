"""How the audit of hard cases judges a group of values."""

from __future__ import annotations

import csv
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from decimal import Decimal
from importlib.resources import files
from typing import Any

import numpy as np

from mdfconv.distributions import Distribution
from mdfconv.distributions.evaluation import Array

DTYPES = (np.float64, np.float32, np.float16)


@dataclass(frozen=True)
class Finding:
    """The worst of a group of hard cases, ours beside the printed expression.

    Parameters
    ----------
    distribution : str
        The distribution; of a conversion the source.
    rule : str
        ``"unit"`` or ``"normalized"`` for a kernel, else the method, ``"... and back"`` for a
        round trip.
    regime : str
        What makes the cases hard.
    dtype : str
        Type of the input and of the result.
    cases : int
        The number of cases.
    out_of_range : int
        How many of them have an exact value that the type holds only as 0, a subnormal number
        or infinity. They are right if the result is that; no error can be stated.
    error : float or str
        The largest relative error against the exact value; inf or NaN for a failure, empty where
        there is no case.
    error_in_eps : float or str
        The same in units of the type's rounding, ``numpy.finfo(dtype).eps``; a correctly
        rounded result has at most ½.
    textbook : float or str
        The largest relative error of the printed expression in plain NumPy, in the same type;
        ``"NaN"`` or ``"inf"`` where it comes to that, and empty where nothing is printed.
    worst : str
        Where `error` is largest.
    """

    distribution: str
    rule: str
    regime: str
    dtype: str
    cases: int
    out_of_range: int
    error: float | str
    error_in_eps: float | str
    textbook: float | str
    worst: str


class Tally:
    """Collects the errors of one group and makes the finding of them.

    Parameters
    ----------
    distribution, rule, regime : str
        As for `Finding`.
    dtype : numpy.dtype
        Type of the values.
    """

    def __init__(self, distribution: str, rule: str, regime: str, dtype: np.dtype) -> None:
        self._group = distribution, rule, regime
        self._dtype = dtype
        self._ours: list[float] = []
        self._textbook: list[float] = []
        self._cases: list[str] = []
        self._out_of_range = 0

    def add(
        self,
        values: Array,
        textbook: Array | None,
        exact: Sequence[Decimal],
        cases: Sequence[str],
    ) -> None:
        """Compare values of the group's type, and the printed expression's, with exact ones.

        `cases` says in words what each of them is.
        """
        self._ours += relative_errors(values, exact)
        if textbook is not None:
            self._textbook += relative_errors(textbook, exact)
        self._cases += cases
        self._out_of_range += sum(not _in_range(value, self._dtype) for value in exact)

    def finding(self) -> Finding:
        """Return the worst."""
        index = int(np.argmax(np.nan_to_num(self._ours, nan=np.inf)))
        error = self._ours[index]
        return Finding(
            *self._group,
            dtype=self._dtype.name,
            cases=len(self._ours),
            out_of_range=self._out_of_range,
            error=two_digits(error),
            error_in_eps=two_digits(error / float(np.finfo(self._dtype).eps)),
            textbook=_worst_of_textbook(self._textbook),
            worst=self._cases[index],
        )


class Tallies:
    """The tallies of several groups, in the order in which they were first asked for."""

    def __init__(self) -> None:
        self._tallies: dict[tuple[str, str, str, str], Tally] = {}

    def of(self, distribution: str, rule: str, regime: str, dtype: Any) -> Tally:
        """Return the tally of a group."""
        kind = np.dtype(dtype)
        key = (distribution, rule, regime, kind.name)
        return self._tallies.setdefault(key, Tally(distribution, rule, regime, kind))

    def findings(self) -> Iterator[Finding]:
        """Return the worst of each group."""
        return (tally.finding() for tally in self._tallies.values())


def no_references(audited: Distribution, dtype: Any) -> Iterator[Finding]:
    """Yield the finding of a distribution for which no exact value is stored."""
    group = (audited.name, "unit", "no stored references", np.dtype(dtype).name)
    yield Finding(*group, cases=0, out_of_range=0, error="", error_in_eps="", textbook="", worst="")


def relative_errors(values: Array, exact: Sequence[Decimal]) -> list[float]:
    """Return |value − exact|/|exact| of each value, rounded only at the end.

    Where the exact value is below the smallest normal number or above the largest number of
    the type, the error is 0 if the value is so too and inf otherwise; NaN stays NaN.
    """
    return [_error(float(v), e, values.dtype) for v, e in zip(values, exact, strict=True)]


def _error(value: float, exact: Decimal, dtype: np.dtype) -> float:
    if np.isnan(value):
        return np.nan
    if not _in_range(exact, dtype):
        limits = np.finfo(dtype)
        small = float(limits.smallest_normal)
        # The last rounding may lift a value just across the limit.
        fits = 0 <= value <= small * 1.01 if exact < small else value >= 0.99 * float(limits.max)
        return 0.0 if fits else np.inf
    return np.inf if np.isinf(value) else float(abs(Decimal(value) - exact) / exact)


def _in_range(exact: Decimal, dtype: np.dtype) -> bool:
    limits = np.finfo(dtype)
    return float(limits.smallest_normal) <= exact <= float(limits.max)


def _worst_of_textbook(errors: list[float]) -> float | str:
    if not errors:
        return ""
    worst = float(np.max(errors))
    return two_digits(worst) if np.isfinite(worst) else str(worst).replace("nan", "NaN")


def two_digits(value: float) -> float:
    """Return a value rounded to two significant digits: an error's size is what matters."""
    return float(f"{value:.1e}")


def read_rows(name: str) -> list[dict[str, str]]:
    """Return the rows of a file of reference values."""
    text = files("mdfconv.benchmark").joinpath("data", name).read_text(encoding="utf-8")
    return list(csv.DictReader(text.splitlines()))
