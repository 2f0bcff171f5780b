"""Speed against error on this machine: kernels, conversion methods, and substitutes."""

from __future__ import annotations

import os
import platform
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import scipy
from numpy.typing import ArrayLike

from mdfconv.conversion import method_named
from mdfconv.conversion.explanation import remaining_error
from mdfconv.distributions import Distribution, distribution
from mdfconv.distributions.evaluation import Array
from mdfconv.errors import MdfconvError
from mdfconv.fitting.metrics import Metric, list_metrics, metric_named
from mdfconv.fitting.problem import bounded_tangent
from mdfconv.fitting.quadrature import LobeQuadrature
from mdfconv.recommend import answers, best, covering, evaluation_times
from mdfconv.studies.stability import printed_form
from mdfconv.studies.table2 import paper_sweep
from mdfconv.timing import Advance, Spread, clock, interleave, spread

PRECISIONS = ("float64", "float32")
# Beside the methods: a loop of scipy.optimize.curve_fit.
LOOP = "curve_fit"
# What is written in Dr.Jit.
_COMPILED = "ggx"
# The paper's sweep is one of this distribution's m_B.
_PAPER_SOURCE = "beckmann"
# A method is tried on this share of the values before it is timed on all of them.
_TRIED = 0.01


@dataclass(frozen=True)
class Sizes:
    """How much is measured.

    Parameters
    ----------
    angles : int
        Angles of an evaluation, uniform on [0, π/2].
    conversions : int
        Values of a conversion by a method that needs no more than `patience` for them.
    fits : int
        Values of a conversion by any other method, and of the comparison of results.
    loop : int
        Values of a loop of scipy.optimize.curve_fit.
    rounds : int
        Repeats that are counted.
    patience : float
        Seconds.
    """

    angles: int
    conversions: int
    fits: int
    loop: int
    rounds: int
    patience: float


FULL = Sizes(angles=4_000_000, conversions=1_000_000, fits=256, loop=17, rounds=11, patience=3.0)
QUICK = Sizes(angles=2_000_000, conversions=100_000, fits=32, loop=5, rounds=5, patience=0.2)


@dataclass(frozen=True)
class Task:
    """What is measured: a reference with its substitutes, their kernels, and a pair's conversions.

    Parameters
    ----------
    reference : Distribution
        What the candidates take the place of.
    parameters : numpy.ndarray, shape (n,)
        Its parameters.
    candidates : tuple of Distribution
        The substitutes.
    source, target : Distribution
        The pair of the conversions.
    sizes : Sizes
        How much is measured.
    """

    reference: Distribution
    parameters: Array
    candidates: tuple[Distribution, ...]
    source: Distribution
    target: Distribution
    sizes: Sizes

    @property
    def steps(self) -> int:
        """How often `measure` advances."""
        evaluations = len(PRECISIONS) * (self.parameters.size + len(self.candidates))
        return (evaluations + 1) * (self.sizes.rounds + 1)


@dataclass(frozen=True)
class Substitute:
    """One distribution in the place of a reference.

    Parameters
    ----------
    reference : str
        Name of the reference.
    reference_parameter : float
        Its parameter.
    distribution : str
        Name of the distribution in its place.
    operations : int
        `Distribution.operations`: arithmetic from cos β, a transcendental function counting 10.
    parameter : float
        The best fit under the unit metric; NaN where there is none.
    rmse, max_error : float
        The error of the unit form that fit leaves, as in `remaining_error`.
    energy_error : float
        √(∫ (D − D_ref)² cos β dω / ∫ D_ref² cos β dω), for the best fit under the energy metric.
    ns_float64, ns_float32 : Spread
        Nanoseconds of an evaluation of the unit form from β.
    """

    reference: str
    reference_parameter: float
    distribution: str
    operations: int
    parameter: float
    rmse: float
    max_error: float
    energy_error: float
    ns_float64: Spread
    ns_float32: Spread


@dataclass(frozen=True)
class MethodSpeed:
    """One method on a sweep of one pair.

    Parameters
    ----------
    source, target : str
        Names of the distributions.
    method : str
        Name of the method, or ``"curve_fit"``.
    metric : str
        Under which its errors are taken: what it keeps, or unit if it has no choice.
    values : int
        Size of the array that was converted at a time.
    per_second : Spread
        Values converted a second.
    parameter_error, parameter_error_max : float
        Median and maximum over the sweep of |p/p_fit − 1|, p_fit the result of ``"fit"``.
    rmse, rmse_max : float
        Median and maximum over the sweep of the error that the conversion leaves under the
        metric: the relative root mean square of `remaining_error`.
    answered : float
        Share of the sweep for which there is a result in the legal range.
    """

    source: str
    target: str
    method: str
    metric: str
    values: int
    per_second: Spread
    parameter_error: float
    parameter_error_max: float
    rmse: float
    rmse_max: float
    answered: float

    @property
    def nanoseconds(self) -> Spread:
        """The time of a value."""
        median, low, high = (1e9 / value for value in self.per_second)
        return Spread(median, high, low)


@dataclass(frozen=True)
class KernelSpeed:
    """One distribution's unit form in one precision; times in nanoseconds an evaluation.

    Parameters
    ----------
    distribution, precision : str
        Name, and ``"float64"`` or ``"float32"``.
    parameter : float
        The parameter.
    kernel_ns, textbook_ns : Spread
        `Distribution.unit`, and the printed expression in NumPy.
    speedup : float
        Textbook/kernel: the median of the ratios within a round.
    drjit_ns : Spread, optional
        The form as Dr.Jit's LLVM backend compiles it, in one thread; of GGX, where Dr.Jit is
        installed.
    """

    distribution: str
    precision: str
    parameter: float
    kernel_ns: Spread
    textbook_ns: Spread
    speedup: float
    drjit_ns: Spread | None


@dataclass(frozen=True)
class Measurements:
    """Speed against error on one machine: its description, and the rows of three tables."""

    machine: str
    sizes: Sizes
    substitutes: Sequence[Substitute]
    methods: Sequence[MethodSpeed]
    kernels: Sequence[KernelSpeed]

    def records(self) -> dict[str, list[dict[str, Any]]]:
        """Return the tables by their names, as flat rows in full precision."""
        return {
            name: [_record(row) for row in getattr(self, name)]
            for name in ("substitutes", "methods", "kernels")
        }


def _record(row: Substitute | MethodSpeed | KernelSpeed) -> dict[str, Any]:
    """Return a row with a spread in three columns, and without what was not measured."""
    record: dict[str, Any] = {}
    for field, value in vars(row).items():
        name = {"source": "from", "target": "to"}.get(field, field)
        if isinstance(value, Spread):
            record |= value.columns(name)
        elif value is not None:
            record[name] = value
    return record


def measure(task: Task, advance: Advance) -> Measurements:
    """Measure substitutes, conversion methods and kernels.

    `advance` is called with 1 after each of `task`.steps rounds.

    Raises
    ------
    MdfconvError
        If there is nothing to convert from source to target.
    """
    # The conversions come first: they may refuse the pair.
    methods = method_speeds(task.source, task.target, task.sizes, advance)
    return Measurements(
        machine=machine(),
        sizes=task.sizes,
        methods=methods,
        substitutes=substitutes(
            task.reference, task.parameters, task.candidates, task.sizes, advance
        ),
        kernels=kernel_speeds(task.candidates, task.sizes, advance),
    )


def machine() -> str:
    """Return processor, system and versions in a line."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        lines = []
    models = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    processor = models[0] if models else platform.processor() or platform.machine()
    return (
        f"{processor} ({os.cpu_count()} CPUs), {platform.system()} {platform.machine()}, "
        f"Python {platform.python_version()}, NumPy {np.__version__}, SciPy {scipy.__version__}"
    )


def substitutes(
    reference: Distribution,
    parameters: Array,
    candidates: Sequence[Distribution],
    sizes: Sizes,
    advance: Advance,
) -> list[Substitute]:
    """Measure every candidate in the place of a reference, for each of its parameters."""
    unit, energy = metric_named("unit"), metric_named("energy")
    shapes = [best(reference, parameters, candidate, unit) for candidate in candidates]
    lights = [best(reference, parameters, candidate, energy) for candidate in candidates]
    rows = []
    for number, reference_parameter in enumerate(parameters.tolist()):
        fits = [[float(column[number]) for column in columns] for columns in shapes]
        # Where there is no best fit a typical lobe is timed.
        lobes = [
            (candidate, candidate.parameter.typical_value if np.isnan(fit[0]) else fit[0])
            for candidate, fit in zip(candidates, fits, strict=True)
        ]
        float64, float32 = (
            evaluation_times(lobes, precision, sizes.angles, sizes.rounds, advance)
            for precision in PRECISIONS
        )
        rows += [
            Substitute(
                reference=reference.name,
                reference_parameter=reference_parameter,
                distribution=candidate.name,
                operations=candidate.operations,
                parameter=fits[place][0],
                rmse=fits[place][1],
                max_error=fits[place][2],
                energy_error=float(lights[place][1][number]),
                ns_float64=float64[place],
                ns_float32=float32[place],
            )
            for place, candidate in enumerate(candidates)
        ]
    return rows


def kernel_speeds(
    candidates: Sequence[Distribution], sizes: Sizes, advance: Advance
) -> list[KernelSpeed]:
    """Measure the unit forms of distributions in both precisions."""
    speeds = []
    for precision in PRECISIONS:
        beta = np.linspace(0, np.pi / 2, sizes.angles, dtype=precision)
        for candidate in candidates:
            parameter = candidate.parameter.typical_value
            rounded = beta.dtype.type(parameter)
            functions: dict[str, Callable[[], object]] = {
                "kernel": partial(candidate.unit, beta, parameter),
                "textbook": partial(printed_form, candidate, "unit", beta, rounded),
            }
            if candidate.name == _COMPILED and _drjit():
                functions["drjit"] = compiled_ggx(beta, parameter)
            samples = interleave(functions, sizes.rounds, advance)
            times = {name: spread(1e9 * each / beta.size) for name, each in samples.items()}
            speeds.append(
                KernelSpeed(
                    candidate.name,
                    precision,
                    parameter,
                    times["kernel"],
                    times["textbook"],
                    float(np.median(samples["textbook"] / samples["kernel"])),
                    times.get("drjit"),
                )
            )
    return speeds


def compiled_ggx(beta: Array, alpha: float) -> Callable[[], Any]:
    """Return what evaluates GGX's unit form in Dr.Jit, which is installed, in one thread."""
    drjit = _drjit()
    drjit.set_thread_count(1)
    kind = drjit.llvm.Float64 if beta.dtype == np.float64 else drjit.llvm.Float
    angles, slope = kind(beta), 1 / alpha**2 - 1

    def evaluate() -> Any:
        value = drjit.square(drjit.rcp(drjit.fma(drjit.square(drjit.sin(angles)), slope, 1)))
        drjit.eval(value)
        drjit.sync_thread()
        return value

    return evaluate


def _drjit() -> Any:
    """Return the module; None where it is not installed or finds no LLVM."""
    try:
        drjit = import_module("drjit")
        import_module("drjit.llvm")
    except ImportError:
        return None
    return drjit if drjit.has_backend(drjit.JitBackend.LLVM) else None


def as_wide(m_b: ArrayLike, source: Distribution) -> Array:
    """Return the parameters of lobes as wide at half height as Beckmann's at m_B.

    They are NaN where the distribution has no such lobe.
    """
    tangents = distribution(_PAPER_SOURCE).half_tangent(m_b)
    return np.asarray(source.from_half_tangent(tangents))


def sweep(source: Distribution, count: int) -> Array:
    """Return parameters for lobes as wide as those of the paper's sweep, evenly in logarithm."""
    m_b, _ = paper_sweep()
    low, high = as_wide([m_b.min(), m_b.max()], source).tolist()
    return np.geomspace(low, high, count)


@dataclass(frozen=True)
class _Trial:
    """A way to convert a pair, and the metric under which its errors are taken."""

    method: str
    metric: Metric
    convert: Callable[[Array], Array]


def method_speeds(
    source: Distribution, target: Distribution, sizes: Sizes, advance: Advance
) -> list[MethodSpeed]:
    """Measure every method that covers a pair, under every metric it can answer.

    Raises
    ------
    MdfconvError
        If there is nothing to convert between the two.
    """
    if source.is_same(target):
        raise MdfconvError(f"from {source.name} to {target.name} there is nothing to convert")
    trials = _trials(source, target)
    values = [_count(trial, source, sizes) for trial in trials]
    functions = {
        str(number): partial(trial.convert, sweep(source, count))
        for number, (trial, count) in enumerate(zip(trials, values, strict=True))
    }
    times = interleave(functions, sizes.rounds, advance)
    return [
        _method_speed(source, target, trial, count, sizes, seconds)
        for trial, count, seconds in zip(trials, values, times.values(), strict=True)
    ]


def _trials(source: Distribution, target: Distribution) -> list[_Trial]:
    """Return every way to convert a pair: what follows no metric once, under the first one."""
    metrics = [metric_named(name) for name in list_metrics()]
    methods = [
        _Trial(
            method.name,
            metric,
            partial(answers, method, source=source, target=target, metric=metric),
        )
        for metric in metrics
        for method in covering(source, target, metric)
        if method.follows_metric or metric is metrics[0]
    ]
    return methods + [
        _Trial(LOOP, metric, partial(curve_fit_loop, source=source, target=target, metric=metric))
        for metric in metrics
    ]


def _count(trial: _Trial, source: Distribution, sizes: Sizes) -> int:
    """Return how many values a method is timed on: many if it is quick."""
    # Among more values most come from a curve: here each is fitted.
    counts = {LOOP: sizes.loop, "fit": sizes.fits}
    if trial.method in counts:
        return counts[trial.method]
    few = sweep(source, max(1, round(_TRIED * sizes.conversions)))
    start = clock()
    trial.convert(few)
    quick = (clock() - start) / _TRIED <= sizes.patience
    return sizes.conversions if quick else sizes.fits


def _method_speed(
    source: Distribution,
    target: Distribution,
    trial: _Trial,
    values: int,
    sizes: Sizes,
    seconds: Array,
) -> MethodSpeed:
    parameter = sweep(source, min(values, sizes.fits))
    result = trial.convert(parameter)
    fitted = answers(method_named("fit"), parameter, source, target, trial.metric)
    answered = ~np.isnan(result) & ~np.isnan(fitted)
    off = np.abs(result[answered] / fitted[answered] - 1)
    rmse, _ = remaining_error(source, parameter[answered], target, result[answered], trial.metric)
    return MethodSpeed(
        source=source.name,
        target=target.name,
        method=trial.method,
        metric=str(trial.metric),
        values=values,
        per_second=spread(values / seconds),
        parameter_error=_summary(np.median, off),
        parameter_error_max=_summary(np.max, off),
        rmse=_summary(np.median, rmse),
        rmse_max=_summary(np.max, rmse),
        answered=float(np.mean(answered)),
    )


def _summary(function: Callable[[Array], Any], values: Array) -> float:
    return float(function(values)) if values.size else float("nan")


def curve_fit_loop(
    parameter: Array, source: Distribution, target: Distribution, metric: Metric
) -> Array:
    """Fit values one by one from equal half angles, on the samples that the package fits to.

    It is what one would write without the package. Results are NaN where there is no start or
    no convergence.
    """
    from scipy.optimize import OptimizeWarning, curve_fit

    beta, weight = LobeQuadrature(np.arctan(bounded_tangent(source, parameter))).nodes(
        np.arange(parameter.size)
    )
    column = parameter[:, None]
    peak = source.maximum(column, normalized=metric.normalized)
    reference = metric.signal(source, beta, column, peak)
    starts = target.from_half_tangent(source.half_tangent(parameter))
    results = np.full(parameter.size, np.nan)
    with np.errstate(all="ignore"), warnings.catch_warnings():
        sigma = 1 / np.sqrt(weight * metric.weight(beta))
        # A perfect fit has no covariance to speak of.
        warnings.simplefilter("ignore", OptimizeWarning)
        for row in np.flatnonzero(~np.isnan(starts)).tolist():

            def signal(angle: Array, log_parameter: float, row: int = row) -> Array:
                return metric.signal(target, angle, np.exp([log_parameter]), peak[row])

            try:
                fitted, _ = curve_fit(
                    signal, beta[row], reference[row], [np.log(starts[row])], sigma[row]
                )
            except RuntimeError:
                continue
            results[row] = np.exp(fitted[0])
    return results
