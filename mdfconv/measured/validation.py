"""How far fits can be trusted: fits without an incidence, and of each incidence alone.

Residuals of a fit to a real surface are systematic, so that their number says little about the
error of an estimate. What does is how far it moves when an angle of incidence is left out.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from mdfconv.distributions.evaluation import Array, Indices
from mdfconv.errors import MdfconvError
from mdfconv.measured.brdf_fit import MeasuredFit, Minimum, Problem, checked, refitted_as
from mdfconv.measured.model import LOSSLESS, LobeShape, lobe_at
from mdfconv.measured.samples import DirectionalSamples, Measurements, some_rows
from mdfconv.measured.scans import incidence_groups, scan_order

# Samples of more are not refitted; folds of more incidences are of several.
_MOST_SAMPLES = 20_000
_MOST_FOLDS = 8
# Of one incidence: folds of blocks that follow each other.
_BLOCKS, _BLOCK_FOLDS = 25, 5
_STEPS = 8
# Of a parameter's errors less does not matter.
_SMALLEST_STEP = 1e-4
_SEED = 1


@dataclass(frozen=True)
class IncidenceFit:
    """The lobe of one angle of incidence alone.

    Parameters
    ----------
    angle : float
        The angle of incidence, degrees.
    count : int
        How many samples there are.
    parameter, parameter_error : float
        The distribution's own parameter and its standard error; NaN if it cannot be fitted.
    """

    angle: float
    count: int
    parameter: float
    parameter_error: float


def validated(samples: Measurements, fit: MeasuredFit) -> MeasuredFit:
    """Return a fit with its error at samples that were left out, and standard errors from it.

    One angle of incidence at a time is left out, of a single one every fifth block of a scan. The
    standard errors are those of the jackknife over the angles of incidence (Tukey 1958), or those
    of the residuals where they are larger.
    """
    whole = _problem(samples, fit)
    folds, are_incidences = _folds(whole.lobe.samples)
    everything, start = np.arange(whole.count), whole.at(fit)
    outcomes = []
    for fold in folds:
        rest = np.setdiff1d(everything, fold, assume_unique=True)
        try:
            checked(whole.lobe.part(rest))
        except MdfconvError:
            continue
        inside, outside = np.zeros(whole.count), whole.robust.copy()
        inside[fold], outside[fold] = whole.robust[fold], 0
        minimum = start.weighted(outside).descend(steps=_STEPS, smallest=_SMALLEST_STEP)
        outcomes.append((minimum, minimum.error_at(inside)))
    if len(outcomes) < 2:
        return fit
    errors = np.array([error for _, error in outcomes])
    unit = _unit(errors)
    mean = unit * float(np.sqrt(np.mean(np.square(errors / unit))))
    spread = unit * float(np.std(errors / unit, ddof=1) / np.sqrt(len(errors)))
    fit = replace(fit, validated_error=mean, validated_spread=spread)
    return _jackknifed(fit, [minimum for minimum, _ in outcomes]) if are_incidences else fit


def _problem(samples: Measurements, fit: MeasuredFit) -> Problem:
    """Return the problem of a fit, on some of the samples if there are many."""
    lobe = lobe_at(samples, fit.what, fit.options, fit.fresnel or LOSSLESS)
    index = some_rows(np.random.default_rng(_SEED), len(fit.weights), _MOST_SAMPLES)
    if index is None:
        return Problem(lobe, fit.weights)
    return Problem(lobe.part(index), fit.weights[index])


def _incidences(samples: Measurements) -> list[tuple[float, Indices]]:
    """Return the angles of incidence and the samples at each; none of one angle."""
    return incidence_groups(samples) if isinstance(samples, DirectionalSamples) else []


def _folds(samples: Measurements) -> tuple[list[Indices], bool]:
    """Return what is left out at a time, and whether it is an angle of incidence."""
    groups = [group for _, group in _incidences(samples)]
    if len(groups) > 1:
        ends = np.linspace(0, len(groups), min(len(groups), _MOST_FOLDS) + 1).astype(int)
        return [np.concatenate(groups[first:last]) for first, last in pairwise(ends)], True
    order = scan_order(samples)
    block = np.arange(len(order)) * min(_BLOCKS, len(order)) // len(order)
    folds = [order[block % _BLOCK_FOLDS == fold] for fold in range(_BLOCK_FOLDS)]
    return [fold for fold in folds if fold.size], False


def _unit(values: Array) -> float:
    """Return the largest of values, whose squares may be too large, for a unit."""
    return float(np.abs(values).max()) or 1.0


def _jackknifed(fit: MeasuredFit, minima: list[Minimum]) -> MeasuredFit:
    """Return a fit with standard errors from fits without an incidence each."""
    estimates = [minimum.ordered().estimates() for minimum in minima]
    count = len(minima)

    def deviation(values: list[Any]) -> Array:
        unit = _unit(np.array(values))
        return np.asarray(unit * np.sqrt((count - 1) * np.var(np.array(values) / unit, axis=0)))

    errors = {
        name: max(error, float(deviation([searched[name] for searched, _ in estimates])))
        for name, error in fit.errors.items()
    }
    linear = {
        name: tuple(np.maximum(error, deviation([all_[name] for _, all_ in estimates])).tolist())
        for name, error in fit.linear_errors.items()
    }
    return replace(fit, errors=errors, linear_errors=linear)


def by_incidence(samples: Measurements, fit: MeasuredFit) -> list[IncidenceFit]:
    """Return the lobe of each angle of incidence alone.

    γ and Fresnel's factor, which one angle does not tell, are those of the fit; the strength of
    the lobe and k_d are free.
    """
    what = fit.what if fit.what.is_double else LobeShape(fit.distribution)
    fresnel = LOSSLESS if fit.n is None else f"ior:{fit.n!r}"
    is_free = fresnel != LOSSLESS
    options = replace(fit.options, fresnel=fresnel, free_specular=is_free)
    alone = []
    random = np.random.default_rng(_SEED)
    for angle, group in _incidences(samples):
        index = some_rows(random, len(group), _MOST_SAMPLES)
        some = samples.select(group if index is None else group[index])
        try:
            one = refitted_as(some, fit, options, fresnel, what)
            numbers = one.parameter, one.parameter_error
        except MdfconvError:
            numbers = np.nan, np.nan
        alone.append(IncidenceFit(angle, len(group), *numbers))
    return alone
