"""Speed against error on this machine: kernels, conversion methods, and substitutes."""

from __future__ import annotations

import os
import platform
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import scipy
from numpy.typing import ArrayLike

from mdfconv.conversion import method_named
from mdfconv.conversion.explanation import remaining_error
from mdfconv.distributions import Distribution, distribution
from mdfconv.distributions.angles import Angles
from mdfconv.distributions.evaluation import Array
from mdfconv.errors import MdfconvError
from mdfconv.fitting.metrics import Metric, list_metrics, metric_named
from mdfconv.fitting.problem import bounded_tangent
from mdfconv.fitting.quadrature import LobeQuadrature
from mdfconv.recommend import answers, best, covering, evaluation_times
from mdfconv.studies.compiled import drjit_evaluation
from mdfconv.studies.stability import printed_form
from mdfconv.studies.table2 import paper_sweep
from mdfconv.timing import Advance, Spread, interleave, spread

PRECISIONS = ("float64", "float32")
# Beside the methods: loops of scipy.optimize.curve_fit, on what `fit` compares, and on samples of
# the printed unit forms on a part of the hemisphere, as one would write it without the package.
LOOP, PLAIN_LOOP = "curve_fit", "curve_fit, 200 samples"
_PLAIN_SAMPLES, _PLAIN_END = 200, 0.8
Row = dict[str, Any]
# The paper's sweep is one of this distribution's m_B.
_PAPER_SOURCE = "beckmann"


@dataclass(frozen=True)
class Sizes:
    """How much is measured.

    Parameters
    ----------
    angles : int
        Angles of an evaluation, uniform on [0, π/2].
    conversions : int
        Values of a conversion by a formula, or from what is stored.
    fits : int
        Values of a conversion by ``"fit"``, and of the comparison of results.
    loop : int
        Values of each loop of scipy.optimize.curve_fit.
    rounds : int
        Repeats that are counted.
    """

    angles: int
    conversions: int
    fits: int
    loop: int
    rounds: int


# The results of so few angles stay on the heap.
FULL = Sizes(angles=1 << 20, conversions=100_000, fits=512, loop=17, rounds=21)
QUICK = Sizes(angles=1 << 19, conversions=100_000, fits=128, loop=5, rounds=5)


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
class Measurements:
    """Speed against error on one machine: its description, and three tables.

    Times in the rows are `Spread` objects. What the columns hold stands with the functions that
    measure them: `substitutes`, `method_speeds` and `kernel_speeds`.
    """

    machine: str
    sizes: Sizes
    tables: Mapping[str, Sequence[Row]]

    def records(self) -> dict[str, list[Row]]:
        """Return the tables by their names, as flat rows in full precision."""
        return {name: [_record(row) for row in rows] for name, rows in self.tables.items()}


def _record(row: Row) -> Row:
    """Return a row with a spread in three columns."""
    record: Row = {}
    for name, value in row.items():
        record |= value.columns(name) if isinstance(value, Spread) else {name: value}
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
    methods = method_speeds(task, advance)
    tables = {"substitutes": substitutes(task, advance), "methods": methods}
    tables["kernels"] = kernel_speeds(task, advance)
    return Measurements(machine(), task.sizes, tables)


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


def substitutes(task: Task, advance: Advance) -> list[Row]:
    """Measure every candidate in the place of the reference, for each of its parameters.

    Parameter, RMSE and maximum error are those of the best fit under the unit metric, as in
    `remaining_error`, NaN where there is none; `energy_error` is the RMSE of that under the energy
    metric. Times are nanoseconds of an evaluation of the unit form from β.
    """
    shapes, lights = (
        np.array([best(task.reference, task.parameters, one, metric) for one in task.candidates])
        for metric in map(metric_named, ("unit", "energy"))
    )
    rows = []
    for number, reference_parameter in enumerate(task.parameters.tolist()):
        fits = shapes[:, :, number].tolist()
        # Where there is no best fit a typical lobe is timed.
        lobes = [
            (candidate, candidate.parameter.typical_value if np.isnan(fit[0]) else fit[0])
            for candidate, fit in zip(task.candidates, fits, strict=True)
        ]
        how = task.sizes.angles, task.sizes.rounds, advance
        times = {f"ns_{dtype}": evaluation_times(lobes, dtype, *how) for dtype in PRECISIONS}
        for place, candidate in enumerate(task.candidates):
            row = {
                "reference": task.reference.name,
                "reference_parameter": reference_parameter,
                "distribution": candidate.name,
                "operations": candidate.operations,
                **dict(zip(("parameter", "rmse", "max_error"), fits[place], strict=True)),
                "energy_error": float(lights[place, 1, number]),
            }
            rows.append(row | {name: spreads[place] for name, spreads in times.items()})
    return rows


def kernel_speeds(task: Task, advance: Advance) -> list[Row]:
    """Measure the unit forms of the candidates in both precisions, and what they can be held to.

    Times are nanoseconds of an evaluation: of the kernel, of the printed expression as Dr.Jit
    compiles it (`drjit_evaluation`, where there is one) and in NumPy, and of copying the angles,
    which is what memory allows. Ratios are the kernel's times over the others', medians of those
    within a round.
    """
    rows = []
    for precision in PRECISIONS:
        beta = np.linspace(0, np.pi / 2, task.sizes.angles, dtype=precision)
        for candidate in task.candidates:
            parameter = candidate.parameter.typical_value
            functions: dict[str, Callable[[], object] | None] = {
                "kernel": partial(candidate.unit, beta, parameter),
                "drjit": drjit_evaluation(candidate, beta, parameter),
                "textbook": partial(
                    printed_form, candidate, "unit", beta, beta.dtype.type(parameter)
                ),
                "copy": beta.copy,
            }
            measured = {name: each for name, each in functions.items() if each}
            samples = interleave(measured, task.sizes.rounds, advance)
            row = {"distribution": candidate.name, "precision": precision, "parameter": parameter}
            for name, seconds in samples.items():
                row[f"{name}_ns"] = spread(1e9 * seconds / beta.size)
            kernel = samples.pop("kernel")
            for name, seconds in samples.items():
                row[f"per_{name}"] = float(np.median(kernel / seconds))
            rows.append(row)
    return rows


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


def method_speeds(task: Task, advance: Advance) -> list[Row]:
    """Measure every method that covers the pair, under every metric it can answer.

    What follows no metric is measured once, under the first one, that of the unit forms. `values`
    are converted at a time, `per_second` is how many a second; `over_loop` and `over_plain_loop`
    are how many times as many as by a loop of curve_fit, by `curve_fit_loop` under the same metric
    and by `plain_loop`. The errors are the median and the maximum, over the share of the sweep that
    is `answered` within the legal range: of |p/p_fit − 1|, p_fit the result of ``"fit"``, and of
    the RMSE of `remaining_error`.

    Raises
    ------
    MdfconvError
        If there is nothing to convert between the two.
    """
    source, target, sizes = task.source, task.target, task.sizes
    if source.is_same(target):
        raise MdfconvError(f"from {source.name} to {target.name} there is nothing to convert")
    metrics = [metric_named(name) for name in list_metrics()]
    methods: list[tuple[str, Metric, Callable[..., Array]]] = [
        (method.name, metric, partial(answers, method))
        for metric in metrics
        for method in covering(source, target, metric)
        if method.follows_metric or metric is metrics[0]
    ]
    plain = PLAIN_LOOP, metrics[0]
    methods += [(LOOP, metric, curve_fit_loop) for metric in metrics] + [(*plain, plain_loop)]
    # Among more values most fits come from a curve: here each is found by itself.
    counts = {LOOP: sizes.loop, PLAIN_LOOP: sizes.loop, "fit": sizes.fits}
    values = [counts.get(name, sizes.conversions) for name, _, _ in methods]
    conversions = {
        (name, metric): partial(convert, sweep(source, count), source, target, metric)
        for (name, metric, convert), count in zip(methods, values, strict=True)
    }
    times = interleave(conversions, sizes.rounds, advance)
    speeds = {key: count / times[key] for key, count in zip(conversions, values, strict=True)}
    rows = []
    for (name, metric, convert), count in zip(methods, values, strict=True):
        parameter = sweep(source, min(count, sizes.fits))
        result = convert(parameter, source, target, metric)
        fitted = answers(method_named("fit"), parameter, source, target, metric)
        answered = ~np.isnan(result) & ~np.isnan(fitted)
        parameter, result = parameter[answered], result[answered]
        off = np.abs(result / fitted[answered] - 1)
        rmse, _ = remaining_error(source, parameter, target, result, metric)
        if not answered.any():
            off = rmse = np.array([np.nan])
        row: Row = {"from": source.name, "to": target.name, "method": name, "metric": str(metric)}
        speed = speeds[name, metric]
        row |= {"values": count, "per_second": spread(speed)}
        row["over_loop"] = float(np.median(speed / speeds[LOOP, metric]))
        row["over_plain_loop"] = float(np.median(speed / speeds[plain]))
        for column, errors in (("parameter_error", off), ("rmse", rmse)):
            row |= {column: float(np.median(errors)), f"{column}_max": float(np.max(errors))}
        rows.append(row | {"answered": float(np.mean(answered))})
    return rows


def curve_fit_loop(
    parameter: Array, source: Distribution, target: Distribution, metric: Metric
) -> Array:
    """Fit values one by one from equal half angles, on the samples that the package fits to.

    Results are NaN where there is no start or no convergence.
    """
    angles, weight = LobeQuadrature(np.arctan(bounded_tangent(source, parameter))).nodes(
        np.arange(parameter.size)
    )
    column = parameter[:, None]
    peak = source.maximum(column, normalized=metric.normalized)
    with np.errstate(all="ignore"):
        reference = metric.signal(source, angles, column, peak)
        sigma = 1 / np.sqrt(weight * metric.weight(angles))

    def problem(row: int, start: float) -> tuple[Any, ...]:
        def signal(beta: Array, log_parameter: float) -> Array:
            return metric.signal(target, Angles(beta), np.exp([log_parameter]), peak[row])

        return signal, angles.beta[row], reference[row], [np.log(start)], sigma[row]

    return np.exp(_one_by_one(parameter, source, target, problem))


def plain_loop(
    parameter: Array, source: Distribution, target: Distribution, metric: Metric
) -> Array:
    """Fit values one by one as one would without the package, whatever the metric.

    The printed unit forms are compared at 200 angles from 0 to 0.8, from equal half angles.
    Results are NaN where there is no start, no convergence, or none in the legal range.
    """
    beta = np.linspace(0, _PLAIN_END, _PLAIN_SAMPLES)

    def form(mdf: Distribution) -> Callable[[Array, float], Array]:
        gamma = [mdf.gamma] if mdf.second_parameter else []
        return lambda beta, value: mdf.printed.unit(beta, value, *gamma)

    shape, reference = form(target), form(source)

    def problem(row: int, start: float) -> tuple[Any, ...]:
        return shape, beta, reference(beta, parameter[row]), [start]

    result = _one_by_one(parameter, source, target, problem)
    return np.where(target.parameter.accepts(result), result, np.nan)


def _one_by_one(
    parameter: Array,
    source: Distribution,
    target: Distribution,
    problem: Callable[[int, float], tuple[Any, ...]],
) -> Array:
    """Call curve_fit with the arguments for each row and its start, the equal half angle."""
    from scipy.optimize import OptimizeWarning, curve_fit

    starts = target.from_half_tangent(source.half_tangent(parameter))
    results = np.full(parameter.size, np.nan)
    with np.errstate(all="ignore"), warnings.catch_warnings():
        # A perfect fit has no covariance to speak of.
        warnings.simplefilter("ignore", OptimizeWarning)
        for row in np.flatnonzero(~np.isnan(starts)).tolist():
            try:
                fitted, _ = curve_fit(*problem(row, starts[row]))
            except RuntimeError:
                continue
            results[row] = fitted[0]
    return results
