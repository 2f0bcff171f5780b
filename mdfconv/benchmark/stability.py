"""The audit of hard cases: where formulas lose their digits, and what is left of them here.

Exact values are stored, computed with mpmath at 60 digits from the printed formulas and for the
very numbers that the types hold (``python -m tests.generate_stability`` writes them), and compared
in decimal arithmetic, so that neither the references nor the comparison add an error of their own.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from mdfconv.benchmark.stability_conversions import audit_conversions
from mdfconv.benchmark.stability_finding import Finding
from mdfconv.benchmark.stability_kernels import audit_kernels
from mdfconv.distributions import distribution, list_distributions

_PARTS = {"kernels": audit_kernels, "conversions": audit_conversions}


def audit(names: Sequence[str] = (), part: str | None = None) -> Iterator[Finding]:
    """Yield the worst error of every group of hard cases.

    Parameters
    ----------
    names : sequence of str
        Names or aliases of the distributions to audit, of conversions the sources; all if empty.
    part : str, optional
        ``"kernels"`` or ``"conversions"``; both if not given.

    Yields
    ------
    Finding
        First of the kernels (float64, float32, float16), then of the conversions (float64,
        float32). A distribution without stored references has a finding without cases.

    Raises
    ------
    MdfconvError
        If a name is not known.
    """
    chosen = list(dict.fromkeys(map(distribution, names))) or list_distributions()
    for name, findings in _PARTS.items():
        if part in (None, name):
            yield from findings(chosen)
