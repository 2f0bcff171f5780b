"""What the interactive page knows of a conversion, as tables that it interpolates."""

from __future__ import annotations

import base64
from typing import Any

import numpy as np
from numpy.typing import DTypeLike

from mdfconv.conversion import convert
from mdfconv.conversion.endpoint import DEFAULT_ENCODING, Endpoint, encodings_of, endpoint
from mdfconv.conversion.remaining_error import remaining_error
from mdfconv.distributions import Distribution
from mdfconv.distributions.dialects import Specular, dialects_of
from mdfconv.distributions.evaluation import Array
from mdfconv.errors import MdfconvError
from mdfconv.fitting.metrics import Metric, list_metrics, metric_named
from mdfconv.light.lobe_spectrum import LobeSpectrum

# The metric with which the page begins: light from all around is the usual case.
FIRST_METRIC = "environment"
# Of the interpolation of a converted parameter, relative: with four digits shown, within 0.1 %.
LARGEST_ERROR = 2e-4
_FEWEST_NODES, _MOST_NODES = 65, 2049
# Of lobes: parameters, and angles in u = t/(1 + t), t = tan β / α with D(0) = 1/(π α²).
_PARAMETERS, _ANGLES = 48, 96
# What is less than e to this of D(0) is not told from 0.
_LEAST_LOG = -24.0
_ERROR_NODES = 33
# Of stored numbers: the nodes to begin with, the error allowed, relative and beside that absolute,
# and how often a step is halved at most, as beside what cannot be stored.
_ENCODING_NODES, _RELATIVE, _ABSOLUTE, _HALVINGS = 65, 2e-4, 5e-6, 8
# On both sides of a clamp, relative: a rule may have a step there.
_BESIDE = 1e-9
# The highest degree of the environment.
DEGREE = 16


def packed(values: Any, kind: DTypeLike) -> str:
    """Return an array as the base64 text of its little-endian bytes."""
    array = np.ascontiguousarray(values, dtype=np.dtype(kind).newbyteorder("<"))
    return base64.b64encode(array.tobytes()).decode()


def rounded(values: Array, digits: int = 8) -> list[Any]:
    """Return an array as lists of numbers with few digits, for they are read as text."""
    return [
        rounded(value, digits) if np.ndim(value) else float(f"{value:.{digits}g}")
        for value in values
    ]


def grid(low: float, high: float, count: int) -> Array:
    """Return parameters from one to another, in equal steps of the logarithm."""
    return np.exp(np.linspace(np.log(low), np.log(high), count))


def conversions(
    source: Distribution, target: Distribution
) -> tuple[list[dict[str, Any]], tuple[float, float], float]:
    """Return the conversions over the source's typical range under every metric.

    Returns
    -------
    tables : list of dict
        For each metric ``name`` and ``keeps``, ``parameter``, 32-bit numbers, as ln p of the
        target at parameters of the source in equal steps of the logarithm, and the ``rmse`` and
        ``maximum`` error that remain, at fewer.
    span : tuple of two float
        The range of the target's parameters.
    error : float
        The largest relative error of linear interpolation between the logarithms.
    """
    names = dict.fromkeys([FIRST_METRIC, *list_metrics()])
    rows = [_conversion(source, target, metric_named(name)) for name in names]
    logs = np.concatenate([logs for _, logs, _ in rows])
    span = float(np.exp(logs.min())), float(np.exp(logs.max()))
    return [table for table, _, _ in rows], span, max(error for _, _, error in rows)


def _conversion(
    source: Distribution, target: Distribution, metric: Metric
) -> tuple[dict[str, Any], Array, float]:
    ends = Endpoint(source), Endpoint(target)
    count, error = _FEWEST_NODES, np.inf
    while error > LARGEST_ERROR:
        if count > _MOST_NODES:
            raise MdfconvError(
                f"the conversion from {source.label} to {target.label} under the {metric.name} "
                "metric is too rough for a table"
            )
        fine = grid(*source.parameter.typical, 2 * count - 1)
        logs = np.log(convert(fine, *ends, metric=metric))
        between = 0.5 * (logs[:-2:2] + logs[2::2])
        error = float(np.max(np.abs(np.expm1(between - logs[1::2]))))
        nodes, count = logs[::2], 2 * count - 1
    few = grid(*source.parameter.typical, _ERROR_NODES)
    results = np.asarray(convert(few, *ends, metric=metric))
    rmse, maximum = remaining_error(source, few, target, results, metric)
    table = {
        "name": str(metric),
        "keeps": metric.keeps,
        "parameter": packed(nodes, np.float32),
        "rmse": rounded(rmse, 4),
        "maximum": rounded(maximum, 4),
    }
    return table, nodes, error


def lobes(mdf: Distribution, low: float, high: float) -> dict[str, Any]:
    """Return a distribution's lobes over a range of its parameter, and how they blur.

    Returns
    -------
    dict
        ``low`` and ``high`` as ln p, and for parameters in equal steps of ln p between them
        ``alpha`` (ln α) and ``peak`` (ln D(0)); ``lobes``, as 16-bit numbers from ``least`` to
        ``most``, ln D/D(0) at ``angles`` angles in equal steps of u; ``spectrum``, k_l by degree
        from 1, as 32-bit numbers.
    """
    parameter = grid(low, high, _PARAMETERS)
    alpha = np.asarray(mdf.peak_alpha(parameter))
    u = np.linspace(0, 1, _ANGLES)
    with np.errstate(divide="ignore"):
        beta = np.arctan(alpha[:, None] * u / (1 - u))
        logs = np.log(mdf.normalized(beta, parameter[:, None]))
    relative = np.maximum(logs - logs[:, :1], _LEAST_LOG)
    # A rough lobe may be highest away from the normal.
    most = float(relative.max())
    spectrum = LobeSpectrum(DEGREE)(mdf, parameter[:, None])[:, :DEGREE]
    return {
        "low": float(np.log(low)),
        "high": float(np.log(high)),
        "alpha": rounded(np.log(alpha)),
        "peak": rounded(logs[:, 0]),
        "least": _LEAST_LOG,
        "most": most,
        "angles": _ANGLES,
        "lobes": packed(np.rint(65535 * (relative - _LEAST_LOG) / (most - _LEAST_LOG)), np.uint16),
        "spectrum": packed(spectrum, np.float32),
    }


def encodings(mdf: Distribution, low: float, high: float) -> dict[str, Any]:
    """Return the forms in which the parameter is stored, over a range of it.

    Returns
    -------
    dict
        ``nodes``, ln p; and ``forms``: for each its ``name`` as for ``--to``, the ``symbol`` of
        the stored number, its ``formula``, what is ``clamped``, and the ``values`` at the nodes,
        NaN where it cannot be stored. Between nodes they are interpolated linearly in ln p.
    """
    plain = Endpoint(mdf)
    ends = [plain, *(endpoint(name) for name in _encoded_names(mdf))]
    nodes = _encoding_nodes([end for end in ends if end.encoding], low, high)
    return {
        "nodes": packed(np.log(nodes), np.float64),
        "forms": [
            {
                "name": end.label,
                "symbol": end.stored.symbol,
                "formula": end.encoding.formula if end.encoding else "",
                "clamped": "; ".join(end.clamped(np.empty(0))),
                # The parameter itself is at hand.
                "values": packed(end.encode(nodes), np.float32) if end.encoding else "",
            }
            for end in ends
        ],
    }


def _encoding_nodes(ends: list[Endpoint], low: float, high: float) -> Array:
    """Return the parameters between which every stored number is as good as linear in ln p."""
    limits = [clamp.limit for end in ends if end.encoding for clamp in end.encoding.clamps]
    beside = [limit * (1 + side) for limit in limits for side in (-_BESIDE, 0, _BESIDE)]
    inside = [value for value in beside if low < value < high]
    nodes = np.unique(np.concatenate([grid(low, high, _ENCODING_NODES), inside]))
    for _ in range(_HALVINGS):
        middle = np.sqrt(nodes[:-1] * nodes[1:])
        bad = np.zeros(middle.size, dtype=bool)
        for end in ends:
            values, between = end.encode(nodes), end.encode(middle)
            error = np.abs(0.5 * (values[:-1] + values[1:]) - between)
            # What cannot be stored is NaN, at both ends of a step or at one.
            fits = error <= _RELATIVE * np.abs(between) + _ABSOLUTE
            whole = np.isnan(values[:-1]) & np.isnan(values[1:])
            bad |= ~(fits | whole)
        # Steps as narrow as those beside a clamp are narrow enough.
        bad &= nodes[1:] > nodes[:-1] * (1 + 4 * _BESIDE)
        if not bad.any():
            break
        nodes = np.sort(np.concatenate([nodes, middle[bad]]))
    return nodes


def _encoded_names(mdf: Distribution) -> list[str]:
    """Return the encodings as for ``--to``; a needed specular weight is 1."""
    dialects = dialects_of(mdf.name)
    return [
        f"{mdf.name}:{name}"
        + (":1" if name in dialects and dialects[name].specular is Specular.needed else "")
        for name in encodings_of(mdf)
        if name != DEFAULT_ENCODING
    ]
