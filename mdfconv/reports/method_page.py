"""Which method should be the default: every method on every pair, beside the best fit."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import permutations
from typing import Any

import numpy as np

from mdfconv.benchmark.methods import answers, covering
from mdfconv.conversion import find_method
from mdfconv.conversion.residual import residual
from mdfconv.distributions import Distribution, distribution
from mdfconv.distributions.evaluation import Array
from mdfconv.fitting.metrics import Metric, list_metrics
from mdfconv.fitting.metrics import metric as find_metric
from mdfconv.reports.text import csv_text, file_bytes, markdown_text

_NAMES = ("beckmann", "gauss", "ggx", "blinn-phong", "sawicki", "schlick", "smoothie")
# Beckmann's m_B for lobes of the same half width.
_RANGES = {
    "paper's sweep, m_B 0.0045-0.447": (0.0045, 0.01, 0.03, 0.1, 0.2, 0.3, 0.447),
    "rougher, m_B 0.55-1": (0.55, 0.7, 0.85, 1.0),
}
_REFERENCE = "fast"


def method_page() -> tuple[dict[str, bytes], str]:
    """Return the files of the page by name, and its result in a line."""
    rows = [
        _row(method, metric, where, errors)
        for where, m_b in _RANGES.items()
        for metric in map(find_metric, list_metrics())
        for method, errors in _errors(np.array(m_b), metric).items()
    ]
    files = {
        "methods.csv": file_bytes(csv_text(list(rows[0]), rows)),
        "methods.md": file_bytes(f"{_PROSE}\n\n{markdown_text(list(rows[0]), rows)}"),
    }
    closed = {row["metric"]: row for row in rows[::-1] if row["method"] == "closed-form"}
    medians = [f"{100 * closed[name]['median']:.2g} % ({name})" for name in list_metrics()]
    return files, f"closed-form on the paper's sweep: median error {', '.join(medians)}"


def _errors(m_b: Array, metric: Metric) -> dict[str, list[tuple[Array, Array]]]:
    """Return for each method |p/p_fit − 1| and RMSE − RMSE_fit of each pair; NaN for no answer."""
    tangents = distribution("beckmann").half_tangent(m_b)
    found: dict[str, list[tuple[Array, Array]]] = {}
    pairs = permutations(map(distribution, _NAMES), 2)
    for source, target in (pair for pair in pairs if not find_method(_REFERENCE).is_exact(*pair)):
        given = source.from_half_tangent(tangents)
        given = given[~np.isnan(given)]
        for name, result in _answers(given, source, target, metric):
            found.setdefault(name, []).append(_compared(given, source, target, metric, result))
    return found


def _answers(
    given: Array, source: Distribution, target: Distribution, metric: Metric
) -> Iterator[tuple[str, Array]]:
    for method in covering(source, target, metric):
        # The fit is its own reference, and the stored polynomials are within 1e-4 of it.
        if method.name not in (_REFERENCE, "fit"):
            yield method.name, answers(method, given, source, target, metric)


def _compared(
    given: Array, source: Distribution, target: Distribution, metric: Metric, result: Array
) -> tuple[Array, Array]:
    best = answers(find_method(_REFERENCE), given, source, target, metric)
    left = np.full((2, given.size), np.nan)
    for row, parameter in zip(left, (result, best), strict=True):
        there = ~np.isnan(parameter)
        row[there] = residual(source, given[there], target, parameter[there], metric)[0]
    return np.abs(result / best - 1), left[0] - left[1]


def _row(
    method: str, metric: Metric, where: str, errors: list[tuple[Array, Array]]
) -> dict[str, Any]:
    off, worse = (np.concatenate(column) for column in zip(*errors, strict=True))
    answered = float(np.mean(~np.isnan(off)))
    return {
        "range": where,
        "metric": metric.name,
        "method": method,
        "pairs": len(errors),
        "answered": _rounded(answered),
        "median": _rounded(np.nanmedian(off)),
        "worst": _rounded(np.nanmax(off)),
        "excess_rmse_median": _rounded(np.nanmedian(worse)),
        "excess_rmse_worst": _rounded(np.nanmax(worse)),
    }


def _rounded(value: Any) -> float:
    return float(f"{float(value):.3g}")


_PROSE = """\
# Which method should be the default

Every method on every ordered pair of the seven one-parameter distributions (ggx and smoothie, which
are one, left out), for lobes as wide as Beckmann's at the m_B given, against the best fit under
each metric. `answered`: the share of the lobes. `median` and `worst`: |p/p_fit − 1| of the
parameter. `excess_rmse`: the RMSE under the metric, relative to the source's peak, beyond that of
the best fit. `fit` and `fast` have 0 in every column: `fast` is within 1e-6 of `fit` (1e-4 for the
picture) at tens of millions of values a second (`mdfconv bench`).

For choosing:

- Inside the paper's sweep the closed forms keep the *shape*: half of the lobes within 1 % of the
  best parameter. The worst are Schlick's, whose m_B the paper takes from Beckmann's; the others
  are within 10 %. There `closed-form` is a fair default, and `half-angle` is not.
- For the *light* the closed forms are wrong by 17 % in the median. Of the formulas `peak` comes
  nearest: 8 % in the median, with an RMSE that is at most 0.004 above that of the best fit.
- For the *picture* no formula comes near.
- Rougher than the sweep, no formula is good for anything, and each fails for one lobe in ten.

A renderer with normalized distributions is served better by `fast --metric energy` than by the
default. The default stays the paper's closed form: it is what is printed, and what is to be kept
is for the user to say."""
