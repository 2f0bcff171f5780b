"""What every distribution has in common."""

from __future__ import annotations

import copy
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, ClassVar, Literal, Self, TypeAlias, TypedDict, Unpack, overload

import numpy as np
from numpy.typing import ArrayLike

from mdfconv.distributions.angles import VARIABLES, Angles
from mdfconv.distributions.evaluation import Array, Kernel, as_operand, computing_dtype, evaluate
from mdfconv.distributions.parameter import Encoding, Parameter, number_text
from mdfconv.distributions.smith import SmithTable, smith_table
from mdfconv.errors import MdfconvError


def same(parameter: Any, *gamma: Any) -> Any:
    """Return the parameter."""
    return parameter


@dataclass(frozen=True)
class Equivalent:
    """Another distribution, in whose parameter this one can be expressed by `forward`.

    The two are the same function of β, or (`same_lobe` false) the sources only let one number
    stand for both, as Schlick's and Beckmann's m. The texts say the relations in words.
    """

    name: str
    same_lobe: bool = True
    forward: Callable[[Array], Array] = same
    backward: Callable[[Array], Array] = same
    forward_text: str = ""
    backward_text: str = ""

    @property
    def same_parameter(self) -> bool:
        """Whether the two parameters are the same number."""
        return self.forward is same


@dataclass(frozen=True)
class MapVariables:
    """The variables in which the stored maps of a conversion are smooth functions.

    x = `width` of a parameter is the roughness of a smooth surface, at most 1; κ = `concentration`
    is 1/x² for a smooth surface, 0 for a uniform lobe. `from_map` returns the parameter for the x
    of the source and the product x² κ; over `scale` of x it is a smooth function, too.
    """

    concentration: Callable[[Array], Array]
    from_map: Callable[[Array, Array], Array]
    width: Callable[[Array], Array] = same
    from_width: Callable[[Array], Array] = same
    scale: Callable[[Array], Array] = same


@dataclass(frozen=True)
class Printed:
    """The expressions as their sources print them, written as one would in NumPy.

    They lose digits to cancellation and overflow: that is what the audit and the benchmark hold
    the kernels against. Every function takes the parameter, and γ after it if there is one, and
    computes in the type of its arguments: `unit` D̄ of (β, parameter), `at_normal` D(0) of the
    normalized form, `cosine` cos β_half, `peak_alpha` the α for which D(0) = 1/(π α²), and the
    two others their inverses.
    """

    unit: Callable[..., Any]
    at_normal: Callable[..., Any]
    cosine: Callable[..., Any] | None = None
    from_cosine: Callable[..., Any] | None = None
    peak_alpha: Callable[..., Any] | None = None
    from_peak_alpha: Callable[..., Any] | None = None

    @classmethod
    def of_alpha(cls, unit: Callable[..., Any], **widths: Callable[..., Any]) -> Printed:
        """Return those of a distribution for which D(0) = 1/(π α²)."""
        return cls(
            unit,
            lambda alpha, *gamma: 1 / (np.pi * alpha**2),
            peak_alpha=same,
            from_peak_alpha=same,
            **widths,
        )


def gamma_parameter(
    typical: tuple[float, float], limits: tuple[float, float], fitted: tuple[float, float]
) -> Parameter:
    """Return a γ that is 2 where none is given, its typical, legal and fitted ranges."""
    closed = {"lower_closed": True, "upper_closed": True}
    return Parameter("gamma", "γ", typical, *limits, default=2.0, fit_range=fitted, **closed)


ALPHA_MAP = MapVariables(
    concentration=lambda alpha: (1 - alpha) * (1 + alpha) / (alpha * alpha),
    from_map=lambda x, product: x / np.sqrt(x * x + product),
)
# Of an α up to 1.
BOUNDED_ALPHA_MAP = replace(
    ALPHA_MAP, from_map=lambda x, product: np.minimum(ALPHA_MAP.from_map(x, product), 1)
)


# What `beta` of `Distribution.unit` and `Distribution.normalized` may hold: β, cos β or tan β.
Variable: TypeAlias = Literal["angle", "cosine", "slope"]


class Options(TypedDict, total=False):
    """The options of `Distribution.unit` and `Distribution.normalized`."""

    phi: ArrayLike | None
    gamma: ArrayLike | None
    variable: Variable
    threads: int


class CumulativeOptions(TypedDict, total=False):
    """The options of `Distribution.cumulative`."""

    gamma: ArrayLike | None
    complement: bool
    threads: int


_SMALLEST_ANGLE = 1e-30
# The square of an angle is about the share of the lobe within it: the least one above 0.
_SMALLEST_DRAWN = 1e-160
# By how much a few values may contradict what is declared, and how many angles are looked at.
_DECLARED, _CHECKED_ANGLES = 1e-6, 64
# Of a central difference in ln p: truncation falls with its square, rounding rises as it falls.
_STEP = float(np.finfo(float).eps) ** (1 / 3)


class Distribution(ABC):
    """A microfacet distribution function of one parameter, or of two.

    A subclass declares what is true of it (names, parameters, sources and what the class
    attributes below say) and gives elementwise kernels of `Angles`: `_lobe`, the distribution over
    its value at the normal, D(β)/D(0); `_at_normal`, D(0) of the normalized form, for which
    ∫ D cos β dω = 1 over the hemisphere; the slopes of both, for fits; and `_cumulative`. Where
    the maximum is not at the normal it gives `_off_axis_maximum` too. Widths and quantiles have
    numerical defaults; a subclass that knows a closed form overrides them.

    A second parameter γ is a field: kernels read `gamma`, and nothing else knows of it.

    Parameters
    ----------
    gamma : float, optional
        The second parameter of a distribution that has two; its default if not given.

    Attributes
    ----------
    parameters : tuple of Parameter
        The one that is converted, and γ if there are two.
    operations : int
        Operations to evaluate the printed unit form from cos β, with sin²β = 1 − cos²β and
        tan²β = 1/cos²β − 1; a transcendental function counts as 10, a power that is not whole as
        two of them. What depends on the parameters alone is precomputed, like terms and constants
        of a sum are collected; the edge and a maximum off the normal are not counted.
    anisotropic : bool
        Whether it takes a pair of parameters.
    ambiguous : dict
        From aliases that users mean different things by to a sentence that says what is taken.
    meant_by : dict
        From words that are no names, but by which users may mean it, to what they mean.
    scales_with_slope : bool
        Whether the cumulative distribution is a function of tan β over the parameter.
    smith : bool
        Whether Smith's Λ has a closed form, which `smith_lambda` then computes for arrays of
        parameters, too.
    equivalent : Equivalent or None
        The distribution that it is in another parameter.
    map_variables : MapVariables or None
        Those of the stored maps; None for a distribution without maps.
    """

    name: ClassVar[str]
    aliases: ClassVar[tuple[str, ...]] = ()
    unit_formula: ClassVar[str]
    normalized_formula: ClassVar[str]
    source: ClassVar[str]
    parameters: ClassVar[tuple[Parameter, ...]]
    printed: ClassVar[Printed]
    operations: ClassVar[int]
    encodings: ClassVar[tuple[Encoding, ...]] = ()
    ambiguous: ClassVar[Mapping[str, str]] = {}
    meant_by: ClassVar[Mapping[str, str]] = {}
    map_variables: ClassVar[MapVariables | None] = None
    anisotropic: ClassVar[bool] = False
    scales_with_slope: ClassVar[bool] = False
    smith: ClassVar[bool] = False

    def __init__(self, gamma: float | None = None) -> None:
        self.gamma: Any = None
        if self.second_parameter:
            value = self.second_parameter.default if gamma is None else gamma
            self.gamma = self.second_parameter.check_one(value, self.name)
        elif gamma is not None:
            raise MdfconvError(f"{self.name} has one parameter and no γ")

    @property
    def parameter(self) -> Parameter:
        """The parameter that is converted."""
        return self.parameters[0]

    @property
    def second_parameter(self) -> Parameter | None:
        """γ, of a distribution of two parameters."""
        return self.parameters[1] if len(self.parameters) > 1 else None

    @property
    def equivalent(self) -> Equivalent | None:
        """The distribution that this one is in another parameter."""
        return None

    def __repr__(self) -> str:
        gamma = "" if self.second_parameter is None else f", gamma={self.gamma!r}"
        return f"distribution({self.name!r}{gamma})"

    def __eq__(self, other: object) -> bool:
        return type(self) is type(other) and np.array_equal(self.gamma, other.gamma)

    def __hash__(self) -> int:
        return hash((type(self), self.gamma))

    @property
    def label(self) -> str:
        """The name, with γ where there is one."""
        if self.second_parameter is None:
            return self.name
        return f"{self.name} ({self.second_parameter.symbol} = {number_text(self.gamma)})"

    def with_gamma(self, gamma: float) -> Self:
        """Return the distribution with another γ; raise `MdfconvError` if it is illegal."""
        return type(self)(gamma)

    def with_gammas(self, gamma: Array) -> Self:
        """Return it with a γ for each element, unchecked, that broadcasts with the parameter."""
        changed = copy.copy(self)
        changed.gamma = gamma
        return changed

    def check_declarations(self) -> None:
        """Raise `MdfconvError` if a few values of the lobes contradict what is declared of them."""
        low, high, symbol = *self.parameter.typical, self.parameter.symbol
        slope, beta = np.array([0.3, 1, 3]), np.linspace(0, 0.5 * np.pi, _CHECKED_ANGLES)
        shares = [self.cumulative(np.arctan(slope * p), p) for p in (low, high)]
        if self.scales_with_slope and not np.allclose(shares[0], shares[1], rtol=_DECLARED):
            raise MdfconvError(
                f"{self.label} declares scales_with_slope, but where tan β = {symbol} its F is "
                f"{shares[0][1]:.6g} at {symbol} = {low:g} and {shares[1][1]:.6g} at {high:g}",
                "leave it False",
            )
        for p in (low, high):
            value = self.unit(beta, p)
            if not value.max() <= 1 + _DECLARED:
                raise MdfconvError(
                    f"the unit form of {self.label} is {value.max():.6g} at β = "
                    f"{beta[value.argmax()]:.3g} for {symbol} = {p:g}",
                    "it is D over its maximum, which _off_axis_maximum gives where it is not D(0)",
                )

    def is_same(self, other: Distribution) -> bool:
        """Return whether two distributions take the same parameter for the same lobe."""
        return self.name == other.name and self.gamma == other.gamma

    @overload
    def unit(self, beta: float, parameter: float, *, gamma: float | None = ...) -> float: ...
    @overload
    def unit(self, beta: ArrayLike, parameter: Any, **options: Unpack[Options]) -> Array: ...

    def unit(
        self,
        beta: ArrayLike,
        parameter: Any,
        *,
        phi: ArrayLike | None = None,
        gamma: ArrayLike | None = None,
        variable: Variable = "angle",
        threads: int = 1,
    ) -> Any:
        """Evaluate the unit form D̄ = D / max D.

        Parameters
        ----------
        beta : array_like
            Angle between normal and half vector, radians, [0, π/2]. The function is even;
            beyond π/2 it is 0.
        parameter : array_like or tuple of two array_like
            The parameter, in its legal range. A tuple (x, y) makes an anisotropic
            distribution anisotropic.
        phi : array_like, optional
            Azimuth of the half vector from the x axis, radians; only with a pair.
        gamma : array_like, optional
            The second parameter, of a distribution that has one; by default `self.gamma`.
        variable : {"angle", "cosine", "slope"}, optional
            What `beta` holds: the angle, its cosine n·h, or its tangent. A cosine is quicker than
            an angle and has lost digits near the normal: what float64 stores as 1 is any angle up
            to 1e-8, float32 up to 2.4e-4. So it suits lobes that are much wider. A slope, which is
            √(x² + y²)/z of a half vector, is quickest and has all its digits; it may be infinite.
        threads : int, optional
            How many share an array of a million angles or more, from 1.

        Returns
        -------
        numpy.ndarray or numpy scalar
            D̄ in [0, 1], in the broadcast shape; float32 if every array is float32.

        Raises
        ------
        MdfconvError
            If a parameter is outside its legal range, a pair, an azimuth or a γ does not apply,
            or the variable is not one of the three.
        """
        return self._evaluate("shape", beta, parameter, phi, gamma, variable, threads)

    @overload
    def normalized(self, beta: float, parameter: float, *, gamma: float | None = ...) -> float: ...
    @overload
    def normalized(self, beta: ArrayLike, parameter: Any, **options: Unpack[Options]) -> Array: ...

    def normalized(
        self,
        beta: ArrayLike,
        parameter: Any,
        *,
        phi: ArrayLike | None = None,
        gamma: ArrayLike | None = None,
        variable: Variable = "angle",
        threads: int = 1,
    ) -> Any:
        """Evaluate the normalized form D, for which ∫ D cos β dω = 1.

        Parameters, shapes and errors are those of `unit`; the result is in 1/sr.
        """
        return self._evaluate("_normalized", beta, parameter, phi, gamma, variable, threads)

    @overload
    def cumulative(self, beta: float, parameter: float, *, complement: bool = ...) -> float: ...
    @overload
    def cumulative(
        self, beta: ArrayLike, parameter: ArrayLike, **options: Unpack[CumulativeOptions]
    ) -> Array: ...

    def cumulative(
        self,
        beta: ArrayLike,
        parameter: ArrayLike,
        *,
        gamma: ArrayLike | None = None,
        complement: bool = False,
        threads: int = 1,
    ) -> Any:
        """Evaluate F(β) = ∫ D cos β dω over the half vectors within β of the normal.

        Parameters
        ----------
        beta, parameter, gamma, threads
            As for `unit`; one parameter, not a pair. Beyond π/2 F is 1.
        complement : bool
            Return 1 − F, with all its digits in the tail.

        Returns
        -------
        numpy.ndarray or numpy scalar
            F, the share of the projected area of the facets, in [0, 1].

        Raises
        ------
        MdfconvError
            As `unit`.
        """
        angle = np.minimum(np.abs(as_operand(beta)), np.pi / 2)
        kernel = "_cumulative_tail" if complement else "_cumulative_lobe"
        return self._evaluate(kernel, angle, parameter, gamma=gamma, threads=threads)

    @overload
    def sample(self, share: float, parameter: float, *, complement: bool = ...) -> float: ...
    @overload
    def sample(
        self, share: ArrayLike, parameter: ArrayLike, *, complement: bool = ...
    ) -> Array: ...

    def sample(self, share: ArrayLike, parameter: ArrayLike, *, complement: bool = False) -> Any:
        """Return the angle β at which F(β) is given: a half vector for a random number.

        Parameters
        ----------
        share : array_like
            F, from 0 to 1; with `complement` 1 − F.
        parameter : array_like
            The parameter, in its legal range; not a pair.
        complement : bool
            Whether the shares are those of the tail, 1 − F, which resolves grazing angles.

        Returns
        -------
        numpy.ndarray or numpy scalar
            β in radians, [0, π/2], float64, in the broadcast shape.

        Raises
        ------
        MdfconvError
            If a share is not from 0 to 1 or a parameter illegal.
        """
        shares = np.asarray(as_operand(share), dtype=float)
        if not ((shares >= 0) & (shares <= 1)).all():
            raise MdfconvError("a share of the facets is from 0 to 1")
        double = np.dtype(float)
        legal = np.asarray(self.parameter.check(parameter, self.name, double), dtype=float)
        try:
            shares, legal = np.broadcast_arrays(shares, legal)
        except ValueError:
            raise MdfconvError(
                f"shapes {shares.shape}, {legal.shape} do not broadcast against each other"
            ) from None
        lobe, tail = (1 - shares, shares) if complement else (shares, 1 - shares)
        lobe, tail, legal = (np.atleast_1d(array) for array in (lobe, tail, legal))
        with np.errstate(all="ignore"):
            angle = np.where(lobe > 0, self._quantile(lobe, tail, legal), 0)
            edge = self.edge(legal)
        angle = np.where(tail > 0, angle, np.pi / 2 if edge is None else edge)
        return np.clip(angle, 0, np.pi / 2).reshape(shares.shape)[()]

    @overload
    def half_width(self, parameter: float) -> float: ...
    @overload
    def half_width(self, parameter: ArrayLike) -> Array: ...

    def half_width(self, parameter: ArrayLike) -> Any:
        """Return β_half, the angle at which D falls to half of D(0) (Blinn 1977).

        Parameters
        ----------
        parameter : array_like
            The parameter, in its legal range.

        Returns
        -------
        numpy.ndarray or numpy scalar
            β_half in radians; NaN where D stays above one half up to π/2.
        """
        return np.arctan(self.half_tangent(parameter))

    def half_tangent(self, parameter: ArrayLike) -> Any:
        """Return tan β_half, which unlike β_half keeps its digits up to π/2."""
        return _elementwise(self._half_tangent, self.parameter.check(parameter, self.name))

    def from_half_tangent(self, tangent: ArrayLike) -> Any:
        """Return the parameter whose tan β_half is given; NaN where there is none."""
        return self._legal(_elementwise(self._from_half_tangent, _positive(tangent)))

    def peak_alpha(self, parameter: ArrayLike) -> Any:
        """Return the α for which 1/(π α²) is D(0), the normalized form at β = 0.

        For Beckmann and GGX this is the parameter itself; for every other distribution it
        is the α of the Beckmann or GGX lobe with the same peak.
        """
        return _elementwise(self._peak_alpha, self.parameter.check(parameter, self.name))

    def from_peak_alpha(self, alpha: ArrayLike) -> Any:
        """Return the parameter whose D(0) is 1/(π α²); NaN where there is none."""
        return self._legal(_elementwise(self._from_peak_alpha, _positive(alpha)))

    @abstractmethod
    def _lobe(self, angles: Angles, parameter: Array, out: Array | None = None) -> Array:
        """Kernel of D(β)/D(0); writes to `out` and returns it."""

    @abstractmethod
    def _at_normal(self, parameter: Array) -> Array:
        """Kernel of D(0) of the normalized form, 1/sr."""

    @abstractmethod
    def _lobe_and_log_slope(self, angles: Angles, parameter: Array) -> tuple[Array, Array]:
        """Kernel of D(β)/D(0) and of ∂ ln(D(β)/D(0)) / ∂ ln p, p the parameter."""

    @abstractmethod
    def _log_slope_at_normal(self, parameter: Array) -> Array:
        """Kernel of ∂ ln D(0) / ∂ ln p of the normalized form."""

    @abstractmethod
    def _cumulative(self, angles: Angles, parameter: Array) -> tuple[Array, Array]:
        """Kernel of F(β) and 1 − F(β), each with its own digits."""

    def cumulative_with_slope(self, angles: Angles, parameter: Array) -> tuple[Array, Array]:
        """Return F and ∂F/∂ ln p for angles, shape (n, k), and parameters p, shape (n, 1)."""
        share = self._cumulative(angles, parameter)[0]
        if self.scales_with_slope:
            # F is a function of tan β / p, and dF = 2π D sin β cos β dβ.
            lobe = self._lobe(angles, parameter) * self._at_normal(parameter)
            return share, -2 * np.pi * lobe * angles.sine_square * angles.cosine_square
        above, below = (self._cumulative(angles, parameter * np.exp(s))[0] for s in (_STEP, -_STEP))
        return share, (above - below) / (2 * _STEP)

    def _off_axis_maximum(self, parameter: Array) -> Array | None:
        """Kernel of max D / D(0); None where that is 1 for every parameter given."""
        return None

    def _log_slope_off_axis(self, parameter: Array) -> Array:
        """Kernel of ∂ ln(max D / D(0)) / ∂ ln p."""
        return np.zeros_like(parameter)

    def smith_lambda(self, tangent: Array, parameter: float | Array) -> Array:
        """Return Smith's Λ, by which G₁ = 1/(1 + Λ) (Heitz 2014).

        By a closed form where one is known. Else a table is made for the parameter, with an error
        of about 1e-10 of 1 + Λ; the last ones are kept.

        Parameters
        ----------
        tangent : numpy.ndarray
            tan θ of the directions, θ their angles from the surface normal; from 0, which is the
            normal, to infinity.
        parameter : float
            The parameter, unchecked; γ is that of the distribution, one number. Where `smith` is
            true the parameter may be an array that broadcasts.

        Returns
        -------
        numpy.ndarray
            Λ ≥ 0 in the shape of `tangent`, float64; infinite where that is.
        """
        if not self.scales_with_slope:
            return _smith_table(self, float(parameter))(tangent)
        # A function of the product: one table for all parameters.
        typical = self.parameter.typical_value
        return _smith_table(self, typical)(tangent * (parameter / typical))

    def mode(self, parameter: Array) -> Array:
        """Return the angle at which D is largest, radians; 0 unless a subclass says otherwise."""
        return np.zeros_like(parameter)

    def edge(self, parameter: Array) -> Array | None:
        """Return the angle beyond which D is 0, radians; None if there is none."""
        return None

    def with_slope(
        self, angles: Angles, parameter: Array, *, normalized: bool
    ) -> tuple[Array, Array]:
        """Return D and ∂D/∂ ln p for angles, shape (n, k), and parameters p, shape (n, 1)."""
        value, slope = self._lobe_and_log_slope(angles, parameter)
        if normalized:
            value *= self._at_normal(parameter)
            slope += self._log_slope_at_normal(parameter)
        else:
            maximum = self._off_axis_maximum(parameter)
            if maximum is not None:
                value /= maximum
                slope -= self._log_slope_off_axis(parameter)
        slope *= value
        return value, slope

    def shape(self, angles: Angles, parameter: Array, out: Array | None = None) -> Array:
        """Return the unit form of unchecked arrays that broadcast, for fits.

        As `unit` without its checks and its blocks, which only pay for large arrays.
        """
        value = self._lobe(angles, parameter, out)
        maximum = self._off_axis_maximum(parameter)
        return value if maximum is None else np.divide(value, maximum, out=value)

    def maximum(self, parameter: Array, *, normalized: bool) -> Array:
        """Return max D: 1 for the unit form, in 1/sr for the normalized one."""
        if not normalized:
            return np.ones_like(parameter)
        ratio = self._off_axis_maximum(parameter)
        return self._at_normal(parameter) * (1 if ratio is None else ratio)

    def _normalized(self, angles: Angles, parameter: Array, out: Array) -> None:
        self._lobe(angles, parameter, out)
        out *= self._finite(self._at_normal(parameter))

    def _finite(self, peak: Array) -> Array:
        """Return values of D(0); raise `MdfconvError` if one overflows."""
        if not np.isfinite(peak).all():
            raise MdfconvError(f"a lobe of {self.label} overflows {peak.dtype.name} at its peak")
        return peak

    def _cumulative_lobe(self, angles: Angles, parameter: Array, out: Array) -> None:
        np.minimum(self._cumulative(angles, parameter)[0], 1, out=out)

    def _cumulative_tail(self, angles: Angles, parameter: Array, out: Array) -> None:
        np.minimum(self._cumulative(angles, parameter)[1], 1, out=out)

    def _quantile(self, lobe: Array, tail: Array, parameter: Array) -> Array:
        """Kernel of β for F = `lobe` and 1 − F = `tail`."""

        def excess(log_beta: Array, lobe: Array, tail: Array, parameter: Array) -> Array:
            below, above = self._cumulative(Angles(np.exp(log_beta)), parameter)
            return np.where(lobe < tail, below - lobe, tail - above)

        bracket = (np.log(_SMALLEST_DRAWN), np.log(np.pi / 2))
        beta = np.exp(find_root(excess, bracket, lobe, tail, parameter))
        # A tail too thin for any float below π/2 lies there, a lobe too thin at 0.
        return np.where(np.isnan(beta), np.where(tail < lobe, 0.5 * np.pi, 0.0), beta)

    def _half_tangent(self, parameter: Array) -> Array:
        def excess(log_beta: Array, parameter: Array) -> Array:
            return self._lobe(Angles(np.exp(log_beta)), parameter) - 0.5

        bracket = (np.log(_SMALLEST_ANGLE), np.log(np.pi / 2))
        return np.tan(np.exp(find_root(excess, bracket, parameter)))

    def _from_half_tangent(self, tangent: Array) -> Array:
        def excess(log_parameter: Array, tangent: Array) -> Array:
            return self._lobe(Angles(tangent=tangent), np.exp(log_parameter)) - 0.5

        return np.exp(find_root(excess, self._log_range(), tangent))

    def _peak_alpha(self, parameter: Array) -> Array:
        return 1 / np.sqrt(np.pi * self._at_normal(parameter))

    def _from_peak_alpha(self, alpha: Array) -> Array:
        def excess(log_parameter: Array, log_alpha: Array) -> Array:
            return np.log(self._peak_alpha(np.exp(log_parameter))) - log_alpha

        return np.exp(find_root(excess, self._log_range(), np.log(alpha)))

    def _log_range(self) -> tuple[float, float]:
        """Bracket for a search over the logarithm of the parameter."""
        lower = max(self.parameter.lower, _SMALLEST_ANGLE)
        return float(np.log(lower)), float(np.log(min(self.parameter.upper, 1 / _SMALLEST_ANGLE)))

    def _legal(self, parameter: Any) -> Any:
        return self.parameter.only_accepted(np.asarray(parameter))[()]

    def _evaluate(
        self,
        kernel: str,
        beta: ArrayLike,
        parameter: Any,
        phi: ArrayLike | None = None,
        gamma: ArrayLike | None = None,
        variable: Variable = "angle",
        threads: int = 1,
    ) -> Any:
        """Check the arguments and evaluate the kernel of a name in blocks."""
        if isinstance(parameter, tuple) or phi is not None:
            return self._evaluate_pair(kernel, beta, parameter, phi, variable, threads)
        if self.second_parameter is None:
            if gamma is not None:
                raise MdfconvError(f"{self.name} has one parameter and no γ")
            legal = self._held(parameter, beta)
            of_block = _of_variable(getattr(self, kernel), variable)
            return evaluate(of_block, beta, legal, threads=threads)
        gammas = self.second_parameter.check(self.gamma if gamma is None else gamma, self.name)
        legal = self._held(parameter, beta, gammas)

        def with_gamma(angles: Angles, parameter: Array, gamma: Array, out: Array) -> None:
            getattr(self.with_gammas(gamma), kernel)(angles, parameter, out)

        of_block = _of_variable(with_gamma, variable)
        return evaluate(of_block, beta, legal, gammas, threads=threads)

    def _evaluate_pair(
        self,
        kernel: str,
        beta: ArrayLike,
        pair: Any,
        phi: ArrayLike | None,
        variable: Variable,
        threads: int,
    ) -> Any:
        """Evaluate the kernel of a name for a pair of parameters and azimuths."""
        if self.anisotropic and not isinstance(pair, tuple):
            raise MdfconvError("an azimuth phi needs a pair of parameters")
        for_pair = getattr(self, f"{kernel}_pair", None)
        if for_pair is None:
            raise MdfconvError(
                f"{self.name} is isotropic here: it takes one parameter and no azimuth phi"
            )
        if len(pair) != 2:
            raise MdfconvError(f"a pair of parameters has two members, not {len(pair)}")
        if phi is None:
            raise MdfconvError("a pair of parameters needs an azimuth phi")
        x, y = (self._held(value, beta, phi) for value in pair)
        return evaluate(_of_variable(for_pair, variable), beta, x, y, phi, threads=threads)

    def _held(self, parameter: ArrayLike, *others: Any) -> Any:
        """Return legal parameters that the type in which all is computed can hold."""
        operands = [as_operand(operand) for operand in (parameter, *others)]
        return self.parameter.check(operands[0], self.name, computing_dtype(*operands)[0])


class AnisotropicDistribution(Distribution):
    """A distribution that also takes a pair of parameters, one for each principal axis.

    In the section along an axis it follows the one-parameter distribution. The subclass
    gives the two kernels for pairs.
    """

    anisotropic = True

    @abstractmethod
    def _lobe_pair(self, angles: Angles, x: Array, y: Array, phi: Array, out: Array) -> None:
        """Kernel of D(β, φ)/D(0); writes to `out`."""

    @abstractmethod
    def _at_normal_pair(self, x: Array, y: Array) -> Array:
        """Kernel of D(0) of the normalized form, 1/sr."""

    def shape_pair(self, angles: Angles, x: Array, y: Array, phi: Array, out: Array) -> None:
        """Write the unit form for a pair of parameters to `out`."""
        self._lobe_pair(angles, x, y, phi, out)
        # Over all azimuths the maximum is that along the rougher axis.
        maximum = self._off_axis_maximum(np.maximum(x, y))
        if maximum is not None:
            out /= maximum

    def _normalized_pair(self, angles: Angles, x: Array, y: Array, phi: Array, out: Array) -> None:
        self._lobe_pair(angles, x, y, phi, out)
        out *= self._finite(self._at_normal_pair(x, y))


class AlphaDistribution(Distribution):
    """A distribution whose parameter is the α of its peak: D(0) = 1/(π α²), or 1/(π α_x α_y)."""

    def _at_normal(self, parameter: Array) -> Array:
        return self._at_normal_pair(parameter, parameter)

    def _at_normal_pair(self, x: Array, y: Array) -> Array:
        return 1 / (np.pi * x * y)

    def _log_slope_at_normal(self, parameter: Array) -> Array:
        return np.full_like(parameter, -2)

    def _peak_alpha(self, parameter: Array) -> Array:
        return parameter

    def _from_peak_alpha(self, alpha: Array) -> Array:
        return alpha


def _of_variable(kernel: Kernel, variable: Variable) -> Kernel:
    """Return a kernel of `Angles` as one of blocks of a variable, 0 below the horizon."""
    if variable not in VARIABLES:
        raise MdfconvError(f"a variable is {', '.join(VARIABLES)}, not {variable!r}")

    def of_block(values: Array, *operands: Array) -> None:
        *parameters, out = operands
        angles = VARIABLES[variable](values)
        kernel(angles, *parameters, out)
        if angles.beyond is not None:
            out[angles.beyond] = 0

    return of_block


@lru_cache(maxsize=64)
def _smith_table(mdf: Distribution, parameter: float) -> SmithTable:
    """Return the table of Λ for a lobe."""
    one = np.array([parameter])
    edge = mdf.edge(one)
    end = None if edge is None else float(edge[0])
    # At the ends of a range kernels overflow on their way to a result.
    with np.errstate(all="ignore"):
        return smith_table(
            lambda angles: mdf._lobe(angles, one), float(mdf._peak_alpha(one)[0]), end
        )


def _elementwise(function: Kernel, values: ArrayLike) -> Any:
    """Apply a float64 function that expects at least one dimension to values of any shape."""
    array = np.asarray(values, dtype=float)
    # At the ends of a range a width is 0, infinite or missing: results, not accidents.
    with np.errstate(all="ignore"):
        return array if array.size == 0 else function(np.atleast_1d(array)).reshape(array.shape)[()]


def _positive(values: ArrayLike) -> Array:
    """Return real numbers as float64, NaN where they are not positive."""
    array = np.asarray(as_operand(values), dtype=float)
    positive = array > 0
    return array if positive.all() else np.where(positive, array, np.nan)


def negative_log_tail(lobe: Array, tail: Array) -> Array:
    """Return −ln(1 − F) for F and 1 − F, from the one that has the digits."""
    return np.where(lobe < tail, -np.log1p(-lobe), -np.log(tail))


def find_root(function: Kernel, bracket: tuple[float, float], *arguments: Array) -> Array:
    """Return the elementwise root of a function inside a bracket, NaN where there is none."""
    from scipy.optimize import elementwise

    lower, upper = (np.full(arguments[0].shape, end) for end in bracket)
    result = elementwise.find_root(function, (lower, upper), args=arguments)
    # A function that only approaches 0 towards an end has no root there.
    crosses = function(lower, *arguments) * function(upper, *arguments) < 0
    return np.where(result.success & crosses, result.x, np.nan)
