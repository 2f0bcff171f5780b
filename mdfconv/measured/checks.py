"""What a careful reader of a fit asks: how good is it, where does it fail, can its numbers be true.

Pure functions of samples and fits. A `Verdict` is one sentence on a fit, a `Check` one on
something that can be wrong with the measurements, the model, or the numbers.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from mdfconv.brdf.fresnel import dielectric_index
from mdfconv.brdf.microfacet import dot, mirrored, polar_angle
from mdfconv.distributions.evaluation import Array, Indices
from mdfconv.measured.samples import DirectionalSamples, Measurements
from mdfconv.measured.scans import brightness, incidence_groups, median
from mdfconv.output.records import percent

if TYPE_CHECKING:
    from mdfconv.measured.brdf_fit import MeasuredFit
    from mdfconv.measured.validation import IncidenceFit

# Of relative errors: at most so much is good, usable.
_GOOD, _USABLE = 0.05, 0.2
# Of a misfit no larger than this it does not matter where it is.
_WORTH_A_WORD = 0.02
# Bright samples that scatter more tell too little for a good fit.
_GOOD_NOISE = 0.1
# The share of the error that two lobes, or a free k_s, have to save before they are spoken of; and
# the ratio of two lobes that are a core and tails.
_GAIN, _TAILS = 0.2, 3.0
# A free k_s gains nothing if so much of the error is left, and little if it explains less error.
_NO_GAIN, _SMALL_GAIN = 0.95, 0.03
# Of an exact fit, that ratios have one.
_LEAST_ERROR = 1e-150
# Where residuals are looked at, in degrees: of angles, and of distances from the mirror direction.
_ANGLE_STEPS = np.arange(5.0, 90.0, 5.0)
_MIRROR_STEPS = np.array([1.0, 2.0, 5.0, 10.0, 20.0, 30.0, 45.0])
# A part of the samples is worth a word if it is so large, and no larger, and if so much of the sum
# of squares is more than it would have with the mean square of the others, which it exceeds so far.
_PART = (0.03, 0.4)
_EXCESS, _TIMES = 0.3, 2.0

# More reasons than this no one reads; the checks have them.
_MOST_REASONS = 2

# Least k_d of what is called a base, and of a bright one.
_BASE, _BRIGHT = 0.005, 0.1
# F₀ of a metal is not less, that of a dielectric not more, and n of usual ones between these.
_LEAST_METAL, _MOST_DIELECTRIC = 0.3, 0.1
_USUAL_INDICES = (1.3, 1.9)
# More light than that along the normal is not an error of calibration.
_IMPOSSIBLE = 1.1
# Fewer samples for each unknown say little of their errors; of values that the noise makes negative
# so many say that the diffuse part is of its size.
_LEAST_SAMPLES, _MOST_NEGATIVE = 3, 0.02
# α up to which a lobe is called glossy.
_GLOSSY = 0.15
# Values of channels that differ so much, relatively, are a colour.
_COLOR = 0.2
# Angles at which the albedo is asked for, degrees.
_ALBEDO_ANGLES = (0.0, 45.0, 75.0)
# A lobe is resolved by so many steps, and so many apertures, in its full width at half maximum.
_LEAST_STEPS, _LEAST_APERTURES = 4.0, 3.0
# One parameter stands for all angles of incidence if those of each differ no more.
_DRIFT = 0.2
# It rises or falls if so much of the difference is that of the first and the last.
_TREND = 0.8
# And no step goes the other way by so much of it.
_AGAINST = 0.25
_CORRELATED = 0.95
# Incidences from here on tell mirror direction and light apart, degrees.
_OBLIQUE = 15.0
# A side is the brighter one by such a ratio of medians.
_BRIGHTER = 1.3
# Directions nearer than this are one, degrees.
_SAME_DIRECTION = 0.01
# Outliers have robust weights less than this and residuals beyond so many times the noise; so large
# a share of them is a misfit.
_OUTLYING, _BEYOND_NOISE, _MANY_OUTLIERS = 0.5, 5.0, 0.05
# k_s is π if it is as near, relatively.
_NEAR_PI = 0.1


@dataclass(frozen=True)
class Verdict:
    """How well a fit describes the measurements.

    Parameters
    ----------
    grade : str
        ``"good"``: the error is at most 5 %, ``"usable"``: 20 %, beyond twice the noise of each
        sample, of which bright ones may have 10 %. ``"poor"``.
    sentence : str
        What kind of surface it is, how large error and noise are, and where the fit fails.
    """

    grade: str
    sentence: str


@dataclass(frozen=True)
class Check:
    """Something that can be wrong, checked.

    Parameters
    ----------
    name : str
        What is checked, in one or two words.
    passed : bool or None
        None of what is neither right nor wrong.
    text : str
        The result with its numbers, and of a failure its likely cause.
    argument : str
        The name of the argument that may make it right, if there is one: the command line adds
        the option of that name.
    """

    name: str
    passed: bool | None
    text: str
    argument: str = ""


def verdict_of(
    samples: Measurements,
    log_ratio: Array,
    fits: Sequence[MeasuredFit],
    fit: MeasuredFit,
    *,
    error: float,
    noise: Array,
    weights: Array,
    checks: Sequence[Check] = (),
) -> Verdict:
    """Return what a fit is worth, and why.

    Parameters
    ----------
    samples : Samples or DirectionalSamples
        Those that were used.
    log_ratio : numpy.ndarray, shape (n, channels)
        ln(fit/data) of the recommended fit.
    fits : sequence of MeasuredFit
        All candidates.
    fit : MeasuredFit
        The recommended one.
    error : float
        The relative root mean square error of the fit.
    noise : numpy.ndarray, shape (n,)
        The relative noise of the samples, as `noise_of` returns it.
    weights : numpy.ndarray, shape (n,)
        The robust weights of the samples.
    checks : sequence of Check
        What `checks_of` found: more light than falls on a surface is never good.
    """
    failed = {check.name: check.text for check in checks if check.passed is False}
    square = _misfit(samples, log_ratio, noise, weights)
    misfit = min(error, float(np.sqrt(square.sum() / weights.sum())))
    reasons = ["More light leaves it than falls on it." if "energy" in failed else ""]
    if misfit > _GOOD or fit.second is not None:
        reasons.append(_two_lobes(fits, fit, error))
    if misfit > _GOOD:
        reasons.append(failed.get("incidences", ""))
    if error > _GOOD and misfit < 0.5 * error:
        reasons.append(
            f"Much of it is noise of dark samples; without it the error is {percent(misfit)}."
        )
    if misfit > _WORTH_A_WORD:
        reasons.append(_where_it_fails(samples, square))
    typical = median(noise)
    size = f"an RMS error of {percent(error)} ({len(samples.values)} samples"
    size += f", noise {percent(typical)})" if np.isfinite(typical) else ")"
    lobe, is_single = _described(fit), fit.second is None
    impossible = failed.get("energy", "") if "energy" in failed and _is_impossible(fit) else ""
    if impossible:
        grade = "poor"
        start = f"No surface reflects so much: {impossible} The fit by {lobe} has {size}."
        reasons[0] = ""
    elif misfit <= _USABLE:
        is_good = misfit <= _GOOD and not reasons[0] and "samples" not in failed
        grade = "good" if is_good else "usable"
        start = f"{_surface(fit)}, described by {lobe} with {size}."
    else:
        grade = "poor"
        what = "this surface" if isinstance(samples, DirectionalSamples) else "these values"
        start = f"{'No single lobe describes' if is_single else 'Two lobes do not describe'} {what}"
        start += f": {lobe} {'leaves' if is_single else 'leave'} {size}."
    return Verdict(grade, " ".join([start, *list(filter(None, reasons))[:_MOST_REASONS]]))


def _is_impossible(fit: MeasuredFit) -> bool:
    """Return whether a surface reflects more than it receives even along the normal."""
    return float(np.max(fit.albedo(0.0))) > _IMPOSSIBLE


def _misfit(samples: Measurements, log_ratio: Array, noise: Array, weights: Array) -> Array:
    """Return the weighted squares of what the fit leaves beyond twice the noise, shape (n,).

    Dark samples may have much noise, which excuses residuals; bright ones may not.
    """
    known = np.isfinite(log_ratio).all(axis=1)
    square = np.mean(np.square(log_ratio), axis=1)
    bright = brightness(samples, log_ratio)
    if median(noise[bright >= median(bright)]) <= _GOOD_NOISE:
        square = np.maximum(square - np.square(2 * noise), 0)
    return np.where(known, weights * square, 0)


def _surface(fit: MeasuredFit) -> str:
    """Return what kind of surface a fit describes."""
    if fit.fresnel in (None, "none") or fit.f0 is None or fit.diffuse is None:
        return "Values"
    strength, base = float(np.mean(fit.f0)), float(np.mean(fit.diffuse))
    gloss = "glossy" if fit.distribution.peak_alpha(fit.parameter) <= _GLOSSY else "rough"
    if strength >= _LEAST_METAL:
        kind = f"A {gloss}{', coloured' if _is_colored(fit.f0) else ''} metal"
    elif strength >= _MOST_DIELECTRIC:
        kind = f"A {gloss} surface of reflectance F₀ = {strength:.2g}"
    else:
        kind = f"A {'dark, ' if _BASE <= base < _BRIGHT else ''}{gloss} dielectric"
        kind += " without a diffuse base" if base < _BASE else ""
    if base >= _BRIGHT:
        kind += f" over a {'coloured' if _is_colored(fit.diffuse) else 'diffuse'} base"
    return kind


def _is_colored(values: Sequence[float]) -> bool:
    return bool(np.ptp(values) > _COLOR * np.mean(values))


def _described(fit: MeasuredFit) -> str:
    """Return what a fit is called, with its γ, or how two lobes differ."""
    if fit.second is None or fit.share is None:
        return fit.label if fit.gamma is None else f"{fit.label} (γ = {fit.gamma:.3g})"
    shape = ", a narrow core with long tails" if fit.second > _TAILS * fit.parameter else ""
    symbol, share = fit.distribution.parameter.symbol, 100 * fit.share
    lobes = f"{symbol} = {fit.parameter:.2g} and {fit.second:.2g}, {share:.0f}:{100 - share:.0f}"
    return f"{fit.label}{shape} ({lobes}),"


def _two_lobes(fits: Sequence[MeasuredFit], fit: MeasuredFit, error: float) -> str:
    """Return what two lobes gain over the best single one; "" if that is little."""
    singles = [one for one in fits if one.second is None]
    doubles = [one for one in fits if one.second is not None]
    if not singles or not doubles:
        return ""
    single, double = (min(group, key=lambda one: one.error) for group in (singles, doubles))
    single = single if fit.second is not None else fit
    gain = double.error / max(single.error, _LEAST_ERROR)
    if gain > 1 - _GAIN:
        return ""
    if fit.second is not None:
        alone = percent(error / max(gain, _LEAST_ERROR))
        return f"The best single lobe, {single.label}, leaves {alone}."
    verb = "halve" if 0.4 <= gain <= 0.6 else "reduce"
    text = f"{_described(double)} would {verb} the error to {percent(gain * error)}."
    return text[0].upper() + text[1:]


def _where_it_fails(samples: Measurements, square: Array) -> str:
    """Return where squared misfits are much larger than elsewhere; "" if nowhere.

    Of all steps the one that best splits the squares in two (Breiman et al. 1984).
    """
    total, count = square.sum(), square.size
    best, where = 0.0, ""
    for coordinate, steps, names in _coordinates(samples):
        # Samples and squares below each step, all steps at once.
        place = np.searchsorted(steps, coordinate, side="right")
        below = np.bincount(place, minlength=steps.size + 1)[:-1].cumsum()
        squares = np.bincount(place, square, minlength=steps.size + 1)[:-1].cumsum()
        sides = (below, squares), (count - below, total - squares)
        for name, (inside, part), is_below in zip(names, sides, (True, False), strict=True):
            mean = part / np.maximum(inside, 1)
            others = (total - part) / np.maximum(count - inside, 1)
            is_part = (inside >= max(3, _PART[0] * count)) & (inside <= _PART[1] * count)
            is_large = (mean > _TIMES * others) & (part - inside * others > _EXCESS * total)
            split = inside * (count - inside) * np.square(mean - others)
            split = np.where(is_part & is_large, split, 0)
            index = int(np.argmax(split))
            if split[index] <= best:
                continue
            is_inside = (place <= index) == is_below
            # Not an outlier or two.
            if np.median(square[is_inside]) > np.median(square[~is_inside]):
                best, size = split[index], percent(np.sqrt(mean[index]))
                where = f"The misfit is largest {name.format(steps[index])}: {size}."
    return where


def _coordinates(samples: Measurements) -> Iterator[tuple[Array, Array, tuple[str, ...]]]:
    """Yield angles of samples, degrees, with steps, and the names of what is below and above."""
    ends = "at {} < {{:g}}°", "at {} ≥ {{:g}}°"
    if not isinstance(samples, DirectionalSamples):
        yield np.degrees(samples.beta), _ANGLE_STEPS, tuple(end.format("β") for end in ends)
        return
    for name, vectors in (("θ_i", samples.incident), ("θ_o", samples.outgoing)):
        names = tuple(end.format(name) for end in ends)
        yield np.degrees(polar_angle(vectors)), _ANGLE_STEPS, names
    names = "within {:g}° of the mirror direction", "beyond {:g}° from the mirror direction"
    from_mirror = _between(samples.outgoing, mirrored(samples.incident))
    yield np.degrees(from_mirror), _MIRROR_STEPS, names


def _between(first: Array, second: Array) -> Array:
    """Return the angles between unit vectors, radians, accurate for small ones."""
    return 2 * np.arcsin(np.minimum(0.5 * np.linalg.norm(first - second, axis=-1), 1))


def checks_of(
    samples: Measurements,
    log_ratio: Array,
    fit: MeasuredFit,
    *,
    error: float,
    noise: Array,
    weights: Array,
    by_incidence: Sequence[IncidenceFit] = (),
    freed: MeasuredFit | None = None,
    aperture: float | None = None,
    left_out: Sequence[str] = (),
) -> list[Check]:
    """Return what can be wrong with measurements and their fit, checked.

    Parameters
    ----------
    samples : Samples or DirectionalSamples
        Those that were used.
    log_ratio : numpy.ndarray, shape (n, channels)
        ln(fit/data).
    fit : MeasuredFit
        The recommended fit.
    error : float
        Its relative root mean square error.
    noise : numpy.ndarray, shape (n,)
        The relative noise of the samples, as `noise_of` returns it.
    weights : numpy.ndarray, shape (n,)
        The robust weights of the samples.
    by_incidence : sequence of IncidenceFit
        The fits to each angle of incidence alone.
    freed : MeasuredFit, optional
        The same fit with k_s free.
    aperture : float, optional
        The full angle of the detector's aperture, degrees.
    left_out : sequence of str
        What was left out of the measurements.

    Returns
    -------
    list of Check
        Those that apply.
    """
    checks: list[Check | None] = []
    peaks: list[tuple[float, float]] = []
    if isinstance(samples, DirectionalSamples):
        groups = incidence_groups(samples)
        checks += [_energy(fit, groups[-1][0]), _reflectance(fit, error)]
        checks.append(_mirror_side(samples, groups))
        peaks = [_peak(samples.select(index)) for _, index in groups]
    checks += [
        _resolution(samples, fit, peaks, aperture, error),
        _one_parameter(fit, by_incidence),
        _ranges(fit),
        _correlation(fit),
        _strength(fit, freed, error),
        _outliers(weights, np.abs(log_ratio).max(axis=1) > _BEYOND_NOISE * noise),
        _number_of_samples(samples, fit),
        _left_out(left_out),
    ]
    return [check for check in checks if check is not None]


def _energy(fit: MeasuredFit, largest: float) -> Check:
    """Check that no more light leaves the surface than falls on it.

    Up to the largest angle of incidence, degrees, the fit is of measurements.
    """
    whole = np.array([np.max(fit.albedo(np.radians(angle))) for angle in _ALBEDO_ANGLES])
    shares = ", ".join(
        f"{percent(share)} at {angle:g}°"
        for share, angle in zip(whole, _ALBEDO_ANGLES, strict=True)
    )
    text = f"The surface reflects {shares}"
    if (whole <= 1).all():
        return Check("energy", True, f"{text}.")
    text += ": more light than falls on it"
    extrapolated = np.array(_ALBEDO_ANGLES) > largest
    if (whole[~extrapolated] <= 1).all():
        return Check("energy", False, f"{text}. No incidence beyond {largest:.3g}° was measured.")
    if whole.min() > 1.1:
        text += ". Are these reflectance factors? They would be π f_r."
        return Check("energy", False, text, argument="values_are")
    return Check("energy", False, f"{text}. Check the calibration.")


def _reflectance(fit: MeasuredFit, error: float) -> Check | None:
    """Check F₀, or n, against what metals and dielectrics have."""
    if fit.f0 is None or fit.fresnel not in ("metal", "dielectric"):
        return None
    strength = float(np.mean(fit.f0))
    numbers = f"F₀ = {', '.join(f'{value:.2g}' for value in fit.f0)}"
    least, largest = _USUAL_INDICES
    doubt = "check the calibration, or the peak is not resolved"
    if error > _USABLE:
        doubt = "the lobe does not fit, or its peak is not resolved"
    if fit.fresnel == "dielectric" or (strength < _MOST_DIELECTRIC and error <= _USABLE):
        index = fit.n or float(dielectric_index(strength))
        text = f"{numbers} is that of a dielectric with n = {index:.3g}"
        passed = bool(least <= index <= largest)
        if not passed:
            text += f"; plastics, paints and glasses have {least:g} to {largest:g}: {doubt}"
        elif fit.fresnel == "metal":
            text += ", though Schlick's factor fits better than the exact one"
    else:
        passed = strength >= _LEAST_METAL
        text = f"{numbers} is {'usual' if passed else 'low'} for a metal"
        text += "" if passed else f": {doubt}"
    return Check("reflectance", passed, f"{text}.")


def _mirror_side(
    samples: DirectionalSamples, groups: Sequence[tuple[float, Indices]]
) -> Check | None:
    """Check that light leaves on the side of the mirror direction, not where it came from."""
    along = -dot(samples.incident[:, :2], samples.outgoing[:, :2])
    with np.errstate(divide="ignore", invalid="ignore"):
        logarithm = np.log(samples.values.mean(axis=1))
    ratios = []
    for angle, index in groups:
        away, towards = index[along[index] > 0], index[along[index] < 0]
        if angle >= _OBLIQUE and away.size and towards.size:
            ratios.append(median(logarithm[towards]) - median(logarithm[away]))
    if not ratios:
        return None
    if min(ratios) < np.log(_BRIGHTER):
        return Check("mirror side", True, "The surface is brighter away from the light.")
    text = (
        "The surface is brighter towards the light: does the file count azimuths, or the sign of "
        "θ_o, the other way, or is this a retroreflector?"
    )
    return Check("mirror side", False, text)


def _resolution(
    samples: Measurements,
    fit: MeasuredFit,
    peaks: Sequence[tuple[float, float]],
    aperture: float | None,
    error: float,
) -> Check | None:
    """Check that the steps, and the aperture, are small against the lobe.

    Its width is that of the fit, but of the data where the fit is poor and theirs is less.
    """
    lobes = np.array([fit.parameter, fit.parameter if fit.second is None else fit.second])
    half_width = np.degrees(float(np.min(fit.distribution.half_width(lobes))))
    if isinstance(samples, DirectionalSamples):
        step, half = np.median(peaks, axis=0)
        # The outgoing direction turns by twice the angle of the half vector.
        angle, width = "θ_o", 4 * half_width
        width = np.fmin(width, 2 * half) if error > _USABLE else width
    else:
        angle, width = "β", 2 * half_width
        step = np.degrees(np.min(np.diff(np.unique(samples.beta))[:1], initial=np.inf))
    if not (np.isfinite(width) and np.isfinite(step)):
        return None
    sizes = f"{_degrees(width)} wide in {angle} at half its height, the step {_degrees(step)}"
    passed = width >= _LEAST_STEPS * step
    if aperture:
        sizes += f", the aperture {aperture:g}°"
        passed &= width >= _LEAST_APERTURES * aperture
    if passed:
        return Check("resolution", True, f"The lobe is {sizes}.")
    text = f"The lobe is at most {sizes}: its peak is not resolved, the roughness is uncertain."
    return Check("resolution", False, text)


def _degrees(angle: float) -> str:
    return f"{angle:.0f}°" if angle >= 9.5 else f"{angle:.2g}°"


def _peak(samples: DirectionalSamples) -> tuple[float, float]:
    """Return the step at the largest value, and where values fall to half of it, degrees.

    Of one angle of incidence; infinite where there is no such sample.
    """
    values = samples.values.mean(axis=1)
    apart = np.degrees(_between(samples.outgoing, samples.outgoing[np.argmax(values)]))
    order = np.argsort(apart, kind="stable")
    apart, values = apart[order], values[order]
    step = np.min(apart[apart > _SAME_DIRECTION], initial=np.inf)
    # A single low value is an outlier.
    windows = sliding_window_view(np.pad(values, 2, mode="edge"), 5)
    is_below = np.median(windows, axis=1) < 0.5 * values.max()
    return float(step), float(np.min(apart[is_below], initial=np.inf))


def _one_parameter(fit: MeasuredFit, by_incidence: Sequence[IncidenceFit]) -> Check | None:
    """Check that one parameter stands for all angles of incidence.

    Those of each alone are compared as α, whatever the parameter is, and left out where they are
    hardly determined.
    """
    known = [one for one in by_incidence if one.parameter_error <= 0.5 * one.parameter]
    if len(known) < 2:
        return None
    known.sort(key=lambda one: one.angle)
    parameter = np.array([one.parameter for one in known])
    low, high = (known[index] for index in (np.argmin(parameter), np.argmax(parameter)))
    uncertain = 2 * np.hypot(low.parameter_error, high.parameter_error)
    alpha = fit.distribution.peak_alpha(parameter)
    drifts = np.ptp(parameter) > uncertain and np.ptp(alpha) > _DRIFT * np.median(alpha)
    first, last = known[0], known[-1]
    change = last.parameter - first.parameter
    # Steps the other way that are more than the errors are no trend.
    against = np.max(-np.sign(change) * np.diff(parameter), initial=0)
    is_trend = abs(change) >= _TREND * np.ptp(parameter) and against < _AGAINST * np.ptp(parameter)
    if drifts and is_trend:
        text = f"{'rises' if change > 0 else 'falls'} from {_at(first)} to {_at(last)}"
    else:
        text = f"is between {_at(low)} and {_at(high)}"
    text = f"By angle of incidence {fit.distribution.parameter.symbol} {text}"
    text += ": one value does not hold for all" if drifts else ""
    return Check("incidences", not bool(drifts), f"{text}.")


def _number_of_samples(samples: Measurements, fit: MeasuredFit) -> Check | None:
    """Check that the samples are more than enough for the unknowns."""
    count, unknowns = samples.values.size, len(fit.unknowns)
    if count >= _LEAST_SAMPLES * unknowns:
        return None
    text = (
        f"{count} values for {unknowns} unknowns: the errors, and the choice of a shape, are rough."
    )
    return Check("samples", False, text)


def _left_out(texts: Sequence[str]) -> Check:
    """Say what is left out, and warn of many negative values, which are noise."""
    text = f"{'; '.join(texts) or 'No sample is left out'}."
    for note in texts:
        if "negative" in note:
            count, _, whole, *_ = note.split()
            if int(count) > _MOST_NEGATIVE * int(whole):
                text += " What is left of dark samples is noise above 0: k_d is an upper bound."
                return Check("left out", False, text)
    return Check("left out", None, text)


def _at(one: IncidenceFit) -> str:
    return f"{one.parameter:.3g} (θ_i = {one.angle:.3g}°)"


def _ranges(fit: MeasuredFit) -> Check:
    """Check that no parameter is at an end of its range."""
    if not fit.at_limit:
        return Check("ranges", True, "No parameter is at an end of its range.")
    names = " and ".join(_symbol(fit, name) for name in fit.at_limit)
    verb = "is" if len(fit.at_limit) == 1 else "are"
    return Check(
        "ranges", False, f"{names} {verb} at an end of the range: the data do not bound it."
    )


def _correlation(fit: MeasuredFit) -> Check | None:
    """Check that the data tell the parameters apart."""
    pairs = np.triu_indices(len(fit.unknowns), 1)
    values = fit.correlation[pairs]
    if not np.isfinite(values).any():
        return None
    largest = int(np.nanargmax(np.abs(values)))
    value = float(values[largest])
    names = [_symbol(fit, fit.unknowns[index[largest]]) for index in pairs]
    text = f"The largest correlation is {value:.2f}, of {names[0]} and {names[1]}"
    if abs(value) <= _CORRELATED:
        return Check("correlation", True, f"{text}.")
    return Check("correlation", False, f"{text}: the data hardly tell them apart.")


def _symbol(fit: MeasuredFit, name: str) -> str:
    """Return an unknown as formulas have it; of a channel its name follows."""
    first, _, channel = name.partition(" ")
    symbols = {parameter.name: parameter.symbol for parameter in fit.distribution.parameters}
    symbols |= {"F0": "F₀"}
    return f"{symbols.get(first, first)} {channel}".strip()


def _strength(fit: MeasuredFit, freed: MeasuredFit | None, error: float) -> Check | None:
    """Check that a lobe of another strength would not fit much better."""
    if freed is None or freed.specular is None:
        return None
    gain = freed.error / max(fit.error, _LEAST_ERROR)
    text = f"Freeing k_s (then {', '.join(f'{value:.2g}' for value in freed.specular)}) would "
    if gain > _NO_GAIN:
        return Check("strength", True, f"{text}gain nothing.")
    text += f"reduce the error from {percent(error)} to {percent(gain * error)}"
    is_little = gain > 1 - _GAIN or error * np.sqrt(1 - gain**2) < _SMALL_GAIN
    if not is_little and np.allclose(freed.specular, np.pi, rtol=_NEAR_PI):
        text += ". k_s is near π: are these reflectance factors, π f_r?"
        return Check("strength", False, text, argument="values_are")
    if is_little or error <= _GOOD:
        return Check("strength", True, f"{text} only.")
    if freed.f0 is not None and np.mean(freed.f0) >= 1:
        text += ": F does not rise to 1 towards grazing as the model's does"
    else:
        text += ": the model, not the calibration, is in doubt"
    return Check("strength", False, f"{text}.")


def _outliers(weights: Array, is_beyond_noise: NDArray[np.bool_]) -> Check:
    """Check that few samples are far from the fit."""
    count = int(np.count_nonzero((weights < _OUTLYING) & is_beyond_noise))
    share = count / len(weights)
    text = (
        f"{count} of {len(weights)} samples ({percent(share)}) lie far from the fit and count less"
    )
    if share <= _MANY_OUTLIERS:
        return Check("outliers", True, f"{text}.")
    return Check("outliers", False, f"{text}: so many mean that the model does not fit there.")
