"""Everything that is fitted to one set of measurements: ranked, validated, judged."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from mdfconv.distributions import Distribution
from mdfconv.distributions.evaluation import Array
from mdfconv.errors import MdfconvError
from mdfconv.measured.brdf_fit import MeasuredFit, fit_distribution, refitted, refitted_as
from mdfconv.measured.checks import Check, Verdict, checks_of, verdict_of
from mdfconv.measured.model import (
    AUTO,
    DIELECTRIC,
    LOSSLESS,
    METAL,
    TWO_LOBES,
    BrdfModel,
    LobeShape,
    all_candidates,
    candidate,
)
from mdfconv.measured.samples import DirectionalSamples, Measurements, Samples, note_of, some_rows
from mdfconv.measured.scans import median, noise_of
from mdfconv.measured.validation import IncidenceFit, by_incidence, validated

# Beyond it the readings of goniometers fall off, and masking is large, degrees.
BRDF_LIMIT = 80.0
_HORIZON = 90.0
# To this limit fits are repeated, to see how far it moves them.
_NARROW_LIMIT = 60.0
_SHADOW = "samples are exactly 0, as in the shadow of the detector, and left out"
# No instrument sees so many decades: what is less, relatively, is computed.
_DARKEST = 1e-15
# A shape whose error is so many times the least cannot win, and is not validated.
_HOPELESS = 3.0
# A shape of more parameters whose error is not less by this is the simpler one again.
_SAME_SHAPE = 0.99
# Of a fit that leaves less, relatively, nothing is left for another one to explain.
_EXACT = 1e-6
# Candidates, and choices, are compared on so many samples at most.
_MOST_SAMPLES = 3_000
_SEED = 2


@dataclass(frozen=True)
class Choice:
    """The recommended fit under other options.

    Parameters
    ----------
    what : str
        The option that differs.
    fit : MeasuredFit
        The fit.
    """

    what: str
    fit: MeasuredFit


@dataclass(frozen=True)
class ChannelFits:
    """The fits to some channels of the measurements.

    Parameters
    ----------
    samples : Samples or DirectionalSamples
        The channels.
    fits : sequence of MeasuredFit
        The fits of distinct shapes, the least error at samples that were left out first.
    recommended : MeasuredFit
        The fit with the fewest parameters whose validated error is within one standard error of
        the best one's.
    """

    samples: Measurements
    fits: Sequence[MeasuredFit]
    recommended: MeasuredFit

    @cached_property
    def log_ratio(self) -> Array:
        """ln(fit/data) of the recommended fit, shape (n, channels); NaN where it does not exist."""
        near = self.recommended.model(self.samples)
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.log(near / self.samples.values)
        return np.where(np.isfinite(ratio), ratio, np.nan)

    @cached_property
    def noises(self) -> Array:
        """The relative standard deviation of each sample from its neighbours, shape (n,)."""
        return noise_of(self.samples, self.log_ratio)

    @property
    def noise(self) -> float:
        """The relative noise of most samples."""
        return median(self.noises)

    @cached_property
    def error(self) -> float:
        """The relative error: the robust root mean square of ln(fit/data)."""
        weight = np.where(np.isfinite(self.log_ratio), self.recommended.weights[:, None], 0)
        square = np.square(np.nan_to_num(self.log_ratio))
        return float(np.sqrt((weight * square).sum() / max(weight.sum(), 1e-300)))

    @cached_property
    def by_incidence(self) -> list[IncidenceFit]:
        """The recommended lobe of each angle of incidence alone; none of one angle."""
        return by_incidence(self.samples, self.recommended)

    @cached_property
    def choices(self) -> list[Choice]:
        """The recommended fit as it is, then under other losses, angles and models."""
        return [Choice("as recommended", self.recommended), *_choices(self)]

    @cached_property
    def verdict(self) -> Verdict:
        """How well the recommended fit describes the samples."""
        return verdict_of(
            self.samples,
            self.log_ratio,
            self.fits,
            self.recommended,
            error=self.error,
            noise=self.noises,
            weights=self.recommended.weights,
            checks=self.checks,
        )

    @cached_property
    def checks(self) -> list[Check]:
        """What can be wrong with the measurements, the model, or the numbers."""
        return checks_of(
            self.samples,
            self.log_ratio,
            self.recommended,
            error=self.error,
            noise=self.noises,
            weights=self.recommended.weights,
            by_incidence=self.by_incidence,
            freed=self.freed,
            aperture=self.recommended.options.aperture,
            left_out=[note for note in self.samples.notes if "left out" in note],
        )

    @cached_property
    def freed(self) -> MeasuredFit | None:
        """The recommended fit with k_s free; None where that means nothing."""
        fit = self.recommended
        if fit.fresnel in (None, LOSSLESS) or fit.options.free_specular:
            return None
        options = replace(fit.options, fresnel=fit.fresnel, free_specular=True)
        try:
            return refitted_as(_some(self.samples), fit, options, fit.fresnel)
        except MdfconvError:
            return None

    def records(self) -> list[dict[str, Any]]:
        """Return a record of each fit; verdict and checks are those of the recommended one."""
        checks = [{"name": c.name, "passed": c.passed, "text": c.text} for c in self.checks]
        judged = {"recommended": True, "verdict": self.verdict.grade, "checks": checks}
        other = {"recommended": False, "verdict": None, "checks": None}
        return [fit.record() | (judged if fit is self.recommended else other) for fit in self.fits]


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
    settings : BrdfModel
        The options.
    """

    name: str
    samples: Measurements
    results: list[ChannelFits]
    settings: BrdfModel

    @property
    def notes(self) -> tuple[str, ...]:
        """What was left out and assumed."""
        return self.samples.notes


def fit(
    samples: Measurements,
    targets: Sequence[str | Distribution | LobeShape] | None = None,
    *,
    gamma: float | None = None,
    quantity: str | None = None,
    max_angle: float | None = None,
    separate: bool = False,
    name: str = "samples",
    **options: Any,
) -> Analysis:
    """Fit distributions to measurements, and recommend one.

    Of one angle, that of the half vector, the model is offset + scale · D̄(β), divided by cos²β
    for a BRDF; of two directions it is k_d/π + k_s D G F / (4 cos θ_i cos θ_o), k_s = 1.

    Parameters
    ----------
    samples : Samples or DirectionalSamples
        The measurements, as `mdfconv.measured.read` returns them.
    targets : sequence of str or Distribution, optional
        The distributions to fit; if not given each shape once, and ``"ggx+ggx"``, the mixture of
        two GGX lobes.
    gamma : float, optional
        γ of those that have one; it is fitted if not given.
    quantity : str, optional
        ``"ndf"`` or ``"brdf"`` of one angle; as the samples say if not given.
    max_angle : float, optional
        The largest angle that is used, degrees: of two directions that of each of them, of one
        angle that from the normal to the half vector. If not given, 80 for a BRDF and 90 for a
        distribution of normals.
    separate : bool
        Whether each channel has parameters of its own.
    name : str
        What was measured, for messages.
    **options
        Those of `BrdfModel`: loss, masking, fresnel, free_specular, robust, aperture, noise, floor.

    Returns
    -------
    Analysis
        ``results`` has one `ChannelFits`, or one for each channel: its ``recommended`` fit (with
        ``parameter``, ``parameter_error``, ``f0``, ``n``, ``diffuse``), all ``fits``, the
        ``verdict``, the ``checks``, and ``records()`` for files.

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
    >>> best = analysis.results[0].recommended
    >>> best.name, round(best.parameter, 6)
    ('ggx', 0.25)
    """
    if max_angle is not None and not 0 < max_angle <= _HORIZON:
        raise MdfconvError(
            f"no angles up to {max_angle:g} degrees", "above 0 and at most 90", argument="max_angle"
        )
    model = BrdfModel(**options)
    if quantity is not None and isinstance(samples, DirectionalSamples):
        raise MdfconvError(
            f"{name}: values of two directions are a BRDF",
            "leave out the quantity",
            argument="quantity",
        )
    if samples.uncertainty is not None and (model.noise, model.floor) != (None, None):
        note = "the uncertainties of the file are not used: noise and floor are given"
        samples = replace(samples, notes=(*samples.notes, note))
    candidates = fitted_candidates(targets, gamma)
    used = _restricted(name, samples, quantity, max_angle)
    used = _positive(name, used, model)
    try:
        parts = _channels(used) if separate else [used]
        results = [_fitted(part, candidates, model, is_asked=bool(targets)) for part in parts]
    except MdfconvError as error:
        raise MdfconvError(f"{name}: {error}") from None
    return Analysis(name, used, results, model)


def _fitted(
    samples: Measurements, candidates: Sequence[LobeShape], model: BrdfModel, *, is_asked: bool
) -> ChannelFits:
    """Return the fits of all candidates that the samples are enough for.

    They compete on some of many samples; the recommended one is fitted to all.
    """
    some, patience = _some(samples), np.inf
    fits, errors = [], []
    for what in candidates:
        try:
            found = fit_distribution(some, what, model, patience=patience)
            fits.append(found)
            if not is_asked:
                patience = min(patience, _HOPELESS * found.error)
        except MdfconvError as error:
            errors.append(error)
            if is_asked:
                raise
    if not fits:
        raise errors[0]
    if not is_asked:
        fits = distinct(fits)
    limit = _HOPELESS * min(one.error for one in fits)
    fits = [one if one.error > limit and not is_asked else validated(some, one) for one in fits]
    chosen = recommended(fits)
    if some is not samples:
        whole = validated(samples, refitted(samples, chosen))
        # That of the same samples as the others'.
        whole = replace(
            whole,
            validated_error=chosen.validated_error,
            validated_spread=chosen.validated_spread,
        )
        fits = [whole if one is chosen else one for one in fits]
        chosen = whole
    return ChannelFits(samples, ranked(fits), chosen)


def distinct(fits: Sequence[MeasuredFit]) -> list[MeasuredFit]:
    """Return fits without those that are a simpler one again: γ = 2 is GGX, γ → ∞ Beckmann."""
    return [one for one in fits if not any(_is_again(one, other) for other in fits)]


def _is_again(one: MeasuredFit, other: MeasuredFit) -> bool:
    """Return whether a fit is a simpler one again."""
    if one.size <= other.size:
        return False
    if one.error > _SAME_SHAPE * other.error or other.log_rmse < _EXACT:
        return True
    if one.what.is_double and one.at_limit and one.distribution == other.distribution:
        # One lobe, and a share of what is hardly a lobe.
        return True
    second = one.distribution.second_parameter
    if second is None or second.default is None or one.gamma_error is None:
        return False
    equal = one.distribution.with_gamma(second.default).equivalent
    is_equal = equal is not None and equal.same_lobe and equal.name == other.name
    return is_equal and abs(one.distribution.gamma - second.default) <= one.gamma_error


def ranked(fits: Sequence[MeasuredFit]) -> list[MeasuredFit]:
    """Return fits by their error at samples that were left out, the smallest first."""
    return sorted(fits, key=_rank)


def _rank(fit: MeasuredFit) -> tuple[bool, float]:
    """Return what fits are ranked by: one that cannot be validated comes after all that can."""
    return bool(np.isnan(fit.validated_error)), fit.comparable_error


def recommended(fits: Sequence[MeasuredFit]) -> MeasuredFit:
    """Return the simplest fit whose validated error is within one standard error of the best.

    The simplest has the fewest parameters; of several those whose masking has a closed form, which
    renderers have, are simpler; of several still the one with the least error.
    """
    best = ranked(fits)[0]
    is_unknown, least = _rank(best)
    limit = is_unknown, least + np.nan_to_num(best.validated_spread)
    good = [fit for fit in fits if _rank(fit) <= limit]
    return min(good, key=lambda fit: (fit.size, not fit.distribution.smith, fit.comparable_error))


def fitted_candidates(
    targets: Sequence[str | Distribution | LobeShape] | None, gamma: float | None
) -> list[LobeShape]:
    """Return what is named, or all shapes; γ that is given applies to those that have one.

    Raises `MdfconvError` if γ is given and means nothing for those that are named.
    """
    named = [candidate(target) for target in targets or ()]
    chosen = named or all_candidates()
    if gamma is None:
        return chosen
    second = [what for what in chosen if what.distribution.second_parameter]
    if not second:
        raise MdfconvError(f"{chosen[0].name} has one parameter and no γ")
    illegal = [
        what
        for what in second
        if not what.distribution.second_parameter.accepts(np.asarray(gamma))  # type: ignore[union-attr]
    ]
    if illegal and (named or len(illegal) == len(second)):
        illegal[0].distribution.with_gamma(gamma)  # says what is legal
    return [
        candidate(what.distribution, gamma) if what.is_gamma_free else what
        for what in chosen
        if what not in illegal
    ]


def _choices(result: ChannelFits) -> list[Choice]:
    """Return the recommended fit under other options, on some of the samples if there are many."""
    fit, samples = result.recommended, _some(result.samples)
    options = replace(fit.options, fresnel=fit.fresnel or AUTO)
    trials: list[tuple[str, Measurements, dict[str, Any]]] = []
    if isinstance(samples, Samples):
        other = "linear" if options.loss == "log" else "log"
        trials.append((f"{other} loss", samples, {"loss": other}))
    else:
        for loss in ("log", "cube-root", "cosine"):
            if loss != options.loss:
                trials.append((f"{loss} loss", samples, {"loss": loss}))
        near = np.minimum(samples.incident[:, 2], samples.outgoing[:, 2])
        inner = samples.select(near >= np.cos(np.radians(_NARROW_LIMIT)))
        trials.append((f"angles up to {_NARROW_LIMIT:g}°", inner, {}))
        kinds = {DIELECTRIC: METAL, METAL: DIELECTRIC}
        if fit.fresnel in kinds:
            other = kinds[fit.fresnel]
            trials.append((f"F of a {other}", samples, {"fresnel": other}))
    choices = [Choice("k_s free", result.freed)] if result.freed else []
    for label, some, changes in trials:
        changed = replace(options, **changes)
        fresnel = fit.fresnel and changed.fresnel
        with suppress(MdfconvError):
            choices.append(Choice(label, refitted_as(some, fit, changed, fresnel)))
    double = candidate(TWO_LOBES)
    shapes = {"one lobe": candidate(double.distribution)} if fit.what.is_double else {}
    if not shapes and fit.distribution == double.distribution:
        shapes = {"two lobes": double}
    for label, what in shapes.items():
        with suppress(MdfconvError):
            choices.append(Choice(label, fit_distribution(samples, what, options)))
    return choices


def _some(samples: Measurements) -> Measurements:
    """Return some of the samples if there are many."""
    index = some_rows(np.random.default_rng(_SEED), len(samples.values), _MOST_SAMPLES)
    return samples if index is None else samples.select(index)


def _restricted(
    name: str, samples: Measurements, quantity: str | None, max_angle: float | None
) -> Measurements:
    """Return the samples up to the largest angle, and say what is left out."""
    notes = samples.notes
    if isinstance(samples, DirectionalSamples):
        limit = max_angle or BRDF_LIMIT
        lowest = np.minimum(samples.incident[:, 2], samples.outgoing[:, 2])
        keep = lowest >= np.cos(np.radians(limit)) * (1 - 1e-12)
    else:
        samples = replace(samples, quantity=quantity or samples.quantity)
        is_brdf = samples.quantity == "brdf"
        limit = max_angle or (BRDF_LIMIT if is_brdf else _HORIZON)
        keep = samples.beta <= np.radians(limit) * (1 + 1e-12)
        if is_brdf:
            notes = (*notes, "brdf: the lobe is D̄/cos²β at θ_d = 0; masking is left out")
    if not keep.any():
        raise MdfconvError(f"{name}: no samples up to {limit:g}°")
    notes += note_of(~keep, f"samples beyond {limit:g}° are left out")
    return replace(samples.select(keep), notes=notes)


def _positive(name: str, samples: Measurements, model: BrdfModel) -> Measurements:
    """Return the samples that are positive; those of a linear loss of one angle as they are.

    No surface scatters nothing: there a detector is in the way of the light, or sees its own noise.
    """
    notes, lowest = samples.notes, samples.values.min(axis=1)
    if model.deviations(samples) is not None and isinstance(samples, DirectionalSamples):
        # What is known to be noise is no bias.
        dark = lowest == 0
        notes += note_of(dark, _SHADOW)
        return replace(samples.select(~dark), notes=notes)
    if isinstance(samples, Samples) and model.loss != "log":
        notes += note_of(lowest < 0, "samples have a negative value and are fitted as they are")
        return replace(samples, notes=notes)
    if not (lowest > 0).any():
        empty = samples.values.max(axis=0) <= 0
        which = "in every channel"
        if empty.any() and not empty.all():
            which = f"in channel {samples.channels[int(np.argmax(empty))]}"
        reason = f"no sample is positive {which}: there is no lobe to fit"
        raise MdfconvError(f"{name}: {reason}")
    notes += note_of(lowest == 0, _SHADOW)
    notes += note_of(lowest < 0, "samples are negative and left out")
    dark = lowest <= _DARKEST * lowest.max()
    text = f"samples are less than {_DARKEST:g} of the largest and left out"
    notes += note_of(dark & (lowest > 0), text)
    return replace(samples.select(~dark), notes=notes)


def _channels(samples: Measurements) -> list[Measurements]:
    sigma = samples.uncertainty
    return [
        replace(
            samples,
            values=samples.values[:, [column]],
            channels=(name,),
            uncertainty=None if sigma is None else sigma[:, [column]],
        )
        for column, name in enumerate(samples.channels)
    ]
