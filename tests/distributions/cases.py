"""Hard cases for every distribution of the registry, from what it declares of its parameters."""

import numpy as np

import mdfconv

HALF_PI = np.pi / 2
ALPHAS = [
    1e-8, 1e-6, 1e-4, 1e-3, 0.01, 0.05, 0.2, 0.5, 0.7, 0.70710678, 0.71, 0.9, 0.999, 1.0, 1.5, 3,
    100, 1e5,
]  # fmt: skip
EXPONENTS = [1e-3, 0.5, 1, 1.5, 2, 7.3, 100, 1e4, 1e8, 1e12, 1e16]
GAMMAS = [0.3, 1, 1.5, 2, 2.001, 2.5, 4, 10, 1e3]


def instances(entry):
    """Return a distribution with each hard value of its second parameter."""
    if entry.second_parameter is None:
        return [entry]
    return [entry.with_gamma(g) for g in GAMMAS if entry.second_parameter.accepts(np.asarray(g))]


def parameters(entry, dtype=float):
    """Return the hard values of the first parameter that are legal, in a type."""
    values = EXPONENTS if entry.parameter.larger_is_smoother else ALPHAS
    return [dtype(value) for value in values if entry.parameter.accepts(np.asarray(value))]


def angles(entry, parameter):
    """Return angles through the lobe, around its edge, into its tail, to both ends of the range."""
    width = entry.half_width(parameter)
    width = 0.5 if np.isnan(width) else width
    fixed = [0, 1e-300, 1e-30, 1e-8, 1e-3, HALF_PI - 1e-3, HALF_PI - 1e-8, HALF_PI]
    beta = [fixed, width * np.logspace(-2, 3, 30), np.linspace(0, HALF_PI, 9)]
    edge = entry.edge(np.array([parameter], dtype=float))
    if edge is not None:
        near = np.logspace(-15, -1, 15)
        beta += [edge * (1 - near), edge * (1 + near), edge, np.nextafter(edge, 0)]
    return np.minimum(np.concatenate(beta), HALF_PI)


def oracle_name(entry):
    """Return the name under which the oracles know the section along an axis."""
    return "blinn-phong" if entry.name == "ashikhmin-shirley" else entry.name


ENTRIES = {entry.name: entry for entry in mdfconv.list_distributions()}
INSTANCES = {one.label: one for entry in ENTRIES.values() for one in instances(entry)}
