"""Fits of offset + scale · D̄(β; p) to samples, offset and scale eliminated.

For given p the model is linear in the offset and scale of every channel, so they are solved
for and only p is searched (`mdfconv.measured.projection`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from mdfconv.distributions import Distribution
from mdfconv.distributions.evaluation import Array
from mdfconv.errors import MdfconvError
from mdfconv.measured.projection import Projection, log_rmse, model, standard_deviations
from mdfconv.measured.samples import Samples
from mdfconv.registry import unknown_name

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
    error : float
        The one of the two that the loss minimizes.
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
    error: float
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
    problem = _SliceProblem(data, target, loss, gamma)
    solutions = [problem.refine(start) for start in problem.starts()]
    _, point = min(solutions, key=lambda solution: solution[0])
    return problem.report(point)


class _SliceProblem:
    """The projected problem: residuals and slopes in the logarithms of p (and γ)."""

    def __init__(self, data: Samples, target: Distribution, loss: str, gamma: float | None) -> None:
        if loss not in LOSSES:
            raise unknown_name("loss", loss, LOSSES)
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
        self._projection = Projection(self._values, log=self._log)
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
            return [half_width_logarithms(self._target, tangents)[:, None]]
        points = []
        for gamma in np.geomspace(*self._gamma_range, _GAMMAS):
            target = self._target.with_gamma(float(gamma))
            first = half_width_logarithms(target, tangents)
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
            [
                np.sum(np.square(self._projection(self._lobes(some))[0]), axis=(1, 2))
                for some in blocks
            ]
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
        return self._projection(self._lobe(point))[0].ravel()

    def slope(self, point: Array) -> Array:
        """Return ∂residual/∂point with the linear part projected out."""
        return self._projection.slope(self._lobe(point), self._lobe_slopes(point))

    def report(self, point: Array) -> LobeFit:
        """Return the fit at a point, with standard errors from the full Jacobian."""
        lobe, slopes = self._lobe(point), self._lobe_slopes(point)
        residual, gain, offset, scale = self._projection(lobe)
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
        spread = np.sqrt(cost / (residual.size - unknowns)) * standard_deviations(flat)
        distribution, parameters = self._at(point), np.exp(point)
        if self._gamma_range:
            parameters[1] = distribution.gamma
        likelihood = residual.size * np.log(max(cost, np.finfo(float).tiny) / residual.size)
        if not self._log:
            likelihood += 2 * residual.size * np.log(self._unit)
        near = model(lobe, offset, scale)
        rmse = self._unit * float(np.sqrt(np.mean(np.square(near - self._values))))
        of_logarithms = log_rmse(near, self._values)
        return LobeFit(
            distribution=distribution,
            parameters=tuple(parameters.tolist()),
            errors=tuple((parameters * spread[: point.size]).tolist()),
            offset=tuple((self._unit * offset).tolist()),
            scale=tuple((self._unit * scale).tolist()),
            rmse=rmse,
            log_rmse=of_logarithms,
            error=of_logarithms if self._log else rmse,
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


def half_width_logarithms(target: Distribution, tangents: Array) -> Array:
    """Return the logarithms of the parameters for half widths, ascending, of those that exist.

    Raises
    ------
    MdfconvError
        If none does.
    """
    parameters = target.from_half_tangent(tangents)
    existing = np.sort(parameters[np.isfinite(parameters)])
    if not existing.size:
        raise MdfconvError(
            f"{target.name} of γ = {target.gamma:g} has no lobe whose half width can be measured"
        )
    logarithms: Array = np.log(existing)
    return logarithms
