"""The page on hard cases: which errors the types and the printed formulas leave."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from mdfconv.benchmark.stability import audit
from mdfconv.benchmark.stability_finding import Finding
from mdfconv.distributions import list_distributions
from mdfconv.reports.text import csv_text, file_bytes, markdown_text

_COLUMNS = ("distribution", "rule", "regime", "dtype", "cases", "out_of_range", "error", "textbook")
_KERNELS = ("unit", "normalized")

Row = dict[str, object]


def stability_page() -> tuple[dict[str, bytes], str]:
    """Return the files of the page by name, and its result in a line.

    Errors are orders of magnitude, rounded up: their digits differ from one processor to the
    next.
    """
    findings = list(audit())
    kernels = [found for found in findings if found.rule in _KERNELS]
    others = [found for found in findings if found.rule not in _KERNELS]
    rows = [_row(found) for found in findings]
    kernel_table = _beside(kernels, ("distribution", "rule", "regime"))
    conversion_table = _beside(others, ("rule", "regime"))
    page = "\n".join(
        [
            _INTRODUCTION,
            "",
            "## Kernels",
            "",
            _KERNEL_PROSE,
            "",
            markdown_text(list(kernel_table[0]), kernel_table),
            "",
            "## Conversions",
            "",
            _CONVERSION_PROSE,
            "",
            markdown_text(list(conversion_table[0]), conversion_table),
        ]
    )
    files = {
        "stability.csv": file_bytes(csv_text(_COLUMNS, rows)),
        "stability.md": file_bytes(page),
    }
    failures = sum(not math.isfinite(found.error) for found in findings)
    spoiled = sum(isinstance(found.textbook, str) and bool(found.textbook) for found in findings)
    cases = sum(found.cases for found in findings)
    summary = (
        f"{failures} failures in {cases} cases of {len(list_distributions())} distributions; "
        f"the printed expressions fail in {spoiled} of {len(findings)} groups"
    )
    return files, summary


_INTRODUCTION = """\
# Hard cases

Worst relative errors against 50-digit values, rounded up to a power of ten; `1` means that no
digit is right. `textbook` is the printed expression in plain NumPy and in the same type; `fails`
is NaN, infinity, or something where the exact value is nothing. An empty cell: nothing is printed,
or every exact value is beyond the type. A result that is right to the last bit has 1e-15 or less
in float64, 1e-07 in float32, 1e-03 in float16. [stability.csv](stability.csv) has every group,
with the number of cases and of exact values that the type holds as 0, a subnormal number or
infinity only (`out_of_range`); all of them come out so. `mdfconv stability` prints more digits,
and where the worst is."""

_KERNEL_PROSE = """\
Roughness is 0.01 or more in `usual` (N up to 20000) and 0.001 down to 1e-8 in `mirror-smooth` (N
up to 1e16). GGX, GTR, Schlick, Sawicki and Blinn/Phong as printed lose their digits as a surface
becomes smoother: in float32 three are left at a roughness of 0.01 and none at 0.0001, in float64
none at 1e-8, and in float16 they are of no use. The forms used here keep them in every type.
Beckmann, Gauss and Smoothie as printed are as good in float64 and float32; only float16, in which
m² already underflows, spoils them. `tail` is D̄ below 1e-6, where an exponential multiplies the
rounding of its exponent, whoever computes it. `edge of support` is the end of Schlick's lobe, both
sides of it. The normalized forms are compared at β = 0; elsewhere they are multiples of the unit
forms. The printed constant of the Gaussian is an approximation (2.7 % off at m_G = 0.4) without a
value above m_G = 1.89; that of GTR is 0/0 at γ = 1 and at C_TR = 1."""

_CONVERSION_PROSE = """\
The worst over all sources. For a smooth surface cos β_half rounds to 1, and the printed half-angle
formulas have nothing left to convert. `and back` is a round trip: where a target has nearly reached
its widest lobe a stored number does not determine where it came from, which no formula can mend
(Blinn/Phong N = 0.1 by half-angle through GGX, Smoothie α_s = 100 through GGX). Glossiness stores a
mirror-smooth surface next to 1, which costs four digits at α = 1e-8; roughness costs none. `fit`
and `fast` are compared with best fits to 24 digits."""


def _row(found: Finding) -> Row:
    return {name: getattr(found, name) for name in _COLUMNS[:-2]} | {
        "error": _magnitude(found.error),
        "textbook": _magnitude(found.textbook),
    }


def _beside(findings: Iterable[Finding], keys: tuple[str, ...]) -> list[Row]:
    """Return a row for each group of equal keys, the worst of each type side by side.

    A cell is empty where there is nothing to compare.
    """
    groups: dict[tuple[object, ...], list[Finding]] = {}
    for found in findings:
        groups.setdefault(tuple(getattr(found, key) for key in keys), []).append(found)
    types = list(dict.fromkeys(found.dtype for group in groups.values() for found in group))
    rows = []
    for values, group in groups.items():
        row: Row = dict(zip(keys, values, strict=True))
        for name in types:
            chosen = [found for found in group if found.dtype == name]
            comparable = any(found.cases > found.out_of_range for found in chosen)
            for column, errors in (
                (name, [found.error for found in chosen]),
                (f"{name} textbook", [found.textbook for found in chosen]),
            ):
                largest = _largest(errors)
                row[column] = largest if comparable or largest != "0" else ""
        rows.append(row)
    return rows


def _largest(errors: Sequence[float | str]) -> str:
    texts = [_magnitude(error) for error in errors]
    if "fails" in texts:
        return "fails"
    return max((text for text in texts if text), key=float, default="")


def _magnitude(error: float | str) -> str:
    """Return an error's order of magnitude, rounded up; at most 1."""
    if error == "":
        return ""
    if isinstance(error, str) or not math.isfinite(error):
        return "fails"
    if error == 0:
        return "0"
    power = math.ceil(math.log10(error))
    return "1" if power >= 0 else f"1e{power:03d}"
