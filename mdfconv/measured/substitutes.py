"""A lobe of another distribution in the place of the one that was fitted, and what it costs."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mdfconv.conversion import explain
from mdfconv.conversion.explanation import remaining_error
from mdfconv.distributions import Distribution
from mdfconv.distributions.angles import Angles
from mdfconv.distributions.endpoint import Endpoint, endpoint, exact_route
from mdfconv.distributions.evaluation import Array
from mdfconv.distributions.parameter import Parameter
from mdfconv.fitting.metrics import Metric, metric_named
from mdfconv.fitting.metrics.base import Display, srgb
from mdfconv.measured.brdf_fit import MeasuredFit
from mdfconv.output.records import percent

# What a number keeps, and by what its error is also given.
_LIGHT, _HIGHLIGHT = "environment", "display"
# A light in a picture: what the surroundings have beside it, white being 1, and what it has times
# the lobe in 1/sr. They were chosen so that the best lobe of GGX is near the one found by rendering
# two mixtures and two Beckmann lobes under three environment maps: within 23 % in r, mostly 10 %.
_AMBIENT, _LAMP = 0.2, 0.3
# Of tan β over that of the half width: from where the lobe is flat to where its tail ends; and the
# smallest parameter of a pair.
_LOG_TANGENTS, _SMALLEST, _INSIDE = (-6.0, 14.0, 200), 1e-6, 1e-3
# An error that another number lessens by no more is the same.
_SAME_ERROR = 0.9


class LobeMixture(Distribution):
    """Two lobes of one distribution: a share of one, the rest of one that is wider by a factor."""

    name = "mixture"
    parameters = (Parameter("alpha", "α", (0.01, 0.8)),)

    def __init__(self, lobe: Distribution, share: float, factor: float) -> None:
        super().__init__()
        self._one = lobe
        self._parts = ((share, 1.0), (1 - share, factor))
        # By it mixtures are told apart.
        self.gamma = (share, factor)

    def _at_normal(self, parameter: Array) -> Array:
        return self._sum(self._peaks(parameter))

    def _lobe(self, angles: Angles, parameter: Array, out: Array | None = None) -> Array:
        values = (self._one._lobe(angles, factor * parameter) for _, factor in self._parts)
        peaks = self._peaks(parameter)
        value = self._sum(peak * value for peak, value in zip(peaks, values, strict=True))
        return np.divide(value, self._sum(peaks), out=out)

    def _lobe_and_log_slope(self, angles: Angles, parameter: Array) -> tuple[Array, Array]:
        height = fall = np.zeros(1)
        for peak, (_, factor) in zip(self._peaks(parameter), self._parts, strict=True):
            value, slope = self._one._lobe_and_log_slope(angles, factor * parameter)
            slope = slope + self._one._log_slope_at_normal(factor * parameter)
            height, fall = height + peak * value, fall + peak * value * slope
        value = height / self._at_normal(parameter)
        return value, fall / height - self._log_slope_at_normal(parameter)

    def _log_slope_at_normal(self, parameter: Array) -> Array:
        peaks = self._peaks(parameter)
        slopes = (self._one._log_slope_at_normal(factor * parameter) for _, factor in self._parts)
        rise = self._sum(peak * slope for peak, slope in zip(peaks, slopes, strict=True))
        return rise / self._sum(peaks)

    def _cumulative(self, angles: Angles, parameter: Array) -> tuple[Array, Array]:
        shares = [self._one._cumulative(angles, factor * parameter) for _, factor in self._parts]
        weights = [weight for weight, _ in self._parts]
        below, above = (np.tensordot(weights, share, 1) for share in zip(*shares, strict=True))
        return below, above

    def _peaks(self, parameter: Array) -> list[Array]:
        return [weight * self._one._at_normal(factor * parameter) for weight, factor in self._parts]

    @staticmethod
    def _sum(values: Iterable[Array]) -> Array:
        return np.asarray(sum(values))


def _source(fit: MeasuredFit) -> Distribution:
    """Return the distribution of a fit, of one lobe or of two, in the first lobe's parameter."""
    if fit.second is None or fit.share is None:
        return fit.distribution
    return LobeMixture(fit.distribution, fit.share, fit.second / fit.parameter)


class ScenePicture(Display):
    """A light and its surroundings as a screen shows them: what is above white is clipped.

    As a picture is not exposed for its lights, the exposure follows from the peak P of the lobe.
    """

    name = "picture"

    def __init__(self, peak: float) -> None:
        super().__init__(_LAMP * peak)
        self.kinks = ((1 - _AMBIENT) / self.exposure,)

    def from_stored(self) -> Sequence[Metric]:
        """Return this: none of its fits is stored."""
        return (self,)

    def encode(self, value: Array) -> Array:
        """Return what the light adds to the picture."""
        return srgb(_AMBIENT + self.exposure * value) - srgb(np.array(_AMBIENT))

    def encode_with_slope(self, value: Array) -> tuple[Array, Array]:
        """Return that and its slope, 0 where it is clipped."""
        x = _AMBIENT + self.exposure * value
        power = 1.055 / 2.4 * np.minimum(x, 1) ** (1 / 2.4 - 1)
        return self.encode(value), self.exposure * np.where(x < 1, power, 0)


@dataclass(frozen=True)
class Substitute:
    """A lobe of another distribution that stands for the fitted one, in a stored form.

    Parameters
    ----------
    end : Endpoint
        The distribution and the form of its parameter.
    number : float
        What keeps the light of an environment.
    errors : tuple of two floats
        The root mean square errors of that under the metrics ``"environment"`` and ``"display"``.
    on_screen : float
        What looks nearest in a picture that is not exposed for its lights.
    screen_errors : tuple of two floats
        The errors in that picture of `number` and of `on_screen`.
    exact : bool
        Whether it is the same lobe.
    """

    end: Endpoint
    number: float
    errors: tuple[float, ...]
    on_screen: float
    screen_errors: tuple[float, ...]
    exact: bool

    @property
    def parameter(self) -> float:
        """The distribution's own parameter."""
        return self.end.decode_one(self.number)

    def stored_as(self, target: str) -> Substitute:
        """Return the same lobe in another form of its parameter."""
        end = endpoint(target)
        number, on_screen = end.encode(np.array([self.number, self.on_screen])).tolist()
        return replace(self, end=end, number=number, on_screen=on_screen)

    def remark(self, label: str) -> str:
        """Return what is lost by the number, and which other one loses less on a screen."""
        if self.exact:
            return ""
        light, highlight = map(percent, self.errors)
        text = (
            f"A {self.end.distribution.name} lobe stands for {label}: {self.end.text(self.number)} "
            f"keeps linear light (error {light} under {_LIGHT}, {highlight} under {_HIGHLIGHT})"
        )
        other, best = self.screen_errors
        if best > _SAME_ERROR * other:
            return f"{text} and looks as near as any on a display."
        return (
            f"{text}; {self.end.text(self.on_screen)} looks nearest in a picture on a display "
            f"(error there {percent(best)} instead of {percent(other)})."
        )


def substitute(fit: MeasuredFit, target: str) -> Substitute:
    """Return the lobe of a distribution that keeps most of the fitted one's light.

    Two lobes have one substitute. Raises `MdfconvError` if the distribution has none.
    """
    source, parameter, end = _source(fit), np.array([fit.parameter]), endpoint(target)

    def kept(metric: str | Metric) -> float:
        (one,) = explain(fit.parameter, Endpoint(source), end, metric=metric, errors=False)
        return float(np.max(one.result))

    def error(number: float, metric: str | Metric) -> float:
        return _error(source, fit.parameter, end.distribution, number, metric)

    number = kept(_LIGHT)
    if exact_route(source, end.distribution) is not None:
        return Substitute(end, number, (0.0, 0.0), number, (0.0, 0.0), exact=True)
    picture = ScenePicture(float(source.maximum(parameter, normalized=True)[0]))
    on_screen = kept(picture)
    errors = error(number, _LIGHT), error(number, _HIGHLIGHT)
    screen_errors = error(number, picture), error(on_screen, picture)
    return Substitute(end, number, errors, on_screen, screen_errors, exact=False)


@dataclass(frozen=True)
class LobePair:
    """Two lobes of a distribution that together stand for the fitted one.

    Parameters
    ----------
    distribution : Distribution
        The distribution.
    share : float
        The share of the first.
    parameters : tuple of two floats
        Their parameters.
    errors : tuple of two floats
        The root mean square errors under the metrics ``"environment"`` and ``"display"``.
    """

    distribution: Distribution
    share: float
    parameters: tuple[float, float]
    errors: tuple[float, float]

    def remark(self, label: str) -> str:
        """Return what is lost by the pair."""
        mdf = self.distribution
        shares = f"{100 * self.share:.0f}:{100 * (1 - self.share):.0f}"
        first, second = (f"{parameter:.4g}" for parameter in self.parameters)
        light, highlight = map(percent, self.errors)
        return (
            f"Two {mdf.name} lobes, {mdf.parameter.symbol} {first} and {second} at {shares}, "
            f"stand for {label} (error {light} under {_LIGHT}, {highlight} under {_HIGHLIGHT})."
        )


def lobe_pair(fit: MeasuredFit, one: Substitute) -> LobePair:
    """Return two lobes of a substitute's distribution that keep most of the fitted one's light.

    They are the least squares of the difference of the cumulative distributions over ln tan β,
    which is the metric ``"environment"``.
    """
    from scipy.optimize import least_squares

    source, target = _source(fit), one.end.distribution
    tangent = float(source.half_tangent(fit.parameter)) * np.exp(np.linspace(*_LOG_TANGENTS))
    beta = np.arctan(tangent)
    wanted = source.cumulative(beta, fit.parameter)
    low, high = target.parameter.lower, target.parameter.upper

    def unpacked(point: Array) -> tuple[float, float, float]:
        first, second = np.clip(np.exp(point[:2]), low, high).tolist()
        return float(point[2]), first, second

    def residual(point: Array) -> Array:
        share, first, second = unpacked(point)
        parts = target.cumulative(beta, first), target.cumulative(beta, second)
        return share * parts[0] + (1 - share) * parts[1] - wanted

    ends = np.log(_SMALLEST), np.log(high)
    middle = np.log(one.parameter)
    start = np.clip([middle - 1, middle + 1], ends[0] + _INSIDE, ends[1] - _INSIDE)
    bounds = [ends[0], ends[0], 0.0], [ends[1], ends[1], 1.0]
    share, first, second = unpacked(least_squares(residual, [*start, 0.5], bounds=bounds).x)
    mixture = LobeMixture(target, share, second / first)
    light, highlight = (
        _error(source, fit.parameter, mixture, first, metric) for metric in (_LIGHT, _HIGHLIGHT)
    )
    return LobePair(target, share, (first, second), (light, highlight))


def _error(
    source: Distribution,
    parameter: float,
    target: Distribution,
    result: float,
    metric: str | Metric,
) -> float:
    lobes = source, np.array([parameter]), target, np.array([result])
    return float(remaining_error(*lobes, metric_named(metric))[0][0])
