"""`explain`: conversions with their route, the error that remains, and caveats."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from mdfconv.conversion.arrays import (
    Gamma,
    apply,
    apply_free,
    cautions_of,
    check_pair,
    chosen_method,
    given_gamma,
    given_metric,
)
from mdfconv.conversion.methods import Method
from mdfconv.distributions import Distribution
from mdfconv.distributions.endpoint import Endpoint, endpoints
from mdfconv.distributions.equivalence import exact_route
from mdfconv.distributions.evaluation import Array, Mask, as_operand
from mdfconv.errors import MdfconvError
from mdfconv.fitting.metrics import Metric
from mdfconv.fitting.problem import FitProblem, bounded_tangent, narrowest

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

    Parameters
    ----------
    source, target : Distribution
        The distributions.
    parameter, result : numpy.ndarray, shape (n,)
        Their parameters.
    metric : Metric
        Its signals S are compared, with its weight w, over the whole hemisphere.
    gamma : numpy.ndarray, shape (n,), optional
        The second parameter of the target, if it was fitted in each row.

    Returns
    -------
    rmse, max_error : numpy.ndarray, shape (n,)
        √(∫ (S_t − S_s)² w dβ / ∫ S_s² w dβ), and max |S_t − S_s| / max |S_s|; NaN for lobes that
        floats do not resolve: narrower than 1e-30, or so wide or steep that their squares
        overflow.
    """
    columns = []
    for rows in _blocks(parameter.size):
        with np.errstate(all="ignore"):
            columns.append(
                _errors(
                    source,
                    parameter[rows],
                    target,
                    result[rows],
                    metric,
                    None if gamma is None else gamma[rows],
                )
            )
    rmse, maximum = np.concatenate([np.zeros((2, 0)), *columns], axis=1)
    return rmse, maximum


def _errors(
    source: Distribution,
    parameter: Array,
    target: Distribution,
    result: Array,
    metric: Metric,
    gamma: Array | None,
) -> Array:
    """Return both errors, shape (2, n), of so few values that the angles stay in the cache."""
    sources = source, parameter
    if gamma is None:
        shaped = target
        widths = narrowest(*sources, target, result)
    else:
        # A free γ makes the target as wide as the source.
        shaped = target.with_gammas(gamma[:, None])
        widths = np.arctan(bounded_tangent(*sources))
    resolved = widths >= _NARROWEST
    # Where nothing can be said the angles are those of any lobe.
    angles = metric.quadrature(np.where(resolved, widths, 1.0))
    problem = FitProblem(*sources, shaped, metric, angles, np.arange(widths.size))
    errors: Array = np.stack(problem.relative_error(result))
    return np.where(resolved & np.isfinite(errors).all(axis=0), errors, np.nan)


def _blocks(size: int) -> list[slice]:
    return [slice(start, start + _ROWS_AT_ONCE) for start in range(0, size, _ROWS_AT_ONCE)]


_NO_ERROR = "the lobe is beyond what double precision resolves: its error is not known"
Value: TypeAlias = float | tuple[float, float]


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
    source: str | Endpoint,
    target: str | Endpoint,
    method: str | None = None,
    *,
    metric: str | Metric | None = None,
    gamma: Gamma = None,
    errors: bool = True,
) -> list[Conversion]:
    """Convert, and say for each value by which route, with which error and caveats.

    Parameters
    ----------
    values : number, tuple of two numbers, list of either, or numpy.ndarray
        Parameters of the source; a tuple (x, y) is the pair of an anisotropic surface.
    source, target, method, metric, gamma
        As for `convert`.
    errors : bool
        False saves the cost of `rmse` and `max_error`, which are then NaN, as they are with a
        caution for lobes that floats do not resolve.

    Returns
    -------
    list of Conversion
        One for each value.

    Raises
    ------
    MdfconvError
        As `convert`.
    """
    ends = endpoints(source, target, given_gamma(gamma))
    kept = given_metric(metric)
    rule = chosen_method(method, *ends, gamma, metric_given=metric is not None)
    axes = _axes(values, *ends)
    stored = [pair if len(pair) == 1 else ends[0].axes(pair) for pair in axes]
    parameter = ends[0].decode([value for pair in stored for value in pair])
    table = _ExplanationTable(
        rule, kept, parameter, *ends, free=isinstance(gamma, str), errors=errors
    )
    return [table.conversion(pair, rows) for pair, rows in _with_rows(axes)]


def results_and_cautions(
    values: Array,
    source: str | Endpoint,
    target: str | Endpoint,
    method: str | None = None,
    *,
    metric: str | Metric | None = None,
    gamma: float | None = None,
) -> tuple[Array, tuple[str, ...]]:
    """Convert an array, and say what any of its values calls for; as `explain` otherwise.

    Parameters
    ----------
    values : numpy.ndarray, shape (n,)
        Parameters of the source.
    source, target, method, metric, gamma
        As for `convert`.

    Returns
    -------
    results : numpy.ndarray, shape (n,)
    cautions : tuple of str
    """
    ends = endpoints(source, target, gamma)
    rule = chosen_method(method, *ends, gamma, metric_given=metric is not None)
    kept = given_metric(metric)
    table = _ExplanationTable(rule, kept, ends[0].decode(values), *ends, free=False, errors=False)
    return table.stored, table.cautions


def _axes(values: Any, source: Endpoint, target: Endpoint) -> list[tuple[Any, ...]]:
    """Return the values as tuples of one number, or of two."""
    items = values if isinstance(values, list) else [values]
    if isinstance(values, np.ndarray):
        items = as_operand(values).ravel().tolist()
    axes = [item if isinstance(item, tuple) else (item,) for item in items]
    for pair in axes:
        if len(pair) != 1:
            check_pair(pair, source, target)
        if any(np.ndim(as_operand(value)) for value in pair):
            raise MdfconvError("explain takes numbers and pairs of numbers, not arrays in a list")
    return axes


def _with_rows(axes: Sequence[tuple[Any, ...]]) -> Iterator[tuple[tuple[Any, ...], slice]]:
    """Yield each value with its rows in the array of all numbers."""
    start = 0
    for pair in axes:
        yield pair, slice(start, start + len(pair))
        start += len(pair)


class _ExplanationTable:
    """The conversions of an array of parameters, column by column."""

    def __init__(
        self,
        method: Method,
        metric: Metric,
        parameter: Array,
        source: Endpoint,
        target: Endpoint,
        *,
        free: bool,
        errors: bool,
    ) -> None:
        self._method, self._metric, self._source, self._target = method, metric, source, target
        self._parameter = parameter
        pair = source.distribution, target.distribution
        exact = None if free else exact_route(*pair)
        self._exact = exact is not None
        own_steps = (
            method.route(*pair) if exact is None else [step.text for step in exact if step.text]
        )
        encodings = [end.encoding.formula if end.encoding else "" for end in (source, target)]
        steps = [encodings[0], *(own_steps or ()), encodings[1]]
        self._route = tuple(step for step in steps if step)
        self._gamma: Array | None = None
        self._at_limit = np.zeros(parameter.shape, bool)
        if free:
            self._stored, self._gamma, self._at_limit = apply_free(
                metric, parameter, source, target
            )
            self._result = target.decode(self._stored)
        else:
            self._result = apply(method, metric, parameter, source, target)
            self._stored = target.encode(self._result)
            if pair[1].second_parameter:
                self._gamma = np.full(parameter.shape, pair[1].gamma)
        if self._exact or free:
            self._answered_by = [method.name] * parameter.size
        else:
            self._answered_by = method.answered_by(parameter, *pair, metric)
        self._errors = (
            self._remaining(free=free) if errors else (np.full_like(parameter, np.nan),) * 2
        )
        self._cautions = self._all_cautions()
        if errors and np.isnan(self._errors[0]).any():
            self._cautions[_NO_ERROR] = np.isnan(self._errors[0])

    def _remaining(self, *, free: bool) -> tuple[Array, Array]:
        """Return the RMSE and the maximum error, shapes (n,)."""
        if self._exact:
            return np.zeros_like(self._parameter), np.zeros_like(self._parameter)
        source, target = self._source.distribution, self._target.distribution
        gamma = self._gamma if free else None
        return remaining_error(source, self._parameter, target, self._result, self._metric, gamma)

    @property
    def stored(self) -> Array:
        """The stored values of the results, shape (n,)."""
        return self._stored

    @property
    def cautions(self) -> tuple[str, ...]:
        """What any of the numbers calls for."""
        return self._true_of(slice(None))

    def _true_of(self, rows: slice) -> tuple[str, ...]:
        return tuple(text for text, which in self._cautions.items() if which[rows].any())

    def conversion(self, pair: tuple[Any, ...], rows: slice) -> Conversion:
        """Return the conversion of one value."""
        rmse, max_error = (float(column[rows].max()) for column in self._errors)
        return Conversion(
            source=self._source.label,
            target=self._target.label,
            value=_value([float(value) for value in pair]),
            result=_value(self._given(self._stored[rows])),
            gamma=None if self._gamma is None else float(self._gamma[rows][0]),
            method=self._answered_by[rows][0],
            metric=str(self._metric),
            exact=self._exact,
            keeps="" if self._exact else self._method.keeps(self._metric),
            route=self._route,
            rmse=rmse,
            max_error=max_error,
            cautions=self._true_of(rows),
        )

    def _given(self, stored: Array) -> list[float]:
        """Return stored results as the user is to have them."""
        if stored.size == 1:
            return [float(stored[0])]
        return [float(value) for value in self._target.pair(*stored)]

    def _all_cautions(self) -> dict[str, Mask]:
        """Return sentences, and which of the numbers they are true of."""
        ends = self._source, self._target
        cautions = cautions_of(self._method, self._parameter, self._result, self._stored, *ends)
        if self._at_limit.any():
            mdf = ends[1].distribution
            low, high = mdf.parameters[1].fit_range
            sentence = (
                f"γ of {mdf.name} is at the end of the range in which it is looked for, "
                f"{low:g} to {high:g}"
            )
            cautions[sentence] = self._at_limit
        return cautions


def _value(axes: list[float]) -> Value:
    return (axes[0], axes[1]) if len(axes) > 1 else axes[0]
