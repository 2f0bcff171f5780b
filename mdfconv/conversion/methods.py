"""The conversion methods, one class each, and the registry of them.

A new method is a class, and its place in the registry at the end.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any, ClassVar, NamedTuple

import numpy as np

from mdfconv.distributions import Distribution
from mdfconv.distributions.endpoint import Endpoint, ParameterMap, follow, to_root
from mdfconv.distributions.evaluation import Array, Mask, by_blocks
from mdfconv.distributions.parameter import number_text
from mdfconv.errors import MdfconvError
from mdfconv.fitting.maps import StoredFit, made_map
from mdfconv.fitting.metrics import Metric, list_metrics, metric_named
from mdfconv.fitting.problem import ConversionTask
from mdfconv.registry import Registry


class Solution(NamedTuple):
    """Parameters of the target; with them γ and whether it met a limit, where γ was free."""

    parameter: Array
    gamma: Array | None = None
    gamma_at_limit: Mask | None = None


class Method(ABC):
    """A rule that takes the parameter of one distribution to that of another.

    A rule that covers every pair in one step names it in `step`; others say their `route`.
    """

    name: ClassVar[str]
    # What it preserves, to follow the word "keeps", unless that is for the metric to say.
    preserves: ClassVar[str] = ""
    step: ClassVar[str] = ""
    # Whether the answer depends on the metric; else that is only what the errors measure.
    follows_metric: ClassVar[bool] = False
    # Whether elements of an array that have no answer become NaN, with a warning.
    gaps_as_nan: ClassVar[bool] = False

    @property
    def has_cautions(self) -> bool:
        """Whether a conversion may call for a caution."""
        return type(self).cautions is not Method.cautions

    def keeps(self, metric: Metric) -> str:
        """Return what the conversion keeps, to follow the word "keeps"."""
        return metric.keeps if self.follows_metric else self.preserves

    def route(self, source: Distribution, target: Distribution) -> tuple[str, ...] | None:
        """Return the steps of the conversion in words; None if the pair is not covered."""
        return (self.step,)

    @abstractmethod
    def convert(self, task: ConversionTask) -> Array:
        """Return target parameters (float64), for a pair that is covered.

        Where the rule leaves the target's legal range it returns what it computes; where it
        computes nothing, NaN.
        """

    def solve(self, task: ConversionTask) -> Solution:
        """Return all parameters of the target, as `convert` the first one."""
        return Solution(np.asarray(self.convert(task)))

    def covers(self, source: Distribution, target: Distribution, metric: Metric) -> bool:
        """Return whether the method can answer for a pair under a metric."""
        return self.route(source, target) is not None

    def answered_by(self, task: ConversionTask) -> list[str]:
        """Return the name of the method that answers each value, for a pair that is covered."""
        return [self.name] * task.parameter.size

    def range_text(self, source: Distribution, target: Distribution, metric: Metric) -> str:
        """Return which parameters of the source a method with a range of its own covers."""
        return ""

    def cautions(self, task: ConversionTask, result: Array) -> dict[str, Mask]:
        """Return what a careful user must know in sentences, and of which numbers they are true."""
        return {}


class FormulaMethod(Method):
    """A method made of formulas, looked up by the names of source and target.

    A distribution that is another one in another parameter goes through that one's formulas.
    """

    formulas: ClassVar[Mapping[tuple[str, str], ParameterMap]]
    # From the name of a distribution to that of the one through which all its formulas lead.
    through: ClassVar[Mapping[str, str]] = {}

    def route(self, source: Distribution, target: Distribution) -> tuple[str, ...] | None:
        """Return the formulas of the conversion; None if the pair is not covered."""
        steps = self._steps(source, target)
        return None if steps is None else tuple(step.text for step in steps if step.text)

    def convert(self, task: ConversionTask) -> Array:
        """Apply the formulas one after the other; NaN where one leaves the positive numbers."""
        parameter = task.parameter
        for number, step in enumerate(self._steps(task.source, task.target) or ()):
            if number:
                parameter = np.where(parameter > 0, parameter, np.nan)
            parameter = step.function(parameter)
        return parameter

    def cautions(self, task: ConversionTask, result: Array) -> dict[str, Mask]:
        """Say where a formula is used beyond the point at which it turns around."""
        cautions, parameter = {}, task.parameter
        for step in self._steps(task.source, task.target) or ():
            sentence = f"beyond {step.turns_at:.3g} the formula {step.text} turns around"
            cautions[sentence] = parameter > step.turns_at
            parameter = step.function(parameter)
        return cautions

    def _steps(self, source: Distribution, target: Distribution) -> list[ParameterMap] | None:
        first, forward, _ = to_root(source, same_lobe=False)
        last, _, back = to_root(target, same_lobe=False)
        path = self._path(first, last)
        return None if path is None else [*forward, *path, *back]

    def _path(self, source: Distribution, target: Distribution) -> list[ParameterMap] | None:
        # Formulas speak of the distributions as they stand in the registry.
        if source.is_same(target):
            return []
        if source.second_parameter or target.second_parameter:
            return None
        names = source.name, target.name
        if names in self.formulas:
            return [self.formulas[names]]
        for via in (self.through.get(name) for name in names):
            if via and {(names[0], via), (via, names[1])} <= self.formulas.keys():
                return [self.formulas[names[0], via], self.formulas[via, names[1]]]
        return None


# What the paper's sweep m_B ∈ [0.0044, 0.4473] (its Table 2) covers, in each parameter.
_SWEEP = {
    "beckmann": (0.0044, 0.4473),
    "gauss": (0.0044, 0.4970),
    "blinn-phong": (10.0, 1e5),
    "sawicki": (9.218, 117400.0),
    "ggx": (0.005364, 0.4865),
}


def _cubic(text: str, linear: float, cubic: float) -> tuple[Any, ...]:
    """Return linear x − cubic x³, which turns around where it has a maximum."""
    turns_at = float(np.sqrt(linear / (3 * cubic))) if cubic > 0 else float("inf")
    return text, lambda x: x * (linear - cubic * x * x), turns_at


# Texts and functions, and where these turn around.
_PARTS: Mapping[tuple[str, str], tuple[Any, ...]] = {
    ("beckmann", "blinn-phong"): ("N = 2/m_B² − 2.5 (eq. 12)", lambda m: 2 / m**2 - 2.5),
    ("blinn-phong", "beckmann"): (
        "m_B = √2/√(N+2.5) (eq. 12)",
        lambda n: np.sqrt(2) / np.sqrt(n + 2.5),
    ),
    ("beckmann", "gauss"): _cubic("m_G = 0.5591 m_B³ + m_B (eq. 13)", 1, -0.5591),
    ("gauss", "beckmann"): _cubic("m_B = m_G − 0.4134 m_G³ (eq. 13)", 1, 0.4134),
    ("gauss", "blinn-phong"): ("N = 2/m_G² − 0.5 (eq. 14)", lambda m: 2 / m**2 - 0.5),
    ("blinn-phong", "gauss"): (
        "m_G = √2/√(N+0.5) (eq. 14)",
        lambda n: np.sqrt(2) / np.sqrt(n + 0.5),
    ),
    ("blinn-phong", "sawicki"): ("N_DS = 1.174 N + 0.3 (eq. 15)", lambda n: 1.174 * n + 0.3),
    ("sawicki", "blinn-phong"): ("N = (N_DS − 0.3)/1.174 (eq. 15)", lambda n: (n - 0.3) / 1.174),
    ("ggx", "gauss"): _cubic("m_G = 0.8222 C + 0.82 C³ (Table 3)", 0.8222, -0.82),
    ("ggx", "beckmann"): ("m_B = 0.8388 C + 0.7 C⁴ (Table 3)", lambda c: c * (0.8388 + 0.7 * c**3)),
    ("ggx", "blinn-phong"): ("N = 1.696²/C² − 4.5 (Table 3)", lambda c: 1.696**2 / c**2 - 4.5),
    ("gauss", "ggx"): _cubic("C = 1.186 m_G − 0.835 m_G³ (Table 4)", 1.186, 0.835),
    ("beckmann", "ggx"): _cubic("C = 1.2 m_B − 0.56 m_B³ (Table 4)", 1.2, 0.56),
    ("blinn-phong", "ggx"): ("C = 1.697/√(N+4.5) (Table 4)", lambda n: 1.697 / np.sqrt(n + 4.5)),
}
_FORMULAS = {pair: ParameterMap(*parts) for pair, parts in _PARTS.items()}


@lru_cache(maxsize=64)
def _sweep(source: Distribution) -> list[float]:
    """Return the ends of the paper's sweep in the parameter of a distribution."""
    root, _, back = to_root(source, same_lobe=False)
    return [float(f"{end:.6g}") for end in follow(back, np.array(_SWEEP[root.name]))]


class ClosedForm(FormulaMethod):
    """The formulas of Sawicki 2021, fitted to its Table 2: they keep the shape of the lobe.

    Eqs (12)-(15), Tables 3 and 4. They were fitted for m_B from 0.0044 to 0.4473. The two
    directions of a pair are not exact inverses of each other.
    """

    name = "closed-form"
    preserves = "shape of the lobe, approximately"
    formulas: ClassVar = _FORMULAS
    # All formulas of Sawicki's distribution lead through Blinn/Phong.
    through: ClassVar = {"sawicki": "blinn-phong"}

    def cautions(self, task: ConversionTask, result: Array) -> dict[str, Mask]:
        """Add to the turning points whether the source is outside the paper's sweep."""
        source, parameter = task.source, task.parameter
        lower, upper = _sweep(source)
        outside = (
            f"outside the paper's sweep: its formulas were fitted for {source.name} "
            f"{source.parameter.symbol} from {number_text(lower)} to {number_text(upper)}"
        )
        return {outside: (parameter < lower) | (parameter > upper)} | super().cautions(task, result)


# So many numbers and their intermediates stay in the cache.
_BLOCK = 32768


class HalfAngle(Method):
    """Both distributions fall to half of their value at the normal at the same angle.

    Blinn 1977; Sawicki 2021, eqs (3)-(10).
    """

    name = "half-angle"
    preserves = "angle of half height"
    step = "β_half of the source = β_half of the target"

    def convert(self, task: ConversionTask) -> Array:
        """Go through tan β_half; NaN where a distribution never falls to one half."""

        def converted(parameter: Array) -> Array:
            return np.asarray(task.target.from_half_tangent(task.source.half_tangent(parameter)))

        return by_blocks(converted, task.parameter, _BLOCK)


class Ward(FormulaMethod):
    """m_B² N = 2: the rule of thumb of Ward 1996, eq. (11) in Sawicki 2021."""

    name = "ward"
    preserves = "shape of a smooth lobe, roughly"
    formulas: ClassVar = {
        ("beckmann", "blinn-phong"): ParameterMap("N = 2/m_B² (eq. 11)", lambda m: 2 / m**2),
        ("blinn-phong", "beckmann"): ParameterMap(
            "m_B = √(2/N) (eq. 11)", lambda n: np.sqrt(2 / n)
        ),
    }


class Peak(Method):
    """Both normalized forms have the same value at the normal, D(0) = 1/(π α²).

    Between Beckmann and GGX this is equal α; between Beckmann and Blinn/Phong it is
    m = √(2/(N+2)), the usual rule between roughness and shininess.
    """

    name = "peak"
    preserves = "peak of the normalized form"
    step = "D(0) of the source = D(0) of the target"

    def convert(self, task: ConversionTask) -> Array:
        """Go through the α with that peak; NaN where the target has no such peak."""
        return task.target.from_peak_alpha(task.source.peak_alpha(task.parameter))


class LeastSquares(Method):
    """The target with the smallest squared distance from the source over the hemisphere.

    The metric says which distance: of the unit forms (shape), of the normalized forms (light),
    or of what a screen shows of them (picture).
    """

    name = "fit"
    step = "least squares"
    follows_metric = True

    def convert(self, task: ConversionTask) -> Array:
        """Fit every value; NaN where the fit tends to the open end of the legal range."""
        from mdfconv.fitting.solve import fit

        fits = fit(task.source, task.parameter.ravel(), task.target, task.metric)
        return fits.parameter.reshape(task.parameter.shape)

    def cautions(self, task: ConversionTask, result: Array) -> dict[str, Mask]:
        """Say where the best fit is the end of the target's range."""
        limits = task.target.parameter
        sentence = f"the best fit lies at the end of the legal range of {task.target.name}"
        return {sentence: (result == limits.upper) & limits.upper_closed}


# Fewer values are fitted sooner than a map is made.
_MANY = 8192


class Fast(Method):
    """The least-squares fit from stored polynomials: 1e-6 from it, 1e-5 for a display.

    Covers the usual range of the source (N from 0.1) as far as the fit does and the target
    stays usable, under the metrics for which there are maps. For a display at another exposure
    than 1 many values have a map made for them, within 1e-4.
    """

    name = "fast"
    step = "stored least squares"
    follows_metric = True
    gaps_as_nan = True

    def route(self, source: Distribution, target: Distribution) -> tuple[str, ...] | None:
        """Return the one step; None for pairs without maps, such as those of GTR."""
        metrics = map(metric_named, list_metrics())
        covered = any(self.covers(source, target, metric) for metric in metrics)
        return (self.step,) if covered else None

    def covers(self, source: Distribution, target: Distribution, metric: Metric) -> bool:
        """Return whether there is a map, one to make others from, or a constant."""
        return _stored(source, target, metric).known

    def convert(self, task: ConversionTask) -> Array:
        """Evaluate the polynomials; NaN outside their range."""
        stored = _stored(task.source, task.target, task.metric)
        if len(task.metric.from_stored()) > 1 and not stored.exact:
            if task.parameter.size < _MANY:
                return LeastSquares().convert(task)
            stored = stored.with_map(made_map(*stored.pair, str(task.metric)))
        return stored(task.parameter)

    def range_text(self, source: Distribution, target: Distribution, metric: Metric) -> str:
        """Return which parameters of the source the stored maps cover."""
        return _stored(source, target, metric).range_text()


def _stored(source: Distribution, target: Distribution, metric: Metric) -> StoredFit:
    """Return what is stored under a metric, or under the one that it is followed from."""
    return StoredFit(source, target, metric.from_stored()[0])


class BestFit(LeastSquares):
    """The fit, from the stored polynomials as far as they reach."""

    def convert(self, task: ConversionTask) -> Array:
        """Take the stored fits, and fit what they do not cover."""
        result = self._stored(task)
        missing = np.isnan(result)
        if missing.any():
            result[missing] = super().convert(task.part(missing))
        return result

    def answered_by(self, task: ConversionTask) -> list[str]:
        """Return "fast" where the stored fits reach, else "fit"."""
        missing = np.isnan(self._stored(task))
        return np.where(missing, self.name, Fast.name).tolist()

    def _stored(self, task: ConversionTask) -> Array:
        """Return the stored fits, NaN where there is none."""
        if not Fast().covers(task.source, task.target, task.metric):
            return np.full(task.parameter.shape, np.nan)
        return Fast().convert(task)


class FreeGammaFit(LeastSquares):
    """The fit of both parameters of a target that has two."""

    def solve(self, task: ConversionTask) -> Solution:
        """Fit both parameters."""
        from mdfconv.fitting.free_gamma import fit_free_gamma

        fits = fit_free_gamma(task.source, task.parameter.ravel(), task.target, task.metric)
        shape = task.parameter.shape
        return Solution(
            fits.parameter.reshape(shape), fits.gamma.reshape(shape), fits.at_limit.reshape(shape)
        )


class ExactRoute(Method):
    """The steps between distributions that have the same lobes, in the place of every method."""

    name = "exact"

    def __init__(self, steps: Sequence[ParameterMap]) -> None:
        self._steps = steps

    def convert(self, task: ConversionTask) -> Array:
        """Take the steps one after the other."""
        return follow(self._steps, task.parameter)


_REGISTRY: Registry[Method] = Registry("method")
# The default first.
for _method in (ClosedForm(), HalfAngle(), Ward(), Peak(), LeastSquares(), Fast()):
    _REGISTRY.add(_method.name, _method)


def list_methods() -> tuple[Method, ...]:
    """Return every conversion method, the default first."""
    return tuple(_REGISTRY)


def method_named(name: str) -> Method:
    """Return the method with a given name.

    Raises
    ------
    MdfconvError
        If the name is not known; the message offers the nearest ones.
    """
    return _REGISTRY[name]


def default_method(
    source: Distribution, target: Distribution, *, metric_given: bool = True
) -> Method:
    """Return the method for a pair where none is asked for.

    With a metric that is the fit under it; without, the closed form of a pair that has one.
    """
    closed_form = _REGISTRY[ClosedForm.name]
    if metric_given or closed_form.route(source, target) is None:
        return BestFit()
    return closed_form


def method_with_free_gamma(name: str | None, target: Distribution) -> Method:
    """Return the method for a free γ; raise if the target has none or another method is named."""
    if target.second_parameter is None:
        raise MdfconvError(f"{target.name} has one parameter and no γ to fit")
    method = FreeGammaFit()
    if name is not None and method_named(name).name != method.name:
        raise MdfconvError(f"{method_named(name).name} takes γ as it is", f"{method.name} finds it")
    return method


def check_covered(method: Method, metric: Metric, source: Endpoint, target: Endpoint) -> None:
    """Raise unless a method has a conversion for a pair under a metric."""
    pair = source.distribution, target.distribution
    if method.route(*pair) is None:
        others = [other.name for other in list_methods() if other.route(*pair) is not None]
        raise MdfconvError(
            f"{method.name} has no conversion from {pair[0].label} to {pair[1].label}",
            f"use {' or '.join(others)}",
        )
    if not method.covers(*pair, metric):
        raise MdfconvError(
            f"{method.name} has no conversion stored from {pair[0].label} to {pair[1].label} "
            f"under the {metric} metric",
            "use fit",
        )
