"""Ward's rule between Beckmann and Blinn/Phong."""

from __future__ import annotations

import numpy as np

from mdfconv.conversion.formulas import FormulaMethod
from mdfconv.distributions.equivalence import Formula
from mdfconv.fitting.metrics import Metric


class Ward(FormulaMethod):
    """m_B² N = 2: the rule of thumb of Ward 1996, eq. (11) in Sawicki 2021."""

    name = "ward"
    source = "Ward 1996; Sawicki 2021, eq. (11)"

    def keeps(self, metric: Metric) -> str:
        """Return the rule keeps roughly the shape."""
        return "shape of a smooth lobe, roughly"


METHOD = Ward(
    {
        ("beckmann", "blinn-phong"): Formula("N = 2/m_B² (eq. 11)", lambda m: 2 / m**2),
        ("blinn-phong", "beckmann"): Formula("m_B = √(2/N) (eq. 11)", lambda n: np.sqrt(2 / n)),
    }
)
