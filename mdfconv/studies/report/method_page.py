"""Which method should be the default: every method on every pair, beside the best fit."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import permutations
from typing import Any

import numpy as np

from mdfconv.conversion import list_methods, method_named
from mdfconv.conversion.explanation import remaining_error
from mdfconv.conversion.methods import Method
from mdfconv.distributions import Distribution, one_parameter_distributions
from mdfconv.distributions.endpoint import exact_route
from mdfconv.distributions.evaluation import Array
from mdfconv.fitting.metrics import Metric, list_metrics, metric_named
from mdfconv.output.files import file_bytes
from mdfconv.output.records import csv_text, markdown_text
from mdfconv.recommend import answers
from mdfconv.studies.bench import as_wide
from mdfconv.studies.report.artefact import Artefact
from mdfconv.studies.report.prose import percent, wrapped

# Beckmann's m_B for lobes of the same half width.
_SWEEP, _ROUGHER = "paper's sweep, m_B 0.0045-0.447", "rougher, m_B 0.55-1"
_RANGES = {_SWEEP: (0.0045, 0.01, 0.03, 0.1, 0.2, 0.3, 0.447), _ROUGHER: (0.55, 0.7, 0.85, 1.0)}
# The stored maps are the fit within 1e-6 and answer at once; where there are none, the fit.
_REFERENCES = ("fast", "fit")

_Pair = tuple[Distribution, Distribution]
# By range, metric and method: for each pair |p/p_fit − 1| and RMSE − RMSE_fit of each lobe, NaN
# for no answer, shape (2, n).
_Errors = dict[tuple[str, str, str], dict[_Pair, Array]]


def method_page() -> Artefact:
    """Return the methods beside the best fit: the figures for the choice of a default."""
    compared = [one for one in one_parameter_distributions() if one.map_variables is not None]
    pairs = list(permutations(compared, 2))
    equal = [pair for pair in pairs if exact_route(*pair) is not None]
    errors = _compare([pair for pair in pairs if pair not in equal])
    rows = {key: _row(key, list(group.values())) for key, group in errors.items()}
    table, columns = list(rows.values()), list(next(iter(rows.values())))
    prose = _prose(rows, _worst_closed_forms(errors), len(compared), [one.name for one, _ in equal])
    files = {
        "methods.csv": file_bytes(csv_text(columns, table)),
        "methods.md": file_bytes(f"{prose}\n\n{markdown_text(columns, table)}"),
    }
    medians = [
        f"{percent(rows[_SWEEP, name, 'closed-form']['median'])} ({name})"
        for name in list_metrics()
    ]
    return Artefact(
        files,
        "which method should be the default",
        f"closed-form on the paper's sweep: median error {', '.join(medians)}",
        "mdfconv report",
    )


def _compare(pairs: Sequence[_Pair]) -> _Errors:
    """Return the errors of all formulas, each of which answers once for a pair."""
    formulas = sorted(
        (method for method in list_methods() if not method.follows_metric),
        key=lambda method: method.name,
    )
    metrics = [metric_named(name) for name in list_metrics()]
    errors: _Errors = {
        (widths, metric.name, method.name): {}
        for widths in _RANGES
        for metric in metrics
        for method in formulas
    }
    parameters = {source: _parameters(source) for source in dict(pairs)}
    for source, target in pairs:
        parameter, within = parameters[source]
        covering = [method for method in formulas if method.covers(source, target, metrics[0])]
        ours = [answers(method, parameter, source, target, metrics[0]) for method in covering]
        for metric in metrics:
            best = answers(_reference(source, target, metric), parameter, source, target, metric)
            results = np.stack([best, *ours])
            rmse = _rmse(source, parameter, target, results, metric)
            for method, off, excess in zip(
                covering, np.abs(results[1:] / best - 1), rmse[1:] - rmse[0], strict=True
            ):
                for widths, rows in within.items():
                    errors[widths, metric.name, method.name][source, target] = np.stack(
                        [off[rows], excess[rows]]
                    )
    return {key: group for key, group in errors.items() if group}


def _parameters(source: Distribution) -> tuple[Array, dict[str, slice]]:
    """Return the parameters of all lobes that a distribution has, and those of each range."""
    groups = [as_wide(m_b, source) for m_b in _RANGES.values()]
    groups = [group[~np.isnan(group)] for group in groups]
    ends = np.cumsum([group.size for group in groups])
    rows = [slice(end - group.size, end) for group, end in zip(groups, ends, strict=True)]
    return np.concatenate(groups), dict(zip(_RANGES, rows, strict=True))


def _reference(source: Distribution, target: Distribution, metric: Metric) -> Method:
    methods = [method_named(name) for name in _REFERENCES]
    return next(method for method in methods if method.covers(source, target, metric))


def _rmse(
    source: Distribution, parameter: Array, target: Distribution, results: Array, metric: Metric
) -> Array:
    """Return the RMSE that results leave, NaN where there is none; both have shape (k, n)."""
    answered = ~np.isnan(results)
    sources = np.broadcast_to(parameter, results.shape)[answered]
    rmse = np.full_like(results, np.nan)
    rmse[answered], _ = remaining_error(source, sources, target, results[answered], metric)
    return rmse


def _row(key: tuple[str, str, str], group: Sequence[Array]) -> dict[str, Any]:
    off, excess = np.concatenate(group, axis=1)
    figures = {
        "answered": np.mean(~np.isnan(off)),
        "median": np.nanmedian(off),
        "worst": np.nanmax(off),
        "excess_rmse_median": np.nanmedian(excess),
        "excess_rmse_worst": np.nanmax(excess),
    }
    names = dict(zip(("range", "metric", "method"), key, strict=True))
    rounded = {name: float(f"{value:.3g}") for name, value in figures.items()}
    return names | {"pairs": len(group)} | rounded


def _worst_closed_forms(errors: _Errors) -> list[float]:
    """Return the worst of those with a borrowed parameter, and the worst of the others."""
    worst = [0.0, 0.0]
    for pair, (off, _) in errors[_SWEEP, "unit", "closed-form"].items():
        own = all(end.equivalent is None or end.equivalent.same_lobe for end in pair)
        worst[own] = max(worst[own], float(np.nanmax(off)))
    return worst


def _prose(
    rows: dict[tuple[str, str, str], dict[str, Any]],
    worst: Sequence[float],
    count: int,
    left_out: Sequence[str],
) -> str:
    def nearest(metric: str) -> dict[str, Any]:
        chosen = [row for key, row in rows.items() if key[:2] == (_SWEEP, metric)]
        return min(chosen, key=lambda row: row["median"])

    light, natural, picture = (nearest(name) for name in ("energy", "environment", "display"))
    missing = [1 - row["answered"] for row in rows.values() if row["range"] == _ROUGHER]
    text = _PROSE.format(
        count=count,
        left_out=" and ".join(dict.fromkeys(left_out)),
        shape=percent(rows[_SWEEP, "unit", "closed-form"]["median"]),
        borrowed=percent(worst[False]),
        own=percent(worst[True]),
        half_angle=percent(rows[_SWEEP, "unit", "half-angle"]["median"]),
        light=percent(rows[_SWEEP, "energy", "closed-form"]["median"]),
        light_method=light["method"],
        light_median=percent(light["median"]),
        light_rmse=f"{light['excess_rmse_worst']:.2g}",
        environment=percent(rows[_SWEEP, "environment", "closed-form"]["median"]),
        environment_method=natural["method"],
        environment_median=percent(natural["median"]),
        picture_method=picture["method"],
        picture_median=percent(picture["median"]),
        missing=f"{percent(min(missing))} to {percent(max(missing))}",
    )
    return wrapped(text)


# A paragraph, or an item of the list, in a line.
_PROSE = """\
# Which method should be the default

Every method on every ordered pair of {count} one-parameter distributions ({left_out}, which are \
one, left out), for lobes as wide as Beckmann's at the m_B given, against the best fit under each \
metric. `answered`: the share of the lobes. `median` and `worst`: |p/p_fit − 1| of the parameter. \
`excess_rmse`: the relative RMSE under the metric beyond that of the best \
fit. `fit` and `fast` have 0 in every column: `fast` is within 1e-6 of `fit` (1e-4 for the \
picture) at the price of a formula (`mdfconv bench`).

For choosing:

- Inside the paper's sweep the closed forms keep the *shape*: half of the lobes within {shape} of \
the best parameter. The worst are Schlick's, whose m_B the paper takes from Beckmann's, up to \
{borrowed} off; the others are within {own}. There `closed-form` is a fair default, and \
`half-angle`, {half_angle} off in the median, is not.
- For the *light* of the sun or a lamp the closed forms are wrong by {light} in the median. Of the \
formulas `{light_method}` comes nearest: {light_median} in the median, with an RMSE that is at \
most {light_rmse} above that of the best fit. For that of a natural environment they are wrong by \
{environment}, and `{environment_method}`, the nearest, by {environment_median}.
- For the *picture* no formula comes near: the nearest, `{picture_method}`, is {picture_median} \
off in the median.
- Rougher than the sweep, no formula is good for anything, and each has no answer for {missing} \
of the lobes.

A renderer with normalized distributions is served by `--metric environment`, which the commands \
for scenes (mtl, texture, formula, recommend) take unasked. Without a metric `convert` stays the \
paper's closed form: it is what is printed, and what is to be kept is for the user to say."""
