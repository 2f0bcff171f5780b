"""The pictures of Figures 1 and 2."""

from __future__ import annotations

from typing import Any

import numpy as np

from mdfconv.distributions import distribution
from mdfconv.output.figures import encoded, line_style, new_figure
from mdfconv.paper.error_curves import Curves

_SIZE = (7.2, 7.0)  # inches
_FLOOR = 1e-6  # of the logarithmic axis


def draw_errors(
    drawn: Curves, title: str, *, form: str = "png", dpi: int = 150, log: bool = False
) -> bytes:
    """Return a picture of curves (a) and of their error (b).

    Parameters
    ----------
    drawn : Curves
        The curves.
    title : str
        What is shown.
    form : str
        ``"png"`` or ``"svg"``.
    dpi : int
        Resolution of a PNG.
    log : bool
        Whether (a) is logarithmic, for the tails.
    """
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
        upper.set_yscale("log")
        upper.set_ylim(_FLOOR, 2)
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
