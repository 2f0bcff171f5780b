"""The page on hard cases: which errors the types and the printed formulas leave."""

from __future__ import annotations

import math
from collections.abc import Sequence
from operator import attrgetter

from mdfconv.output.records import csv_text
from mdfconv.studies.pages import PageFiles, fill, pivot
from mdfconv.studies.stability import Finding, audit

_COLUMNS = ("distribution", "rule", "regime", "dtype", "cases", "out_of_range", "error", "textbook")
_KERNELS = ("unit", "normalized")
_NO_DIGIT, _FAILS = "1", "fails"
_NO_REFERENCES = "—"


def stability() -> PageFiles:
    """Return the audit of hard cases.

    Errors are orders of magnitude, rounded up: their digits differ from one processor to the
    next.
    """
    findings = list(audit())
    kernels = [finding for finding in findings if finding.rule in _KERNELS]
    by_type = {
        dtype: _table([one for one in kernels if one.dtype == dtype], "distribution", "regime")
        for dtype in ("float64", "float32")
    }
    conversions = [finding for finding in findings if finding.rule not in _KERNELS]
    figures = {
        "cases": sum(finding.cases for finding in findings),
        "distributions": len({finding.distribution for finding in findings}),
        "groups": len(findings),
        "failures": sum(_magnitude(finding.error) == _FAILS for finding in findings),
        "textbook_failures": sum(_magnitude(finding.textbook) == _FAILS for finding in findings),
    }
    page = fill("stability", **by_type, conversions=_table(conversions, "rule", "dtype"), **figures)
    rows = [
        {name: getattr(finding, name) for name in _COLUMNS}
        | {name: _magnitude(getattr(finding, name)) for name in ("error", "textbook")}
        for finding in findings
    ]
    return PageFiles([page, csv_text(_COLUMNS, rows)], figures)


def _table(findings: Sequence[Finding], row: str, column: str) -> str:
    """Return the worst errors, ours and the textbook's, by two fields of a finding."""
    groups: dict[tuple[str, str], list[Finding]] = {}
    for finding in findings:
        groups.setdefault(attrgetter(row, column)(finding), []).append(finding)
    return pivot(row, ((*key, _worst(group)) for key, group in groups.items()))


def _worst(group: Sequence[Finding]) -> str:
    if not any(finding.cases for finding in group):
        return _NO_REFERENCES
    ours = [_magnitude(finding.error) for finding in group]
    textbook = [_magnitude(finding.textbook) for finding in group]
    return " / ".join(max(texts, key=_order) for texts in (ours, textbook) if any(texts))


def _order(magnitude: str) -> float:
    return math.inf if magnitude == _FAILS else float(magnitude or 0)


def _magnitude(error: float | str) -> str:
    """Return an error's order of magnitude, rounded up; at most 1."""
    if error == "":
        return ""
    if isinstance(error, str) or not math.isfinite(error):
        return _FAILS
    if error == 0:
        return "0"
    power = math.ceil(math.log10(error))
    return _NO_DIGIT if power >= 0 else f"1e{power:03d}"
