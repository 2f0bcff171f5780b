"""What the interactive page knows of a conversion, as tables that it interpolates."""

from __future__ import annotations

import base64
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import DTypeLike

from mdfconv.conversion import convert
from mdfconv.conversion.explanation import remaining_error
from mdfconv.distributions import Distribution
from mdfconv.distributions.dialects import Specular, dialects_of
from mdfconv.distributions.endpoint import DEFAULT_ENCODING, Endpoint, encodings_of, endpoint
from mdfconv.distributions.evaluation import Array
from mdfconv.fitting.metrics import Metric, list_metrics, metric_named
from mdfconv.light.spectrum import LobeSpectrum

# The metric with which the page begins: light from all around is the usual case.
FIRST_METRIC = "environment"
# Of a converted parameter, relative: with four digits shown the number is within 0.1 %.
LARGEST_ERROR = 2e-4
# Of stored numbers: relative, and absolute beside that.
_RELATIVE, _ABSOLUTE = 3e-4, 5e-6
# Nodes to begin with, and the step of ln p that is narrow enough for a jump.
_NODES, _NARROW = 65, 1e-6
# Of lobes: parameters, and angles in u = t/(1 + t), t = tan β / α with D(0) = 1/(π α²).
_PARAMETERS, _ANGLES = 48, 96
# What is less than e to this of D(0) is not told from 0.
_LEAST_LOG = -24.0
_ERROR_NODES = 33
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


def refined(
    function: Callable[[Array], Array], nodes: Array, relative: float, absolute: float
) -> tuple[Array, Array, float]:
    """Return nodes between which a function is as good as linear, but for narrow jumps.

    Parameters
    ----------
    function : callable
        From ln p, shape (n,), to values of shape (k, n); NaN where there is none.
    nodes : numpy.ndarray, shape (m,)
        Those to begin with: steps are halved where one of the k is not linear.
    relative, absolute : float
        The error that is allowed in the middle of a step, whose sum counts.

    Returns
    -------
    nodes, values : numpy.ndarray, shapes (n,) and (k, n)
        The nodes and the values there.
    error : float
        The largest error in the middle of a step that is no jump.
    """
    values = function(nodes)
    while True:
        middle = 0.5 * (nodes[:-1] + nodes[1:])
        between = function(middle)
        error = np.abs(0.5 * (values[:, :-1] + values[:, 1:]) - between)
        none = np.isnan(values[:, :-1]) & np.isnan(values[:, 1:])
        linear = none | (error <= relative * np.abs(between) + absolute)
        bad = ~linear.all(axis=0) & (np.diff(nodes) > _NARROW)
        if not bad.any():
            return nodes, values, float(np.max(error, where=linear & ~none, initial=0))
        order = np.argsort(np.concatenate([nodes, middle[bad]]))
        nodes = np.concatenate([nodes, middle[bad]])[order]
        values = np.concatenate([values, between[:, bad]], axis=1)[:, order]


def conversions(
    source: Distribution, target: Distribution
) -> tuple[list[dict[str, Any]], tuple[float, float], float]:
    """Return the conversions over the source's typical range under every metric.

    Returns
    -------
    tables : list of dict
        For each metric ``name`` and ``keeps``; ln p of the target, ``parameter``, at ln p of the
        source, ``nodes``; and the ``rmse`` and ``maximum`` error that remain, at parameters of
        the source in equal steps of ln p.
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
    low, high = source.parameter.typical

    def converted(logs: Array) -> Array:
        # The ends of the range, whose logarithm is rounded, are inside of it.
        parameter = np.clip(np.exp(logs), low, high)
        return np.log(convert(parameter, *ends, metric=metric))[None, :]

    start = np.log(grid(low, high, _NODES))
    nodes, (logs,), error = refined(converted, start, 0, LARGEST_ERROR)
    few = grid(low, high, _ERROR_NODES)
    rmse, maximum = remaining_error(source, few, target, convert(few, *ends, metric=metric), metric)
    table = {
        "name": str(metric),
        "keeps": metric.keeps,
        "nodes": packed(nodes, np.float64),
        "parameter": packed(logs, np.float32),
        "rmse": rounded(rmse, 4),
        "maximum": rounded(maximum, 4),
    }
    return table, logs, error


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
    encoded = [end for end in ends if end.encoding]
    limits = [clamp.limit for end in ends if end.encoding for clamp in end.encoding.clamps]
    beside = [limit * (1 + side) for limit in limits for side in (-_BESIDE, 0, _BESIDE)]
    inside = [value for value in beside if low < value < high]
    nodes = np.log(np.unique(np.concatenate([grid(low, high, _NODES), inside])))
    if encoded:
        nodes, _, _ = refined(
            lambda logs: np.array([end.encode(np.exp(logs)) for end in encoded]),
            nodes,
            _RELATIVE,
            _ABSOLUTE,
        )
    return {
        "nodes": packed(nodes, np.float64),
        "forms": [
            {
                "name": end.label,
                "symbol": end.stored.symbol,
                "formula": end.encoding.formula if end.encoding else "",
                "clamped": "; ".join(end.clamped(np.empty(0))),
                # The parameter itself is at hand.
                "values": packed(end.encode(np.exp(nodes)), np.float32) if end.encoding else "",
            }
            for end in ends
        ],
    }


def _encoded_names(mdf: Distribution) -> list[str]:
    """Return the encodings as for ``--to``; a needed specular weight is 1."""
    dialects = dialects_of(mdf.name)
    return [
        f"{mdf.name}:{name}"
        + (":1" if name in dialects and dialects[name].specular is Specular.needed else "")
        for name in encodings_of(mdf)
        if name != DEFAULT_ENCODING
    ]
