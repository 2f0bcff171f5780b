"""The paper's closed forms as what they are: fits to Table 2, redone under every metric."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from mdfconv.distributions.evaluation import Array
from mdfconv.fitting.metrics import Metric
from mdfconv.studies.table2 import FITTED, fit_table, paper_sweep


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
    Law(
        "ggx", "beckmann", "m_B = a C + b C⁴", lambda x, a, b: a * x + b * x**4, (0.8388, 0.7)
    ),
    Law(
        "ggx", "blinn-phong", "N = a²/C² − b", lambda x, a, b: (a / x) ** 2 - b, (1.696, 4.5)
    ),
    Law("gauss", "ggx", "C = a m_G + b m_G³", _odd, (1.186, -0.835)),
    Law("beckmann", "ggx", "C = a m_B + b m_B³", _odd, (1.2, -0.56)),
    Law("blinn-phong", "ggx", "C = a/√(N+b)", lambda x, a, b: a / np.sqrt(x + b), (1.697, 4.5)),
)  # fmt: skip

_DECIMALS = 9
_COLUMNS = {"beckmann": "m_b"} | {name: column for column, name in FITTED.items()}


def refit(metric: Metric) -> list[Refit]:
    """Refit every printed formula to the table of a metric over the paper's sweep.

    The unit metric gives the table that the paper's own coefficients were fitted to.
    """
    rows = fit_table(*paper_sweep(), metric)
    table = {name: np.array([row[key] for row in rows]) for name, key in _COLUMNS.items()}
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
    def relative(coefficients: Array) -> Array:
        return form.shape(x, *coefficients) / y - 1

    with np.errstate(invalid="ignore"):
        best = least_squares(relative, form.printed, x_scale="jac", xtol=1e-14, ftol=1e-14).x
    return Refit(
        form=form,
        metric=str(metric),
        coefficients=tuple(best.tolist()),
        printed_error=float(np.max(np.abs(relative(np.array(form.printed))))),
        error=float(np.max(np.abs(relative(best)))),
    )
