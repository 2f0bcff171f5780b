"""What the plots of a fit show, before anything is drawn: data, recommended fit and residuals."""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from mdfconv.brdf.microfacet import direction, polar_angle
from mdfconv.distributions.evaluation import Array, Indices
from mdfconv.measured.analysis import ChannelFits
from mdfconv.measured.brdf_fit import MeasuredFit
from mdfconv.measured.samples import DirectionalSamples, Samples, wavelengths_of
from mdfconv.measured.scans import incidence_groups

# Colours that a plot has for angles of incidence.
COLORS = 8
# Of a plot; more dots do not change it.
_MOST_DOTS = 1500
# So near the plane of incidence a sample belongs to the scan in it, degrees.
_IN_PLANE = 3.0
# Of a sine that is 0 but for rounding.
_UPRIGHT = 1e-9
# Fewer samples in the plane are no scan.
_SHORTEST_SCAN = 4
# Steps of a curve, degrees; towards the mirror direction they shrink to follow a narrow peak.
_STEP = 0.25
_NARROWEST_STEP = 0.01
# Channels that have plots of their own; of more the middle one has.
_MOST_CHANNELS = 3
# Discs of residuals, one an angle of incidence.
_MOST_DISCS = 6
# Of fewer samples at each an angle of incidence is one of many directions by chance.
_FEWEST_AT_ANGLE = 20
# Of samples beside the plane this share makes a hemisphere.
_HEMISPHERE = 0.3
# Of the residuals this share decides the axis; those beyond are drawn at its end.
_SHOWN_SHARE = 0.99
# The noise band, standard deviations.
_BAND = 2.0
_BETA = "β between normal and half vector (°)"
_IN_PLANE_ANGLE = "θ_o in the plane of incidence (°)"
# A symbol with its index, and what may follow it: f_r, θ_i.
SUBSCRIPT = re.compile(r"\b([fkFθφαmCN])_([a-z]|[A-Z]{1,2})\b([ .,:)]?)")


@dataclass(frozen=True)
class Curve:
    """Points of a panel.

    The kind is ``"dots"``, ``"line"``, ``"dotted"``, or ``"bars"``: dots with an error. The colour
    is one of `COLORS`, None that of the text; the label stands at the highest point.
    """

    kind: str
    x: Array
    y: Array
    color: int | None = None
    label: str = ""
    error: Array | None = None


@dataclass(frozen=True)
class Panel:
    """A plot: curves over an axis, which `x_range` and `y_range` cover.

    `band` is a range of y behind the curves; `remark` says what is not shown.
    """

    title: str
    x_label: str
    y_label: str
    curves: Sequence[Curve]
    x_range: tuple[float, float]
    y_range: tuple[float, float]
    logarithmic: bool = False
    band: tuple[float, float] | None = None
    remark: str = ""


@dataclass(frozen=True)
class Disc:
    """The residuals of one angle of incidence; x and y are θ_o over 90° away from the normal.

    x points to the mirror direction, which is `mirror` away from the normal.
    """

    label: str
    x: Array
    y: Array
    value: Array
    mirror: float


@dataclass(frozen=True)
class DiscPanel:
    """Discs of residuals from −limit to limit."""

    title: str
    discs: Sequence[Disc]
    limit: float
    remark: str = ""


AnyPanel: TypeAlias = Panel | DiscPanel


def panels(result: ChannelFits) -> Iterator[AnyPanel]:
    """Yield what is to be seen of the recommended fit.

    Data and fit, and the residuals, of each channel or of the middle one of many; the parameter
    of each incidence alone; k_d and F₀ over many channels.
    """
    count = len(result.samples.channels)
    shown = range(count) if count <= _MOST_CHANNELS else [count // 2]
    for channel in shown:
        view = _view(result, channel)
        yield view.data()
        yield view.residuals()
        if channel == shown[0] and len(result.by_incidence) > 1:
            yield _by_incidence(result)
        if isinstance(view, _DirectionView) and view.is_hemisphere:
            yield view.discs()
    if count > _MOST_CHANNELS:
        yield from _by_channel(result)


def runner_up(result: ChannelFits) -> MeasuredFit | None:
    """Return the best fit besides the recommended one."""
    return next((fit for fit in result.fits if fit is not result.recommended), None)


class _View(ABC):
    """One channel of a result, as plots show it."""

    def __init__(self, result: ChannelFits, channel: int) -> None:
        self.result, self.channel = result, channel
        self.samples = result.samples
        self.values = result.samples.values[:, channel]
        self.residual = result.log_ratio[:, channel]
        self.of_channel = ""
        if len(result.samples.channels) > 1:
            self.of_channel = f", channel {result.samples.channels[channel]}"

    @cached_property
    def limit(self) -> float:
        """The end of the axis of residuals."""
        size = np.abs(self.residual[np.isfinite(self.residual)])
        if not size.size:
            return 1.0
        noise = self.result.noise if np.isfinite(self.result.noise) else 0.0
        return float(max(1.2 * np.quantile(size, _SHOWN_SHARE), 1.5 * _BAND * noise, 1e-3))

    @property
    def beyond(self) -> str:
        """How many residuals are drawn at the end of the axis, if any."""
        count = int(np.count_nonzero(np.abs(self.residual) > self.limit))
        return f"{count} beyond the axis are drawn at its end" if count else ""

    def data_panel(
        self, curves: Sequence[Curve], x_label: str, y_label: str, remark: str = ""
    ) -> Panel:
        """Return data and fits on a logarithmic axis."""
        seen = [curve.y[curve.y > 0] for curve in curves if curve.kind != "dotted"]
        y = np.concatenate([part for part in seen if part.size] or [np.ones(1)])
        # Above the curves there are their labels.
        span = max(np.log10(y.max() / y.min()), 0.3)
        low, high = y.min() / 10 ** (0.04 * span), y.max() * 10 ** (0.12 * span)
        title = f"Data and fit{self.of_channel}"
        x_range = _range_of(curves)
        return Panel(title, x_label, y_label, curves, x_range, (low, high), True, None, remark)

    def residual_panel(self, curves: Sequence[Curve], x_label: str) -> Panel:
        """Return residuals of the logarithm about the band of the noise."""
        noise = _BAND * self.result.noise
        band = (-noise, noise) if np.isfinite(noise) else None
        ends = -self.limit, self.limit
        inside = [
            Curve(curve.kind, curve.x, np.clip(curve.y, *ends), curve.color) for curve in curves
        ]
        title = f"Residuals{self.of_channel}"
        ranges = _range_of(curves), ends
        return Panel(title, x_label, "ln(fit/data)", inside, *ranges, False, band, self.beyond)

    def fits(self) -> Iterator[tuple[str, MeasuredFit]]:
        """Yield the fits to draw, the recommended one last, with the kind of its curve."""
        second = runner_up(self.result)
        if second:
            yield "dotted", second
        yield "line", self.result.recommended

    @abstractmethod
    def data(self) -> Panel:
        """Return data and fits."""

    @abstractmethod
    def residuals(self) -> Panel:
        """Return what the recommended fit leaves."""


class _SliceView(_View):
    """Samples of one angle."""

    def data(self) -> Panel:
        data = self.samples
        assert isinstance(data, Samples)
        fine = _fine_grid(0.0, *np.degrees(data.beta[[0, -1]]).tolist())
        blank = np.zeros((fine.size, len(data.channels)))
        grid = Samples(np.radians(fine), blank, data.channels, data.quantity)
        some = _thinned(self.values.size, _MOST_DOTS)
        curves = [Curve("dots", np.degrees(data.beta[some]), self.values[some], 0)]
        for kind, fit in self.fits():
            curves.append(Curve(kind, fine, fit.model(grid)[:, self.channel], 0))
        y_label = "f_r (1/sr)" if data.quantity == "brdf" else "distribution"
        return self.data_panel(curves, _BETA, y_label)

    def residuals(self) -> Panel:
        assert isinstance(self.samples, Samples)
        return self.residual_panel([_over_half_angle(self, np.degrees(self.samples.beta))], _BETA)


def _over_half_angle(view: _View, degrees: Array) -> Curve:
    some = _thinned(degrees.size, _MOST_DOTS)
    return Curve("dots", degrees[some], view.residual[some], 0)


@dataclass(frozen=True)
class _PlaneScan:
    """Samples in the plane of incidence: their indices in order of θ_o, which is signed."""

    incidence: float
    index: Indices
    angle: Array
    color: int = 0


class _DirectionView(_View):
    """Samples of two directions: scans in the plane of incidence."""

    def __init__(self, result: ChannelFits, channel: int) -> None:
        super().__init__(result, channel)
        data = self.samples
        assert isinstance(data, DirectionalSamples)
        self.incidence = np.degrees(polar_angle(data.incident))
        self.outgoing = np.degrees(polar_angle(data.outgoing))
        (x, y), (u, v) = data.incident[:, :2].T, data.outgoing[:, :2].T
        # Light along the normal has no azimuth, and so that of the x axis.
        x = np.where(np.hypot(x, y) < _UPRIGHT, 1, x)
        # Towards the mirror direction, and aside.
        self.along, self.aside = -(x * u + y * v), x * v - y * u
        self.groups = incidence_groups(data)

    @cached_property
    def in_plane(self) -> NDArray[np.bool_]:
        """Which samples are in the plane of incidence."""
        away = np.degrees(np.arctan2(np.abs(self.aside), np.abs(self.along)))
        # Along the normal every plane is that of incidence.
        is_upright = np.minimum(self.incidence, self.outgoing) < _IN_PLANE
        return np.asarray((away < _IN_PLANE) | is_upright)

    @property
    def has_few_angles(self) -> bool:
        """Whether the samples are at angles of incidence that were chosen."""
        return len(self.groups) * _FEWEST_AT_ANGLE <= len(self.incidence)

    @property
    def is_hemisphere(self) -> bool:
        """Whether samples cover more than the plane at each angle of incidence."""
        return self.has_few_angles and bool(np.mean(~self.in_plane) > _HEMISPHERE)

    @cached_property
    def scans(self) -> list[_PlaneScan]:
        """The scans to draw: of many angles of incidence some, from the least to the largest."""
        found = []
        for angle, group in self.groups:
            index = group[self.in_plane[group]]
            signed = np.where(self.along[index] >= 0, 1, -1) * self.outgoing[index]
            order = np.argsort(signed, kind="stable")
            if index.size >= _SHORTEST_SCAN:
                found.append(_PlaneScan(angle, index[order], signed[order]))
        self.scanned = len(found)
        count = sum(scan.index.size for scan in found)
        if not self.has_few_angles and 2 * count < len(self.incidence):
            return []
        chosen = [found[place] for place in _spread(len(found), COLORS)]
        colors = np.linspace(0, COLORS - 1, len(chosen)).round().astype(int).tolist()
        return [replace(scan, color=color) for scan, color in zip(chosen, colors, strict=True)]

    def data(self) -> Panel:
        if not self.scans:
            return self._cloud()
        low = min(scan.angle[0] for scan in self.scans)
        high = max(scan.angle[-1] for scan in self.scans)
        curves = self._dots(self.values)
        grids = [_fine_grid(scan.incidence, low, high) for scan in self.scans]
        for kind, fit in self.fits():
            lines = self._model(fit, grids)
            for scan, grid, line in zip(self.scans, grids, lines, strict=True):
                label = f"{scan.incidence:.3g}°" if kind == "line" else ""
                curves.append(Curve(kind, grid, line, scan.color, label))
        remark = ""
        if self.scanned > len(self.scans):
            remark = f"{len(self.scans)} of {self.scanned} angles of incidence"
        return self.data_panel(curves, _IN_PLANE_ANGLE, "f_r (1/sr)", remark)

    def _model(self, fit: MeasuredFit, grids: Sequence[Array]) -> list[Array]:
        """Return a fit over θ_o in the plane, for each scan."""
        incident = np.concatenate(
            [
                np.full(grid.size, np.radians(scan.incidence))
                for scan, grid in zip(self.scans, grids, strict=True)
            ]
        )
        signed = np.radians(np.concatenate(grids))
        outgoing = direction(np.abs(signed), np.where(signed < 0, 0.0, np.pi))
        channels = self.samples.channels
        values = np.zeros((signed.size, len(channels)))
        fine = DirectionalSamples(direction(incident), outgoing, values, channels)
        line = fit.model(fine)[:, self.channel]
        return np.split(line, np.cumsum([grid.size for grid in grids])[:-1])

    def residuals(self) -> Panel:
        if not self.scans:
            return self.residual_panel([_over_half_angle(self, self._half_angles())], _BETA)
        return self.residual_panel(self._dots(self.residual), _IN_PLANE_ANGLE)

    def _dots(self, values: Array) -> list[Curve]:
        """Return the values of samples in scans."""
        curves = []
        for scan in self.scans:
            some = _thinned(scan.index.size, _MOST_DOTS // len(self.scans))
            curves.append(Curve("dots", scan.angle[some], values[scan.index[some]], scan.color))
        return curves

    def _cloud(self) -> Panel:
        """Return data and fit over β, of directions that make no scans."""
        some = _thinned(self.values.size, _MOST_DOTS // 2)
        half = self._half_angles()[some]
        near = self.result.recommended.model(self.samples.select(some))[:, self.channel]
        curves = [
            Curve("dots", half, self.values[some], 0, "data"),
            Curve("dots", half, near, COLORS - 1, "fit"),
        ]
        return self.data_panel(curves, _BETA, "f_r (1/sr)")

    def _half_angles(self) -> Array:
        assert isinstance(self.samples, DirectionalSamples)
        return np.degrees(polar_angle(self.samples.half))

    def discs(self) -> DiscPanel:
        """Return the residuals over the hemisphere."""
        chosen = _spread(len(self.groups), _MOST_DISCS)
        discs = []
        for angle, group in (self.groups[place] for place in chosen):
            index = group[_thinned(group.size, _MOST_DOTS // len(chosen))]
            turn = np.arctan2(self.aside[index], self.along[index])
            radius = self.outgoing[index] / 90
            value = np.clip(self.residual[index], -self.limit, self.limit)
            x, y = radius * np.cos(turn), radius * np.sin(turn)
            discs.append(Disc(f"θ_i {angle:.3g}°", x, y, value, angle / 90))
        title = f"Residuals over the hemisphere{self.of_channel}"
        return DiscPanel(title, discs, self.limit, self.beyond)


def _view(result: ChannelFits, channel: int) -> _SliceView | _DirectionView:
    kind = _SliceView if isinstance(result.samples, Samples) else _DirectionView
    return kind(result, channel)


def _by_incidence(result: ChannelFits) -> Panel:
    """Return the parameter of each incidence alone, and the one of all as a line."""
    told = [one for one in result.by_incidence if np.isfinite(one.parameter)]
    angle, parameter, error = (
        np.array([getattr(one, name) for one in told], float)
        for name in ("angle", "parameter", "parameter_error")
    )
    fit = result.recommended
    joint, spread = fit.parameter, fit.parameter_error
    high = 1.3 * max(joint, parameter.max(initial=0.0))
    angles = [one.angle for one in result.by_incidence]
    x_range = _widened(min(angles), max(angles))
    ends = np.array(x_range)
    symbol = fit.distribution.parameter.symbol
    curves = [
        Curve("line", ends, np.full(2, joint), 1),
        Curve("bars", angle, parameter, None, "", np.where(np.isfinite(error), error, 0)),
    ]
    band = (joint - spread, joint + spread) if np.isfinite(spread) else None
    missing = len(result.by_incidence) - len(told)
    remark = "line: all together" + (f"; {missing} do not determine it" if missing else "")
    title = f"Does one {symbol} hold at all angles?"
    y_label = f"{symbol} of this incidence alone"
    return Panel(title, "θ_i (°)", y_label, curves, x_range, (0.0, high), False, band, remark)


def _by_channel(result: ChannelFits) -> Iterator[Panel]:
    """Yield what each of many channels reflects, over its wavelength if it has one."""
    named = wavelengths_of(result.samples.channels)
    x = np.arange(1.0, 1 + len(result.samples.channels)) if named is None else named
    x_label = "channel" if named is None else "wavelength λ (nm)"
    fit = result.recommended
    for title, symbol, values, errors in (
        ("Diffuse albedo", "k_d", fit.diffuse, fit.diffuse_error),
        ("Reflectance along the normal", "F₀", fit.f0, fit.f0_error),
    ):
        # A dielectric has one index, and one F₀.
        if values is None or errors is None or np.ptp(values) == 0:
            continue
        y, error = np.array(values), np.nan_to_num(np.array(errors, float), posinf=0)
        high = 1.15 * max(float((y + error).max()), 1e-3)
        low = min(0.0, float((y - error).min()))
        curves = [Curve("line", x, y, 1), Curve("bars", x, y, 1, "", error)]
        yield Panel(title, x_label, symbol, curves, _widened(x.min(), x.max()), (low, high))


def _fine_grid(incidence: float, low: float, high: float) -> Array:
    """Return θ_o from low to high, degrees, finest about the mirror direction."""
    steps = np.geomspace(_NARROWEST_STEP, 20 * _STEP, 60)
    even = np.linspace(low, high, int(np.ceil((high - low) / _STEP)) + 1)
    grid = np.concatenate([even, incidence - steps, [incidence], incidence + steps])
    return np.unique(grid[(grid >= low) & (grid <= high)])


def _spread(count: int, most: int) -> Indices:
    """Return at most so many of a number of places, evenly from the first to the last."""
    return np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(int))


def _thinned(count: int, most: int) -> Indices:
    """Return which of some samples are drawn: all, or a choice that makes no pattern."""
    if count <= most:
        return np.arange(count)
    return np.sort(np.random.default_rng(0).choice(count, most, replace=False))


def _range_of(curves: Sequence[Curve]) -> tuple[float, float]:
    x = np.concatenate([curve.x for curve in curves])
    return _widened(x.min(), x.max(), 0.02)


def _widened(low: float, high: float, share: float = 0.08) -> tuple[float, float]:
    room = share * (high - low) or 1.0
    return float(low - room), float(high + room)
