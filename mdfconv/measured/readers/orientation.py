"""Which side the mirror direction is on, where a file may mean either.

Some give the azimuth of incidence towards the light, so that the mirror direction is opposite to
it; others that of the light's travel, so that both have one azimuth. The lobe tells.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mdfconv.brdf.directions import polar_angle
from mdfconv.distributions.evaluation import Array
from mdfconv.measured.directional import DirectionalSamples

# How much sooner, in standard deviations of the angle, values fall off with one half vector than
# with the other before it is said to be the right one: those of a diffuse surface differ by less.
_CLEAR = 0.25
_TURN = np.array([-1.0, -1.0, 1.0])


def oriented(samples: DirectionalSamples) -> DirectionalSamples:
    """Return samples with the incident directions turned by 180° if the lobe lies there.

    Parameters
    ----------
    samples : DirectionalSamples
        Samples whose azimuths of incidence are taken to be those towards the light.

    Returns
    -------
    DirectionalSamples
        The same, or turned; a note says which if the file left it open.
    """
    turned = replace(samples, incident=samples.incident * _TURN)
    literal_fall, turned_fall = _fall(samples), _fall(turned)
    if turned_fall < literal_fall - _CLEAR:
        note = (
            "the lobe lies where incident and outgoing azimuth are the same: the azimuth of "
            "incidence is that of the light's travel and is turned by 180°"
        )
        return replace(turned, notes=(*samples.notes, note))
    if literal_fall < turned_fall - _CLEAR or not _is_oblique(samples):
        return samples
    note = (
        "the values do not tell on which side the mirror direction lies: it is taken to be "
        "opposite to the azimuth of incidence"
    )
    return replace(samples, notes=(*samples.notes, note))


def _is_oblique(samples: DirectionalSamples) -> bool:
    return bool(np.hypot(*samples.incident[:, :2].T).max() > 1e-6)


def _fall(samples: DirectionalSamples) -> float:
    """Return how far the values gather at a small angle of the half vector: negative if so.

    It is the mean angle with the values as weights, less the one without, in standard
    deviations.
    """
    beta = polar_angle(samples.half)
    weight = _brightness(samples.values)
    spread = float(np.std(beta))
    if spread < 1e-9 or not weight.any():
        return 0.0
    return (float(np.average(beta, weights=weight)) - float(np.mean(beta))) / spread


def _brightness(values: Array) -> Array:
    """Return one weight for each row, in which every channel counts as much."""
    positive = np.maximum(values, 0)
    largest = positive.max(axis=0)
    return np.sum(positive / np.where(largest > 0, largest, 1), axis=1)
