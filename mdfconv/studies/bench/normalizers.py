"""Speed against error of modified Phong's normalizers."""

from __future__ import annotations

from typing import Any

import numpy as np

from mdfconv.brdf.reflection import NORMALIZERS, normalization
from mdfconv.studies.furnace import directional_albedo, furnace_model
from mdfconv.timing import interleave, spread

_COSINES = np.linspace(0, 1, 100_000)
_CHECKED = np.linspace(0, 1, 11)
_ROUNDS = 7


def normalizer_speeds(exponent: float) -> list[dict[str, Any]]:
    """Return for each normalizer its time and the energy that is missing.

    Parameters
    ----------
    exponent : float
        γ ≥ 0; Arvo's method is left out unless it is an integer.

    Returns
    -------
    list of dict
        Name, nanoseconds for one cosine (median), largest and mean |albedo − 1| over cosines.

    Raises
    ------
    MdfconvError
        If the exponent is negative.
    """
    names = [name for name in NORMALIZERS.names if name != "arvo" or exponent == round(exponent)]
    models = {name: furnace_model("modified-phong", exponent, normalizer=name) for name in names}
    times = interleave(
        {name: _evaluation(name, exponent) for name in names}, _ROUNDS, lambda steps: None
    )
    rows = []
    for name in names:
        missing = np.abs(directional_albedo(models[name], _CHECKED) - 1)
        rows.append(
            {
                "normalizer": name,
                "ns": float(f"{1e9 * spread(times[name]).median / _COSINES.size:.3g}"),
                "largest_error": float(f"{missing.max():.2g}"),
                "mean_error": float(f"{missing.mean():.2g}"),
            }
        )
    return rows


def _evaluation(name: str, exponent: float) -> Any:
    return lambda: normalization(name, _COSINES, exponent)
