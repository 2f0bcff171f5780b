"""The kernels at hard cases against 50 digits, beside the printed expressions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from decimal import Decimal
from itertools import groupby
from typing import Any

import numpy as np

from mdfconv.benchmark.stability_finding import DTYPES, Finding, Tallies, no_references, read_rows
from mdfconv.distributions import Distribution
from mdfconv.distributions.evaluation import Array

_Rows = list[dict[str, str]]


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
    for audited in chosen:
        for dtype, by_name in cases.items():
            rows = by_name.get(audited.name) or by_name.get(_same_function(audited), [])
            yield from _findings(audited, rows, dtype) if rows else no_references(audited, dtype)


def _read(dtype: type) -> dict[str, _Rows]:
    rows = read_rows(f"kernels-{np.dtype(dtype).name}.csv")
    return {name: list(group) for name, group in groupby(rows, lambda row: row["distribution"])}


def _same_function(audited: Distribution) -> str:
    """Return the name of the distribution that is this one in the same parameter, if any."""
    equal = audited.equivalent
    return equal.name if equal and equal.same_lobe and equal.same_parameter else ""


def _findings(audited: Distribution, rows: _Rows, dtype: Any) -> Iterator[Finding]:
    tallies = Tallies()
    keys = ("form", "regime", "parameter", "gamma")
    for (form, regime, parameter, gamma), group in groupby(
        rows, lambda row: tuple(row[key] for key in keys)
    ):
        members = list(group)
        beta = np.array([row["beta"] for row in members], dtype=dtype)
        p, shape = dtype(parameter), audited
        if audited.second_parameter:
            shape = audited.with_gamma(float(dtype(gamma or audited.gamma)))
        evaluate = shape.unit if form == "unit" else shape.normalized
        where = f"{audited.parameter.symbol} = {parameter}" + (f", γ = {gamma}" if gamma else "")
        # float16 overflows where the normalized form of a mirror-smooth surface exceeds 65504.
        with np.errstate(over="ignore"):
            values = evaluate(beta, p)
        tallies.of(audited.name, form, regime, dtype).add(
            values,
            printed_form(shape, form, beta, p),
            [Decimal(row["value"]) for row in members],
            [f"β = {row['beta']}, {where}" for row in members],
        )
    return tallies.findings()


def printed_form(shape: Distribution, form: str, beta: Array, parameter: Any) -> Array:
    """Return the printed unit form, or the printed normalized form at the normal.

    Parameters
    ----------
    shape : Distribution
        The distribution, with its γ if it has one.
    form : str
        ``"unit"`` or ``"normalized"``.
    beta : numpy.ndarray
        Angles, radians; 0 for the normalized form.
    parameter : numpy scalar
        The parameter, in the type of the angles.
    """
    printed = shape.printed
    arguments = [parameter] + [beta.dtype.type(shape.gamma)] * bool(shape.second_parameter)
    with np.errstate(all="ignore"):
        # Where the maximum is off the normal, D̄ is not D(β)/D(0): that is 1 at the normal.
        off_axis = form == "normalized" and shape.mode(np.asarray(float(parameter))) > 0
        value = np.ones_like(beta) if off_axis else printed.unit(beta, *arguments)
        return value if form == "unit" else value * printed.at_normal(*arguments)
