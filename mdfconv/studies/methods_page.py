"""Which method should be the default: every formula on every pair, beside the best fit."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import permutations, product
from typing import Any

import numpy as np

from mdfconv.conversion import list_methods, method_named
from mdfconv.conversion.explanation import remaining_error
from mdfconv.conversion.methods import Method
from mdfconv.distributions import Distribution, one_parameter_distributions
from mdfconv.distributions.endpoint import exact_route
from mdfconv.distributions.evaluation import Array
from mdfconv.fitting.metrics import Metric, list_metrics, metric_named
from mdfconv.output.records import csv_text
from mdfconv.recommend import answers
from mdfconv.studies.bench import as_wide
from mdfconv.studies.pages import PageFiles, fill, pivot, tracked

# Beckmann's m_B for lobes of the same half width.
_RANGES = {
    "paper's sweep, m_B 0.0045-0.447": (0.0045, 0.01, 0.03, 0.1, 0.2, 0.3, 0.447),
    "rougher, m_B 0.55-1": (0.55, 0.7, 0.85, 1.0),
}
# The stored maps are the fit within 1e-6 and answer at once; where there are none, the fit.
_REFERENCES = ("fast", "fit")

# By range, metric and method: |p/p_fit − 1| and RMSE − RMSE_fit of the lobes of each pair, NaN for
# those without an answer, shape (2, n).
_Errors = dict[tuple[str, str, str], list[Array]]


def methods() -> PageFiles:
    """Return the methods beside the best fit: the figures for the choice of a default."""
    compared = [one for one in one_parameter_distributions() if one.map_variables is not None]
    pairs = [pair for pair in permutations(compared, 2) if exact_route(*pair) is None]
    names = sorted(method.name for method in list_methods() if not method.follows_metric)
    formulas = [method_named(name) for name in names]
    metrics = [metric_named(name) for name in list_metrics()]
    errors = _compare(pairs, formulas, metrics)
    keys = product(_RANGES, (metric.name for metric in metrics), names)
    rows = [_row(key, errors[key]) for key in keys if key in errors]
    sweep, rougher = ([row for row in rows if row["range"] == name] for name in _RANGES)
    unanswered = [1 - row["answered"] for row in rougher]
    closed_form = {row["metric"]: row["median"] for row in sweep if row["method"] == "closed-form"}
    page = fill(
        "methods",
        count=len(compared),
        closed_form=closed_form,
        best={
            name: min(row["median"] for row in sweep if row["metric"] == name)
            for name in closed_form
        },
        sweep=_table(sweep),
        rougher=_table(rougher),
        unanswered=f"{min(unanswered):.1%} to {max(unanswered):.1%}",
    )
    return PageFiles([page, csv_text(list(rows[0]), rows)], closed_form)


def _compare(
    pairs: Sequence[tuple[Distribution, Distribution]],
    formulas: Sequence[Method],
    metrics: Sequence[Metric],
) -> _Errors:
    """Return the errors of all formulas, each of which answers once for a pair."""
    errors: _Errors = {}
    for (widths, m_b), (source, target) in tracked([*product(_RANGES.items(), pairs)]):
        parameter = as_wide(m_b, source)
        parameter = parameter[~np.isnan(parameter)]
        covering = [method for method in formulas if method.covers(source, target, metrics[0])]
        ours = [answers(method, parameter, source, target, metrics[0]) for method in covering]
        for metric in metrics:
            references = map(method_named, _REFERENCES)
            reference = next(one for one in references if one.covers(source, target, metric))
            best = answers(reference, parameter, source, target, metric)
            results = np.stack([best, *ours])
            off = np.abs(results / best - 1)
            rmse = _rmse(source, parameter, target, results, metric)
            for number, method in enumerate(covering, 1):
                pair = np.stack([off[number], rmse[number] - rmse[0]])
                errors.setdefault((widths, metric.name, method.name), []).append(pair)
    return errors


def _rmse(
    source: Distribution, parameter: Array, target: Distribution, results: Array, metric: Metric
) -> Array:
    """Return the RMSE that results leave, NaN where there is none; both have shape (k, n)."""
    answered = ~np.isnan(results)
    sources = np.broadcast_to(parameter, results.shape)[answered]
    rmse = np.full_like(results, np.nan)
    rmse[answered], _ = remaining_error(source, sources, target, results[answered], metric)
    return rmse


def _row(key: tuple[str, str, str], pairs: Sequence[Array]) -> dict[str, Any]:
    off, excess = np.concatenate(pairs, axis=1)
    figures = {
        "answered": np.mean(~np.isnan(off)),
        "median": np.nanmedian(off),
        "worst": np.nanmax(off),
        "excess_rmse_median": np.nanmedian(excess),
        "excess_rmse_worst": np.nanmax(excess),
    }
    names = dict(zip(("range", "metric", "method"), key, strict=True))
    rounded = {name: float(f"{value:.3g}") for name, value in figures.items()}
    return names | {"pairs": len(pairs)} | rounded


def _table(rows: Sequence[dict[str, Any]]) -> str:
    """Return median and worst errors with a row for each method and a column for each metric."""
    cells = []
    for row in rows:
        label = f"{row['method']}, {row['pairs']} pairs"
        cells.append((label, row["metric"], f"{row['median']:.1%} ({row['worst']:.0%})"))
    return pivot("method", cells)
