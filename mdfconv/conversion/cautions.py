"""What a careful user must know of conversions, beyond their error."""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from typing import Any

import numpy as np

from mdfconv.conversion.endpoint import Endpoint
from mdfconv.conversion.method import Method
from mdfconv.distributions.equivalence import exact_route
from mdfconv.distributions.evaluation import Array, Mask
from mdfconv.errors import MdfconvWarning

# So many are looked at sooner than their ends are found.
_FEW = 16


def cautions_of(
    method: Method,
    parameter: Array,
    result: Array,
    stored: Array,
    source: Endpoint,
    target: Endpoint,
) -> dict[str, Mask]:
    """Return sentences, and which of some conversions they are true of.

    Parameters
    ----------
    method : Method
        By which they were made, unless both lobes are the same.
    parameter, result : numpy.ndarray, shape (n,)
        Parameters of the source and the target.
    stored : numpy.ndarray, shape (n,)
        The results as the target stores them.
    source, target : Endpoint
        The ends of the conversions.
    """
    every = np.ones(parameter.shape, bool)
    cautions = {end.caution: every for end in (source, target) if end.caution}
    for text, which in target.clamped(stored).items():
        cautions[f"{target.label} clamps: {text}"] = which
    pair = source.distribution, target.distribution
    if exact_route(*pair) is None:
        cautions |= method.cautions(parameter, result, *pair)
    return cautions


def warn_of(
    method: Method,
    conversions: Iterable[tuple[Any, Any]],
    source: Endpoint,
    target: Endpoint,
    stacklevel: int,
) -> None:
    """Warn once of all that arrays of conversions call for.

    Only their least and largest numbers are looked at, as what calls for a caution lies beyond a
    limit; and only where there may be a caution.

    Parameters
    ----------
    method, source, target
        As for `cautions_of`.
    conversions : iterable of two array_like
        Stored values and results, in the same shape.
    stacklevel : int
        Of the warning, as `warnings.warn` takes it in the calling function.
    """
    clamps = target.encoding is not None and bool(target.encoding.clamps)
    silent = not method.has_cautions or source.distribution.is_same(target.distribution)
    if silent and not clamps and not source.caution and not target.caution:
        return
    sentences: dict[str, None] = {}
    for values, results in conversions:
        given = _ends(values)
        # A caution about results is about those at the end of a range.
        stored = _ends(results) if clamps or method.follows_metric else given
        with np.errstate(all="ignore"):
            parameter, result = source.decode_legal(given), target.decode_legal(stored)
            cautions = cautions_of(method, parameter, result, stored, source, target)
        sentences |= dict.fromkeys(text for text, which in cautions.items() if which.any())
    if sentences:
        warnings.warn("; ".join(sentences), MdfconvWarning, stacklevel=stacklevel + 1)


def _ends(values: Any) -> Array:
    """Return the least and the largest of numbers, leaving out NaN (float64); few as they are."""
    array = np.asarray(values)
    if array.size < _FEW:
        return array.astype(float).ravel()
    ends = np.array([array.min(), array.max()], float)
    return ends if not np.isnan(ends[0]) else np.array([np.nanmin(array), np.nanmax(array)], float)
