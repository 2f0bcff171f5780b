"""What every metric has in common."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from functools import cache, cached_property
from pathlib import Path
from typing import ClassVar, Self

import numpy as np

from mdfconv.distributions import Distribution
from mdfconv.distributions.angles import Angles
from mdfconv.distributions.elementary import exp_of_product
from mdfconv.distributions.evaluation import Array, gauss_panels
from mdfconv.distributions.parameter import Parameter, number_text, percent_hint
from mdfconv.errors import MdfconvError
from mdfconv.fitting.quadrature import LobeQuadrature, Quadrature

# Between these a signal is the power of D/P that it is where D leaves 0.
_SMALL_VALUES = 1e-30, 1e-20
# What is so nearly of the first power is.
_LEAST_ROOT = 1.03


class Metric(ABC):
    """A squared distance ∫ (S(D_t/P) − S(D_s/P))² w dβ over [0, π/2], P = max D_s.

    Attributes
    ----------
    keeps, quantity : str
        What a fit under the metric keeps, and what its signal S is, in words.
    word : str
        What it keeps, in one word.
    meant_by : tuple of str
        Words that are no names of metrics, by which users may mean this one.
    purpose : str
        Where that is right, in a few.
    normalized : bool
        Whether D is the normalized or the unit form.
    kinks : tuple of float
        Values of D/P at which S is not smooth.
    inputs : tuple of Path
        Files that it was read from.
    setting : str
        What may follow the name and a colon, in a word; "" for nothing.
    needs_setting : bool
        Whether it must.
    over_angles : bool
        Whether S is a function of β.
    similar_below : float
        Lobes of a smaller tan β_half convert as one that has it, scaled: smooth lobes are similar,
        and rounding would hide what they differ by.
    """

    name: ClassVar[str]
    keeps: ClassVar[str]
    word: ClassVar[str]
    purpose: ClassVar[str]
    quantity: ClassVar[str]
    normalized: ClassVar[bool]
    kinks: tuple[float, ...] = ()
    inputs: tuple[Path, ...] = ()
    meant_by: ClassVar[tuple[str, ...]] = ()
    setting: ClassVar[str] = ""
    needs_setting: ClassVar[bool] = False
    over_angles: ClassVar[bool] = True
    similar_below: ClassVar[float] = 0.0

    @classmethod
    def with_setting(cls, text: str) -> Self:
        """Return the metric for the setting that follows its name and a colon.

        Raises
        ------
        MdfconvError
            If the metric has none, or the text does not say one.
        """
        raise MdfconvError(f"the {cls.name} metric has no setting '{text}'")

    def __str__(self) -> str:
        """Return the name, with the setting where it is not the usual one."""
        return self.name

    def from_stored(self) -> Sequence[Metric]:
        """Return metrics from one whose fits may be stored to this, each near the one before."""
        return (self,)

    @abstractmethod
    def weight(self, angles: Angles) -> Array:
        """Return w at angles."""

    def quadrature(self, half_width: Array) -> Quadrature:
        """Return where S is sampled, for lobes of which β_half is the narrowest, radians."""
        return LobeQuadrature(half_width, root=self.root)

    @cached_property
    def root(self) -> float:
        """Which root of D the signal is where D leaves 0; 1 without an infinite slope there."""
        with np.errstate(all="ignore"):
            zero, near, farther = self.encode(np.array([0, *_SMALL_VALUES]))
            root = math.log(_SMALL_VALUES[1] / _SMALL_VALUES[0]) / np.log(
                (farther - zero) / (near - zero)
            )
        return float(root) if _LEAST_ROOT < root < np.inf else 1.0

    def ratio(self, source: Distribution, target: Distribution) -> float | None:
        """Return p_target/p_source of the fit where that is one constant, else None."""
        return None

    def encode(self, value: Array) -> Array:
        """Return S for D/P."""
        return value

    def encode_slope(self, value: Array) -> Array | float:
        """Return dS/d(D/P)."""
        return 1.0

    def encode_with_slope(self, value: Array) -> tuple[Array, Array | float]:
        """Return S and dS/d(D/P) for D/P."""
        return self.encode(value), self.encode_slope(value)

    def signal(self, mdf: Distribution, angles: Angles, parameter: Array, peak: Array) -> Array:
        """Return S of a distribution for P = `peak`."""
        with np.errstate(all="ignore"):
            value = mdf.shape(angles, parameter)
            value *= mdf.maximum(parameter, normalized=self.normalized) / peak
        return self.encode(value)

    def signal_and_slope(
        self, distribution: Distribution, angles: Angles, parameter: Array, peak: Array
    ) -> tuple[Array, Array]:
        """Return S and ∂S/∂ ln p at angles, shape (n, k); `parameter` p and `peak` have (n, 1)."""
        value, slope = distribution.with_slope(angles, parameter, normalized=self.normalized)
        if self.normalized:
            value /= peak
            slope /= peak
        value, factor = self.encode_with_slope(value)
        slope *= factor
        return value, slope


class Unit(Metric):
    """The shape of the lobe: unit forms, every angle alike (the view of Sawicki 2021)."""

    name = "unit"
    keeps = "shape of the lobe"
    word = "shape"
    purpose = "lobe's shape"
    meant_by: ClassVar[tuple[str, ...]] = ("shape", "lobe", "paper")
    quantity = "unit form D / max D"
    normalized = False

    def weight(self, angles: Angles) -> Array:
        """Return 1."""
        return np.broadcast_to(1.0, angles.shape)


class Energy(Metric):
    """The light: normalized forms, over the hemisphere with cos β dω."""

    name = "energy"
    keeps = "light"
    word = "light"
    purpose = "sun or lamp, linear light"
    meant_by: ClassVar[tuple[str, ...]] = ("sun", "lamp", "point", "directional", "peak")
    quantity = "normalized D / max D of the reference"
    normalized = True

    def weight(self, angles: Angles) -> Array:
        """Return 2π sin β cos β."""
        return 2 * np.pi * angles.tangent * angles.cosine_square


# The sRGB encoding (IEC 61966-2-1) is linear up to here.
_SRGB_TOE = 0.0031308
# Of ln exposure, from which a fit can be followed from one exposure to the next: up to 16 times the
# usual, beyond which rough lobes are clipped as a whole, and by a third at a time.
_FARTHEST, _LARGEST_STEP = math.log(16), 0.35
_EXPOSURE = Parameter("exposure", "exposure", (0.25, 4.0), default=1.0)


class Display(Energy):
    """The picture on a screen: normalized forms, exposed, sRGB-encoded, clipped at white.

    Parameters
    ----------
    exposure : float
        What max D_s is multiplied with before encoding; 1 puts it at white.
    """

    name = "display"
    keeps = "picture on a screen"
    word = "picture"
    purpose = "as seen on a screen"
    meant_by: ClassVar[tuple[str, ...]] = ("screen", "picture", "srgb", "image")
    quantity = "normalized D as a screen shows it"
    setting = "exposure"

    def __init__(self, exposure: float = _EXPOSURE.default) -> None:
        self.exposure = _EXPOSURE.check_one(exposure, self.name)
        self.kinks = (_SRGB_TOE / self.exposure, 1 / self.exposure)

    @classmethod
    def with_setting(cls, text: str) -> Self:
        """Return the metric for an exposure, such as ``"4"`` in ``"display:4"``."""
        try:
            return cls(float(text))
        except MdfconvError:
            raise
        except ValueError:
            raise MdfconvError(
                f"the exposure of the display metric is a number, not '{text}'",
                percent_hint(text),
            ) from None

    def __str__(self) -> str:
        """Return the name, with the exposure unless it is 1."""
        usual = self.exposure == _EXPOSURE.default
        return self.name if usual else f"{self.name}:{number_text(self.exposure)}"

    def from_stored(self) -> Sequence[Metric]:
        """Return the exposures from the usual one to this; this alone if that is far away."""
        way = np.log(self.exposure / _EXPOSURE.default)
        if abs(way) > _FARTHEST:
            return (self,)
        steps = math.ceil(abs(way) / _LARGEST_STEP)
        between = np.exp(np.linspace(0, way, steps + 1)[:-1])
        return [*(type(self)(float(exposure)) for exposure in between), self]

    def encode(self, value: Array) -> Array:
        """Return the encoded value in [0, 1]."""
        return srgb(self.exposure * value)

    def encode_slope(self, value: Array) -> Array:
        """Return the slope of the encoding; 0 where it is clipped."""
        return self.encode_with_slope(value)[1]

    def encode_with_slope(self, value: Array) -> tuple[Array, Array]:
        """Return the encoded value and the slope of the encoding."""
        linear = self.exposure * value
        encoded = srgb(linear)
        # Of a power over its base, which is no smaller than where the curve is linear.
        slope = (encoded + 0.055) / np.maximum(linear, _SRGB_TOE)
        slope *= self.exposure / 2.4
        slope = np.where(linear <= _SRGB_TOE, 12.92 * self.exposure, slope)
        slope *= linear < 1
        return encoded, slope


def srgb(linear: Array) -> Array:
    """Return linear light in the sRGB encoding, clipped to [0, 1] (IEC 61966-2-1)."""
    x = np.clip(np.atleast_1d(linear), 0, 1)
    power = np.log(np.maximum(x, _SRGB_TOE))
    power = exp_of_product(power, 1 / 2.4, out=power)
    power *= 1.055
    power -= 0.055
    return np.where(x <= _SRGB_TOE, 12.92 * x, power).reshape(np.shape(linear))


# The ratio of two parameters is found on ln tan β from −32 to 32: beyond, the shares of any two
# lobes differ by less than 1e-27.
_LOG_REACH, _PANELS, _ORDER = 32.0, 96, 16
# Ratios between lobes of one width lie within a factor of e³ of each other.
_LOG_RATIOS = (-3.0, 3.0)


class Environment(Metric):
    """The light of a natural environment, whose angular power falls like 1/f².

    A lobe blurs the environment. In spherical harmonics that multiplies degree l by k_l, so that
    the error of a picture is Σ (2l+1) C_l (Δk_l)². For C_l = 1/(l(l+1)), the law of natural
    images, the sum is 4 ∫ ΔF² dβ / sin 2β, F the cumulative distribution. S is F less that of the
    uniform lobe, sin²β, which leaves no contrast: so ∫ S² w is the contrast of the picture.

    As dβ / sin 2β = ½ d ln tan β, whatever scales with the slope converts by one constant.
    """

    name = "environment"
    keeps = "light of a natural environment"
    word = "environment"
    purpose = "natural light"
    meant_by: ClassVar[tuple[str, ...]] = ("natural", "sky", "scene", "hdri", "ibl")
    quantity = "share of the facets within β, beyond a uniform lobe's"
    normalized = True

    def weight(self, angles: Angles) -> Array:
        """Return 4 / sin 2β."""
        # A panel of no width lies at 0.
        return 2 / np.maximum(angles.tangent * angles.cosine_square, 1e-300)

    def signal(self, mdf: Distribution, angles: Angles, parameter: Array, peak: Array) -> Array:
        """Return F − sin²β."""
        with np.errstate(all="ignore"):
            return self.signal_and_slope(mdf, angles, parameter, peak)[0]

    def signal_and_slope(
        self, distribution: Distribution, angles: Angles, parameter: Array, peak: Array
    ) -> tuple[Array, Array]:
        """Return F − sin²β and ∂F/∂ ln p."""
        share, slope = distribution.cumulative_with_slope(angles, parameter)
        return share - angles.sine_square, slope

    def ratio(self, source: Distribution, target: Distribution) -> float | None:
        """Return the constant by which parameters convert, if both scale with the slope."""
        if not (source.scales_with_slope and target.scales_with_slope):
            return None
        # One search for both directions, so that there and back is the identity.
        pair = (source.name, source.gamma), (target.name, target.gamma)
        if pair[0] <= pair[1]:
            return _ratio(source, target)
        return 1 / _ratio(target, source)


@cache
def _ratio(source: Distribution, target: Distribution) -> float:
    """Return p_target/p_source where ∂/∂ ln p of the distance is 0, to the last digits."""
    from scipy.optimize import brentq

    edges = np.linspace(-_LOG_REACH, _LOG_REACH, _PANELS + 1)
    log_tangent, weight = gauss_panels(edges[None, :], _ORDER)
    angles = Angles(tangent=np.exp(log_tangent))
    share, _ = source.cumulative_with_slope(angles, np.ones((1, 1)))

    def slope(log_ratio: float) -> float:
        # The target at parameter 1, moved along the axis: a legal range does not matter.
        moved = Angles(tangent=np.exp(log_tangent - log_ratio))
        other, fall = target.cumulative_with_slope(moved, np.ones((1, 1)))
        return float(np.sum(weight * (other - share) * fall))

    return float(np.exp(brentq(slope, *_LOG_RATIOS, xtol=1e-16, rtol=1e-15)))


METRICS = (Unit, Energy, Display, Environment)
