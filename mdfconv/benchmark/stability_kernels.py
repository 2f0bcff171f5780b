"""The kernels at hard cases against 50 digits, beside the printed expressions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from decimal import Decimal
from itertools import groupby
from typing import Any

import numpy as np

from mdfconv.benchmark.stability_finding import DTYPES, Finding, Tally, read_rows
from mdfconv.benchmark.stability_textbook import printed_kernel
from mdfconv.distributions import Distribution
from mdfconv.distributions.gtr import GTR

# With one exponent the two are one function.
_SAME_FORM = {"ashikhmin-shirley": "blinn-phong"}


def audit_kernels(chosen: Sequence[Distribution]) -> Iterator[Finding]:
    """Yield the findings of the unit and the normalized forms.

    Parameters
    ----------
    chosen : sequence of Distribution
        What to audit. β is compared as stored: of a β beyond π/2, which float32's π/2 is, the
        mirrored angle counts. The normalized forms are compared at β = 0; elsewhere they are a
        multiple of the unit forms.

    Yields
    ------
    Finding
        One for each distribution, form, regime and type.
    """
    cases = {dtype: _read(dtype) for dtype in DTYPES}
    for entry in chosen:
        for dtype, by_name in cases.items():
            yield from _findings(entry, by_name[_SAME_FORM.get(entry.name, entry.name)], dtype)


def _read(dtype: type) -> dict[str, list[dict[str, str]]]:
    rows = read_rows(f"kernels-{np.dtype(dtype).name}.csv")
    return {name: list(group) for name, group in groupby(rows, lambda row: row["distribution"])}


def _findings(entry: Distribution, rows: list[dict[str, str]], dtype: Any) -> Iterator[Finding]:
    tallies: dict[tuple[str, str], Tally] = {}
    keys = ("form", "regime", "parameter", "gamma")
    for (form, regime, parameter, gamma), group in groupby(
        rows, lambda row: tuple(row[key] for key in keys)
    ):
        members = list(group)
        beta = np.array([row["beta"] for row in members], dtype=dtype)
        p, exponent = dtype(parameter), dtype(gamma or 2)
        options = {"gamma": exponent} if isinstance(entry, GTR) else {}
        evaluate = entry.unit if form == "unit" else entry.normalized
        where = f"{entry.parameter.symbol} = {parameter}" + (f", γ = {gamma}" if gamma else "")
        tally = tallies.setdefault((form, regime), Tally(entry.name, form, regime, np.dtype(dtype)))
        # float16 overflows where the normalized form of a mirror-smooth surface exceeds 65504.
        with np.errstate(over="ignore"):
            values = evaluate(beta, p, **options)
        tally.add(
            values,
            printed_kernel(entry.name, form, beta, p, exponent),
            [Decimal(row["value"]) for row in members],
            [f"β = {row['beta']}, {where}" for row in members],
        )
    return (tally.finding() for tally in tallies.values())
