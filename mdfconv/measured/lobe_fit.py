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
from mdfconv.distributions.gtr import GTR
from mdfconv.errors import MdfconvError
from mdfconv.fitting.gtr import HIGHEST_GAMMA, LOWEST_GAMMA
from mdfconv.measured.samples import Samples

LOSSES = ("linear", "log")
_CANDIDATES = 120
_GAMMAS = 9
# Tangents of β_half from narrower than any measurement resolves to nearly uniform.
_NARROWEST, _WIDEST = 1e-5, 30.0
_LOG_STEPS = 12
_SMALLEST_MODEL = 1e-3  # of the smallest sample, under the logarithmic loss
_LOG_GAMMA_RANGE = (float(np.log(LOWEST_GAMMA)), float(np.log(HIGHEST_GAMMA)))


@dataclass(frozen=True)
class LobeFit:
    """One distribution fitted to samples.

    Parameters
    ----------
    distribution : Distribution
        The distribution; for GTR with the fitted γ.
    parameters, errors : tuple of float
        The parameter (and γ for GTR), and their standard errors.
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
        """Whether γ of GTR lies at the end of the range that is searched."""
        ends = LOWEST_GAMMA * 1.001, HIGHEST_GAMMA * 0.999
        return len(self.parameters) > 1 and not ends[0] < self.parameters[1] < ends[1]

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
        What to fit; GTR with γ free unless `gamma` is given.
    loss : str
        ``"linear"``: squared residuals. ``"log"``: squared residuals of the logarithms; only
        positive samples count.
    gamma : float, optional
        γ of GTR.

    Returns
    -------
    LobeFit
        The best fit over the whole legal range, with standard errors.

    Raises
    ------
    MdfconvError
        If there are fewer samples than unknowns, or nothing to fit.
    """
    problem = _Problem(data, target, loss, gamma)
    found = least_squares(
        problem.residual,
        problem.start(),
        problem.slope,
        bounds=problem.bounds,
        xtol=1e-12,
        ftol=1e-14,
        gtol=1e-14,
        x_scale="jac",
    )
    return problem.report(found.x)


def simplest(fits: list[LobeFit], tolerance: float, loss: str) -> LobeFit:
    """Return the cheapest of fits whose error is within a relative tolerance of the best.

    Cheapest has the fewest parameters, then the fewest operations per evaluation.
    """
    best = min(_error(entry, loss) for entry in fits)
    good = [entry for entry in fits if _error(entry, loss) <= (1 + tolerance) * best]
    return min(good, key=lambda entry: (len(entry.parameters), entry.distribution.operations))


def rank(fits: list[LobeFit], loss: str) -> list[LobeFit]:
    """Return fits by the error of the loss, the smallest first."""
    return sorted(fits, key=lambda entry: _error(entry, loss))


def _error(entry: LobeFit, loss: str) -> float:
    return entry.log_rmse if loss == "log" else entry.rmse


class _Problem:
    """The projected problem: residuals and slopes in the logarithms of p (and γ)."""

    def __init__(self, data: Samples, target: Distribution, loss: str, gamma: float | None) -> None:
        if loss not in LOSSES:
            raise MdfconvError(f"unknown loss '{loss}'; known: {', '.join(LOSSES)}")
        self._log = loss == "log"
        self._target = GTR(gamma) if gamma is not None and isinstance(target, GTR) else target
        self._free_gamma = isinstance(target, GTR) and gamma is None
        keep = (data.values > 0).all(axis=1) if self._log else np.ones(data.beta.size, bool)
        self._data, self._beta, self._values = data, data.beta[keep], data.values[keep]
        self._cosine = foreshortening(self._beta, data.quantity)
        self._check()
        # In units of the largest value, whatever the measurement's.
        self._unit = float(np.max(np.abs(self._values)))
        self._values = self._values / self._unit
        tangents = np.geomspace(_NARROWEST, _WIDEST, _CANDIDATES)
        candidates = self._target.from_half_tangent(tangents)
        self._candidates = np.log(np.sort(candidates[np.isfinite(candidates)]))
        upper = min(np.log(self._target.parameter.upper), self._candidates[-1] + 5)
        ends = [(self._candidates[0] - 1, upper)]
        if self._free_gamma:
            ends.append(_LOG_GAMMA_RANGE)
        self.bounds = tuple(np.array(ends).T)

    def _check(self) -> None:
        unknowns = 2 * self._values.shape[1] + 1 + self._free_gamma
        angles = np.unique(self._beta).size
        if self._values.size <= unknowns or angles < 4:
            raise MdfconvError(
                f"{self._values.size} values at {angles} angles are too few to fit {unknowns} "
                f"unknowns of {self._target.name}"
            )
        if np.ptp(self._values, axis=0).max() == 0:
            raise MdfconvError("all values are equal: there is no lobe to fit")

    def start(self) -> Array:
        """Return the best point of a scan over p (and γ)."""
        gammas = np.linspace(*_LOG_GAMMA_RANGE, _GAMMAS) if self._free_gamma else [None]
        points = [np.array([p] if g is None else [p, g]) for g in gammas for p in self._candidates]
        costs = [float(np.sum(np.square(self.residual(point)))) for point in points]
        lowest = points[int(np.argmin(costs))]
        return np.clip(lowest, self.bounds[0] + 1e-9, self.bounds[1] - 1e-9)

    def residual(self, point: Array) -> Array:
        """Return the residuals that the best offsets and scales leave, flattened."""
        return self._project(point)[0].ravel()

    def slope(self, point: Array) -> Array:
        """Return ∂residual/∂point with the linear part projected out (Kaufman)."""
        _, gain, _, scale = self._project(point)
        lobe, slopes = self._lobe(point)
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
        residual, gain, offset, scale = self._project(point)
        if not scale.any():
            raise MdfconvError("the values do not fall with the angle: there is no lobe to fit")
        lobe, slopes = self._lobe(point)
        count, channels = residual.shape
        jacobian = np.zeros((count, channels, len(slopes) + 2 * channels))
        for place, slope in enumerate(slopes):
            jacobian[:, :, place] = gain * slope[:, None] * scale
        for channel in range(channels):
            jacobian[:, channel, len(slopes) + 2 * channel] = gain[:, channel]
            jacobian[:, channel, len(slopes) + 2 * channel + 1] = gain[:, channel] * lobe
        flat = jacobian.reshape(count * channels, -1)
        unknowns = flat.shape[1]
        cost = float(np.sum(np.square(residual)))
        spread = np.sqrt(cost / (residual.size - unknowns)) * _standard_deviations(flat)
        parameters = np.exp(point)
        likelihood = residual.size * np.log(max(cost, np.finfo(float).tiny) / residual.size)
        if not self._log:
            likelihood += 2 * residual.size * np.log(self._unit)
        model = offset + lobe[:, None] * scale
        return LobeFit(
            distribution=self._at(point),
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
        return GTR(float(np.exp(point[1]))) if self._free_gamma else self._target

    def _lobe(self, point: Array) -> tuple[Array, list[Array]]:
        """Return the lobe and its slopes in the logarithms of the parameters."""
        target = self._at(point)
        alpha = np.exp(point[:1])[:, None]
        with np.errstate(all="ignore"):
            value, slope = target.with_slope(self._beta[None, :], alpha, normalized=False)
            slopes = [slope[0] / self._cosine]
            if isinstance(target, GTR) and self._free_gamma:
                # ∂ ln (1+x)^(−γ) / ∂ ln γ is the logarithm itself.
                logarithm = np.log(np.maximum(value[0], np.finfo(float).tiny))
                slopes.append(value[0] * logarithm / self._cosine)
        return value[0] / self._cosine, slopes

    def _project(self, point: Array) -> tuple[Array, Array, Array, Array]:
        """Return residuals, their gain ∂residual/∂model, offsets and scales."""
        target = self._at(point)
        alpha = np.exp(point[:1])[:, None]
        with np.errstate(all="ignore"):
            lobe = target.shape(self._beta[None, :], alpha)[0] / self._cosine
        values = self._values
        ones = np.ones_like(values)
        offset, scale = _solve(lobe, values, ones)
        if not self._log:
            return offset + lobe[:, None] * scale - values, ones, offset, scale
        smallest = _SMALLEST_MODEL * values.min(axis=0)
        offset, scale = _solve(lobe, values, 1 / np.square(values))
        for _ in range(_LOG_STEPS):
            model = np.maximum(offset + lobe[:, None] * scale, smallest)
            # One Gauss-Newton step for the logarithms is a weighted linear fit.
            working = model * (1 + np.log(values / model))
            offset, scale = _solve(lobe, working, 1 / np.square(model))
        model = np.maximum(offset + lobe[:, None] * scale, smallest)
        return np.log(model / values), 1 / model, offset, scale


def _solve(lobe: Array, values: Array, weight: Array) -> tuple[Array, Array]:
    """Return weighted least-squares offset and scale ≥ 0 of each channel."""
    total = weight.sum(axis=0)
    centre = (weight * lobe[:, None]).sum(axis=0) / total
    mean = (weight * values).sum(axis=0) / total
    centred = lobe[:, None] - centre
    spread = (weight * np.square(centred)).sum(axis=0)
    shared = (weight * centred * (values - mean)).sum(axis=0)
    # A lobe points outwards: a negative scale would be a hole.
    scale = np.where(spread > 0, np.maximum(shared, 0) / np.where(spread > 0, spread, 1), 0)
    return mean - scale * centre, scale


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
