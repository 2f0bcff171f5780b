"""The page on hard cases: which errors the types and the printed formulas leave."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from textwrap import fill

from mdfconv.output.files import file_bytes
from mdfconv.output.records import csv_text, markdown_text
from mdfconv.studies.report.artefact import Artefact
from mdfconv.studies.report.prose import enumeration
from mdfconv.studies.stability import Finding, audit

_COLUMNS = ("distribution", "rule", "regime", "dtype", "cases", "out_of_range", "error", "textbook")
_KERNELS = ("unit", "normalized")
_NO_DIGIT, _FAILS = "1", "fails"

Row = dict[str, object]


def stability_page() -> Artefact:
    """Return the audit of hard cases.

    Errors are orders of magnitude, rounded up: their digits differ from one processor to the
    next.
    """
    findings = list(audit())
    kernels = [finding for finding in findings if finding.rule in _KERNELS]
    others = [finding for finding in findings if finding.rule not in _KERNELS]
    rows = [_row(finding) for finding in findings]
    kernel_table = _beside(kernels, ("distribution", "rule", "regime"))
    conversion_table = _beside(others, ("rule", "regime"))
    page = "\n".join(
        [
            _INTRODUCTION,
            "",
            "## Kernels",
            "",
            _kernel_prose(kernels),
            "",
            markdown_text(list(kernel_table[0]), kernel_table),
            "",
            "## Conversions",
            "",
            _conversion_prose(others),
            "",
            markdown_text(list(conversion_table[0]), conversion_table),
        ]
    )
    files = {
        "stability.csv": file_bytes(csv_text(_COLUMNS, rows)),
        "stability.md": file_bytes(page),
    }
    failures = sum(_magnitude(finding.error) == _FAILS for finding in findings)
    spoiled = sum(_magnitude(finding.textbook) == _FAILS for finding in findings)
    cases = sum(finding.cases for finding in findings)
    audited = {finding.distribution for finding in findings}
    agreement = (
        f"{failures} failures in {cases} cases of {len(audited)} distributions; "
        f"the printed expressions fail in {spoiled} of {len(findings)} groups"
    )
    question = "how accurate the forms are where formulas lose their digits"
    return Artefact(files, question, agreement, "mdfconv stability")


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


def _kernel_prose(findings: Sequence[Finding]) -> str:
    smooth = {
        finding.distribution: _magnitude(finding.textbook)
        for finding in findings
        if (finding.rule, finding.regime, finding.dtype) == ("unit", "mirror-smooth", "float64")
    }
    losing = [name for name, error in smooth.items() if error in (_NO_DIGIT, _FAILS)]
    sound = [name for name in smooth if name not in losing]
    spoiled, kept = enumeration(losing), enumeration(sound)
    return fill(
        "Roughness is 0.01 or more in `usual` (N up to 20000) and 0.001 down to 1e-8 in "
        f"`mirror-smooth` (N up to 1e16). {spoiled} as printed lose their digits as a surface "
        "becomes smoother, the last of them in `mirror-smooth`, even in float64. The forms used "
        f"here keep them in every type. {kept} as printed are as good in float64 and "
        "float32; only float16, in which the square of a roughness already underflows, spoils "
        "them. `tail` is D̄ below 1e-6, where an exponential multiplies the rounding of its "
        "exponent, whoever computes it. `edge of support` is the end of Schlick's lobe, both sides "
        "of it. The normalized forms are compared at β = 0; elsewhere they are multiples of the "
        "unit forms. The printed constant of the Gaussian is an approximation, without a value for "
        "a very rough surface; that of GTR is 0/0 at γ = 1 and at C_TR = 1.",
        100,
        break_on_hyphens=False,
    )


def _conversion_prose(findings: Sequence[Finding]) -> str:
    trips = [finding for finding in findings if finding.round_trip and finding.regime == "rough"]
    hardest = max(trips, key=lambda trip: float(trip.error or 0))
    return fill(
        "The worst over all sources. For a smooth surface cos β_half rounds to 1, and the printed "
        "half-angle formulas have nothing left to convert. `and back` is a round trip: where a "
        "target has nearly reached its widest lobe a stored number does not determine where it "
        f"came from, which no formula can mend (the hardest: {hardest.worst} by {hardest.rule} in "
        f"{hardest.dtype}). Glossiness stores a mirror-smooth surface next to 1, which costs "
        "digits; roughness costs none. `fit` and `fast` are compared with best fits to 24 digits.",
        100,
        break_on_hyphens=False,
    )


def _row(finding: Finding) -> Row:
    return {name: getattr(finding, name) for name in _COLUMNS[:-2]} | {
        "error": _magnitude(finding.error),
        "textbook": _magnitude(finding.textbook),
    }


def _beside(findings: Iterable[Finding], keys: tuple[str, ...]) -> list[Row]:
    """Return a row for each group of equal keys, the worst of each type side by side.

    A cell is empty where there is nothing to compare.
    """
    groups: dict[tuple[object, ...], list[Finding]] = {}
    for finding in findings:
        groups.setdefault(tuple(getattr(finding, key) for key in keys), []).append(finding)
    types = list(dict.fromkeys(finding.dtype for group in groups.values() for finding in group))
    rows = []
    for values, group in groups.items():
        row: Row = dict(zip(keys, values, strict=True))
        for name in types:
            chosen = [finding for finding in group if finding.dtype == name]
            comparable = any(finding.cases > finding.out_of_range for finding in chosen)
            for column, errors in (
                (name, [finding.error for finding in chosen]),
                (f"{name} textbook", [finding.textbook for finding in chosen]),
            ):
                largest = _largest(errors)
                row[column] = largest if comparable or largest != "0" else ""
        rows.append(row)
    return rows


def _largest(errors: Sequence[float | str]) -> str:
    texts = [_magnitude(error) for error in errors]
    if _FAILS in texts:
        return _FAILS
    return max((text for text in texts if text), key=float, default="")


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
