"""Everything that is fitted to one file of measurements."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Protocol, TypeAlias, TypeVar

import numpy as np

from mdfconv.distributions import Distribution
from mdfconv.errors import MdfconvError
from mdfconv.measured.brdf_fit import BrdfFit, BrdfModel, fit_brdf
from mdfconv.measured.lobe_fit import LOSSES, LobeFit, fit_lobe
from mdfconv.measured.samples import DirectionalSamples, Samples


class RankedFit(Protocol):
    """A fit whose error compares with that of others to the same samples."""

    @property
    def distribution(self) -> Distribution:
        """The distribution."""

    @property
    def parameters(self) -> Any:
        """What was fitted of it: as many as there are."""

    @property
    def error(self) -> float:
        """Root mean square of the loss's residuals."""


Fit = TypeVar("Fit", bound=RankedFit)


def rank(fits: Sequence[Fit]) -> list[Fit]:
    """Return fits by their error, the smallest first."""
    return sorted(fits, key=lambda fit: fit.error)


def simplest(fits: Sequence[Fit], tolerance: float) -> Fit:
    """Return the cheapest of fits whose error is within a relative tolerance of the best.

    Cheapest has the fewest parameters, then the fewest operations per evaluation.
    """
    best = min(fit.error for fit in fits)
    good = [fit for fit in fits if fit.error <= (1 + tolerance) * best]
    return min(good, key=lambda fit: (len(fit.parameters), fit.distribution.operations))


Measurements: TypeAlias = Samples | DirectionalSamples
# Beyond it the masking that a slice at θ_d = 0 leaves out is large, degrees.
_BRDF_LIMIT = 80.0


@dataclass(frozen=True)
class FitOptions:
    """What is fitted, and how.

    Parameters
    ----------
    targets : tuple of Distribution
        The distributions.
    gamma : float or None
        γ of those that have one; None to fit it.
    model : BrdfModel
        Loss, masking and Fresnel factor; of one angle only the loss applies.
    quantity : str or None
        ``"ndf"`` or ``"brdf"`` of one angle; None as the file says.
    max_angle : float or None
        The largest angle that is used, degrees: from the normal to the half vector, and of two
        directions to each of them. None is 80 for a BRDF of one angle, and all else.
    separate : bool
        Whether each channel has parameters of its own.
    tolerance : float
        How much worse than the best, relatively, the simplest good fit may be.
    """

    targets: tuple[Distribution, ...]
    gamma: float | None = None
    model: BrdfModel = field(default_factory=BrdfModel)
    quantity: str | None = None
    max_angle: float | None = None
    separate: bool = False
    tolerance: float = 0.05

    def __post_init__(self) -> None:
        if not self.tolerance >= 0:
            raise MdfconvError("--tolerance is not negative")
        if self.max_angle is not None and not 0 < self.max_angle <= 90:
            raise MdfconvError("--max-angle is above 0 and at most 90 degrees")


@dataclass(frozen=True)
class Result:
    """The fits to some channels of a file.

    Parameters
    ----------
    samples : Samples or DirectionalSamples
        The channels.
    fits : list of LobeFit or BrdfFit
        The fits, best first.
    simplest : LobeFit or BrdfFit
        The simplest one that is nearly as good as the best.
    """

    samples: Measurements
    fits: Sequence[LobeFit | BrdfFit]
    simplest: LobeFit | BrdfFit

    def records(self) -> list[dict[str, Any]]:
        """Return a record of each fit."""
        return [_record(fit) | {"simplest": fit is self.simplest} for fit in self.fits]


@dataclass(frozen=True)
class Analysis:
    """All fits to one file.

    Parameters
    ----------
    name : str
        The file's.
    samples : Samples or DirectionalSamples
        Those that were used.
    results : list of Result
        One, or one for each channel.
    """

    name: str
    samples: Measurements
    results: list[Result]

    @property
    def notes(self) -> tuple[str, ...]:
        """What was left out and assumed, and what the fits do not tell."""
        fits = [fit for result in self.results for fit in result.fits]
        limited = dict.fromkeys(
            fit.distribution.name for fit in fits if isinstance(fit, LobeFit) and fit.at_limit
        )
        texts = [f"γ of {name} is at the end of the range that is searched" for name in limited]
        for fit in fits:
            if isinstance(fit, BrdfFit):
                texts += [f"{fit.distribution.name}: {note}" for note in fit.notes]
        return (*self.samples.notes, *dict.fromkeys(texts))


def analyse(name: str, samples: Measurements, options: FitOptions) -> Analysis:
    """Fit distributions to the measurements of a file.

    Parameters
    ----------
    name : str
        The file's, for messages.
    samples : Samples or DirectionalSamples
        What it holds.
    options : FitOptions
        What is fitted.

    Raises
    ------
    MdfconvError
        If no sample is left, or a fit finds nothing.
    """
    used = _restricted(name, samples, options)
    parts = _channels(used) if options.separate else [used]
    try:
        results = [_result(part, options) for part in parts]
    except MdfconvError as error:
        raise MdfconvError(f"{name}: {error}") from None
    return Analysis(name, used, results)


def _result(samples: Measurements, options: FitOptions) -> Result:
    fits: list[LobeFit] | list[BrdfFit]
    if isinstance(samples, DirectionalSamples):
        fits = rank(
            [
                fit_brdf(samples, target, options.model, gamma=options.gamma)
                for target in options.targets
            ]
        )
        return Result(samples, fits, simplest(fits, options.tolerance))
    if options.model.loss not in LOSSES:
        raise MdfconvError(
            f"the {options.model.loss} loss needs two directions", f"known: {', '.join(LOSSES)}"
        )
    fits = rank(
        [
            fit_lobe(samples, target, options.model.loss, gamma=options.gamma)
            for target in options.targets
        ]
    )
    return Result(samples, fits, simplest(fits, options.tolerance))


def _restricted(name: str, samples: Measurements, options: FitOptions) -> Measurements:
    """Return the samples up to the largest angle, and say what is left out."""
    notes: tuple[str, ...] = samples.notes
    if isinstance(samples, DirectionalSamples):
        limit = options.max_angle or 90.0
        lowest = np.minimum(samples.incident[:, 2], samples.outgoing[:, 2])
        keep = lowest >= np.cos(np.radians(limit)) * (1 - 1e-12)
    else:
        kind = options.quantity or samples.quantity
        samples = replace(samples, quantity=kind)
        limit = options.max_angle or (_BRDF_LIMIT if kind == "brdf" else 90.0)
        keep = samples.beta <= np.radians(limit) * (1 + 1e-12)
        if kind == "brdf":
            notes = (*notes, "brdf: the lobe is D̄/cos²β at θ_d = 0; masking is left out")
    if not keep.any():
        raise MdfconvError(f"{name}: no samples up to {limit:g}°")
    if not keep.all():
        count = int(np.count_nonzero(~keep))
        notes = (*notes, f"{count} of {keep.size} samples beyond {limit:g}° are left out")
    if isinstance(samples, DirectionalSamples):
        return replace(
            samples,
            incident=samples.incident[keep],
            outgoing=samples.outgoing[keep],
            values=samples.values[keep],
            notes=notes,
        )
    return replace(samples, beta=samples.beta[keep], values=samples.values[keep], notes=notes)


def _channels(samples: Measurements) -> list[Measurements]:
    return [
        replace(samples, values=samples.values[:, place : place + 1], channels=(name,))
        for place, name in enumerate(samples.channels)
    ]


def _record(fit: LobeFit | BrdfFit) -> dict[str, Any]:
    if isinstance(fit, LobeFit):
        free = len(fit.parameters) > 1
        return {
            "distribution": fit.distribution.name,
            "parameter": fit.parameters[0],
            "gamma": fit.parameters[1] if free else fit.distribution.gamma,
            "stderr": fit.errors[0],
            "gamma_stderr": fit.errors[1] if free else None,
            "offset": list(fit.offset),
            "scale": list(fit.scale),
            "rmse": fit.rmse,
            "log_rmse": fit.log_rmse,
            "aic": fit.aic,
            "bic": fit.bic,
        }
    first = fit.distribution.parameter.name
    return {
        "distribution": fit.distribution.name,
        "parameter": fit.parameters[first],
        "gamma": fit.parameters.get("gamma", fit.distribution.gamma),
        "stderr": fit.errors[first],
        "gamma_stderr": fit.errors.get("gamma"),
        "reflectance": fit.parameters.get("reflectance"),
        "reflectance_stderr": fit.errors.get("reflectance"),
        "diffuse": list(fit.diffuse),
        "specular": list(fit.specular),
        "diffuse_stderr": list(fit.diffuse_errors),
        "specular_stderr": list(fit.specular_errors),
        "rmse": fit.rmse,
        "log_rmse": fit.log_rmse,
        "error": fit.error,
        "aic": fit.aic,
        "bic": fit.bic,
        "masking": fit.masking,
        "notes": list(fit.notes),
    }
