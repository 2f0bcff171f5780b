"""The closed forms of Sawicki 2021, equations (12)-(15) and Tables 3 and 4."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from mdfconv.conversion.formulas import FormulaMethod
from mdfconv.distributions import Distribution
from mdfconv.distributions.equivalence import Formula, follow, from_root, to_root
from mdfconv.distributions.evaluation import Array, Mask
from mdfconv.distributions.parameter import number_text
from mdfconv.fitting.metrics import Metric

# What the paper's sweep m_B ∈ [0.0044, 0.4473] (its Table 2) covers, in each parameter.
_SWEEP = {
    "beckmann": (0.0044, 0.4473),
    "gauss": (0.0044, 0.4970),
    "blinn-phong": (10.0, 1e5),
    "sawicki": (9.218, 117400.0),
    "ggx": (0.005364, 0.4865),
}


def _turning_point(linear: float, cubic: float) -> float:
    """Return where linear x − cubic x³ has its maximum."""
    return float(np.sqrt(linear / (3 * cubic)))


_FORMULAS = {
    ("beckmann", "blinn-phong"): Formula("N = 2/m_B² − 2.5 (eq. 12)", lambda m: 2 / m**2 - 2.5),
    ("blinn-phong", "beckmann"): Formula(
        "m_B = √2/√(N+2.5) (eq. 12)", lambda n: np.sqrt(2) / np.sqrt(n + 2.5)
    ),
    ("beckmann", "gauss"): Formula(
        "m_G = 0.5591 m_B³ + m_B (eq. 13)", lambda m: m * (1 + 0.5591 * m * m)
    ),
    ("gauss", "beckmann"): Formula(
        "m_B = m_G − 0.4134 m_G³ (eq. 13)",
        lambda m: m * (1 - 0.4134 * m * m),
        _turning_point(1, 0.4134),
    ),
    ("gauss", "blinn-phong"): Formula("N = 2/m_G² − 0.5 (eq. 14)", lambda m: 2 / m**2 - 0.5),
    ("blinn-phong", "gauss"): Formula(
        "m_G = √2/√(N+0.5) (eq. 14)", lambda n: np.sqrt(2) / np.sqrt(n + 0.5)
    ),
    ("blinn-phong", "sawicki"): Formula("N_DS = 1.174 N + 0.3 (eq. 15)", lambda n: 1.174 * n + 0.3),
    ("sawicki", "blinn-phong"): Formula(
        "N = (N_DS − 0.3)/1.174 (eq. 15)", lambda n: (n - 0.3) / 1.174
    ),
    ("ggx", "gauss"): Formula(
        "m_G = 0.8222 C + 0.82 C³ (Table 3)", lambda c: c * (0.8222 + 0.82 * c * c)
    ),
    ("ggx", "beckmann"): Formula(
        "m_B = 0.8388 C + 0.7 C⁴ (Table 3)", lambda c: c * (0.8388 + 0.7 * c**3)
    ),
    ("ggx", "blinn-phong"): Formula(
        "N = 1.696²/C² − 4.5 (Table 3)", lambda c: 1.696**2 / c**2 - 4.5
    ),
    ("gauss", "ggx"): Formula(
        "C = 1.186 m_G − 0.835 m_G³ (Table 4)",
        lambda m: m * (1.186 - 0.835 * m * m),
        _turning_point(1.186, 0.835),
    ),
    ("beckmann", "ggx"): Formula(
        "C = 1.2 m_B − 0.56 m_B³ (Table 4)",
        lambda m: m * (1.2 - 0.56 * m * m),
        _turning_point(1.2, 0.56),
    ),
    ("blinn-phong", "ggx"): Formula(
        "C = 1.697/√(N+4.5) (Table 4)", lambda n: 1.697 / np.sqrt(n + 4.5)
    ),
}


@lru_cache(maxsize=64)
def _sweep(source: Distribution) -> list[float]:
    """Return the ends of the paper's sweep in the parameter of a distribution."""
    root, _ = to_root(source, same_lobe=False)
    ends = np.array(_SWEEP[root.name])
    return [float(f"{end:.6g}") for end in follow(from_root(source, same_lobe=False), ends)]


class ClosedForm(FormulaMethod):
    """The paper's formulas, fitted by it to Table 2: they keep the shape of the lobe.

    They were fitted for m_B from 0.0044 to 0.4473. The two directions of a pair are not
    exact inverses of each other.
    """

    name = "closed-form"
    source = "Sawicki 2021, eqs (12)-(15), Tables 3 and 4"

    def keeps(self, metric: Metric) -> str:
        """Return that the formulas keep the shape, whatever the metric of the errors."""
        return "shape of the lobe, approximately"

    def cautions(
        self, parameter: Array, result: Array, source: Distribution, target: Distribution
    ) -> dict[str, Mask]:
        """Add to the turning points whether the source is outside the paper's sweep."""
        lower, upper = _sweep(source)
        outside = (
            f"outside the paper's sweep: its formulas were fitted for {source.name} "
            f"{source.parameter.symbol} from {number_text(lower)} to {number_text(upper)}"
        )
        turned = super().cautions(parameter, result, source, target)
        return {outside: (parameter < lower) | (parameter > upper)} | turned


METHOD = ClosedForm(_FORMULAS, through={"sawicki": "blinn-phong"})
