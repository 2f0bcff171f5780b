"""The squared distance between two distributions as a function of the target's parameter."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from mdfconv.distributions import Distribution
from mdfconv.distributions.angles import Angles
from mdfconv.distributions.evaluation import Array, Indices, Mask
from mdfconv.fitting.metrics import Metric
from mdfconv.fitting.quadrature import Breaks, Quadrature, SmoothQuadrature

# Lobes down to 1e-19 are resolved. From there to π/2 there are 67 octaves: so many halvings of the
# logarithm leave 1e-5, on which D̄ is a straight line even beside an edge, and so many steps of the
# Illinois rule then 1e-14.
_LEAST, _BISECTIONS, _SECANTS = 1e-20, 22, 4


def level_crossing(
    mdf: Distribution, parameter: Array, level: Array, high: Array, low: Array
) -> Array:
    """Return the angle between `high` and `low` at which D̄ falls through a level; 0 for none.

    All have the shape (n, 1); at the angle `high` D̄ is above the level, at `low` below it.
    """
    crosses = (level < 1) & (mdf.shape(Angles(low), parameter) < level)
    high, low = np.maximum(high, _LEAST), np.maximum(low, _LEAST)
    for _ in range(_BISECTIONS):
        middle = np.sqrt(low * high)
        above = mdf.shape(Angles(middle), parameter) >= level
        high, low = np.where(above, middle, high), np.where(above, low, middle)
    at_high, at_low = (mdf.shape(Angles(angle), parameter) - level for angle in (high, low))
    for _ in range(_SECANTS):
        with np.errstate(divide="ignore", invalid="ignore"):
            middle = high + (low - high) * at_high / (at_high - at_low)
        # Where D̄ is the level all along, any angle is.
        middle = np.where(np.isfinite(middle), middle, high)
        value = mdf.shape(Angles(middle), parameter) - level
        above = value >= 0
        # The end that stays pulls half as hard, so that both come near (Dowell & Jarratt 1971).
        at_high = np.where(above, value, 0.5 * at_high)
        at_low = np.where(above, 0.5 * at_low, value)
        high, low = np.where(above, middle, high), np.where(above, low, middle)
    return np.where(crosses, middle, 0)


# Beyond this tan β_half (87°), or without a β_half, a lobe is as wide as the hemisphere.
_WIDEST_TANGENT = 20.0


class ConversionTask(NamedTuple):
    """What is converted: n lobes of a source, to those of a target.

    The metric says where the distance of a fit is sampled, unless there is a quadrature.
    """

    source: Distribution
    parameter: Array
    target: Distribution
    metric: Metric
    quadrature: Quadrature | None = None

    def part(self, rows: Indices | Mask) -> ConversionTask:
        """Return the task for some of the lobes; not for one with a quadrature of its own."""
        return self._replace(parameter=self.parameter[rows])

    def problem(self, rows: Indices) -> FitProblem:
        """Return some of the lobes as a batch."""
        return FitProblem(self, rows)

    def problem_near(self, near: Array) -> FitProblem:
        """Return all lobes as a batch whose minima are known to be near: a few angles do."""
        quadrature = self.quadrature
        if quadrature is None and self.metric.over_angles:
            width = narrowest(self.source, self.parameter, self.target, near)
            quadrature = SmoothQuadrature(width, root=self.metric.root)
        return self._replace(quadrature=quadrature).problem(np.arange(self.parameter.size))


class FitProblem:
    """A batch of m fits: the distance of each, and its slope in ln p, p the target's parameter.

    The rows of a task make the batch.
    """

    def __init__(self, task: ConversionTask, rows: Indices) -> None:
        source, parameter, self.target, self.metric, quadrature = task
        self._source = source
        self._source_parameter = parameter[rows][:, None]
        # tan β_half of the source, at most that of a lobe as wide as the hemisphere.
        self.tangent = bounded_tangent(source, parameter[rows])
        self._peak = source.maximum(self._source_parameter, normalized=self.metric.normalized)
        if quadrature is None:
            quadrature = self.metric.quadrature(np.arctan(self.tangent))
            rows = np.arange(rows.size)
        self._quadrature, self._rows = quadrature, rows
        self._source_breaks = self._breaks(source, self._source_parameter, self._peak)
        # Unless the panels move with the target, all distances share their samples.
        self._samples: tuple[Angles, Array, Array] | None = None
        if not self.metric.kinks and self.target.edge(np.ones(1)) is None:
            self._samples = self._sampled(self._all, self._source_breaks)

    @property
    def size(self) -> int:
        """The number of problems in the batch."""
        return self._rows.size

    @property
    def _all(self) -> Indices:
        return np.arange(self.size)

    def coarse_distance(self, candidates: Array) -> Array:
        """Return the approximate distance for each candidate p, shape (m, c)."""
        angles, weight = self._quadrature.coarse(self._rows, fine=bool(self.metric.kinks))
        weight = weight * self.metric.weight(angles)
        signal = self.metric.signal(self._source, angles, self._source_parameter, self._peak)
        rest = candidates[:, :, None], self._peak[:, :, None]
        residual = self.metric.signal(self.target, angles[:, None, :], *rest)
        residual -= signal[:, None, :]
        return np.einsum("ik,ijk,ijk->ij", weight, residual, residual)

    def distance(self, log_parameter: Array, index: Indices) -> tuple[Array, Array]:
        """Return the distance and half its slope in ln p, for some problems of the batch."""
        weight, residual, slope = self._with_slope(log_parameter, index)
        weighted = weight * residual
        return np.einsum("ij,ij->i", weighted, residual), np.einsum("ij,ij->i", weighted, slope)

    def step(self, log_parameter: Array) -> tuple[Array, Array]:
        """Return the Gauss-Newton step in ln p from near a minimum, and the distance there."""
        weight, residual, slope = self._with_slope(log_parameter, self._all)
        weighted = weight * slope
        curvature = np.einsum("ij,ij->i", weighted, slope)
        step = -np.einsum("ij,ij->i", weighted, residual) / curvature
        # The distance at the end of the step, to second order.
        distance = np.einsum("ij,ij,ij->i", weight, residual, residual)
        return step, distance - np.square(step) * curvature

    def residual(self, parameter: Array) -> Callable[[Distribution, Array], Array]:
        """Return √w ΔS, shape (m, k), as a function of a target and its parameters.

        The samples are those for the target with `parameter`, shape (m,).
        """
        angles, weight, signal = self._samples_for(parameter[:, None], self._all)
        root = np.sqrt(weight)

        def residual(target: Distribution, parameter: Array) -> Array:
            value = self.metric.signal(target, angles, parameter[:, None], self._peak)
            return root * (value - signal)

        return residual

    def relative_error(self, parameter: Array) -> tuple[Array, Array]:
        """Return √(distance / distance of the source from 0), and max |ΔS| / max |S|.

        Infinite where the source has no signal, as a uniform lobe has no contrast.
        """
        angles, weight, signal = self._samples_for(parameter[:, None], self._all)
        difference = self.metric.signal(self.target, angles, parameter[:, None], self._peak)
        difference -= signal
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.sqrt(
                np.einsum("ij,ij,ij->i", weight, difference, difference)
                / np.einsum("ij,ij,ij->i", weight, signal, signal)
            )
            largest = np.max(np.abs(difference), axis=1) / np.max(np.abs(signal), axis=1)
        return share, largest

    def _with_slope(self, log_parameter: Array, index: Indices) -> tuple[Array, Array, Array]:
        """Return the weights, ΔS and ∂S/∂ ln p of some problems at their samples."""
        parameter = np.exp(log_parameter)[:, None]
        angles, weight, signal = self._samples_for(parameter, index)
        arguments = self.target, angles, parameter, self._peak[index]
        value, slope = self.metric.signal_and_slope(*arguments)
        value -= signal
        return weight, value, slope

    def _samples_for(self, parameter: Array, index: Indices) -> tuple[Angles, Array, Array]:
        """Return angles, weights and the source's signal for parameters of the target."""
        if self._samples is not None:
            if index.size == self.size:
                return self._samples
            angles, weight, signal = self._samples
            return angles[index], weight[index], signal[index]
        breaks = self._breaks(self.target, parameter, self._peak[index])
        return self._sampled(index, self._source_breaks.rows(index).joined(breaks))

    def _sampled(self, index: Indices, breaks: Breaks) -> tuple[Angles, Array, Array]:
        """Return angles, weights and the source's signal."""
        angles, weight = self._quadrature.nodes(self._rows[index], breaks)
        parameter = self._source_parameter[index]
        signal = self.metric.signal(self._source, angles, parameter, self._peak[index])
        return angles, weight * self.metric.weight(angles), signal

    def _breaks(self, distribution: Distribution, parameter: Array, peak: Array) -> Breaks:
        """Return where the signal of a lobe has kinks, and where it becomes 0."""
        edge = distribution.edge(parameter)
        if not self.metric.kinks:
            return Breaks(edges=edge)
        kinks = []
        maximum = distribution.maximum(parameter, normalized=self.metric.normalized)
        mode = distribution.mode(parameter)
        sides = [np.full_like(mode, 0.5 * np.pi)]
        if np.any(mode > 0):
            sides.append(np.zeros_like(mode))
        for kink in self.metric.kinks:
            level = kink * peak / maximum
            kinks += [level_crossing(distribution, parameter, level, mode, low) for low in sides]
        return Breaks(np.concatenate(kinks, axis=1), edge)


def narrowest(source: Distribution, parameter: Array, target: Distribution, result: Array) -> Array:
    """Return β_half of the narrower lobe of each pair, radians, shape (n,)."""
    tangents = bounded_tangent(source, parameter), bounded_tangent(target, result)
    return np.arctan(np.minimum(*tangents))


def bounded_tangent(distribution: Distribution, parameter: Array) -> Array:
    """Return tan β_half, shape (n,), at most that of a lobe as wide as the hemisphere."""
    tangent = distribution.half_tangent(parameter)
    return np.where(tangent < _WIDEST_TANGENT, tangent, _WIDEST_TANGENT)
