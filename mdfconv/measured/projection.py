"""Models that are linear in some of their unknowns: the best coefficients for any lobe.

The model of channel c is fixed + Σ_j a_cj basis_j, a ≥ 0. The coefficients are solved for, so that
only the lobe's own parameters are searched (variable projection: Golub & Pereyra 1973). Under a
loss that transforms the values, the same linear step is iterated. Channels come before samples:
sums run along contiguous memory.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from copy import copy
from dataclasses import dataclass
from itertools import combinations
from typing import NamedTuple

import numpy as np

from mdfconv.distributions.evaluation import Array

# Samples at a time: three arrays of three channels are 1 MB.
_BLOCK = 16384
# Linear steps: at the right parameter six are exact under 50 % of noise.
_STEPS = 12
# A step of this size, relatively, leaves far less than its size.
_TOLERANCE = 1e-6
# Of the smallest value: a model is kept positive, far from where a fit ends.
_SMALLEST_MODEL = 1e-3


@dataclass(frozen=True)
class Transform:
    """What a loss compares instead of values: `value` of them, and its `slope` by both."""

    value: Callable[[Array], Array]
    slope: Callable[[Array, Array], Array]


LOGARITHM = Transform(np.log, lambda value, _: 1 / value)
CUBE_ROOT = Transform(np.cbrt, lambda value, root: root / (3 * value))


class Terms(NamedTuple):
    """A model up to its coefficients: the basis, shape (..., k, n), and what is fixed, (..., n)."""

    basis: Array
    fixed: Array

    def at(self, coefficients: Array) -> Array:
        """Return the model, shape (..., channels, n), of coefficients (..., channels, k)."""
        value = coefficients[..., 0, None] * self.basis[..., None, 0, :]
        value += self.fixed[..., None, :]
        for place in range(1, self.basis.shape[-2]):
            value += coefficients[..., place, None] * self.basis[..., None, place, :]
        return value

    def blocks(self) -> Iterator[tuple[slice, Terms]]:
        """Yield the terms of blocks of samples that stay in the processor's cache."""
        for start in range(0, self.fixed.shape[-1], _BLOCK):
            block = slice(start, start + _BLOCK)
            yield block, Terms(self.basis[..., block], self.fixed[..., block])


class Projected(NamedTuple):
    """What terms leave: coefficients, residuals and ∂residual/∂model, (..., channels, n)."""

    coefficients: Array
    residual: Array
    gain: Array


class Projection:
    """The best coefficients of each channel, for any terms.

    Values have shape (channels, n), weights (n,) or (channels, n); the residual is √weight times
    the difference of values, or of what `transform` makes of them, which takes positive values.
    """

    def __init__(self, values: Array, weight: Array, transform: Transform | None) -> None:
        self._values, self._weight, self._transform = values, weight, transform
        self._root = np.sqrt(weight)
        if transform:
            self._wanted = transform.value(values)
            self._smallest = _SMALLEST_MODEL * values.min(axis=-1, keepdims=True)

    def weighted(self, weight: Array) -> Projection:
        """Return the projection with other weights."""
        other = copy(self)
        other._weight, other._root = weight, np.sqrt(weight)
        return other

    def __call__(
        self, terms: Terms, start: Array | None = None, *, steps: int = _STEPS
    ) -> Projected:
        """Project terms; `start` are coefficients near the best ones, `steps` the most to take.

        Without steps the coefficients are those of the start.
        """
        values, transform = self._values, self._transform
        if transform is None:
            coefficients = start if start is not None and not steps else None
            if coefficients is None:
                coefficients = nonnegative(terms, values, self._weight)
            residual = terms.at(coefficients)
            residual -= values
            residual *= self._root
            return Projected(coefficients, residual, np.broadcast_to(self._root, values.shape))
        if start is None:
            weight = self._weight * np.square(transform.slope(values, self._wanted))
            start = nonnegative(terms, values, weight)
        coefficients = start
        for _ in range(steps):
            before, coefficients = coefficients, self._improved(terms, coefficients, transform)
            change = np.abs(coefficients - before)
            if not (change > _TOLERANCE * np.abs(coefficients)).any():
                break
        shape = (*coefficients.shape[:-1], terms.fixed.shape[-1])
        residual, gain = np.empty(shape), np.empty(shape)
        for block, part in terms.blocks():
            _, shown, slope = self._transformed(part, coefficients, transform)
            shown -= self._wanted[..., block]
            np.multiply(shown, self._root[..., block], out=residual[..., block])
            np.multiply(slope, self._root[..., block], out=gain[..., block])
        return Projected(coefficients, residual, gain)

    def _improved(self, terms: Terms, coefficients: Array, transform: Transform) -> Array:
        """Return better coefficients by a Gauss-Newton step, which is a weighted linear fit."""
        sums = []
        for block, part in terms.blocks():
            near, shown, gain = self._transformed(part, coefficients, transform)
            working = self._wanted[..., block] - shown
            working /= gain
            working += near
            gain *= gain
            gain *= self._weight[..., block]
            sums.append(_normal_equations(part, working, gain))
        return _nonnegative_solution(sums)

    def _transformed(
        self, terms: Terms, coefficients: Array, transform: Transform
    ) -> tuple[Array, Array, Array]:
        """Return a model, what the loss compares instead, and the slope of that."""
        near = terms.at(coefficients)
        np.maximum(near, self._smallest, out=near)
        shown = transform.value(near)
        return near, shown, transform.slope(near, shown)


def nonnegative(terms: Terms, values: Array, weight: Array) -> Array:
    """Return the weighted least-squares coefficients ≥ 0 of each channel, shape (..., channels, k).

    Of all choices of coefficients that are not zero the best legal one (at most three: eight).
    """
    return _nonnegative_solution(
        [
            _normal_equations(part, values[..., block], weight[..., block])
            for block, part in terms.blocks()
        ]
    )


def _normal_equations(terms: Terms, values: Array, weight: Array) -> tuple[Array, Array]:
    """Return the matrix and the right side of a weighted linear fit of each channel."""
    basis = terms.basis
    weighted = basis[..., None, :, :] * (weight if weight.ndim < 2 else weight[..., :, None, :])
    # Of so few rows faster than a product of matrices, whose threads wait for each other.
    normal = np.einsum("...in,...jn->...ij", weighted, basis[..., None, :, :])
    wanted = values - terms.fixed[..., None, :]
    return normal, np.einsum("...n,...n->...", weighted, wanted[..., None, :])


def _nonnegative_solution(sums: Sequence[tuple[Array, Array]]) -> Array:
    """Return the best coefficients ≥ 0 of normal equations, which are those of parts, summed."""
    normal, right = (np.sum(parts, axis=0) for parts in zip(*sums, strict=True))
    # In units in which the diagonal is 1.
    size = np.sqrt(np.maximum(normal.diagonal(axis1=-2, axis2=-1), np.finfo(float).tiny))
    right /= size
    if right.shape[-1] == 1:
        return np.asarray(np.maximum(right, 0) / size)
    normal /= size[..., :, None] * size[..., None, :]
    with np.errstate(all="ignore"):
        best = _solved(normal, right)
    illegal = ~(best >= 0).all(axis=-1)
    if illegal.any():
        normal = np.broadcast_to(normal, (*right.shape, right.shape[-1]))
        best[illegal] = _at_border(normal[illegal], right[illegal])
    best /= size
    return best


def _at_border(normal: Array, right: Array) -> Array:
    """Return the best coefficients ≥ 0 of which some are 0, of systems whose diagonal is 1."""
    count = right.shape[-1]
    best, explained = np.zeros_like(right), np.zeros(len(right))
    for number in range(1, count):
        for chosen in map(list, combinations(range(count), number)):
            with np.errstate(all="ignore"):
                solution = _solved(normal[:, chosen][:, :, chosen], right[:, chosen])
                gain = (solution * right[:, chosen]).sum(axis=-1)
            is_better = (solution >= 0).all(axis=-1) & (gain > explained)
            explained = np.where(is_better, gain, explained)
            candidate = np.zeros_like(right)
            candidate[:, chosen] = solution
            best = np.where(is_better[:, None], candidate, best)
    return best


def _solved(normal: Array, right: Array) -> Array:
    """Return the solutions of small systems whose diagonal is 1."""
    if right.shape[-1] == 1:
        return right.copy()
    if right.shape[-1] == 2:
        shared = normal[..., 0, 1, None]
        solution = right - shared * right[..., ::-1]
        solution /= 1 - shared * shared
        return np.asarray(solution)
    # A combination that the data do not tell is left at 0.
    return np.asarray((np.linalg.pinv(normal, hermitian=True) @ right[..., None])[..., 0])


def projected_slope(terms: Terms, slopes: list[Terms], projected: Projected) -> Array:
    """Return ∂residual/∂parameter with the linear part projected out (Kaufman 1975).

    The result has shape (parameters, channels · n). Coefficients that are zero stay so.
    """
    moved = np.stack(moved_models(slopes, projected))
    moved *= projected.gain
    for channel, gain in enumerate(projected.gain):
        free = terms.basis[projected.coefficients[channel] > 0] * gain
        size = np.sqrt(np.einsum("in,in->i", free, free))
        free /= np.where(size > 0, size, 1)[:, None]
        normal = np.einsum("in,jn->ij", free, free)
        shares = np.einsum("pn,in->pi", moved[:, channel], free)
        if len(free):
            with np.errstate(all="ignore"):
                shares = np.nan_to_num(_solved(normal, shares), posinf=0, neginf=0)
        for place, row in enumerate(free):
            moved[:, channel] -= shares[:, place, None] * row
    return moved.reshape(len(moved), -1)


def moved_models(slopes: list[Terms], projected: Projected) -> list[Array]:
    """Return ∂model/∂parameter at fixed coefficients, each of shape (channels, n)."""
    return [slope.at(projected.coefficients) for slope in slopes]


def information(terms: Terms, slopes: list[Terms], projected: Projected) -> Array:
    """Return JᵀJ of all unknowns: the lobe's parameters, then the coefficients of each channel."""
    count, size = len(slopes), terms.basis.shape[-2]
    channels = len(projected.coefficients)
    total = np.zeros((count + size * channels,) * 2)
    moved = moved_models(slopes, projected)
    for channel, gain in enumerate(projected.gain):
        rows = np.stack([*(model[channel] for model in moved), *terms.basis]) * gain
        first = count + size * channel
        places = np.concatenate([np.arange(count), np.arange(first, first + size)])
        total[np.ix_(places, places)] += np.einsum("in,jn->ij", rows, rows)
    return total
