"""Everything that is fitted to one set of measurements, ranked."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mdfconv.distributions import Distribution, distribution, one_parameter_distributions
from mdfconv.errors import MdfconvError
from mdfconv.measured.brdf_fit import BrdfModel, MeasuredFit, fit_distribution
from mdfconv.measured.samples import DirectionalSamples, Measurements, note_of

# Beyond it the masking that a slice at θ_d = 0 leaves out is large, degrees.
_BRDF_LIMIT = 80.0
_HORIZON = 90.0


@dataclass(frozen=True)
class ChannelFits:
    """The fits to some channels of the measurements.

    Parameters
    ----------
    samples : Samples or DirectionalSamples
        The channels.
    fits : list of MeasuredFit
        The fits, best first.
    simplest : MeasuredFit
        The simplest one that is nearly as good as the best.
    """

    samples: Measurements
    fits: Sequence[MeasuredFit]
    simplest: MeasuredFit

    def records(self) -> list[dict[str, Any]]:
        """Return a record of each fit."""
        return [fit.record() | {"simplest": fit is self.simplest} for fit in self.fits]


@dataclass(frozen=True)
class Analysis:
    """All fits to a set of measurements.

    Parameters
    ----------
    name : str
        What was measured.
    samples : Samples or DirectionalSamples
        Those that were used.
    results : list of ChannelFits
        One, or one for each channel.
    """

    name: str
    samples: Measurements
    results: list[ChannelFits]

    @property
    def notes(self) -> tuple[str, ...]:
        """What was left out and assumed, and what the fits do not tell."""
        texts = [
            note if fit.masking is None else f"{fit.distribution.name}: {note}"
            for result in self.results
            for fit in result.fits
            for note in fit.notes
        ]
        return (*self.samples.notes, *self._impossible, *dict.fromkeys(texts))

    @property
    def _impossible(self) -> Iterator[str]:
        """What no surface can be."""
        best = (result.fits[0] for result in self.results)
        largest = max(max(fit.linear.get("diffuse", (0.0,))) for fit in best)
        if largest > 1:
            yield (
                f"k_d {largest:.3g} is more light than falls on the surface: the values are not "
                "f_r in 1/sr but, for example, π f_r"
            )


def fit(
    samples: Measurements,
    targets: Sequence[str | Distribution] | None = None,
    *,
    gamma: float | None = None,
    loss: str = "linear",
    masking: str = "smith",
    fresnel: str = "none",
    robust: bool = False,
    quantity: str | None = None,
    max_angle: float | None = None,
    separate: bool = False,
    tolerance: float = 0.05,
    name: str = "samples",
) -> Analysis:
    """Fit distributions to measurements, and rank them.

    Of one angle, that of the half vector, the model is offset + scale · D̄(β), divided by cos²β
    for a BRDF; of two directions it is k_d/π + k_s D G F / (4 cos θ_i cos θ_o), and samples that
    are exactly 0 are left out.

    Parameters
    ----------
    samples : Samples or DirectionalSamples
        The measurements, as `mdfconv.measured.read` returns them.
    targets : sequence of str or Distribution, optional
        The distributions to fit; all if not given.
    gamma : float, optional
        γ of those that have one; it is fitted if not given.
    loss, masking, fresnel, robust
        As in `BrdfModel`; of one angle only the loss applies.
    quantity : str, optional
        ``"ndf"`` or ``"brdf"`` of one angle; as the samples say if not given.
    max_angle : float, optional
        The largest angle that is used, degrees: from the normal to the half vector, and of two
        directions to each of them. If not given, 80 for a BRDF of one angle, and all else.
    separate : bool
        Whether each channel has parameters of its own.
    tolerance : float
        How much worse than the best, relatively, the simplest good fit may be.
    name : str
        What was measured, for messages.

    Returns
    -------
    Analysis
        The fits, best first, with standard errors, and notes.

    Raises
    ------
    MdfconvError
        If an option is not known, no sample is left, or there is nothing to fit.

    Examples
    --------
    >>> import numpy as np
    >>> from mdfconv import distribution
    >>> from mdfconv.measured import Samples, fit
    >>> beta = np.radians(np.arange(0.0, 80.0, 2.0))
    >>> values = 0.1 + 3 * distribution("ggx").unit(beta, 0.25)
    >>> analysis = fit(Samples(beta, values[:, None], ("green",), "ndf"), ["beckmann", "ggx"])
    >>> best = analysis.results[0].fits[0]
    >>> best.distribution.name, round(best.parameter, 6)
    ('ggx', 0.25)
    """
    if not tolerance >= 0:
        raise MdfconvError(
            f"a tolerance of {tolerance:g} is negative", "give 0 or more", argument="tolerance"
        )
    if max_angle is not None and not 0 < max_angle <= _HORIZON:
        raise MdfconvError(
            f"no angles up to {max_angle:g} degrees", "above 0 and at most 90", argument="max_angle"
        )
    model = BrdfModel(loss, masking, fresnel, robust)
    distributions = fitted_distributions(targets, gamma)
    used = _without_shadow(_restricted(name, samples, quantity, max_angle), loss)
    results = []
    try:
        for part in _channels(used) if separate else [used]:
            fits = rank([fit_distribution(part, mdf, model, gamma=gamma) for mdf in distributions])
            results.append(ChannelFits(part, fits, simplest(fits, tolerance)))
    except MdfconvError as error:
        raise MdfconvError(f"{name}: {error}") from None
    return Analysis(name, used, results)


def rank(fits: Sequence[MeasuredFit]) -> list[MeasuredFit]:
    """Return fits by their error, the smallest first."""
    return sorted(fits, key=lambda fit: fit.error)


def simplest(fits: Sequence[MeasuredFit], tolerance: float) -> MeasuredFit:
    """Return the cheapest of fits whose error is within a relative tolerance of the best.

    Cheapest has the fewest parameters, then the fewest operations per evaluation.
    """
    best = min(fit.error for fit in fits)
    good = [fit for fit in fits if fit.error <= (1 + tolerance) * best]
    return min(good, key=lambda fit: (len(fit.parameters), fit.distribution.operations))


def fitted_distributions(
    targets: Sequence[str | Distribution] | None, gamma: float | None
) -> list[Distribution]:
    """Return the distributions that are named, or all those that a given γ leaves legal.

    Raises `MdfconvError` if γ is given and means nothing for those that are named.
    """
    named = [distribution(mdf) if isinstance(mdf, str) else mdf for mdf in targets or ()]
    chosen = named or one_parameter_distributions()
    if gamma is None:
        return chosen
    second = {mdf: mdf.second_parameter for mdf in chosen if mdf.second_parameter}
    if not second:
        raise MdfconvError(f"{chosen[0].name} has one parameter and no γ")
    illegal = [mdf for mdf, range_ in second.items() if not range_.accepts(np.asarray(gamma))]
    if illegal and (named or len(illegal) == len(second)):
        illegal[0].with_gamma(gamma)  # says what is legal
    return [mdf for mdf in chosen if mdf not in illegal]


def _restricted(
    name: str, samples: Measurements, quantity: str | None, max_angle: float | None
) -> Measurements:
    """Return the samples up to the largest angle, and say what is left out."""
    notes = samples.notes
    if isinstance(samples, DirectionalSamples):
        limit = max_angle or _HORIZON
        lowest = np.minimum(samples.incident[:, 2], samples.outgoing[:, 2])
        keep = lowest >= np.cos(np.radians(limit)) * (1 - 1e-12)
    else:
        samples = replace(samples, quantity=quantity or samples.quantity)
        is_brdf = samples.quantity == "brdf"
        limit = max_angle or (_BRDF_LIMIT if is_brdf else _HORIZON)
        keep = samples.beta <= np.radians(limit) * (1 + 1e-12)
        if is_brdf:
            notes = (*notes, "brdf: the lobe is D̄/cos²β at θ_d = 0; masking is left out")
    if not keep.any():
        raise MdfconvError(f"{name}: no samples up to {limit:g}°")
    notes += note_of(~keep, f"samples beyond {limit:g}° are left out")
    return replace(samples.select(keep), notes=notes)


def _without_shadow(samples: Measurements, loss: str) -> Measurements:
    """Return the samples of two directions that are not 0; say so, and how others are taken.

    No surface scatters exactly nothing: there the detector is in the way of the light.
    """
    notes = samples.notes
    if isinstance(samples, DirectionalSamples) and samples.values.any():
        dark = np.abs(samples.values).max(axis=1) == 0
        text = "samples are exactly 0, as in the shadow of the detector, and left out"
        notes += note_of(dark, text)
        samples = samples.select(~dark)
    lowest = samples.values.min(axis=1)
    if loss == "log":
        text = "samples have a value of 0 or less, which has no logarithm, and are left out"
        notes += note_of(lowest <= 0, text)
    else:
        notes += note_of(lowest < 0, "samples have a negative value and are fitted as they are")
    return replace(samples, notes=notes)


def _channels(samples: Measurements) -> list[Measurements]:
    return [
        replace(samples, values=samples.values[:, column : column + 1], channels=(name,))
        for column, name in enumerate(samples.channels)
    ]
