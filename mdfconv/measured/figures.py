"""The picture of fits to measurements of one angle: data, fits, and what they leave."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from mdfconv.brdf.microfacet import polar_angle
from mdfconv.distributions.evaluation import Array, Indices
from mdfconv.measured.brdf_fit import BrdfFit
from mdfconv.measured.lobe_fit import LobeFit
from mdfconv.measured.samples import DirectionalSamples, Samples
from mdfconv.output.figures import PAGE, encoded, line_style, new_figure

_POINTS = 600  # of a curve, one a pixel
# Side by side; pictures of more would be unreadable.
_MOST_CHANNELS = 6


def draw_fits(
    panels: Sequence[tuple[Samples, Sequence[LobeFit], int]],
    title: str,
    *,
    logarithms: bool = False,
) -> bytes:
    """Return a PNG of samples and fits, with the residuals beneath, a column for each panel.

    Parameters
    ----------
    panels : sequence of (Samples, sequence of LobeFit, int)
        The measurements, the fits to them, and which channel is drawn; of many the first six.
    title : str
        What was measured.
    logarithms : bool
        Whether the axis of values is logarithmic and the residuals are those of logarithms, as
        those that the fit minimized.
    """
    panels = panels[:_MOST_CHANNELS]
    figure = new_figure(PAGE[0] * (1 + 0.6 * (len(panels) - 1)), PAGE[1])
    axes = figure.subplots(2, len(panels), sharex=True, height_ratios=(3, 2), squeeze=False)
    for column, (data, fits, channel) in enumerate(panels):
        upper, lower = axes[:, column]
        _draw_channel(upper, lower, data, fits, channel, logarithms=logarithms)
        named = f"{title}, {data.channels[channel]}"
        upper.set_title(title if len(panels) == 1 else named)
        upper.legend(fontsize=8 if len(panels) == 1 else 7)
        lower.set_xlabel("β between normal and half vector [degrees]")
    brdf = panels[0][0].quantity == "brdf"
    axes[0, 0].set_ylabel("BRDF [1/sr]" if brdf else "distribution")
    axes[1, 0].set_ylabel("ln(fit/data)" if logarithms else "fit − data")
    return encoded(figure)


def _draw_channel(
    upper: Any,
    lower: Any,
    data: Samples,
    fits: Sequence[LobeFit],
    channel: int,
    *,
    logarithms: bool,
) -> None:
    degrees, values = np.degrees(data.beta), data.values[:, channel]
    beta = np.linspace(data.beta[0], data.beta[-1], _POINTS)
    upper.plot(degrees, values, "o", color="0.6", markersize=3, label="data")
    for fit in fits:
        style = line_style(fit.distribution.name)
        fitted = fit.distribution.parameters[: len(fit.parameters)]
        numbers = ", ".join(
            f"{parameter.symbol} = {value:.4g}"
            for parameter, value in zip(fitted, fit.parameters, strict=True)
        )
        curve, near = (fit.model(at, data.quantity)[:, channel] for at in (beta, data.beta))
        label = f"{fit.distribution.name}, {numbers}"
        upper.plot(np.degrees(beta), curve, label=label, **style)
        with np.errstate(divide="ignore", invalid="ignore"):
            residual = np.log(near / values) if logarithms else near - values
        lower.plot(degrees, residual, **style)
    if logarithms:
        upper.set_yscale("log", nonpositive="mask")


# Angles of incidence that a picture can tell apart, and how near samples are one of them, degrees.
_MOST_CURVES, _SAME_ANGLE = 8, 0.25
# So near the plane of incidence a sample belongs to the scan in it, degrees.
_IN_PLANE = 3.0
_MOST_POINTS = 4000


def draw_directional(
    panels: Sequence[tuple[DirectionalSamples, BrdfFit, int]],
    title: str,
    *,
    logarithms: bool = False,
) -> bytes:
    """Return a PNG: f_r over the angle of reflection, on both axes, and the residuals.

    Parameters
    ----------
    panels : sequence of (DirectionalSamples, BrdfFit, int)
        The measurements, a fit to them, and which channel is drawn; a row each.
    title : str
        What was measured.
    logarithms : bool
        Whether residuals are of logarithms, as those that the fit minimized.
    """
    figure = new_figure(PAGE[0] * 2, PAGE[1] * 0.62 * len(panels) + 0.4)
    axes = figure.subplots(len(panels), 4, squeeze=False)
    for row, (data, fit, channel) in zip(axes, panels, strict=True):
        _draw_row(row, data, fit, channel, logarithms=logarithms)
        row[0].set(title=f"{title}, {data.channels[channel]}", ylabel="f_r [1/sr]")
    for panel in axes[-1, :3]:
        panel.set_xlabel("θ_o in the plane of incidence [degrees]")
    axes[-1, 3].set_xlabel("β of the half vector [degrees]")
    if axes[0, 1].lines:
        axes[0, 1].legend(fontsize=7)
    return encoded(figure, dpi=110)


def _draw_row(
    axes: Any, data: DirectionalSamples, fit: BrdfFit, channel: int, *, logarithms: bool
) -> None:
    linear, logarithmic, residual, scatter = axes
    values, near = data.values[:, channel], fit.model(data)[:, channel]
    with np.errstate(divide="ignore", invalid="ignore"):
        error = np.log(near / values) if logarithms else near - values
    scan = _Scan(data)
    for index, color, label in scan.curves():
        angle = scan.signed[index]
        for panel in (linear, logarithmic):
            panel.plot(angle, values[index], ".", color=color, markersize=3)
            panel.plot(angle, near[index], "-", color=color, label=label)
        residual.plot(angle, error[index], "-", color=color, linewidth=0.8)
    some = np.linspace(0, values.size - 1, min(values.size, _MOST_POINTS)).astype(int)
    half = np.degrees(polar_angle(data.half[some]))
    scatter.plot(half, error[some], ".", color="0.3", markersize=2)
    logarithmic.set(title=fit.distribution.label)
    logarithmic.set_yscale("log", nonpositive="mask")
    residual.set(title="ln(fit/data)" if logarithms else "fit − data [1/sr]")
    scatter.set(title="the same over β, all samples")


def incidences(data: DirectionalSamples) -> Array:
    """Return the angles of incidence of samples, degrees, each once."""
    angle = np.degrees(polar_angle(data.incident))
    whole = np.unique(np.round(angle / _SAME_ANGLE)) * _SAME_ANGLE
    found: Array = np.array([np.median(angle[np.abs(angle - a) <= _SAME_ANGLE]) for a in whole])
    return found


class _Scan:
    """The samples in the plane of incidence, by their angles of incidence.

    Attributes
    ----------
    signed : numpy.ndarray, shape (n,)
        θ_o, degrees, positive on the side of the mirror direction.
    """

    def __init__(self, data: DirectionalSamples) -> None:
        self._incidence = np.degrees(polar_angle(data.incident))
        outgoing = np.degrees(polar_angle(data.outgoing))
        (x, y), (u, v) = data.incident[:, :2].T, data.outgoing[:, :2].T
        along, side = -(x * u + y * v), x * v - y * u
        # Along the normal every plane is that of incidence.
        away = np.degrees(np.arctan2(np.abs(side), np.abs(along)))
        upright = np.minimum(self._incidence, outgoing) < _IN_PLANE
        self._in_plane = (away < _IN_PLANE) | upright
        self.signed = np.where(along >= 0, outgoing, -outgoing)

    def curves(self) -> Iterator[tuple[Indices, Any, str]]:
        """Yield samples in order, a colour and a label for each angle of incidence."""
        from matplotlib import colormaps

        whole = np.unique(np.round(self._incidence / _SAME_ANGLE)) * _SAME_ANGLE
        if whole.size > _MOST_CURVES:
            whole = whole[np.linspace(0, whole.size - 1, _MOST_CURVES).astype(int)]
        for number, angle in enumerate(whole):
            near = np.abs(self._incidence - angle) < _SAME_ANGLE
            index = np.flatnonzero(near & self._in_plane)
            index = index[np.argsort(self.signed[index], kind="stable")]
            color = colormaps["viridis"](0.9 * number / max(1, whole.size - 1))
            yield index, color, f"θ_i {angle:.3g}°"
