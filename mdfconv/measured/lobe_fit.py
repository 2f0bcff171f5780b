"""Fits of offset + scale · D̄(β; p) to samples, offset and scale eliminated.

For given p the model is linear in the offset and scale of every channel, so they are solved
for and only p is searched (variable projection: Golub & Pereyra 1973, with the derivative of
Kaufman 1975). Under the logarithmic loss the same linear step is iterated.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from mdfconv.distributions import Distribution
from mdfconv.distributions.evaluation import Array
from mdfconv.errors import MdfconvError
from mdfconv.measured.samples import Samples

LOSSES = ("linear", "log")
# Tangents of β_half from narrower than any measurement resolves to nearly uniform. Neighbours of
# 120 differ by 13 %, which no valley of the cost falls between.
_NARROWEST, _WIDEST, _CANDIDATES = 1e-5, 30.0, 120
# Lobes of different γ are valleys of their own, and the lowest candidate need not lie in the
# deepest: the best of each γ is refined.
_GAMMAS = 9
# Truncation of a central difference falls with h², rounding rises with ε/h: h = ε^(1/3).
_STEP = float(np.finfo(float).eps) ** (1 / 3)
# Nearer than this to an end of its range, relatively, γ is at the end.
_AT_END = 1e-3
# Gauss-Newton steps for the logarithms: at the right parameter six are exact under 50 % of noise.
_LOG_STEPS = 12
# Of the smallest sample, under the logarithmic loss: a model is kept positive, far from where a
# fit ends.
_SMALLEST_MODEL = 1e-3
# Values that a scan holds at a time: 16 MB.
_SCANNED_AT_ONCE = 2_000_000
# Inside the bounds by this, in a logarithm: the solver starts between them.
_INSIDE = 1e-9


@dataclass(frozen=True)
class LobeFit:
    """One distribution fitted to samples.

    Parameters
    ----------
    distribution : Distribution
        The distribution, with the fitted γ if it has one.
    parameters, errors : tuple of float
        The parameter (and γ where it was fitted), and their standard errors.
    offset, scale : tuple of float
        One of each for every channel.
    rmse, log_rmse : float
        Root mean square of the residuals, and of those of the natural logarithms where both
        sample and model are positive.
    aic, bic : float
        Information criteria of the loss's residuals.
    """

    distribution: Distribution
    parameters: tuple[float, ...]
    errors: tuple[float, ...]
    offset: tuple[float, ...]
    scale: tuple[float, ...]
    rmse: float
    log_rmse: float
    aic: float
    bic: float

    @property
    def at_limit(self) -> bool:
        """Whether a fitted γ lies at the end of the range that is searched."""
        second = self.distribution.second_parameter
        if second is None or len(self.parameters) < 2:
            return False
        low, high = second.fit_range
        return not low * (1 + _AT_END) < self.parameters[1] < high * (1 - _AT_END)

    def model(self, beta: Array, quantity: str) -> Array:
        """Return the model at angles (radians), shape (n, channels)."""
        lobe = self.distribution.unit(beta, self.parameters[0]) / foreshortening(beta, quantity)
        return np.array(self.offset) + lobe[:, None] * np.array(self.scale)


def foreshortening(beta: Array, quantity: str) -> Array:
    """Return cos²β for a BRDF at θ_d = 0, where it is D̄/cos²β but for masking; else 1."""
    return np.square(np.cos(beta)) if quantity == "brdf" else np.ones_like(beta)


def fit_lobe(
    data: Samples, target: Distribution, loss: str = "linear", *, gamma: float | None = None
) -> LobeFit:
    """Fit one distribution to samples, all channels with one parameter.

    Parameters
    ----------
    data : Samples
        The measurements.
    target : Distribution
        What to fit; γ of a distribution of two parameters is free unless `gamma` is given.
    loss : str
        ``"linear"``: squared residuals. ``"log"``: squared residuals of the logarithms; only
        positive samples count.
    gamma : float, optional
        γ of a distribution that has one; the others do not ask for it.

    Returns
    -------
    LobeFit
        The best fit over the whole legal range, with standard errors.

    Raises
    ------
    MdfconvError
        If there are fewer samples than unknowns, nothing to fit, or γ is illegal.
    """
    problem = _Problem(data, target, loss, gamma)
    solutions = [problem.refine(start) for start in problem.starts()]
    _, point = min(solutions, key=lambda solution: solution[0])
    return problem.report(point)


def simplest(fits: list[LobeFit], tolerance: float, loss: str) -> LobeFit:
    """Return the cheapest of fits whose error is within a relative tolerance of the best.

    Cheapest has the fewest parameters, then the fewest operations per evaluation.
    """
    best = min(_error(fit, loss) for fit in fits)
    good = [fit for fit in fits if _error(fit, loss) <= (1 + tolerance) * best]
    return min(good, key=lambda fit: (len(fit.parameters), fit.distribution.operations))


def rank(fits: list[LobeFit], loss: str) -> list[LobeFit]:
    """Return fits by the error of the loss, the smallest first."""
    return sorted(fits, key=lambda fit: _error(fit, loss))


def _error(fit: LobeFit, loss: str) -> float:
    return fit.log_rmse if loss == "log" else fit.rmse


class _Problem:
    """The projected problem: residuals and slopes in the logarithms of p (and γ)."""

    def __init__(self, data: Samples, target: Distribution, loss: str, gamma: float | None) -> None:
        if loss not in LOSSES:
            raise MdfconvError(f"unknown loss '{loss}'", f"known: {', '.join(LOSSES)}")
        self._log = loss == "log"
        second = target.second_parameter
        self._target = target if second is None or gamma is None else target.with_gamma(gamma)
        self._gamma_range = second.fit_range if second and gamma is None else None
        keep = (data.values > 0).all(axis=1) if self._log else np.ones(data.beta.size, bool)
        self._data, self._beta, self._values = data, data.beta[keep], data.values[keep]
        self._cosine = foreshortening(self._beta, data.quantity)
        self._check()
        # In units of the largest value, whatever the measurement's.
        self._unit = float(np.max(np.abs(self._values)))
        self._values = self._values / self._unit
        self._candidates = self._scanned()
        logarithms = np.concatenate([points[:, 0] for points in self._candidates])
        # Beyond the candidates a lobe is narrower than the angles resolve, or nearly uniform.
        upper = min(np.log(self._target.parameter.upper), logarithms.max() + 5)
        ends = [(logarithms.min() - 1, upper)]
        if self._gamma_range:
            ends.append(tuple(np.log(self._gamma_range)))
        self._bounds = tuple(np.array(ends).T)

    def _scanned(self) -> list[Array]:
        """Return points of every half width for each γ of a grid, shape (candidates, unknowns)."""
        tangents = np.geomspace(_NARROWEST, _WIDEST, _CANDIDATES)
        if self._gamma_range is None:
            return [_logarithms(self._target.from_half_tangent(tangents))[:, None]]
        points = []
        for gamma in np.geomspace(*self._gamma_range, _GAMMAS):
            target = self._target.with_gamma(float(gamma))
            first = _logarithms(target.from_half_tangent(tangents))
            points.append(np.stack([first, np.full_like(first, np.log(gamma))], axis=1))
        return points

    def _check(self) -> None:
        unknowns = 2 * self._values.shape[1] + (2 if self._gamma_range else 1)
        angles = np.unique(self._beta).size
        if self._values.size <= unknowns or angles < 4:
            raise MdfconvError(
                f"{self._values.size} values at {angles} angles are too few to fit {unknowns} "
                f"unknowns of {self._target.name}"
            )
        if np.ptp(self._values, axis=0).max() == 0:
            raise MdfconvError("all values are equal: there is no lobe to fit")

    def starts(self) -> list[Array]:
        """Return the best point of a scan over p, for each γ of a grid if that is free."""
        return [points[int(np.argmin(self._costs(points)))] for points in self._candidates]

    def _costs(self, points: Array) -> Array:
        """Return the cost of points of one γ, shape (candidates,)."""
        block = max(1, _SCANNED_AT_ONCE // self._values.size)
        blocks = [points[start : start + block] for start in range(0, len(points), block)]
        return np.concatenate(
            [np.sum(np.square(self._project(self._lobes(some))[0]), axis=(1, 2)) for some in blocks]
        )

    def refine(self, start: Array) -> tuple[float, Array]:
        """Return the cost and the point of the minimum whose valley a point lies in."""
        point = least_squares(
            self.residual,
            np.clip(start, self._bounds[0] + _INSIDE, self._bounds[1] - _INSIDE),
            self.slope,
            bounds=self._bounds,
            xtol=1e-12,
            ftol=1e-14,
            gtol=1e-14,
            x_scale="jac",
        ).x
        return self.cost(point), point

    def cost(self, point: Array) -> float:
        """Return the sum of the squared residuals."""
        return float(np.sum(np.square(self.residual(point))))

    def residual(self, point: Array) -> Array:
        """Return the residuals that the best offsets and scales leave, flattened."""
        return self._project(self._lobe(point))[0].ravel()

    def slope(self, point: Array) -> Array:
        """Return ∂residual/∂point with the linear part projected out (Kaufman)."""
        lobe, slopes = self._lobe(point), self._lobe_slopes(point)
        _, gain, _, scale = self._project(lobe)
        columns = []
        for slope in slopes:
            moved = gain * slope[:, None] * scale
            for channel in range(moved.shape[1]):
                basis = gain[:, channel, None] * np.stack([np.ones_like(lobe), lobe], axis=1)
                inner = np.linalg.lstsq(basis, moved[:, channel], rcond=None)[0]
                moved[:, channel] -= basis @ inner
            columns.append(moved.ravel())
        return np.stack(columns, axis=1)

    def report(self, point: Array) -> LobeFit:
        """Return the fit at a point, with standard errors from the full Jacobian."""
        lobe, slopes = self._lobe(point), self._lobe_slopes(point)
        residual, gain, offset, scale = self._project(lobe)
        if not scale.any():
            raise MdfconvError("the values do not fall with the angle: there is no lobe to fit")
        count, channels = residual.shape
        jacobian = np.zeros((count, channels, len(slopes) + 2 * channels))
        for column, slope in enumerate(slopes):
            jacobian[:, :, column] = gain * slope[:, None] * scale
        for channel in range(channels):
            jacobian[:, channel, len(slopes) + 2 * channel] = gain[:, channel]
            jacobian[:, channel, len(slopes) + 2 * channel + 1] = gain[:, channel] * lobe
        flat = jacobian.reshape(count * channels, -1)
        unknowns = flat.shape[1]
        cost = float(np.sum(np.square(residual)))
        spread = np.sqrt(cost / (residual.size - unknowns)) * _standard_deviations(flat)
        distribution, parameters = self._at(point), np.exp(point)
        if self._gamma_range:
            parameters[1] = distribution.gamma
        likelihood = residual.size * np.log(max(cost, np.finfo(float).tiny) / residual.size)
        if not self._log:
            likelihood += 2 * residual.size * np.log(self._unit)
        model = _model(lobe, offset, scale)
        return LobeFit(
            distribution=distribution,
            parameters=tuple(parameters.tolist()),
            errors=tuple((parameters * spread[: point.size]).tolist()),
            offset=tuple((self._unit * offset).tolist()),
            scale=tuple((self._unit * scale).tolist()),
            rmse=self._unit * float(np.sqrt(np.mean(np.square(model - self._values)))),
            log_rmse=_log_rmse(model, self._values),
            aic=float(likelihood + 2 * unknowns),
            bic=float(likelihood + unknowns * np.log(residual.size)),
        )

    def _at(self, point: Array) -> Distribution:
        """Return the distribution with the γ of a point."""
        second = self._target.second_parameter
        if self._gamma_range is None or second is None:
            return self._target
        # exp(ln γ) rounds, and an end of the range may be the end of the legal values.
        return self._target.with_gamma(float(np.clip(np.exp(point[1]), second.lower, second.upper)))

    def _lobe(self, point: Array) -> Array:
        """Return the lobe, of which the model is a multiple and an offset, shape (n,)."""
        lobe: Array = self._lobes(point[None, :])[0]
        return lobe

    def _lobes(self, points: Array) -> Array:
        """Return the lobes of points of one γ, shape (points, n)."""
        beta = np.broadcast_to(self._beta, (len(points), self._beta.size))
        with np.errstate(all="ignore"):
            return self._at(points[0]).shape(beta, np.exp(points[:, :1])) / self._cosine

    def _lobe_slopes(self, point: Array) -> list[Array]:
        """Return the slopes of the lobe in ln p, and in ln γ if that is free."""
        with np.errstate(all="ignore"):
            _, slope = self._at(point).with_slope(
                self._beta[None, :], np.exp(point[:1])[:, None], normalized=False
            )
        slopes = [slope[0] / self._cosine]
        if self._gamma_range:
            low, high = (np.array([point[0], point[1] + step]) for step in (-_STEP, _STEP))
            rise = self._lobe(high) - self._lobe(low)
            # At an end of the legal values one-sided.
            slopes.append(rise / np.log(self._at(high).gamma / self._at(low).gamma))
        return slopes

    def _project(self, lobe: Array) -> tuple[Array, Array, Array, Array]:
        """Return residuals, their gain ∂residual/∂model, offsets and scales.

        A lobe has shape (..., n), residuals and gain (..., n, channels), the others
        (..., channels).
        """
        values, ones = self._values, np.ones_like(self._values)
        offset, scale = _solve(lobe, values, ones)
        if not self._log:
            return _model(lobe, offset, scale) - values, ones, offset, scale
        smallest = _SMALLEST_MODEL * values.min(axis=0)
        offset, scale = _solve(lobe, values, 1 / np.square(values))
        for _ in range(_LOG_STEPS):
            model = np.maximum(_model(lobe, offset, scale), smallest)
            # One Gauss-Newton step for the logarithms is a weighted linear fit.
            working = model * (1 + np.log(values / model))
            offset, scale = _solve(lobe, working, 1 / np.square(model))
        model = np.maximum(_model(lobe, offset, scale), smallest)
        return np.log(model / values), 1 / model, offset, scale


def _model(lobe: Array, offset: Array, scale: Array) -> Array:
    """Return offset + scale · lobe, shape (..., n, channels)."""
    return offset[..., None, :] + lobe[..., None] * scale[..., None, :]


def _solve(lobe: Array, values: Array, weight: Array) -> tuple[Array, Array]:
    """Return weighted least-squares offset and scale ≥ 0 of each channel."""
    total = weight.sum(axis=-2)
    centre = (weight * lobe[..., None]).sum(axis=-2) / total
    mean = (weight * values).sum(axis=-2) / total
    centred = lobe[..., None] - centre[..., None, :]
    spread = (weight * np.square(centred)).sum(axis=-2)
    shared = (weight * centred * (values - mean[..., None, :])).sum(axis=-2)
    # A lobe points outwards: a negative scale would be a hole.
    scale = np.where(spread > 0, np.maximum(shared, 0) / np.where(spread > 0, spread, 1), 0)
    return mean - scale * centre, scale


def _logarithms(candidates: Array) -> Array:
    """Return the logarithms of those that exist, ascending."""
    return np.log(np.sort(candidates[np.isfinite(candidates)]))


def _standard_deviations(jacobian: Array) -> Array:
    """Return the square roots of the diagonal of (JᵀJ)⁻¹, without forming JᵀJ."""
    norms = np.linalg.norm(jacobian, axis=0)
    norms = np.where(norms > 0, norms, 1)
    _, singular, basis = np.linalg.svd(jacobian / norms, full_matrices=False)
    singular = np.maximum(singular, np.finfo(float).tiny)
    return np.linalg.norm(basis / singular[:, None], axis=0) / norms


def _log_rmse(model: Array, values: Array) -> float:
    positive = (model > 0) & (values > 0)
    if not positive.any():
        return float("nan")
    ratio = np.log(model[positive] / values[positive])
    return float(np.sqrt(np.mean(np.square(ratio))))
