"""The squared distance between two distributions as a function of the target's parameter."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, TypeAlias

import numpy as np

from mdfconv.distributions import Distribution
from mdfconv.distributions.angles import Angles
from mdfconv.distributions.evaluation import Array, Indices, Mask
from mdfconv.fitting.metrics import Metric
from mdfconv.fitting.quadrature import Breaks, Quadrature, SmoothQuadrature

# tan β over tan β_half where D̄ is looked at first: closest where lobes fall.
_FIRST_LOOK = np.exp(1.5 * np.sinh(np.linspace(-2.4, 3.2, 29)))
# Then at even steps between two of these, in logarithms; so many steps of the Illinois rule then
# leave 1e-9 of the angle.
_STEPS, _SECANTS = np.linspace(0, 1, 17), 5


def level_crossings(mdf: Distribution, parameter: Array, levels: Array, tangent: Array) -> Array:
    """Return the angles at which D̄ passes levels, shape (n, any); 0 for none.

    `levels` has the shape (n, any), `tangent`, tan β_half or about that, and the parameter (n, 1).
    """
    places = tangent * _FIRST_LOOK
    edge = mdf.edge(parameter)
    if edge is not None:
        # There D̄ bends, and beyond it has no slope.
        places = np.minimum(places, np.tan(edge))
    top = np.tan(mdf.mode(parameter))
    if off_axis := bool(np.any(top > 0)):
        places = np.sort(np.concatenate([places, np.maximum(top, places[:, :1])], axis=1), axis=1)
    above = mdf.shape(Angles(tangent=places), parameter)[:, None, :] >= levels[:, :, None]
    exists = (levels < 1) & above.any(axis=2)
    end = places.shape[1] - 1
    high = end - np.argmax(above[:, :, ::-1], axis=2)
    low = np.minimum(high + 1, end)
    if off_axis:
        first = np.argmax(above, axis=2)
        high, low = np.hstack([high, first]), np.hstack([low, np.maximum(first - 1, 0)])
        exists, levels = np.hstack([exists, exists]), np.hstack([levels, levels])
    ends = [np.log(np.take_along_axis(places, index, axis=1)) for index in (high, low)]
    crossing = np.arctan(np.exp(_crossing(mdf, parameter, levels, *ends)))
    return np.where(exists & (high != low), crossing, 0)


def _crossing(mdf: Distribution, parameter: Array, levels: Array, high: Array, low: Array) -> Array:
    """Return the ln tan β at which D̄ passes levels between two, above at the first."""
    places = high[:, :, None] + (low - high)[:, :, None] * _STEPS
    tangent = np.exp(places.reshape(len(levels), -1))
    value = mdf.shape(Angles(tangent=tangent), parameter).reshape(places.shape)
    value -= levels[:, :, None]
    # The first is above, whatever rounding says, and the last below.
    index = (value[:, :, 1:-1] >= 0).sum(axis=2, keepdims=True)
    high, low, at_high, at_low = (
        np.take_along_axis(array, index + step, axis=2)[:, :, 0]
        for array in (places, value)
        for step in (0, 1)
    )
    before = np.full(high.shape, np.nan)
    for _ in range(_SECANTS):
        # Where the place is an end, rounding may leave none between.
        share = at_high / (at_high - at_low)
        middle = high + (low - high) * np.where(share > 0, np.minimum(share, 1), 0)
        value = mdf.shape(Angles(tangent=np.exp(middle)), parameter)
        value -= levels
        above = value >= 0
        # What stays again pulls half as hard, so that both come near (Dowell & Jarratt 1971).
        pull = np.where(above == before, 0.5, 1)
        at_high = np.where(above, value, pull * at_high)
        at_low = np.where(above, pull * at_low, value)
        high, low, before = np.where(above, middle, high), np.where(above, low, middle), above
    return middle


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

    @property
    def target_has_edge(self) -> bool:
        """Whether the target is 0 beyond an angle, which moves with its parameter."""
        return self.target.edge(np.ones(1)) is not None

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


# Angles, their weights, and the signal of the source.
Sampled: TypeAlias = tuple[Angles, Array, Array]


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
        self._source_breaks = self._breaks(source, self._source_parameter, self._peak, self.tangent)
        # Unless the panels move with the target, all distances share their samples.
        self._samples: Sampled | None = None
        self.target_has_edge = task.target_has_edge
        if not self.metric.kinks and not self.target_has_edge:
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
        samples = self._samples_for(np.exp(log_parameter)[:, None], index)
        weight, residual, slope = self._with_slope(log_parameter, index, samples)
        weighted = weight * residual
        return np.einsum("ij,ij->i", weighted, residual), np.einsum("ij,ij->i", weighted, slope)

    def samples(self, log_parameter: Array) -> Sampled:
        """Return where the distances are sampled for parameters of the target."""
        return self._samples_for(np.exp(log_parameter)[:, None], self._all)

    def step(self, log_parameter: Array, samples: Sampled) -> tuple[Array, Array]:
        """Return the Gauss-Newton step in ln p from near a minimum, and the distance there.

        The samples are those for about the same parameters.
        """
        weight, residual, slope = self._with_slope(log_parameter, self._all, samples)
        weighted = weight * slope
        curvature = np.einsum("ij,ij->i", weighted, slope)
        step = -np.einsum("ij,ij->i", weighted, residual) / curvature
        # The distance at the end of the step, to second order.
        weighted = np.multiply(weight, residual, out=weighted)
        distance = np.einsum("ij,ij->i", weighted, residual)
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

    def _with_slope(
        self, log_parameter: Array, index: Indices, samples: Sampled
    ) -> tuple[Array, Array, Array]:
        """Return the weights, ΔS and ∂S/∂ ln p of some problems at their samples."""
        angles, weight, signal = samples
        arguments = self.target, angles, np.exp(log_parameter)[:, None], self._peak[index]
        value, slope = self.metric.signal_and_slope(*arguments)
        value -= signal
        return weight, value, slope

    def _samples_for(self, parameter: Array, index: Indices) -> Sampled:
        """Return angles, weights and the source's signal for parameters of the target."""
        if self._samples is not None:
            if index.size == self.size:
                return self._samples
            angles, weight, signal = self._samples
            return angles[index], weight[index], signal[index]
        breaks = self._breaks(self.target, parameter, self._peak[index], self.tangent[index])
        return self._sampled(index, self._source_breaks.rows(index).joined(breaks))

    def _sampled(self, index: Indices, breaks: Breaks) -> Sampled:
        """Return angles, weights and the source's signal."""
        angles, weight = self._quadrature.nodes(self._rows[index], breaks)
        parameter = self._source_parameter[index]
        signal = self.metric.signal(self._source, angles, parameter, self._peak[index])
        return angles, weight * self.metric.weight(angles), signal

    def _breaks(
        self, distribution: Distribution, parameter: Array, peak: Array, tangent: Array
    ) -> Breaks:
        """Return where the signal of a lobe has kinks, and where it becomes 0."""
        edge = distribution.edge(parameter)
        if not self.metric.kinks:
            return Breaks(edges=edge)
        maximum = distribution.maximum(parameter, normalized=self.metric.normalized)
        levels = np.array(self.metric.kinks) * (peak / maximum)
        with np.errstate(all="ignore"):
            kinks = level_crossings(distribution, parameter, levels, tangent[:, None])
        return Breaks(kinks, edge)


def narrowest(source: Distribution, parameter: Array, target: Distribution, result: Array) -> Array:
    """Return β_half of the narrower lobe of each pair, radians, shape (n,)."""
    tangents = bounded_tangent(source, parameter), bounded_tangent(target, result)
    return np.arctan(np.minimum(*tangents))


def bounded_tangent(distribution: Distribution, parameter: Array) -> Array:
    """Return tan β_half, shape (n,), at most that of a lobe as wide as the hemisphere."""
    tangent = distribution.half_tangent(parameter)
    return np.where(tangent < _WIDEST_TANGENT, tangent, _WIDEST_TANGENT)
