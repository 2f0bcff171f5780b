"""The pictures of fits to measurements: data, fits, and what they leave."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from mdfconv.brdf.microfacet import polar_angle
from mdfconv.distributions.evaluation import Array, Indices
from mdfconv.measured.analysis import Analysis, ChannelFits
from mdfconv.measured.brdf_fit import MeasuredFit
from mdfconv.measured.samples import DirectionalSamples, Samples
from mdfconv.output.figures import PAGE, encoded, line_style, new_figure

# Of a curve, one a pixel.
_POINTS = 600
# Side by side; pictures of more would be unreadable.
_MOST_CHANNELS = 6
# Angles of incidence that a picture can tell apart.
_MOST_CURVES = 8
# So near to each other two angles of incidence are one, degrees.
_SAME_ANGLE = 0.25
# So near the plane of incidence a sample belongs to the scan in it, degrees.
_IN_PLANE = 3.0
# Of a cloud, which more do not change.
_MOST_POINTS = 4000


def draw_analysis(analysis: Analysis, *, logarithms: bool) -> bytes:
    """Return a PNG of every channel and the fits to it.

    Residuals are of logarithms where the fit minimized those.
    """
    panels = [
        (result, channel)
        for result in analysis.results
        for channel in range(len(result.samples.channels))
    ]
    if isinstance(analysis.samples, DirectionalSamples):
        return _draw_directions(panels, analysis.name, logarithms=logarithms)
    return _draw_slices(panels[:_MOST_CHANNELS], analysis.name, logarithms=logarithms)


def draw_parts(analysis: Analysis, *, logarithms: bool) -> Iterator[tuple[str, bytes]]:
    """Yield the pictures of a page by what they show.

    One for each channel of two directions; of one angle all channels on linear and on logarithmic
    axes.
    """
    if isinstance(analysis.samples, Samples):
        for name, kind in (("linear", False), ("logarithmic", True)):
            yield name, draw_analysis(analysis, logarithms=kind)
        return
    for result in analysis.results:
        for channel, name in enumerate(result.samples.channels):
            panel = [(result, channel)]
            picture = _draw_directions(panel, analysis.name, logarithms=logarithms)
            yield f"channel {name}", picture


def _draw_slices(
    panels: Sequence[tuple[ChannelFits, int]], title: str, *, logarithms: bool
) -> bytes:
    """Return a PNG with a column for each channel: data and fits, the residuals beneath."""
    alone = len(panels) == 1
    figure = new_figure(PAGE[0] * (1 + 0.6 * (len(panels) - 1)), PAGE[1])
    axes = figure.subplots(2, len(panels), sharex=True, height_ratios=(3, 2), squeeze=False)
    for (upper, lower), (result, channel) in zip(axes.T, panels, strict=True):
        data = result.samples
        assert isinstance(data, Samples)
        degrees, values = np.degrees(data.beta), data.values[:, channel]
        fine = replace(data, beta=np.linspace(data.beta[0], data.beta[-1], _POINTS))
        upper.plot(degrees, values, "o", color="0.6", markersize=3, label="data")
        for fit in result.fits:
            style = line_style(fit.distribution.name)
            curve = fit.model(fine)[:, channel]
            upper.plot(np.degrees(fine.beta), curve, label=_label(fit), **style)
            residual = _residual(fit.model(data)[:, channel], values, logarithms=logarithms)
            lower.plot(degrees, residual, **style)
        if logarithms:
            upper.set_yscale("log", nonpositive="mask")
        upper.set_title(title if alone else f"{title}, {data.channels[channel]}")
        upper.legend(fontsize=8 if alone else 7)
        lower.set_xlabel("β between normal and half vector [degrees]")
        if upper is axes[0, 0]:
            upper.set_ylabel("BRDF [1/sr]" if data.quantity == "brdf" else "distribution")
            lower.set_ylabel("ln(fit/data)" if logarithms else "fit − data")
    return encoded(figure)


def _label(fit: MeasuredFit) -> str:
    fitted = zip(fit.distribution.parameters, fit.parameters.values(), strict=False)
    numbers = (f"{parameter.symbol} = {value:.4g}" for parameter, value in fitted)
    return f"{fit.distribution.name}, {', '.join(numbers)}"


def _residual(near: Array, values: Array, *, logarithms: bool) -> Array:
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.log(near / values) if logarithms else near - values


def _draw_directions(
    panels: Sequence[tuple[ChannelFits, int]], title: str, *, logarithms: bool
) -> bytes:
    """Return a PNG with a row for each channel and its best fit.

    f_r over the angle of reflection on both axes, the residuals, and those over β.
    """
    figure = new_figure(PAGE[0] * 2, PAGE[1] * 0.62 * len(panels) + 0.4)
    axes = figure.subplots(len(panels), 4, squeeze=False)
    for row, (result, channel) in zip(axes, panels, strict=True):
        linear, logarithmic, residual, scatter = row
        data, fit = result.samples, result.fits[0]
        assert isinstance(data, DirectionalSamples)
        values, near = data.values[:, channel], fit.model(data)[:, channel]
        error = _residual(near, values, logarithms=logarithms)
        for index, angle, color, label in _scans(data):
            for panel in (linear, logarithmic):
                panel.plot(angle, values[index], ".", color=color, markersize=3)
                panel.plot(angle, near[index], "-", color=color, label=label)
            residual.plot(angle, error[index], "-", color=color, linewidth=0.8)
        some = np.linspace(0, values.size - 1, min(values.size, _MOST_POINTS)).astype(int)
        half = np.degrees(polar_angle(data.half[some]))
        scatter.plot(half, error[some], ".", color="0.3", markersize=2)
        linear.set(title=f"{title}, {data.channels[channel]}", ylabel="f_r [1/sr]")
        logarithmic.set(title=fit.distribution.label)
        logarithmic.set_yscale("log", nonpositive="mask")
        residual.set(title="ln(fit/data)" if logarithms else "fit − data [1/sr]")
        scatter.set(title="the same over β, all samples")
    for panel in axes[-1, :3]:
        panel.set_xlabel("θ_o in the plane of incidence [degrees]")
    axes[-1, 3].set_xlabel("β of the half vector [degrees]")
    if axes[0, 1].lines:
        axes[0, 1].legend(fontsize=7)
    return encoded(figure, dpi=110)


def incidences(data: DirectionalSamples) -> Array:
    """Return the angles of incidence of samples, degrees, each once."""
    angle, whole = _rounded_incidence(data)
    return np.array([np.median(angle[np.abs(angle - a) <= _SAME_ANGLE]) for a in whole])


def _rounded_incidence(data: DirectionalSamples) -> tuple[Array, Array]:
    """Return the angle of incidence of each sample, and the different ones, in degrees."""
    angle = np.degrees(polar_angle(data.incident))
    return angle, np.unique(np.round(angle / _SAME_ANGLE)) * _SAME_ANGLE


def _scans(data: DirectionalSamples) -> Iterator[tuple[Indices, Array, Any, str]]:
    """Yield the samples in the plane of incidence for some angles of incidence.

    Their indices in order, their θ_o in degrees, positive on the side of the mirror direction, a
    colour and a label.
    """
    from matplotlib import colormaps

    incidence, whole = _rounded_incidence(data)
    outgoing = np.degrees(polar_angle(data.outgoing))
    (x, y), (u, v) = data.incident[:, :2].T, data.outgoing[:, :2].T
    along, side = -(x * u + y * v), x * v - y * u
    signed = np.where(along >= 0, outgoing, -outgoing)
    away = np.degrees(np.arctan2(np.abs(side), np.abs(along)))
    # Along the normal every plane is that of incidence.
    is_upright = np.minimum(incidence, outgoing) < _IN_PLANE
    is_in_plane = (away < _IN_PLANE) | is_upright
    if whole.size > _MOST_CURVES:
        whole = whole[np.linspace(0, whole.size - 1, _MOST_CURVES).astype(int)]
    for number, angle in enumerate(whole):
        index = np.flatnonzero((np.abs(incidence - angle) < _SAME_ANGLE) & is_in_plane)
        index = index[np.argsort(signed[index], kind="stable")]
        color = colormaps["viridis"](0.9 * number / max(1, whole.size - 1))
        yield index, signed[index], color, f"θ_i {angle:.3g}°"
