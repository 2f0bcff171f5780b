"""The metric that keeps the light."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from mdfconv.distributions.evaluation import Array
from mdfconv.fitting.metrics.base import Metric


class Energy(Metric):
    """The light: normalized forms, over the hemisphere with cos β dω."""

    name = "energy"
    keeps = "light"
    word = "light"
    purpose = "sun or lamp, linear light"
    meant_by: ClassVar[tuple[str, ...]] = ("sun", "lamp", "point", "directional", "peak")
    quantity = "normalized D / max D of the reference"
    normalized = True

    def weight(self, beta: Array) -> Array:
        """Return 2π sin β cos β."""
        return np.pi * np.sin(2 * beta)


METRIC = Energy
