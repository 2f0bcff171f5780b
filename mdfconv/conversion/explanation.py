"""`explain`: conversions with their route, the error that remains, and caveats."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from mdfconv.conversion.values import (
    ConversionRule,
    Converted,
    Gamma,
    Name,
    Value,
    holds_pairs,
    in_order,
    listed,
)
from mdfconv.distributions import Distribution
from mdfconv.distributions.evaluation import Array, Mask
from mdfconv.fitting.metrics import Metric
from mdfconv.fitting.problem import ConversionTask, bounded_tangent, narrowest

# 64 × 800 angles and what is computed there stay in the cache.
_ROWS_AT_ONCE = 64
# Of still narrower lobes quadratures lose digits, and squares of their peaks overflow.
_NARROWEST = 1e-30  # radians


def remaining_error(
    source: Distribution,
    parameter: Array,
    target: Distribution,
    result: Array,
    metric: Metric,
    gamma: Array | None = None,
) -> tuple[Array, Array]:
    """Compare two lobes by what a metric minimizes, so that no conversion is better than the fit.

    Parameters and results have shape (n,), as has the target's γ where it was fitted in each row.
    Returns the root mean square √(∫ (S_t − S_s)² w dβ / ∫ S_s² w dβ) over the hemisphere, S the
    signals and w the weight of the metric, and max |S_t − S_s| / max |S_s|; both are NaN for lobes
    that floats do not resolve: narrower than 1e-30, or so wide or steep that their squares
    overflow.
    """
    blocks: list[Array] = [np.zeros((2, 0))]
    for start in range(0, parameter.size, _ROWS_AT_ONCE):
        rows = slice(start, start + _ROWS_AT_ONCE)
        task = ConversionTask(source, parameter[rows], target, metric)
        with np.errstate(all="ignore"):
            blocks.append(_errors(task, result[rows], None if gamma is None else gamma[rows]))
    rmse, maximum = np.concatenate(blocks, axis=1)
    return rmse, maximum


def _errors(task: ConversionTask, result: Array, gamma: Array | None) -> Array:
    """Return both errors, shape (2, n), of so few values that the angles stay in the cache."""
    if gamma is None:
        widths = narrowest(task.source, task.parameter, task.target, result)
    else:
        # A free γ makes the target as wide as the source.
        task = task._replace(target=task.target.with_gammas(gamma[:, None]))
        widths = np.arctan(bounded_tangent(task.source, task.parameter))
    resolved = widths >= _NARROWEST
    # Where nothing can be said the angles are those of any lobe.
    angles = task.metric.quadrature(np.where(resolved, widths, 1.0))
    problem = task._replace(quadrature=angles).problem(np.arange(widths.size))
    errors: Array = np.stack(problem.relative_error(result))
    return np.where(resolved & np.isfinite(errors).all(axis=0), errors, np.nan)


_NO_ERROR = "the lobe is beyond what double precision resolves: its error is not known"


@dataclass(frozen=True)
class Conversion:
    """One converted value, with its error and what a careful user must know.

    Parameters
    ----------
    source, target : str
        Distribution and encoding, such as ``"ggx:roughness"``.
    value, result : float or tuple of two floats
        What was converted, and to what; a pair for an anisotropic surface.
    gamma : float or None
        γ of the target, if it has a second parameter.
    method, metric : str
        The method used, and the metric of the errors (and of the method, if it is "fit").
    exact : bool
        Whether the target is the same lobe, so that no error remains.
    keeps : str
        What the conversion keeps, to follow the word "keeps"; "" if it is exact.
    route : tuple of str
        The formulas or conditions applied, in order.
    rmse, max_error : float
        √(∫ (S_t − S_s)² w dβ / ∫ S_s² w dβ) over the hemisphere, S the signal and w the weight
        of the metric, which no conversion makes smaller than the fit under it; and
        max |S_t − S_s| / max |S_s|. For a pair those of the worse axis.
    cautions : tuple of str
        What this value in particular calls for.
    """

    source: str
    target: str
    value: Value
    result: Value
    gamma: float | None
    method: str
    metric: str
    exact: bool
    keeps: str
    route: tuple[str, ...]
    rmse: float
    max_error: float
    cautions: tuple[str, ...]

    @property
    def notes(self) -> tuple[str, ...]:
        """The cautions, what the method keeps, and the route, as sentences."""
        by = (f"by {', '.join(self.route)}",) if self.route else ()
        if self.exact:
            return (*self.cautions, "exact: the same form", *by)
        return (*self.cautions, f"keeps the {self.keeps}", *by)


def explain(
    values: Any,
    source: Name,
    target: Name,
    method: str | None = None,
    *,
    metric: str | Metric | None = None,
    gamma: Gamma = None,
    errors: bool = True,
) -> list[Conversion]:
    """Convert, and say for each value by which route, with which error and caveats.

    Parameters
    ----------
    values : array_like, tuple of two array_like, or list with tuples
        Parameters of the source, as for `convert`; a tuple (x, y) is the pair of an anisotropic
        surface, in a list, too.
    source, target, method, metric, gamma
        As for `convert`.
    errors : bool
        False saves the cost of `rmse` and `max_error`, which are then NaN, as they are with a
        caution for lobes that floats do not resolve.

    Returns
    -------
    list of Conversion
        One for each value, those of arrays in one row.

    Raises
    ------
    MdfconvError
        As `convert`, and also where that would return NaN.

    Examples
    --------
    >>> (conversion,) = explain(0.2, "beckmann", "ggx")
    >>> conversion.result, conversion.route
    (0.23552, ('C = 1.2 m_B − 0.56 m_B³ (Table 4)',))
    """
    rule = ConversionRule(source, target, method, metric, gamma)
    return explained(values, rule, errors=errors)


def explained(values: Any, rule: ConversionRule, *, errors: bool) -> list[Conversion]:
    """Return the conversions by a rule, as `explain`."""
    if holds_pairs(values):
        return in_order(values, lambda part: explained(part, rule, errors=errors))
    operands = np.broadcast_arrays(*rule.read(values))
    columns = tuple(np.ravel(operand).astype(float) for operand in operands)
    axes = [rule.convert(axis) for axis in rule.source.axes(columns)]
    results = tuple(axis.stored for axis in axes)
    paired = len(axes) > 1
    parameter, gamma = axes[0].parameter, axes[0].gamma
    if gamma is None and rule.pair[1].second_parameter:
        gamma = np.full(parameter.shape, rule.pair[1].gamma)
    cautions: dict[str, Mask] = {}
    for axis in axes:
        for text, which in rule.cautions(axis).items():
            cautions[text] = which | cautions.get(text, False)
    rmse, max_error = np.full((2, parameter.size), np.nan)
    if errors:
        rmse, max_error = np.max([_errors_left(axis, rule) for axis in axes], axis=0)
        cautions[_NO_ERROR] = np.isnan(rmse)
    methods = [rule.method.name] * parameter.size
    if rule.exact is None:
        methods = rule.method.answered_by(rule.task(parameter))
    conversion = partial(
        Conversion,
        source=rule.source.label,
        target=rule.target.label,
        metric=str(rule.metric),
        exact=rule.exact is not None,
        keeps="" if rule.exact is not None else rule.method.keeps(rule.metric),
        route=_route(rule),
    )
    return [
        conversion(
            value=value,
            result=result,
            gamma=None if gamma is None else float(gamma[row]),
            method=method,
            rmse=float(rmse[row]),
            max_error=float(max_error[row]),
            cautions=tuple(text for text, which in cautions.items() if which[row]),
        )
        for row, (value, result, method) in enumerate(
            zip(
                listed(columns if paired else columns[0]),
                listed(rule.target.pair(*results) if paired else results[0]),
                methods,
                strict=True,
            )
        )
    ]


def _errors_left(axis: Converted, rule: ConversionRule) -> tuple[Array, Array]:
    """Return the RMSE and the maximum error of each number of an axis."""
    if rule.exact is not None:
        return np.zeros_like(axis.parameter), np.zeros_like(axis.parameter)
    lobes = rule.pair[0], axis.parameter, rule.pair[1], axis.result
    return remaining_error(*lobes, rule.metric, axis.gamma)


def _route(rule: ConversionRule) -> tuple[str, ...]:
    """Return the formulas from one stored form to the other."""
    decode, encode = (end.encoding.formula if end.encoding else "" for end in rule.ends)
    if rule.exact is None:
        steps = rule.method.route(*rule.pair) or ()
    else:
        steps = tuple(step.text for step in rule.exact)
    return tuple(filter(None, (decode, *steps, encode)))
