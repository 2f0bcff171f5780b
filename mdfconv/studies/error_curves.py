"""Curves of distributions and of their error against one of them: Figures 1 and 2."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mdfconv.conversion import convert
from mdfconv.distributions import distribution
from mdfconv.distributions.angles import Angles
from mdfconv.distributions.evaluation import Array
from mdfconv.errors import MdfconvError
from mdfconv.fitting.metrics import Metric, metric_named
from mdfconv.output.figures import encoded, line_style, new_figure
from mdfconv.output.records import csv_text, rounded_rows
from mdfconv.render.comparison import lobe_extent

_MOST_POINTS = 1_000_000


@dataclass(frozen=True)
class Curves:
    """Distributions against β, the reference first, and their error.

    `values` are the metric's signal, D̄ for the unit metric; `errors`, of all but the reference,
    are (signal − reference)/max reference.
    """

    parameters: Mapping[str, float]
    beta: Array
    values: Mapping[str, Array]
    quantity: str
    errors: Mapping[str, Array]

    @property
    def reference(self) -> str:
        """The name of the distribution that the others are compared with."""
        return next(iter(self.parameters))

    def error_text(self) -> str:
        """Return the errors as CSV: beta_rad, then a column a distribution."""
        columns = {"beta_rad": self.beta, **self.errors}
        return csv_text(list(columns), rounded_rows(columns))

    def maxima(self) -> list[dict[str, Any]]:
        """Return for each distribution the largest |error| and where it occurs."""
        largest = {name: int(np.argmax(np.abs(error))) for name, error in self.errors.items()}
        return [
            {
                "distribution": name,
                "parameter": float(self.parameters[name]),
                "max_error_percent": 100 * float(abs(self.errors[name][index])),
                "beta_rad": float(self.beta[index]),
            }
            for name, index in largest.items()
        ]


def parameters_for(
    m_b: float, names: Sequence[str], method: str | None, metric: Metric | None
) -> dict[str, float]:
    """Return the parameters of distributions converted from Beckmann's m_B."""
    return {name: float(convert(m_b, "beckmann", name, method, metric=metric)) for name in names}


def curves(
    parameters: Mapping[str, float], metric: Metric | str = "unit", points: int = 1001
) -> Curves:
    """Evaluate distributions on a range of β that follows the lobe of the first, the reference.

    The unit metric compares unit forms, as the paper; others what they compare in a fit. The
    angles run from 0 to 4.8 β_half of the reference, at most π/2.

    Raises
    ------
    MdfconvError
        If the number of points is none, or the metric does not compare over β.
    """
    if not 2 <= points <= _MOST_POINTS:
        raise MdfconvError(f"the number of points is from 2 to {_MOST_POINTS}")
    metric = metric_named(metric)
    if not metric.over_angles:
        raise MdfconvError(f"{metric} compares spectra: it has no curves over β")
    arrays = {name: np.array([float(value)]) for name, value in parameters.items()}
    reference = next(iter(parameters))
    source = distribution(reference)
    beta = np.linspace(0, float(lobe_extent(source, arrays[reference])[0]), points)
    peak = source.maximum(arrays[reference], normalized=metric.normalized)
    angles = Angles(beta)
    values = {
        name: metric.signal(distribution(name), angles, value, peak)
        for name, value in arrays.items()
    }
    errors = {
        name: (value - values[reference]) / values[reference].max()
        for name, value in values.items()
        if name != reference
    }
    return Curves(parameters, beta, values, metric.quantity, errors)


_SIZE = (7.2, 7.0)  # inches
_FLOOR = 1e-6  # of the logarithmic axis


def draw_errors(
    drawn: Curves, title: str, *, form: str = "png", dpi: int = 150, log: bool = False
) -> bytes:
    """Return a picture of curves (a), logarithmic to show the tails, and of their error (b)."""
    figure = new_figure(*_SIZE)
    upper, lower = figure.subplots(2, 1, sharex=True)
    for name, value in drawn.values.items():
        symbol = distribution(name).parameter.symbol
        label = f"{name}, {symbol} = {drawn.parameters[name]:.5g}"
        _line(upper, drawn, name, value, label)
    for name, error in drawn.errors.items():
        _line(lower, drawn, name, 100 * error, name)
    figure.suptitle(title)
    if log:
        upper.set(yscale="log", ylim=(_FLOOR, 2))
    upper.set_ylabel(f"(a) {drawn.quantity}")
    upper.legend(fontsize=8)
    lower.axhline(0, color="0.4", linewidth=0.8)
    lower.set_ylabel(f"(b) error against {drawn.reference} [%]")
    lower.set_xlabel("β between normal and half vector [rad]")
    lower.set_xlim(0, drawn.beta[-1])
    return encoded(figure, form, dpi)


def _line(axes: Any, drawn: Curves, name: str, value: Any, label: str) -> None:
    """Draw one distribution, on its support and marked where that ends."""
    edge = distribution(name).edge(np.array([drawn.parameters[name]]))
    inside = np.ones(drawn.beta.size, bool) if edge is None else drawn.beta <= edge[0]
    style = line_style(name)
    axes.plot(drawn.beta[inside], value[inside], label=label, **style)
    if not inside.all():
        last = int(np.flatnonzero(inside)[-1])
        axes.plot(drawn.beta[last], value[last], "|", color=style["color"], markersize=11)
