"""What every distribution has in common."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from mdfconv.distributions.evaluation import Array, Kernel, as_operand, evaluate
from mdfconv.distributions.parameter import Encoding, Parameter
from mdfconv.errors import MdfconvError

_SMALLEST_ANGLE = 1e-30


class Distribution(ABC):
    """A microfacet distribution function of one parameter.

    A subclass states its names, its parameter and its source, and gives two elementwise
    kernels: `_lobe`, the distribution over its value at the normal, D(β)/D(0), and
    `_at_normal`, D(0) of the normalized form, for which ∫ D cos β dω = 1 over the
    hemisphere. Where the maximum is not at the normal it gives `_off_axis_maximum` too. The
    widths have numerical defaults; a subclass that knows a closed form overrides them.
    """

    name: ClassVar[str]
    aliases: ClassVar[tuple[str, ...]] = ()
    unit_formula: ClassVar[str]
    normalized_formula: ClassVar[str]
    source: ClassVar[str]
    parameter: ClassVar[Parameter]
    encodings: ClassVar[tuple[Encoding, ...]] = ()
    # Arithmetic operations to evaluate the unit form from cos β, the parameter's constants
    # precomputed; a transcendental function counts as 10.
    operations: ClassVar[int]

    def unit(self, beta: ArrayLike, parameter: Any, *, phi: ArrayLike | None = None) -> Any:
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

        Returns
        -------
        numpy.ndarray or numpy scalar
            D̄ in [0, 1], in the broadcast shape; float32 if every array is float32.

        Raises
        ------
        MdfconvError
            If a parameter is outside its legal range, or a pair or an azimuth does not apply.
        """
        return self._evaluate(beta, parameter, phi, normalized=False)

    def normalized(self, beta: ArrayLike, parameter: Any, *, phi: ArrayLike | None = None) -> Any:
        """Evaluate the normalized form D, for which ∫ D cos β dω = 1.

        Parameters, shapes and errors are those of `unit`; the result is in 1/sr.
        """
        return self._evaluate(beta, parameter, phi, normalized=True)

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
        given = np.asarray(as_operand(tangent), dtype=float)
        positive = np.where(given > 0, given, np.nan)
        return self._legal(_elementwise(self._from_half_tangent, positive))

    def peak_alpha(self, parameter: ArrayLike) -> Any:
        """Return the α for which 1/(π α²) is D(0), the normalized form at β = 0.

        For Beckmann and GGX this is the parameter itself; for every other distribution it
        is the α of the Beckmann or GGX lobe with the same peak.
        """
        return _elementwise(self._peak_alpha, self.parameter.check(parameter, self.name))

    def from_peak_alpha(self, alpha: ArrayLike) -> Any:
        """Return the parameter whose D(0) is 1/(π α²); NaN where there is none."""
        given = np.asarray(as_operand(alpha), dtype=float)
        positive = np.where(given > 0, given, np.nan)
        return self._legal(_elementwise(self._from_peak_alpha, positive))

    @abstractmethod
    def _lobe(self, beta: Array, parameter: Array, out: Array | None = None) -> Array:
        """Kernel of D(β)/D(0); writes to `out` and returns it."""

    @abstractmethod
    def _at_normal(self, parameter: Array) -> Array:
        """Kernel of D(0) of the normalized form, 1/sr."""

    @abstractmethod
    def _lobe_and_log_slope(self, beta: Array, parameter: Array) -> tuple[Array, Array]:
        """Kernel of D(β)/D(0) and of ∂ ln(D(β)/D(0)) / ∂ ln p, p the parameter."""

    @abstractmethod
    def _log_slope_at_normal(self, parameter: Array) -> Array:
        """Kernel of ∂ ln D(0) / ∂ ln p of the normalized form."""

    def _off_axis_maximum(self, parameter: Array) -> Array | None:
        """Kernel of max D / D(0); None where that is 1 for every parameter given."""
        return None

    def _log_slope_off_axis(self, parameter: Array) -> Array:
        """Kernel of ∂ ln(max D / D(0)) / ∂ ln p."""
        return np.zeros_like(parameter)

    def mode(self, parameter: Array) -> Array:
        """Return the angle at which D is largest, radians; 0 unless a subclass says otherwise."""
        return np.zeros_like(parameter)

    def edge(self, parameter: Array) -> Array | None:
        """Return the angle beyond which D is 0, radians; None if there is none."""
        return None

    def with_slope(self, beta: Array, parameter: Array, *, normalized: bool) -> tuple[Array, Array]:
        """Return D and ∂D/∂(ln p), for fits.

        Parameters
        ----------
        beta : numpy.ndarray, shape (n, k)
            Angles in [0, π/2], radians.
        parameter : numpy.ndarray, shape (n, 1)
            Legal parameters p.
        normalized : bool
            Whether D is the normalized form (1/sr) or the unit form.
        """
        value, slope = self._lobe_and_log_slope(beta, parameter)
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

    def shape(self, beta: Array, parameter: Array) -> Array:
        """Return the unit form of unchecked arrays that broadcast, for fits.

        As `unit` without its checks and its blocks, which only pay for large arrays; `beta`
        has the shape of the result.
        """
        value = self._lobe(beta, parameter)
        maximum = self._off_axis_maximum(parameter)
        return value if maximum is None else np.divide(value, maximum, out=value)

    def maximum(self, parameter: Array, *, normalized: bool) -> Array:
        """Return max D: 1 for the unit form, in 1/sr for the normalized one."""
        if not normalized:
            return np.ones_like(parameter)
        ratio = self._off_axis_maximum(parameter)
        return self._at_normal(parameter) * (1 if ratio is None else ratio)

    def _unit(self, beta: Array, parameter: Array, out: Array) -> None:
        self._lobe(beta, parameter, out)
        maximum = self._off_axis_maximum(parameter)
        if maximum is not None:
            out /= maximum

    def _normalized(self, beta: Array, parameter: Array, out: Array) -> None:
        self._lobe(beta, parameter, out)
        out *= self._at_normal(parameter)

    def _half_tangent(self, parameter: Array) -> Array:
        def excess(log_beta: Array, parameter: Array) -> Array:
            return self._lobe(np.exp(log_beta), parameter) - 0.5

        bracket = (np.log(_SMALLEST_ANGLE), np.log(np.pi / 2))
        return np.tan(np.exp(find_root(excess, bracket, parameter)))

    def _from_half_tangent(self, tangent: Array) -> Array:
        def excess(log_parameter: Array, beta_half: Array) -> Array:
            return self._lobe(beta_half, np.exp(log_parameter)) - 0.5

        return np.exp(find_root(excess, self._log_range(), np.arctan(tangent)))

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
        return np.where(self.parameter.accepts(parameter), parameter, np.nan)[()]

    def _evaluate(
        self, beta: ArrayLike, parameter: Any, phi: ArrayLike | None, *, normalized: bool
    ) -> Any:
        if isinstance(parameter, tuple) or phi is not None:
            raise MdfconvError(
                f"{self.name} is isotropic: it takes one parameter and no azimuth phi"
            )
        kernel = self._normalized if normalized else self._unit
        return evaluate(kernel, beta, self.parameter.check(parameter, self.name))


class AnisotropicDistribution(Distribution):
    """A distribution that also takes a pair of parameters, one for each principal axis.

    In the section along an axis it follows the one-parameter distribution. The subclass
    gives the two kernels for pairs.
    """

    @abstractmethod
    def _lobe_pair(self, beta: Array, x: Array, y: Array, phi: Array, out: Array) -> None:
        """Kernel of D(β, φ)/D(0); writes to `out`."""

    @abstractmethod
    def _at_normal_pair(self, x: Array, y: Array) -> Array:
        """Kernel of D(0) of the normalized form, 1/sr."""

    def _unit_pair(self, beta: Array, x: Array, y: Array, phi: Array, out: Array) -> None:
        self._lobe_pair(beta, x, y, phi, out)
        # Over all azimuths the maximum is that along the rougher axis.
        maximum = self._off_axis_maximum(np.maximum(x, y))
        if maximum is not None:
            out /= maximum

    def _normalized_pair(self, beta: Array, x: Array, y: Array, phi: Array, out: Array) -> None:
        self._lobe_pair(beta, x, y, phi, out)
        out *= self._at_normal_pair(x, y)

    def _evaluate(
        self, beta: ArrayLike, parameter: Any, phi: ArrayLike | None, *, normalized: bool
    ) -> Any:
        if not isinstance(parameter, tuple):
            if phi is not None:
                raise MdfconvError("an azimuth phi needs a pair of parameters")
            return super()._evaluate(beta, parameter, phi, normalized=normalized)
        if len(parameter) != 2:
            raise MdfconvError(f"a pair of parameters has two members, not {len(parameter)}")
        if phi is None:
            raise MdfconvError("a pair of parameters needs an azimuth phi")
        x, y = (self.parameter.check(value, self.name) for value in parameter)
        kernel = self._normalized_pair if normalized else self._unit_pair
        return evaluate(kernel, beta, x, y, phi)


def _elementwise(function: Kernel, values: ArrayLike) -> Any:
    """Apply a float64 function that expects at least one dimension to values of any shape."""
    array = np.asarray(values, dtype=float)
    # At the ends of a range a width is 0, infinite or not there: results, not accidents.
    with np.errstate(all="ignore"):
        return array if array.size == 0 else function(np.atleast_1d(array)).reshape(array.shape)[()]


def find_root(function: Kernel, bracket: tuple[float, float], argument: Array) -> Array:
    """Return the elementwise root of a function inside a bracket, NaN where there is none."""
    from scipy.optimize import elementwise

    lower, upper = (np.full(argument.shape, end) for end in bracket)
    found = elementwise.find_root(function, (lower, upper), args=(argument,))
    # A function that only approaches 0 towards an end has no root there.
    crosses = function(lower, argument) * function(upper, argument) < 0
    root: Array = np.where(found.success & crosses, found.x, np.nan)
    return root
