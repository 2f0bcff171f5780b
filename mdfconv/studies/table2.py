"""Table 2 of Sawicki 2021 by the protocol recovered from its numbers, and tables like it.

The paper does not say how it sampled the angles. Every cell but ten comes back with: m_B =
√(2/N) unrounded; β uniform from 0 to a limit of each row's own, about 3000 points; unit forms;
RMSE = √(SSE/(n−1)) where a parameter was fitted and √(SSE/n) for N by equation (11).

The paper's closed forms are fits to this table, redone here under every metric.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mdfconv.conversion.explanation import remaining_error
from mdfconv.distributions import distribution, one_parameter_distributions
from mdfconv.distributions.evaluation import Array
from mdfconv.errors import MdfconvError
from mdfconv.fitting.free_gamma import FreeFit, fit_free_gamma
from mdfconv.fitting.metrics import Metric
from mdfconv.fitting.metrics.base import Unit
from mdfconv.fitting.problem import ConversionTask
from mdfconv.fitting.quadrature import UniformSamples
from mdfconv.fitting.solve import fit
from mdfconv.studies.pages import read_rows

# Between 0 and the limit of a row.
SAMPLES = 3001
AGREEMENT = 4e-4  # relative
_LIMIT = 4.0  # β up to 4 m_B, the paper's habit
_BATCH = 64

# What is fitted; column of the paper, and the distribution that fits it.
_SOURCE = "beckmann"
FITTED = {"n": "blinn-phong", "m_g": "gauss", "n_ds": "sawicki", "c_tr": "ggx"}
_PAIRS = [name for column in FITTED for name in (column, f"rmse_{column}")]
COLUMNS = ("m_b", "n_eq11", "rmse_n_eq11", *_PAIRS)

Row = dict[str, float]


def paper_sweep() -> tuple[Array, Array]:
    """Return the paper's m_B, unrounded, and the limit of β of each row, radians."""
    rows = read_rows("table2_protocol.csv")
    numbers = [[float(row[key]) for row in rows] for key in ("m_b_exact", "beta_max_rad")]
    return np.array(numbers[0]), np.array(numbers[1])


def angle_limit(m_b: Array) -> Array:
    """Return the limit of β for any other m_B: 4 m_B, at most π/2."""
    return _LIMIT * np.minimum(m_b, 0.5 * np.pi / _LIMIT)


def fit_table(
    m_b: Array,
    limit: Array,
    metric: Metric,
    *,
    extended: bool = False,
    progress: Callable[[int], None] = lambda rows: None,
) -> list[Row]:
    """Fit every column of the table for a sweep of m_B, and return its rows.

    Under the unit metric by the paper's protocol, on β up to a limit for each m_B. Under others
    over the hemisphere, with the relative root mean square of `remaining_error`. An extended table
    has the distributions that the paper's lacks, too: a parameter under the name of the
    distribution, ``gamma_`` and ``rmse_`` before it. `progress` is called with the number of rows
    done after each batch.
    """
    rows: list[Row] = []
    for start in range(0, m_b.size, _BATCH):
        batch = slice(start, start + _BATCH)
        with np.errstate(all="ignore"):  # what overflows has no best fit
            columns = _columns(m_b[batch], limit[batch], metric, extended=extended)
        table = np.stack([*columns.values()], 1).tolist()
        rows += [dict(zip(columns, row, strict=True)) for row in table]
        progress(min(start + _BATCH, m_b.size) - start)
    return rows


def printed_cells(ours: list[Row] | None = None) -> Iterator[dict[str, Any]]:
    """Yield the 153 printed parameters and errors beside ours, fitted anew if not given.

    `units` is the difference in units of the last printed digit; a reason has what does not agree.
    """
    reasons = {(row["m_b"], row["column"]): row["reason"] for row in read_rows("table2_missed.csv")}
    ours = fit_table(*paper_sweep(), Unit()) if ours is None else ours
    for printed, row in zip(read_rows("table2.csv"), ours, strict=True):
        for column in COLUMNS[2:]:
            agrees = abs(row[column] / float(printed[column]) - 1) <= AGREEMENT
            difference = row[column] - float(printed[column])
            yield {
                "m_b": printed["m_b"],
                "column": column,
                "printed": printed[column],
                "ours": row[column],
                "units": difference / _last_digit(column, printed[column]),
                "agrees": agrees,
                "reason": "" if agrees else reasons.get((printed["m_b"], column), "unexplained"),
            }


def _columns(m_b: Array, limit: Array, metric: Metric, *, extended: bool) -> dict[str, Array]:
    """Return the columns of the table, in order."""
    source, n_eq11 = distribution(_SOURCE), 2 / np.square(m_b)
    # An exponent that is none has no error either.
    legal = distribution(FITTED["n"]).parameter.accepts(n_eq11)
    _check_answers(m_b, np.where(legal, n_eq11, np.nan), FITTED["n"])
    protocol = metric.name == Unit.name
    samples = UniformSamples(limit, SAMPLES) if protocol else None
    by_eq11 = source, m_b, distribution(FITTED["n"])
    if samples is None:
        rmse_eq11, _ = remaining_error(*by_eq11, n_eq11, metric)
    else:
        rows = np.arange(m_b.size)
        task = ConversionTask(*by_eq11, metric, samples)
        distance, _ = task.problem(rows).distance(np.log(n_eq11), rows)
        rmse_eq11 = np.sqrt(distance / SAMPLES)
    columns = {"m_b": m_b, "n_eq11": n_eq11, "rmse_n_eq11": rmse_eq11}
    targets = {column: distribution(name) for column, name in FITTED.items()}
    if extended:
        known = (source, *targets.values())
        others = [mdf for mdf in one_parameter_distributions() if mdf not in known]
        targets |= {mdf.name.replace("-", "_"): mdf for mdf in others}
    for column, target in targets.items():
        solve = fit_free_gamma if target.second_parameter else fit
        fitted = solve(source, m_b, target, metric, samples)
        columns[column] = best = fitted.parameter
        gamma = fitted.gamma if isinstance(fitted, FreeFit) else None
        if gamma is not None:
            columns[f"gamma_{column}"] = gamma
        _check_answers(m_b, best, target.name)
        if samples is None:
            rmse, _ = remaining_error(source, m_b, target, best, metric, gamma)
        else:
            # A degree of freedom is spent for each parameter.
            rmse = np.sqrt(np.maximum(fitted.distance, 0) / (SAMPLES - len(target.parameters)))
        columns[f"rmse_{column}"] = rmse
    return columns


def _check_answers(m_b: Array, parameter: Array, name: str) -> None:
    if np.isnan(parameter).any():
        bad = float(m_b[int(np.argmax(np.isnan(parameter)))])
        raise MdfconvError(f"{_SOURCE} m_B = {bad:g} has no best fit in {name}")


def _last_digit(column: str, printed: str) -> float:
    """Return the unit of the last printed digit."""
    mantissa, _, exponent = printed.partition("e")
    decimals = len(mantissa.partition(".")[2])
    if column == "n_ds" and float(printed) >= 20000:
        # Printed to four figures; the zeros behind them only hold the place.
        return float(10 ** (len(mantissa) - 4))
    return float(10.0 ** (int(exponent or 0) - decimals))


@dataclass(frozen=True)
class Law:
    """A printed formula from one distribution to another, in text with letters for coefficients.

    `shape` takes the source's parameters and then the coefficients.
    """

    source: str
    target: str
    text: str
    shape: Callable[..., Array]
    printed: tuple[float, ...]


@dataclass(frozen=True)
class Refit:
    """A formula refitted to the table of a metric, least squares of the relative error.

    The errors are the worst relative ones over the rows, with the printed coefficients and with
    these.
    """

    form: Law
    metric: str
    coefficients: tuple[float, ...]
    printed_error: float
    error: float


def _inverse_square(x: Array, a: float, b: float) -> Array:
    return a / x**2 - b


def _root(x: Array, a: float, b: float) -> Array:
    return np.sqrt(a) / np.sqrt(x + b)


def _odd(x: Array, a: float, b: float) -> Array:
    return a * x + b * x**3


FORMS: Sequence[Law] = (
    Law("beckmann", "blinn-phong", "N = a/m_B² − b", _inverse_square, (2, 2.5)),
    Law("blinn-phong", "beckmann", "m_B = √a/√(N+b)", _root, (2, 2.5)),
    Law("beckmann", "gauss", "m_G = m_B + a m_B³", lambda x, a: x + a * x**3, (0.5591,)),
    Law("gauss", "beckmann", "m_B = m_G − a m_G³", lambda x, a: x - a * x**3, (0.4134,)),
    Law("gauss", "blinn-phong", "N = a/m_G² − b", _inverse_square, (2, 0.5)),
    Law("blinn-phong", "gauss", "m_G = √a/√(N+b)", _root, (2, 0.5)),
    Law("blinn-phong", "sawicki", "N_DS = a N + b", lambda x, a, b: a * x + b, (1.174, 0.3)),
    Law("sawicki", "blinn-phong", "N = (N_DS − b)/a", lambda x, a, b: (x - b) / a, (1.174, 0.3)),
    Law("ggx", "gauss", "m_G = a C + b C³", _odd, (0.8222, 0.82)),
    Law("ggx", "beckmann", "m_B = a C + b C⁴", lambda x, a, b: a * x + b * x**4, (0.8388, 0.7)),
    Law("ggx", "blinn-phong", "N = a²/C² − b", lambda x, a, b: (a / x) ** 2 - b, (1.696, 4.5)),
    Law("gauss", "ggx", "C = a m_G + b m_G³", _odd, (1.186, -0.835)),
    Law("beckmann", "ggx", "C = a m_B + b m_B³", _odd, (1.2, -0.56)),
    Law("blinn-phong", "ggx", "C = a/√(N+b)", lambda x, a, b: a / np.sqrt(x + b), (1.697, 4.5)),
)  # fmt: skip

_DECIMALS = 7
_SOURCES = {_SOURCE: "m_b"} | {name: column for column, name in FITTED.items()}


def refit(metric: Metric) -> list[Refit]:
    """Refit every printed formula to the table of a metric over the paper's sweep.

    The unit metric gives the table that the paper's own coefficients were fitted to.
    """
    rows = fit_table(*paper_sweep(), metric)
    table = {name: np.array([row[key] for row in rows]) for name, key in _SOURCES.items()}
    return [_refit_one(form, metric, table[form.source], table[form.target]) for form in FORMS]


def refit_rows(metrics: Sequence[Metric]) -> list[dict[str, Any]]:
    """Return the refitted formulas under each metric as rows of a table."""
    return [
        {
            "from": refitted.form.source,
            "to": refitted.form.target,
            "formula": refitted.form.text,
            "metric": refitted.metric,
            "printed": _coefficients(refitted.form.printed),
            "worst_printed": refitted.printed_error,
            "refitted": _coefficients(refitted.coefficients),
            "worst_refitted": round(refitted.error, _DECIMALS),
        }
        for metric in metrics
        for refitted in refit(metric)
    ]


def _coefficients(values: Sequence[float]) -> str:
    # Where a power has no part, what is left of its coefficient is rounding.
    return " ".join(f"{round(value, _DECIMALS) + 0.0:.6g}" for value in values)


def _refit_one(form: Law, metric: Metric, x: Array, y: Array) -> Refit:
    from scipy.optimize import least_squares

    def relative(coefficients: Sequence[float]) -> Array:
        return form.shape(x, *coefficients) / y - 1

    with np.errstate(invalid="ignore"):
        best = least_squares(relative, form.printed, x_scale="jac", xtol=1e-14, ftol=1e-14).x
    errors = (float(np.max(np.abs(relative(each)))) for each in (form.printed, best))
    return Refit(form, str(metric), tuple(best.tolist()), *errors)
