"""What is fitted to measurements: the options, the candidates, and their lobes at the samples.

Of two directions f_r = k_d/π + k_s L F(θ_d), L = D G / (4 cos θ_i cos θ_o). Absolute data determine
one number for the strength of the lobe: k_s = 1, unless it is freed, and F carries the strength.
A slice at θ_d = 0 is offset + scale · D̄(β)/cos²β, in which masking is left out, and a distribution
of normals offset + scale · D̄(β).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any, ClassVar, Self

import numpy as np

from mdfconv.brdf.fresnel import dielectric, normal_reflectance
from mdfconv.brdf.microfacet import dot, half_vector, polar_angle, unit, v_cavity
from mdfconv.distributions import Distribution, distribution, one_parameter_distributions
from mdfconv.distributions.angles import Angles
from mdfconv.distributions.evaluation import Array, Indices
from mdfconv.distributions.parameter import percent_hint
from mdfconv.errors import MdfconvError
from mdfconv.measured.projection import CUBE_ROOT, LOGARITHM, Terms, Transform
from mdfconv.measured.samples import DirectionalSamples, Measurements, Samples
from mdfconv.registry import unknown_name

LOSSES = ("log", "linear", "cosine", "cube-root")
SLICE_LOSSES = ("log", "linear")
MASKINGS = ("smith", "v-cavity", "none")
AUTO, DIELECTRIC, METAL, LOSSLESS = "auto", "dielectric", "metal", "none"
FRESNELS = (AUTO, DIELECTRIC, METAL, "ior:N", LOSSLESS)
# Of a dielectric whose index is free; beyond it are metals.
_INDEX_RANGE = (1.02, 2.6)
_TYPICAL_INDEX = 1.5
# Of two lobes: the share of the first.
_SHARE_RANGE = (0.002, 0.998)
TWO_LOBES = "ggx+ggx"
# A rule for the mean over a disc of radius 1, exact to the fifth degree (Stroud 1971, S2: 5-1):
# radius of six points around the centre, and weights.
_DISC_RADIUS = np.sqrt(2 / 3)
_DISC_WEIGHTS = np.array([1 / 4, *[1 / 8] * 6])
# So many samples and the intermediates of their lobes stay in the cache.
_BLOCK = 50_000
# Of a difference in the parameters of a lobe.
_DIFFERENCE = 1e-5


@dataclass(frozen=True)
class BrdfModel:
    """What is fitted beside the distribution; of one angle only loss and robustness apply.

    Parameters
    ----------
    loss : str
        What is squared and summed. ``"log"``: differences of logarithms. ``"linear"``: of values.
        ``"cosine"``: of f_r cos θ_i cos θ_o (Löw et al. 2012). ``"cube-root"``: of the cube roots
        of f_r cos θ_o (Bieron & Peers 2020).
    masking : str
        ``"smith"``: height-correlated (Heitz 2014). ``"v-cavity"`` (Torrance & Sparrow 1967).
        ``"none"``.
    fresnel : str
        ``"dielectric"``: exact, with the index of refraction free. ``"metal"``: Schlick 1994, with
        F₀ of each channel free. ``"auto"``: the one of the two that fits better, by BIC.
        ``"ior:N"``: a dielectric of that index. ``"none"``: F = 1 and k_s free.
    free_specular : bool
        Whether k_s of each channel is free, too; otherwise it is 1.
    robust : bool
        Whether outliers count linearly (Huber 1964).
    aperture : float or None
        Diameter of the detector seen from the sample, degrees, over which the model is averaged.
    noise, floor : float or None
        The relative and the absolute standard deviation of values, σ² = (noise f)² + floor², which
        weights differences of values; without them the samples' own uncertainties do, if any.
    """

    loss: str = "log"
    masking: str = "smith"
    fresnel: str = AUTO
    free_specular: bool = False
    robust: bool = True
    aperture: float | None = None
    noise: float | None = None
    floor: float | None = None

    def __post_init__(self) -> None:
        if self.loss not in LOSSES:
            raise unknown_name("loss", self.loss, LOSSES)
        if self.masking not in MASKINGS:
            raise unknown_name("masking", self.masking, MASKINGS)
        _check_fresnel(self.fresnel)
        if self.free_specular and self.fresnel == LOSSLESS:
            raise MdfconvError(
                "k_s is free already where F is 1", "leave it out", argument="free_specular"
            )
        for name, largest in (("aperture", 30.0), ("noise", 1.0), ("floor", np.inf)):
            value = getattr(self, name)
            if value is not None and not 0 <= value <= largest:
                raise MdfconvError(
                    f"the {name} {value:g} is outside 0 to {largest:g}", argument=name
                )
        if (self.noise, self.floor) != (None, None) and not (self.noise or self.floor):
            given = "floor" if self.noise is None else "noise"
            raise MdfconvError(
                "a standard deviation of 0 is that of no measurement",
                "give noise or floor above 0, or neither",
                argument=given,
            )

    @property
    def kinds(self) -> tuple[str, ...]:
        """The Fresnel factors to try."""
        return (DIELECTRIC, METAL) if self.fresnel == AUTO else (self.fresnel,)

    def deviations(self, samples: Measurements) -> Array | None:
        """Return σ of the values, shape (n, channels); None if neither file nor options say it."""
        if self.noise is None and self.floor is None:
            return samples.uncertainty
        relative, floor = self.noise or 0.0, self.floor or 0.0
        return np.hypot(relative * samples.values, floor)


def _check_fresnel(name: str) -> float | None:
    """Return the index of a name of `FRESNELS` that gives it; raise if there is no such factor."""
    if name in FRESNELS and name != "ior:N":
        return None
    head, _, number = name.partition(":")
    try:
        index = float(number) if head == "ior" else 0.0
    except ValueError:
        index = 0.0
    if 0 < index <= 1:
        reason = f"a surface of index {index:g} reflects nothing from outside"
        raise MdfconvError(reason, "give an index above 1", argument="fresnel")
    if not 0 < index < np.inf:
        near = percent_hint(number)
        if near:
            raise MdfconvError(f"an index of refraction is a number, not '{number}'", near)
        raise unknown_name("Fresnel factor", name, FRESNELS)
    return index


@dataclass(frozen=True)
class LobeShape:
    """What is fitted: a distribution, its γ free or not, or the mixture of two of its lobes."""

    distribution: Distribution
    is_gamma_free: bool = False
    is_double: bool = False

    @property
    def name(self) -> str:
        """The name by which it is asked for."""
        return TWO_LOBES if self.is_double else self.distribution.name


def candidate(target: str | Distribution | LobeShape, gamma: float | None = None) -> LobeShape:
    """Return what a name or a distribution stands for; γ is free if there is one and none given."""
    if isinstance(target, LobeShape):
        return target
    if target == TWO_LOBES:
        return LobeShape(distribution("ggx"), is_double=True)
    mdf = distribution(target) if isinstance(target, str) else target
    if mdf.second_parameter and gamma is not None:
        mdf = mdf.with_gamma(gamma)
    return LobeShape(mdf, is_gamma_free=bool(mdf.second_parameter) and gamma is None)


def all_candidates() -> list[LobeShape]:
    """Return each shape once: no distribution that is another one in another parameter.

    The usual ones, whose masking has a closed form, come first.
    """
    shapes = [mdf for mdf in one_parameter_distributions() if not _is_another(mdf)]
    shapes.sort(key=lambda mdf: not mdf.smith)
    return [*map(candidate, shapes), candidate(TWO_LOBES)]


def _is_another(mdf: Distribution) -> bool:
    return mdf.second_parameter is None and mdf.equivalent is not None and mdf.equivalent.same_lobe


@dataclass(frozen=True)
class Unknown:
    """What is searched: its range, and the coordinate in which it is, a logarithm or itself.

    The logarithm is that of the difference from `origin`.
    """

    name: str
    lower: float
    upper: float
    is_logarithm: bool = True
    origin: float = 0.0

    def coordinate(self, value: Array | float) -> Any:
        """Return the coordinate of a value."""
        return np.log(value - self.origin) if self.is_logarithm else value

    def value(self, coordinate: Array | float) -> Any:
        """Return the value at a coordinate."""
        return self.origin + np.exp(coordinate) if self.is_logarithm else coordinate

    def slope(self, coordinate: float) -> float:
        """Return ∂value/∂coordinate."""
        return float(np.exp(coordinate)) if self.is_logarithm else 1.0


@dataclass(frozen=True)
class Scan:
    """Where minima are looked for: half widths by their tangents, for each γ of a grid."""

    narrowest: float
    widest: float
    half_widths: int
    gammas: int
    # How many of the best starts, of different γ, are refined.
    starts: int


class Lobe(ABC):
    """The lobe of a candidate at samples; a point has the coordinates of `unknowns`."""

    scan: ClassVar[Scan]
    # What is said of values that no lobe fits.
    refusal: ClassVar[tuple[str, ...]]
    # The names of the coefficients of each channel.
    linear: tuple[str, ...]

    def __init__(self, samples: Any, what: LobeShape, options: BrdfModel, fresnel: str) -> None:
        self.samples, self.what, self.options, self.fresnel = samples, what, options, fresnel
        # How many places there are samples at, and how a message says it.
        self.places, self.where = len(samples.values), ""

    def part(self, index: Indices) -> Self:
        """Return the lobe at some of the samples."""
        return type(self)(self.samples.select(index), self.what, self.options, self.fresnel)

    def with_fresnel(self, fresnel: str) -> Self:
        """Return the lobe with another Fresnel factor."""
        return type(self)(self.samples, self.what, self.options, fresnel)

    @cached_property
    def unknowns(self) -> tuple[Unknown, ...]:
        """What is searched; of two lobes the narrower one may be either."""
        mdf = self.what.distribution
        ends = self._parameter_ends()
        unknowns = [Unknown(mdf.parameter.name, *ends)]
        if self.what.is_double:
            unknowns.append(Unknown("second", *ends))
            unknowns.append(Unknown("share", *_SHARE_RANGE, is_logarithm=False))
        elif self.what.is_gamma_free and mdf.second_parameter:
            unknowns.append(Unknown("gamma", *mdf.second_parameter.fit_range))
        return (*unknowns, *self._of_fresnel())

    @property
    def shape_size(self) -> int:
        """How many of the unknowns are the lobe's own."""
        return len(self.unknowns) - len(self._of_fresnel())

    def _of_fresnel(self) -> tuple[Unknown, ...]:
        """Return what is searched beside the lobe's own parameters."""
        return ()

    @property
    def is_absolute(self) -> bool:
        """Whether the unit of the values matters: no coefficient stands for the lobe's strength."""
        return not {"scale", "specular", "specular_f0"} & set(self.linear)

    @property
    def loss(self) -> str:
        """The loss, ``"sigma"`` where uncertainties stand for it."""
        return self.options.loss

    @property
    def bounds(self) -> Array:
        """The least and the largest point, shape (2, unknowns)."""
        ends = [(u.coordinate(u.lower), u.coordinate(u.upper)) for u in self.unknowns]
        return np.array(ends).T

    def starts(self) -> list[tuple[Distribution, Array]]:
        """Return distributions and the parameters of all half widths, for each γ of a grid."""
        return _starts(self.scan, self.what)

    def distribution(self, point: Array) -> Distribution:
        """Return the distribution with the γ of a point."""
        mdf = self.what.distribution
        second = mdf.second_parameter
        if not self.what.is_gamma_free or second is None:
            return mdf
        # exp(ln γ) rounds, and an end of the range may be the end of the legal values.
        return mdf.with_gamma(float(np.clip(np.exp(point[1]), second.lower, second.upper)))

    def shape(self, point: Array) -> Array:
        """Return the lobe without Fresnel's factor, shape (n,)."""
        first = float(np.exp(point[0]))
        if not self.what.is_double:
            return self._shape(self.distribution(point), first)
        mdf, share = self.what.distribution, float(point[2])
        value = share * self._shape(mdf, first)
        value += (1 - share) * self._shape(mdf, float(np.exp(point[1])))
        return value

    def terms(self, point: Array) -> Terms:
        """Return the model at a point up to its coefficients."""
        return self._terms(self.shape(point), point)

    def slopes(self, point: Array, terms: Terms) -> list[Terms]:
        """Return ∂terms/∂coordinate, by differences that stay inside the bounds."""
        _, high = self.bounds
        slopes = []
        for index in range(len(point)):
            moved = point.copy()
            step = -_DIFFERENCE if point[index] + _DIFFERENCE > high[index] else _DIFFERENCE
            moved[index] += step
            pairs = zip(self.terms(moved), terms, strict=True)
            slopes.append(Terms(*((near - here) / step for near, here in pairs)))
        return slopes

    @abstractmethod
    def scanned(self, mdf: Distribution, parameters: Array) -> Terms:
        """Return terms of a free strength for many parameters, which only have to find a start."""

    def deviations(self) -> Array | None:
        """Return the standard deviations of the values that weight them, if any."""
        return None

    @abstractmethod
    def transform(self) -> Transform | None:
        """Return what the loss compares instead of values."""

    @abstractmethod
    def weight(self) -> Array:
        """Return the weights of the squared differences, shape (n,) or (channels, n)."""

    @abstractmethod
    def _shape(self, mdf: Distribution, parameter: float) -> Array:
        """Return the lobe of one distribution, shape (n,)."""

    @abstractmethod
    def _terms(self, shape: Array, point: Array) -> Terms: ...

    @abstractmethod
    def _parameter_ends(self) -> tuple[float, float]:
        """Return the least and the largest parameter."""


class SliceLobe(Lobe):
    """D̄(β), divided by cos²β if the measurement is a BRDF's."""

    scan = Scan(narrowest=1e-5, widest=30.0, half_widths=120, gammas=9, starts=9)
    linear = ("offset", "scale")
    refusal = ("the values do not fall with the angle: there is no lobe to fit",)

    def __init__(self, samples: Samples, *rest: Any) -> None:
        super().__init__(samples, *rest)
        self._angles = _in_blocks(samples.beta)
        self._foreshortening = foreshortening(samples.beta, samples.quantity)
        self.places = np.unique(samples.beta).size
        self.where = f" at {self.places} angles"

    def scanned(self, mdf: Distribution, parameters: Array) -> Terms:
        """Return terms of many parameters."""
        lobes = _lobes(mdf, self._angles, parameters, normalized=False)
        return self._with_offset(lobes / self._foreshortening)

    def transform(self) -> Transform | None:
        """Return the logarithm, if the loss is that."""
        return LOGARITHM if self.options.loss == "log" else None

    def weight(self) -> Array:
        """Return the weights."""
        return np.ones(len(self.samples.values))

    def shape(self, point: Array) -> Array:
        """Return the lobe; of two lobes in units of its value at the normal."""
        value = super().shape(point)
        if not self.what.is_double:
            return value
        top = self._peaks(point) @ np.array([point[2], 1 - point[2]])
        return np.asarray(value / top)

    def _peaks(self, point: Array) -> Array:
        return self.what.distribution.maximum(np.exp(point[:2]), normalized=True)

    def _shape(self, mdf: Distribution, parameter: float) -> Array:
        value, normalized = np.array([parameter]), self.what.is_double
        lobe = _lobes(mdf, self._angles, value, normalized=normalized)[0]
        return np.asarray(lobe / self._foreshortening)

    def _terms(self, shape: Array, point: Array) -> Terms:
        return self._with_offset(shape)

    def _with_offset(self, lobe: Array) -> Terms:
        return Terms(np.stack([np.ones_like(lobe), lobe], axis=-2), np.zeros_like(lobe))

    def _parameter_ends(self) -> tuple[float, float]:
        ends = [parameters[[0, -1]] for _, parameters in self.starts()]
        # Beyond the candidates a lobe is narrower than the angles resolve, or nearly uniform.
        lowest, largest = float(np.min(ends) / np.e), float(np.max(ends) * np.exp(5))
        return lowest, min(self.what.distribution.parameter.upper, largest)


class DirectionalLobe(Lobe):
    """D G / (4 cos θ_i cos θ_o), and Fresnel's factor."""

    # Half widths from narrower than a goniometer resolves to nearly uniform.
    scan = Scan(narrowest=1e-3, widest=10.0, half_widths=40, gammas=5, starts=3)
    refusal = (
        "the values do not rise towards the mirror direction: there is no lobe to fit",
        "check which columns and which unit the angles are, and look at the largest angles",
    )

    def __init__(self, samples: DirectionalSamples, *rest: Any) -> None:
        super().__init__(samples, *rest)
        self._at = _Geometry(samples, self.options.aperture)
        self._index = _check_fresnel(self.fresnel)
        self.linear = ("diffuse", *self._strengths())
        self._last: dict[tuple[Any, ...], Array] = {}

    def with_fresnel(self, fresnel: str) -> Self:
        """Return the lobe with another Fresnel factor."""
        other = super().with_fresnel(fresnel)
        other._at, other._last = self._at, self._last
        return other

    def _strengths(self) -> tuple[str, ...]:
        """Return the names of the coefficients that carry the strength of the lobe."""
        is_free = self.options.free_specular
        if self.fresnel == METAL:
            # k_s F = k_s F₀ + k_s (1 − F₀) (1 − cos θ_d)⁵: linear in two that are not negative.
            return ("specular_f0", "specular_rest") if is_free else ("f0",)
        return ("specular",) if is_free or self.fresnel == LOSSLESS else ()

    @property
    def loss(self) -> str:
        """The loss, ``"sigma"`` where uncertainties stand for it."""
        is_weighted = self.options.deviations(self.samples) is not None
        return "sigma" if is_weighted else self.options.loss

    def _of_fresnel(self) -> tuple[Unknown, ...]:
        is_searched = self.fresnel == DIELECTRIC
        return (Unknown("n", *_INDEX_RANGE, origin=1.0),) if is_searched else ()

    def scanned(self, mdf: Distribution, parameters: Array) -> Terms:
        """Return terms of many parameters."""
        at = self._at
        lobe = _lobes(mdf, at.angles, parameters, normalized=True)
        factor = dielectric(at.difference_cosine, _TYPICAL_INDEX) / _F0_TYPICAL
        lobe *= at.v_cavity * factor / at.denominator
        return self._averaged(np.stack([np.full_like(lobe, 1 / np.pi), lobe], axis=-2), 0 * lobe)

    def deviations(self) -> Array | None:
        """Return those that options or samples have."""
        return self.options.deviations(self.samples)

    def transform(self) -> Transform | None:
        """Return the logarithm or the cube root, if the loss is that."""
        if self.deviations() is not None:
            return None
        if self.options.loss == "log":
            return LOGARITHM
        return CUBE_ROOT if self.options.loss == "cube-root" else None

    def weight(self) -> Array:
        """Return the weights."""
        deviations = self.deviations()
        if deviations is not None:
            return 1 / np.square(deviations.T)
        if self.options.loss == "cube-root":
            # The cube root of the cosine, squared.
            return np.cbrt(np.square(self.samples.outgoing[:, 2]))
        if self.options.loss == "cosine":
            return np.square(self.samples.incident[:, 2] * self.samples.outgoing[:, 2])
        return np.ones(len(self.samples.values))

    def _shape(self, mdf: Distribution, parameter: float) -> Array:
        # The index of refraction is often all that has changed.
        key = parameter, mdf.gamma
        if key not in self._last:
            if len(self._last) > 2:
                del self._last[next(iter(self._last))]
            self._last[key] = self._computed_shape(mdf, parameter)
        return self._last[key]

    def _computed_shape(self, mdf: Distribution, parameter: float) -> Array:
        at = self._at
        lobe = _lobes(mdf, at.angles, np.array([parameter]), normalized=True)[0]
        lobe /= at.denominator
        if self.options.masking == "v-cavity":
            lobe *= at.v_cavity
        elif self.options.masking == "smith":
            incident, whose = at.incident_tangents
            total = mdf.smith_lambda(incident, parameter)[whose]
            total += mdf.smith_lambda(at.outgoing_tangent, parameter)
            total += 1
            lobe /= total
        return np.asarray(lobe)

    def _terms(self, shape: Array, point: Array) -> Terms:
        at, one = self._at, np.full_like(shape, 1 / np.pi)
        if self.fresnel == METAL:
            grazing = shape * at.schlick
            if self.options.free_specular:
                return self._averaged(np.stack([one, shape, grazing]), np.zeros_like(shape))
            return self._averaged(np.stack([one, shape - grazing]), grazing)
        if self.fresnel == LOSSLESS:
            lobe = shape
        else:
            index = self._index or self.unknowns[-1].value(point[-1])
            lobe = shape * dielectric(at.difference_cosine, index)
        if "specular" in self.linear:
            return self._averaged(np.stack([one, lobe]), np.zeros_like(shape))
        return self._averaged(one[None], lobe)

    def _averaged(self, basis: Array, fixed: Array) -> Terms:
        """Return terms averaged over the aperture."""
        count = len(self.samples.values)
        if fixed.shape[-1] == count:
            return Terms(basis, fixed)
        return Terms(
            *(
                np.einsum("...ij,i->...j", part.reshape(*part.shape[:-1], -1, count), _DISC_WEIGHTS)
                for part in (basis, fixed)
            )
        )

    def _parameter_ends(self) -> tuple[float, float]:
        parameter = self.what.distribution.parameter
        return max(parameter.lower, 1e-8), min(parameter.upper, 1e12)


_F0_TYPICAL = normal_reflectance(_TYPICAL_INDEX)


def tangent(vectors: Array) -> Array:
    """Return the tangents of the angles from the normal."""
    return np.hypot(vectors[:, 0], vectors[:, 1]) / vectors[:, 2]


def _in_blocks(beta: Array) -> list[Angles]:
    """Return angles, shape (n,), in parts of shape (1, any) whose intermediates stay in cache."""
    return [Angles(part[None]) for part in np.split(beta, range(_BLOCK, beta.size, _BLOCK))]


def _lobes(
    mdf: Distribution, angles: list[Angles], parameters: Array, *, normalized: bool
) -> Array:
    """Return lobes of parameters, shape (m,), at angles in parts, shape (m, n)."""
    column = parameters[:, None]
    with np.errstate(all="ignore"):
        parts = [mdf.shape(part, column) for part in angles]
        lobes = parts[0] if len(parts) == 1 else np.concatenate(parts, axis=1)
        if normalized:
            lobes *= mdf.maximum(column, normalized=True)
    return lobes


class _Geometry:
    """What lobes need of pairs of directions, of each what is asked for."""

    def __init__(self, samples: DirectionalSamples, aperture: float | None) -> None:
        self._samples, self._aperture = samples, aperture

    @cached_property
    def _directions(self) -> tuple[Array, Array]:
        return _seen(self._samples, self._aperture)

    @cached_property
    def _half(self) -> Array:
        return half_vector(*self._directions)

    @cached_property
    def angles(self) -> list[Angles]:
        return _in_blocks(polar_angle(self._half))

    @cached_property
    def difference_cosine(self) -> Array:
        return np.clip(dot(self._directions[0], self._half), 0, 1)

    @cached_property
    def schlick(self) -> Array:
        return np.power(1 - self.difference_cosine, 5)

    @cached_property
    def denominator(self) -> Array:
        incident, outgoing = self._directions
        return 4 * incident[:, 2] * outgoing[:, 2]

    @cached_property
    def v_cavity(self) -> Array:
        return v_cavity(*self._directions, self._half)

    @cached_property
    def incident_tangents(self) -> tuple[Array, Indices]:
        """The tangents of the angles of incidence, of which a scan has few, and whose they are."""
        return np.unique(tangent(self._directions[0]), return_inverse=True)

    @cached_property
    def outgoing_tangent(self) -> Array:
        return tangent(self._directions[1])


def _seen(samples: DirectionalSamples, aperture: float | None) -> tuple[Array, Array]:
    """Return the directions at which a lobe is evaluated: of an aperture seven for each sample."""
    incident, outgoing = samples.incident, samples.outgoing
    if not aperture:
        return incident, outgoing
    level = np.stack([-outgoing[:, 1], outgoing[:, 0], np.zeros(len(outgoing))], axis=-1)
    level = np.where(np.hypot(*outgoing[:, :2].T)[:, None] > 0, level, [1.0, 0, 0])
    across = unit(level)
    along = np.cross(outgoing, across)
    radius = np.tan(np.radians(aperture / 2)) * _DISC_RADIUS
    seen = [outgoing]
    for turn in np.arange(6) * np.pi / 3:
        seen.append(unit(outgoing + radius * (np.cos(turn) * across + np.sin(turn) * along)))
    directions = np.concatenate(seen)
    # What would lie below the horizon is seen at it.
    directions[:, 2] = np.maximum(directions[:, 2], 1e-6)
    return np.tile(incident, (len(seen), 1)), directions


def lobe_at(samples: Measurements, what: LobeShape, options: BrdfModel, fresnel: str) -> Lobe:
    """Return the lobe of a candidate at samples."""
    if isinstance(samples, DirectionalSamples):
        return DirectionalLobe(samples, what, options, fresnel)
    return SliceLobe(samples, what, options, fresnel)


def foreshortening(beta: Array, quantity: str) -> Array:
    """Return cos²β for a BRDF at θ_d = 0, where it is D̄/cos²β but for masking; else 1."""
    return np.square(np.cos(beta)) if quantity == "brdf" else np.ones_like(beta)


@lru_cache(maxsize=64)
def _starts(scan: Scan, what: LobeShape) -> list[tuple[Distribution, Array]]:
    """Return what a candidate's scan begins with: the same for all samples."""
    mdf = what.distribution
    tangents = np.geomspace(scan.narrowest, scan.widest, scan.half_widths)
    if not what.is_gamma_free or mdf.second_parameter is None:
        return [(mdf, _parameters(mdf, tangents))]
    ends = mdf.second_parameter.fit_range
    gammas = np.geomspace(*ends, scan.gammas)
    shapes = [mdf.with_gamma(float(np.clip(gamma, *ends))) for gamma in gammas]
    return [(shape, _parameters(shape, tangents)) for shape in shapes]


def _parameters(target: Distribution, tangents: Array) -> Array:
    """Return the parameters for half widths, ascending, of those that exist."""
    parameters = target.from_half_tangent(tangents)
    existing = np.sort(parameters[np.isfinite(parameters)])
    if not existing.size:
        raise MdfconvError(
            f"{target.name} of γ = {target.gamma:g} has no lobe whose half width can be measured"
        )
    return np.asarray(existing)
