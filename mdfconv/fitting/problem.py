"""The squared distance between two distributions as a function of the target's parameter."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from mdfconv.distributions import Distribution
from mdfconv.distributions.evaluation import Array, Indices
from mdfconv.fitting.metrics import Metric
from mdfconv.fitting.quadrature import Quadrature, SmoothQuadrature

# Lobes down to 1e-19 are resolved. From there to π/2 there are 67 octaves: so many halvings of the
# logarithm leave 1e-5, on which D̄ is a straight line even beside an edge, and so many steps of the
# Illinois rule then 1e-14.
_LEAST, _BISECTIONS, _SECANTS = 1e-20, 22, 4


def level_crossing(
    distribution: Distribution, parameter: Array, level: Array, high: Array, low: Array
) -> Array:
    """Return the angle at which D̄ crosses a level.

    Parameters
    ----------
    distribution : Distribution
        The distribution.
    parameter, level : numpy.ndarray, shape (n, 1)
        Its parameters, and levels of D̄.
    high, low : numpy.ndarray, shape (n, 1)
        Angles, radians, between which D̄ falls from above the level to below it.

    Returns
    -------
    numpy.ndarray, shape (n, 1)
        The angle; 0 where D̄ does not cross the level between the two.
    """
    crosses = (level < 1) & (distribution.shape(low, parameter) < level)
    high, low = np.maximum(high, _LEAST), np.maximum(low, _LEAST)
    for _ in range(_BISECTIONS):
        middle = np.sqrt(low * high)
        above = distribution.shape(middle, parameter) >= level
        high, low = np.where(above, middle, high), np.where(above, low, middle)
    at_high, at_low = (distribution.shape(end, parameter) - level for end in (high, low))
    for _ in range(_SECANTS):
        with np.errstate(divide="ignore", invalid="ignore"):
            middle = high + (low - high) * at_high / (at_high - at_low)
        # Where D̄ is the level all along, any angle is.
        middle = np.where(np.isfinite(middle), middle, high)
        value = distribution.shape(middle, parameter) - level
        above = value >= 0
        # The end that stays pulls half as hard, so that both come near (Dowell & Jarratt 1971).
        at_high, at_low = (
            np.where(above, value, 0.5 * at_high),
            np.where(above, 0.5 * at_low, value),
        )
        high, low = np.where(above, middle, high), np.where(above, low, middle)
    return np.where(crosses, middle, 0)


# Angles of kinks, and of the edge.
_Breaks: TypeAlias = tuple[Array | None, Array | None]

# Beyond this tan β_half (87°), or without a β_half, a lobe is as wide as the hemisphere.
_WIDEST_TANGENT = 20.0


class FitProblem:
    """A batch of fits: the distance of each, and its slope in ln p.

    Parameters
    ----------
    source : Distribution
        The distribution that is replaced.
    parameter : numpy.ndarray, shape (n,)
        Its legal parameters.
    target : Distribution
        What takes its place, with parameters p.
    metric : Metric
        What the distance measures.
    quadrature : Quadrature, optional
        Where it is sampled; by default as the metric says, over the whole hemisphere.
    rows : numpy.ndarray of int, shape (m,)
        Which of the n problems make the batch.

    Attributes
    ----------
    tangent : numpy.ndarray, shape (m,)
        tan β_half of the source, at most that of a lobe as wide as the hemisphere.
    """

    def __init__(
        self,
        source: Distribution,
        parameter: Array,
        target: Distribution,
        metric: Metric,
        quadrature: Quadrature | None,
        rows: Indices,
    ) -> None:
        self.target, self.metric = target, metric
        self._source = source
        self._source_parameter = parameter[rows][:, None]
        self.tangent = bounded_tangent(source, parameter[rows])
        self._peak = source.maximum(self._source_parameter, normalized=metric.normalized)
        if quadrature is None:
            self._quadrature: Quadrature = metric.quadrature(np.arctan(self.tangent))
            self._rows: Indices = np.arange(rows.size)
        else:
            self._quadrature, self._rows = quadrature, rows
        self._source_breaks = self._breaks(source, self._source_parameter, self._peak)
        # Unless the panels move with the target, all distances share their samples.
        self._samples: tuple[Array, Array, Array] | None = None
        if not metric.kinks and target.edge(np.ones(1)) is None:
            self._samples = self._sampled(np.arange(rows.size), *self._source_breaks)

    @property
    def size(self) -> int:
        """The number of problems in the batch."""
        return self._rows.size

    def coarse_distance(self, candidates: Array) -> Array:
        """Return the approximate distance for each candidate p, shape (m, c)."""
        beta, weight = self._quadrature.coarse(self._rows, fine=bool(self.metric.kinks))
        weight = weight * self.metric.weight(beta)
        signal = self.metric.signal(self._source, beta, self._source_parameter, self._peak)
        shape = (*candidates.shape, beta.shape[1])
        residual = self.metric.signal(
            self.target,
            np.broadcast_to(beta[:, None, :], shape),
            candidates[:, :, None],
            self._peak[:, :, None],
        )
        residual -= signal[:, None, :]
        return np.einsum("ik,ijk,ijk->ij", weight, residual, residual)

    def distance(self, log_parameter: Array, index: Indices) -> tuple[Array, Array]:
        """Return the distance and half its slope in ln p, for some problems of the batch."""
        parameter = np.exp(log_parameter)[:, None]
        beta, weight, signal = self._samples_for(parameter, index)
        value, slope = self.metric.signal_and_slope(self.target, beta, parameter, self._peak[index])
        value -= signal
        weighted = weight * value
        return np.einsum("ij,ij->i", weighted, value), np.einsum("ij,ij->i", weighted, slope)

    def step(self, log_parameter: Array) -> tuple[Array, Array]:
        """Return the Gauss-Newton step in ln p from near a minimum, and the distance there.

        Parameters
        ----------
        log_parameter : numpy.ndarray, shape (m,)
            Those of the target.
        """
        parameter = np.exp(log_parameter)[:, None]
        beta, weight, signal = self._samples_for(parameter, np.arange(self.size))
        value, slope = self.metric.signal_and_slope(self.target, beta, parameter, self._peak)
        value -= signal
        weighted = weight * slope
        curvature = np.einsum("ij,ij->i", weighted, slope)
        step = -np.einsum("ij,ij->i", weighted, value) / curvature
        # The distance at the end of the step, to second order.
        distance = np.einsum("ij,ij,ij->i", weight, value, value) - np.square(step) * curvature
        return step, distance

    def residual(self, parameter: Array) -> Callable[[Distribution, Array], Array]:
        """Return √w ΔS, shape (m, k), as a function of a target and its parameters.

        Parameters
        ----------
        parameter : numpy.ndarray, shape (m,)
            Those of the target for which the samples are placed; there they stay.
        """
        beta, weight, signal = self._samples_for(parameter[:, None], np.arange(self.size))
        root = np.sqrt(weight)

        def residual(target: Distribution, parameter: Array) -> Array:
            value = self.metric.signal(target, beta, parameter[:, None], self._peak)
            difference: Array = root * (value - signal)
            return difference

        return residual

    def relative_error(self, parameter: Array) -> tuple[Array, Array]:
        """Return √(distance / distance of the source from 0), and max |ΔS| / max |S|.

        Parameters
        ----------
        parameter : numpy.ndarray, shape (m,)
            Those of the target.

        Returns
        -------
        root_mean_square, maximum : numpy.ndarray, shape (m,)
            Infinite where the source has no signal, as a uniform lobe has no contrast.
        """
        index = np.arange(self.size)
        beta, weight, signal = self._samples_for(parameter[:, None], index)
        difference = self.metric.signal(self.target, beta, parameter[:, None], self._peak)
        difference -= signal
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.sqrt(
                np.einsum("ij,ij,ij->i", weight, difference, difference)
                / np.einsum("ij,ij,ij->i", weight, signal, signal)
            )
            largest = np.max(np.abs(difference), axis=1) / np.max(np.abs(signal), axis=1)
        return share, largest

    def _samples_for(self, parameter: Array, index: Indices) -> tuple[Array, Array, Array]:
        """Return angles, weights and the source's signal for parameters of the target."""
        if self._samples is not None:
            if index.size == self.size:
                return self._samples
            beta, weight, signal = (array[index] for array in self._samples)
            return beta, weight, signal
        theirs = (part if part is None else part[index] for part in self._source_breaks)
        ours = self._breaks(self.target, parameter, self._peak[index])
        return self._sampled(index, *map(_joined, theirs, ours))

    def _sampled(
        self, index: Indices, kinks: Array | None, edges: Array | None
    ) -> tuple[Array, Array, Array]:
        """Return angles, weights and the source's signal."""
        beta, weight = self._quadrature.nodes(self._rows[index], kinks, edges)
        parameter = self._source_parameter[index]
        signal = self.metric.signal(self._source, beta, parameter, self._peak[index])
        return beta, weight * self.metric.weight(beta), signal

    def _breaks(self, distribution: Distribution, parameter: Array, peak: Array) -> _Breaks:
        """Return the angles of kinks and of the edge, shapes (n, any); None for neither."""
        kinks = []
        maximum = distribution.maximum(parameter, normalized=self.metric.normalized)
        mode = distribution.mode(parameter)
        for kink in self.metric.kinks:
            level = kink * peak / maximum
            ends = [(mode, np.full_like(mode, 0.5 * np.pi))]
            if np.any(mode > 0):
                ends.append((mode, np.zeros_like(mode)))
            kinks += [level_crossing(distribution, parameter, level, *end) for end in ends]
        return np.concatenate(kinks, axis=1) if kinks else None, distribution.edge(parameter)


def _joined(one: Array | None, other: Array | None) -> Array | None:
    parts = [part for part in (one, other) if part is not None]
    return np.concatenate(parts, axis=1) if parts else None


def near_problem(
    source: Distribution,
    parameter: Array,
    target: Distribution,
    near: Array,
    metric: Metric,
    quadrature: Quadrature | None = None,
) -> FitProblem:
    """Return a batch of n fits whose answers are known to be near: a few angles are enough.

    Parameters
    ----------
    near : numpy.ndarray, shape (n,)
        Parameters of the target near the answers.
    source, parameter, target, metric, quadrature
        As for `Problem`.
    """
    if quadrature is None and metric.over_angles:
        quadrature = SmoothQuadrature(narrowest(source, parameter, target, near))
    return FitProblem(source, parameter, target, metric, quadrature, np.arange(parameter.size))


def narrowest(source: Distribution, parameter: Array, target: Distribution, result: Array) -> Array:
    """Return β_half of the narrower lobe of each pair, radians, shape (n,)."""
    tangents = bounded_tangent(source, parameter), bounded_tangent(target, result)
    return np.arctan(np.minimum(*tangents))


def bounded_tangent(distribution: Distribution, parameter: Array) -> Array:
    """Return tan β_half, shape (n,), at most that of a lobe as wide as the hemisphere."""
    tangent = distribution.half_tangent(parameter)
    return np.where(tangent < _WIDEST_TANGENT, tangent, _WIDEST_TANGENT)
