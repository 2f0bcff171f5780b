"""Models that are an offset and a multiple of a lobe: both found for any lobe.

Linear in the two, the model's best offset and scale are solved for, so that only the lobe's own
parameters are searched (variable projection: Golub & Pereyra 1973). Under the logarithmic loss
the same linear step is iterated.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from mdfconv.distributions.evaluation import Array
from mdfconv.errors import MdfconvError

# Gauss-Newton steps for the logarithms: at the right parameter six are exact under 50 % of noise.
_LOG_STEPS, _LOG_TOLERANCE = 12, 1e-11
# Of the largest sample: what is smaller has no weight 1/value² in double precision.
_SMALLEST_LOGARITHM = 1e-100
# Of the smallest sample, under the logarithmic loss: a model is kept positive, far from where a
# fit ends.
_SMALLEST_MODEL = 1e-3


class Projection:
    """The best offset and scale of each channel, for any lobe.

    Parameters
    ----------
    values : numpy.ndarray, shape (n, channels)
        What the model is to be; positive for logarithms.
    log : bool
        Whether the residuals are those of the logarithms.
    weight : numpy.ndarray, shape (n, 1), optional
        Of the squared residuals; 1 if not given.
    floor : bool
        Whether an offset is at least 0.

    Raises
    ------
    MdfconvError
        If there are logarithms of values that are too far apart.
    """

    def __init__(
        self,
        values: Array,
        *,
        log: bool = False,
        weight: Array | None = None,
        floor: bool = False,
    ) -> None:
        self.values, self._log, self._floor = values, log, floor
        self._weight = np.ones_like(values) if weight is None else weight * np.ones_like(values)
        self._root = np.sqrt(self._weight)
        if log and values.min() <= _SMALLEST_LOGARITHM * values.max():
            raise MdfconvError(
                "the smallest value is less than 1e-100 of the largest: no loss of logarithms "
                "holds both",
                "leave out what is no measurement, or take the linear loss",
            )

    def __call__(self, lobe: Array) -> tuple[Array, Array, Array, Array]:
        """Return residuals, their gain ∂residual/∂model, offsets and scales.

        A lobe has shape (..., n), residuals and gain (..., n, channels), the others
        (..., channels).
        """
        values, root = self.values, self._root
        if not self._log:
            offset, scale = self._solve(lobe, values, self._weight)
            return root * (model(lobe, offset, scale) - values), root, offset, scale
        smallest = _SMALLEST_MODEL * values.min(axis=0)
        offset, scale = self._solve(lobe, values, self._weight / np.square(values))
        for _ in range(_LOG_STEPS):
            near = np.maximum(model(lobe, offset, scale), smallest)
            # One Gauss-Newton step for the logarithms is a weighted linear fit.
            working = near * (1 + np.log(values / near))
            last, (offset, scale) = (
                (offset, scale),
                self._solve(lobe, working, self._weight / np.square(near)),
            )
            if np.allclose(last, (offset, scale), rtol=_LOG_TOLERANCE, atol=0):
                break
        near = np.maximum(model(lobe, offset, scale), smallest)
        return root * np.log(near / values), root / near, offset, scale

    def slope(self, lobe: Array, slopes: list[Array]) -> Array:
        """Return ∂residual/∂parameter with the linear part projected out (Kaufman 1975).

        Parameters
        ----------
        lobe : numpy.ndarray, shape (n,)
            The lobe.
        slopes : list of numpy.ndarray, shape (n,)
            Its slopes in each parameter.

        Returns
        -------
        numpy.ndarray, shape (n · channels, parameters)
        """
        return projected_slope(lobe, slopes, *self(lobe)[1::2])

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


def projected_slope(lobe: Array, slopes: list[Array], gain: Array, scale: Array) -> Array:
    """Return ∂residual/∂parameter of a model with the given gain and scale, as `Projection`."""
    columns = []
    for slope in slopes:
        moved = slope[:, None] * scale
        moved -= model(lobe, *_regression(lobe, moved, np.square(gain)))
        columns.append((gain * moved).ravel())
    return np.stack(columns, axis=1)


def model(lobe: Array, offset: Array, scale: Array) -> Array:
    """Return offset + scale · lobe, shape (..., n, channels)."""
    return offset[..., None, :] + lobe[..., None] * scale[..., None, :]


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


def log_rmse(near: Array, values: Array) -> float:
    """Return the root mean square of ln(model/value) where both are positive, else NaN."""
    positive = (near > 0) & (values > 0)
    if not positive.any():
        return float("nan")
    ratio = np.log(near[positive] / values[positive])
    return float(np.sqrt(np.mean(np.square(ratio))))


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
