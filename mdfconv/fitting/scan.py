"""The first part of a fit: which parameters come near the best one."""

from __future__ import annotations

import numpy as np

from mdfconv.distributions.evaluation import Array, Indices
from mdfconv.fitting.problem import Problem

# Targets whose tan β_half is this multiple of the source's: the best fits known lie between 0.3
# and 3; far beyond, the distance only falls towards an end of the legal range.
_LEAST_MULTIPLE, _MOST_MULTIPLE = 0.01, 100.0
# Steps of 21 %, and of 6 % where clipping at white makes minima narrow.
_MULTIPLES, _MULTIPLES_WITH_KINKS = 50, 150
# Where the lobe itself is clipped, the lowest minima are looked at again, as far as two steps
# away in thirds of a step.
_NEIGHBOURS, _POINTS_BETWEEN = 2, 11
# Beyond the widest target that has a half width: factors of its parameter, or for a closed range
# shares of what is left to its end.
_WIDER = np.geomspace(1.02, 1e5, 26)
_CLOSER = np.linspace(0.95, 0, _WIDER.size)
# Where a tangent has no legal parameter, neighbours are this factor apart.
_BEYOND = 1.3
# A tangent above it is that of an angle which no float tells from π/2.
_LARGEST_TANGENT = 1e8
# Distances have seldom two minima, and the scan is approximate.
_MOST_MINIMA, _NEARLY_AS_LOW = 3, 2.0


def scan(problem: Problem) -> tuple[Array, Array]:
    """Return target parameters over the whole legal range, and their approximate distances.

    Parameters
    ----------
    problem : Problem
        A batch of n fits.

    Returns
    -------
    candidates, distance : numpy.ndarray, shape (n, c)
        The parameters rise along a row.
    """
    every = candidates(problem)
    distance = problem.coarse_distance(every)
    if max(problem.metric.kinks, default=1.0) >= 1:
        return every, distance
    closer = _closer(every, lowest_minima(distance))
    every = np.concatenate([every, closer], axis=1)
    distance = np.concatenate([distance, problem.coarse_distance(closer)], axis=1)
    order = np.argsort(every, axis=1, kind="stable")
    return np.take_along_axis(every, order, 1), np.take_along_axis(distance, order, 1)


def lowest_minima(distance: Array) -> Indices:
    """Return the columns of the lowest minima of each row, shape (n, 3); −1 for none.

    The scan is approximate, so a minimum that is nearly as low as the lowest counts as well. Of
    a plateau, which clipping at white makes, both ends count: the minimum may lie beside either.
    """
    padded = np.pad(distance, ((0, 0), (1, 1)), constant_values=np.inf)
    left, right = padded[:, :-2], padded[:, 2:]
    local = (distance <= left) & (distance <= right) & ((distance < left) | (distance < right))
    ranked = np.where(local, distance, np.inf)
    columns = np.argsort(ranked, axis=1, kind="stable")[:, :_MOST_MINIMA]
    values = np.take_along_axis(ranked, columns, axis=1)
    return np.where(values <= _NEARLY_AS_LOW * values[:, :1], columns, -1)


def _closer(candidates: Array, columns: Indices) -> Array:
    """Return more candidates around the lowest minima, shape (n, any)."""
    last = candidates.shape[1] - 1
    log_candidates = np.log(candidates)
    ends = [
        np.take_along_axis(log_candidates, np.clip(columns + side, 0, last), axis=1)[:, :, None]
        for side in (-_NEIGHBOURS, _NEIGHBOURS)
    ]
    share = np.linspace(0, 1, _POINTS_BETWEEN + 2)[1:-1]
    return np.exp(ends[0] + (ends[1] - ends[0]) * share).reshape(len(candidates), -1)


def candidates(problem: Problem) -> Array:
    """Return target parameters over the whole legal range, ascending, shape (n, c)."""
    target = problem.target
    count = _MULTIPLES_WITH_KINKS if problem.metric.kinks else _MULTIPLES
    multiples = np.geomspace(_LEAST_MULTIPLE, _MOST_MULTIPLE, count)
    tangents = problem.tangent[:, None] * np.append(multiples, 1e6)
    scaled = target.from_half_tangent(np.minimum(tangents, _LARGEST_TANGENT))
    # Exponents fall as lobes widen.
    falls = target.parameter.larger_is_smoother
    widest = (np.fmin if falls else np.fmax).reduce(scaled, axis=1, keepdims=True)
    wider = widest / _WIDER if falls else widest * _WIDER
    if target.parameter.upper_closed:
        upper = target.parameter.upper
        wider = upper - (upper - widest) * _CLOSER
    missing = np.isnan(scaled)
    beyond = widest * _BEYOND ** (np.cumsum(missing, axis=1) * (-1 if falls else 1))
    return np.sort(np.concatenate([np.where(missing, beyond, scaled), wider], axis=1), axis=1)
