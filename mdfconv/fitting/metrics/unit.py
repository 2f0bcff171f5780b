"""The metric that keeps the shape of the lobe."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from mdfconv.distributions.evaluation import Array
from mdfconv.fitting.metrics.base import Metric


class Unit(Metric):
    """The shape of the lobe: unit forms, every angle alike (the view of Sawicki 2021)."""

    name = "unit"
    keeps = "shape of the lobe"
    word = "shape"
    purpose = "lobe's shape"
    meant_by: ClassVar[tuple[str, ...]] = ("shape", "lobe", "paper")
    quantity = "unit form D / max D"
    normalized = False

    def weight(self, beta: Array) -> Array:
        """Return 1."""
        return np.broadcast_to(1.0, beta.shape)


METRIC = Unit
