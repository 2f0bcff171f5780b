"""Models that are an offset and a multiple of a lobe: both found for any lobe.

Linear in the two, the model's best offset and scale are solved for, so that only the lobe's own
parameters are searched (variable projection: Golub & Pereyra 1973). Under the logarithmic loss
the same linear step is iterated.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

from mdfconv.distributions.evaluation import Array
from mdfconv.errors import MdfconvError

# Gauss-Newton steps for the logarithms: at the right parameter six are exact under 50 % of noise.
_LOG_STEPS = 12
_LOG_TOLERANCE = 1e-11
# Of the largest sample: what is smaller has no weight 1/value² in double precision.
_SMALLEST_LOGARITHM = 1e-100
# Of the smallest sample, under the logarithmic loss: a model is kept positive, far from where a
# fit ends.
_SMALLEST_MODEL = 1e-3
# Rows of a Jacobian that are held at a time.
_BLOCK = 65536


class Projected(NamedTuple):
    """What a lobe leaves: residuals, ∂residual/∂model, and the best offsets and scales."""

    residual: Array
    gain: Array
    offset: Array
    scale: Array


class Projection:
    """The best offset and scale of each channel, for any lobe.

    Values and weights have shape (n, channels), values are positive for logarithms; `floor` keeps
    offsets from being negative. Raises `MdfconvError` for logarithms of values that are too far
    apart.
    """

    def __init__(self, values: Array, weight: Array, *, log: bool, floor: bool) -> None:
        self._values, self._weight, self._log, self._floor = values, weight, log, floor
        self._root = np.sqrt(weight)
        if log and values.min() <= _SMALLEST_LOGARITHM * values.max():
            raise MdfconvError(
                "the smallest value is less than 1e-100 of the largest: no loss of logarithms "
                "holds both",
                "leave out what is no measurement, or take the linear loss",
            )

    def __call__(self, lobe: Array) -> Projected:
        """Project lobes of shape (..., n): residuals and gain are (..., n, channels)."""
        values, root = self._values, self._root
        if not self._log:
            offset, scale = self._solve(lobe, values, self._weight)
            return Projected(root * (model(lobe, offset, scale) - values), root, offset, scale)
        smallest = _SMALLEST_MODEL * values.min(axis=0)
        offset, scale = self._solve(lobe, values, self._weight / np.square(values))
        for _ in range(_LOG_STEPS):
            near = np.maximum(model(lobe, offset, scale), smallest)
            # One Gauss-Newton step for the logarithms is a weighted linear fit.
            working = near * (1 + np.log(values / near))
            last = offset, scale
            offset, scale = self._solve(lobe, working, self._weight / np.square(near))
            if np.allclose(last, (offset, scale), rtol=_LOG_TOLERANCE, atol=0):
                break
        near = np.maximum(model(lobe, offset, scale), smallest)
        return Projected(root * np.log(near / values), root / near, offset, scale)

    def _solve(self, lobe: Array, values: Array, weight: Array) -> tuple[Array, Array]:
        """Return weighted least-squares offset and scale ≥ 0 of each channel."""
        offset, scale = _regression(lobe, values, weight)
        # A lobe points outwards: a negative scale would be a hole.
        hole = scale < 0
        if hole.any():
            mean = (weight * values).sum(axis=-2) / weight.sum(axis=-2)
            offset, scale = np.where(hole, mean, offset), np.where(hole, 0, scale)
        if self._floor and (offset < 0).any():
            alone = _ratio(
                (weight * lobe[..., None] * values).sum(axis=-2),
                (weight * np.square(lobe[..., None])).sum(axis=-2),
            )
            below = offset < 0
            scale, offset = np.where(below, np.maximum(alone, 0), scale), np.where(below, 0, offset)
        return offset, scale


def model(lobe: Array, offset: Array, scale: Array) -> Array:
    """Return offset + scale · lobe, shape (..., n, channels)."""
    return offset[..., None, :] + lobe[..., None] * scale[..., None, :]


def projected_slope(lobe: Array, slopes: list[Array], gain: Array, scale: Array) -> Array:
    """Return ∂residual/∂parameter with the linear part projected out (Kaufman 1975).

    Lobe and slopes have shape (n,), gain (n, channels); the result is (n · channels, parameters).
    """
    columns = []
    for slope in slopes:
        moved = slope[:, None] * scale
        moved -= model(lobe, *_regression(lobe, moved, np.square(gain)))
        columns.append((gain * moved).ravel())
    return np.stack(columns, axis=1)


def jacobian(lobe: Array, slopes: list[Array], gain: Array, scale: Array) -> Iterator[Array]:
    """Yield blocks, shape (rows, channels, unknowns), of the slopes of the residuals.

    The unknowns are the lobe's parameters, then offset and scale of each channel.
    """
    channel = np.arange(scale.size)
    offsets = len(slopes) + 2 * channel
    for start in range(0, lobe.size, _BLOCK):
        rows = slice(start, start + _BLOCK)
        part = gain[rows]
        block = np.zeros((*part.shape, len(slopes) + 2 * scale.size))
        for column, slope in enumerate(slopes):
            block[:, :, column] = part * slope[rows, None] * scale
        block[:, channel, offsets] = part
        block[:, channel, offsets + 1] = part * lobe[rows, None]
        yield block


def upper_triangle(blocks: Iterable[Array]) -> Array:
    """Return R of the QR decomposition of a tall matrix, given in blocks of rows."""
    rows: list[Array] = []
    for block in blocks:
        rows = [np.asarray(np.linalg.qr(np.concatenate([*rows, block]), mode="r"))]
    return rows[0]


def standard_deviations(jacobian: Array) -> Array:
    """Return the square roots of the diagonal of (JᵀJ)⁻¹, without forming JᵀJ; J or its R."""
    norms = np.linalg.norm(jacobian, axis=0)
    norms = np.where(norms > 0, norms, 1)
    _, singular, basis = np.linalg.svd(jacobian / norms, full_matrices=False)
    singular = np.maximum(singular, np.finfo(float).tiny)
    deviations: Array = np.linalg.norm(basis / singular[:, None], axis=0) / norms
    return deviations


def _regression(lobe: Array, values: Array, weight: Array) -> tuple[Array, Array]:
    """Return the offset and the multiple of a lobe nearest to values, for each channel."""
    total = weight.sum(axis=-2)
    centre = (weight * lobe[..., None]).sum(axis=-2) / total
    mean = (weight * values).sum(axis=-2) / total
    centred = lobe[..., None] - centre[..., None, :]
    weighted = weight * centred
    spread = (weighted * centred).sum(axis=-2)
    shared = (weighted * (values - mean[..., None, :])).sum(axis=-2)
    scale = _ratio(shared, spread)
    return mean - scale * centre, scale


def _ratio(numerator: Array, denominator: Array) -> Array:
    """Return numerator/denominator, 0 where the denominator is."""
    positive = denominator > 0
    return np.where(positive, numerator / np.where(positive, denominator, 1), 0)
