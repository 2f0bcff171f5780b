"""How samples lie: angles of incidence, scans, neighbours, and what residuals along them say."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
from scipy.spatial import KDTree

from mdfconv.brdf.microfacet import azimuth, direction, dot, polar_angle
from mdfconv.distributions.evaluation import Array, Indices, gauss_legendre
from mdfconv.measured.samples import DirectionalSamples, Measurements

# Angles of incidence within such a range are one, degrees.
_SAME_ANGLE = 0.5

# The standard deviation in medians of absolute deviations.
MEDIANS = 1.4826
# A sample between two neighbours is the least that shows noise.
_FEWEST = 3
# Levels of brightness at which noise is estimated, and the least differences of one.
_LEVELS, _PER_LEVEL = 8, 30
# Of more samples some are as dense as the lobe needs.
_MOST = 50_000
# Of so many neighbours one is opposite to the nearest: on a line, on a grid, and of many clouds.
_NEIGHBOURS = 6
_OPPOSITE = -0.8
# Of the choice of neighbours in one place: the same each time.
_SEED = 0
# Unit vectors nearer than this are one direction, measured again.
_SAME_PLACE = 1e-9

# Gauss's rules in azimuth and zenith of the half vector: relative errors below 1e-4.
_AZIMUTHS, _ZENITHS = 24, 32


def scan_order(samples: Measurements) -> Indices:
    """Return the order in which samples follow each other in scans."""
    if not isinstance(samples, DirectionalSamples):
        return np.argsort(samples.beta, kind="stable")
    incidence = np.round(np.degrees(polar_angle(samples.incident)) / _SAME_ANGLE)
    difference = azimuth(samples.outgoing) - azimuth(samples.incident)
    turn = np.round(np.degrees(difference) % 360) % 360
    signed = np.where(turn < 180, -1, 1) * polar_angle(samples.outgoing)
    return np.lexsort((signed, turn % 180, incidence))


def dependence(residual: Array) -> float:
    """Return by how much residuals in the order of scans, (channels, n), count less: 1 or more.

    It is the integrated autocorrelation, 1 + 2 Σ ρ_k up to the first k that is not positive.
    """
    count = residual.shape[1]
    centred = residual - residual.mean(axis=1, keepdims=True)
    size = 1 << (2 * count - 1).bit_length()
    spectrum = np.abs(np.fft.rfft(centred, size)) ** 2
    correlation = np.fft.irfft(spectrum.sum(axis=0), size)[: max(2, count // 4)]
    if not correlation[0] > 0:
        return 1.0
    correlation /= correlation[0]
    ends = np.flatnonzero(correlation <= 0)
    last = ends[0] if ends.size else len(correlation)
    return float(1 + 2 * correlation[1:last].sum())


def incidence_groups(samples: DirectionalSamples) -> list[tuple[float, Indices]]:
    """Return the angles of incidence, degrees, and the samples at each, whatever the azimuth.

    Angles within half a degree are one, their median; they ascend.
    """
    angle = np.degrees(polar_angle(samples.incident))
    order = np.argsort(angle, kind="stable")
    ascending = angle[order]
    edges = [0]
    while edges[-1] < ascending.size:
        last = ascending[edges[-1]] + _SAME_ANGLE
        edges.append(np.searchsorted(ascending, last, side="right").item())
    spans = pairwise(edges)
    return [(float(np.median(ascending[a:b])), np.sort(order[a:b])) for a, b in spans]


def median(values: Array) -> float:
    """Return the median of what is finite; NaN of nothing."""
    known = values[np.isfinite(values)]
    return float(np.median(known)) if known.size else float("nan")


def noise_of(samples: Measurements, log_ratio: Array) -> Array:
    """Return the relative noise of samples: how much each differs from its neighbours.

    The residual of a sample is compared with the one that two neighbours on opposite sides
    interpolate, so that a misfit, which is smooth, cancels, and medians of such differences do not
    know outliers. They are taken by brightness, since dark samples are noisier; where bright ones
    differ more than most, at a peak between two steps, it is not by noise. The order of the samples
    does not matter; of more than 50,000 some are drawn.

    Parameters
    ----------
    samples : Samples or DirectionalSamples
        The measurements, of positive values; the surface is taken for isotropic.
    log_ratio : numpy.ndarray, shape (n, channels)
        ln(fit/data); rows that are not finite are left out.

    Returns
    -------
    numpy.ndarray, shape (n,)
        The standard deviation of the noise, relative to the value; NaN of too few samples.
    """
    random = np.random.default_rng(_SEED)
    unknown = np.full(len(log_ratio), np.nan)
    rows = np.flatnonzero(np.isfinite(log_ratio).all(axis=1))
    if rows.size < _FEWEST:
        return unknown
    bright = brightness(samples, log_ratio)
    if rows.size > _MOST:
        rows = random.choice(rows, _MOST, replace=False)
    points, residual = _points(samples.select(rows)), log_ratio[rows]
    # By place, whatever the order of the rows.
    place = (points * np.sqrt([2.0, 3.0, 5.0, 7.0, 11.0])[: points.shape[1]]).sum(axis=1)
    order = np.lexsort((residual[:, 0], place))
    points, residual, rows = points[order], residual[order], rows[order]
    # Of many measurements in one place each has neighbours of its own.
    points += 0.1 * _SAME_PLACE * random.standard_normal(points.shape)
    center, near, far, share = _between_neighbours(points)
    if not center.size:
        return unknown
    difference = residual[center] - share * residual[near] - (1 - share) * residual[far]
    apart = np.abs(difference) / np.sqrt(1 + share**2 + (1 - share) ** 2)
    light = bright[rows[center]]
    parts = np.array_split(
        np.argsort(light, kind="stable"), np.clip(light.size // _PER_LEVEL, 1, _LEVELS)
    )
    level = np.array([np.median(light[part]) for part in parts])
    noise = MEDIANS * np.array([np.median(apart[part]) for part in parts])
    upper = noise[noise.size // 2 :]
    np.minimum(upper, np.median(noise), out=upper)
    # Beyond the darkest level the noise of the detector stays as it is.
    return np.interp(bright, level, noise) * np.exp(np.maximum(level[0] - bright, 0))


def brightness(samples: Measurements, log_ratio: Array) -> Array:
    """Return the mean logarithm of the fit over the channels, shape (n,)."""
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.mean(np.log(samples.values) + log_ratio, axis=1)


def _points(samples: Measurements) -> Array:
    """Return where samples are, such that equal distances are about equally different.

    Of two directions both, turned about the normal until the incident one has no azimuth.
    """
    if not isinstance(samples, DirectionalSamples):
        return samples.beta[:, None]
    turned = azimuth(samples.outgoing) - azimuth(samples.incident)
    outgoing = direction(polar_angle(samples.outgoing), turned)
    incident = direction(polar_angle(samples.incident))
    return np.concatenate([incident[:, ::2], outgoing], axis=1)


def _between_neighbours(points: Array) -> tuple[Indices, Indices, Indices, Array]:
    """Return points that have neighbours on opposite sides, the nearer and the farther of these.

    And the share of the nearer one, shape (n, 1), in what both interpolate at the point.
    """
    count = min(_NEIGHBOURS + 1, len(points))
    _, found = KDTree(points).query(points, k=count)
    # The nearest is the point itself.
    found = found[:, 1:]
    offset = points[found] - points[:, None]
    distance = np.linalg.norm(offset, axis=2)
    away = offset / np.maximum(distance, _SAME_PLACE)[..., None]
    cosine = np.einsum("nki,ni->nk", away, away[:, 0])
    is_opposite = (cosine < _OPPOSITE) | (distance < _SAME_PLACE)
    is_opposite[:, 0] = False
    rows = np.flatnonzero(is_opposite.any(axis=1))
    second = is_opposite[rows].argmax(axis=1)
    nearer, farther = distance[rows, :1], distance[rows, second][:, None]
    share = farther / (nearer + farther)
    return rows, found[rows, 0], found[rows, second], share


def albedo(brdf: Callable[[Array, Array], Array], theta: float, width: float) -> Array:
    """Return the share of light from one direction that a surface reflects, ∫ f cos θ_o dω_o.

    Over half vectors, whose zenith is width · sinh u: dense in the lobe, sparse in its tails
    (relative error below 1e-3, mostly 1e-5).

    Parameters
    ----------
    brdf : callable
        f of incident and outgoing unit vectors, both of shape (n, 3), with values of shape
        (n, channels); isotropic.
    theta : float
        The angle of incidence, radians, [0, π/2).
    width : float
        The half width of the (narrowest) lobe in half vectors, radians; NaN of one without.

    Returns
    -------
    numpy.ndarray, shape (channels,)
        The albedo for light from `theta`.
    """
    width = min(width, 1.0) if width > 0 else 1.0
    cosine, sine = np.cos(theta), np.sin(theta)
    x, weight = gauss_legendre(_AZIMUTHS)
    phi, phi_weight = 0.5 * np.pi * (1 + x), np.pi * weight
    x, weight = gauss_legendre(_ZENITHS)
    # The half vector for which the outgoing direction is level.
    horizon = 0.25 * np.pi + 0.5 * np.arctan(sine * np.cos(phi) / cosine)
    end = 0.5 * np.arcsinh(horizon / width)[:, None]
    u = end * (1 + x)
    zenith = width * np.sinh(u)
    measure = phi_weight[:, None] * end * weight * width * np.cosh(u) * np.sin(zenith)
    m = direction(zenith, phi[:, None]).reshape(-1, 3)
    incident = np.broadcast_to([sine, 0.0, cosine], m.shape)
    facing = dot(incident, m)
    outgoing = 2 * facing[:, None] * m - incident
    # dω_o = 4 (i·m) dω_m.
    measure = measure.ravel() * 4 * facing * outgoing[:, 2]
    return measure @ brdf(incident, outgoing)
