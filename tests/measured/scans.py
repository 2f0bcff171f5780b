"""Measurements to write into files: a GGX mirror at directions that are known."""

import numpy as np

ALPHA = 0.3


def vector(theta, phi):
    return np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1)


def ggx(incident, outgoing, alpha=ALPHA):
    """D G / (4 cos cos) of a perfect mirror, G by Smith, from vectors."""
    half = incident + outgoing
    half = half / np.linalg.norm(half, axis=-1, keepdims=True)
    slope = (half[..., 0] ** 2 + half[..., 1] ** 2) / half[..., 2] ** 2 / alpha**2
    density = 1 / (np.pi * alpha**2 * half[..., 2] ** 4 * (1 + slope) ** 2)
    masking = 2 / (smith(incident, alpha) + smith(outgoing, alpha))
    return masking * density / (4 * incident[..., 2] * outgoing[..., 2])


def smith(omega, alpha):
    """Return 1 + 2 Λ of GGX."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.sqrt(1 + alpha**2 * (1 / omega[..., 2] ** 2 - 1))


def grid(incidences=(10, 35, 60), zeniths=range(0, 80, 5), azimuths=range(0, 360, 30)):
    """Return θ_i, φ_i = 0, θ_o, φ_o in degrees; φ_o = 180 is the mirror's side."""
    angles = np.meshgrid(
        np.array(incidences, float), [0.0], np.array(zeniths, float), np.array(azimuths, float)
    )
    return np.stack([a.ravel() for a in angles], -1)


def measured(angles):
    """Return incident and outgoing vectors and values of angles in degrees, shape (n, 4)."""
    theta_i, phi_i, theta_o, phi_o = np.radians(angles).T
    incident, outgoing = vector(theta_i, phi_i), vector(theta_o, phi_o)
    return incident, outgoing, ggx(incident, outgoing)


def rows(*columns, separator=",", digits=".12g"):
    return "\n".join(
        separator.join(format(cell, digits) for cell in row) for row in np.column_stack(columns)
    )


def merl_bytes(counts=(12, 9, 10), seed=1):
    """Return a MERL file of a GGX BRDF, a tenth of its cells invalid, and the cells."""
    half, difference, azimuth = counts
    theta_h = (np.arange(half) / half) ** 2 * np.pi / 2
    theta_d = np.arange(difference) / difference * np.pi / 2
    phi_d = np.arange(azimuth) / azimuth * np.pi
    h, d, p = np.meshgrid(theta_h, theta_d, phi_d, indexing="ij")
    incident, outgoing = rusinkiewicz(h, np.zeros_like(h), d, p)
    with np.errstate(all="ignore"):
        values = ggx(incident, outgoing)
    values = np.where((incident[..., 2] > 0) & (outgoing[..., 2] > 0), values, 1.0)
    values[np.random.default_rng(seed).random(values.shape) < 0.1] = -1
    scales = np.array([1, 1.15, 1.66]) / 1500
    planes = np.stack([values / scale for scale in scales])
    return np.array(counts, "<i4").tobytes() + planes.astype("<f8").tobytes()


def rusinkiewicz(theta_h, phi_h, theta_d, phi_d):
    """Return both directions by explicit rotation about y, then z, one at a time."""
    half = vector(theta_h, phi_h)
    tangent = np.stack(
        [np.cos(theta_h) * np.cos(phi_h), np.cos(theta_h) * np.sin(phi_h), -np.sin(theta_h)], -1
    )
    side = np.cross(half, tangent)
    local = vector(theta_d, phi_d)
    first = local[..., :1] * tangent + local[..., 1:2] * side + local[..., 2:] * half
    second = 2 * np.sum(first * half, -1, keepdims=True) * half - first
    return first, second


def tensor_bytes(fields):
    """Return a tensor file of arrays by name."""
    types = {"u1": 1, "<f4": 10, "<f8": 11}
    head = [b"tensor_file\0", bytes([1, 0]), np.uint32(len(fields)).tobytes()]
    size = 18 + sum(2 + len(name) + 2 + 1 + 8 + 8 * array.ndim for name, array in fields.items())
    body = []
    for name, array in fields.items():
        kind = types[array.dtype.str.replace("|", "")]
        head += [np.uint16(len(name)).tobytes(), name.encode()]
        head += [np.uint16(array.ndim).tobytes(), bytes([kind]), np.uint64(size).tobytes()]
        head += [np.array(array.shape, "<u8").tobytes()]
        body.append(array.tobytes())
        size += array.nbytes
    return b"".join(head + body)
