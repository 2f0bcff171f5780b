"""Table 2 of Sawicki 2021 by the protocol recovered from its numbers, and tables like it.

The paper does not say how it sampled the angles. Every cell but ten comes back with: m_B =
√(2/N) unrounded; β uniform from 0 to a limit of each row's own, about 3000 points; unit forms;
RMSE = √(SSE/(n−1)) where a parameter was fitted and √(SSE/n) for N by equation (11).
"""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib.resources import files

import numpy as np

from mdfconv.conversion.explanation import remaining_error
from mdfconv.distributions import distribution, one_parameter_distributions
from mdfconv.distributions.evaluation import Array
from mdfconv.errors import MdfconvError
from mdfconv.fitting.free_gamma import fit_free_gamma
from mdfconv.fitting.metrics import Metric
from mdfconv.fitting.metrics.base import Unit
from mdfconv.fitting.problem import FitProblem
from mdfconv.fitting.quadrature import UniformSamples
from mdfconv.fitting.solve import fit

# Between 0 and the limit of a row.
SAMPLES = 3001
AGREEMENT = 4e-4  # relative
_LIMIT = 4.0  # β up to 4 m_B, the paper's habit
_BATCH = 64

# What is fitted; column of the paper, and the distribution that fits it.
_SOURCE = "beckmann"
FITTED = {"n": "blinn-phong", "m_g": "gauss", "n_ds": "sawicki", "c_tr": "ggx"}
COLUMNS = (
    "m_b", "n_eq11", "rmse_n_eq11", "n", "rmse_n", "m_g", "rmse_m_g", "n_ds", "rmse_n_ds",
    "c_tr", "rmse_c_tr",
)  # fmt: skip

_EQ11 = "the protocol that returns every other row gives this"
REASONS = {
    ("0.4473", "m_g"): "the fit is 0.4966 on β up to 1.2 and up to 1.4 alike: printed 0.4970 "
    "fits neither",
    (
        "0.4473",
        "rmse_m_g",
    ): "taken on β up to 1.2, which gives 0.03396; the row's other cells are on 1.4",
    ("0.1415", "rmse_m_g"): "a slip of the decimal point for 0.001910",
    ("0.01415", "n_ds"): "printed 11749, the fit is 11739",
    ("0.01415", "rmse_n"): "printed 1.321e-5, the fit is 1.316e-5",
    ("0.005164", "rmse_n"): "printed 1.793e-6, the fit is 1.792e-6",
    ("0.1634", "rmse_n_eq11"): _EQ11,
    ("0.05164", "rmse_n_eq11"): _EQ11,
    ("0.01634", "rmse_n_eq11"): _EQ11,
    ("0.005164", "rmse_n_eq11"): _EQ11,
}

Row = dict[str, float]
Progress = Callable[[int], None]


@dataclass(frozen=True)
class Cell:
    """One printed cell beside ours.

    Parameters
    ----------
    m_b, column : str
        The row, as printed, and the column.
    printed : str
        The printed number.
    ours : float
        The number that the protocol gives.
    units : float
        The difference in units of the last printed digit.
    agrees : bool
        Whether it is within 4e-4 relative.
    reason : str
        Why it does not come back, if it does not.
    """

    m_b: str
    column: str
    printed: str
    ours: float
    units: float
    agrees: bool
    reason: str


def printed_rows() -> list[dict[str, str]]:
    """Return the rows of the paper's Table 2, as printed."""
    return _read("table2.csv")


def paper_sweep() -> tuple[Array, Array]:
    """Return the paper's m_B, unrounded, and the limit of β of each row, radians."""
    rows = _read("table2_protocol.csv")
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
    progress: Progress = lambda rows: None,
) -> list[Row]:
    """Fit every column of the table for a sweep of m_B.

    Parameters
    ----------
    m_b : numpy.ndarray, shape (n,)
        Beckmann's parameters.
    limit : numpy.ndarray, shape (n,)
        The limit of β of each row, radians, for the unit metric.
    metric : Metric
        Unit: the paper's protocol, on 3001 uniform angles, and its RMSE. Others: the fit over
        the hemisphere, with the relative root mean square of `remaining_error`.
    extended : bool
        Whether to add the distributions that the paper's table lacks, with γ of those that
        have one.
    progress : callable
        Told the number of rows done after every batch.

    Returns
    -------
    list of dict
        A row for each m_B: `COLUMNS`, and of each further distribution its parameter under its
        name, ``gamma_`` and ``rmse_`` before it.
    """
    rows: list[Row] = []
    for start in range(0, m_b.size, _BATCH):
        batch = slice(start, start + _BATCH)
        with np.errstate(all="ignore"):  # what overflows has no best fit
            columns = _columns(m_b[batch], limit[batch], metric, extended=extended)
        rows += [
            dict(zip(columns, row, strict=True))
            for row in np.stack([*columns.values()], 1).tolist()
        ]
        progress(min(start + _BATCH, m_b.size) - start)
    return rows


def printed_cells(ours: list[Row] | None = None) -> Iterator[Cell]:
    """Yield the 153 printed parameters and errors beside ours, fitted anew if not given."""
    ours = fit_table(*paper_sweep(), Unit()) if ours is None else ours
    for printed, row in zip(printed_rows(), ours, strict=True):
        for column in COLUMNS[2:]:
            yield _cell(printed["m_b"], column, printed[column], row[column])


def _read(name: str) -> list[dict[str, str]]:
    text = files("mdfconv.studies").joinpath("data", name).read_text()
    return list(csv.DictReader(text.splitlines()))


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
        distance, _ = FitProblem(*by_eq11, metric, samples, rows).distance(np.log(n_eq11), rows)
        rmse_eq11 = np.sqrt(distance / SAMPLES)
    columns = {"m_b": m_b, "n_eq11": n_eq11, "rmse_n_eq11": rmse_eq11}
    targets = FITTED | (further_targets() if extended else {})
    for column, name in targets.items():
        target = distribution(name)
        gamma = None
        if target.second_parameter:
            free = fit_free_gamma(source, m_b, target, metric, samples)
            best, distance, gamma = free.parameter, free.distance, free.gamma
            columns |= {column: best, f"gamma_{column}": gamma}
        else:
            fixed = fit(source, m_b, target, metric, samples)
            best, distance = fixed.parameter, fixed.distance
            columns[column] = best
        _check_answers(m_b, best, name)
        if samples is None:
            rmse, _ = remaining_error(source, m_b, target, best, metric, gamma)
        else:
            # A degree of freedom is spent for each parameter.
            rmse = np.sqrt(np.maximum(distance, 0) / (SAMPLES - len(target.parameters)))
        columns[f"rmse_{column}"] = rmse
    return columns


def further_targets() -> dict[str, str]:
    """Return the distributions that the paper's table lacks, by the names of their columns."""
    known = (_SOURCE, *FITTED.values())
    names = [mdf.name for mdf in one_parameter_distributions() if mdf.name not in known]
    return {name.replace("-", "_"): name for name in names}


def _check_answers(m_b: Array, parameter: Array, name: str) -> None:
    if np.isnan(parameter).any():
        bad = float(m_b[int(np.argmax(np.isnan(parameter)))])
        raise MdfconvError(f"{_SOURCE} m_B = {bad:g} has no best fit in {name}")


def _cell(m_b: str, column: str, printed: str, ours: float) -> Cell:
    value = float(printed)
    agrees = abs(ours / value - 1) <= AGREEMENT
    return Cell(
        m_b=m_b,
        column=column,
        printed=printed,
        ours=ours,
        units=(ours - value) / _last_digit(column, printed),
        agrees=agrees,
        reason="" if agrees else REASONS.get((m_b, column), "unexplained"),
    )


def _last_digit(column: str, printed: str) -> float:
    """Return the unit of the last printed digit."""
    mantissa, _, exponent = printed.partition("e")
    decimals = len(mantissa.partition(".")[2])
    if column == "n_ds" and float(printed) >= 20000:
        # Printed to four figures; the zeros behind them only hold the place.
        return float(10 ** (len(mantissa) - 4))
    return float(10.0 ** (int(exponent or 0) - decimals))
